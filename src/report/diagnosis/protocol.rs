//! Pokes to be made as a table: rows of a recording's `pokes.csv` with how the stage is to move besides.
//!
//! The first follows the last poke of the recording by the longest pause between pokes so far, and at least a second, so
//! that what relaxes has had as long as before; the others follow one another likewise. Readers of `pokes.csv` ignore the
//! columns added: depth (m), rate of approach and retreat (m/s) and time held (s).

use crate::observation::{PlannedPoke, Recording};
use crate::report::ReportError;
use std::path::Path;

const COLUMNS: [&str; 13] = [
    "poke", "site_x_m", "site_y_m", "site_z_m", "dir_x", "dir_y", "dir_z", "radius_m", "start_s", "end_s",
    "depth_m", "rate_m_s", "hold_s",
];

/// The least pause before a poke (s).
const PAUSE_S: f64 = 1.0;

/// Writes `pokes`, which are to follow those of `recording`.
///
/// # Errors
/// [`ReportError`] with the file.
pub fn write_pokes(path: &Path, pokes: &[PlannedPoke], recording: &Recording) -> Result<(), ReportError> {
    let table = |source| ReportError::Table { path: path.to_owned(), source };
    let before = &recording.pokes;
    let last = before.iter().map(|p| p.number).max().unwrap_or(0);
    let pause_s = recording.pause_s().max(PAUSE_S);
    let mut end_s = before.last().map_or(0.0, |p| p.end_s);
    let mut writer = csv::Writer::from_path(path).map_err(table)?;
    writer.write_record(COLUMNS).map_err(table)?;
    for (number, poke) in (last + 1..).zip(pokes) {
        let start_s = end_s + pause_s;
        end_s = start_s + poke.contact_s();
        let (site, direction) = (poke.site, poke.direction);
        let row: [f64; 13] = [
            f64::from(number),
            site.x,
            site.y,
            site.z,
            direction.x,
            direction.y,
            direction.z,
            poke.radius_m,
            start_s,
            end_s,
            poke.depth_m,
            poke.rate_m_s,
            poke.hold_s,
        ];
        writer.write_record(row.map(|v| v.to_string())).map_err(table)?;
    }
    writer.flush().map_err(|source| ReportError::Write { path: path.to_owned(), source })
}
