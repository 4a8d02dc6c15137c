//! What a calibration board is: a flat grid of round dots, or of the corners where the squares of a checkerboard meet.

use super::LensError;
use std::fmt;

/// What the points of a board are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BoardKind {
    /// Round dots, all lighter or all darker than the board.
    Dots {
        /// Radius of a dot (m).
        radius_m: f64,
    },
    /// A checkerboard; its points are the inner corners, where four squares meet.
    Checkerboard,
}

/// A flat board with a square grid of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// What its points are.
    pub kind: BoardKind,
    /// Points in a row.
    pub columns: usize,
    /// Rows of points.
    pub rows: usize,
    /// Distance from one point to the next in its row or column (m). A wrong one cannot be seen in pictures.
    pub pitch_m: f64,
}

/// A grid of fewer columns or rows has no point with neighbours on all sides.
const LEAST: usize = 3;
/// More columns or rows than that are a slip of the pen.
const MOST: usize = 200;

impl Board {
    /// Refuses what cannot be a board.
    ///
    /// # Errors
    /// [`LensError::Board`].
    pub fn check(&self) -> Result<(), LensError> {
        let wrong = |name, value, expected| Err(LensError::Board { name, value, expected });
        for (name, count) in [("the number of columns", self.columns), ("the number of rows", self.rows)] {
            if !(LEAST..=MOST).contains(&count) {
                return wrong(name, count as f64, "3 to 200");
            }
        }
        if !(self.pitch_m.is_finite() && self.pitch_m > 0.0) {
            return wrong("pitch_m", self.pitch_m, "a positive number");
        }
        if let BoardKind::Dots { radius_m } = self.kind
            && !(radius_m > 0.0 && radius_m < 0.5 * self.pitch_m)
        {
            return wrong("radius_m", radius_m, "more than 0 and less than half of the pitch");
        }
        Ok(())
    }

    /// How many points it has.
    pub fn points(&self) -> usize {
        self.columns * self.rows
    }

    /// How many of them must be seen in a picture: half, and never fewer than nine, which scenery may look like.
    pub(super) fn least(&self) -> usize {
        self.points().div_ceil(2).max(9)
    }

    /// Where a point lies in the board frame (m).
    pub fn point_m(&self, column: usize, row: usize) -> [f64; 2] {
        [column as f64 * self.pitch_m, row as f64 * self.pitch_m]
    }

    /// What its points are called.
    pub(super) fn what(&self) -> &'static str {
        match self.kind {
            BoardKind::Dots { .. } => "dots",
            BoardKind::Checkerboard => "corners",
        }
    }
}

impl fmt::Display for Board {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} × {} {}, pitch {} mm",
            self.columns,
            self.rows,
            self.what(),
            millimetres(self.pitch_m)
        )?;
        match self.kind {
            BoardKind::Dots { radius_m } => write!(f, ", radius {} mm", millimetres(radius_m)),
            BoardKind::Checkerboard => Ok(()),
        }
    }
}

/// Millimetres without the last digits of binary fractions: nobody knows a board better than to a nanometre.
fn millimetres(metres: f64) -> f64 {
    (metres * 1e9).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOARD: Board =
        Board { kind: BoardKind::Dots { radius_m: 3e-3 }, columns: 9, rows: 7, pitch_m: 12e-3 };

    #[test]
    fn impossible_boards_are_refused_by_name() {
        assert_eq!(BOARD.check(), Ok(()));
        let squares = Board { kind: BoardKind::Checkerboard, ..BOARD };
        assert_eq!(squares.check(), Ok(()));
        let cases = [
            (Board { columns: 2, ..BOARD }, "columns is 2"),
            (Board { rows: 0, ..BOARD }, "rows is 0"),
            (Board { pitch_m: f64::NAN, ..BOARD }, "pitch_m"),
            (Board { kind: BoardKind::Dots { radius_m: 6e-3 }, ..BOARD }, "half of the pitch"),
        ];
        for (board, words) in cases {
            let error = board.check().expect_err(words).to_string();
            assert!(error.contains(words), "{words}: {error}");
        }
    }

    #[test]
    fn a_board_says_what_it_is() {
        assert_eq!(BOARD.to_string(), "9 × 7 dots, pitch 12 mm, radius 3 mm");
        let squares = Board { kind: BoardKind::Checkerboard, pitch_m: 0.0125, ..BOARD };
        assert_eq!(squares.to_string(), "9 × 7 corners, pitch 12.5 mm");
        assert_eq!((BOARD.points(), BOARD.point_m(2, 1)), (63, [24e-3, 12e-3]));
    }
}
