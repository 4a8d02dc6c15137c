//! The same second-order job by this program and by CalculiX, one after the other: `cargo bench --bench against_calculix`.
//!
//! A slab of 150 × 100 × 25 mm with its inner nodes off the grid, half of its underside glued, pressed by a pad of 8 mm
//! radius that no edge of the mesh follows: ten-node tetrahedra (C3D10, both integrate the stiffness exactly),
//! E = 10.5 kPa, ν = 0.47, linear. Both start as a process of their own, read the job from a text file, and write every
//! node's displacement with seven digits; both get the pad as the same nodal forces. This program puts the edge nodes on
//! the mesh and spreads the pad by itself, CalculiX finds both in its file.
//!
//! Wall times are the best of the rounds, on as many threads as asked for; displacements must agree to what the
//! printed digits leave. CalculiX runs with its direct solver (SPOOLES, its default) and with the iterative one.
//!
//! ```sh
//! cargo bench --bench against_calculix -- --threads 2 --rounds 3
//! ```
//! Needs `ccx` (Debian: calculix-ccx); without it the bench says so and does nothing.

use nalgebra::Vector3;
use phantom_rig::dataset::{read_mesh, write_msh};
use phantom_rig::fem::{Functional, Model, Order, Space, Spot};
use phantom_rig::geometry::Vec3;
use phantom_rig::mesh::{Block, TetMesh, block};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

const SIZE_M: [f64; 3] = [0.15, 0.1, 0.025];
/// Boxes along the edges: 5,313, 14,553 and 32,513 second-order nodes.
const CELLS: [[usize; 3]; 3] = [[16, 11, 3], [24, 16, 4], [30, 20, 6]];
const MODULUS_PA: f64 = 10_500.0;
const POISSON: f64 = 0.47;
const PAD_M: ([f64; 3], f64) = ([0.1037, 0.0462, 0.025], 0.008);
const FORCE_N: [f64; 3] = [0.1, 0.0, -0.5];

/// Largest difference of displacements over the largest displacement: half a unit of the seventh digit on either side,
/// with room for what the digits of the job file leave.
const AGREEMENT: f64 = 2e-6;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|a| a == "--solve") {
        return solve(Path::new(&arguments[at + 1]), Path::new(&arguments[at + 2]));
    }
    let number = |name: &str, default: usize| {
        let given = arguments.iter().skip_while(|a| *a != name).nth(1);
        given.map_or(Ok(default), |text| text.parse())
    };
    let (threads, rounds) = (number("--threads", 2)?, number("--rounds", 3)?);
    if Command::new("ccx").arg("-v").stdout(Stdio::null()).stderr(Stdio::null()).status().is_err() {
        println!("skipped: ccx not found (Debian: apt-get install calculix-ccx)");
        return Ok(());
    }
    println!("wall time of the whole job, best of {rounds}, {threads} threads");
    println!("nodes  unknowns  ours/s  ccx/s  ratio  difference  ccx iterative/s  ratio  difference");
    for cells in CELLS {
        side_by_side(cells, threads, rounds)?;
    }
    Ok(())
}

fn side_by_side(cells: [usize; 3], threads: usize, rounds: usize) -> Outcome<()> {
    let folder = tempfile::tempdir()?;
    let file = |name: &str| folder.path().join(name);
    let mesh = slab(cells)?;
    write_msh(&mesh, BufWriter::new(std::fs::File::create(file("slab.msh"))?))?;
    let space = Space::new(&mesh, Order::P2)?;
    let solvers = [("direct", "SPOOLES"), ("iterative", "ITERATIVE CHOLESKY")];
    for (job, solver) in solvers {
        write_inp(&space, solver, BufWriter::new(std::fs::File::create(file(&format!("{job}.inp")))?))?;
    }
    let mut best = [f64::INFINITY; 3];
    for _ in 0..rounds {
        let mut ours = Command::new(std::env::current_exe()?);
        ours.arg("--solve").args([file("slab.msh"), file("ours.dat")]);
        ours.env("RAYON_NUM_THREADS", threads.to_string());
        best[0] = best[0].min(seconds(ours)?);
        for (best, (job, _)) in best[1..].iter_mut().zip(solvers) {
            let mut ccx = Command::new("ccx");
            ccx.args(["-i", job]).current_dir(folder.path());
            ccx.env("OMP_NUM_THREADS", threads.to_string());
            *best = best.min(seconds(ccx)?);
        }
    }
    let ours = displacements(&file("ours.dat"), space.nodes().len())?;
    let largest = ours.iter().map(Vec3::amax).fold(0.0, f64::max);
    let difference = |job: &str| -> Outcome<f64> {
        let theirs = displacements(&file(&format!("{job}.dat")), ours.len())?;
        Ok(ours.iter().zip(&theirs).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max) / largest)
    };
    let [direct, iterative] = [difference("direct")?, difference("iterative")?];
    let unknowns = 3 * space.on_surface("fixed").iter().filter(|&&held| !held).count();
    println!(
        "{:5}  {unknowns:8}  {:6.2}  {:5.2}  {:5.2}  {direct:10.1e}  {:15.2}  {:5.2}  {iterative:10.1e}",
        space.nodes().len(),
        best[0],
        best[1],
        best[0] / best[1],
        best[2],
        best[0] / best[2]
    );
    if direct > AGREEMENT {
        return Err(
            format!("the displacements differ by {direct:.1e}; expected at most {AGREEMENT:.0e}").into()
        );
    }
    Ok(())
}

