//! What Gmsh's MSH 2.2 and 4.1 have in common: the header, physical names, element types, node numbers.

use super::MeshFileError;
use super::assemble::RawMesh;
use super::cursor::{Cursor, Encoding};
use std::collections::HashMap;

/// The two versions that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Version {
    V2,
    V4,
}

/// Reads `$MeshFormat … $EndMeshFormat` and sets the cursor's encoding.
pub(super) fn read_header(cursor: &mut Cursor<'_>) -> Result<Version, MeshFileError> {
    let first = cursor.text("$MeshFormat")?;
    if first != "$MeshFormat" {
        return Err(cursor.unexpected(first, "$MeshFormat"));
    }
    cursor.section = "$MeshFormat".to_owned();
    let at = cursor.place();
    let unsupported = |what, found: &str, expected| MeshFileError::Unsupported {
        at,
        what,
        found: found.to_owned(),
        expected,
    };
    let version = match cursor.text("the version")? {
        "2.2" => Version::V2,
        "4.1" => Version::V4,
        other => return Err(unsupported("the MSH version", other, "2.2 or 4.1")),
    };
    let binary = match cursor.text("the file type")? {
        "0" => false,
        "1" => true,
        other => return Err(unsupported("the file type", other, "0 (ASCII) or 1 (binary)")),
    };
    match cursor.text("the data size")? {
        "8" => {}
        other => return Err(unsupported("the data size", other, "8")),
    }
    if binary {
        cursor.line();
        let one: [u8; 4] = cursor.take("the number 1 that tells the byte order")?;
        match one {
            [1, 0, 0, 0] => cursor.encoding = Encoding::LittleEndian,
            [0, 0, 0, 1] => return Err(unsupported("the byte order", "big endian", "little endian")),
            other => {
                return Err(cursor.unexpected(format!("{other:?}"), "the number 1 that tells the byte order"));
            }
        }
    }
    end_section(cursor)?;
    Ok(version)
}

/// Goes to the next section and returns its name with the dollar sign; `None` at the end of the file.
pub(super) fn next_section<'a>(cursor: &mut Cursor<'a>) -> Result<Option<&'a str>, MeshFileError> {
    cursor.section = "the space between sections".to_owned();
    cursor.skip_blanks();
    let Some(line) = cursor.line() else { return Ok(None) };
    match std::str::from_utf8(line) {
        Ok(name) if name.starts_with('$') && !name.starts_with("$End") => {
            cursor.section = name.to_owned();
            Ok(Some(name))
        }
        _ => Err(cursor.unexpected(String::from_utf8_lossy(line), "a section such as $Nodes")),
    }
}

/// Reads the line that ends the cursor's section.
pub(super) fn end_section(cursor: &mut Cursor<'_>) -> Result<(), MeshFileError> {
    let end = format!("$End{}", &cursor.section[1..]);
    match cursor.word() {
        Some(word) if word == end.as_bytes() => Ok(()),
        Some(word) => Err(cursor.unexpected(String::from_utf8_lossy(word), end)),
        None => Err(cursor.truncated("the end of the section")),
    }
}

/// Skips a section whose content does not matter.
pub(super) fn skip_section(cursor: &mut Cursor<'_>) -> Result<(), MeshFileError> {
    let end = format!("$End{}", &cursor.section[1..]);
    cursor.skip_past(&end)
}

/// Names of physical groups by dimension and number.
pub(super) type Names = HashMap<(i64, i64), String>;

/// Reads `$PhysicalNames`, which is text also in binary files.
pub(super) fn read_names(cursor: &mut Cursor<'_>) -> Result<Names, MeshFileError> {
    let count: u64 = cursor.parsed("the number of names")?;
    let count = cursor.fits(count, 6)?;
    let mut names = Names::new();
    for _ in 0..count {
        let dimension = cursor.parsed("a dimension")?;
        let number = cursor.parsed("the number of a group")?;
        let line = cursor.line().ok_or_else(|| cursor.truncated("the name of a group"))?;
        let quoted = std::str::from_utf8(line).ok();
        let name = quoted.and_then(|q| q.strip_prefix('"')).and_then(|q| q.strip_suffix('"'));
        let name =
            name.ok_or_else(|| cursor.unexpected(String::from_utf8_lossy(line), "a name in double quotes"))?;
        names.insert((dimension, number), name.to_owned());
    }
    end_section(cursor)?;
    Ok(names)
}

