//! `calibrate registration`: where the camera stands, from what it saw.

use super::instrument::next_in_rig;
use crate::calib::{Pair, RegistrationFile, match_constellation, register};
use crate::cli::look::{fiducials, look};
use crate::cli::{Context, Exit, Outcome, StagedFile, UsageError};
use crate::geometry::Mat3;
use crate::session::{Session, utc_text};
use crate::track::Settings;
use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::time::SystemTime;

/// Finds out where the camera stands, from fiducials that a session shows.
///
/// Fiducials are dots at known places of the bench, listed in the rig file (`fiducials_mm`): at least four, without symmetry, not on a line.
/// They are found among all dots by the distances between them, so that nothing has to be known of where the camera stands.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig run rigs/protocols/look.toml --rig rigs/bench.toml --out sessions/look
  phantom-rig calibrate registration sessions/look --out rigs/registration.toml")]
pub(in crate::cli) struct RegistrationArguments {
    /// A session with pictures
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// The file to write, for `registration` in the rig file
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// A fiducial is at most so far from where the others put it (mm)
    #[arg(long, value_name = "MM", default_value_t = 1.0, allow_negative_numbers = true)]
    tolerance_mm: f64,
    /// Replace the file when it exists
    #[arg(long)]
    force: bool,
}

/// Variance of a place besides what scatters from frame to frame (m²): 10 µm. Without it a long rest would count for exact.
const LASTING_M2: f64 = 1e-10;
/// Lengths that differ by more than this, and by three deviations, are worth a word.
const SCALE: f64 = 1e-3;

pub(super) fn run(arguments: &RegistrationArguments, context: &Context) -> anyhow::Result<Outcome> {
    let tolerance_mm = arguments.tolerance_mm;
    if !(tolerance_mm.is_finite() && tolerance_mm > 0.0) {
        return Err(UsageError(format!("--tolerance-mm {tolerance_mm}: expected more than 0")).into());
    }
    // A place that is taken is told before any pictures are followed, which takes a while.
    let staged = StagedFile::new(&arguments.out, arguments.force)?;
    let session = Session::open(&arguments.session)?;
    let name = arguments.session.display();
    let Some(camera) = &session.start().camera else { bail!("{name}: it has no camera") };
    let known = fiducials(camera);
    if known.is_empty() {
        bail!("{name}: its rig file lists no fiducials (camera.fiducials_mm)");
    }
    let looked =
        look(&session, Settings::default(), context)?.with_context(|| format!("{name}: no pictures"))?;
    let seen: Vec<_> = looked.resting.iter().map(|dot| dot.mean_m).collect();
    let matched = match_constellation(&seen, &known, 1e-3 * tolerance_mm)
        .with_context(|| format!("{name}: the fiducials"))?;
    let pairs: Vec<Pair> = (matched.iter().zip(&known))
        .filter_map(|(seen, known)| {
            let dot = &looked.resting[(*seen)?];
            Some(Pair {
                seen_m: dot.mean_m,
                seen_m2: dot.covariance_m2 + Mat3::identity() * LASTING_M2,
                known_m: *known,
                known_m2: Mat3::identity() * camera.fiducial_sd_m.powi(2),
            })
        })
        .collect();
    let found = register(&pairs).with_context(|| format!("{name}: the registration"))?;
    let file = RegistrationFile::new(&found, utc_text(SystemTime::now()), session.start().name.clone());
    let out = arguments.out.display();
    std::fs::write(staged.path(), file.text()?).with_context(|| format!("{out}: can't be written"))?;
    staged.finish()?;
    let (turn, shift) = found.deviations();
    let largest = |values: [f64; 3]| values.into_iter().fold(0.0, f64::max) * 1e3;
    let hidden = known.len() - pairs.len();
    let mut text = format!(
        "{} of {} fiducials seen; {:.3} mm left between seen and known (root mean square)\n\
         camera at ({:.1}, {:.1}, {:.1}) mm; at the fiducials' centre sure to {:.2} mrad and {:.3} mm\n\
         lengths seen are {:+.3} % ± {:.3} % off",
        pairs.len(),
        known.len(),
        found.rms_m * 1e3,
        found.translation_m.x * 1e3,
        found.translation_m.y * 1e3,
        found.translation_m.z * 1e3,
        largest(turn),
        largest(shift),
        -1e2 * found.scale_error,
        1e2 * found.scale_error_sd,
    );
    let scaled = found.scale_error.abs() > SCALE && found.scale_error.abs() > 3.0 * found.scale_error_sd;
    if scaled {
        text += "\nnote: that is more than chance: the camera's lens, its unit of depth or the fiducials' places are off";
    }
    text += &next_in_rig("camera", "registration", &arguments.out);
    Ok(Outcome {
        exit: if scaled || hidden > 0 { Exit::Degraded } else { Exit::Good },
        text,
        json: json!({
            "format": "phantom-registration-result/1",
            "file": arguments.out,
            "fiducials": known.len(),
            "seen": pairs.len(),
            "rms_m": found.rms_m,
            "chi2_per_dof": found.chi2_per_dof,
            "turn_sd_rad": turn,
            "shift_sd_m": shift,
            "scale_error": found.scale_error,
            "scale_error_sd": found.scale_error_sd,
        }),
    })
}
