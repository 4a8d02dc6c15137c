//! `recording.toml` → what the operator states about phantom, tip and noise, checked. SI units.

use super::DatasetError;
use super::text::{is_utf16, line_of, without_bom};
use crate::geometry::Vec3;
use crate::observation::{Contact, Gravity, Noise, Phantom, Tip, TipShape};
use crate::units::unread_words;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The format that this program reads and writes.
pub(super) const FORMAT: &str = "phantom-recording/1";

/// A marker may stand off the observed surface this far (m) when the manifest does not say.
pub(super) const DEFAULT_STANDOFF_M: f64 = 0.010;

/// The manifest as it stands in the file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    pub(super) format: String,
    pub(super) name: String,
    pub(super) rest_until_s: f64,
    pub(super) phantom: PhantomKeys,
    pub(super) tip: TipKeys,
    pub(super) noise: NoiseKeys,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) markers: Option<MarkerKeys>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PhantomKeys {
    pub(super) poisson_ratio: f64,
    pub(super) density_kg_m3: f64,
    pub(super) modulus_range_pa: [f64; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) gravity_m_s2: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) gravity_at_rest: Option<bool>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TipKeys {
    pub(super) contact: ContactWord,
    pub(super) shape: ShapeWord,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) sphere_radius_m: Option<f64>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ContactWord {
    Bonded,
    Unilateral,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ShapeWord {
    Pad,
    Flat,
    Sphere,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NoiseKeys {
    pub(super) force_n: [f64; 3],
    pub(super) torque_nm: [f64; 3],
    pub(super) marker_m: [f64; 3],
    pub(super) stage_m: [f64; 3],
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MarkerKeys {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) max_standoff_m: Option<f64>,
}

/// The manifest with every value checked.
pub(super) struct Stated {
    pub(super) name: String,
    pub(super) rest_until_s: f64,
    pub(super) phantom: Phantom,
    pub(super) tip: Tip,
    pub(super) noise: Noise,
    pub(super) max_standoff_m: f64,
}

/// Reads and checks `recording.toml`.
pub(super) fn read_manifest(file: &Path) -> Result<Stated, DatasetError> {
    let bytes = std::fs::read(file).map_err(|source| DatasetError::Read { file: file.to_owned(), source })?;
    check(file, parse(file, &bytes)?)
}

/// The format is looked at before the keys: another version has other keys, and must not be called misspelt.
fn parse(file: &Path, bytes: &[u8]) -> Result<Manifest, DatasetError> {
    if is_utf16(bytes) {
        return Err(DatasetError::Utf16 { file: file.to_owned() });
    }
    let bytes = without_bom(bytes);
    let text = std::str::from_utf8(bytes)
        .map_err(|e| DatasetError::NotUtf8 { file: file.to_owned(), row: line_of(bytes, e.valid_up_to()) })?;
    let row = |e: &toml::de::Error| e.span().map_or(1, |s| line_of(bytes, s.start));
    let table: toml::Table = toml::from_str(text).map_err(|e| DatasetError::NotToml {
        file: file.to_owned(),
        row: row(&e),
        message: e.message().to_owned(),
    })?;
    if table.get("format").and_then(toml::Value::as_str) != Some(FORMAT) {
        return Err(DatasetError::UnknownFormat {
            file: file.to_owned(),
            found: table.get("format").map_or_else(|| "(absent)".to_owned(), ToString::to_string),
            expected: FORMAT,
        });
    }
    toml::from_str(text).map_err(|e| DatasetError::ManifestKey {
        file: file.to_owned(),
        row: row(&e),
        message: unread_words(&e),
    })
}

fn check(file: &Path, manifest: Manifest) -> Result<Stated, DatasetError> {
    let Manifest { format: _, name, rest_until_s, phantom, tip, noise, markers } = manifest;
    let require = |good: bool, key: &'static str, value: String, expected: &'static str| {
        if good {
            Ok(())
        } else {
            Err(DatasetError::ManifestValue { file: file.to_owned(), key, value, expected })
        }
    };
    let positive = |x: f64| x > 0.0 && x.is_finite();
    require(rest_until_s.is_finite(), "rest_until_s", rest_until_s.to_string(), "a finite time (s)")?;
    let nu = phantom.poisson_ratio;
    require(
        nu > -1.0 && nu < 0.5,
        "phantom.poisson_ratio",
        nu.to_string(),
        "more than -1 and less than 0.5",
    )?;
    let density = phantom.density_kg_m3;
    require(positive(density), "phantom.density_kg_m3", density.to_string(), "a positive number (kg/m³)")?;
    let [low, high] = phantom.modulus_range_pa;
    require(
        positive(low) && positive(high) && low < high,
        "phantom.modulus_range_pa",
        format!("{:?}", phantom.modulus_range_pa),
        "two positive numbers (Pa), the lower first",
    )?;
    for (key, sigma) in [
        ("noise.force_n", noise.force_n),
        ("noise.torque_nm", noise.torque_nm),
        ("noise.marker_m", noise.marker_m),
        ("noise.stage_m", noise.stage_m),
    ] {
        // A channel without noise would have infinite weight.
        require(sigma.into_iter().all(positive), key, format!("{sigma:?}"), "three positive numbers")?;
    }
    let gravity = match (phantom.gravity_m_s2, phantom.gravity_at_rest) {
        (None, None) => None,
        (Some(g), at_rest) => {
            require(
                g.iter().all(|x| x.is_finite()),
                "phantom.gravity_m_s2",
                format!("{g:?}"),
                "three finite numbers (m/s²)",
            )?;
            let at_rest = at_rest.ok_or_else(|| DatasetError::ManifestValue {
                file: file.to_owned(),
                key: "phantom.gravity_at_rest",
                value: "(absent)".to_owned(),
                expected: "true or false, whenever gravity_m_s2 is given",
            })?;
            Some(Gravity { acceleration_m_s2: Vec3::from(g), at_rest })
        }
        (None, Some(at_rest)) => {
            return Err(DatasetError::ManifestValue {
                file: file.to_owned(),
                key: "phantom.gravity_at_rest",
                value: at_rest.to_string(),
                expected: "gravity_m_s2 beside it",
            });
        }
    };
    let shape = match (tip.shape, tip.sphere_radius_m) {
        (ShapeWord::Pad, None) => TipShape::Pad,
        (ShapeWord::Flat, None) => TipShape::Flat,
        (ShapeWord::Sphere, Some(radius_m)) => {
            require(
                positive(radius_m),
                "tip.sphere_radius_m",
                radius_m.to_string(),
                "a positive number (m)",
            )?;
            TipShape::Sphere { radius_m }
        }
        (ShapeWord::Sphere, None) => {
            return Err(DatasetError::ManifestValue {
                file: file.to_owned(),
                key: "tip.sphere_radius_m",
                value: "(absent)".to_owned(),
                expected: "the sphere's radius (m), whenever shape = \"sphere\"",
            });
        }
        (_, Some(radius_m)) => {
            return Err(DatasetError::ManifestValue {
                file: file.to_owned(),
                key: "tip.sphere_radius_m",
                value: radius_m.to_string(),
                expected: "no such key unless shape = \"sphere\"",
            });
        }
    };
    let contact = match tip.contact {
        ContactWord::Bonded => Contact::Bonded,
        ContactWord::Unilateral => Contact::Unilateral,
    };
    let max_standoff_m = markers.and_then(|m| m.max_standoff_m).unwrap_or(DEFAULT_STANDOFF_M);
    require(
        positive(max_standoff_m),
        "markers.max_standoff_m",
        max_standoff_m.to_string(),
        "a positive number (m)",
    )?;
    Ok(Stated {
        name,
        rest_until_s,
        phantom: Phantom {
            poisson_ratio: nu,
            density_kg_m3: density,
            modulus_range_pa: phantom.modulus_range_pa,
            gravity,
        },
        tip: Tip { contact, shape },
        noise: Noise {
            force_n: noise.force_n,
            torque_nm: noise.torque_nm,
            marker_m: noise.marker_m,
            stage_m: noise.stage_m,
        },
        max_standoff_m,
    })
}
