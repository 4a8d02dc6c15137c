//! From an adjustment to what is said of it.

use super::adjust::{Sight, State, normalised, residuals, rms, spread};
use super::calibrate::{Used, unknowns, without_offsets};
use super::extent::{corner_radius, covered, folds, lens_sd_px, turned};
use super::held_out::held_out;
use super::normal::Free;
use super::{Board, LensError, LensFound, PictureFit};

/// A point this many standard deviations from where it should be is an outlier.
const OUTLIER: f64 = 5.0;

pub(super) fn report(
    state: &State,
    seen: &[Vec<Sight>],
    board: &Board,
    free: &Free,
    used: &Used,
) -> Result<LensFound, LensError> {
    let Used { pictures, strangers, solved } = used;
    let (part, part_seen) = state.part(pictures, seen);
    let points: usize = part_seen.iter().map(Vec::len).sum();
    let freedom = (2 * points).saturating_sub(unknowns(free, pictures.len())).max(1);
    let chi2_per_dof = solved.leftover.chi2 / freedom as f64;
    let covariance = solved.leftover.covariance * chi2_per_dof.max(1.0);
    let sights = without_offsets(seen, state, board);
    let left = residuals(state, &sights).ok_or(LensError::NotABoard { picture: 0 })?;
    let held_out = held_out(&part, &part_seen, board, free);
    let held_out_rms = |k: usize| {
        let place = pictures.iter().position(|&p| p == k)?;
        held_out.as_ref().map(|residuals| rms([&residuals[place]]))
    };
    let fit = |k: usize| {
        let pairs = || left[k].iter().zip(&sights[k]);
        let stranger = strangers.contains(&k);
        let far = |(i, (r, s))| (normalised(r, s) > OUTLIER * solved.excess && !stranger).then_some(i);
        PictureFit {
            pose: state.poses[k],
            rms_px: rms([&left[k]]),
            spread: spread(pairs()),
            stranger,
            held_out_rms_px: held_out_rms(k),
            outliers: pairs().enumerate().filter_map(far).collect(),
        }
    };
    Ok(LensFound {
        camera: state.camera,
        covariance,
        lens_sd_px: lens_sd_px(&state.camera, &covariance),
        rms_px: rms(pictures.iter().map(|&k| &left[k])),
        chi2_per_dof,
        held_out_rms_px: held_out.as_ref().map(rms),
        pictures: (0..seen.len()).map(fit).collect(),
        turned_rad: turned(&part.poses),
        covered_radius: covered(&part, &part_seen),
        corner_radius: corner_radius(&state.camera),
        folds: folds(&state.camera),
    })
}
