//! What can go wrong when pictures are made or written.

use std::io;
use std::path::PathBuf;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum PixelError {
    /// A figure that means nothing.
    #[error("{what} is {value}; expected {expected}")]
    BadFigure {
        /// Which one.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What can be.
        expected: &'static str,
    },
    /// No ray leads to a pixel: the distortion turns back on itself inside the picture.
    #[error(
        "the lens folds over at pixel ({column}, {row}): no ray leads there; expected less distortion or a \
         smaller picture"
    )]
    LensFolds {
        /// Column of the pixel.
        column: usize,
        /// Row of the pixel.
        row: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but there are {vertices}, counted from 0")]
    NoSuchVertex {
        /// Index of the triangle.
        triangle: usize,
        /// What it names.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A dot is attached to a triangle that does not exist.
    #[error("dot {dot} is attached to triangle {triangle}, but there are {triangles}, counted from 0")]
    NoSuchTriangle {
        /// Number of the dot.
        dot: u32,
        /// What it names.
        triangle: u32,
        /// How many there are.
        triangles: usize,
    },
    /// The moving surface has not the vertices of the resting one.
    #[error("{what} for {given} vertices; the surface has {wanted}")]
    VertexCount {
        /// Positions, normals or velocities.
        what: &'static str,
        /// How many were given.
        given: usize,
        /// How many the surface has.
        wanted: usize,
    },
    /// Nothing to look at: the phantom was prepared without a skin.
    #[error("the simulated phantom has no skin for a camera to look at: it was prepared without")]
    NoSkin,
    /// The world has a fault of the camera that tells marker positions; pictures have their pose and lens instead.
    #[error(
        "{effect} is a fault of simulated marker positions, not of pictures; expected a world without it, and \
         another pose or lens of the simulated camera instead"
    )]
    NotInPictures {
        /// Its id in the physics catalogue.
        effect: &'static str,
    },
    /// A named pipe could not be made, opened or written to.
    #[error("the pipe {} failed", path.display())]
    Pipe {
        /// Which one.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file could not be written.
    #[error("writing {} failed", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A picture could not be encoded.
    #[error("encoding {} failed", path.display())]
    Encode {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: image::ImageError,
    },
}

/// Refuses a figure that is not finite or lies outside `[least, most]`.
pub(super) fn within(
    what: &'static str,
    value: f64,
    least: f64,
    most: f64,
    expected: &'static str,
) -> Result<(), PixelError> {
    if (least..=most).contains(&value) {
        Ok(())
    } else {
        Err(PixelError::BadFigure { what, value, expected })
    }
}
