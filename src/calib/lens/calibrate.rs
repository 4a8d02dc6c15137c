//! From boards in pictures to the camera that took them.
//!
//! ```text
//! points → homography of each picture → camera and poses in closed form → adjustment → residuals, covariance, held-out pictures
//!             (Hartley 1997)                    (Zhang 2000)                 ↑     ↓
//!                                                                      offsets of discs, excess of residuals
//! ```
//!
//! Pictures that do not fit the others, and then single points that are not where they should be, are left out and all is adjusted again.
//!
//! The centre of a disc's picture is not the picture of its centre (see [`DiscInSpace`]): with the poses known the difference is computed and
//! taken off the points, and all is adjusted again, until nothing changes.

use super::adjust::{Leftover, Sight, State, adjust, excess, median, normalised, residuals, spread};
use super::homography::homography;
use super::normal::Free;
use super::report::report;
use super::zhang::{first_camera, first_pose};
use super::{Board, BoardKind, BoardPoint, BoardView, LensError, LensFound, Pose};
use crate::geometry::Mat3;
use crate::track::{Camera, DiscInSpace};
use nalgebra::Vector2;

/// Which terms of distortion are found; the others are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Distortion {
    /// k₁, k₂, p₁ and p₂: enough for most lenses.
    #[default]
    FourTerms,
    /// k₃ too: for wide lenses, with points up to the corners.
    WithK3,
}

/// Two pictures are enough for numbers, but not for knowing whether they are right.
pub(super) const LEAST_PICTURES: usize = 3;
/// Rounds of correcting and adjusting; the second changes the offsets by less than a thousandth of a pixel.
const ROUNDS: usize = 10;
/// An excess that changes by less than this share is final.
const SETTLED: f64 = 1e-3;
/// Offsets that change by less than that are final (px).
const SETTLED_PX: f64 = 1e-5;
/// A picture with so many times the usual median residual is not like the others.
const STRANGER: f64 = 3.0;
/// A point this many standard deviations from where it should be is an outlier.
const OUTLIER: f64 = 5.0;
/// Largest share of points that may be outliers, and of the tenth of them that is farthest from the optical axis. Where it are more, it is
/// the model that does not fit, and without them it would fit what is left of the picture only.
const MOST_OUTLIERS: [f64; 2] = [0.1, 0.33];

/// Finds the camera, with the distortion k₁, k₂, p₁, p₂.
///
/// The pictures are all of one camera with one focus. What they cannot tell is in the room's documentation.
///
/// # Errors
/// [`LensError`]: fewer than three pictures, points that are none of a board, a mirrored board, or boards that leave the focal length open.
pub fn calibrate_lens(
    views: &[BoardView],
    board: &Board,
    size_px: [usize; 2],
) -> Result<LensFound, LensError> {
    calibrate_lens_with(views, board, size_px, Distortion::default())
}

/// Finds the camera with the distortion that is asked for.
///
/// # Errors
/// As [`calibrate_lens`].
pub fn calibrate_lens_with(
    views: &[BoardView],
    board: &Board,
    size_px: [usize; 2],
    distortion: Distortion,
) -> Result<LensFound, LensError> {
    board.check()?;
    if views.len() < LEAST_PICTURES {
        return Err(LensError::TooFewPictures { found: views.len(), needed: LEAST_PICTURES });
    }
    let seen: Vec<Vec<Sight>> = views
        .iter()
        .enumerate()
        .map(|(picture, view)| sights(picture, view, size_px))
        .collect::<Result<_, _>>()?;
    let mut free: Free = [true; 9];
    free[8] = distortion == Distortion::WithK3;
    let points: usize = seen.iter().map(Vec::len).sum();
    let needed = unknowns(&free, seen.len()) / 2 + 1;
    if points < needed {
        return Err(LensError::TooFewPoints { found: points, needed });
    }
    let mut state = start(&seen, size_px)?;
    let used = solve_without_strangers(&mut state, &seen, board, &free)?;
    report(&state, &seen, board, &free, &used)
}

/// Unknowns of a camera and its boards.
pub(super) fn unknowns(free: &Free, pictures: usize) -> usize {
    free.iter().filter(|f| **f).count() + 6 * pictures
}

/// The points of a picture, checked.
fn sights(picture: usize, view: &BoardView, size_px: [usize; 2]) -> Result<Vec<Sight>, LensError> {
    let sight = |(index, point): (usize, &BoardPoint)| -> Result<Sight, LensError> {
        let inside = (0..2).all(|k| (-0.5..=size_px[k] as f64 - 0.5).contains(&point.pixel[k]));
        let finite = point.board_m.iter().all(|x| x.is_finite());
        let factor = point.covariance_px2.cholesky().filter(|_| inside && finite);
        let weight = factor.map(|f| f.inverse()).filter(|w| w.iter().all(|x| x.is_finite()));
        let weight = weight.ok_or(LensError::NotAPoint { picture, index })?;
        Ok(Sight { board_m: point.board_m, pixel: point.pixel.into(), weight })
    };
    view.points.iter().enumerate().map(sight).collect()
}

