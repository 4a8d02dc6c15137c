//! Recording bundles turned into observations, and back.
//!
//! A bundle is a folder of plain text: `recording.toml`, a mesh, `pokes.csv`, `force.csv`, `markers.csv` and
//! perhaps `stage.csv`, all in SI units, in the phantom frame and on one clock. [`read_bundle`] either gives a
//! checked [`Recording`](crate::observation::Recording) or says which file, row and column is wrong, and what
//! was expected there ([`DatasetError`]). What is allowed but looks like a mistake, such as a length in
//! millimetres or a noise that the rest interval contradicts, comes back as a [`Suspicion`].
//!
//! Meshes are read from Gmsh MSH 2.2 and 4.1, legacy VTK and VTU ([`read_mesh`], [`parse_mesh`]); what each
//! format must hold is written in [`MeshFileError`]'s module and in the parsers. A bundle's mesh is `mesh.msh`;
//! without it `mesh.vtu`, without that `mesh.vtk`.
//!
//! # The path to read first
//! `bundle` (the order of the checks) → `manifest`, `table`, `channels`, `pokes` (one file each) → `attach`
//! (whether pokes and markers lie on the mesh) → `suspicion`.

mod attach;
mod bundle;
mod channels;
mod error;
mod manifest;
mod mesh_file;
mod pokes;
mod protocol;
mod rest;
mod seen;
mod session;
mod survey;
mod suspicion;
mod table;
mod text;
mod write;

pub use bundle::{MESH_FILES, read_bundle, read_phantom};
pub use error::DatasetError;
pub use mesh_file::{MeshFileError, Place, parse_mesh, read_mesh, write_msh};
pub use protocol::read_planned_pokes;
pub use rest::{ChannelNoise, RestNoise, rest_noise};
pub use seen::{
    Attached, Eye, Followed, FollowedFrame, FrameCounts, Place as DotPlace, RestingDot, attach_dots,
    dots_at_rest, follow,
};
pub use session::{FromSession, first_rest, read_seen_sessions, read_sessions};
pub use survey::{ChannelSurvey, MarkerSurvey, MeshSurvey, PokeSurvey, SurfaceSurvey, Survey, survey};
pub use suspicion::Suspicion;
pub use write::write_bundle;
