//! What the page's three-dimensional view is drawn from: the phantom's surface, the pokes, their markers and
//! the restraint patches. Lengths leave here in millimetres, displacements in micrometres, as plain columns.

use super::scale::factor;
use super::skin::{Columns, DiscScene, Skin, Triangles, micrometres, millimetres};
use crate::geometry::Vec3;
use crate::inverse::{Fit, Patch, PatchKind, PokeView};
use crate::mesh::MeshError;
use crate::observation::Recording;
use crate::report::words::stiffness;
use serde::Serialize;

/// Share of the phantom's diagonal that the largest displacement may be drawn as.
const DRAWN_DISPLACEMENT: f64 = 0.05;
/// Share of the phantom's diagonal that the root mean square of the marker residuals is drawn as.
const DRAWN_RESIDUAL: f64 = 0.05;

/// The whole view.
#[derive(Serialize)]
pub(super) struct Scene {
    /// Surface nodes at rest (mm).
    nodes_mm: Columns,
    /// Triangles by the group of surface: `fixed`, `search` or `free`.
    triangles: Triangles,
    pokes: Vec<PokeScene>,
    patches: Vec<PatchScene>,
    displacement_factor: f64,
    residual_factor: f64,
    /// One standard deviation of a marker's coordinates (µm).
    marker_sd_um: [f64; 3],
}

#[derive(Serialize)]
struct PokeScene {
    number: u32,
    /// The instant shown (s).
    deepest_s: f64,
    /// Displacement of the surface nodes (µm).
    displacement_um: Columns,
    tip: DiscScene,
    marker: Vec<u32>,
    marker_rest_mm: Columns,
    marker_model_um: Columns,
    marker_residual_um: Columns,
}

#[derive(Serialize)]
struct PatchScene {
    label: String,
    text: String,
    glued: bool,
    disc: DiscScene,
}

impl Scene {
    pub(super) fn new(fit: &Fit, recording: &Recording) -> Result<Self, MeshError> {
        let skin = Skin::new(&recording.mesh)?;
        let diagonal = skin.diagonal();
        let largest =
            fit.pokes.iter().flat_map(|p| &p.node_displacement_m).map(Vec3::norm).fold(0.0, f64::max);
        let residuals: Vec<f64> = fit
            .pokes
            .iter()
            .flat_map(|p| &p.markers)
            .map(|m| (m.measured_m - m.modelled_m).norm_squared())
            .collect();
        let rms = (residuals.iter().sum::<f64>() / residuals.len().max(1) as f64).sqrt();
        Ok(Self {
            nodes_mm: millimetres(skin.nodes.iter()),
            pokes: fit.pokes.iter().map(|p| PokeScene::new(p, &skin)).collect(),
            patches: fit.patches.iter().enumerate().map(|(i, p)| PatchScene::new(i, p, &skin)).collect(),
            displacement_factor: factor(largest, DRAWN_DISPLACEMENT * diagonal).max(1.0),
            residual_factor: factor(rms, DRAWN_RESIDUAL * diagonal),
            marker_sd_um: recording.noise.marker_m.map(|sd| sd * 1e6),
            triangles: skin.triangles,
        })
    }
}

/// The name of the `index`th patch on the page: A, B, … Z, then 27, 28, ….
pub(super) fn patch_label(index: usize) -> String {
    match u8::try_from(index) {
        Ok(i @ 0..26) => char::from(b'A' + i).to_string(),
        _ => (index + 1).to_string(),
    }
}

impl PokeScene {
    fn new(poke: &PokeView, skin: &Skin) -> Self {
        let markers = &poke.markers;
        let residuals: Vec<Vec3> = markers.iter().map(|m| m.measured_m - m.modelled_m).collect();
        Self {
            number: poke.number,
            deepest_s: poke.deepest_s,
            displacement_um: micrometres(skin.origin.iter().map(|&n| &poke.node_displacement_m[n])),
            tip: skin.disc(&poke.site_m, poke.radius_m, Some(-poke.direction)),
            marker: markers.iter().map(|m| m.number).collect(),
            marker_rest_mm: millimetres(markers.iter().map(|m| &m.rest_m)),
            marker_model_um: micrometres(markers.iter().map(|m| &m.modelled_m)),
            marker_residual_um: micrometres(residuals.iter()),
        }
    }
}

impl PatchScene {
    fn new(index: usize, patch: &Patch, skin: &Skin) -> Self {
        let (glued, text) = match patch.kind {
            PatchKind::Springs { stiffness_n_per_m } => (false, stiffness(&stiffness_n_per_m)),
            PatchKind::Glued { stiffness_lower_bound_n_per_m: bound } => {
                (true, format!("glued, ≥ {bound:.0} N/m"))
            }
        };
        let disc = skin.disc(&patch.centroid_m, patch.radius_m, None);
        Self { label: patch_label(index), text, glued, disc }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_are_named_like_columns() {
        assert_eq!([0, 1, 25, 26].map(patch_label), ["A", "B", "Z", "27"]);
    }
}
