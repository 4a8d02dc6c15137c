//! What shape a body has: first-order tetrahedra with named surfaces.
//!
//! A [`TetMesh`] is a geometry. How finely it must be cut for an answer of a given accuracy is decided later,
//! by refinement.

mod block;
mod boundary;
mod error;
mod locate;
mod quality;
mod refine;
mod tet_mesh;

pub use block::{Block, block};
pub use boundary::boundary_triangles;
pub use error::MeshError;
pub use locate::{Attachment, SurfaceIndex};
pub use quality::{Quality, check, quality};
pub use refine::refine;
pub use tet_mesh::{Surface, TetMesh};
