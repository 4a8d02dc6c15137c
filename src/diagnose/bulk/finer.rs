//! What finer elements would say: the pattern of a discretisation error.
//!
//! After a full fit, the finest discretisation that the fit was corrected by; after a quick one, the given mesh cut to
//! the resolution that a full fit starts from its finer ones with. Either way less the first discretisation. A full fit's
//! baseline already has the limit of fine elements in it: there a share is one of what was corrected.

use super::changes::BodyChange;
use crate::diagnose::DiagnoseError;
use crate::diagnose::body::{Shape, of_blocks};
use crate::inverse::{Bench, Level, Mounted, Settled, finer_level};
use nalgebra::DMatrix;

/// Finer less first discretisation.
pub(super) fn difference(settled: &Settled<'_>) -> Result<BodyChange, DiagnoseError> {
    let made;
    let level: &Level = match settled.finer {
        Some(finer) => &finer.fine,
        None => {
            made = finer_level(settled)?;
            &made
        }
    };
    let shapes = Shape::all(&settled.at.mounted.blocks)?;
    let of = |bench: &Bench, search: &[usize]| -> Result<[DMatrix<f64>; 4], DiagnoseError> {
        let mounted = Mounted::new(bench, search, &settled.at.state.patches)?;
        Ok(of_blocks(bench, &mounted.blocks, &shapes))
    };
    let first = of(&settled.problem.bench, &settled.problem.search)?;
    let finer = of(&level.bench, &level.search)?;
    let [tips_tips, discs_tips, discs_discs, markers] = std::array::from_fn(|i| &finer[i] - &first[i]);
    Ok(BodyChange::plain(tips_tips, discs_tips, discs_discs, markers))
}
