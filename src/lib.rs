//! phantom-rig: pokes a soft phantom, records what happens, and finds its Young's modulus and the hidden
//! elastic restraint, with what is known about each.
//!
//! # Map
//! A room is a folder; its `mod.rs` is the front door. A room imports only rooms on lower floors, never a
//! peer; `tests/tidy.rs` holds the table.
//!
//! | floor | room | question it answers |
//! | --- | --- | --- |
//! | 0 | [`units`], [`clock`], [`geometry`] | what a number means: which unit, whose time, which frame |
//! | 0 | [`digest`] | whether bytes are what they were |
//! | 0 | [`mesh`] | what shape a body has |
//! | 0 | [`sparse`] | how a large sparse system is solved |
//! | 1 | [`device`] | what a stage, a force sensor, a depth camera and a source of marker positions are |
//! | 1 | [`observation`] | what was observed in one poke |
//! | 1 | [`fem`] | what the phantom does under a load |
//! | 2 | [`driver`] | how real hardware speaks |
//! | 2 | [`sim`] | a bench with physics of its own, sharing no element, load or material with [`fem`]; also at the level of bytes |
//! | 2 | [`session`] | what was recorded, safely; a recording as devices again |
//! | 2 | [`track`] | where the dots of a camera's pictures are, and which is which |
//! | 2 | [`calib`] | reference values, and what camera, force sensor and stage are worth, each with its uncertainty |
//! | 2 | [`inverse`] | which parameters explain the observations, and how surely |
//! | 3 | [`diagnose`] | what the model left out |
//! | 3 | [`dataset`] | sessions and recording bundles turned into observations, and back |
//! | 3 | [`acquire`] | how a protocol is checked, run and stopped |
//! | 3 | [`rig`] | which devices stand behind a configuration |
//! | 4 | [`report`] | what a person should see |
//! | 5 | [`cli`] | what was typed, and the exit code |
//!
//! # The path to read first
//! `cli::fit` → `dataset::read_bundle` → `inverse::fit` (which asks `fem` for the condensed compliance of the
//! phantom) → `report::write_fit`.
//!
//! # Invariants
//! - SI units and `f64` inside; a value at an edge carries its unit in its name.
//! - [`fem`], [`inverse`], [`observation`] and [`track`] do no input or output, read no clock and hold no globals.
//!   Randomness enters as a seed; results do not depend on the number of threads.
//! - [`sim`] shares only floor 0 with the fit, so that a fit of simulated data is never a fit of itself.
//! - A solver never returns an unconverged state as if it were a result.
//!
//! # Frame and signs
//! Everything is in the phantom frame (right-handed, the mesh's coordinates). Forces are those of the tip on
//! the phantom.

pub mod acquire;
pub mod calib;
pub mod cli;
pub mod clock;
pub mod dataset;
pub mod device;
pub mod diagnose;
pub mod digest;
pub mod driver;
pub mod fem;
pub mod geometry;
pub mod inverse;
pub mod mesh;
pub mod observation;
pub mod report;
pub mod rig;
pub mod session;
pub mod sim;
pub mod sparse;
pub mod track;
pub mod units;
