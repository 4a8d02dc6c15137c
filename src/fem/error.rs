//! What can go wrong between a mesh and a displacement.

use crate::mesh::MeshError;
use crate::sparse::SparseError;

/// Why the phantom's response could not be computed.
#[derive(Debug, thiserror::Error)]
pub enum FemError {
    /// The mesh cannot carry a displacement.
    #[error("the mesh cannot carry a displacement")]
    Mesh(#[from] MeshError),
    /// The stiffness could not be factored or solved.
    #[error("the stiffness could not be solved")]
    Sparse(#[from] SparseError),
    /// A Poisson's ratio outside the range in which the elements answer.
    #[error(
        "Poisson's ratio {poisson_ratio} is outside (-1, 0.4999]: the elements here need a compressible body"
    )]
    PoissonRatio {
        /// What was given.
        poisson_ratio: f64,
    },
    /// Nothing holds the body.
    #[error(
        "surface \"{surface}\" has no node: nothing holds the phantom, so its displacement is not determined"
    )]
    NotHeld {
        /// The surface that should hold it.
        surface: String,
    },
    /// A disc that lies off the body.
    #[error(
        "a disc of radius {radius_m} m at ({x:.4}, {y:.4}, {z:.4}) m covers no part of the surface",
        x = centre_m[0], y = centre_m[1], z = centre_m[2]
    )]
    DiscOffSurface {
        /// Centre (m).
        centre_m: [f64; 3],
        /// Radius (m).
        radius_m: f64,
    },
    /// A point that is to be attached to a surface that does not exist.
    #[error("surface \"{surface}\" has no triangle to attach a point to")]
    NoSurface {
        /// Name of the surface.
        surface: String,
    },
    /// A rigid tip where the surface is not flat.
    #[error(
        "a rigid tip of radius {radius_m} m at ({x:.4}, {y:.4}, {z:.4}) m does not lie wholly on a flat part of the \
         surface: its contact is not modelled there",
        x = centre_m[0], y = centre_m[1], z = centre_m[2]
    )]
    TipNotFlat {
        /// Centre (m).
        centre_m: [f64; 3],
        /// Radius (m).
        radius_m: f64,
    },
    /// The contact under a tip could not be found.
    #[error("the contact under the tip could not be found: {why} ({cells} cells, {exchanges} exchanges)")]
    Contact {
        /// What failed.
        why: &'static str,
        /// Cells involved.
        cells: usize,
        /// Exchanges made.
        exchanges: usize,
    },
}
