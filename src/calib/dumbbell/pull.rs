//! One specimen's pull, from a table.

use super::DumbbellError;
use crate::calib::export::{Loading, Quantity, StrainSource, Table};
use crate::calib::slip::slip;
use std::path::PathBuf;

/// A pull. Lists are of one length.
#[derive(Debug, Clone, PartialEq)]
pub struct Pull {
    /// File and specimen.
    pub label: String,
    /// Where it was read.
    pub file: PathBuf,
    /// Field of a line that the stress was read from, from 1.
    pub column: usize,
    /// Strain (1).
    pub strain: Vec<f64>,
    /// Engineering stress (Pa).
    pub stress: Vec<f64>,
    /// Line of the file.
    pub lines: Vec<u64>,
    /// Where the strain was measured; none where the file does not say.
    pub source: Option<StrainSource>,
    /// Width (m), if it is known.
    pub width_m: Option<f64>,
    /// Thickness (m), if it is known.
    pub thickness_m: Option<f64>,
    /// First cross-section (m²).
    pub area_m2: Option<f64>,
    /// First length (m).
    pub gauge_length_m: Option<f64>,
    /// Mean rate of strain (1/s), if times are known.
    pub rate_per_s: Option<f64>,
    /// Mean temperature (°C), if it is known.
    pub temperature_c: Option<f64>,
}

impl Pull {
    /// From a table with stress and strain, or with force and extension and the sizes of the specimen.
    ///
    /// # Errors
    /// [`DumbbellError`]: columns or sizes that are missing, another way of loading.
    pub fn from_table(table: &Table) -> Result<Self, DumbbellError> {
        let place = table.place.to_string();
        match table.loading {
            Some(Loading::Flexure) => return Err(DumbbellError::NotPulled { place, how: "bent" }),
            Some(Loading::Compression) => return Err(DumbbellError::NotPulled { place, how: "pressed" }),
            _ => {}
        }
        let has = |q| table.all(q).next().is_some();
        let size = |value: Option<f64>, what, key| match value {
            Some(size) if size > 0.0 => Ok(size),
            Some(found) => Err(DumbbellError::Size { place: place.clone(), what, found, key }),
            None => Err(DumbbellError::NoSize { place: place.clone(), what, key }),
        };
        let strains = has(Quantity::Strain);
        let stresses = has(Quantity::Stress);
        let x = if strains { Quantity::Strain } else { Quantity::Extension };
        let y = if stresses { Quantity::Stress } else { Quantity::Force };
        let series = table.series(&[x, y])?;
        let length = if strains {
            1.0
        } else {
            size(table.specimen.gauge_length_m, "gauge length", "gauge_length_mm")?
        };
        let area = if stresses {
            1.0
        } else {
            size(table.specimen.area_m2(), "cross-section", "thickness_mm and width_mm")?
        };
        // An extension counts from where the grips began.
        let start = if strains { 0.0 } else { series.values[0].first().copied().unwrap_or(0.0) };
        let strain: Vec<f64> = series.values[0].iter().map(|v| (v - start) / length).collect();
        let stress: Vec<f64> = series.values[1].iter().map(|v| v / area).collect();
        if -least(&stress) > greatest(&stress) {
            return Err(DumbbellError::NotPulled { place, how: "pressed" });
        }
        let time = table.series(&[Quantity::Time, x]).ok().map(|s| s.values[0].clone());
        let top = strain.iter().position(|s| *s >= greatest(&strain)).unwrap_or(0);
        let rate = time.filter(|t| t.len() == strain.len() && top > 0 && t[top] > t[0]);
        let temperature = table.column(Quantity::Temperature).ok().and_then(|c| c.si());
        let stem = table.place.origin.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self {
            file: table.place.origin.file.clone(),
            column: table.column(y)?.place.column,
            label: if table.label.is_empty() { stem } else { format!("{stem} {}", table.label) },
            rate_per_s: rate.map(|t| (strain[top] - strain[0]) / (t[top] - t[0])),
            strain,
            stress,
            lines: series.lines,
            source: table.column(x)?.source,
            width_m: table.specimen.width_m,
            thickness_m: table.specimen.thickness_m,
            area_m2: table.specimen.area_m2(),
            gauge_length_m: table.specimen.gauge_length_m,
            temperature_c: temperature.map(|t| t.iter().sum::<f64>() / t.len() as f64 - 273.15),
        })
    }

    /// Rows of the first pull inside the window.
    pub(super) fn window(&self, low: f64, high: f64) -> Vec<usize> {
        let top = self.strain.iter().position(|s| *s >= greatest(&self.strain)).unwrap_or(0);
        (0..=top.min(self.strain.len().saturating_sub(1)))
            .filter(|r| (low..=high).contains(&self.strain[*r]))
            .collect()
    }

    /// Refuses a slip between two rows of the window.
    pub(super) fn refuse_slip(&self, rows: &[usize]) -> Result<(), DumbbellError> {
        let stress: Vec<f64> = rows.iter().map(|r| self.stress[*r]).collect();
        let Some(at) = slip(&stress) else { return Ok(()) };
        Err(DumbbellError::Slipped {
            file: self.file.clone(),
            line: self.lines[rows[at]],
            column: self.column,
            before: stress[at - 1],
            after: stress[at],
            strain: self.strain[rows[at]],
        })
    }
}

fn greatest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}
