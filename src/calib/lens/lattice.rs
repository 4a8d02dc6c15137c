//! Which points of a picture belong to one grid, and where in it: pixels → whole numbers of steps along the grid's two directions.
//!
//! A point with neighbours opposite one another on two sides gives two directions. From there the grid is walked outwards. Each next point
//! is predicted from the step before and from the steps beside it in the neighbouring rows, so that perspective and distortion, which
//! change a step little from one cell to the next, may change it much across the picture. What lies too far from its prediction is not a
//! point of the grid. Walks start from every point that no walk has reached yet; the largest grid is the board.
//!
//! The two directions are the shortest ones. Those are the rows and columns of a square grid that is tilted by less than 54.7°: beyond
//! that the diagonal of a cell, foreshortened along its length (√2 cos τ), may be shorter than its sides (√((1 + cos² τ)/2)).

use nalgebra::Vector2;
use std::collections::{BTreeMap, VecDeque};

/// A place in a grid: steps along its first and its second direction.
pub(super) type Node = [i32; 2];

/// Which point is at which place.
pub(super) type Grid = BTreeMap<Node, usize>;

/// Neighbours in which opposite ones are looked for: those of two cells each way are among them.
const NEIGHBOURS: usize = 12;
/// How far two neighbours may be from lying opposite one another, over their distance.
const OPPOSITE: f64 = 0.2;
/// Least sine of the angle between the two directions.
const LEAST_SINE: f64 = 0.3;
/// How far a point may lie from its prediction, in steps.
const GATE: f64 = 0.22;

/// Points in the middle of a grid that it is walked from again, and the share of its points that such a walk must reach.
const INNER: usize = 9;
const WHOLE: f64 = 0.9;

/// The four ways to go on from a place.
const WAYS: [Node; 4] = [[1, 0], [-1, 0], [0, 1], [0, -1]];

/// The largest grid among points of a picture (px), right-handed like the picture: from the first to the second direction one turns as
/// from x to y. Empty where there is none.
pub(super) fn largest_grid(points: &[Vector2<f64>]) -> Grid {
    let mut reached = vec![false; points.len()];
    let mut largest = Grid::new();
    for seed in 0..points.len() {
        if reached[seed] {
            continue;
        }
        let Some(steps) = directions(points, seed) else { continue };
        let grid = walk(points, seed, steps);
        for &point in grid.values() {
            reached[point] = true;
        }
        if grid.len() > largest.len() {
            largest = grid;
        }
    }
    unsheared(points, largest)
}

/// The same points, walked along their shortest steps. At the rim of a board or beside a stranger a diagonal may pass for a direction,
/// and the walk along it reaches everything too; points in the middle have neighbours on all sides.
fn unsheared(points: &[Vector2<f64>], grid: Grid) -> Grid {
    let middle: Vector2<f64> =
        grid.values().map(|&p| points[p]).sum::<Vector2<f64>>() / grid.len().max(1) as f64;
    let mut inner: Vec<usize> = grid.values().copied().collect();
    inner.sort_by(|&a, &b| (points[a] - middle).norm().total_cmp(&(points[b] - middle).norm()));
    inner.truncate(INNER);
    let again = inner.iter().filter_map(|&seed| Some(walk(points, seed, directions(points, seed)?)));
    let walks: Vec<Grid> = again.chain([grid]).collect();
    let most = walks.iter().map(Grid::len).max().unwrap_or(0);
    let whole = walks.into_iter().filter(|grid| grid.len() as f64 >= WHOLE * most as f64);
    whole.min_by(|a, b| step_length(points, a).total_cmp(&step_length(points, b))).unwrap_or_default()
}

