//! A bench with physics of its own: what a session on a known phantom would have recorded.
//!
//! Nothing here is shared with the fit but the ground floor and the recording's types. The fit uses tetrahedra on
//! the recording's mesh; the bench uses serendipity hexahedra on boxes of its own, graded towards the end of the glue
//! and to where tips and restraints come close to it and to edges, and hands the fit a mesh that knows nothing of these
//! places. So a fit of simulated data is never a fit of itself.
//!
//! Like the fit, the bench knows that a block looks like a half-space under a small disc, but by formulas and code of
//! its own (`half_space`, `near_field`, `linear`), checked against closed forms and against elements that hold the
//! whole field by themselves.
//!
//! The path: a [`Draw`] says everything about a session, concealed values included ([`draw`] makes one from a
//! seed); [`record`] computes the response of the phantom to each poke, lets the instruments watch it and returns a
//! [`Recording`](crate::observation::Recording). Equal draws give recordings equal to the last bit.
//!
//! A [`Draw`] conceals elasticity and restraint, linear or at finite strain. A [`World`] conceals what a fit may leave
//! out as well: memory, slack, slip, faults of the instruments and more, on phantoms that many sessions share (`world`).
//!
//! A camera above the bench (`pixel_camera`) makes pictures of the phantom's skin (`skin`), which bends as the bench says, in a room that knows
//! nothing of benches (`pixels`).
//!
//! Symbols: `E` Young's modulus (Pa), `K` stiffness, `C` compliance, `u` displacement (m), `ν` Poisson's ratio.

mod bench;
#[cfg(test)]
mod brute_force;
pub mod bytes;
mod demo;
mod draw;
mod equilibrium;
mod error;
mod fit_mesh;
mod half_space;
mod hex_mesh;
mod instruments;
mod large_strain;
mod legendre;
mod linear;
mod live_bench;
mod load_path;
mod near_field;
mod neo_hookean;
mod pixel_camera;
pub mod pixels;
mod quadratic;
mod random;
mod record;
#[cfg(test)]
mod refinement;
mod resolution;
mod seed;
mod skin;
mod stage_path;
mod supports;
mod timeline;
mod truth;
mod unknowns;
#[cfg(test)]
mod verification_large_strain;
#[cfg(test)]
mod verification_linear;
mod world;

pub use demo::demo;
pub use draw::{Draw, Instruments, Kinematics, PokePlan, Wander};
pub use error::SimError;
pub use hex_mesh::Slab;
pub use live_bench::{LiveBench, SimulatedMarkers};
pub use pixel_camera::{FramePipe, FrameSink, LiveCamera, PixelCamera, PixelCameraSetup, TruthTable};
pub use random::draw;
pub use record::record;
pub use resolution::{RemainderResolution, Resolution};
pub use skin::{Skin, SkinCut};
pub use stage_path::StageTeller;
pub use supports::Restraint;
pub use truth::{TrueRestraint, Truth};
pub use world::{
    Answer, Body, Disc, Effect, Figure, Foreign, Glimpse, Hold, Large, Live, Memory, Past, Phantom,
    PhantomPlan, Press, PronyTerm, Rig, SeenTip, Site, StiffeningLaw, Strength, Touch, World, stock,
};
