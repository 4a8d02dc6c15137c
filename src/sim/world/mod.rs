//! The bench with everything that a fit may leave out: phantom, holds, tip and instruments, each with switches.
//!
//! A [`World`] says everything about one session, effects included; equal worlds make recordings equal to the last bit.
//! [`Phantom::prepare`] does what many sessions on one phantom share, once: it condenses the block to all sites, patches
//! and markers that sessions may use. [`World::record`] then takes fractions of a second, because what is left is dense
//! algebra on a few dozen numbers:
//!
//! 1. `motion`: what the stage reports becomes what the tip does (backlash, late contact, …).
//! 2. `history`: the condensed phantom, its holds and the tip go through the session in small steps of time, with memory
//!    and with laws that are not linear.
//! 3. `force_sensor`, `camera`: what happened becomes what is reported.
//!
//! Effects come in families, one file each, that share no code: what only the instruments and the stage do ([`Rig`]), a
//! body that is another linear one ([`Body`]), memory ([`Memory`]), what is not linear in holds and contact ([`Touch`]),
//! large strain ([`Large`]), and what the physics catalogue does not list ([`Foreign`]).
//!
//! Symbols: `C` compliance at E = 1 Pa (m/N · Pa), `W` displacement of markers likewise, `λ` forces of the supports on
//! the phantom (N), `w = C y` displacements of the supports (m); `y` (N/Pa) is λ/E without memory.

mod altered;
mod answer;
mod body;
mod camera;
mod conceal;
mod condensed;
mod effect;
mod force_sensor;
mod foreign;
mod glimpse;
mod happened;
mod history;
mod hold_law;
mod large;
mod live;
mod memory;
mod motion;
mod past;
mod phantom;
mod plan;
mod record;
mod rig;
mod stock;
mod strength;
mod touch;

pub use answer::{Answer, Figure};
pub use body::Body;
pub use effect::Effect;
pub use foreign::Foreign;
pub use glimpse::{Glimpse, SeenTip};
pub use large::{Large, StiffeningLaw};
pub use live::Live;
pub use memory::{Memory, PronyTerm};
pub use past::Past;
pub use phantom::{Disc, Phantom, PhantomPlan, Site};
pub use plan::{Hold, Press, World};
pub use rig::Rig;
pub use stock::stock;
pub use strength::Strength;
pub use touch::Touch;
