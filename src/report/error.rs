//! What can keep a report from being written.

use std::path::PathBuf;

/// Why a report was not written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file could not be made or filled.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A table could not be written.
    #[error("cannot write the table {}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What the writer said.
        source: csv::Error,
    },
    /// The result could not be put into JSON.
    #[error("cannot put the result into JSON")]
    Json(#[from] serde_json::Error),
    /// The mesh has no proper surface to draw.
    #[error("cannot draw the phantom")]
    Mesh(#[from] crate::mesh::MeshError),
    /// Pictures that cannot be put side by side.
    #[error("there is no picture to draw upon, or pictures have different sizes")]
    Picture,
    /// The fit speaks of another mesh than the recording.
    #[error("poke {poke}: the fit moves {displacements} nodes, but the mesh of the recording has {nodes}")]
    OtherMesh {
        /// Number of the poke.
        poke: u32,
        /// Displacements in the fit.
        displacements: usize,
        /// Nodes in the mesh.
        nodes: usize,
    },
    /// A field to be drawn has another length than what carries it.
    #[error("field `{field}` has {values} values; {expected} are needed")]
    FieldLength {
        /// Name of the field.
        field: String,
        /// Values given.
        values: usize,
        /// Values needed.
        expected: usize,
    },
    /// A cell names a node that does not exist.
    #[error("cell {cell} names node {node}, but there are {nodes}")]
    NoSuchNode {
        /// The cell, from zero.
        cell: usize,
        /// The node that it names.
        node: u32,
        /// How many nodes there are.
        nodes: usize,
    },
}
