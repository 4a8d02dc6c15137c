//! Why a fit could not be made.

use crate::fem::FemError;
use crate::fem::finite::FiniteError;
use crate::fem::material::MaterialError;
use crate::observation::{Contact, TipShape};

/// What keeps a recording from being fitted.
#[derive(Debug, thiserror::Error)]
pub enum InverseError {
    /// The model of the phantom could not be built.
    #[error("the model of the phantom could not be built")]
    Fem(#[from] FemError),
    /// An optimisation failed.
    #[error("an optimisation failed")]
    Solve(#[from] super::SolveError),
    /// The stage was asked to drive the model but was not recorded.
    #[error("the recording has no stage.csv, so the stage cannot drive the model; the wrench can")]
    NoStage,
    /// A tip that touches the phantom bit by bit, or may lift off, and a weight that moves the surface away from it.
    #[error(
        "the tip ({shape:?}, {contact:?}) meets the surface as it goes, and the weight acts meanwhile \
         (gravity_at_rest = false): where the surface then is, is not modelled; let the wrench drive the model"
    )]
    MetUnderWeight {
        /// What holds it to the surface.
        contact: Contact,
        /// Its face.
        shape: TipShape,
    },
    /// The stage holds a rigid tip against turning where that matters, and the model does not.
    #[error(
        "at ({x:.4}, {y:.4}, {z:.4}) m, where the surface is not flat, the rigid flat tip would turn: holding its \
         rotation, which is not modelled there, takes up to {share_percent:.1} % off its compliance (limit {limit_percent:.1} %); let the wrench drive the \
         model", x = site_m[0], y = site_m[1], z = site_m[2],
        share_percent = 100.0 * share, limit_percent = 100.0 * limit
    )]
    TipTurns {
        /// The site (m).
        site_m: [f64; 3],
        /// Share of the tip's compliance, at most.
        share: f64,
        /// Largest share that is left out.
        limit: f64,
    },
    /// Nothing in the recording moves the model.
    #[error("the recording's {pokes} pokes hold no row in which anything moves: nothing can be fitted")]
    Nothing {
        /// Number of pokes.
        pokes: usize,
    },
    /// The fit did not converge.
    #[error(
        "the fit did not converge: a further step still promises to lower the misfit by {promised:.3e} (misfit \
         {misfit:.6e}), and none does"
    )]
    NotConverged {
        /// What a further step promises.
        promised: f64,
        /// Misfit reached.
        misfit: f64,
    },
    /// Patches keep coming and going.
    #[error(
        "the search for restraint did not settle: after {rounds} rounds, with {patches} patches, it still changes what \
         was found; the recording does not tell how the restraint is spread"
    )]
    NotSettled {
        /// Rounds made.
        rounds: usize,
        /// Patches at the end.
        patches: usize,
    },
    /// A load that should stand still changes.
    #[error(
        "{recording}, poke {poke}: the force scatters by {scatter_n:.3} N about {mean_n:.3} N; a dead load stands still"
    )]
    Unsteady {
        /// The recording.
        recording: String,
        /// Number of the poke.
        poke: u32,
        /// Standard deviation of the force (N).
        scatter_n: f64,
        /// Its mean (N).
        mean_n: f64,
    },
    /// Rest positions are those of a body that hangs by its weight already.
    #[error(
        "{recording}: its rest positions carry the sag (gravity_at_rest = true); the shape without weight, from which large \
         rotations are counted, is not known"
    )]
    SagAtRest {
        /// The recording.
        recording: String,
    },
    /// A load that a body at finite strain cannot carry: too large for it, or far from everything that it was seen under.
    #[error(
        "by this model the body has no equilibrium under a force of ({:.3}, {:.3}, {:.3}) N; expected a load near those that were recorded",
        force_n[0], force_n[1], force_n[2]
    )]
    NoEquilibrium {
        /// The force (N).
        force_n: [f64; 3],
        /// How the search for it ended.
        source: FiniteError,
    },
    /// The question that was put to a body at finite strain makes no sense.
    #[error("the body at finite strain")]
    Finite(#[from] FiniteError),
    /// A material at finite strain is none.
    #[error("the material at finite strain")]
    Material(#[from] MaterialError),
    /// The data do not determine the modulus.
    #[error("the recording does not determine Young's modulus: {why}")]
    Undetermined {
        /// What is missing.
        why: &'static str,
    },
}
