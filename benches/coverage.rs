//! Whether the 90 % interval of Young's modulus covers the truth in 90 % of recordings.
//!
//! Every repeat draws a phantom, its restraint, sites, depths, the fit mesh's offset and noise from a seed, records
//! it on the simulated bench (hexahedra of its own) and fits it. Prints one row a repeat (CSV) and the shares at the
//! end. Coverage is asserted nowhere: the figure is for people.
//!
//! ```sh
//! cargo bench --bench coverage -- --repeats 1000 --first-seed 1 > coverage.csv
//! ```

use phantom_rig::inverse::{PatchKind, Settings, fit};
use phantom_rig::sim::{Restraint, draw, record};
use std::process::ExitCode;

struct Row {
    seed: u64,
    truth_pa: f64,
    value_pa: f64,
    sd_pa: f64,
    bound_pa: f64,
    low_pa: f64,
    high_pa: f64,
    true_total: f64,
    total: f64,
    total_sd: f64,
    patches: (usize, usize),
    glued: (usize, usize),
    chi2: f64,
}

fn repeat(seed: u64) -> Result<Row, Box<dyn std::error::Error>> {
    let session = draw(seed);
    let recording = record(&session)?;
    let found = fit(&recording, &Settings::default(), &mut |_| {})?;
    let springs = |r: &Restraint| match r {
        Restraint::Springs { stiffness_n_per_m, .. } => *stiffness_n_per_m,
        Restraint::Glued { .. } => 0.0,
    };
    let true_glued = session.restraints.iter().filter(|r| matches!(r, Restraint::Glued { .. })).count();
    let found_glued = found.patches.iter().filter(|p| matches!(p.kind, PatchKind::Glued { .. })).count();
    Ok(Row {
        seed,
        truth_pa: session.young_modulus_pa,
        value_pa: found.young_modulus_pa.value,
        sd_pa: found.young_modulus_pa.sd,
        bound_pa: found.young_modulus_bound_pa,
        low_pa: found.young_modulus_interval90_pa[0],
        high_pa: found.young_modulus_interval90_pa[1],
        true_total: session.restraints.iter().map(springs).sum(),
        total: found.restraint_total_n_per_m.value,
        total_sd: found.restraint_total_n_per_m.sd,
        patches: (session.restraints.len(), found.patches.len()),
        glued: (true_glued, found_glued),
        chi2: found.residual.chi2_per_dof,
    })
}

fn main() -> ExitCode {
    let argument = |name: &str, default: u64| {
        let mut arguments = std::env::args().skip_while(|a| a != name).skip(1);
        arguments.next().and_then(|v| v.parse().ok()).unwrap_or(default)
    };
    let (repeats, first) = (argument("--repeats", 20), argument("--first-seed", 1));
    println!(
        "seed,truth_pa,value_pa,sd_pa,bound_pa,low_pa,high_pa,true_total_n_per_m,total_n_per_m,total_sd_n_per_m,\
         true_patches,patches,true_glued,glued,chi2_per_dof"
    );
    let (mut rows, mut failed) = (Vec::new(), 0);
    for seed in first..first + repeats {
        match repeat(seed) {
            Ok(r) => {
                println!(
                    "{},{:.2},{:.2},{:.2},{:.2},{:.2},{:.2},{:.3},{:.3},{:.3},{},{},{},{},{:.4}",
                    r.seed,
                    r.truth_pa,
                    r.value_pa,
                    r.sd_pa,
                    r.bound_pa,
                    r.low_pa,
                    r.high_pa,
                    r.true_total,
                    r.total,
                    r.total_sd,
                    r.patches.0,
                    r.patches.1,
                    r.glued.0,
                    r.glued.1,
                    r.chi2
                );
                rows.push(r);
            }
            Err(error) => {
                eprintln!("seed {seed}: {error}");
                failed += 1;
            }
        }
    }
    let n = rows.len() as f64;
    let share = |hit: &dyn Fn(&Row) -> bool| 100.0 * rows.iter().filter(|r| hit(r)).count() as f64 / n;
    let error = |r: &Row| r.value_pa / r.truth_pa - 1.0;
    let mean = rows.iter().map(error).sum::<f64>() / n;
    let rms = (rows.iter().map(|r| error(r).powi(2)).sum::<f64>() / n).sqrt();
    eprintln!(
        "{n} repeats, {failed} without a fit: the 90 % interval covers {:.1} %; modulus off by {:.3} % in the mean, \
         {:.3} % rms; right number of patches in {:.1} %",
        share(&|r| (r.low_pa..=r.high_pa).contains(&r.truth_pa)),
        100.0 * mean,
        100.0 * rms,
        share(&|r| r.patches.0 == r.patches.1 && r.glued.0 == r.glued.1),
    );
    ExitCode::SUCCESS
}
