//! Gmsh MSH 4.1, ASCII and binary (Gmsh reference manual, section "MSH file format").
//!
//! An element belongs to an entity; an entity belongs to any number of physical groups.

use super::MeshFileError;
use super::assemble::RawMesh;
use super::cursor::{Cursor, Encoding};
use super::gmsh::{self, Elements, Names, Nodes};
use std::collections::HashMap;

/// Physical groups by dimension and number of the entity.
type Groups = HashMap<(i64, i64), Vec<i64>>;

/// Parses what follows the header.
pub(super) fn parse(mut cursor: Cursor<'_>) -> Result<RawMesh, MeshFileError> {
    let cursor = &mut cursor;
    let mut names = Names::new();
    let mut groups = Groups::new();
    let mut nodes: Option<Nodes> = None;
    let mut elements: Option<Elements> = None;
    while let Some(section) = gmsh::next_section(cursor)? {
        match section {
            "$PhysicalNames" => names = gmsh::read_names(cursor)?,
            "$Entities" => groups = read_entities(cursor)?,
            "$Nodes" => nodes = Some(read_nodes(cursor)?),
            "$Elements" => match &nodes {
                Some(nodes) => elements = Some(read_elements(cursor, nodes, &groups)?),
                None => return Err(cursor.unexpected("$Elements", "$Nodes before it")),
            },
            "$PartitionedEntities" => {
                return Err(cursor.unexpected("$PartitionedEntities", "a mesh that is not partitioned"));
            }
            _ => gmsh::skip_section(cursor)?,
        }
    }
    let nodes = nodes.ok_or_else(|| MeshFileError::MissingSection { section: "$Nodes".to_owned() })?;
    let elements =
        elements.ok_or_else(|| MeshFileError::MissingSection { section: "$Elements".to_owned() })?;
    Ok(elements.into_raw(nodes, &names))
}

fn read_entities(cursor: &mut Cursor<'_>) -> Result<Groups, MeshFileError> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = cursor.size("the number of entities")?;
    }
    let mut groups = Groups::new();
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..cursor.fits(count, 5)? {
            let tag = cursor.int("the number of an entity")?;
            // A point has its coordinates, everything else its bounding box.
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                cursor.double("a coordinate of an entity")?;
            }
            let physical = read_ints(cursor, "the physical groups of an entity")?;
            if dimension > 0 {
                read_ints(cursor, "the boundary of an entity")?;
            }
            groups.insert((dimension as i64, tag), physical);
        }
    }
    gmsh::end_section(cursor)?;
    Ok(groups)
}

fn read_ints(cursor: &mut Cursor<'_>, expected: &'static str) -> Result<Vec<i64>, MeshFileError> {
    let count = cursor.size(expected)?;
    (0..cursor.fits(count, 2)?).map(|_| cursor.int(expected)).collect()
}

fn read_nodes(cursor: &mut Cursor<'_>) -> Result<Nodes, MeshFileError> {
    let blocks = cursor.size("the number of node blocks")?;
    for _ in 0..3 {
        cursor.size("the number of nodes, the smallest and the largest node number")?;
    }
    let mut nodes = Nodes::default();
    for _ in 0..cursor.fits(blocks, 4)? {
        let dimension = cursor.int("the dimension of an entity")?;
        cursor.int("the number of an entity")?;
        let parametric = cursor.int("whether nodes are parametric")? != 0;
        let count = cursor.size("the number of nodes in a block")?;
        let tags: Vec<u64> = (0..cursor.fits(count, smallest_number(cursor))?)
            .map(|_| cursor.size("the number of a node"))
            .collect::<Result<_, _>>()?;
        for tag in tags {
            let mut position = [0.0; 3];
            for x in &mut position {
                *x = cursor.double("a coordinate of a node")?;
            }
            if parametric {
                for _ in 0..dimension.clamp(0, 3) {
                    cursor.double("a parameter of a node")?;
                }
            }
            nodes.insert(tag, position)?;
        }
    }
    gmsh::end_section(cursor)?;
    Ok(nodes)
}

fn read_elements(cursor: &mut Cursor<'_>, nodes: &Nodes, groups: &Groups) -> Result<Elements, MeshFileError> {
    let blocks = cursor.size("the number of element blocks")?;
    for _ in 0..3 {
        cursor.size("the number of elements, the smallest and the largest element number")?;
    }
    let mut elements = Elements::default();
    for _ in 0..cursor.fits(blocks, 4)? {
        let dimension = cursor.int("the dimension of an entity")?;
        let entity = cursor.int("the number of an entity")?;
        let code = cursor.int("an element type")?;
        let count = cursor.size("the number of elements in a block")?;
        let groups = groups.get(&(dimension, entity)).map_or(&[][..], Vec::as_slice);
        for _ in 0..cursor.fits(count, smallest_number(cursor))? {
            let tag = cursor.size("the number of an element")?;
            let kind = gmsh::kind_of(code, tag)?;
            let mut corners = [0; 4];
            let corners = &mut corners[..kind.nodes()];
            for corner in corners.iter_mut() {
                let node = cursor.size("a node of an element")?;
                *corner = nodes.find(tag, node)?;
            }
            for &group in groups {
                elements.insert(kind, group.abs(), corners);
            }
        }
    }
    gmsh::end_section(cursor)?;
    Ok(elements)
}

/// Bytes that a size takes at least: one digit and one blank, or a machine number.
fn smallest_number(cursor: &Cursor<'_>) -> usize {
    if cursor.encoding == Encoding::Ascii { 2 } else { 8 }
}
