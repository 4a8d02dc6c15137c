//! `stage.csv`, `force.csv` and `markers.csv` → what the instruments reported. SI units, phantom frame.

use super::DatasetError;
use super::table::{RowStart, Table};
use crate::observation::{MarkerRow, Markers, Stage, Wrench};
use std::collections::HashMap;
use std::path::Path;

/// Columns of `stage.csv`.
pub(super) const STAGE: [&str; 4] = ["t_s", "x_m", "y_m", "z_m"];
/// Columns of `force.csv`.
pub(super) const FORCE: [&str; 7] = ["t_s", "fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm"];
/// Columns of `markers.csv`.
pub(super) const MARKERS: [&str; 5] = ["t_s", "marker", "x_m", "y_m", "z_m"];

/// Reads `stage.csv`. Times ascend.
pub(super) fn read_stage(file: &Path) -> Result<Stage, DatasetError> {
    let mut table = Table::open(file, STAGE)?;
    let mut stage = Stage::default();
    while table.advance()? {
        stage.time_s.push(table.time(stage.time_s.last().copied())?);
        stage.displacement_m.push(table.vector(1)?);
    }
    not_empty(file, stage.time_s.is_empty())?;
    Ok(stage)
}

/// Reads `force.csv`. Times ascend.
pub(super) fn read_wrench(file: &Path) -> Result<Wrench, DatasetError> {
    let mut table = Table::open(file, FORCE)?;
    let mut wrench = Wrench::default();
    while table.advance()? {
        wrench.time_s.push(table.time(wrench.time_s.last().copied())?);
        wrench.force_n.push(table.vector(1)?);
        wrench.torque_nm.push(table.vector(4)?);
    }
    not_empty(file, wrench.time_s.is_empty())?;
    Ok(wrench)
}

fn not_empty(file: &Path, empty: bool) -> Result<(), DatasetError> {
    if empty { Err(DatasetError::NoRows { file: file.to_owned() }) } else { Ok(()) }
}

/// The markers with, for messages, the row in which each first appears (in the order of
/// [`Markers::numbers`]).
pub(super) struct MarkerFile {
    pub(super) markers: Markers,
    pub(super) first_row: Vec<RowStart>,
}

/// What is known of a marker while its file is being read.
struct Seen {
    number: u32,
    last_frame: u32,
    first_row: RowStart,
}

/// Reads `markers.csv` and refuses markers that have no row before `rest_until_s`.
///
/// Rows of one time are one frame. A row takes 32 bytes of memory, so that a file of two gigabytes needs less
/// than that.
pub(super) fn read_markers(file: &Path, rest_until_s: f64) -> Result<MarkerFile, DatasetError> {
    let mut table = Table::open(file, MARKERS)?;
    let mut markers = Markers::default();
    let mut index: HashMap<u32, u32> = HashMap::new();
    let mut seen: Vec<Seen> = Vec::new();
    while table.advance()? {
        let previous = markers.frame_time_s.last().copied();
        let time_s = table.time(previous)?;
        if previous != Some(time_s) {
            markers.frame_time_s.push(time_s);
        }
        let number = table.whole(1)?;
        let position_m = table.vector(2)?;
        let (Ok(frame), Ok(next)) =
            (u32::try_from(markers.frame_time_s.len() - 1), u32::try_from(seen.len()))
        else {
            let row = table.line(table.row());
            return Err(DatasetError::TooMany { file: file.to_owned(), row, limit: u32::MAX });
        };
        let marker = *index.entry(number).or_insert(next);
        if marker == next {
            let first_row = table.row();
            if time_s >= rest_until_s {
                return Err(DatasetError::MarkerNotAtRest {
                    file: file.to_owned(),
                    row: table.line(first_row),
                    marker: number,
                    first_s: time_s,
                    rest_until_s,
                });
            }
            seen.push(Seen { number, last_frame: frame, first_row });
        } else {
            let before = &mut seen[marker as usize];
            if before.last_frame == frame {
                return Err(DatasetError::RepeatedMarker {
                    file: file.to_owned(),
                    row: table.line(table.row()),
                    marker: number,
                    time_s,
                });
            }
            before.last_frame = frame;
        }
        markers.rows.push(MarkerRow { frame, marker, position_m });
    }
    not_empty(file, markers.rows.is_empty())?;
    markers.rows.shrink_to_fit();

    // Markers were numbered as they appeared; the recording lists them by ascending number.
    let mut order: Vec<u32> = (0..seen.len() as u32).collect();
    order.sort_unstable_by_key(|&m| seen[m as usize].number);
    let mut rank = vec![0_u32; order.len()];
    for (new, &old) in order.iter().enumerate() {
        rank[old as usize] = new as u32;
    }
    for row in &mut markers.rows {
        row.marker = rank[row.marker as usize];
    }
    markers.numbers = order.iter().map(|&m| seen[m as usize].number).collect();
    let first_row = order.iter().map(|&m| seen[m as usize].first_row).collect();
    Ok(MarkerFile { markers, first_row })
}
