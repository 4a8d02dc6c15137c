//! A mesh → Gmsh MSH 4.1, ASCII: one entity a named surface, the tetrahedra as the physical volume `phantom`.

use super::assemble::PHANTOM;
use crate::mesh::TetMesh;
use std::io::{self, Write};

/// Writes `mesh` (m). What is written is read again as it was: numbers are the shortest that read back to the
/// same value, nodes and elements keep their order.
///
/// A triangle of two surfaces is written twice, once in each.
///
/// # Errors
/// Whatever `to` reports.
pub fn write_msh(mesh: &TetMesh, mut to: impl Write) -> io::Result<()> {
    let surfaces = mesh.surfaces.len();
    let volume_group = surfaces + 1;
    writeln!(to, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n{}", surfaces + 1)?;
    for (i, name) in mesh.surfaces.keys().enumerate() {
        writeln!(to, "2 {} \"{name}\"", i + 1)?;
    }
    writeln!(to, "3 {volume_group} \"{PHANTOM}\"\n$EndPhysicalNames")?;

    let ([x0, y0, z0], [x1, y1, z1]) = bounds(mesh);
    let bounds = format!("{x0:?} {y0:?} {z0:?} {x1:?} {y1:?} {z1:?}");
    writeln!(to, "$Entities\n0 0 {surfaces} 1")?;
    for i in 1..=surfaces {
        writeln!(to, "{i} {bounds} 1 {i} 0")?;
    }
    write!(to, "1 {bounds} 1 {volume_group} {surfaces}")?;
    for i in 1..=surfaces {
        write!(to, " {i}")?;
    }
    writeln!(to, "\n$EndEntities")?;

    let nodes = mesh.nodes.len();
    writeln!(to, "$Nodes\n1 {nodes} 1 {nodes}\n3 1 0 {nodes}")?;
    for tag in 1..=nodes {
        writeln!(to, "{tag}")?;
    }
    for p in &mesh.nodes {
        writeln!(to, "{:?} {:?} {:?}", p.x, p.y, p.z)?;
    }
    writeln!(to, "$EndNodes")?;

    let elements = mesh.tets.len() + mesh.surfaces.values().map(Vec::len).sum::<usize>();
    writeln!(to, "$Elements\n{} {elements} 1 {elements}", surfaces + 1)?;
    let mut tag = 0_usize;
    for (i, triangles) in mesh.surfaces.values().enumerate() {
        writeln!(to, "2 {} 2 {}", i + 1, triangles.len())?;
        for [a, b, c] in triangles {
            tag += 1;
            writeln!(to, "{tag} {} {} {}", a + 1, b + 1, c + 1)?;
        }
    }
    writeln!(to, "3 1 4 {}", mesh.tets.len())?;
    for [a, b, c, d] in &mesh.tets {
        tag += 1;
        writeln!(to, "{tag} {} {} {} {}", a + 1, b + 1, c + 1, d + 1)?;
    }
    writeln!(to, "$EndElements")?;
    to.flush()
}

fn bounds(mesh: &TetMesh) -> ([f64; 3], [f64; 3]) {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in &mesh.nodes {
        for i in 0..3 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    (low, high)
}
