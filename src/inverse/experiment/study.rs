//! One experiment, many noise levels and seeds: every method on the same data.
//!
//! Noise is white and normal, its standard deviation the root mean square of all observed components times
//! 10^(−SNR/20). Seed s draws the same normal numbers at every level.

use super::{BlockExperiment, Restraint};
use crate::inverse::nodal::{self, Bound, NodalProblem, Outline};
use crate::inverse::published::{
    Regularisation, StepOne, StepOneFit, StepOneRules, equivalent_stiffness, reactions, search_forces,
};
use crate::inverse::{Condensed, SolveError};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// How modulus and springs were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Method {
    /// The published method: step one with this regularisation, step two by l1 or directly.
    Published {
        /// Place among energy, unit, scaled unit and none.
        regularisation: usize,
        /// Step two.
        step_two: StepTwo,
    },
    /// The default nodal estimate.
    Default,
}

/// How the published method's second step was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum StepTwo {
    /// Not at all: nodes that are held have no stiffness to be found.
    Skipped,
    /// By the l1 problem.
    L1,
    /// Directly.
    Direct,
}

/// Step one's variants, with the names that tables give them.
const REGULARISATIONS: [(Regularisation, &str); 4] = [
    (Regularisation::Energy, "energy"),
    (Regularisation::Unit, "unit"),
    (Regularisation::UnitScaled, "unit, scaled"),
    (Regularisation::None, "none"),
];

impl Method {
    /// Its name in tables.
    pub fn name(self) -> String {
        match self {
            Self::Default => "default".to_owned(),
            Self::Published { regularisation, step_two } => {
                let step_two = match step_two {
                    StepTwo::Skipped => "",
                    StepTwo::L1 => " + l1",
                    StepTwo::Direct => " + direct",
                };
                format!("{}{step_two}", REGULARISATIONS[regularisation].1)
            }
        }
    }
}

/// What to run.
#[derive(Debug, Clone, PartialEq)]
pub struct StudySettings {
    /// How many seeds are drawn.
    pub seeds: u64,
    /// The first of them.
    pub first_seed: u64,
    /// Signal-to-noise ratios (dB); infinite for none, of which one seed is run.
    pub snr_db: Vec<f64>,
    /// Whether the data come from a finer mesh of second order instead of the model's own.
    pub finer_data: bool,
    /// Whether springs that differ from node to node are studied too.
    pub unequal: bool,
}

/// One method on one data set.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// What restrained the ten nodes.
    pub restraint: Restraint,
    /// Signal-to-noise ratio (dB).
    pub snr_db: f64,
    /// Seed.
    pub seed: u64,
    /// Method.
    pub method: Method,
    /// Whether its iteration converged; the figures are those of the last state otherwise.
    pub converged: bool,
    /// Young's modulus (Pa).
    pub young_modulus_pa: f64,
    /// Ψ½ (m), equation 1.
    pub psi_half_m: f64,
    /// Φ½ (m), equation 2.
    pub phi_half_m: f64,
    /// Γ (N/m): sum over the nodes that are restrained.
    pub gamma_n_per_m: f64,
    /// ϒ (N/m): sum over all search nodes.
    pub upsilon_n_per_m: f64,
    /// Stiffness of each search node (N/m).
    pub stiffness_n_per_m: Vec<f64>,
    /// Displacements of the search nodes (3 Nₛ, m).
    pub search_m: Vec<f64>,
}

/// Everything that a study found.
#[derive(Debug, Clone)]
pub struct Study {
    /// What was run.
    pub settings: StudySettings,
    /// The experiment.
    pub experiment: BlockExperiment,
    /// True search displacements for each restraint (3 Nₛ, m).
    pub truth: Vec<(Restraint, Vec<f64>)>,
    /// Cramér–Rao bounds on the model's mesh, support known: restraint, level, bound.
    pub bounds: Vec<(Restraint, f64, Bound)>,
    /// All trials, in order of restraint, level, seed, method.
    pub trials: Vec<Trial>,
    /// Fits that gave nothing: restraint, level, seed, why.
    pub failures: Vec<(Restraint, f64, u64, String)>,
}

