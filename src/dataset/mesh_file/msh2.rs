//! Gmsh MSH 2.2, ASCII and binary (Gmsh reference manual, section "MSH file format version 2").
//!
//! An element carries the number of its one physical group as its first tag.

use super::MeshFileError;
use super::assemble::RawMesh;
use super::cursor::{Cursor, Encoding};
use super::gmsh::{self, Elements, Kind, Names, Nodes};

/// Parses what follows the header.
pub(super) fn parse(mut cursor: Cursor<'_>) -> Result<RawMesh, MeshFileError> {
    let cursor = &mut cursor;
    let mut names = Names::new();
    let mut nodes: Option<Nodes> = None;
    let mut elements: Option<Elements> = None;
    while let Some(section) = gmsh::next_section(cursor)? {
        match section {
            "$PhysicalNames" => names = gmsh::read_names(cursor)?,
            "$Nodes" => nodes = Some(read_nodes(cursor)?),
            "$Elements" => match &nodes {
                Some(nodes) => elements = Some(read_elements(cursor, nodes)?),
                None => return Err(cursor.unexpected("$Elements", "$Nodes before it")),
            },
            _ => gmsh::skip_section(cursor)?,
        }
    }
    let nodes = nodes.ok_or_else(|| MeshFileError::MissingSection { section: "$Nodes".to_owned() })?;
    let elements =
        elements.ok_or_else(|| MeshFileError::MissingSection { section: "$Elements".to_owned() })?;
    Ok(elements.into_raw(nodes, &names))
}

fn read_nodes(cursor: &mut Cursor<'_>) -> Result<Nodes, MeshFileError> {
    let count: u64 = cursor.parsed("the number of nodes")?;
    let count = cursor.fits(count, 8)?;
    cursor.line();
    let mut nodes = Nodes::default();
    for _ in 0..count {
        let tag = positive(cursor, "the number of a node")?;
        let mut position = [0.0; 3];
        for x in &mut position {
            *x = cursor.double("a coordinate of a node")?;
        }
        nodes.insert(tag, position)?;
    }
    gmsh::end_section(cursor)?;
    Ok(nodes)
}

fn read_elements(cursor: &mut Cursor<'_>, nodes: &Nodes) -> Result<Elements, MeshFileError> {
    let count: u64 = cursor.parsed("the number of elements")?;
    let mut left = cursor.fits(count, 8)?;
    cursor.line();
    let mut elements = Elements::default();
    while left > 0 {
        if cursor.encoding == Encoding::Ascii {
            let tag = positive(cursor, "the number of an element")?;
            let code = cursor.int("an element type")?;
            let kind = gmsh::kind_of(code, tag)?;
            let tags = positive(cursor, "the number of tags")?;
            read_element(cursor, nodes, &mut elements, (tag, kind, tags))?;
            left -= 1;
        } else {
            // Binary files announce runs of elements of one type.
            let code = cursor.int("an element type")?;
            let run = positive(cursor, "the number of elements of one type")?;
            let tags = positive(cursor, "the number of tags")?;
            if run == 0 || run > left as u64 {
                return Err(cursor.unexpected(run.to_string(), format!("a run of 1 to {left} elements")));
            }
            for _ in 0..run {
                let tag = positive(cursor, "the number of an element")?;
                let kind = gmsh::kind_of(code, tag)?;
                read_element(cursor, nodes, &mut elements, (tag, kind, tags))?;
            }
            left -= run as usize;
        }
    }
    gmsh::end_section(cursor)?;
    Ok(elements)
}

/// Reads the tags and nodes of one element.
fn read_element(
    cursor: &mut Cursor<'_>,
    nodes: &Nodes,
    elements: &mut Elements,
    (tag, kind, tags): (u64, Kind, u64),
) -> Result<(), MeshFileError> {
    let mut group = 0;
    for i in 0..cursor.fits(tags, 2)? {
        let value = cursor.int("a tag of an element")?;
        if i == 0 {
            group = value.abs();
        }
    }
    let mut corners = [0; 4];
    let corners = &mut corners[..kind.nodes()];
    for corner in corners.iter_mut() {
        let node = positive(cursor, "a node of an element")?;
        *corner = nodes.find(tag, node)?;
    }
    elements.insert(kind, group, corners);
    Ok(())
}

fn positive(cursor: &mut Cursor<'_>, expected: &'static str) -> Result<u64, MeshFileError> {
    let value = cursor.int(expected)?;
    u64::try_from(value).map_err(|_| cursor.unexpected(value.to_string(), expected))
}
