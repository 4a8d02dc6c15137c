//! Which files the experiment leaves behind.

use super::{body, experiment_text, nodes, tables, verdicts};
use crate::inverse::experiment::{Restraint, Shape, Study, Summary, bars};
use crate::report::ReportError;
use std::fs;
use std::path::{Path, PathBuf};

/// Writes `experiment.txt`, `trials.csv`, `summary.csv`, `bars.csv` and for each restraint figures of the deformed
/// body, of the search nodes' displacements and of their stiffness errors into an existing folder, and says what was
/// written.
///
/// # Errors
/// [`ReportError::Write`] and [`ReportError::Mesh`].
pub fn write_experiment(
    folder: &Path,
    study: &Study,
    summaries: &[Summary],
    shapes: &[Shape],
) -> Result<Vec<PathBuf>, ReportError> {
    let mut files = vec![
        (folder.join("experiment.txt"), experiment_text(study, summaries)),
        (folder.join("trials.csv"), tables::trials_csv(&study.trials)),
        (folder.join("summary.csv"), tables::summary_csv(summaries)),
        (folder.join("bars.csv"), verdicts::bars_csv(&bars(study, summaries))),
    ];
    for (restraint, truth) in &study.truth {
        let name = match restraint {
            Restraint::Fixed => "fixed",
            Restraint::Springs(_) => "springs",
            Restraint::Unequal(_) => "unequal",
        };
        let shown = study.shown(*restraint);
        let figure = |kind: &str| folder.join(format!("{kind}-{name}.svg"));
        files.push((figure("shapes"), body::shapes(study, *restraint, shapes)?));
        files.push((figure("displacements"), nodes::displacements(study, *restraint, truth, &shown)));
        if *restraint != Restraint::Fixed {
            files.push((figure("stiffness"), nodes::stiffness(study, *restraint, &shown)));
        }
    }
    let mut written = Vec::new();
    for (path, text) in files {
        fs::write(&path, text).map_err(|source| ReportError::Write { path: path.clone(), source })?;
        written.push(path);
    }
    Ok(written)
}