/// Wall time of a process that must succeed.
fn seconds(mut command: Command) -> Outcome<f64> {
    let clock = Instant::now();
    let done = command.stdout(Stdio::null()).status()?;
    let seconds = clock.elapsed().as_secs_f64();
    if done.success() { Ok(seconds) } else { Err(format!("{command:?}: {done}").into()) }
}

/// This program's job, in a process of its own: mesh file → file of displacements.
fn solve(mesh: &Path, to: &Path) -> Outcome<()> {
    let mesh = read_mesh(mesh)?;
    let model = Model::new(&mesh, Order::P2, POISSON, "fixed")?;
    let nodal = model.respond_to(&[pad(model.space())?])?.pop().unwrap_or_default();
    let mut out = BufWriter::new(std::fs::File::create(to)?);
    for (node, u) in nodal.chunks_exact(3).enumerate() {
        let [x, y, z] = [0, 1, 2].map(|i| u[i] / MODULUS_PA);
        writeln!(out, "{} {x:.6e} {y:.6e} {z:.6e}", node + 1)?;
    }
    Ok(out.flush()?)
}

/// The slab; the first half of its underside is the surface `fixed`.
fn slab(cells: [usize; 3]) -> Outcome<TetMesh> {
    let mut mesh = block(&Block { size_m: SIZE_M, cells })?;
    for (i, p) in mesh.nodes.iter_mut().enumerate() {
        if (0..3).all(|a| p[a] > 0.0 && p[a] < SIZE_M[a]) {
            let shift = |a: usize| 0.1 * SIZE_M[a] / cells[a] as f64 * (((3 * i + a) as f64) * 12.9898).sin();
            *p += Vector3::from_fn(|a, _| shift(a));
        }
    }
    let underside = mesh.surface("z-").iter();
    let glued = underside.filter(|&&f| mesh.triangle(f).0.iter().all(|p| p.x <= 0.5 * SIZE_M[0]));
    let glued = glued.copied().collect();
    mesh.surfaces.insert("fixed".to_owned(), glued);
    Ok(mesh)
}

/// Nodal forces (N) of the pad.
fn pad(space: &Space) -> Outcome<Functional> {
    let (centre, radius) = PAD_M;
    let disc = Spot::disc(space, space.surface("z+"), &Vec3::from(centre), radius)?;
    let forces = disc.weights.iter().zip(FORCE_N);
    Ok(forces.flat_map(|(w, force)| w.iter().map(move |&(c, w)| (c, w * force))).collect())
}

/// The job as CalculiX reads it. Corners and edges of a C3D10 follow each other as here; numbers have at most twenty
/// characters.
fn write_inp(space: &Space, solver: &str, mut to: impl Write) -> Outcome<()> {
    writeln!(to, "*NODE, NSET=ALL")?;
    for (node, p) in space.nodes().iter().enumerate() {
        writeln!(to, "{}, {:.11e}, {:.11e}, {:.11e}", node + 1, p.x, p.y, p.z)?;
    }
    writeln!(to, "*ELEMENT, TYPE=C3D10, ELSET=PHANTOM")?;
    for (cell, nodes) in space.cells().enumerate() {
        let nodes: Vec<String> = nodes.iter().map(|n| (n + 1).to_string()).collect();
        writeln!(to, "{}, {}", cell + 1, nodes.join(", "))?;
    }
    writeln!(to, "*NSET, NSET=FIXED")?;
    for node in (0..space.nodes().len()).zip(space.on_surface("fixed")).filter_map(|(n, on)| on.then_some(n))
    {
        writeln!(to, "{},", node + 1)?;
    }
    writeln!(to, "*MATERIAL, NAME=GEL\n*ELASTIC\n{MODULUS_PA}, {POISSON}")?;
    writeln!(to, "*SOLID SECTION, ELSET=PHANTOM, MATERIAL=GEL")?;
    writeln!(to, "*BOUNDARY\nFIXED, 1, 3\n*STEP\n*STATIC, SOLVER={solver}\n*CLOAD")?;
    for (component, force) in pad(space)? {
        writeln!(to, "{}, {}, {force:.11e}", component / 3 + 1, component % 3 + 1)?;
    }
    writeln!(to, "*NODE PRINT, NSET=ALL\nU\n*END STEP")?;
    Ok(to.flush()?)
}

/// Displacements (m) from lines of a node's number and three components; all other lines are headings.
fn displacements(file: &Path, nodes: usize) -> Outcome<Vec<Vec3>> {
    let mut found = vec![Vec3::repeat(f64::NAN); nodes];
    let mut count = 0;
    for line in std::fs::read_to_string(file)?.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [node, u @ ..] = words.as_slice() else { continue };
        let (Ok(node), [x, y, z]) = (node.parse::<usize>(), u) else { continue };
        found[node - 1] = Vec3::new(x.parse()?, y.parse()?, z.parse()?);
        count += 1;
    }
    if count == nodes {
        Ok(found)
    } else {
        Err(format!("{}: {count} displacements; expected {nodes}", file.display()).into())
    }
}
