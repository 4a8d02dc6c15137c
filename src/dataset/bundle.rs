//! A bundle folder → a checked recording: which files are read, and in which order they are checked.

use super::attach::Body;
use super::channels::{read_markers, read_stage, read_wrench};
use super::manifest::read_manifest;
use super::mesh_file::read_mesh;
use super::pokes::read_pokes;
use super::suspicion::suspicions;
use super::table::ends_with_newline;
use super::{DatasetError, MeshFileError, Suspicion};
use crate::mesh::TetMesh;
use crate::observation::Recording;
use crate::session::Session;
use std::path::{Path, PathBuf};

/// The names under which a bundle's mesh is looked for, the first found being read.
pub const MESH_FILES: [&str; 3] = ["mesh.msh", "mesh.vtu", "mesh.vtk"];

/// Surfaces that every bundle's mesh names.
const SURFACES: [&str; 3] = ["fixed", "search", "observed"];

/// Reads the bundle in `folder`: the recording, and what about it is allowed but looks like a mistake.
///
/// # Errors
/// The first thing that the format forbids, with file, row and column. The mesh is checked before what lies on
/// it, and the small files before the large ones.
pub fn read_bundle(folder: &Path) -> Result<(Recording, Vec<Suspicion>), DatasetError> {
    if !folder.is_dir() {
        return Err(DatasetError::NotAFolder { folder: folder.to_owned() });
    }
    if Session::is_at(folder) && !folder.join("recording.toml").is_file() {
        return Err(DatasetError::IsASession { folder: folder.to_owned() });
    }
    let manifest_file = existing(folder, "recording.toml", "recording.toml")?;
    let poke_file = existing(folder, "pokes.csv", "pokes.csv")?;
    let force_file = existing(folder, "force.csv", "force.csv")?;
    let marker_file = existing(folder, "markers.csv", "markers.csv")?;
    let mesh_file = MESH_FILES
        .iter()
        .find_map(|name| existing(folder, name, name).ok())
        .map_or_else(|| existing(folder, MESH_FILES[0], "mesh.msh (or mesh.vtu, or mesh.vtk)"), Ok)?;
    let stage_file = existing(folder, "stage.csv", "stage.csv").ok();

    let stated = read_manifest(&manifest_file)?;
    let mesh = read_phantom(&mesh_file)?;
    let body = Body::new(&mesh, &mesh_file)
        .map_err(|e| DatasetError::Mesh { file: mesh_file.clone(), source: MeshFileError::Mesh(e) })?;
    let pokes = read_pokes(&poke_file, stated.rest_until_s)?;
    body.check_sites(&poke_file, &pokes)?;
    let stage = stage_file.as_deref().map(read_stage).transpose()?;
    let wrench = read_wrench(&force_file)?;
    let mut read = read_markers(&marker_file, stated.rest_until_s)?;
    let markers = std::mem::take(&mut read.markers);
    let recording = Recording {
        name: stated.name,
        rest_until_s: stated.rest_until_s,
        phantom: stated.phantom,
        tip: stated.tip,
        noise: stated.noise,
        max_standoff_m: stated.max_standoff_m,
        mesh,
        pokes: pokes.pokes,
        stage,
        wrench,
        markers,
    };
    let rest = recording.rest_positions();
    body.check_markers(&marker_file, &read.first_row, &recording, &rest)?;

    let mut suspected = Vec::new();
    for file in [Some(poke_file), stage_file, Some(force_file), Some(marker_file)].into_iter().flatten() {
        match ends_with_newline(&file) {
            Ok(true) => {}
            Ok(false) => suspected.push(Suspicion::NoFinalNewline { file }),
            Err(source) => return Err(DatasetError::Read { file, source }),
        }
    }
    suspected.extend(suspicions(&recording));
    Ok((recording, suspected))
}

fn existing(folder: &Path, name: &str, expected: &'static str) -> Result<PathBuf, DatasetError> {
    let file = folder.join(name);
    if file.is_file() { Ok(file) } else { Err(DatasetError::MissingFile { file, expected }) }
}

/// Reads a phantom's mesh: as [`read_mesh`], with all the surfaces that a bundle names.
///
/// # Errors
/// What [`read_mesh`] refuses; [`DatasetError::MissingSurface`].
pub fn read_phantom(file: &Path) -> Result<TetMesh, DatasetError> {
    let mesh = read_mesh(file)?;
    match SURFACES.into_iter().find(|&s| mesh.surface(s).is_empty()) {
        None => Ok(mesh),
        Some(group) => Err(DatasetError::MissingSurface {
            file: file.to_owned(),
            group,
            found: mesh.surfaces.keys().cloned().collect(),
        }),
    }
}
