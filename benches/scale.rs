//! What a fit costs against the size of the given mesh: wall and processor time and memory of the whole program, one
//! process a row.
//!
//! The demonstration's session (five pokes, 80-odd markers, two bands) is recorded with given meshes of several sizes,
//! and the program fits each. Processor time and the resident set's high-water mark are what Linux tells while the
//! program runs, so that the last 10 ms are missed.
//!
//! ```sh
//! cargo bench --bench scale                  # the whole table, some minutes
//! cargo bench --bench scale -- --edge-mm 4.5 --element p2 --quick
//! ```

use phantom_rig::dataset::write_bundle;
use phantom_rig::sim::{Draw, demo, record};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// One fit: edge of the boxes that the given mesh is cut from (mm), elements, whether to stay on the given mesh.
struct Case {
    edge_mm: f64,
    element: String,
    quick: bool,
}

/// Edges (mm) that give 1,540 nodes (the demonstration's own), 4,704 (33,579 of second order: 100,737 degrees of
/// freedom), 13,392 and 50,400.
const TABLE: [(f64, &str); 6] =
    [(6.8, "p1"), (6.8, "p2"), (4.5, "p1"), (4.5, "p2"), (3.0, "p1"), (1.9, "p1")];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "edge/mm  nodes  dof given  dof finest  element  mode     seconds  processor  peak/GB  E/truth−1  exit"
    );
    for case in cases()? {
        run(&case)?;
    }
    Ok(())
}

fn cases() -> Result<Vec<Case>, Box<dyn std::error::Error>> {
    let given = |name: &str| std::env::args().skip_while(|a| a != name).nth(1);
    let Some(edge) = given("--edge-mm") else {
        return Ok(TABLE
            .iter()
            .flat_map(|&(edge_mm, element)| {
                [true, false].map(|quick| Case { edge_mm, element: element.to_owned(), quick })
            })
            .collect());
    };
    let element = given("--element").unwrap_or_else(|| "p2".to_owned());
    let quick = std::env::args().any(|a| a == "--quick");
    Ok(vec![Case { edge_mm: edge.parse()?, element, quick }])
}

fn run(case: &Case) -> Result<(), Box<dyn std::error::Error>> {
    let session = Draw { fit_cell_m: case.edge_mm * 1e-3, ..demo() };
    let place = tempfile::tempdir()?;
    let bundle = place.path().join("recording");
    std::fs::create_dir(&bundle)?;
    let recording = record(&session)?;
    write_bundle(&recording, &bundle)?;
    let out = place.path().join("fit");

    let clock = Instant::now();
    let mut program = Command::new(env!("CARGO_BIN_EXE_phantom-rig"));
    program.args(["fit", "--element", &case.element, "--out"]).args([&out, &bundle]);
    program.args(case.quick.then_some("--quick")).stdout(Stdio::null());
    let mut program = program.spawn()?;
    let (mut peak_kb, mut busy_s) = (None, None);
    let exit = loop {
        if let Some(exit) = program.try_wait()? {
            break exit;
        }
        peak_kb = resident_peak_kb(program.id()).or(peak_kb);
        busy_s = processor_s(program.id()).filter(|&s| s > 0.0).or(busy_s);
        std::thread::sleep(Duration::from_millis(10));
    };
    let seconds = clock.elapsed().as_secs_f64();

    let nodes = recording.mesh.nodes.len();
    let given = match case.element.as_str() {
        "p1" => 3 * nodes,
        _ => 3 * phantom_rig::fem::Space::new(&recording.mesh, phantom_rig::fem::Order::P2)?.nodes().len(),
    };
    let (finest, modulus) = answer(&out).unwrap_or((0, f64::NAN));
    println!(
        "{:7.1}  {nodes:5}  {given:9}  {finest:10}  {:7}  {:7}  {seconds:7.1}  {:9}  {:7}  {:+8.2} %  {}",
        case.edge_mm,
        case.element,
        if case.quick { "quick" } else { "default" },
        busy_s.map_or("unknown".to_owned(), |s| format!("{s:.1}")),
        peak_kb.map_or("unknown".to_owned(), |kb| format!("{:.2}", kb as f64 / 1048576.0)),
        100.0 * (modulus / session.young_modulus_pa - 1.0),
        exit.code().map_or("killed".to_owned(), |c| c.to_string()),
    );
    Ok(())
}

/// High-water mark of the resident set, in units of 1024 bytes; `None` where there is no `/proc` or no such process.
fn resident_peak_kb(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?.split_whitespace().next()?.parse().ok()
}

/// Processor time (s) so far, in Linux' ticks of 10 ms; `None` where there is no `/proc` or no such process.
fn processor_s(process: u32) -> Option<f64> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name in parentheses may hold spaces; user and system time are the 12th and 13th word after it.
    let mut ticks = stat.rsplit_once(") ")?.1.split(' ').skip(11);
    Some(0.01 * (ticks.next()?.parse::<f64>().ok()? + ticks.next()?.parse::<f64>().ok()?))
}

/// Degrees of freedom of the finest discretisation, and Young's modulus (Pa).
fn answer(out: &Path) -> Option<(u64, f64)> {
    let text = std::fs::read_to_string(out.join("fit.json")).ok()?;
    let fit: serde_json::Value = serde_json::from_str(&text).ok()?;
    Some((fit["discretisation"]["degrees_of_freedom"].as_u64()?, fit["young_modulus_pa"]["value"].as_f64()?))
}