impl StudySettings {
    /// The restraints that are studied.
    pub fn restraints(&self) -> Vec<Restraint> {
        let mut all = vec![Restraint::Fixed, Restraint::Springs(500.0)];
        if self.unequal {
            all.push(Restraint::Unequal(500.0));
        }
        all
    }
}

struct Bench {
    body: Condensed,
    nodal: NodalProblem,
    outline: Outline,
    step_one: Vec<StepOne>,
}

/// Runs the study; `done` is called after every data set.
///
/// # Errors
/// What keeps the models from being built.
pub fn study(
    settings: &StudySettings,
    done: &(dyn Fn() + Sync),
) -> Result<Study, crate::inverse::InverseError> {
    let experiment = BlockExperiment::new()?;
    let body = experiment.condense()?;
    let nodal = NodalProblem::new(&body)?;
    let step_one: Result<Vec<StepOne>, SolveError> =
        REGULARISATIONS.iter().map(|&(r, _)| StepOne::new(&body, r)).collect();
    let source = match settings.finer_data {
        true => NodalProblem::new(&experiment.condense_finer()?)?,
        false => nodal.clone(),
    };
    let outline = Outline::new(&experiment.search_places());
    let bench = Bench { body, nodal, outline, step_one: step_one? };
    let settings = settings.clone();
    let mut found =
        Study { settings, experiment, truth: vec![], bounds: vec![], trials: vec![], failures: vec![] };
    for restraint in found.settings.restraints() {
        let stiffness = found.experiment.stiffness(restraint);
        let (search, observed) = source.displace(BlockExperiment::YOUNG_MODULUS_PA, &stiffness)?;
        for snr_db in found.settings.snr_db.clone() {
            let sigma_m = observed.norm() / (observed.len() as f64).sqrt() * 10_f64.powf(-snr_db / 20.0);
            if sigma_m > 0.0 {
                let on = &found.experiment.restrained;
                let known: Vec<f64> = on.iter().map(|&j| stiffness[j]).collect();
                let e = BlockExperiment::YOUNG_MODULUS_PA;
                found.bounds.push((restraint, snr_db, nodal::bound(&bench.nodal, e, on, &known, sigma_m)?));
            }
            let first = found.settings.first_seed;
            let seeds = if sigma_m > 0.0 { found.settings.seeds } else { found.settings.seeds.min(1) };
            let results: Vec<(u64, Vec<Result<Trial, SolveError>>)> = (first..first + seeds)
                .into_par_iter()
                .map(|seed| {
                    let data = Data { restraint, snr_db, seed, sigma_m, search: &search };
                    let trials = data.all(&bench, &found.experiment, &observed);
                    done();
                    (seed, trials)
                })
                .collect();
            for (seed, trials) in results {
                for trial in trials {
                    match trial {
                        Ok(trial) => found.trials.push(trial),
                        Err(e) => found.failures.push((restraint, snr_db, seed, e.to_string())),
                    }
                }
            }
        }
        found.truth.push((restraint, search.as_slice().to_vec()));
    }
    Ok(found)
}

/// One data set.
struct Data<'a> {
    restraint: Restraint,
    snr_db: f64,
    seed: u64,
    sigma_m: f64,
    search: &'a DVector<f64>,
}

