//! The whole body as each variant has it, for figures: step one's modulus and search displacements carried into
//! the body.

use super::{BlockExperiment, Method, Restraint, StepTwo, Study, Trial};
use crate::geometry::Vec3;
use crate::inverse::InverseError;

/// The body's displacement by one method.
#[derive(Debug, Clone)]
pub struct Shape {
    /// What restrained the ten nodes.
    pub restraint: Restraint,
    /// The method; nothing for the truth.
    pub method: Option<Method>,
    /// Whether its iteration converged.
    pub converged: bool,
    /// Displacement of every node of the experiment's mesh (m).
    pub displacement_m: Vec<Vec3>,
}

impl Study {
    /// The first seed's trials at the level nearest to 40 dB, as the published figures show it.
    pub fn shown(&self, restraint: Restraint) -> Vec<&Trial> {
        let of = |t: &&Trial| t.restraint == restraint && t.seed == self.settings.first_seed;
        let nearest = self
            .trials
            .iter()
            .filter(of)
            .map(|t| t.snr_db)
            .min_by(|a, b| (a - 40.0).abs().total_cmp(&(b - 40.0).abs()));
        self.trials.iter().filter(of).filter(|t| Some(t.snr_db) == nearest).collect()
    }
}

/// For every restraint the true shape (its search displacements in a body of the true modulus on the experiment's
/// mesh) and that of each trial shown; step two changes no shape, so that direct variants are left out.
///
/// # Errors
/// What the model reports.
pub fn shapes(study: &Study) -> Result<Vec<Shape>, InverseError> {
    let mut shapes = Vec::new();
    for (restraint, truth) in &study.truth {
        let shown: Vec<&Trial> = study
            .shown(*restraint)
            .into_iter()
            .filter(|t| !matches!(t.method, Method::Published { step_two: StepTwo::Direct, .. }))
            .collect();
        let mut states = vec![(BlockExperiment::YOUNG_MODULUS_PA, truth.as_slice())];
        states.extend(shown.iter().map(|t| (t.young_modulus_pa, t.search_m.as_slice())));
        let mut displaced = study.experiment.deformed(&states)?.into_iter();
        let of = |method, converged, displacement_m| Shape {
            restraint: *restraint,
            method,
            converged,
            displacement_m,
        };
        shapes.extend(displaced.next().map(|u| of(None, true, u)));
        shapes.extend(shown.iter().zip(displaced).map(|(t, u)| of(Some(t.method), t.converged, u)));
    }
    Ok(shapes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inverse::nodal::NodalProblem;

    /// The body carried along by its true search displacements moves its observed nodes as the springs have it.
    #[test]
    fn the_true_shape_shows_the_true_observations() {
        let experiment = BlockExperiment::new().expect("a block");
        let problem = NodalProblem::new(&experiment.condense().expect("condensed")).expect("ready");
        let springs = experiment.stiffness(Restraint::Springs(500.0));
        let (search, observed) = problem.displace(1e4, &springs).expect("displaced");
        let shape = &experiment.deformed(&[(1e4, search.as_slice())]).expect("a shape")[0];
        for (nodes, expected) in [(&experiment.observed, &observed), (&experiment.search, &search)] {
            for (i, &n) in nodes.iter().enumerate() {
                let off = shape[n as usize] - expected.fixed_rows::<3>(3 * i);
                assert!(off.norm() < 1e-9 * observed.amax(), "node {n}");
            }
        }
    }
}
