//! The next poke as `next-poke.csv`: one row of a recording's `pokes.csv` with how the stage is to move besides.
//!
//! Its times follow the last poke of the recording by the longest pause between pokes so far, and at least a second, so
//! that what relaxes has had as long as before. Readers of `pokes.csv` ignore the columns added: depth (m), rate of
//! approach and retreat (m/s) and time held (s).

use crate::diagnose::NextPoke;
use crate::observation::Recording;
use crate::report::ReportError;
use std::path::Path;

const COLUMNS: [&str; 13] = [
    "poke", "site_x_m", "site_y_m", "site_z_m", "dir_x", "dir_y", "dir_z", "radius_m", "start_s", "end_s",
    "depth_m", "rate_m_s", "hold_s",
];

/// The least pause before it (s).
const PAUSE_S: f64 = 1.0;

/// The row; its radius is that of the recording's tip.
fn row(poke: &NextPoke, recording: &Recording) -> [f64; 13] {
    let pokes = &recording.pokes;
    let number = pokes.iter().map(|p| p.number).max().unwrap_or(0) + 1;
    let radius_m = pokes.last().map_or(f64::NAN, |p| p.radius_m);
    let pause = pokes.windows(2).map(|p| p[1].start_s - p[0].end_s).fold(PAUSE_S, f64::max);
    let start_s = pokes.last().map_or(0.0, |p| p.end_s) + pause;
    let end_s = start_s + 2.0 * poke.depth_m / poke.rate_m_s + poke.hold_s;
    let (site, direction) = (poke.site_m, poke.direction);
    [
        f64::from(number),
        site.x,
        site.y,
        site.z,
        direction.x,
        direction.y,
        direction.z,
        radius_m,
        start_s,
        end_s,
        poke.depth_m,
        poke.rate_m_s,
        poke.hold_s,
    ]
}

/// Writes `next-poke.csv`.
pub(super) fn write_next_poke(
    path: &Path,
    poke: &NextPoke,
    recording: &Recording,
) -> Result<(), ReportError> {
    let table = |source| ReportError::Table { path: path.to_owned(), source };
    let mut writer = csv::Writer::from_path(path).map_err(table)?;
    writer.write_record(COLUMNS).map_err(table)?;
    writer.write_record(row(poke, recording).map(|v| v.to_string())).map_err(table)?;
    writer.flush().map_err(|source| ReportError::Write { path: path.to_owned(), source })
}
