//! A table of pokes to be made → the pokes, checked one by one.
//!
//! Its columns are those of `pokes.csv` that say where and in which direction, and besides `depth_m`, `rate_m_s` and
//! `hold_s`. When a poke is made is up to who makes it.

use super::DatasetError;
use super::pokes::unit;
use super::table::Table;
use crate::observation::PlannedPoke;
use std::path::Path;

const COLUMNS: [&str; 11] = [
    "poke", "site_x_m", "site_y_m", "site_z_m", "dir_x", "dir_y", "dir_z", "radius_m", "depth_m", "rate_m_s",
    "hold_s",
];

/// Reads pokes to be made, in the order of the table.
///
/// # Errors
/// [`DatasetError`] with file and row: a table without rows, a direction that is not a unit vector, a radius, depth or rate that
/// is not positive, a negative hold.
pub fn read_planned_pokes(file: &Path) -> Result<Vec<PlannedPoke>, DatasetError> {
    let mut table = Table::open(file, COLUMNS)?;
    let mut pokes = Vec::new();
    while table.advance()? {
        let row = table.line(table.row());
        let number = table.whole(0)?;
        let poke = PlannedPoke {
            site: table.vector(1)?.into(),
            direction: unit(file, row, number, table.vector(4)?.into())?,
            radius_m: table.number(7)?,
            depth_m: table.number(8)?,
            rate_m_s: table.number(9)?,
            hold_s: table.number(10)?,
        };
        let positive = [("radius_m", poke.radius_m), ("depth_m", poke.depth_m), ("rate_m_s", poke.rate_m_s)];
        let wrong = positive.into_iter().find(|(_, value)| *value <= 0.0);
        let wrong = wrong.map(|(column, value)| (column, value, "more than 0"));
        let held = (poke.hold_s < 0.0).then_some(("hold_s", poke.hold_s, "0 or more"));
        if let Some((column, value, expected)) = wrong.or(held) {
            let file = file.to_owned();
            return Err(DatasetError::CannotBeMade { file, row, poke: number, column, value, expected });
        }
        pokes.push(poke);
    }
    if pokes.is_empty() {
        return Err(DatasetError::NoPokes { file: file.to_owned() });
    }
    Ok(pokes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str =
        "poke,site_x_m,site_y_m,site_z_m,dir_x,dir_y,dir_z,radius_m,start_s,end_s,depth_m,rate_m_s,hold_s\n";

    fn read(rows: &str) -> Result<Vec<PlannedPoke>, DatasetError> {
        let place = tempfile::tempdir().expect("a temporary folder");
        let file = place.path().join("pokes.csv");
        std::fs::write(&file, format!("{HEAD}{rows}")).expect("written");
        read_planned_pokes(&file)
    }

    #[test]
    fn a_poke_is_read_and_what_cannot_be_made_is_refused_by_name() {
        let pokes = read("8,0.05,0.06,0.025,0,0,-1,0.008,60,70.5,0.003,0.002,2.5\n").expect("a poke");
        assert_eq!(pokes.len(), 1);
        assert_eq!((pokes[0].site.y, pokes[0].direction.z, pokes[0].contact_s()), (0.06, -1.0, 5.5));
        for (row, words) in [
            ("", "no poke; expected"),
            ("8,0.05,0.06,0.025,0,0,-2,0.008,60,70,0.003,0.002,2.5\n", "has length 2"),
            ("8,0.05,0.06,0.025,0,0,-1,0.008,60,70,0,0.002,2.5\n", "depth_m is 0; expected more than 0"),
            ("8,0.05,0.06,0.025,0,0,-1,0.008,60,70,0.003,-1,2.5\n", "rate_m_s is -1; expected more than 0"),
            ("8,0.05,0.06,0.025,0,0,-1,0.008,60,70,0.003,0.002,-1\n", "hold_s is -1; expected 0 or more"),
        ] {
            let refused = read(row).expect_err("refused").to_string();
            assert!(refused.contains(words), "{refused}");
        }
    }

    /// Whatever a file holds, a terminal is not told to obey it.
    #[test]
    fn a_file_that_is_no_table_is_not_shown() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let file = place.path().join("garbage.csv");
        let long = format!("{HEAD}8,{}\u{1b}[31m,0,0\n", "x".repeat(500)).into_bytes();
        for (bytes, words) in [
            (&b"\x7fELF\x02\x01\x01\x00\x1b[2J"[..], "garbage.csv: no table: its first line is not text"),
            (b"\x89PNG\r\n\x1a\n\0\0", "garbage.csv: no table"),
            (b"poke\tsite_x_m\n", "no column"),
            (b"poke,Kraft (\xb5N)\n", "no column"),
            (b"one,two\n", "no column"),
            (&long, "fields"),
        ] {
            std::fs::write(&file, bytes).expect("written");
            let refused = read_planned_pokes(&file).expect_err("refused").to_string();
            let plain = !refused.contains(char::is_control) && refused.len() < 400;
            assert!(refused.contains(words) && plain, "{refused:?}");
        }
    }
}
