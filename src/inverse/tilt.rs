//! Whether a rigid flat tip on ground that is not flat may be left free to turn: its response to a force → how much stiffer it would be, were
//! its rotation held as the stage holds it.
//!
//! The model's tip carries a force and no moment. Under a force `f` the face turns by `G f`; a moment turns it by
//! `D`, at least that of the half-space under it. Holding the rotation takes `S = Gᵀ D⁻¹ G` off its compliance
//! `C`: along the softest direction a share of `C⁻¹ S`, which is what is left out. Over glued ground it is some
//! millionths; on a part that overhangs, where a push bends the body, it reaches tenths.

use super::blocks::{Bench, TipResponse};
use super::error::InverseError;
use super::evidence::Evidence;
use crate::fem::{Model, Profile, Response, Spot, SpotKind, turning_compliance};
use crate::geometry::{Mat3, basis_from_axis};

/// Largest share of a tip's stiffness that may be left out.
const NEGLIGIBLE: f64 = 0.01;

/// Refuses a rigid tip whose held rotation would change its stiffness by more than one per cent.
pub(super) fn turns_little(bench: &Bench, evidence: &Evidence) -> Result<(), InverseError> {
    for (site, (tip, response)) in bench.tips.iter().zip(bench.tip_responses()).enumerate() {
        let TipResponse::Ports { responses, .. } = response else { continue };
        // A tip that reads its displacement in one port is free to turn.
        let ([port], [response]) = (tip.ports(), &responses[..]) else { continue };
        let share = left_out(&bench.model, port, response);
        if share > NEGLIGIBLE {
            return Err(InverseError::TipTurns {
                site_m: evidence.sites[site].centre.into(),
                share,
                limit: NEGLIGIBLE,
            });
        }
    }
    Ok(())
}

/// Share of the tip's compliance that holding its rotation would take off, at most; 0 for a soft pad.
fn left_out(model: &Model, tip: &Spot, response: &Response) -> f64 {
    let SpotKind::Disc { disc, profile: Profile::Rigid, .. } = tip.kind else { return 0.0 };
    let basis = basis_from_axis(&disc.normal);
    let [x, y] = [0, 1].map(|k| {
        let tangent = basis.column(k).into_owned();
        // Rows in the face's own axes; columns are forces along those of the phantom.
        basis.transpose() * response.slope_at(&tip.slope(model.space(), &tangent), tip, &tangent)
    });
    let turning = Mat3::from_rows(&[y.row(2).into(), -x.row(2), (x.row(1) - y.row(0)) * 0.5]);
    let [tilt, twist] = turning_compliance(disc.radius, model.poisson_ratio());
    let taken =
        turning.transpose() * Mat3::from_diagonal(&[tilt, tilt, twist].map(f64::recip).into()) * turning;
    let compliance = response.at(tip);
    let symmetric = (compliance + compliance.transpose()) * 0.5;
    match symmetric.cholesky().and_then(|c| c.l().try_inverse()) {
        Some(inverse) => (inverse * taken * inverse.transpose()).symmetric_eigenvalues().max(),
        None => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::Order;
    use crate::geometry::Vec3;
    use crate::mesh::{Block, block};

    /// A slab glued on the left 60 mm of its base: pushed over the glue the tip stays level, pushed on the
    /// overhanging part it turns, a larger one more.
    #[test]
    fn a_tip_turns_where_the_slab_overhangs() {
        let mut mesh = block(&Block { size_m: [0.15, 0.1, 0.025], cells: [15, 10, 3] }).expect("a block");
        let glue = mesh
            .surface("z-")
            .iter()
            .copied()
            .filter(|t| t.iter().all(|&n| mesh.nodes[n as usize].x < 0.0601))
            .collect();
        mesh.surfaces.insert("fixed".to_owned(), glue);
        let model = Model::new(&mesh, Order::P1, 0.47, "fixed").expect("held");
        let top = model.space().surface("z+");
        let share = |x: f64, radius: f64, rigid: bool| {
            let centre = Vec3::new(x, 0.05, 0.025);
            let tip = if rigid {
                Spot::rigid_disc(model.space(), top, &centre, radius)
            } else {
                Spot::disc(model.space(), top, &centre, radius)
            };
            let tip = tip.expect("on the top");
            left_out(&model, &tip, &model.respond(&[&tip]).expect("solved")[0])
        };
        assert!(share(0.03, 0.005, true) < 0.1 * NEGLIGIBLE);
        assert!(share(0.1, 0.005, true) > NEGLIGIBLE);
        assert!(share(0.1, 0.008, true) > 2.0 * share(0.1, 0.005, true));
        assert_eq!(share(0.1, 0.008, false), 0.0);
    }
}
