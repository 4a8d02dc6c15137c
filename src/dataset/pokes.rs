//! `pokes.csv` → the pokes in order of time, checked one by one and against each other.

use super::DatasetError;
use super::table::Table;
use crate::geometry::Vec3;
use crate::observation::Poke;
use std::path::Path;

/// Columns of `pokes.csv`.
pub(super) const POKES: [&str; 10] =
    ["poke", "site_x_m", "site_y_m", "site_z_m", "dir_x", "dir_y", "dir_z", "radius_m", "start_s", "end_s"];

/// A direction this far from unit length is refused.
const UNIT_TOLERANCE: f64 = 1e-3;

/// A direction closer to unit length than this is left as written, so that what was written is read again.
const UNIT_TO_ROUNDING: f64 = 1e-14;

/// The pokes with, for messages, the line of each.
pub(super) struct PokeFile {
    pub(super) pokes: Vec<Poke>,
    pub(super) line: Vec<u64>,
}

/// Reads `pokes.csv`. Rows are sorted by start; a poke may start when the one before ends, not earlier, and not
/// before `rest_until_s`.
pub(super) fn read_pokes(file: &Path, rest_until_s: f64) -> Result<PokeFile, DatasetError> {
    let mut table = Table::open(file, POKES)?;
    let mut read = PokeFile { pokes: Vec::new(), line: Vec::new() };
    while table.advance()? {
        let row = table.line(table.row());
        let poke = Poke {
            number: table.whole(0)?,
            site: table.vector(1)?.into(),
            direction: table.vector(4)?.into(),
            radius_m: table.number(7)?,
            start_s: table.number(8)?,
            end_s: table.number(9)?,
        };
        read.pokes.push(check(file, row, poke, &read.pokes, rest_until_s)?);
        read.line.push(row);
    }
    if read.pokes.is_empty() {
        return Err(DatasetError::NoPokes { file: file.to_owned() });
    }
    Ok(read)
}

fn check(
    file: &Path,
    row: u64,
    poke: Poke,
    before: &[Poke],
    rest_until_s: f64,
) -> Result<Poke, DatasetError> {
    let Poke { number, direction, radius_m, start_s, end_s, .. } = poke;
    let file = file.to_owned();
    if before.iter().any(|p| p.number == number) {
        return Err(DatasetError::RepeatedPoke { file, row, poke: number });
    }
    let direction = unit(&file, row, number, direction)?;
    if radius_m <= 0.0 {
        return Err(DatasetError::RadiusNotPositive { file, row, poke: number, radius_m });
    }
    if end_s <= start_s {
        return Err(DatasetError::EndBeforeStart { file, row, poke: number, start_s, end_s });
    }
    if start_s < rest_until_s {
        return Err(DatasetError::PokeInRest { file, row, poke: number, start_s, rest_until_s });
    }
    if let Some(last) = before.last() {
        if start_s < last.start_s {
            return Err(DatasetError::UnsortedTime {
                file,
                row,
                column: "start_s",
                time_s: start_s,
                previous_s: last.start_s,
            });
        }
        if start_s < last.end_s {
            return Err(DatasetError::OverlappingPokes {
                file,
                row,
                poke: number,
                start_s,
                other: last.number,
                other_end_s: last.end_s,
            });
        }
    }
    Ok(Poke { direction, ..poke })
}

/// The direction of a poke as a unit vector, which it must nearly be.
pub(super) fn unit(file: &Path, row: u64, poke: u32, direction: Vec3) -> Result<Vec3, DatasetError> {
    let length = direction.norm();
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        let (file, direction) = (file.to_owned(), direction.into());
        return Err(DatasetError::DirectionNotUnit { file, row, poke, direction, length });
    }
    Ok(if (length - 1.0).abs() <= UNIT_TO_ROUNDING { direction } else { direction / length })
}
