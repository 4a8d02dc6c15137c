//! How far the camera moves as a whole: what all markers do in common while nothing touches the phantom.
//!
//! Between pokes the common motion is measured against what the markers' own noise makes of it. During a poke it is not known; readings of
//! one place are then whitened against a motion that all of its markers have in common as long as that place is poked, each place by itself.
//! Motion of markers against each other keeps its weight. What a phantom with a memory still moves between pokes counts as sway here.

use super::evidence::{Driven, Evidence};
use crate::geometry::Vec3;
use crate::observation::Recording;

/// Rows so close to a poke (s) do not count as rest.
pub const MARGIN_S: f64 = 0.05;
/// Nor do markers so soon after one: when and how fast the surface leaves the tip no model here says.
pub const SETTLED_S: f64 = 0.3;
/// Fewer frames than this say nothing.
const FEWEST: usize = 6;
/// Chance raises a variance of so many degrees of freedom by this many standard deviations, once in a thousand times.
const CHANCE: f64 = 3.1;

/// A ratio of variances, or 1 where chance may have made it.
pub fn beyond_chance(ratio: f64, freedom: f64) -> f64 {
    if ratio > 1.0 + CHANCE * (2.0 / freedom).sqrt() { ratio } else { 1.0 }
}

/// Variance (m²) of the markers' common motion between pokes along each axis, beyond what their own noise `sd_m` makes. `rest`: rest position (m)
/// and rows of every marker; `crept`: displacement (m) of a marker at a frame that is no motion of the camera, none where that is not known.
pub fn sway_m2(
    recording: &Recording,
    rest: &[(Vec3, usize)],
    sd_m: [f64; 3],
    crept: impl Fn(usize, usize) -> Option<Vec3>,
) -> [f64; 3] {
    let markers = &recording.markers;
    // Sum over all markers of their displacement from rest, frame by frame, and so many markers.
    let mut frames = vec![(Vec3::zeros(), 0.0); markers.frame_time_s.len()];
    for row in &markers.rows {
        let (at, rows) = rest[row.marker as usize];
        if rows > 0
            && let Some(crept) = crept(row.frame as usize, row.marker as usize)
        {
            let frame = &mut frames[row.frame as usize];
            frame.0 += Vec3::from(row.position_m) - at - crept;
            frame.1 += 1.0;
        }
    }
    let still = |t: f64| t >= recording.rest_until_s && !touched(recording, t, SETTLED_S);
    let rest_frames =
        markers.frame_time_s.iter().filter(|t| **t < recording.rest_until_s).count().max(1) as f64;
    let seen = frames.into_iter().zip(&markers.frame_time_s);
    let seen: Vec<(Vec3, f64)> = seen.filter(|(f, t)| f.1 > 0.0 && still(**t)).map(|(f, _)| f).collect();
    excess_m2(&seen, sd_m.map(|sd| sd * (1.0 + 1.0 / rest_frames).sqrt()))
}

/// Whether the tip may touch, or until so much later (s) something of that shows.
pub(super) fn touched(recording: &Recording, time_s: f64, later_s: f64) -> bool {
    recording.pokes.iter().any(|p| time_s >= p.start_s - MARGIN_S && time_s <= p.end_s + later_s)
}

/// Variance (m²) of frames' common motion beyond what noise `sd_m` of one marker makes; frames as the sum of their markers' displacements (m) and the
/// number of these.
fn excess_m2(frames: &[(Vec3, f64)], sd_m: [f64; 3]) -> [f64; 3] {
    if frames.len() < FEWEST {
        return [0.0; 3];
    }
    let n = frames.len() as f64;
    std::array::from_fn(|axis| {
        let white = |count: f64| sd_m[axis].powi(2) / count;
        let over_white = |(sum, count): &(Vec3, f64)| (sum[axis] / count).powi(2) / white(*count);
        let ratio = frames.iter().map(over_white).sum::<f64>() / n;
        (beyond_chance(ratio, n) - 1.0) * n / frames.iter().map(|f| white(f.1).recip()).sum::<f64>()
    })
}

/// Along which axes the camera sways, with the standard deviation (m): where the stage drives the model. What hangs on a known wrench and comes back
/// elsewhere moves as one as well.
pub(super) fn swaying(evidence: &Evidence) -> impl Iterator<Item = (usize, f64)> + '_ {
    let driven = evidence.driven == Driven::ByStage;
    let sways = move |axis: &usize| driven && evidence.sway_m2[*axis] > 0.0;
    (0..3).filter(sways).map(|axis| (axis, evidence.sway_m2[axis].sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A camera that sways along y: as much is found of it, however many markers are in view from frame to frame.
    #[test]
    fn sway_is_found_where_few_markers_are_in_view() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (sd, sway) = (50e-6, 12e-6);
        let mut frames = |sway: f64| -> Vec<(Vec3, f64)> {
            let counts = (0..2000).map(|i| if i % 2 == 0 { 100.0_f64 } else { 2.0 });
            counts
                .map(|n| {
                    let noise = Vec3::from_fn(|_, _| n.sqrt() * sd * normal());
                    (noise + Vec3::y() * (n * sway * normal()), n)
                })
                .collect()
        };
        let [x, y, z] = excess_m2(&frames(sway), [sd; 3]);
        assert!((y.sqrt() / sway - 1.0).abs() < 0.1 && x == 0.0 && z == 0.0, "{x} {y} {z}");
        assert_eq!(excess_m2(&frames(0.0), [sd; 3]), [0.0; 3]);
        assert_eq!(excess_m2(&frames(sway)[..FEWEST - 1], [sd; 3]), [0.0; 3]);
    }
}
