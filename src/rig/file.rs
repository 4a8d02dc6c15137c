//! A rig file as a person writes it: which devices, how they are mounted, what must not happen to the phantom.

use super::RigError;
use super::depth_camera::DepthCameraKeys;
use super::reading;
use super::simulation::SimulationKeys;
use crate::device::{Mounting, SensorMounting};
use crate::geometry::Mat3;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The format that this program reads.
pub(super) const FORMAT: &str = "phantom-rig/1";
/// In place of a port, an address or a file: the simulated bench has it.
pub(super) const SIMULATED: &str = "simulated";
/// Marker positions come from the depth camera.
pub(super) const CAMERA: &str = "camera";

/// Longest time from a force to its record, and from a stop to the motors (ms).
const LONGEST_MS: f64 = 1000.0;
/// Thinnest tip (mm).
const THINNEST_MM: f64 = 0.1;
/// How far the length of a direction may be off: three digits are written down.
const UNIT: f64 = 2e-3;

/// The whole file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RigKeys {
    pub(super) format: String,
    pub(super) name: String,
    /// A calibration set of the instruments.
    pub(super) calibration: Option<String>,
    pub(super) stage: StageKeys,
    pub(super) force: ForceKeys,
    pub(super) markers: Option<MarkerKeys>,
    pub(super) camera: Option<DepthCameraKeys>,
    pub(super) tip: TipKeys,
    pub(super) phantom: PhantomKeys,
    pub(super) simulation: Option<SimulationKeys>,
}

#[derive(Debug, Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ControllerWord {
    Native,
    Grbl,
}

/// `[stage]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StageKeys {
    pub(super) controller: ControllerWord,
    pub(super) port: String,
    pub(super) baud: u32,
    /// Letters of the two axes, for Grbl.
    pub(super) axes: Option<[char; 2]>,
    /// How long a motion goes on without a word from this program, for own firmware.
    pub(super) lease_ms: Option<u64>,
    /// Status reports a second while moving, for Grbl.
    pub(super) reports_hz: Option<f64>,
    pub(super) origin_mm: [f64; 3],
    pub(super) directions: [[f64; 3]; 2],
    pub(super) beside_mm: f64,
    pub(super) travel_mm: [[f64; 2]; 2],
    pub(super) most_speed_mm_s: [f64; 2],
    pub(super) most_acceleration_mm_s2: [f64; 2],
    pub(super) travel_speed_mm_s: f64,
    pub(super) approach_speed_mm_s: f64,
    pub(super) acceleration_mm_s2: f64,
    pub(super) stop_deceleration_mm_s2: f64,
    pub(super) clearance_mm: f64,
    pub(super) run_up_mm: f64,
    pub(super) surface_tolerance_mm: f64,
    pub(super) rest_s: f64,
    pub(super) latency_ms: f64,
}

/// `[force]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ForceKeys {
    pub(super) address: String,
    pub(super) to_phantom: [[f64; 3]; 3],
    pub(super) tip_mm: [f64; 3],
    pub(super) reads_reaction: bool,
    pub(super) limit_n: [f64; 3],
    pub(super) limit_nm: f64,
    pub(super) range_n: [f64; 3],
    pub(super) range_nm: [f64; 3],
    pub(super) rate_hz: f64,
    pub(super) buffered: Option<bool>,
    pub(super) silence_ms: u64,
    pub(super) gap_records: u32,
    pub(super) frozen_records: u32,
    pub(super) latency_ms: f64,
}

/// `[markers]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MarkerKeys {
    pub(super) source: String,
}

#[derive(Debug, Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ShapeWord {
    Pad,
    Flat,
}

#[derive(Debug, Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ContactWord {
    Bonded,
    Unilateral,
}

/// `[tip]`
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TipKeys {
    pub(super) shape: ShapeWord,
    pub(super) contact: ContactWord,
    pub(super) radius_mm: f64,
}

/// `[phantom]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PhantomKeys {
    pub(super) mesh: String,
    pub(super) low_mm: [f64; 3],
    pub(super) high_mm: [f64; 3],
    pub(super) poisson_ratio: f64,
    pub(super) density_kg_m3: f64,
    pub(super) modulus_range_kpa: [f64; 2],
}

