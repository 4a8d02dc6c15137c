//! Mesh files → tetrahedra with named surfaces, and back to Gmsh.
//!
//! Every parser takes bytes, does no input or output, allocates no more than the bytes can hold, and gives the
//! same `RawMesh`: nodes, tetrahedra and triangles by the name of their group. `assemble` makes the checked
//! [`TetMesh`](crate::mesh::TetMesh) of it.
//!
//! | format | what is read | groups |
//! | --- | --- | --- |
//! | Gmsh MSH 4.1, 2.2 | ASCII; binary, little endian | physical groups with names |
//! | legacy VTK 2.0 to 5.1 | unstructured grids; ASCII; binary (big endian by definition) | below |
//! | VTU | ASCII; base64; appended raw or base64; zlib or uncompressed; little endian; one piece | below |
//!
//! VTK has no names for groups. A cell-data array called `group` or `gmsh:physical` holds one whole number a
//! cell; field data names the numbers by one array a group, called like the group (`phantom`, `fixed`,
//! `search`, `observed`, …), whose first value is the number (a second one, the dimension, may follow).
//! Numbers without a name are no group. Tetrahedra are VTK cells of type 10, surface triangles of type 5.
//!
//! In all formats the body is the volume group `phantom`; nodes that none of its tetrahedra uses are dropped.
//! Points and lines are ignored; any other element (second order, prisms, …) is refused by its name.

mod array;
mod assemble;
mod cursor;
mod detect;
mod error;
mod gmsh;
mod msh2;
mod msh4;
mod vtk;
mod vtk_grid;
mod vtu;
mod vtu_data;
mod write_msh;

pub use detect::{parse_mesh, read_mesh};
pub use error::{MeshFileError, Place};
pub use write_msh::write_msh;
