//! How far the zero of the force wanders: what the sensor shows while nothing touches the phantom.

use super::evidence::{Driven, Evidence};
use super::sway::{MARGIN_S, beyond_chance, touched};
use crate::geometry::Vec3;
use crate::observation::Recording;

/// Length of the means (s).
const BLOCK_S: f64 = 0.5;
/// Fewer means than this say nothing.
pub const FEWEST_MEANS: usize = 6;

/// Force rows outside pokes: time (s) and force (N).
pub fn force_at_rest(recording: &Recording) -> Vec<(f64, Vec3)> {
    let wrench = &recording.wrench;
    let rows = wrench.time_s.iter().zip(&wrench.force_n);
    rows.filter(|(t, _)| !touched(recording, **t, MARGIN_S)).map(|(t, f)| (*t, Vec3::from(*f))).collect()
}

/// Mean of the force (N) over a block, with its time (s) and the number of its rows.
pub struct BlockMean {
    /// Mean time of its rows (s).
    pub time_s: f64,
    /// Mean force (N).
    pub force_n: Vec3,
    /// Number of its rows.
    pub rows: f64,
}

/// Means over blocks of half a second of rows with their time (s).
pub fn block_means(rows: &[(f64, Vec3)]) -> Vec<BlockMean> {
    let blocks = rows.chunk_by(|(a, _), (b, _)| (a / BLOCK_S).floor() == (b / BLOCK_S).floor());
    let mean = |block: &[(f64, Vec3)]| {
        let rows = block.len() as f64;
        BlockMean {
            time_s: block.iter().map(|(t, _)| t).sum::<f64>() / rows,
            force_n: block.iter().map(|(_, f)| f).sum::<Vec3>() / rows,
            rows,
        }
    };
    blocks.map(mean).collect()
}

/// How far the means scatter beyond white noise; about a drift in proportion to time where there is one, about zero
/// otherwise. Variance over that of white noise, and its degrees of freedom.
pub fn wandering(means: &[BlockMean], sd: [f64; 3], drifts: bool) -> (f64, f64) {
    if means.len() < FEWEST_MEANS {
        return (1.0, f64::INFINITY);
    }
    let spread: f64 = means.iter().map(|m| m.rows * m.time_s * m.time_s).sum();
    let sum = |axis: usize| -> f64 {
        let along: f64 = means.iter().map(|m| m.rows * m.time_s * m.force_n[axis]).sum();
        let rate = if drifts { along / spread } else { 0.0 };
        let left = |m: &BlockMean| m.rows * ((m.force_n[axis] - rate * m.time_s) / sd[axis]).powi(2);
        means.iter().map(left).sum()
    };
    let freedom = 3.0 * (means.len() as f64 - f64::from(u8::from(drifts)));
    ((0..3).map(sum).sum::<f64>() / freedom, freedom)
}

/// Variance of the zero's wandering over that of a row, about a drift in proportion to time, of which a fit shall not make noise; zero where
/// chance may have made it. `sd_n`: noise of a row (N).
pub(super) fn wander(recording: &Recording, sd_n: [f64; 3]) -> f64 {
    let means = block_means(&force_at_rest(recording));
    let (ratio, freedom) = wandering(&means, sd_n, true);
    let rows = means.iter().map(|m| m.rows).sum::<f64>() / means.len().max(1) as f64;
    (beyond_chance(ratio, freedom) - 1.0) / rows.max(1.0)
}

/// Standard deviation of the zero along each axis (N), where the force is a reading and its zero wanders.
pub(super) fn zero_sd_n(evidence: &Evidence) -> Option<[f64; 3]> {
    let reads = evidence.driven == Driven::ByStage && evidence.wander > 0.0;
    reads.then(|| evidence.noise.force_n.map(|sd| sd * evidence.wander.sqrt()))
}
