//! Where a board of so many columns and rows lies in a grid: the block of that size that holds most of the grid's points.
//!
//! Rows and columns are numbered so that the board is not mirrored. That leaves a turn by 180°, by 90° where there are as many rows as
//! columns, and where columns or rows are outside of the picture a shift by some of them. Any is taken, for the camera comes out the same.

use super::lattice::{Grid, Node};
use super::{Board, LensError};

/// A point of the board: its column, its row, and which of the grid's points it is.
pub(super) type Placed = ([usize; 2], usize);

/// The points of a board, row by row: half of them at least.
///
/// # Errors
/// [`LensError::Partial`]: fewer. [`LensError::Larger`]: more than one block of the grid is full.
pub(super) fn board_in_grid(grid: &Grid, board: &Board) -> Result<Vec<Placed>, LensError> {
    let what = board.what();
    let [(i0, i1), (j0, j1)] = [0, 1].map(|axis| extent(grid, axis));
    let occupied = Occupied::of(grid, [i0, j0], [i1 - i0 + 1, j1 - j0 + 1]);
    let (columns, rows) = (board.columns as i32, board.rows as i32);
    let (mut most, mut best, mut ways) = (0, None, 0);
    for turned in [false, true] {
        if turned && columns == rows {
            continue;
        }
        let [wide, high] = if turned { [rows, columns] } else { [columns, rows] };
        for i in i0 - wide + 1..=i1 {
            for j in j0 - high + 1..=j1 {
                let count = occupied.within([i, j], [wide, high]);
                ways += usize::from(count == board.points());
                if count > most {
                    (most, best) = (count, Some((turned, [i, j])));
                }
            }
        }
    }
    if ways > 1 {
        let seen = [(i1 - i0 + 1) as usize, (j1 - j0 + 1) as usize];
        return Err(LensError::Larger { what, seen, expected: [board.columns, board.rows], ways });
    }
    let partial = LensError::Partial { what, found: most, least: board.least(), points: board.points() };
    let (turned, [i, j]) = best.filter(|_| most >= board.least()).ok_or(partial)?;
    let place = |column: i32, row: i32| -> Node {
        // Turned by a right angle, not mirrored: columns go along the second direction, rows against the first.
        if turned { [i + rows - 1 - row, j + column] } else { [i + column, j + row] }
    };
    let nodes = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let placed = |(column, row): (i32, i32)| -> Option<Placed> {
        Some(([column as usize, row as usize], *grid.get(&place(column, row))?))
    };
    Ok(nodes.filter_map(placed).collect())
}

/// First and last place along an axis of the grid.
fn extent(grid: &Grid, axis: usize) -> (i32, i32) {
    let places = grid.keys().map(|node| node[axis]);
    (places.clone().min().unwrap_or(0), places.max().unwrap_or(0))
}

/// How many places of a grid are taken in any block of it.
struct Occupied {
    origin: Node,
    size: Node,
    /// Places taken before each column and row.
    sums: Vec<usize>,
}

impl Occupied {
    fn of(grid: &Grid, origin: Node, size: Node) -> Self {
        let stride = size[0] as usize + 1;
        let mut sums = vec![0; stride * (size[1] as usize + 1)];
        for j in 0..size[1] as usize {
            let mut row = 0;
            for i in 0..size[0] as usize {
                row += usize::from(grid.contains_key(&[origin[0] + i as i32, origin[1] + j as i32]));
                sums[(j + 1) * stride + i + 1] = sums[j * stride + i + 1] + row;
            }
        }
        Self { origin, size, sums }
    }

    fn within(&self, corner: Node, size: Node) -> usize {
        let bounds = [0, 1].map(|k| {
            let from = corner[k] - self.origin[k];
            [from, from + size[k]].map(|place| place.clamp(0, self.size[k]) as usize)
        });
        let before = |i: usize, j: usize| self.sums[j * (self.size[0] as usize + 1) + i];
        let [[left, right], [top, bottom]] = bounds;
        before(right, bottom) + before(left, top) - before(left, bottom) - before(right, top)
    }
}

#[cfg(test)]
mod tests {
    use super::super::BoardKind;
    use super::*;

    const BOARD: Board = Board { kind: BoardKind::Checkerboard, columns: 9, rows: 7, pitch_m: 0.01 };

    /// Points numbered row by row of a grid of that size, from another origin.
    fn grid(columns: i32, rows: i32) -> Grid {
        (0..columns * rows).map(|k| ([k % columns - 4, k / columns + 3], k as usize)).collect()
    }

    /// Points of the grid in the board's own order.
    fn whole() -> Vec<Placed> {
        (0..63).map(|k| ([k % 9, k / 9], k)).collect()
    }

    #[test]
    fn a_full_block_is_the_board() {
        assert_eq!(board_in_grid(&grid(9, 7), &BOARD), Ok(whole()));
        // One point more that happens to be on the grid is not the board's.
        let mut one_more = grid(9, 7);
        one_more.insert([5, 4], 63);
        assert_eq!(board_in_grid(&one_more, &BOARD), Ok(whole()));
    }

    #[test]
    fn a_board_on_its_side_is_turned_and_not_mirrored() {
        let points = board_in_grid(&grid(7, 9), &BOARD).expect("full");
        assert!(points.iter().enumerate().all(|(k, (at, _))| *at == [k % 9, k / 9]) && points.len() == 63);
        let place = |k: usize| [points[k].1 as i32 % 7, points[k].1 as i32 / 7];
        let (origin, along, down) = (place(0), place(1), place(9));
        let [a, b] = [along, down].map(|p| [p[0] - origin[0], p[1] - origin[1]]);
        assert_eq!(a[0] * b[1] - a[1] * b[0], 1, "columns {a:?}, rows {b:?}");
    }

    #[test]
    fn half_of_a_board_is_enough_and_less_is_refused_with_numbers() {
        let mut part = grid(9, 7);
        part.retain(|node, _| node[0] < 1);
        part.remove(&[0, 5]);
        // Five columns without a point: neighbours on the board are neighbours in the grid.
        let points = board_in_grid(&part, &BOARD).expect("34 points");
        assert_eq!(points.len(), 34);
        for (a, at) in points.iter().flat_map(|a| points.iter().map(move |b| (a, b))) {
            let board = [at.0[0] as i32 - a.0[0] as i32, at.0[1] as i32 - a.0[1] as i32];
            assert_eq!(board, [(at.1 % 9) as i32 - (a.1 % 9) as i32, (at.1 / 9) as i32 - (a.1 / 9) as i32]);
        }
        part.retain(|node, _| node[0] < 0);
        let error = board_in_grid(&part, &BOARD).expect_err("four columns");
        assert_eq!(error, LensError::Partial { what: "corners", found: 28, least: 32, points: 63 });
        assert!(error.to_string().starts_with("28 of 63 corners found"), "{error}");
        let nothing = board_in_grid(&Grid::new(), &BOARD);
        assert_eq!(nothing, Err(LensError::Partial { what: "corners", found: 0, least: 32, points: 63 }));
    }

    #[test]
    fn a_larger_grid_is_refused_with_its_size() {
        let error = board_in_grid(&grid(10, 8), &BOARD).expect_err("four blocks are full");
        assert_eq!(error, LensError::Larger { what: "corners", seen: [10, 8], expected: [9, 7], ways: 4 });
    }
}
