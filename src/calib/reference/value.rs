//! A reference value as a file: TOML in `calibration/values`, which people read and `calibrate` writes.
//!
//! ```toml
//! format = "phantom-reference/1"
//! name = "…"                                  # of the value
//! young_modulus_pa = { value = …, sd = …, interval_90 = [ …, … ] }   # or another quantity, one a file
//! date = "2026-11-24"                         # of the measurement
//! source = "…"                                # who measured, where it is written
//! specimen = "…"
//! machine = "…"
//! method = "…"
//!
//! [validity]                                  # within what it was measured; each key may be left out
//! strain = [0.0, 0.1]
//!
//! [[raw]]                                     # files that it was computed from
//! file = "…"
//! sha256 = "…"
//! ```

use super::{Figure, ReferenceError, ReferenceQuantity};
use crate::calib::Day;
use crate::units::unread_toml;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a file begins with.
const FORMAT: &str = "phantom-reference/1";

/// Digits of a SHA-256 in hexadecimal.
const SHA256_DIGITS: usize = 64;

/// A value that was found without the rig, and everything that is needed to trust it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceValue {
    /// Its name, for people.
    pub name: String,
    /// Of which quantity.
    pub quantity: ReferenceQuantity,
    /// The value in SI, and how surely it is known.
    pub figure: Figure,
    /// When it was measured.
    pub date: Day,
    /// Who measured, or where it is published.
    pub source: String,
    /// What was measured: material, batch, how many pieces.
    pub specimen: String,
    /// With which machine, load cell and strain source.
    pub machine: String,
    /// How the value follows from the raw files: model, window, what the uncertainty carries.
    pub method: String,
    /// Within what it was measured.
    pub validity: Validity,
    /// The files that it was computed from.
    pub raw: Vec<RawFile>,
}

/// Ranges in which a value was measured: lowest and highest. None where the range does not matter or is not known.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Validity {
    /// Strain (m/m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strain: Option<[f64; 2]>,
    /// Strain rate (1/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_per_s: Option<[f64; 2]>,
    /// Pull on a band at rest (N).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pretension_n: Option<[f64; 2]>,
    /// Lengthening of a band (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extension_m: Option<[f64; 2]>,
    /// Time since the load changed (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<[f64; 2]>,
    /// Temperature (°C).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<[f64; 2]>,
}

impl Validity {
    fn ranges(&self) -> [(&'static str, Option<[f64; 2]>); 6] {
        [
            ("validity.strain", self.strain),
            ("validity.rate_per_s", self.rate_per_s),
            ("validity.pretension_n", self.pretension_n),
            ("validity.extension_m", self.extension_m),
            ("validity.time_s", self.time_s),
            ("validity.temperature_c", self.temperature_c),
        ]
    }

    /// The ranges that are given, by their keys.
    pub fn given(&self) -> impl Iterator<Item = (&'static str, [f64; 2])> {
        let named =
            |(key, range): (&'static str, Option<[f64; 2]>)| Some((&key["validity.".len()..], range?));
        self.ranges().into_iter().filter_map(named)
    }
}

/// A file that a value was computed from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawFile {
    /// Its name, or its path from the value's file.
    pub file: String,
    /// SHA-256 of its bytes, in hexadecimal digits.
    pub sha256: String,
}

/// The file's keys.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    format: String,
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    young_modulus_pa: Option<Figure>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stiffness_n_per_m: Option<Figure>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    relaxed_fraction: Option<Figure>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    time_constant_s: Option<Figure>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    slack_m: Option<Figure>,
    date: Day,
    source: String,
    specimen: String,
    machine: String,
    method: String,
    #[serde(default)]
    validity: Validity,
    #[serde(default)]
    raw: Vec<RawFile>,
}

