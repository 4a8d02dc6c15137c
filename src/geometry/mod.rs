//! Points, directions, discs and triangles in the phantom frame (metres, right-handed).

mod basis;
mod disc;
mod triangle;

pub use basis::basis_from_axis;
pub use disc::{Disc, DiscPoint};
pub use triangle::{Triangle, TrianglePoint};

/// A point, displacement, force or direction in the phantom frame.
pub type Vec3 = nalgebra::Vector3<f64>;

/// A second-order tensor in the phantom frame.
pub type Mat3 = nalgebra::Matrix3<f64>;