/// What an element of a Gmsh type is to a reader of tetrahedra.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A point or line with this many nodes: ignored.
    Ignored(usize),
    Triangle,
    Tetrahedron,
}

impl Kind {
    /// Nodes of such an element.
    pub(super) fn nodes(self) -> usize {
        match self {
            Self::Ignored(nodes) => nodes,
            Self::Triangle => 3,
            Self::Tetrahedron => 4,
        }
    }
}

/// The kind of a Gmsh element type (Gmsh reference manual, section "MSH file format").
pub(super) fn kind_of(code: i64, element: u64) -> Result<Kind, MeshFileError> {
    let kind = match code {
        15 => return Ok(Kind::Ignored(1)),
        1 => return Ok(Kind::Ignored(2)),
        8 => return Ok(Kind::Ignored(3)),
        2 => return Ok(Kind::Triangle),
        4 => return Ok(Kind::Tetrahedron),
        3 => "quadrangle",
        5 => "hexahedron",
        6 => "prism",
        7 => "pyramid",
        9 => "second-order triangle",
        10 | 16 => "second-order quadrangle",
        11 => "second-order tetrahedron",
        12 | 17 => "second-order hexahedron",
        13 | 18 => "second-order prism",
        14 | 19 => "second-order pyramid",
        20..=25 => "triangle of higher order",
        26..=28 => "line of higher order",
        29..=31 => "tetrahedron of higher order",
        _ => "element of another kind",
    };
    Err(MeshFileError::UnsupportedElement { element, kind, code })
}

/// Nodes in the file's order, found again by their numbers.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    positions: Vec<[f64; 3]>,
    index: HashMap<u64, u32>,
}

impl Nodes {
    pub(super) fn insert(&mut self, node: u64, position: [f64; 3]) -> Result<(), MeshFileError> {
        if !position.iter().all(|x| x.is_finite()) {
            return Err(MeshFileError::NonFinite { node, position });
        }
        if self.index.insert(node, self.positions.len() as u32).is_some() {
            return Err(MeshFileError::RepeatedNode { node });
        }
        self.positions.push(position);
        Ok(())
    }

    pub(super) fn find(&self, element: u64, node: u64) -> Result<u32, MeshFileError> {
        self.index.get(&node).copied().ok_or(MeshFileError::UnknownNode { element, node })
    }

    pub(super) fn into_raw(self) -> RawMesh {
        RawMesh { nodes: self.positions, ..RawMesh::default() }
    }
}

/// Elements of one physical group or of several.
#[derive(Debug, Default)]
pub(super) struct Elements {
    /// Triangles with the numbers of their physical surfaces.
    triangles: HashMap<i64, Vec<[u32; 3]>>,
    /// Tetrahedra with the numbers of their physical volumes.
    tetrahedra: HashMap<i64, Vec<[u32; 4]>>,
}

impl Elements {
    /// Adds an element to physical group `group`; its nodes are as many as its kind has.
    pub(super) fn insert(&mut self, kind: Kind, group: i64, nodes: &[u32]) {
        match (kind, nodes) {
            (Kind::Triangle, &[a, b, c]) => self.triangles.entry(group).or_default().push([a, b, c]),
            (Kind::Tetrahedron, &[a, b, c, d]) => {
                self.tetrahedra.entry(group).or_default().push([a, b, c, d]);
            }
            _ => {}
        }
    }

    /// Puts names in the place of numbers. Elements of nameless groups are dropped: nothing can ask for them.
    pub(super) fn into_raw(self, nodes: Nodes, names: &Names) -> RawMesh {
        let mut raw = nodes.into_raw();
        for (group, triangles) in self.triangles {
            if let Some(name) = names.get(&(2, group)) {
                raw.surfaces.insert(name.clone(), triangles);
            }
        }
        for (group, tetrahedra) in self.tetrahedra {
            if let Some(name) = names.get(&(3, group)) {
                raw.volumes.insert(name.clone(), tetrahedra);
            }
        }
        raw
    }
}
