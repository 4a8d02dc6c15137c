//! Mesh files → tetrahedra with named surfaces, and back to Gmsh.
//!
//! Every parser takes bytes, does no input or output, allocates no more than the bytes can hold, and gives the
//! same `RawMesh`: nodes, tetrahedra and triangles by the name of their group. `assemble` makes the checked
//! [`TetMesh`](crate::mesh::TetMesh) of it.
//!
//! | format | what is read | groups |
//! | --- | --- | --- |
//! | Gmsh MSH 4.1, 2.2 | ASCII; binary, little endian | physical groups with names |
//!
//! In all formats the body is the volume group `phantom`; nodes that none of its tetrahedra uses are dropped.
//! Points and lines are ignored; any other element (second order, prisms, …) is refused by its name.

mod assemble;
mod cursor;
mod detect;
mod error;
mod gmsh;
mod msh2;
mod msh4;
mod write_msh;

pub use detect::{parse_mesh, read_mesh};
pub use error::{MeshFileError, Place};
pub use write_msh::write_msh;
