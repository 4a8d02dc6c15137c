//! `mesh block`: a block's size, cells and named regions → a Gmsh file.

use super::{Context, Exit, Outcome, Region, StagedFile, UsageError};
use crate::dataset::write_msh;
use crate::mesh::{Block, TetMesh, block};
use anyhow::Context as _;
use clap::Args;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

/// Writes a rectangular block as a Gmsh mesh with named surfaces.
///
/// The block reaches from the origin to its size along x, y and z and is cut into cells of six tetrahedra.
/// A region is a side of the block (x-, x+, y-, y+, z-, z+) and bounds behind it, separated by commas, that
/// all hold: "z-,x<60mm" is the underside up to x = 60 mm. Bounds lie on cell borders. A surface may be given
/// several times; its regions add up. What is in no region is free. At most 2,000,000 cells.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig mesh block --size-mm 150x100x25 --cells 30x20x5 \\
      --fixed 'z-,x<60mm' --search 'z-,x>60mm' --observed z+ slab.msh
  phantom-rig mesh block --size-mm 100x30x30 --cells 20x6x6 --fixed x- --search y- \\
      --observed z+ --observed x+ beam.msh")]
pub(super) struct BlockArguments {
    /// Edge lengths along x, y and z in millimetres, such as 150x100x25
    #[arg(long, value_name = "LXxLYxLZ", value_parser = sizes)]
    size_mm: [f64; 3],
    /// Cells along x, y and z, such as 30x20x5
    #[arg(long, value_name = "NXxNYxNZ", value_parser = counts)]
    cells: [usize; 3],
    /// Glued region, such as 'z-,x<60mm'
    #[arg(long, value_name = "REGION")]
    fixed: Vec<Region>,
    /// Region where an unknown restraint may act
    #[arg(long, value_name = "REGION")]
    search: Vec<Region>,
    /// Region that the camera sees
    #[arg(long, value_name = "REGION")]
    observed: Vec<Region>,
    /// Replace the file when it exists
    #[arg(long)]
    force: bool,
    /// The file to write
    #[arg(value_name = "FILE.msh")]
    file: PathBuf,
}

pub(super) fn run(arguments: &BlockArguments, context: &Context) -> anyhow::Result<Outcome> {
    // 150 mm is 150 / 1000 m: the nearest number to 0.15, which 150 · 1e-3 is not always.
    let shape = Block { size_m: arguments.size_mm.map(|l| l / 1e3), cells: arguments.cells };
    few_enough(shape.cells)?;
    let staged = StagedFile::new(&arguments.file, arguments.force)?;
    let spinner = context.progress.spinner("cutting the block");
    let mut mesh = block(&shape)?;
    mesh.surfaces = named_surfaces(arguments, &shape, &mesh)?;
    spinner.label("writing");
    File::create(staged.path())
        .and_then(|file| write_msh(&mesh, BufWriter::new(file)))
        .with_context(|| format!("can't write {}", arguments.file.display()))?;
    staged.finish()?;
    drop(spinner);
    Ok(outcome(arguments, &mesh))
}

/// Cells that a block may have. Cutting a million takes 1.2 GB of memory and makes six million tetrahedra, far more than a fit can use.
const MOST_CELLS: usize = 2_000_000;

/// Refuses more cells than the computer's memory can be trusted to hold.
fn few_enough(cells: [usize; 3]) -> Result<(), UsageError> {
    let asked: f64 = cells.iter().map(|&c| c as f64).product();
    if asked <= MOST_CELLS as f64 {
        return Ok(());
    }
    let [x, y, z] = cells;
    Err(UsageError(format!(
        "--cells {x}x{y}x{z}: {asked} cells would take about {:.0} GB of memory; expected at most {MOST_CELLS} cells",
        1.2e-6 * asked
    )))
}

