//! The camera and the poses of all boards that explain all points best: bundle adjustment.
//!
//! Least squares weighted with the points' covariances by Levenberg's and Marquardt's method (Marquardt 1963, SIAM J. 11, 431). A residual
//! longer than k standard deviations counts linearly and not squared (Huber 1964, Ann. Math. Stat. 35, 73), by weights that are renewed at
//! each step. What a standard deviation is follows the residuals themselves where they are larger than stated, or a lens that the model
//! cannot bend as it is bent would make outliers of all points.

use super::LensError;
use super::extent::turned;
use super::normal::{Free, LensSquare, Normal, Step};
use super::pose::{Pose, parameters, with_parameters};
use crate::track::Camera;
use nalgebra::{Matrix2, Vector2};

/// A point as the adjustment needs it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    /// Its place on the board (m).
    pub(super) board_m: [f64; 2],
    /// Where it is seen (px), as far as the point itself is seen there.
    pub(super) pixel: Vector2<f64>,
    /// Inverse covariance of that (1/px²).
    pub(super) weight: Matrix2<f64>,
}

/// The unknowns.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// The camera.
    pub(super) camera: Camera,
    /// Where the board is in each picture.
    pub(super) poses: Vec<Pose>,
}

impl State {
    /// Some of the pictures.
    pub(super) fn part(&self, pictures: &[usize], sights: &[Vec<Sight>]) -> (Self, Vec<Vec<Sight>>) {
        let poses = pictures.iter().map(|&k| self.poses[k]).collect();
        (Self { camera: self.camera, poses }, pictures.iter().map(|&k| sights[k].clone()).collect())
    }

    /// Takes over the camera and the poses of some of the pictures.
    pub(super) fn put(&mut self, pictures: &[usize], part: &Self) {
        self.camera = part.camera;
        for (&k, pose) in pictures.iter().zip(&part.poses) {
            self.poses[k] = *pose;
        }
    }
}

/// What an adjustment leaves.
pub(super) struct Leftover {
    /// Sum of squared normalised residuals, none of them counted as longer than where they begin to count linearly, over what is then
    /// lost of normal errors (Huber 1973, Ann. Stat. 1, 799).
    pub(super) chi2: f64,
    /// Covariance of the camera's parameters if the points' covariances are true.
    pub(super) covariance: LensSquare,
}

/// Standard deviations from which residuals count linearly. Of two-dimensional normal errors 1.1 % are longer.
const HUBER: f64 = 3.0;
/// Largest share of itself that the standard deviation of a focal length may be.
const MOST_FOCAL_SD: f64 = 0.02;
/// Median length of a two-dimensional standard normal error: √(2 ln 2).
const MEDIAN: f64 = 1.177_410_022_515_474_7;
/// Steps that an adjustment may take; from the closed form ten are usual.
const STEPS: usize = 200;
/// A step so small, in standard deviations, is the last; and one that moves points by so little (px), for rounding leaves no less.
const SMALL: f64 = 1e-9;
const SMALL_PX: f64 = 1e-10;
/// Damping at the start, and where no step helps any more.
const DAMPING: [f64; 2] = [1e-3, 1e10];
/// A cost may grow by so much from rounding: a share of it, and χ² of points that are exact.
const ROUNDING: [f64; 2] = [1e-11, 1e-12];
/// A step that changes a focal length by more than this share is too long to be believed.
const MOST_FOCAL_CHANGE: f64 = 0.5;

/// Residuals of all points (seen less projected, px); none when a point is not in front of the camera.
pub(super) fn residuals(state: &State, sights: &[Vec<Sight>]) -> Option<Vec<Vec<Vector2<f64>>>> {
    let of_picture = |(pose, sights): (&Pose, &Vec<Sight>)| -> Option<Vec<Vector2<f64>>> {
        let seen = |sight: &Sight| state.camera.project(pose.apply(sight.board_m)).map(Vector2::from);
        sights.iter().map(|sight| Some(sight.pixel - seen(sight)?)).collect()
    };
    state.poses.iter().zip(sights).map(of_picture).collect()
}

/// Length of a residual in its standard deviations.
pub(super) fn normalised(residual: &Vector2<f64>, sight: &Sight) -> f64 {
    residual.dot(&(sight.weight * residual)).max(0.0).sqrt()
}

/// By how much residuals are larger than their covariances say, by their median; at least 1.
pub(super) fn excess(state: &State, sights: &[Vec<Sight>]) -> f64 {
    let Some(residuals) = residuals(state, sights) else { return 1.0 };
    let pairs = residuals.iter().flatten().zip(sights.iter().flatten());
    spread(pairs).max(1.0)
}

/// Median length of residuals in their standard deviations, over what it is for normal errors.
pub(super) fn spread<'a>(pairs: impl Iterator<Item = (&'a Vector2<f64>, &'a Sight)>) -> f64 {
    median(pairs.map(|(residual, sight)| normalised(residual, sight)).collect()).unwrap_or(0.0) / MEDIAN
}

