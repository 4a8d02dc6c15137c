//! What can be wrong with a mesh.

/// Why a mesh was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A tetrahedron without positive volume.
    #[error("tetrahedron {tet} has volume {volume_m3:e} m³: it is inverted or flat; expected more than 0")]
    Inverted {
        /// Index of the tetrahedron, from 0.
        tet: usize,
        /// Its signed volume (m³).
        volume_m3: f64,
    },
    /// Tetrahedra that hang together in more than one piece.
    #[error(
        "the tetrahedra form {pieces} disconnected pieces (the smallest has {smallest} tetrahedra); expected one"
    )]
    Disconnected {
        /// Number of pieces.
        pieces: usize,
        /// Tetrahedra in the smallest piece.
        smallest: usize,
    },
    /// A mesh without tetrahedra.
    #[error("the mesh has no tetrahedra")]
    Empty,
    /// An element names a node that does not exist.
    #[error("element {element} names node {node}, but there are {nodes} nodes")]
    MissingNode {
        /// Index of the element, from 0.
        element: usize,
        /// The node it names.
        node: u32,
        /// Number of nodes.
        nodes: usize,
    },
    /// A face shared by more than two tetrahedra.
    #[error("the face with nodes {face:?} belongs to {count} tetrahedra; expected one or two")]
    BranchingFace {
        /// Its nodes.
        face: [u32; 3],
        /// Number of tetrahedra that have it.
        count: usize,
    },
    /// A named surface with a triangle that is not on the boundary.
    #[error(
        "surface \"{surface}\": triangle {triangle} with nodes {nodes:?} is not a boundary face of the tetrahedra"
    )]
    NotOnBoundary {
        /// Name of the surface.
        surface: String,
        /// Index of the triangle in the surface, from 0.
        triangle: usize,
        /// Its nodes.
        nodes: [u32; 3],
    },
    /// A node coordinate that is not a number.
    #[error("node {node} has the coordinates {position:?}; expected finite numbers")]
    NonFinite {
        /// Index of the node, from 0.
        node: usize,
        /// What was read.
        position: [f64; 3],
    },
    /// A block without extent or cells.
    #[error(
        "a block needs positive edge lengths and at least one cell along each: got {size_m:?} m, {cells:?} cells"
    )]
    EmptyBlock {
        /// Edge lengths (m).
        size_m: [f64; 3],
        /// Cells along each edge.
        cells: [usize; 3],
    },
}
