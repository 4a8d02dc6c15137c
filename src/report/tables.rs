//! The fit as plain tables, for people who plot for themselves: forces against time, markers at the deepest
//! instant of each poke. Every column carries its unit (SI); a residual is measured less modelled.

use super::ReportError;
use crate::inverse::Fit;
use std::path::Path;

const FORCE_COLUMNS: [&str; 12] = [
    "poke",
    "t_s",
    "depth_m",
    "measured_fx_n",
    "measured_fy_n",
    "measured_fz_n",
    "model_fx_n",
    "model_fy_n",
    "model_fz_n",
    "residual_fx_n",
    "residual_fy_n",
    "residual_fz_n",
];

const MARKER_COLUMNS: [&str; 15] = [
    "poke",
    "t_s",
    "marker",
    "rest_x_m",
    "rest_y_m",
    "rest_z_m",
    "measured_ux_m",
    "measured_uy_m",
    "measured_uz_m",
    "model_ux_m",
    "model_uy_m",
    "model_uz_m",
    "residual_ux_m",
    "residual_uy_m",
    "residual_uz_m",
];

/// Writes `forces.csv`: one row a sample inside a poke.
pub(super) fn write_forces(path: &Path, fit: &Fit) -> Result<(), ReportError> {
    let rows = fit.pokes.iter().flat_map(|poke| {
        poke.samples.iter().map(|s| {
            let residual = [0, 1, 2].map(|i| s.measured_n[i] - s.modelled_n[i]);
            let numbers = [s.measured_n, s.modelled_n, residual].concat();
            row(&[poke.number.to_string(), s.time_s.to_string(), s.depth_m.to_string()], &numbers)
        })
    });
    write(path, &FORCE_COLUMNS, rows)
}

/// Writes `residuals.csv`: one row a marker seen at the deepest instant of a poke.
pub(super) fn write_residuals(path: &Path, fit: &Fit) -> Result<(), ReportError> {
    let rows = fit.pokes.iter().flat_map(|poke| {
        poke.markers.iter().map(|m| {
            let vectors = [m.rest_m, m.measured_m, m.modelled_m, m.measured_m - m.modelled_m];
            let numbers: Vec<f64> = vectors.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
            row(&[poke.number.to_string(), poke.deepest_s.to_string(), m.number.to_string()], &numbers)
        })
    });
    write(path, &MARKER_COLUMNS, rows)
}

fn row(labels: &[String; 3], numbers: &[f64]) -> Vec<String> {
    labels.iter().cloned().chain(numbers.iter().map(f64::to_string)).collect()
}

fn write(path: &Path, columns: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Result<(), ReportError> {
    let table = |source| ReportError::Table { path: path.to_owned(), source };
    let mut writer = csv::Writer::from_path(path).map_err(table)?;
    writer.write_record(columns).map_err(table)?;
    for row in rows {
        writer.write_record(row).map_err(table)?;
    }
    writer.flush().map_err(|source| ReportError::Write { path: path.to_owned(), source })
}
