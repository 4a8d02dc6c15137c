//! The phantom as ParaView opens it: VTK XML files, version 1.0, arrays inline (base64 of zlib blocks).
//!
//! [`write_vtu`] takes plain arrays (nodes, cells of 4 or 10 nodes, named fields) and [`write_vtp`] a cloud of
//! points with fields; neither knows what a fit is.

mod array;
mod cloud;
mod grid;
mod poke;
#[cfg(test)]
mod read_back;

pub use array::{Field, FieldValues};
pub use cloud::write_vtp;
pub use grid::{Cells, Grid, write_vtu};
pub(super) use poke::{write_markers, write_poke, write_restraint};