impl ReferenceValue {
    /// Its text.
    ///
    /// # Errors
    /// [`ReferenceError`]: a value that [`ReferenceValue::parse`] would refuse.
    pub fn text(&self) -> Result<String, ReferenceError> {
        self.check(Path::new(&self.name))?;
        let figure = |quantity| (self.quantity == quantity).then_some(self.figure);
        let keys = Keys {
            format: FORMAT.to_owned(),
            name: self.name.clone(),
            young_modulus_pa: figure(ReferenceQuantity::YoungModulus),
            stiffness_n_per_m: figure(ReferenceQuantity::Stiffness),
            relaxed_fraction: figure(ReferenceQuantity::RelaxedFraction),
            time_constant_s: figure(ReferenceQuantity::TimeConstant),
            slack_m: figure(ReferenceQuantity::Slack),
            date: self.date,
            source: self.source.clone(),
            specimen: self.specimen.clone(),
            machine: self.machine.clone(),
            method: self.method.clone(),
            validity: self.validity,
            raw: self.raw.clone(),
        };
        toml::to_string(&keys).map_err(|error| ReferenceError::Write { why: error.to_string() })
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`ReferenceError`] with file and key.
    pub fn read(file: &Path) -> Result<Self, ReferenceError> {
        let text = std::fs::read_to_string(file)
            .map_err(|source| ReferenceError::Read { file: file.to_owned(), source })?;
        Self::parse(file, &text)
    }