/// Camera and poses in closed form.
fn start(seen: &[Vec<Sight>], size_px: [usize; 2]) -> Result<State, LensError> {
    let map = |(picture, sights): (usize, &Vec<Sight>)| {
        let pairs: Vec<_> = sights.iter().map(|s| (Vector2::from(s.board_m), s.pixel)).collect();
        homography(&pairs).ok_or(LensError::NotABoard { picture })
    };
    let maps: Vec<_> = seen.iter().enumerate().map(map).collect::<Result<_, _>>()?;
    let camera = first_camera(&maps, size_px);
    let pose = |(picture, map): (usize, &Mat3)| {
        let pose = first_pose(map, &camera).ok_or(LensError::NotABoard { picture })?;
        if pose.faces_camera() { Ok(pose) } else { Err(LensError::Mirrored { picture }) }
    };
    let poses = maps.iter().enumerate().map(pose).collect::<Result<_, _>>()?;
    Ok(State { camera, poses })
}

/// What an adjustment came to.
pub(super) struct Solved {
    /// The points with the offsets of discs taken off.
    pub(super) sights: Vec<Vec<Sight>>,
    /// By how much residuals are larger than their covariances say; at least 1.
    pub(super) excess: f64,
    pub(super) leftover: Leftover,
}

/// What the pictures that are alike came to.
pub(super) struct Used {
    /// Which pictures the camera was found from.
    pub(super) pictures: Vec<usize>,
    /// Which ones do not fit the others, whether they were left out or not.
    pub(super) strangers: Vec<usize>,
    /// For each of `pictures`, its outliers. The camera is found without them, unless they are too many.
    pub(super) outliers: Vec<Vec<usize>>,
    /// The camera before they were left out; none where nothing was.
    pub(super) before: Option<Camera>,
    pub(super) solved: Solved,
}

/// Solves, leaves out pictures that do not fit the others as long as enough of these are left, and solves again. What is left out gets
/// a pose only.
fn solve_without_strangers(
    state: &mut State,
    seen: &[Vec<Sight>],
    board: &Board,
    free: &Free,
) -> Result<Used, LensError> {
    let mut pictures: Vec<usize> = (0..seen.len()).collect();
    let (solved, mut strangers) = loop {
        let (mut part, part_seen) = state.part(&pictures, seen);
        let solved = solve(&mut part, &part_seen, board, free)?;
        state.put(&pictures, &part);
        let strangers: Vec<usize> = strangers(&part, &solved).into_iter().map(|k| pictures[k]).collect();
        if strangers.is_empty() || pictures.len() - strangers.len() < LEAST_PICTURES {
            break (solved, strangers);
        }
        pictures.retain(|k| !strangers.contains(k));
    };
    let camera = state.camera;
    let (solved, outliers, left_any_out) =
        solve_without_outliers(state, seen, board, free, &pictures, solved);
    let before = left_any_out.then_some(camera);
    let left_out: Vec<usize> = (0..seen.len()).filter(|k| !pictures.contains(k)).collect();
    for &k in &left_out {
        let (mut part, part_seen) = state.part(&[k], seen);
        // A picture that has no pose either keeps the one that it has, and its residuals say so.
        if solve(&mut part, &part_seen, board, &[false; 9]).is_ok() {
            state.put(&[k], &part);
        }
    }
    strangers.extend(left_out);
    Ok(Used { pictures, strangers, outliers, before, solved })
}

/// Leaves out points that are not where they should be and solves again, until they are the same ones. What is left, the outliers of
/// each of `pictures`, and whether they were left out: where they turn out to be too many, nothing is.
fn solve_without_outliers(
    state: &mut State,
    seen: &[Vec<Sight>],
    board: &Board,
    free: &Free,
    pictures: &[usize],
    solved: Solved,
) -> (Solved, Vec<Vec<usize>>, bool) {
    let (mut part, all) = state.part(pictures, seen);
    let far = |part: &State, excess: f64| outliers(part, &without_offsets(&all, part, board), excess);
    let first = far(&part, solved.excess);
    if first.iter().all(Vec::is_empty) {
        return (solved, first, false);
    }
    let (mut left_out, mut again) = (first.clone(), None);
    for _ in 0..ROUNDS {
        let kept = without(&all, &left_out);
        let solved_again = if are_many(&part, &all, &left_out) {
            None
        } else {
            // What single points decided is not decided by the others.
            solve(&mut part, &kept, board, free).ok()
        };
        let Some(solved_again) = solved_again else { return (solved, first, false) };
        let outliers = far(&part, solved_again.excess);
        let settled = outliers == left_out;
        again = Some((solved_again, std::mem::replace(&mut left_out, outliers)));
        if settled {
            break;
        }
    }
    let (solved, left_out) = again.unwrap_or((solved, first));
    state.put(pictures, &part);
    let any = !left_out.iter().all(Vec::is_empty);
    (solved, left_out, any)
}

