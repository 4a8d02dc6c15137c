//! Whether the 90 % interval of Young's modulus covers the truth in 90 % of recordings.
//!
//! Every repeat draws a phantom, its restraint, sites, depths, the fit mesh's offset and noise from a seed, records
//! it on the simulated bench (hexahedra of its own) and fits it. Each repeat is a row of a table, which is added to as soon as the
//! row is known: seeds that are in it are not drawn again, so that a run of hours may be stopped and goes on. The shares at the end
//! are those of the whole table. Coverage is asserted nowhere: the figure is for people.
//!
//! `benches/coverage.csv` holds what was measured so far. It is to be begun anew when the fit changes.
//!
//! ```sh
//! cargo bench --bench coverage -- --repeats 1000 --first-seed 20001 --table benches/coverage.csv
//! ```

use phantom_rig::inverse::{PatchKind, Settings, fit};
use phantom_rig::sim::{Draw, Restraint, draw, record};
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::path::Path;
use table::Table;

#[path = "support/table.rs"]
mod table;

/// One repeat; moduli in Pa, totals in N/m.
#[derive(Debug, Serialize, Deserialize)]
struct Row {
    seed: u64,
    truth_pa: f64,
    value_pa: f64,
    sd_pa: f64,
    bound_pa: f64,
    low_pa: f64,
    high_pa: f64,
    true_total_n_per_m: f64,
    total_n_per_m: f64,
    total_sd_n_per_m: f64,
    true_patches: usize,
    patches: usize,
    true_glued: usize,
    glued: usize,
    chi2_per_dof: f64,
}

/// Edge of the boxes that the fit's mesh is cut from (m): a slab of 150 × 100 × 25 mm then has 1,216 nodes, like a mesh that somebody
/// brings.
const FIT_CELL_M: f64 = 0.008;

fn repeat(seed: u64) -> Result<Row, Box<dyn Error>> {
    let session = Draw { fit_cell_m: FIT_CELL_M, ..draw(seed) };
    let recording = record(&session)?;
    let found = fit(&recording, &Settings::default(), &mut |_| {})?;
    if !found.settled {
        return Err("the fit did not settle".into());
    }
    let springs = |r: &Restraint| match r {
        Restraint::Springs { stiffness_n_per_m, .. } => *stiffness_n_per_m,
        Restraint::Glued { .. } => 0.0,
    };
    Ok(Row {
        seed,
        truth_pa: session.young_modulus_pa,
        value_pa: found.young_modulus_pa.value,
        sd_pa: found.young_modulus_pa.sd,
        bound_pa: found.young_modulus_bound_pa,
        low_pa: found.young_modulus_interval90_pa[0],
        high_pa: found.young_modulus_interval90_pa[1],
        true_total_n_per_m: session.restraints.iter().map(springs).sum(),
        total_n_per_m: found.restraint_total_n_per_m.value,
        total_sd_n_per_m: found.restraint_total_n_per_m.sd,
        true_patches: session.restraints.len(),
        patches: found.patches.len(),
        true_glued: session.restraints.iter().filter(|r| matches!(r, Restraint::Glued { .. })).count(),
        glued: found.patches.iter().filter(|p| matches!(p.kind, PatchKind::Glued { .. })).count(),
        chi2_per_dof: found.residual.chi2_per_dof,
    })
}

/// Half the width of a 90 % interval, in standard deviations.
const Z90: f64 = 1.645;

fn main() -> Result<(), Box<dyn Error>> {
    let argument = |name: &str| std::env::args().skip_while(|a| a != name).nth(1);
    let number = |name: &str, default: u64| argument(name).map_or(Ok(default), |v| v.parse());
    let (repeats, first) = (number("--repeats", 20)?, number("--first-seed", 1)?);
    let table = argument("--table").unwrap_or_else(|| "target/coverage.csv".to_owned());
    let mut table = Table::<Row>::open(Path::new(&table))?;
    let mut failed = 0;
    for seed in first..first + repeats {
        if table.rows.iter().any(|row| row.seed == seed) {
            continue;
        }
        match repeat(seed) {
            Ok(row) => table.add(row)?,
            Err(error) => {
                eprintln!("seed {seed}: {error}");
                failed += 1;
            }
        }
    }
    let rows = &table.rows;
    let n = rows.len() as f64;
    let share = |hit: &dyn Fn(&Row) -> bool| 100.0 * rows.iter().filter(|r| hit(r)).count() as f64 / n;
    let error = |r: &Row| r.value_pa / r.truth_pa - 1.0;
    let mean = rows.iter().map(error).sum::<f64>() / n;
    let rms = (rows.iter().map(|r| error(r).powi(2)).sum::<f64>() / n).sqrt();
    let right = |r: &Row| r.true_patches == r.patches && r.true_glued == r.glued;
    let sprung: Vec<&Row> = rows.iter().filter(|r| right(r) && r.true_total_n_per_m > 0.0).collect();
    let within = |r: &&&Row| (r.total_n_per_m - r.true_total_n_per_m).abs() <= Z90 * r.total_sd_n_per_m;
    println!(
        "{n} repeats, {failed} without a fit: the 90 % interval covers {:.1} %; modulus off by {:.3} % in the mean, \
         {:.3} % rms; right number of patches in {:.1} %; of {} of them with springs that of the total covers {}",
        share(&|r| (r.low_pa..=r.high_pa).contains(&r.truth_pa)),
        100.0 * mean,
        100.0 * rms,
        share(&right),
        sprung.len(),
        sprung.iter().filter(within).count(),
    );
    Ok(())
}
