//! What the model left out: where recording and baseline differ, which physics explains it, how much it changes, how surely.
//!
//! [`diagnose`] is the way in; [`Diagnosis`] is what comes out. The baseline is the default fit
//! ([`settled`](crate::inverse::settled)). Everything that may act besides is one set of values whose neutral member is
//! the baseline; one march in time predicts every row of the recording for any of them, with exact derivatives:
//!
//! | file | question |
//! | --- | --- |
//! | `run` | which steps lead to a diagnosis |
//! | `select`, `screen`, `thin`, `starts`, `scan` | which effects act: a look at every entry, refits of the best, one by one |
//! | `terms`, `law`, `gains` | which form of an effect acts: how many terms, which law, which axes |
//! | `model`, `rows`, `sums`, `refit` | what a reading of the recording predicts, and its best parameters |
//! | `march`, `memory`, `sticky`, `tip_path`, `camera`, `registration`, `uneven` | what the phantom, its restraint, the stage and the camera do in time |
//! | `body`, [`bulk`] | the condensed body, and linear changes of it |
//! | `extra`, [`large`] | what is not linear in the displacement |
//! | `hum`, `rest`, `lasting`, `creep` | how far the instruments' errors are from white |
//! | `left`, `beyond`, `place` | what a reading leaves: when, where, in which channel, how plainly |
//! | `verdict`, `why`, `rivals`, `in_step`, `confidence`, `parameters`, `spread`, `curves`, `plans`, `next_poke` | what is said, how surely, and what to do next |
//!
//! Symbols: `C` compliance for a unit modulus (1/m), `𝓔` the hereditary modulus, `q` force of the tip (N), `f` forces of the
//! restraint discs (N), `u` displacements (m), `J` derivative of the readings by the parameters.

mod along_path;
mod anew;
mod beyond;
mod body;
pub mod bulk;
mod camera;
mod confidence;
mod contact;
mod creep;
mod curves;
mod diagnosis;
mod dual;
mod effects;
mod error;
mod extra;
mod gains;
mod hum;
mod in_step;
mod kept;
mod knob;
mod known;
pub mod large;
mod lasting;
mod law;
mod left;
mod limits;
mod march;
mod memory;
mod model;
mod motion;
mod nearest;
mod next_poke;
mod parameters;
mod physics;
mod place;
mod plans;
mod refit;
mod registration;
mod rest;
mod restrained;
mod rivals;
mod rows;
mod run;
mod scan;
mod screen;
mod select;
mod slip;
mod spread;
mod starts;
mod sticky;
mod sums;
mod terms;
mod thin;
mod tip_path;
mod track;
mod undecided;
mod uneven;
mod verdict;
mod why;

pub use confidence::MOST_SURE;
pub use diagnosis::{
    Candidate, Channel, Choice, Curve, Diagnosis, Estimate, Evidence, Found, Mismatch, NextPoke, Parameter,
    Phase, Progress, Reading, Region, Restrained, Settings, Verdict,
};
pub use dual::Field;
pub use error::DiagnoseError;
pub use large::StiffeningLaw;
pub use physics::Physics;
pub use run::diagnose;
