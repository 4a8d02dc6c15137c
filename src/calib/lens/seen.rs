//! Where the points of a board are in a picture.

use super::block::board_in_grid;
use super::corners::corners;
use super::lattice::largest_grid;
use super::{Board, BoardKind, LensError};
use crate::track::{Dot, DotSettings, Finder, GreyView};
use nalgebra::{Matrix2, Vector2};

/// One point of a board in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardPoint {
    /// Its place in the board frame (m).
    pub board_m: [f64; 2],
    /// Where it is seen (px): the corner, or the centre of the dot's image.
    pub pixel: [f64; 2],
    /// Covariance of that (px²).
    pub covariance_px2: Matrix2<f64>,
}

/// A board in a picture, or half of it and more.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardView {
    /// Its points that are seen, row by row.
    pub points: Vec<BoardPoint>,
}

/// A place in a picture with its covariance (px, px²).
type Spot = (Vector2<f64>, Matrix2<f64>);

/// Smallest radius of a dot that can be measured (px).
const LEAST_RADIUS_PX: f64 = 2.0;
/// Largest radius that the finder of dots takes (px).
const MOST_RADIUS_PX: f64 = 200.0;
/// How much larger the nearest dots of a tilted board may be than the mean.
const NEARER: f64 = 1.5;

/// Finds a board in a picture: all of its points, or half of them at least, where the rest is outside of the picture, hidden, in glare, or
/// (hollow dots that mark the axes of some targets) of another kind.
///
/// Dots may be lighter or darker than the board. Which corner of the board is taken for the first is open where it looks the same turned
/// by 180°, or by 90°, and where columns or rows are missing the whole board may be shifted by some: see the room's documentation.
///
/// # Errors
/// [`LensError`]: a board that cannot be, one of which less than half is seen, or one that has more points than it should.
pub fn board_in(picture: &GreyView<'_>, board: &Board) -> Result<BoardView, LensError> {
    board.check()?;
    let BoardKind::Dots { radius_m } = board.kind else {
        let spots: Vec<Spot> = corners(picture).iter().map(|c| (c.at, c.covariance_px2)).collect();
        return arranged(&spots, board);
    };
    let radius_px = radii_px(picture.size(), radius_m, board);
    let light = arranged(&dots(picture, radius_px), board);
    if light.as_ref().is_ok_and(|view| view.points.len() == board.points()) {
        return light;
    }
    let [width, height] = picture.size();
    let negative: Vec<u8> = (0..height).flat_map(|y| picture.row(y).iter().map(|p| 255 - p)).collect();
    let Ok(inverted) = GreyView::new(width, height, width, &negative) else { return light };
    let dark = arranged(&dots(&inverted, radius_px), board);
    let found = |seen: &Result<BoardView, LensError>| match seen {
        Ok(view) => view.points.len(),
        Err(LensError::Partial { found, .. }) => *found,
        Err(_) => board.points(),
    };
    if found(&dark) > found(&light) { dark } else { light }
}

/// Between which radii dots are looked for (px): the board fits into the picture.
fn radii_px(size: [usize; 2], radius_m: f64, board: &Board) -> [f64; 2] {
    let diagonal = (size[0] as f64).hypot(size[1] as f64);
    let pitch_px = NEARER * diagonal / (board.columns.max(board.rows) - 1) as f64;
    let most = (pitch_px * radius_m / board.pitch_m).clamp(LEAST_RADIUS_PX, MOST_RADIUS_PX);
    [LEAST_RADIUS_PX, most]
}

/// Whole dots of a picture. Light that falls off across a dot moves its centre by as much for all of them, or by more at one side
/// of the picture than at the other, which looks like a lens: what it does is taken off, for the price of more noise.
fn dots(picture: &GreyView<'_>, radius_px: [f64; 2]) -> Vec<Spot> {
    let settings = DotSettings { radius_px, ..DotSettings::default() };
    let found = Finder::default().find(picture, &settings);
    let spot = |dot: &Dot| {
        let centre = Vector2::from(dot.centre_px);
        dot.light.map_or((centre, dot.covariance_px2), |light| {
            (centre + Vector2::from(light.shift_px), dot.covariance_px2 + light.covariance_px2)
        })
    };
    found.dots.iter().filter(|dot| dot.is_whole()).map(spot).collect()
}

fn arranged(spots: &[Spot], board: &Board) -> Result<BoardView, LensError> {
    let places: Vec<Vector2<f64>> = spots.iter().map(|(at, _)| *at).collect();
    let order = board_in_grid(&largest_grid(&places), board)?;
    let points = order.iter().map(|&([column, row], spot)| BoardPoint {
        board_m: board.point_m(column, row),
        pixel: spots[spot].0.into(),
        covariance_px2: spots[spot].1,
    });
    Ok(BoardView { points: points.collect() })
}
