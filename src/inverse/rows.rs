//! What is left, row by row: the sums that `fit.json` reports, over all rows inside poke intervals.

use super::evidence::{DriveTrack, Driven, Evidence};
use super::forward::Prediction;
use super::result::Residual;
use super::sway::swaying;
use crate::clock::Rows;
use crate::geometry::Vec3;
use crate::observation::Recording;

/// What is left, in total and per poke.
pub(super) struct Left {
    /// In total.
    pub residual: Residual,
    /// Sum of squares over noise, per value, of every poke.
    pub per_poke: Vec<f64>,
}

/// Standard deviations above its mean that the limit allows: 99.9 % one-sided.
const LIMIT: f64 = 3.09;

/// Frames over which the camera's sway is taken to last.
const SWAY_FRAMES: f64 = 20.0;

/// Variance of a frame's sum of squares by what moves all of its markers together: the drive's noise, and the camera's sway, in three axes that
/// know nothing of each other.
fn of_frame(drive: f64, sway: f64) -> f64 {
    2.0 * (drive * drive + SWAY_FRAMES * sway * sway / 3.0)
}

/// Sums squared residuals over noise. The markers' noise includes that of their rest mean.
pub(super) fn leftovers(
    recording: &Recording,
    evidence: &Evidence,
    prediction: &Prediction,
    parameters: usize,
) -> Left {
    let noise = &evidence.noise;
    let drive = DriveTrack::new(recording, evidence.driven, &evidence.lifts, noise);
    let markers = recording.markers.numbers.len();
    let (mut force_sum, mut force_n, mut force_chi2) = (0.0, 0.0, 0.0);
    let (mut marker_sum, mut marker_n, mut marker_chi2) = (0.0, 0.0, 0.0);
    let mut seen = vec![0.0; markers];
    let mut expected_force = 0.0;
    let mut variance_force = 0.0;
    let mut per_poke = vec![0.0; recording.pokes.len()];
    // The drive's own noise moves all markers of a frame together.
    let (mut expected_marker, mut variance_frames) = (0.0, 0.0);
    let mut sway = [0.0; 3];
    swaying(evidence).for_each(|(axis, sd)| sway[axis] = sd * sd);
    for (site, map) in evidence.sites.iter().zip(&prediction.sites) {
        for &index in &site.pokes {
            let poke = &recording.pokes[index];
            let (mut chi2, mut values) = (0.0, 0.0);
            if evidence.driven == Driven::ByStage {
                for i in Rows::new(&recording.wrench.time_s).within(poke.start_s, poke.end_s) {
                    let Some(x) = drive.at(recording.wrench.time_s[i], index) else {
                        continue;
                    };
                    let left = Vec3::from(recording.wrench.force_n[i]) - &map.force * x.x;
                    let own = x.noise;
                    for axis in 0..3 {
                        let variance = noise.force_n[axis].powi(2);
                        force_sum += left[axis] * left[axis];
                        chi2 += left[axis] * left[axis] / variance;
                        // The stage's own noise shows in the force through the phantom's stiffness.
                        let row = map.force.row(axis);
                        let through = (row * own).dot(&row);
                        let expected = 1.0 + through / variance;
                        expected_force += expected + evidence.wander;
                        variance_force += 2.0 * expected * expected;
                        force_n += 1.0;
                        values += 1.0;
                    }
                }
                force_chi2 += chi2;
                // The zero is off alike in all rows of a poke, along each axis.
                variance_force += 2.0 * (values * evidence.wander).powi(2) / 3.0;
            }
            let mut frame = None;
            let (mut frame_through, mut frame_sways) = (0.0, 0.0);
            for (row, x) in drive.marker_rows(index) {
                if frame != Some(row.frame) {
                    variance_frames += of_frame(frame_through, frame_sways);
                    (frame, frame_through, frame_sways) = (Some(row.frame), 0.0, 0.0);
                }
                let m = row.marker as usize;
                let (rest, rest_rows) = evidence.rest[m];
                let moved = Vec3::from(row.position_m) - rest;
                let modelled = map.markers.rows(3 * m, 3) * x.x;
                let own = x.noise;
                for axis in 0..3 {
                    let left = moved[axis] - modelled[axis];
                    marker_sum += left * left;
                    let variance = noise.marker_m[axis].powi(2) * (1.0 + 1.0 / rest_rows.max(1) as f64);
                    let row = map.markers.row(3 * m + axis);
                    let through = (row * own).dot(&row);
                    frame_through += through / variance;
                    frame_sways += sway[axis] / variance;
                    expected_marker += 1.0 + (through + sway[axis]) / variance;
                    marker_chi2 += left * left / variance;
                    chi2 += left * left / variance;
                    marker_n += 1.0;
                    values += 1.0;
                }
                seen[m] += 1.0;
            }
            variance_frames += of_frame(frame_through, frame_sways);
            per_poke[index] = if values > 0.0 { chi2 / values } else { 0.0 };
        }
    }
    // The rest mean's error is common to a marker's n rows: of the n variances one is (1 + n/r) / (1 + 1/r), the
    // others 1 / (1 + 1/r), with r rest rows.
    let variance_markers: f64 = seen
        .iter()
        .zip(&evidence.rest)
        .filter(|(n, _)| **n > 0.0)
        .map(|(n, (_, r))| {
            let r = (*r).max(1) as f64;
            let share = 1.0 / (1.0 + 1.0 / r);
            3.0 * 2.0 * share * share * ((1.0 + n / r).powi(2) + (n - 1.0).max(0.0))
        })
        .sum();
    let values: f64 = force_n + marker_n;
    let freedom = (values - parameters as f64).max(1.0);
    let expected = expected_force + expected_marker - parameters as f64;
    let rms = |sum: f64, n: f64| if n > 0.0 { (sum / n).sqrt() } else { 0.0 };
    Left {
        residual: Residual {
            marker_rms_m: rms(marker_sum, marker_n),
            force_rms_n: rms(force_sum, force_n),
            chi2_per_dof: (force_chi2 + marker_chi2) / freedom,
            chi2_per_dof_expected: expected / freedom,
            chi2_per_dof_limit: (expected
                + LIMIT * (variance_force + variance_markers + variance_frames).sqrt())
                / freedom,
            rest_noise_over_stated: evidence.measured_over_stated,
        },
        per_poke,
    }
}