/// Whether outliers are so many, or so many of those far out, that they are no errors of points.
fn are_many(state: &State, sights: &[Vec<Sight>], outliers: &[Vec<usize>]) -> bool {
    let pictures = state.poses.iter().zip(sights).zip(outliers);
    let mut points: Vec<(f64, bool)> = pictures
        .flat_map(|((pose, sights), outliers)| {
            sights.iter().enumerate().map(move |(i, sight)| {
                let at = pose.apply(sight.board_m);
                (at.xy().norm() / at.z, outliers.contains(&i))
            })
        })
        .collect();
    points.sort_by(|a, b| b.0.total_cmp(&a.0));
    let share =
        |points: &[(f64, bool)]| points.iter().filter(|p| p.1).count() as f64 / points.len().max(1) as f64;
    share(&points) > MOST_OUTLIERS[0] || share(&points[..points.len().div_ceil(10)]) > MOST_OUTLIERS[1]
}

/// Points of each picture, from 0, that are not where they should be.
fn outliers(state: &State, sights: &[Vec<Sight>], excess: f64) -> Vec<Vec<usize>> {
    let Some(left) = residuals(state, sights) else { return vec![Vec::new(); sights.len()] };
    let far = |(residuals, sights): (&Vec<Vector2<f64>>, &Vec<Sight>)| {
        let pairs = residuals.iter().zip(sights).enumerate();
        pairs.filter(|(_, (r, s))| normalised(r, s) > OUTLIER * excess).map(|(i, _)| i).collect()
    };
    left.iter().zip(sights).map(far).collect()
}

/// The points of each picture but some of them.
pub(super) fn without(sights: &[Vec<Sight>], left_out: &[Vec<usize>]) -> Vec<Vec<Sight>> {
    let kept = |(sights, left_out): (&Vec<Sight>, &Vec<usize>)| {
        let points = sights.iter().enumerate();
        points.filter(|(i, _)| !left_out.contains(i)).map(|(_, sight)| *sight).collect()
    };
    sights.iter().zip(left_out).map(kept).collect()
}

/// Pictures, from 0, most of whose points fit three times worse than is usual.
fn strangers(state: &State, solved: &Solved) -> Vec<usize> {
    let Some(left) = residuals(state, &solved.sights) else { return Vec::new() };
    let spreads: Vec<f64> = left.iter().zip(&solved.sights).map(|(r, s)| spread(r.iter().zip(s))).collect();
    let usual = median(spreads.clone()).unwrap_or(0.0).max(1.0);
    (0..spreads.len()).filter(|&k| spreads[k] > STRANGER * usual).collect()
}

/// Corrects and adjusts until nothing changes.
pub(super) fn solve(
    state: &mut State,
    seen: &[Vec<Sight>],
    board: &Board,
    free: &Free,
) -> Result<Solved, LensError> {
    let mut sights = seen.to_vec();
    let mut allowed = excess(state, &sights);
    let mut leftover = adjust(state, &sights, free, allowed)?;
    for _ in 1..ROUNDS {
        let corrected = without_offsets(seen, state, board);
        let pairs = corrected.iter().flatten().zip(sights.iter().flatten());
        let change = pairs.map(|(new, old)| (new.pixel - old.pixel).norm()).fold(0.0, f64::max);
        let renewed = excess(state, &corrected);
        if change < SETTLED_PX && (renewed / allowed - 1.0).abs() < SETTLED {
            break;
        }
        (sights, allowed) = (corrected, renewed);
        leftover = adjust(state, &sights, free, allowed)?;
    }
    Ok(Solved { sights, excess: allowed, leftover })
}

/// Points moved from the centres of the discs' pictures to the pictures of their centres.
pub(super) fn without_offsets(seen: &[Vec<Sight>], state: &State, board: &Board) -> Vec<Vec<Sight>> {
    let BoardKind::Dots { radius_m } = board.kind else { return seen.to_vec() };
    let corrected = |(pose, sights): (&Pose, &Vec<Sight>)| {
        let of_point = |sight: &Sight| {
            let disc = DiscInSpace { centre_m: pose.apply(sight.board_m), normal: pose.normal(), radius_m };
            let offset = disc.image_offset(&state.camera).unwrap_or_else(Vector2::zeros);
            Sight { pixel: sight.pixel - offset, ..*sight }
        };
        sights.iter().map(of_point).collect()
    };
    state.poses.iter().zip(seen).map(corrected).collect()
}
