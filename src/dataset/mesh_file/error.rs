//! Why a mesh file was refused, and where in it.

use crate::mesh::MeshError;
use std::fmt;

/// Where in a file: a line of text, or a byte of binary data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Line, the first being 1.
    Line(u64),
    /// Byte, the first being 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "row {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// Why a mesh file was refused.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// The first bytes are those of no format that is read.
    #[error("begins with \"{start}\"; expected Gmsh MSH 2.2 or 4.1, legacy VTK, or VTU")]
    UnknownFormat {
        /// The first bytes.
        start: String,
    },
    /// Text in UTF-16.
    #[error("the text is UTF-16; expected UTF-8")]
    Utf16,
    /// A version or kind of a known format that is not read.
    #[error("{at}: {what} is \"{found}\"; expected {expected}")]
    Unsupported {
        /// Where.
        at: Place,
        /// Which property of the file.
        what: &'static str,
        /// Its value.
        found: String,
        /// What is read.
        expected: &'static str,
    },
    /// The file ends early.
    #[error("{at}: the file ends within {section}; expected {expected} (is it cut off?)")]
    Truncated {
        /// Where it ends.
        at: Place,
        /// The section being read.
        section: String,
        /// What should follow.
        expected: &'static str,
    },
    /// A word that is not what the format asks for.
    #[error("{at}, in {section}: \"{found}\"; expected {expected}")]
    Unexpected {
        /// Where.
        at: Place,
        /// The section being read.
        section: String,
        /// The word.
        found: String,
        /// What should stand there.
        expected: String,
    },
    /// A section or array that is not there.
    #[error("there is no {section}; expected one")]
    MissingSection {
        /// Its name.
        section: String,
    },
    /// A coordinate that is infinite or NaN.
    #[error("node {node} has the coordinates {position:?}; expected finite numbers")]
    NonFinite {
        /// The node's number in the file.
        node: u64,
        /// What stands there.
        position: [f64; 3],
    },
    /// A node number given twice.
    #[error("node {node} stands there twice; expected each number once")]
    RepeatedNode {
        /// The node's number in the file.
        node: u64,
    },
    /// An element that names a node that does not exist.
    #[error("element {element} names node {node}, which the file does not have")]
    UnknownNode {
        /// The element's number in the file.
        element: u64,
        /// The node that it names.
        node: u64,
    },
    /// An element other than a point, a line, a first-order triangle or a first-order tetrahedron.
    #[error(
        "element {element} is a {kind} (type {code}); expected first-order tetrahedra and triangles only"
    )]
    UnsupportedElement {
        /// The element's number in the file.
        element: u64,
        /// Its kind in words.
        kind: &'static str,
        /// Its type number in the format.
        code: i64,
    },
    /// An array with a wrong number of values.
    #[error("array {array} has {found} values; expected {expected}")]
    WrongLength {
        /// Its name.
        array: String,
        /// Values found.
        found: usize,
        /// Values expected.
        expected: usize,
    },
    /// Something in an array that does not belong there.
    #[error("{array}: \"{found}\"; expected {expected}")]
    UnexpectedInArray {
        /// The array.
        array: String,
        /// What stands there.
        found: String,
        /// What was expected.
        expected: String,
    },
    /// An array with fewer bytes than it announces.
    #[error("{array}: the data end before the size that their header announces (is the file cut off?)")]
    ArrayCutOff {
        /// The array.
        array: String,
    },
    /// A number that should be whole.
    #[error("array {array}: {value} is not a whole number; expected one")]
    NotWhole {
        /// The array.
        array: String,
        /// The value.
        value: f64,
    },
    /// A cell whose nodes are not in the list of nodes of cells.
    #[error("cell {cell} has its nodes from {start} to {end} of the connectivity, which has no such range")]
    CellBounds {
        /// Index of the cell, from 0.
        cell: usize,
        /// Where its nodes start.
        start: i64,
        /// Where they end.
        end: i64,
    },
    /// A cell that names a point that does not exist.
    #[error("cell {cell} names point {node}; expected 0 to {count} (exclusive)")]
    UnknownCellNode {
        /// Index of the cell, from 0.
        cell: usize,
        /// The point that it names.
        node: i64,
        /// Number of points.
        count: usize,
    },
    /// Group numbers, but no names for any.
    #[error(
        "cells have group numbers such as {number}, but no field-data array names one; expected an array called like each group with its number"
    )]
    NamelessGroups {
        /// One of the numbers.
        number: i64,
    },
    /// No tetrahedra in the volume `phantom`.
    #[error("there is no physical volume \"phantom\" with tetrahedra; the volumes are {found:?}")]
    NoPhantom {
        /// The volumes that the file names.
        found: Vec<String>,
    },
    /// A surface triangle with a node that no tetrahedron of the phantom has.
    #[error(
        "surface \"{surface}\": triangle {triangle} is not on the phantom: no tetrahedron has its node at {position:?}"
    )]
    OffPhantom {
        /// Name of the surface.
        surface: String,
        /// Index of the triangle in the surface, from 0.
        triangle: usize,
        /// The node's coordinates.
        position: [f64; 3],
    },
    /// XML that is not well formed.
    #[error("byte {byte}: not well-formed XML: {message}")]
    Xml {
        /// Where.
        byte: u64,
        /// What the parser says.
        message: String,
    },
    /// Text that is not base64.
    #[error("array {array}: the data are not base64: {message}")]
    Base64 {
        /// The array.
        array: String,
        /// What the decoder says.
        message: String,
    },
    /// Compressed data that do not decompress to what their header says.
    #[error("array {array}: block {block} decompresses to {found} bytes; expected {expected}")]
    Compression {
        /// The array.
        array: String,
        /// Index of the block, from 0.
        block: usize,
        /// Bytes obtained before the data ended or went wrong.
        found: usize,
        /// Bytes expected.
        expected: usize,
    },
    /// A mesh that is read well but cannot be computed on.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}