fn named_surfaces(
    arguments: &BlockArguments,
    shape: &Block,
    mesh: &TetMesh,
) -> anyhow::Result<BTreeMap<String, Vec<[u32; 3]>>> {
    let mut surfaces: BTreeMap<String, Vec<[u32; 3]>> = BTreeMap::new();
    let mut taken: HashMap<[u32; 3], &str> = HashMap::new();
    for (name, regions) in
        [("fixed", &arguments.fixed), ("search", &arguments.search), ("observed", &arguments.observed)]
    {
        for region in regions {
            for face in region.select(shape, mesh).map_err(|e| UsageError(format!("--{name} {e}")))? {
                match taken.insert(face, name) {
                    None => surfaces.entry(name.to_owned()).or_default().push(face),
                    Some(other) if other == name => {}
                    Some(other) => {
                        let overlap = format!("--{name} and --{other} overlap; expected separate regions");
                        return Err(UsageError(overlap).into());
                    }
                }
            }
        }
    }
    Ok(surfaces)
}

fn outcome(arguments: &BlockArguments, mesh: &TetMesh) -> Outcome {
    let (nodes, tets) = (mesh.nodes.len(), mesh.tets.len());
    let mut text = format!("{}: {nodes} nodes, {tets} tetrahedra", arguments.file.display());
    for (name, faces) in &mesh.surfaces {
        let area: f64 = faces.iter().map(|&f| mesh.triangle(f).area()).sum();
        text += &format!("\n  {name:<9}{:>7} triangles {:>9.3} cm²", faces.len(), 1e4 * area);
    }
    let missing: Vec<&str> =
        ["fixed", "search", "observed"].into_iter().filter(|n| mesh.surface(n).is_empty()).collect();
    if !missing.is_empty() {
        text += &format!("\nnote: a bundle's mesh also needs {}", missing.join(", "));
    }
    let surfaces: BTreeMap<&str, usize> = mesh.surfaces.iter().map(|(n, f)| (n.as_str(), f.len())).collect();
    let json = serde_json::json!({
        "format": "phantom-mesh/1",
        "file": arguments.file,
        "nodes": nodes,
        "tetrahedra": tets,
        "surface_triangles": surfaces,
    });
    Outcome { exit: Exit::Good, text, json }
}

fn sizes(text: &str) -> Result<[f64; 3], String> {
    let size = triple(text)?;
    if size.iter().all(|&l: &f64| l.is_finite() && l > 0.0) {
        Ok(size)
    } else {
        Err("expected three positive lengths in millimetres".to_owned())
    }
}

fn counts(text: &str) -> Result<[usize; 3], String> {
    let counts = triple(text)?;
    if counts.contains(&0) {
        Err("expected at least one cell along each edge".to_owned())
    } else {
        Ok(counts)
    }
}

/// Three numbers with an `x` between them.
fn triple<T: std::str::FromStr>(text: &str) -> Result<[T; 3], String> {
    let numbers: Option<Vec<T>> = text.split('x').map(|n| n.trim().parse().ok()).collect();
    numbers
        .and_then(|n| n.try_into().ok())
        .ok_or_else(|| "expected three numbers with an x between them, such as 150x100x25".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triples_are_three_numbers() {
        assert_eq!(sizes("150x100x25.5"), Ok([150.0, 100.0, 25.5]));
        assert_eq!(counts("30 x 20 x 5"), Ok([30, 20, 5]));
        for text in ["", "150", "1x2", "1x2x3x4", "1x2xthree", "1x-2x3", "1xinfx3", "1xnanx3"] {
            assert!(sizes(text).is_err(), "{text}");
        }
        for text in ["1x2.5x3", "1x0x3", "1x-1x3"] {
            assert!(counts(text).is_err(), "{text}");
        }
    }

    #[test]
    fn more_cells_than_fit_are_refused_with_their_number() {
        assert!(few_enough([200, 100, 100]).is_ok());
        let refused = few_enough([3000, 2000, 500]).expect_err("too many").to_string();
        assert!(refused.contains("3000x2000x500: 3000000000 cells"), "{refused}");
        assert!(refused.contains("3600 GB") && refused.contains("at most 2000000 cells"), "{refused}");
        for cells in [[201, 100, 100], [usize::MAX; 3]] {
            assert!(few_enough(cells).is_err(), "{cells:?}");
        }
    }
}
