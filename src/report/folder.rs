//! Which files a fit leaves behind.

use super::document::FitDocument;
use super::vtk::{write_markers, write_poke, write_restraint};
use super::{ReportError, page, tables};
use crate::fem::{Order, Space};
use crate::inverse::{Fit, PokeView};
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
    let spaces = [Order::P1, Order::P2].map(|order| Space::new(&recording.mesh, order));
    let spaces = spaces.into_iter().collect::<Result<Vec<_>, _>>()?;
    let elements = fit.pokes.iter().map(|poke| elements(&spaces, poke)).collect::<Result<Vec<_>, _>>()?;
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
    for (poke, space) in fit.pokes.iter().zip(&elements) {
        let body = next(&format!("vtk/poke-{:03}.vtu", poke.number));
        pokes.push((poke, space, body, next(&format!("vtk/poke-{:03}-markers.vtp", poke.number))));
    }
    // Compressing the arrays is most of the work.
    pokes.par_iter().try_for_each(|(poke, space, body, markers)| {
        write_poke(body, space, poke)?;
        write_markers(markers, poke)
    })?;
    if !fit.patches.is_empty() {
        write_restraint(&next("vtk/restraint.vtp"), &fit.patches)?;
    }
    Ok(written)
}

/// Those elements, of any order, on the recording's mesh whose nodes `poke` displaces.
fn elements<'s>(spaces: &'s [Space], poke: &PokeView) -> Result<&'s Space, ReportError> {
    let displacements = poke.node_displacement_m.len();
    let fitting = spaces.iter().find(|space| space.nodes().len() == displacements);
    fitting.ok_or_else(|| ReportError::OtherMesh {
        poke: poke.number,
        displacements,
        nodes: spaces.first().map_or(0, |space| space.nodes().len()),
    })
}

fn write_text(path: &Path, text: &str) -> Result<(), ReportError> {
    fs::write(path, text).map_err(|source| ReportError::Write { path: path.to_owned(), source })
}
