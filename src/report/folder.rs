//! Which files a fit leaves behind.

use super::document::FitDocument;
use super::vtk::{write_markers, write_poke, write_restraint};
use super::{ReportError, page, tables};
use crate::inverse::Fit;
use crate::observation::Recording;
use rayon::prelude::*;
use serde_json::{Map, Value};
use std::fs;
use std::path::{Path, PathBuf};

/// Writes everything that a person or a program may want of a fit into an existing folder and says what was
/// written: `fit.html` (the page), `fit.json`, `forces.csv`, `residuals.csv`, and in `vtk/` one `.vtu` and one `.vtp` a poke and the
/// restraint patches.
///
/// `settings` are those that made the fit, by name with unit. The folder should be a staging folder: after an
/// error some of the files may be there.
pub fn write_fit(
    folder: &Path,
    fit: &Fit,
    recording: &Recording,
    settings: &Map<String, Value>,
) -> Result<Vec<PathBuf>, ReportError> {
    check_mesh(fit, recording)?;
    let mut written = Vec::new();
    let mut next = |name: &str| {
        let path = folder.join(name);
        written.push(path.clone());
        path
    };
    let page = page(fit, recording, settings)?;
    write_text(&next("fit.html"), &page)?;
    write_text(&next("fit.json"), &(serde_json::to_string_pretty(&FitDocument::new(fit, settings))? + "\n"))?;
    tables::write_forces(&next("forces.csv"), fit)?;
    tables::write_residuals(&next("residuals.csv"), fit)?;

    let vtk = folder.join("vtk");
    fs::create_dir_all(&vtk).map_err(|source| ReportError::Write { path: vtk, source })?;
    let mut pokes = Vec::with_capacity(fit.pokes.len());
    for poke in &fit.pokes {
        let body = next(&format!("vtk/poke-{:03}.vtu", poke.number));
        pokes.push((poke, body, next(&format!("vtk/poke-{:03}-markers.vtp", poke.number))));
    }
    // Compressing the arrays is most of the work.
    pokes.par_iter().try_for_each(|(poke, body, markers)| {
        write_poke(body, &recording.mesh, poke)?;
        write_markers(markers, poke)
    })?;
    if !fit.patches.is_empty() {
        write_restraint(&next("vtk/restraint.vtp"), &fit.patches)?;
    }
    Ok(written)
}

/// Refuses a fit whose displacements belong to another mesh than the recording's.
fn check_mesh(fit: &Fit, recording: &Recording) -> Result<(), ReportError> {
    let nodes = recording.mesh.nodes.len();
    match fit.pokes.iter().find(|p| p.node_displacement_m.len() != nodes) {
        None => Ok(()),
        Some(poke) => Err(ReportError::OtherMesh {
            poke: poke.number,
            displacements: poke.node_displacement_m.len(),
            nodes,
        }),
    }
}

fn write_text(path: &Path, text: &str) -> Result<(), ReportError> {
    fs::write(path, text).map_err(|source| ReportError::Write { path: path.to_owned(), source })
}
