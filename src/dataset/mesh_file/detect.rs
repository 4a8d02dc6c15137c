//! Which format a mesh file is in, by its first bytes.

use super::super::DatasetError;
use super::super::text::{is_utf16, without_bom};
use super::cursor::Cursor;
use super::gmsh::{self, Version};
use super::{MeshFileError, msh2, msh4, vtk, vtu};
use crate::mesh::TetMesh;
use std::path::Path;

/// Reads a mesh file of any known format.
///
/// # Errors
/// [`DatasetError::Read`], or [`DatasetError::Mesh`] with what is wrong inside.
pub fn read_mesh(file: &Path) -> Result<TetMesh, DatasetError> {
    let bytes = std::fs::read(file).map_err(|source| DatasetError::Read { file: file.to_owned(), source })?;
    parse_mesh(&bytes).map_err(|source| DatasetError::Mesh { file: file.to_owned(), source })
}

/// Parses a mesh of any known format; what each must hold stands in this room's front door.
///
/// # Errors
/// Whatever is wrong with the bytes or with the mesh in them.
pub fn parse_mesh(bytes: &[u8]) -> Result<TetMesh, MeshFileError> {
    if is_utf16(bytes) {
        return Err(MeshFileError::Utf16);
    }
    let text = without_bom(bytes);
    let start = text.trim_ascii_start();
    let raw = if start.starts_with(b"$") {
        let mut cursor = Cursor::new(text);
        match gmsh::read_header(&mut cursor)? {
            Version::V2 => msh2::parse(cursor)?,
            Version::V4 => msh4::parse(cursor)?,
        }
    } else if start.starts_with(b"# vtk DataFile") {
        vtk::parse(start)?
    } else if start.starts_with(b"<") {
        vtu::parse(start)?
    } else {
        let shown = &start[..start.len().min(24)];
        return Err(MeshFileError::UnknownFormat { start: String::from_utf8_lossy(shown).into_owned() });
    };
    raw.assemble()
}