impl RigKeys {
    /// Reads and checks a file.
    pub(super) fn read(file: &Path) -> Result<(Self, String), RigError> {
        let text = std::fs::read_to_string(file)
            .map_err(|source| RigError::Read { file: file.to_owned(), source })?;
        let keys: Self = reading::read(file, &text)?;
        keys.check(file)?;
        Ok((keys, text))
    }

    fn check(&self, file: &Path) -> Result<(), RigError> {
        let wrong = |key: &'static str, found: String, expected: &'static str| {
            Err(RigError::Value { file: file.to_owned(), key, found, expected })
        };
        if self.format != FORMAT {
            return wrong("format", self.format.clone(), FORMAT);
        }
        let positive = [
            ("stage.travel_speed_mm_s", self.stage.travel_speed_mm_s),
            ("stage.approach_speed_mm_s", self.stage.approach_speed_mm_s),
            ("stage.stop_deceleration_mm_s2", self.stage.stop_deceleration_mm_s2),
            ("stage.run_up_mm", self.stage.run_up_mm),
            ("stage.surface_tolerance_mm", self.stage.surface_tolerance_mm),
            ("force.limit_nm", self.force.limit_nm),
            ("force.rate_hz", self.force.rate_hz),
            ("stage.acceleration_mm_s2", self.stage.acceleration_mm_s2),
            ("stage.clearance_mm", self.stage.clearance_mm),
            ("stage.beside_mm", self.stage.beside_mm),
            ("tip.radius_mm", self.tip.radius_mm),
            ("phantom.density_kg_m3", self.phantom.density_kg_m3),
            ("phantom.modulus_range_kpa", self.phantom.modulus_range_kpa[0]),
        ];
        let limits = self.force.limit_n.iter().map(|&x| ("force.limit_n", x));
        let ranges = self.force.range_n.iter().map(|&x| ("force.range_n", x));
        let torques = self.force.range_nm.iter().map(|&x| ("force.range_nm", x));
        for (key, value) in positive.into_iter().chain(limits).chain(ranges).chain(torques) {
            if !(value > 0.0 && value.is_finite()) {
                return wrong(key, value.to_string(), "a number above 0");
            }
        }
        let lasting = [
            ("force.latency_ms", self.force.latency_ms, LONGEST_MS, "0 to 1000"),
            ("stage.latency_ms", self.stage.latency_ms, LONGEST_MS, "0 to 1000"),
            ("stage.rest_s", self.stage.rest_s, f64::MAX, "0 or more"),
        ];
        for (key, value, most, expected) in lasting {
            if !(0.0..=most).contains(&value) {
                return wrong(key, value.to_string(), expected);
            }
        }
        if !(1..=10_000).contains(&self.force.silence_ms) {
            return wrong("force.silence_ms", self.force.silence_ms.to_string(), "1 to 10000");
        }
        // A wrong unit: a tip of 8 mm is neither 0.008 nor 8000.
        let widest = (0..3).map(|a| self.phantom.high_mm[a] - self.phantom.low_mm[a]).fold(0.0, f64::max);
        if !(THINNEST_MM..=0.5 * widest).contains(&self.tip.radius_mm) {
            let expected = "millimetres: 0.1 to half of the phantom's longest edge";
            return wrong("tip.radius_mm", self.tip.radius_mm.to_string(), expected);
        }
        let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if self.stage.directions.iter().any(|direction| (length(direction) - 1.0).abs() > UNIT) {
            return wrong("stage.directions", format!("{:?}", self.stage.directions), "vectors of length 1");
        }
        if let Some([low, high]) = self
            .stage
            .travel_mm
            .iter()
            .find(|[low, high]| !matches!(low.partial_cmp(high), Some(std::cmp::Ordering::Less)))
        {
            return wrong("stage.travel_mm", format!("{low} to {high}"), "the lower end first");
        }
        let ratio = self.phantom.poisson_ratio;
        if !(0.0..0.5).contains(&ratio) {
            return wrong("phantom.poisson_ratio", ratio.to_string(), "at least 0 and less than 0.5");
        }
        let [low, high] = self.phantom.modulus_range_kpa;
        if !(low < high && high.is_finite()) {
            return wrong("phantom.modulus_range_kpa", format!("{low} to {high}"), "the lower bound first");
        }
        if (0..3).any(|a| self.phantom.low_mm[a] >= self.phantom.high_mm[a]) {
            let found = format!("{:?} to {:?}", self.phantom.low_mm, self.phantom.high_mm);
            return wrong("phantom.low_mm", found, "below phantom.high_mm along each axis");
        }
        if let Some(lease) = self.stage.lease_ms.filter(|lease| !(20..=1000).contains(lease)) {
            return wrong("stage.lease_ms", lease.to_string(), "20 to 1000");
        }
        if self.stage.controller == ControllerWord::Grbl && self.stage.axes.is_none() {
            return wrong("stage.axes", "nothing".to_owned(), "the letters of two axes, for Grbl");
        }
        self.mounting(file)?;
        if !self.sensor().is_rotation() {
            let found = format!("{:?}", self.force.to_phantom);
            return wrong(
                "force.to_phantom",
                found,
                "a rotation: rows of unit length at right angles, right-handed",
            );
        }
        let source = self.markers.as_ref().map(|m| m.source.as_str());
        match (source, &self.camera) {
            (None | Some(SIMULATED), None) | (Some(CAMERA), Some(_)) => {}
            (Some(CAMERA), None) => {
                return wrong("markers.source", CAMERA.to_owned(), "a section [camera] beside it");
            }
            (None | Some(SIMULATED), Some(_)) => {
                return wrong("camera", "there".to_owned(), "[markers] with source = \"camera\" beside it");
            }
            (Some(other), _) => {
                return wrong(
                    "markers.source",
                    other.to_owned(),
                    "\"camera\", or \"simulated\" for exact positions",
                );
            }
        }
        if let Some(camera) = &self.camera {
            let positive = [
                ("camera.rate_hz", camera.rate_hz),
                ("camera.depth_unit_mm", camera.depth_unit_mm),
                ("camera.fiducial_sd_mm", camera.fiducial_sd_mm),
            ];
            if let Some((key, value)) = positive.into_iter().find(|(_, v)| !(*v > 0.0 && v.is_finite())) {
                return wrong(key, value.to_string(), "a number above 0");
            }
            if camera.is_simulated() && self.simulation.as_ref().is_none_or(|s| s.camera().is_none()) {
                return wrong(
                    "camera.source",
                    SIMULATED.to_owned(),
                    "a real one, or a section [simulation.camera]",
                );
            }
            camera.lens(file)?;
            camera.registration(file)?;
        }
        let simulated = [
            ("stage.port", self.stage.port.as_str()),
            ("force.address", &self.force.address),
            ("phantom.mesh", &self.phantom.mesh),
        ];
        let source = self.markers.as_ref().map(|m| ("markers.source", m.source.as_str()));
        let mut simulated = simulated.into_iter().chain(source);
        if let (Some((key, _)), None) = (simulated.find(|(_, value)| *value == SIMULATED), &self.simulation) {
            return wrong(key, SIMULATED.to_owned(), "a real one, or a section [simulation] in the file");
        }
        Ok(())
    }

    /// How the stage carries the tip.
    pub(super) fn mounting(&self, file: &Path) -> Result<Mounting, RigError> {
        let stage = &self.stage;
        Mounting::new(stage.origin_mm.map(|x| x * 1e-3), stage.directions, stage.beside_mm * 1e-3).ok_or_else(
            || RigError::Value {
                file: file.to_owned(),
                key: "stage.directions",
                found: format!("{:?}", stage.directions),
                expected: "two directions at least 30 degrees apart",
            },
        )
    }

    /// How the sensor lies.
    pub(super) fn sensor(&self) -> SensorMounting {
        SensorMounting {
            to_phantom: Mat3::from_fn(|i, j| self.force.to_phantom[i][j]),
            tip_m: self.force.tip_mm.map(|x| x * 1e-3).into(),
            reads_reaction: self.force.reads_reaction,
        }
    }

    /// The mesh file, beside the rig file; none for that of the simulated bench.
    pub(super) fn mesh(&self, file: &Path) -> Option<PathBuf> {
        (self.phantom.mesh != SIMULATED)
            .then(|| file.parent().unwrap_or_else(|| Path::new(".")).join(&self.phantom.mesh))
    }
}
