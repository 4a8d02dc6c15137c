//! Which parameters explain the observations, and how surely.
//!
//! [`fit`] is the default method: it explains a recording of pokes with the modulus and with patches that slide on
//! the search surface. [`published`] is the two-step method that this work grew from, [`nodal`] the default method's
//! counterpart on a fixed set of nodes; [`experiment`] pits the two against each other on the published block.
//!
//! Symbols: `E` Young's modulus (Pa), `k` stiffness of a restraint patch (N/m), `s = E/k` its softness (1/m),
//! `C` compliance for a unit modulus (1/m).

mod blocks;
mod candidates;
mod condensed;
pub mod dead_load;
mod discretised;
mod elements;
mod error;
mod evidence;
pub mod experiment;
mod fit;
mod forward;
mod found;
mod grip;
pub mod l1;
mod lift;
mod limit;
mod nnls;
pub mod nodal;
mod outcome;
mod placed;
mod problem;
pub mod published;
mod refit;
mod residual;
mod restraint;
mod result;
mod rim;
mod rows;
mod search;
mod shared_error;
mod solve_error;
mod sprung;
mod sway;
mod tilt;
mod view;
mod wander;

pub use blocks::{Bench, Blocks, SiteBlocks, TipResponse};
pub use candidates::{Candidate, candidates};
pub use condensed::{Condensed, Loaded};
pub use discretised::{cut_finer, finer_level};
pub use elements::{ElementErrors, PatchErrors};
pub use error::InverseError;
pub use evidence::{DRIVE, Drive, DriveTrack, Driven, Evidence, Reading, Site, WEIGHT};
pub use fit::{Progress, Settings, fit, settled};
pub use forward::{Change, Forward, Group, NewDisc, Prediction, SitePrediction};
pub use found::Found;
pub use grip::Grip;
pub use lift::{DriveNoise, Driving, Lift};
pub use limit::{Correction, Difference, Finer, Level};
pub use nnls::{NonNegative, nnls};
pub use outcome::{Settled, outcome};
pub use placed::Placed;
pub use problem::{Linearised, Moved, Parameter, Problem, State};
pub use refit::refit;
pub use residual::Whitening;
pub use restraint::{Mounted, Restraint};
pub use result::{
    Discretisation, Estimate, Fit, FitMethod, MarkerView, Patch, PatchKind, PokeView, Residual, Sample,
};
pub use search::search;
pub use solve_error::SolveError;
pub use sway::{MARGIN_S, SETTLED_S, beyond_chance, sway_m2};
pub use wander::{BlockMean, FEWEST_MEANS, block_means, force_at_rest, wandering};
