//! What a person says of an export, against what would be inferred: a small TOML file.
//!
//! ```toml
//! encoding = "windows-1251"    # utf-8, utf-16le, windows-1252, gbk, …
//! delimiter = ";"              # one of ; , | tab (as "\t") or a blank
//! decimal = ","                # sign before decimals
//! thousands = "."              # sign between thousands
//! names = ["Time (s)", "Load (N)"]  # names of columns where the file has none
//! names_line = 17              # line of the names of columns
//! units_line = 18              # line of their units; needs names_line
//! sheet = "Specimen 1"         # the only sheet to read
//! pull = "negative"            # sign that the file gives to a pull
//! time = "decimal"             # times are decimals, or "counted": 40.10 follows 40.9
//!
//! [column."Ch:Strain (lbs)"]   # by heading, or by name without the unit
//! quantity = "strain"          # time, extension, gap, force, stress, true_stress, strain, true_strain, cycle, …
//! unit = "mm/mm"               # the true one
//! ignore = false               # true: leave the column out
//!
//! [specimen]                   # what the file should say of the specimen, and does not
//! thickness_mm = 3.0
//! width_mm = 6.0
//! diameter_mm = 5.0
//! area_mm2 = 18.0
//! gauge_length_mm = 33.0
//! ```

use super::ExportError;
use super::quantity::Quantity;
use super::unit::{self, Unit};
use crate::units::unread_toml;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Names are taken for a slip of one another from this similarity on (Jaro–Winkler, 0 to 1).
const ALIKE: f64 = 0.8;

/// Which sign the file gives to a pull.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pull {
    /// A pull is positive.
    Positive,
    /// A pull is negative.
    Negative,
}

/// How times are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeStyle {
    /// 40.10 is 40.1.
    Decimal,
    /// 40.10 comes after 40.9.
    Counted,
}

/// What is said of one column.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColumnOverride {
    /// What it holds.
    pub quantity: Option<Quantity>,
    /// Its unit.
    pub unit: Option<String>,
    /// Leave it out.
    #[serde(default)]
    pub ignore: bool,
}

/// What is said of the specimen (mm, mm²).
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpecimenOverride {
    /// Thickness (mm).
    pub thickness_mm: Option<f64>,
    /// Width (mm).
    pub width_mm: Option<f64>,
    /// Diameter (mm).
    pub diameter_mm: Option<f64>,
    /// Cross-section (mm²).
    pub area_mm2: Option<f64>,
    /// Length between marks or grips (mm).
    pub gauge_length_mm: Option<f64>,
}

/// What is said of an export; all keys may be left out.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Override {
    /// Label of the encoding.
    pub encoding: Option<String>,
    /// What separates fields.
    pub delimiter: Option<char>,
    /// Sign before decimals.
    pub decimal: Option<char>,
    /// Sign between thousands.
    pub thousands: Option<char>,
    /// Names of columns, where the file has none.
    #[serde(default)]
    pub names: Vec<String>,
    /// Line of the names of columns.
    pub names_line: Option<u64>,
    /// Line of their units.
    pub units_line: Option<u64>,
    /// The only sheet to read.
    pub sheet: Option<String>,
    /// Sign of a pull.
    pub pull: Option<Pull>,
    /// How times are written.
    pub time: Option<TimeStyle>,
    /// What is said of columns.
    #[serde(default)]
    pub column: BTreeMap<String, ColumnOverride>,
    /// What is said of the specimen.
    #[serde(default)]
    pub specimen: SpecimenOverride,
}

impl Override {
    /// Reads the file of wishes.
    ///
    /// # Errors
    /// [`ExportError::Read`], [`ExportError::Override`].
    pub fn read(file: &Path) -> Result<Self, ExportError> {
        let text = std::fs::read_to_string(file)
            .map_err(|source| ExportError::Read { file: file.to_owned(), source })?;
        Self::parse(file, &text)
    }

