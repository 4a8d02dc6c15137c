//! Whether a camera holds for pictures that it was not found from.

use super::Board;
use super::adjust::{Sight, State, residuals};
use super::calibrate::{LEAST_PICTURES, solve};
use super::normal::Free;
use nalgebra::Vector2;

/// Pictures that it takes: each half must give a camera.
pub(super) const HELD_OUT_PICTURES: usize = 2 * LEAST_PICTURES;

/// Residuals of each picture for a camera from the half of the pictures that it is not in, with only its pose adjusted; none with too
/// few pictures, and where a half alone gives no camera.
pub(super) fn held_out(
    state: &State,
    seen: &[Vec<Sight>],
    board: &Board,
    free: &Free,
) -> Option<Vec<Vec<Vector2<f64>>>> {
    if seen.len() < HELD_OUT_PICTURES {
        return None;
    }
    let mut all = vec![Vec::new(); seen.len()];
    for half in 0..2 {
        let [chosen, others] = [half, 1 - half].map(|h| (h..seen.len()).step_by(2).collect::<Vec<_>>());
        let ((mut own, own_seen), (mut other, other_seen)) =
            (state.part(&chosen, seen), state.part(&others, seen));
        solve(&mut own, &own_seen, board, free).ok()?;
        other.camera = own.camera;
        let solved = solve(&mut other, &other_seen, board, &[false; 9]).ok()?;
        for (k, left) in others.into_iter().zip(residuals(&other, &solved.sights)?) {
            all[k] = left;
        }
    }
    Some(all)
}
