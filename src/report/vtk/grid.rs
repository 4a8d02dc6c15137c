//! A tetrahedral mesh with fields as a `.vtu` file.

use super::array::{Field, check_length, write_fields, write_head, write_i64, write_u8, write_vectors};
use crate::geometry::Vec3;
use crate::report::ReportError;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Tetrahedra by their nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cells<'a> {
    /// Four corners, positive volume (VTK_TETRA, 10).
    Linear(&'a [[u32; 4]]),
    /// Four corners, then the middles of edges 01, 12, 20, 03, 13, 23 (VTK_QUADRATIC_TETRA, 24).
    Quadratic(&'a [[u32; 10]]),
}

impl<'a> Cells<'a> {
    fn len(&self) -> usize {
        match self {
            Self::Linear(cells) => cells.len(),
            Self::Quadratic(cells) => cells.len(),
        }
    }

    fn nodes_each(&self) -> usize {
        match self {
            Self::Linear(_) => 4,
            Self::Quadratic(_) => 10,
        }
    }

    fn vtk_type(&self) -> u8 {
        match self {
            Self::Linear(_) => 10,
            Self::Quadratic(_) => 24,
        }
    }

    fn nodes(&self) -> &'a [u32] {
        match self {
            Self::Linear(cells) => cells.as_flattened(),
            Self::Quadratic(cells) => cells.as_flattened(),
        }
    }
}

/// A mesh with fields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid<'a> {
    /// Node positions (m).
    pub nodes: &'a [Vec3],
    /// Tetrahedra.
    pub cells: Cells<'a>,
    /// Fields with one entry a node.
    pub point_fields: &'a [Field<'a>],
    /// Fields with one entry a tetrahedron.
    pub cell_fields: &'a [Field<'a>],
}

/// Writes a `.vtu` file. A field of the wrong length or a cell with an unknown node is refused before
/// anything is written.
pub fn write_vtu(path: &Path, grid: &Grid<'_>) -> Result<(), ReportError> {
    check(grid)?;
    let failed = |source| ReportError::Write { path: path.to_owned(), source };
    let mut out = BufWriter::new(File::create(path).map_err(failed)?);
    write(&mut out, grid).and_then(|()| out.flush()).map_err(failed)
}

fn check(grid: &Grid<'_>) -> Result<(), ReportError> {
    let nodes = grid.nodes.len();
    if let Some(at) = grid.cells.nodes().iter().position(|&n| n as usize >= nodes) {
        let cell = at / grid.cells.nodes_each();
        return Err(ReportError::NoSuchNode { cell, node: grid.cells.nodes()[at], nodes });
    }
    grid.point_fields.iter().try_for_each(|f| check_length(f, nodes))?;
    grid.cell_fields.iter().try_for_each(|f| check_length(f, grid.cells.len()))
}

fn write(out: &mut impl Write, grid: &Grid<'_>) -> io::Result<()> {
    let (cells, each) = (grid.cells.len(), grid.cells.nodes_each());
    write_head(out, "UnstructuredGrid")?;
    writeln!(out, "<UnstructuredGrid>")?;
    writeln!(out, "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{cells}\">", grid.nodes.len())?;
    writeln!(out, "<Points>")?;
    write_vectors(out, "position_m", grid.nodes)?;
    writeln!(out, "</Points>\n<Cells>")?;
    write_i64(out, "connectivity", grid.cells.nodes().iter().map(|&n| i64::from(n)))?;
    write_i64(out, "offsets", (1..=cells).map(|i| (i * each) as i64))?;
    write_u8(out, "types", &vec![grid.cells.vtk_type(); cells])?;
    writeln!(out, "</Cells>\n<PointData>")?;
    write_fields(out, grid.point_fields)?;
    writeln!(out, "</PointData>\n<CellData>")?;
    write_fields(out, grid.cell_fields)?;
    writeln!(out, "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}

#[cfg(test)]
mod tests {
    use super::super::read_back::parse;
    use super::super::{Field, FieldValues};
    use super::*;
    use crate::mesh::{Block, block};

    fn text(grid: &Grid<'_>) -> String {
        let mut out = Vec::new();
        write(&mut out, grid).expect("memory");
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn a_linear_grid_reads_back_as_written() {
        let mesh = block(&Block { size_m: [0.15, 0.1, 0.025], cells: [12, 8, 4] }).expect("a block");
        let moved: Vec<Vec3> = mesh.nodes.iter().map(|p| 0.01 * p.yzx()).collect();
        let volume: Vec<f64> = (0..mesh.tets.len()).map(|i| i as f64).collect();
        let name = "a <strange> & \"quoted\" name";
        let grid = Grid {
            nodes: &mesh.nodes,
            cells: Cells::Linear(&mesh.tets),
            point_fields: &[Field { name, values: FieldValues::Vectors(&moved) }],
            cell_fields: &[Field { name: "v", values: FieldValues::Scalars(&volume) }],
        };
        let parsed = parse(&text(&grid));
        assert_eq!(parsed.piece["NumberOfPoints"], mesh.nodes.len());
        assert_eq!(parsed.piece["NumberOfCells"], mesh.tets.len());
        let flat = |v: &[Vec3]| v.iter().flat_map(|p| [p.x, p.y, p.z]).collect::<Vec<f64>>();
        assert_eq!(parsed.f64s("position_m"), flat(&mesh.nodes));
        assert_eq!(parsed.f64s(name), flat(&moved));
        assert_eq!(parsed.arrays[name].1, 3);
        assert_eq!(parsed.f64s("v"), volume);
        let connectivity: Vec<i64> = mesh.tets.as_flattened().iter().map(|&n| i64::from(n)).collect();
        assert_eq!(parsed.i64s("connectivity"), connectivity);
        assert_eq!(parsed.i64s("offsets").last(), Some(&(4 * mesh.tets.len() as i64)));
        assert!(parsed.arrays["types"].2.iter().all(|&t| t == 10));
    }

    #[test]
    fn a_quadratic_tetrahedron_has_ten_nodes_and_type_24() {
        let nodes = vec![Vec3::zeros(); 10];
        let cells = [std::array::from_fn(|i| i as u32)];
        let grid =
            Grid { nodes: &nodes, cells: Cells::Quadratic(&cells), point_fields: &[], cell_fields: &[] };
        let parsed = parse(&text(&grid));
        assert_eq!(parsed.i64s("offsets"), [10]);
        assert_eq!(parsed.arrays["types"].2, [24]);
    }

    #[test]
    fn what_does_not_fit_together_is_refused() {
        let nodes = vec![Vec3::zeros(); 4];
        let short = [Field { name: "short", values: FieldValues::Labels(&[1, 2]) }];
        let grid = Grid {
            nodes: &nodes,
            cells: Cells::Linear(&[[0, 1, 2, 3]]),
            point_fields: &short,
            cell_fields: &[],
        };
        assert!(matches!(check(&grid), Err(ReportError::FieldLength { values: 2, expected: 4, .. })));
        let grid = Grid { cells: Cells::Linear(&[[0, 1, 2, 3], [0, 1, 7, 3]]), point_fields: &[], ..grid };
        assert!(matches!(check(&grid), Err(ReportError::NoSuchNode { cell: 1, node: 7, nodes: 4 })));
    }
}