/// The middle one of numbers in their order; none of none.
pub(super) fn median(mut numbers: Vec<f64>) -> Option<f64> {
    let middle = numbers.len() / 2;
    (!numbers.is_empty()).then(|| *numbers.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Adjusts the free parameters of the camera and all poses, for residuals that are `excess` times as large as their covariances say.
///
/// # Errors
/// [`LensError::Undetermined`] where a focal length is free and left open, [`LensError::NotConverged`].
pub(super) fn adjust(
    state: &mut State,
    sights: &[Vec<Sight>],
    free: &Free,
    excess: f64,
) -> Result<Leftover, LensError> {
    let most = HUBER * excess;
    let weights: f64 = sights.iter().flatten().map(|sight| 0.5 * sight.weight.trace()).sum();
    let small = SMALL.max(SMALL_PX * weights.sqrt());
    let mut damping = DAMPING[0];
    let mut cost = cost_of(state, sights, most);
    let mut steps = 0;
    while steps < STEPS && damping <= DAMPING[1] {
        let Some((normal, chi2)) = assemble(state, sights, most) else { break };
        steps += 1;
        let mut length = f64::INFINITY;
        while damping <= DAMPING[1] {
            if let Some(step) = normal.step(damping, free)
                && let Some(trial) = moved(state, &step)
            {
                let trial_cost = cost_of(&trial, sights, most);
                if trial_cost <= cost * (1.0 + ROUNDING[0]) + ROUNDING[1].max(SMALL_PX * SMALL_PX * weights) {
                    (cost, *state, length) = (trial_cost, trial, step.length);
                    break;
                }
            }
            damping *= 10.0;
        }
        if length < small && damping < DAMPING[0] {
            let covariance = determined(state, sights, &normal, free)?;
            return Ok(Leftover { chi2: chi2 / (1.0 - (-0.5 * HUBER * HUBER).exp()), covariance });
        }
        damping *= 0.1;
    }
    // A focal length that nothing limits walks away: that is what is to be said of it.
    if let Some((normal, _)) = assemble(state, sights, most) {
        determined(state, sights, &normal, free)?;
    }
    Err(LensError::NotConverged {
        steps,
        rms_px: residuals(state, sights).map_or(f64::INFINITY, |r| rms(&r)),
    })
}

/// Covariance of the camera's parameters, if its focal lengths are determined by residuals as large as they are.
fn determined(
    state: &State,
    sights: &[Vec<Sight>],
    normal: &Normal,
    free: &Free,
) -> Result<LensSquare, LensError> {
    let excess = excess(state, sights);
    let covariance = normal.covariance(free);
    for k in 0..2 {
        let (focal_px, variance) = (state.camera.focal_px[k], covariance.as_ref().map(|c| c[(k, k)]));
        // Rounding may make a variance negative where nothing is determined.
        let sd_px = variance.filter(|v| *v >= 0.0).map_or(f64::INFINITY, |v| excess * v.sqrt());
        if sd_px > MOST_FOCAL_SD * focal_px {
            let turned_deg = turned(&state.poses).to_degrees();
            return Err(LensError::Undetermined { focal_px, sd_px, turned_deg });
        }
    }
    let open = LensError::Undetermined {
        focal_px: state.camera.focal_px[0],
        sd_px: f64::INFINITY,
        turned_deg: turned(&state.poses).to_degrees(),
    };
    covariance.ok_or(open)
}

fn assemble(state: &State, sights: &[Vec<Sight>], most: f64) -> Option<(Normal, f64)> {
    let mut normal = Normal::new(sights.len());
    let mut chi2 = 0.0;
    for (picture, (pose, sights)) in state.poses.iter().zip(sights).enumerate() {
        for sight in sights {
            let at = pose.project(&state.camera, sight.board_m)?;
            let residual = sight.pixel - at.pixel;
            let length = normalised(&residual, sight);
            let share = if length > most { most / length } else { 1.0 };
            normal.add(picture, &at, residual, &(share * sight.weight));
            chi2 += (share * length).powi(2);
        }
    }
    Some((normal, chi2))
}

/// Sum of Huber's function over all residuals; infinite when a point is behind the camera.
fn cost_of(state: &State, sights: &[Vec<Sight>], most: f64) -> f64 {
    let Some(residuals) = residuals(state, sights) else { return f64::INFINITY };
    let cost = |(residual, sight): (&Vector2<f64>, &Sight)| {
        let length = normalised(residual, sight);
        if length > most { most * (2.0 * length - most) } else { length * length }
    };
    let sum: f64 = residuals.iter().flatten().zip(sights.iter().flatten()).map(cost).sum();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

/// The state after a step; none where it is none of a camera, or too far to be believed.
fn moved(state: &State, step: &Step) -> Option<State> {
    let before = state.camera;
    let camera = with_parameters(before.size_px, &(parameters(&before) + step.lens));
    let far = |k: usize| (camera.focal_px[k] / before.focal_px[k] - 1.0).abs() > MOST_FOCAL_CHANGE;
    if camera.check().is_err() || far(0) || far(1) {
        return None;
    }
    let poses = state.poses.iter().zip(&step.poses).map(|(pose, by)| pose.moved(by)).collect();
    Some(State { camera, poses })
}

/// Root mean square length of residuals (px).
pub(super) fn rms<'a>(residuals: impl IntoIterator<Item = &'a Vec<Vector2<f64>>>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for residual in residuals.into_iter().flatten() {
        sum += residual.norm_squared();
        count += 1;
    }
    (sum / count.max(1) as f64).sqrt()
}