/// Mean squared length of the steps of a grid (px²).
fn step_length(points: &[Vector2<f64>], grid: &Grid) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (&[i, j], &from) in grid {
        for to in [[i + 1, j], [i, j + 1]].iter().filter_map(|node| grid.get(node)) {
            sum += (points[*to] - points[from]).norm_squared();
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { f64::INFINITY }
}

/// Steps from a point to its neighbours along two directions.
fn directions(points: &[Vector2<f64>], from: usize) -> Option<[Vector2<f64>; 2]> {
    let mut near: Vec<Vector2<f64>> = points
        .iter()
        .enumerate()
        .filter(|&(i, _)| i != from)
        .map(|(_, p)| p - points[from])
        .filter(|step| step.norm() > 0.0)
        .collect();
    near.sort_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    near.truncate(NEIGHBOURS);
    let mut steps = near.iter().filter_map(|step| {
        let opposite = near.iter().find(|other| (step + *other).norm() < OPPOSITE * step.norm())?;
        Some(0.5 * (step - opposite))
    });
    let first = steps.next()?;
    let second = steps.find(|s| first.perp(s).abs() > LEAST_SINE * first.norm() * s.norm())?;
    Some(if first.perp(&second) > 0.0 { [first, second] } else { [first, -second] })
}

/// All points that are reached from one.
fn walk(points: &[Vector2<f64>], seed: usize, steps: [Vector2<f64>; 2]) -> Grid {
    let mut grid = Grid::from([([0, 0], seed)]);
    let mut taken = vec![false; points.len()];
    taken[seed] = true;
    let mut queue = VecDeque::from([([0, 0], steps)]);
    while let Some((node, steps)) = queue.pop_front() {
        for way in WAYS {
            let next = [node[0] + way[0], node[1] + way[1]];
            if grid.contains_key(&next) {
                continue;
            }
            let inherited = steps[0] * f64::from(way[0]) + steps[1] * f64::from(way[1]);
            let step = expected_step(points, &grid, node, way).unwrap_or(inherited);
            let from = points[grid[&node]];
            let Some((point, distance)) = nearest(points, from + step) else { continue };
            if taken[point] || distance > GATE * step.norm() {
                continue;
            }
            taken[point] = true;
            grid.insert(next, point);
            let axis = usize::from(way[0] == 0);
            let mut own = steps;
            own[axis] = (points[point] - from) * f64::from(way[axis]);
            queue.push_back((next, own));
        }
    }
    grid
}

/// The next step from a place, as those known around it say: the step that led there, and the same step in the rows on both sides.
fn expected_step(points: &[Vector2<f64>], grid: &Grid, [i, j]: Node, way: Node) -> Option<Vector2<f64>> {
    let at = |i: i32, j: i32| grid.get(&[i, j]).map(|&p| points[p]);
    let [di, dj] = way;
    let pairs = [
        (at(i, j), at(i - di, j - dj)),
        (at(i + dj + di, j + di + dj), at(i + dj, j + di)),
        (at(i - dj + di, j - di + dj), at(i - dj, j - di)),
    ];
    let (mut sum, mut count) = (Vector2::zeros(), 0.0);
    for pair in pairs {
        if let (Some(to), Some(from)) = pair {
            sum += to - from;
            count += 1.0;
        }
    }
    (count > 0.0).then(|| sum / count)
}

fn nearest(points: &[Vector2<f64>], to: Vector2<f64>) -> Option<(usize, f64)> {
    let (point, squared) =
        points.iter().map(|p| (p - to).norm_squared()).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((point, squared.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::super::block::board_in_grid;
    use super::super::tests::scene::{Random, TRUTH, poses};
    use super::super::{Board, BoardKind};
    use super::*;

    /// Points of a grid seen through the lens of the tests, column by column, and strangers behind them.
    fn seen(pose: usize, [columns, rows]: [usize; 2], strangers: &[[f64; 2]]) -> Vec<Vector2<f64>> {
        let pose = poses()[pose];
        let place = |k: usize| pose.apply([(k / rows) as f64 * 12e-3, (k % rows) as f64 * 12e-3]);
        let board = (0..columns * rows).map(|k| TRUTH.project(place(k)).expect("in front"));
        board.chain(strangers.iter().copied()).map(Vector2::from).collect()
    }

    /// Every neighbour in the grid is a neighbour on the board.
    fn is_the_board(grid: &Grid, rows: usize) -> bool {
        grid.iter().all(|(&[i, j], &point)| {
            [[i + 1, j], [i, j + 1]].iter().filter_map(|next| grid.get(next)).all(|&other| {
                let apart = (point / rows).abs_diff(other / rows) + (point % rows).abs_diff(other % rows);
                apart == 1
            })
        })
    }

    #[test]
    fn every_pose_of_a_board_is_walked_among_strangers() {
        let strangers = [[12.0, 8.0], [600.0, 470.0], [300.5, 241.0], [20.0, 400.0], [25.0, 404.0]];
        for pose in 0..poses().len() {
            let points = seen(pose, [9, 7], &strangers);
            let mut grid = largest_grid(&points);
            let board = grid.values().filter(|&&p| p < 63).count();
            // A stranger may lie by chance where the grid would go on: an area of π·0.22² of each cell is within the gate.
            assert!(board == 63 && grid.len() <= 64, "pose {pose}: {}", grid.len());
            let whole = Board { kind: BoardKind::Checkerboard, columns: 9, rows: 7, pitch_m: 0.01 };
            let placed = board_in_grid(&grid, &whole).expect("the board");
            assert!(placed.len() == 63 && placed.iter().all(|(_, p)| *p < 63), "pose {pose}: {placed:?}");
            grid.retain(|_, p| *p < 63);
            assert!(is_the_board(&grid, 7));
            let at = |i: i32, j: i32| grid.get(&[i, j]).map(|&p| points[p]);
            let turn = at(1, 0).zip(at(0, 0)).zip(at(0, 1)).map(|((a, o), b)| (a - o).perp(&(b - o)));
            assert!(turn.expect("the seed's cell") > 0.0);
        }
    }

    #[test]
    fn of_two_grids_the_larger_one_is_taken() {
        let small = (0..20).map(|k| [20.0 + 11.0 * f64::from(k % 5), 15.0 + 11.0 * f64::from(k / 5)]);
        let points = seen(9, [9, 7], &small.collect::<Vec<_>>());
        let grid = largest_grid(&points);
        assert_eq!(grid.values().filter(|&&p| p < 63).count(), 63);
        assert_eq!(grid.len(), 63);
    }

    #[test]
    fn scattered_points_are_no_grid() {
        let mut random = Random::seeded(4);
        let mut place = |wide: f64| wide * random.uniform();
        let points: Vec<Vector2<f64>> = (0..60).map(|_| Vector2::new(place(640.0), place(480.0))).collect();
        assert!(largest_grid(&points).len() < 20, "{}", largest_grid(&points).len());
        assert!(largest_grid(&[]).is_empty());
        assert!(largest_grid(&[Vector2::zeros(); 5]).is_empty());
    }
}
