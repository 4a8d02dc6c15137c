//! Where the dots are while nothing moves.

use super::Followed;
use crate::clock::HostTime;
use crate::geometry::{Mat3, Vec3};

/// A dot of the reference while nothing moves, in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestingDot {
    /// Its number in the reference.
    pub dot: usize,
    /// Mean (m).
    pub mean_m: Vec3,
    /// Covariance of the mean as scatter between frames has it (m²).
    pub covariance_m2: Mat3,
    /// Covariance of one place, as the tracker expects it, on average (m²).
    pub expected_m2: Mat3,
    /// Frames in which it was seen.
    pub frames: usize,
}

/// Frames that a mean needs, so that its scatter is known.
const LEAST: usize = 5;

/// Means over the frames between two times. Dots that were seen in fewer than five of them are left out.
pub fn dots_at_rest(followed: &Followed, from: HostTime, until: HostTime) -> Vec<RestingDot> {
    let within = || followed.frames.iter().filter(|frame| (from..=until).contains(&frame.host));
    (0..followed.reference.len())
        .filter_map(|dot| {
            let places = || within().filter_map(|frame| frame.places[dot].as_ref());
            let frames = places().count();
            if frames < LEAST {
                return None;
            }
            let count = frames as f64;
            let mean_m = places().map(|p| p.position_m).sum::<Vec3>() / count;
            let scatter: Mat3 =
                places().map(|p| (p.position_m - mean_m) * (p.position_m - mean_m).transpose()).sum();
            let expected_m2 = places().map(|p| p.covariance_m2).sum::<Mat3>() / count;
            Some(RestingDot {
                dot,
                mean_m,
                covariance_m2: scatter / ((count - 1.0) * count),
                expected_m2,
                frames,
            })
        })
        .collect()
}
