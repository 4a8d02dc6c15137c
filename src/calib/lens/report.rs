//! From an adjustment to what is said of it.

use super::adjust::{Sight, State, residuals, rms, spread};
use super::calibrate::{Used, unknowns, without, without_offsets};
use super::extent::{apart_px, corner_radius, covered, folds, lens_sd_px, turned};
use super::held_out::held_out;
use super::normal::Free;
use super::{Board, LeftOut, LensError, LensFound, PictureFit};
use nalgebra::Vector2;

pub(super) fn report(
    state: &State,
    seen: &[Vec<Sight>],
    board: &Board,
    free: &Free,
    used: &Used,
) -> Result<LensFound, LensError> {
    let Used { pictures, strangers, outliers, before, solved } = used;
    let (part, part_seen) = state.part(pictures, seen);
    let nothing = vec![Vec::new(); pictures.len()];
    let part_seen = without(&part_seen, if before.is_some() { outliers } else { &nothing });
    let points: usize = part_seen.iter().map(Vec::len).sum();
    let freedom = (2 * points).saturating_sub(unknowns(free, pictures.len())).max(1);
    let chi2_per_dof = solved.leftover.chi2 / freedom as f64;
    let covariance = solved.leftover.covariance * chi2_per_dof.max(1.0);
    let sights = without_offsets(seen, state, board);
    let left = residuals(state, &sights).ok_or(LensError::NotABoard { picture: 0 })?;
    let held_out = held_out(&part, &part_seen, board, free);
    let place = |k: usize| pictures.iter().position(|&p| p == k);
    let held_out_rms = |k: usize| held_out.as_ref().zip(place(k)).map(|(left, p)| rms([&left[p]]));
    let own_outliers = |k: usize| {
        place(k).filter(|_| !strangers.contains(&k)).map_or_else(Vec::new, |p| outliers[p].clone())
    };
    let kept = |k: usize| -> Vec<Vector2<f64>> {
        let left_out = if before.is_some() { own_outliers(k) } else { Vec::new() };
        let points = left[k].iter().enumerate();
        points.filter(|(i, _)| !left_out.contains(i)).map(|(_, residual)| *residual).collect()
    };
    let fit = |k: usize| PictureFit {
        pose: state.poses[k],
        rms_px: rms([&kept(k)]),
        spread: spread(left[k].iter().zip(&sights[k])),
        stranger: strangers.contains(&k),
        held_out_rms_px: held_out_rms(k),
        outliers: own_outliers(k),
    };
    let used_left: Vec<_> = pictures.iter().map(|&k| kept(k)).collect();
    let left_out = before.map(|with_them| LeftOut {
        points: outliers.iter().map(Vec::len).sum(),
        with_them,
        moved_px: apart_px(&state.camera, &with_them).into_iter().fold(0.0, f64::max),
    });
    Ok(LensFound {
        camera: state.camera,
        covariance,
        lens_sd_px: lens_sd_px(&state.camera, &covariance),
        rms_px: rms(&used_left),
        chi2_per_dof,
        held_out_rms_px: held_out.as_ref().map(rms),
        pictures: (0..seen.len()).map(fit).collect(),
        turned_rad: turned(&part.poses),
        covered_radius: covered(&part, &part_seen),
        corner_radius: corner_radius(&state.camera),
        folds: folds(&state.camera),
        left_out,
    })
}