    /// Reads and checks a text; `file` is for messages.
    ///
    /// # Errors
    /// As [`ReferenceValue::read`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, ReferenceError> {
        let keys: Keys = toml::from_str(text).map_err(|error| ReferenceError::Refused {
            file: file.to_owned(),
            why: unread_toml(text, &error),
        })?;
        if keys.format != FORMAT {
            return Err(ReferenceError::Value {
                file: file.to_owned(),
                key: "format".to_owned(),
                found: format!("{:?}", keys.format),
                expected: FORMAT,
            });
        }
        let figures = [
            (ReferenceQuantity::YoungModulus, keys.young_modulus_pa),
            (ReferenceQuantity::Stiffness, keys.stiffness_n_per_m),
            (ReferenceQuantity::RelaxedFraction, keys.relaxed_fraction),
            (ReferenceQuantity::TimeConstant, keys.time_constant_s),
            (ReferenceQuantity::Slack, keys.slack_m),
        ];
        let given: Vec<_> =
            figures.into_iter().filter_map(|(quantity, figure)| Some((quantity, figure?))).collect();
        let [(quantity, figure)] = given[..] else {
            let found = given.iter().map(|(quantity, _)| *quantity).collect();
            return Err(ReferenceError::NotOne { file: file.to_owned(), found });
        };
        let value = Self {
            name: keys.name,
            quantity,
            figure,
            date: keys.date,
            source: keys.source,
            specimen: keys.specimen,
            machine: keys.machine,
            method: keys.method,
            validity: keys.validity,
            raw: keys.raw,
        };
        value.check(file)?;
        Ok(value)
    }

    fn check(&self, file: &Path) -> Result<(), ReferenceError> {
        let wrong = |key: &str, found: String, expected: &'static str| {
            Err(ReferenceError::Value { file: file.to_owned(), key: key.to_owned(), found, expected })
        };
        let key = self.quantity.key();
        let Figure { value, sd, interval_90 } = self.figure;
        if !value.is_finite() || (self.quantity.must_be_positive() && value <= 0.0) {
            return wrong(&format!("{key}.value"), value.to_string(), "a number above 0");
        }
        if !(sd.is_finite() && sd > 0.0) {
            return wrong(&format!("{key}.sd"), sd.to_string(), "a number above 0: nothing is known exactly");
        }
        if let Some([low, high]) = interval_90
            && !(low.is_finite() && high.is_finite() && low <= value && value <= high && low < high)
        {
            let expected = "the lower end first, the value between both";
            return wrong(&format!("{key}.interval_90"), format!("[{low}, {high}]"), expected);
        }
        for (key, text) in [("name", &self.name), ("source", &self.source), ("method", &self.method)] {
            if text.trim().is_empty() {
                return wrong(key, format!("{text:?}"), "words: a value of unknown origin is no reference");
            }
        }
        for (key, range) in self.validity.ranges() {
            if let Some([low, high]) = range
                && !(low.is_finite() && high.is_finite() && low <= high)
            {
                return wrong(key, format!("[{low}, {high}]"), "two numbers, the lower one first");
            }
        }
        for raw in &self.raw {
            let digits = raw.sha256.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
            if !digits || raw.sha256.len() != SHA256_DIGITS {
                let expected = "the 64 hexadecimal digits of a SHA-256, in small letters";
                return wrong("raw.sha256", format!("{:?}", raw.sha256), expected);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value() -> ReferenceValue {
        ReferenceValue {
            name: "gel A, batch 3".to_owned(),
            quantity: ReferenceQuantity::YoungModulus,
            figure: Figure { value: 10_150.0, sd: 130.0, interval_90: Some([9_940.0, 10_370.0]) },
            date: Day::parse("2026-11-02").expect("a day"),
            source: "made up for this test".to_owned(),
            specimen: "5 dumb-bells".to_owned(),
            machine: "10 N cell".to_owned(),
            method: "neo-Hookean, median".to_owned(),
            validity: Validity { strain: Some([0.01, 0.1]), ..Validity::default() },
            raw: vec![RawFile { file: "a.csv".to_owned(), sha256: "0f".repeat(32) }],
        }
    }

    #[test]
    fn a_value_comes_back_from_its_file() {
        let text = value().text().expect("sound");
        assert_eq!(ReferenceValue::parse(Path::new("a.toml"), &text).expect("sound"), value());
        assert!(text.starts_with("format = \"phantom-reference/1\""), "{text}");
        assert!(text.contains("young_modulus_pa") && text.contains("2026-11-02"), "{text}");
        assert_eq!(value().validity.given().collect::<Vec<_>>(), [("strain", [0.01, 0.1])]);
        for quantity in ReferenceQuantity::ALL {
            let other = ReferenceValue { quantity, ..value() };
            let text = other.text().expect("sound");
            assert_eq!(ReferenceValue::parse(Path::new("a.toml"), &text).expect("sound"), other);
        }
    }

    #[test]
    fn a_file_that_is_none_is_refused() {
        let text = value().text().expect("sound");
        for (from, to, words) in [
            ("phantom-reference/1", "phantom-reference/2", "expected phantom-reference/1"),
            ("method = ", "methods = ", "methods is not known; expected one of"),
            ("date = \"2026-11-02\"", "", "date is missing"),
            ("2026-11-02", "2026-02-30", "is no day"),
            ("10150.0", "-10150.0", "young_modulus_pa.value is -10150"),
            ("10150.0", "nan", "young_modulus_pa.value is NaN"),
            ("130.0", "0.0", "nothing is known exactly"),
            ("9940.0", "10200.0", "interval_90"),
            ("[young_modulus_pa]", "[young_modulus_kpa]", "young_modulus_kpa is not known"),
            (
                "[young_modulus_pa]",
                "[slack_m]\nvalue = 1.0\nsd = 1.0\n[young_modulus_pa]",
                "slack_m; expected one of",
            ),
            ("made up for this test", " ", "unknown origin"),
            ("0f0f", "0F0F", "raw.sha256"),
            ("strain = [0.01, 0.1]", "strain = [0.2, 0.1]", "validity.strain"),
        ] {
            assert!(text.contains(from), "{from}: {text}");
            let error = ReferenceValue::parse(Path::new("a.toml"), &text.replacen(from, to, 1));
            let error = error.expect_err(words).to_string();
            assert!(error.contains(words) && error.starts_with("a.toml: "), "{words}: {error}");
        }
    }
}
