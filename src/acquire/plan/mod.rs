//! What the bench will do for a protocol, and what speaks against it, before anything moves.
//!
//! [`Plan::new`] lays the motions of all steps one after the other with their times, and lists every [`Violation`] of what the
//! [`Bench`] can and may do. Only a [`CheckedPlan`] is run. What can be done and is probably not meant is in [`Plan::doubts`].
//!
//! Times are those of ideal trapezoids ([`Trapezoid`]); forces are estimates from a range of stiffness ([`pad_stiffness_n_per_m`]):
//! linear, one poke at a time, no lateral reaction. The phantom is taken for a box, of which the tip touches the face that it looks at;
//! the tip's shank is not looked at.
//!
//! Overshoot: when the stage is stopped at speed `v`, it goes `v t + v²/2a` on, `t` the latency and `a` the
//! deceleration; the force rises by at most the greatest stiffness times that, and has to stay within the sensor's range.

mod bench;
mod canvas;
mod check;
mod doubt;
mod drawing;
#[cfg(test)]
mod fixture;
#[cfg(test)]
mod fuzz;
mod lay;
mod motions;
mod side_view;
mod stiffness;
mod strip;
mod table;
#[cfg(test)]
mod timing;
mod trapezoid;
mod violation;
#[cfg(test)]
mod violations;

pub use bench::{Bench, Latency, LoadLimits, PhantomBox, Stream};
pub use motions::{CheckedPlan, Contact, Leg, Phase, Plan, PlanStep};
pub use stiffness::pad_stiffness_n_per_m;
pub use trapezoid::Trapezoid;
pub use violation::{At, Breach, Violation};
