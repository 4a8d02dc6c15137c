//! What a reader should know before trusting the published method's figures, in whole sentences.

use crate::fem::Order;
use crate::inverse::{Fit, PatchKind};
use crate::observation::Recording;
use crate::units::{newtons_per_metre, pascals};
use nalgebra::DVector;

/// What both steps found for one poke.
#[derive(Debug, Clone)]
pub(super) struct PokeResult {
    /// Index of the poke in the recording.
    pub(super) poke: usize,
    /// Whether step one met both stopping rules.
    pub(super) converged: bool,
    /// Steps of step one.
    pub(super) steps: usize,
    /// Young's modulus (Pa).
    pub(super) young_modulus_pa: f64,
    /// Ψ½ (m).
    pub(super) psi_half_m: f64,
    /// What Ψ½ would be for the observation's error alone (m).
    pub(super) error_half_m: f64,
    /// Components of the search displacements on their bound.
    pub(super) at_bound: usize,
    /// ϒ (N/m): sum over the search nodes.
    pub(super) total_n_per_m: f64,
    /// Forces on the body at the search nodes (3 Nₛ, N).
    pub(super) forces: DVector<f64>,
    /// Displacements of the search nodes (3 Nₛ, m).
    pub(super) search_m: DVector<f64>,
}

/// The remarks, the gravest first.
pub(super) fn remarks(
    recording: &Recording,
    fit: &Fit,
    element: Order,
    search_nodes: usize,
    results: &[PokeResult],
) -> Vec<String> {
    let number = |r: &PokeResult| recording.pokes[r.poke].number;
    let mut remarks = vec![format!(
        "The published method states no deviation, so that none is given. Poke by poke it found {}; the modulus is \
         the mean of these, the springs fit all pokes at once by least squares.",
        results
            .iter()
            .map(|r| format!(
                "{} and {} ({})",
                pascals(r.young_modulus_pa),
                newtons_per_metre(r.total_n_per_m),
                number(r)
            ))
            .collect::<Vec<_>>()
            .join(", ")
    )];
    let open: Vec<&PokeResult> = results.iter().filter(|r| !r.converged).collect();
    if !open.is_empty() {
        remarks.push(format!(
            "Step one did not meet both stopping rules on {} of {} pokes, and its last state counts: {}.",
            open.len(),
            results.len(),
            open.iter()
                .map(|r| format!(
                    "poke {}: {:.3} mm left a marker against an error of {:.3} mm, {} displacements on their bound \
                     after {} steps",
                    number(r),
                    r.psi_half_m * 1e3,
                    r.error_half_m * 1e3,
                    r.at_bound,
                    r.steps
                ))
                .collect::<Vec<_>>()
                .join("; ")
        ));
    }
    let left = &fit.residual;
    if left.chi2_per_dof > left.chi2_per_dof_limit {
        remarks.push(format!(
            "χ² per degree of freedom is {:.2}, noise alone leaves at most {:.3}: modulus and springs together do not \
             explain the markers.",
            left.chi2_per_dof, left.chi2_per_dof_limit
        ));
    }
    if element == Order::P1 {
        remarks.push(
            "First-order elements on the given mesh are too stiff, the more so the nearer to a local load: the \
             modulus may be off by tens of per cent."
                .to_owned(),
        );
    }
    let negative = fit
        .patches
        .iter()
        .filter(|p| matches!(p.kind, PatchKind::Springs { stiffness_n_per_m: k } if k.value < 0.0))
        .count();
    if negative > 0 {
        remarks.push(format!(
            "{negative} of {} patches have a stiffness below zero, which no restraint has.",
            fit.patches.len()
        ));
    }
    remarks.push(format!(
        "Springs stand on {search_nodes} nodes of the given mesh; those above 1 % of the stiffest were gathered into \
         patches of neighbours, and the total is over all nodes. A spring on a single node also bears on the mesh's \
         own softness there, so that stiffness depends on the mesh."
    ));
    remarks.push(
        "The recorded wrench drives the model at the deepest instant of each poke; the force is not explained by \
         it, and the stage's displacement is not used."
            .to_owned(),
    );
    remarks
}
