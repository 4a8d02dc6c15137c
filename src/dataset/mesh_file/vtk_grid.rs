//! The arrays of a VTK unstructured grid → nodes, tetrahedra and triangles by name.

use super::MeshFileError;
use super::array::Values;
use super::assemble::RawMesh;
use std::collections::BTreeMap;

/// Names under which the cell-data array of group numbers is looked for.
pub(super) const GROUP_ARRAYS: [&str; 2] = ["group", "gmsh:physical"];

/// The arrays of a grid, as far as they matter.
#[derive(Debug, Default)]
pub(super) struct Grid {
    /// x, y, z of every point.
    pub(super) points: Vec<f64>,
    /// Points of all cells, one after the other.
    pub(super) connectivity: Vec<i64>,
    /// Where each cell ends in `connectivity`.
    pub(super) ends: Vec<i64>,
    /// VTK type of each cell.
    pub(super) types: Vec<i64>,
    /// Group number of each cell.
    pub(super) groups: Option<Vec<i64>>,
    /// Names of group numbers.
    pub(super) names: BTreeMap<i64, String>,
}

/// What a cell is to a reader of tetrahedra.
enum Kind {
    Ignored,
    Triangle,
    Tetrahedron,
}

impl Grid {
    /// Takes a field-data array as the name of a group: whole numbers, at most three, the first being the
    /// number of the group.
    pub(super) fn name_group(&mut self, name: &str, values: &Values) {
        if let Values::Whole(values) = values
            && let [number] | [number, _] | [number, _, _] = values[..]
        {
            self.names.insert(number, name.to_owned());
        }
    }

    pub(super) fn into_raw(self) -> Result<RawMesh, MeshFileError> {
        let length = |array: &str, found: usize, expected: usize| {
            if found == expected {
                Ok(())
            } else {
                Err(MeshFileError::WrongLength { array: array.to_owned(), found, expected })
            }
        };
        let cells = self.types.len();
        length("offsets", self.ends.len(), cells)?;
        length("points", self.points.len(), self.points.len() / 3 * 3)?;
        let groups = self.groups.ok_or_else(|| MeshFileError::MissingSection {
            section: format!("cell-data array called \"{}\" or \"{}\"", GROUP_ARRAYS[0], GROUP_ARRAYS[1]),
        })?;
        length("group", groups.len(), cells)?;
        if let (true, Some(&number)) = (self.names.is_empty(), groups.first()) {
            return Err(MeshFileError::NamelessGroups { number });
        }
        let mut raw = RawMesh::default();
        for (node, p) in self.points.chunks_exact(3).enumerate() {
            let position = [p[0], p[1], p[2]];
            if !position.iter().all(|x| x.is_finite()) {
                return Err(MeshFileError::NonFinite { node: node as u64, position });
            }
            raw.nodes.push(position);
        }
        let mut start = 0;
        for (cell, &end) in self.ends.iter().enumerate() {
            let corners = usize::try_from(start)
                .ok()
                .zip(usize::try_from(end).ok())
                .and_then(|(a, b)| self.connectivity.get(a..b))
                .ok_or(MeshFileError::CellBounds { cell, start, end })?;
            start = end;
            let kind = kind_of(self.types[cell], cell)?;
            let Some(name) = self.names.get(&groups[cell]) else { continue };
            match kind {
                Kind::Ignored => {}
                Kind::Triangle => {
                    raw.surfaces.entry(name.clone()).or_default().push(nodes(
                        cell,
                        corners,
                        raw.nodes.len(),
                    )?);
                }
                Kind::Tetrahedron => {
                    raw.volumes.entry(name.clone()).or_default().push(nodes(cell, corners, raw.nodes.len())?);
                }
            }
        }
        Ok(raw)
    }
}

/// The `N` nodes of a cell, each of which exists.
fn nodes<const N: usize>(cell: usize, corners: &[i64], count: usize) -> Result<[u32; N], MeshFileError> {
    let corners: [i64; N] = corners.try_into().map_err(|_| MeshFileError::WrongLength {
        array: format!("cell {cell}"),
        found: corners.len(),
        expected: N,
    })?;
    let mut found = [0; N];
    for (f, &node) in found.iter_mut().zip(&corners) {
        *f = u32::try_from(node)
            .ok()
            .filter(|&n| (n as usize) < count)
            .ok_or(MeshFileError::UnknownCellNode { cell, node, count })?;
    }
    Ok(found)
}

/// The kind of a VTK cell type (VTK's `vtkCellType.h`).
fn kind_of(code: i64, cell: usize) -> Result<Kind, MeshFileError> {
    let kind = match code {
        1..=4 | 21 | 35 | 68 | 75 => return Ok(Kind::Ignored),
        5 => return Ok(Kind::Triangle),
        10 => return Ok(Kind::Tetrahedron),
        6 => "triangle strip",
        7 => "polygon",
        8 => "pixel",
        9 => "quadrangle",
        11 => "voxel",
        12 => "hexahedron",
        13 => "prism",
        14 => "pyramid",
        22 | 34 | 69 | 76 => "triangle of second or higher order",
        24 | 71 | 78 => "tetrahedron of second or higher order",
        23 | 25..=33 | 70 | 72..=74 | 77 | 79..=81 => "cell of second or higher order",
        _ => "cell of another kind",
    };
    Err(MeshFileError::UnsupportedElement { element: cell as u64, kind, code })
}