    /// Reads its text; `file` is named in refusals.
    ///
    /// # Errors
    /// [`ExportError::Override`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, ExportError> {
        let refuse =
            |reason: String, nearest| ExportError::Override { file: file.to_owned(), reason, nearest };
        let read: Self = toml::from_str(text)
            .map_err(|error| refuse(unread_toml(text, &error), nearest(error.message())))?;
        for (name, column) in &read.column {
            if let Some(text) = &column.unit
                && unit::parse(text).is_none()
            {
                return Err(refuse(format!("[column.{name:?}]: unit = {text:?} is not known"), None));
            }
        }
        for (key, sign) in [("decimal", read.decimal), ("thousands", read.thousands)] {
            if sign.is_some_and(|s| s != '.' && s != ',') {
                return Err(refuse(
                    format!("{key} is {:?}; \".\" or \",\" is possible", sign.unwrap_or_default()),
                    None,
                ));
            }
        }
        if read.decimal.is_some() && read.decimal == read.thousands {
            return Err(refuse("decimal and thousands are the same sign".to_owned(), None));
        }
        if !read.names.is_empty() && read.names_line.is_some() {
            return Err(refuse("names and names_line: one of them names the columns".to_owned(), None));
        }
        if read.units_line.is_some() && read.names_line.is_none() {
            return Err(refuse("units_line needs names_line".to_owned(), None));
        }
        let s = &read.specimen;
        let sizes = [s.thickness_mm, s.width_mm, s.diameter_mm, s.area_mm2, s.gauge_length_mm];
        if let Some(size) = sizes.iter().flatten().find(|size| !(size.is_finite() && **size > 0.0)) {
            return Err(refuse(format!("[specimen]: {size} is no size"), None));
        }
        Ok(read)
    }

    /// What is said of a column, by its heading or by its name without the unit.
    pub(super) fn of(&self, heading: &str, name: &str) -> Option<&ColumnOverride> {
        self.column.get(heading).or_else(|| self.column.get(name))
    }

    /// The unit said of a column.
    pub(super) fn unit_of(&self, heading: &str, name: &str) -> Option<Unit> {
        unit::parse(self.of(heading, name)?.unit.as_deref()?)
    }
}

/// The known key that is most like the unknown one, from what serde says of both: it puts keys between backticks, the unknown first.
fn nearest(message: &str) -> Option<String> {
    let mut names = message.strip_prefix("unknown ")?.split('`').skip(1).step_by(2);
    let unknown = names.next()?;
    names
        .map(|known| (strsim::jaro_winkler(unknown, known), known))
        .filter(|(alike, _)| *alike >= ALIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, known)| known.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Override, ExportError> {
        Override::parse(Path::new("wishes.toml"), text)
    }

    #[test]
    fn the_documented_file_is_read() {
        let text = "encoding = 'gbk'\ndelimiter = \"\\t\"\ndecimal = ','\nthousands = '.'\nnames_line = 17\nunits_line = 18\n\
            sheet = 'a'\npull = 'negative'\ntime = 'counted'\n[column.'Ch:Strain (lbs)']\nquantity = 'true_strain'\nunit = 'mm/mm'\n\
            [specimen]\nthickness_mm = 3\ngauge_length_mm = 33\n";
        let read = parse(text).expect("sound");
        assert_eq!((read.delimiter, read.pull), (Some('\t'), Some(Pull::Negative)));
        let column = read.of("Ch:Strain (lbs)", "Ch:Strain").expect("there");
        assert_eq!(column.quantity, Some(Quantity::TrueStrain));
        assert_eq!(parse("").expect("empty"), Override::default());
    }

    #[test]
    fn slips_are_refused_with_what_was_meant() {
        for (text, words) in [
            ("decimals = ','", "did you mean decimal?"),
            ("[column.a]\nunits = 'mm'", "did you mean unit?"),
            ("[column.a]\nquantity = 'strian'", "did you mean strain?"),
            ("[column.a]\nunit = 'furlong'", "\"furlong\" is not known"),
            ("decimal = 'x'", "decimal is 'x'"),
            ("decimal = ','\nthousands = ','", "same sign"),
            ("units_line = 3", "needs names_line"),
            ("[specimen]\nwidth_mm = 0", "0 is no size"),
        ] {
            let error = parse(text).expect_err(text).to_string();
            assert!(error.starts_with("wishes.toml") && error.contains(words), "{text:?}: {error}");
        }
    }
}