impl Data<'_> {
    fn all(
        &self,
        bench: &Bench,
        experiment: &BlockExperiment,
        truth: &DVector<f64>,
    ) -> Vec<Result<Trial, SolveError>> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let observed = truth.map(|u| {
            let z: f64 = StandardNormal.sample(&mut rng);
            u + self.sigma_m * z
        });
        let mut trials = Vec::new();
        for regularisation in 0..REGULARISATIONS.len() {
            match self.step_one(&bench.step_one[regularisation], &observed) {
                Ok((fit, converged)) => {
                    let steps: &[StepTwo] = match self.restraint {
                        Restraint::Fixed => &[StepTwo::Skipped],
                        Restraint::Springs(_) | Restraint::Unequal(_) => &[StepTwo::L1, StepTwo::Direct],
                    };
                    for &step_two in steps {
                        let stiffness = self.step_two(bench, &observed, &fit, step_two);
                        trials.push(stiffness.map(|stiffness| {
                            let method = Method::Published { regularisation, step_two };
                            let found = (fit.young_modulus_pa, fit.psi_m2.sqrt());
                            self.trial(experiment, method, converged, found, &fit.search_m, stiffness)
                        }));
                    }
                }
                Err(e) => trials.push(Err(e)),
            }
        }
        trials.push(self.default(bench, experiment, &observed));
        trials
    }

    /// Step one and whether it converged; the last state counts when it did not.
    fn step_one(&self, one: &StepOne, observed: &DVector<f64>) -> Result<(StepOneFit, bool), SolveError> {
        let error = self.sigma_m * (observed.len() as f64).sqrt();
        match one.fit(observed, error, &StepOneRules::BLOCK) {
            Ok(fit) => Ok((fit, true)),
            Err(SolveError::StepOne { last, .. }) => Ok((*last, false)),
            Err(e) => Err(e),
        }
    }

    /// One stiffness a search node; not a number where step two is skipped.
    fn step_two(
        &self,
        bench: &Bench,
        observed: &DVector<f64>,
        fit: &StepOneFit,
        how: StepTwo,
    ) -> Result<Vec<f64>, SolveError> {
        let forces = match how {
            StepTwo::Skipped => return Ok(vec![f64::NAN; fit.search_m.len() / 3]),
            StepTwo::L1 => search_forces(&bench.body, fit.young_modulus_pa, observed, self.sigma_m)?.x,
            StepTwo::Direct => reactions(&bench.body, fit.young_modulus_pa, &fit.search_m)?,
        };
        Ok(equivalent_stiffness(&forces, &fit.search_m))
    }

    fn default(
        &self,
        bench: &Bench,
        experiment: &BlockExperiment,
        observed: &DVector<f64>,
    ) -> Result<Trial, SolveError> {
        // Data without noise are taken as known to 60 dB: the likelihood needs a width.
        let sigma_m = self.sigma_m.max(1e-3 * observed.norm() / (observed.len() as f64).sqrt());
        let fit = nodal::fit(&bench.nodal, &bench.outline, &bench.nodal.reduce(observed, sigma_m)?)?;
        let modulus = fit.young_modulus_pa.value;
        let (search, modelled) = bench.nodal.displace(modulus, &fit.stiffness_n_per_m)?;
        let psi_half_m = (observed - modelled).norm() / (observed.len() as f64 / 3.0).sqrt();
        Ok(self.trial(
            experiment,
            Method::Default,
            true,
            (modulus, psi_half_m),
            &search,
            fit.stiffness_n_per_m,
        ))
    }

    /// A trial from modulus (Pa) and Ψ½ (m), search displacements and springs.
    fn trial(
        &self,
        experiment: &BlockExperiment,
        method: Method,
        converged: bool,
        (young_modulus_pa, psi_half_m): (f64, f64),
        search_m: &DVector<f64>,
        stiffness_n_per_m: Vec<f64>,
    ) -> Trial {
        Trial {
            restraint: self.restraint,
            snr_db: self.snr_db,
            seed: self.seed,
            method,
            converged,
            young_modulus_pa,
            psi_half_m,
            phi_half_m: (search_m - self.search).norm() / (search_m.len() as f64 / 3.0).sqrt(),
            gamma_n_per_m: experiment.restrained.iter().map(|&j| stiffness_n_per_m[j]).sum(),
            upsilon_n_per_m: stiffness_n_per_m.iter().sum(),
            stiffness_n_per_m,
            search_m: search_m.as_slice().to_vec(),
        }
    }
}
