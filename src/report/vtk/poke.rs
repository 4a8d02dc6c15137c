//! What a fit says of one poke, and of the restraint, as VTK files: the phantom with the displacement of the
//! model at the deepest instant, its markers with their residuals, the restraint patches.

use super::{Cells, Field, FieldValues, Grid, write_vtp, write_vtu};
use crate::fem::{Order, Space};
use crate::geometry::Vec3;
use crate::inverse::{Patch, PatchKind, PokeView};
use crate::report::ReportError;
use std::path::Path;

/// The elements of the given mesh at rest, of the order of the fit, with `displacement_m` and, for every named surface, a label that
/// is 1 on its nodes.
pub(in crate::report) fn write_poke(path: &Path, space: &Space, poke: &PokeView) -> Result<(), ReportError> {
    let groups: Vec<(&str, Vec<u32>)> = space
        .surface_names()
        .into_iter()
        .map(|name| (name, space.on_surface(name).into_iter().map(u32::from).collect()))
        .collect();
    let displacement =
        Field { name: "displacement_m", values: FieldValues::Vectors(&poke.node_displacement_m) };
    let point_fields: Vec<Field<'_>> = std::iter::once(displacement)
        .chain(groups.iter().map(|(name, label)| Field { name, values: FieldValues::Labels(label) }))
        .collect();
    let (linear, quadratic);
    let cells = match space.order() {
        Order::P1 => {
            linear = cells_of(space);
            Cells::Linear(&linear)
        }
        Order::P2 => {
            quadratic = cells_of(space);
            Cells::Quadratic(&quadratic)
        }
    };
    write_vtu(path, &Grid { nodes: space.nodes(), cells, point_fields: &point_fields, cell_fields: &[] })
}

/// Markers at rest with measured and modelled displacement and what is left between them.
pub(in crate::report) fn write_markers(path: &Path, poke: &PokeView) -> Result<(), ReportError> {
    let column =
        |of: fn(&crate::inverse::MarkerView) -> Vec3| poke.markers.iter().map(of).collect::<Vec<_>>();
    let number: Vec<u32> = poke.markers.iter().map(|m| m.number).collect();
    let (measured, modelled) = (column(|m| m.measured_m), column(|m| m.modelled_m));
    let residual = column(|m| m.measured_m - m.modelled_m);
    let fields = [
        Field { name: "marker", values: FieldValues::Labels(&number) },
        Field { name: "measured_displacement_m", values: FieldValues::Vectors(&measured) },
        Field { name: "model_displacement_m", values: FieldValues::Vectors(&modelled) },
        Field { name: "residual_m", values: FieldValues::Vectors(&residual) },
    ];
    write_vtp(path, &column(|m| m.rest_m), &fields)
}

/// Centres of the restraint patches. `stiffness_n_per_m` of a glued patch is its lower bound, and `glued` is 1.
pub(in crate::report) fn write_restraint(path: &Path, patches: &[Patch]) -> Result<(), ReportError> {
    let centres: Vec<Vec3> = patches.iter().map(|p| p.centroid_m).collect();
    let radius: Vec<f64> = patches.iter().map(|p| p.radius_m).collect();
    let glued: Vec<u32> =
        patches.iter().map(|p| u32::from(matches!(p.kind, PatchKind::Glued { .. }))).collect();
    let stiffness: Vec<f64> = patches
        .iter()
        .map(|p| match p.kind {
            PatchKind::Springs { stiffness_n_per_m } => stiffness_n_per_m.value,
            PatchKind::Glued { stiffness_lower_bound_n_per_m } => stiffness_lower_bound_n_per_m,
        })
        .collect();
    let fields = [
        Field { name: "radius_m", values: FieldValues::Scalars(&radius) },
        Field { name: "stiffness_n_per_m", values: FieldValues::Scalars(&stiffness) },
        Field { name: "glued", values: FieldValues::Labels(&glued) },
    ];
    write_vtp(path, &centres, &fields)
}

/// Cells of `N` nodes.
fn cells_of<const N: usize>(space: &Space) -> Vec<[u32; N]> {
    space.cells().map(|cell| std::array::from_fn(|i| cell[i])).collect()
}
