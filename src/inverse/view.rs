//! A fit as a person looks at it: every poke's force against time, and the body at its deepest instant.

use super::evidence::{Drive, DriveTrack, Driven, Evidence};
use super::forward::{Forward, Prediction};
use super::lift::Driving;
use super::problem::Problem;
use super::restraint::Mounted;
use super::result::{MarkerView, PokeView, Sample};
use crate::clock::Rows;
use crate::fem::Space;
use crate::geometry::Vec3;
use crate::observation::Recording;
use rayon::prelude::*;
use std::collections::HashMap;

/// One view a poke, in the recording's order.
pub(super) fn poke_views(
    recording: &Recording,
    evidence: &Evidence,
    problem: &Problem<'_>,
    mounted: &Mounted,
    forward: &Forward<'_>,
    prediction: &Prediction,
    chi2_per_value: &[f64],
) -> Vec<PokeView> {
    let drive = DriveTrack::new(recording, evidence.driven, &evidence.lifts, &evidence.noise);
    let nodes = given_nodes(recording, problem);
    let mut views: Vec<(usize, PokeView)> = Vec::with_capacity(recording.pokes.len());
    for (s, (site, map)) in evidence.sites.iter().zip(&prediction.sites).enumerate() {
        for &index in &site.pokes {
            let poke = &recording.pokes[index];
            let mut samples = Vec::new();
            let mut deepest: Option<(f64, f64, Drive)> = None;
            for i in Rows::new(&recording.wrench.time_s).within(poke.start_s, poke.end_s) {
                let time_s = recording.wrench.time_s[i];
                let Some(Driving { x, depth_m, .. }) = drive.at(time_s, index) else { continue };
                let modelled = match evidence.driven {
                    Driven::ByStage => &map.force * x,
                    Driven::ByWrench => nalgebra::DVector::from_column_slice(&x.as_slice()[..3]),
                };
                let along = match evidence.driven {
                    Driven::ByStage => depth_m,
                    Driven::ByWrench => x.fixed_rows::<3>(0).dot(&poke.direction),
                };
                samples.push(Sample {
                    time_s,
                    depth_m,
                    measured_n: recording.wrench.force_n[i],
                    modelled_n: std::array::from_fn(|k| modelled[k]),
                });
                if deepest.is_none_or(|(_, most, _)| along > most) {
                    deepest = Some((time_s, along, x));
                }
            }
            let (deepest_s, x) = deepest.map_or((poke.start_s, Drive::zeros()), |(t, _, x)| (t, x));
            views.push((
                index,
                PokeView {
                    number: poke.number,
                    site_m: poke.site,
                    direction: poke.direction,
                    radius_m: poke.radius_m,
                    deepest_s,
                    node_displacement_m: displaced(&nodes, problem, mounted, forward, s, &x),
                    markers: markers(recording, evidence, index, deepest_s, &drive, &map.markers),
                    samples,
                    chi2_per_value: chi2_per_value[index],
                },
            ));
        }
    }
    views.sort_by_key(|(index, _)| *index);
    views.into_iter().map(|(_, view)| view).collect()
}

/// The model's nodes at those of elements of its order on the given mesh: its nodes, which are the first of every refinement, and the
/// middles of its edges, which are nodes of second-order elements whether the edge was cut or not. Were one of them none, the field would be
/// one of first order.
fn given_nodes(recording: &Recording, problem: &Problem<'_>) -> Vec<usize> {
    let space = problem.bench.model.space();
    let corners = recording.mesh.nodes.len();
    let Some(given) = Space::new(&recording.mesh, space.order()).ok().filter(|g| g.nodes().len() > corners)
    else {
        return (0..corners).collect();
    };
    let key = |p: &Vec3| [p.x, p.y, p.z].map(f64::to_bits);
    let number: HashMap<[u64; 3], usize> =
        space.nodes().iter().enumerate().map(|(n, p)| (key(p), n)).collect();
    let middles: Option<Vec<usize>> =
        given.nodes()[corners..].iter().map(|p| number.get(&key(p)).copied()).collect();
    (0..corners).chain(middles.unwrap_or_default()).collect()
}

/// Displacement of the nodes of [`given_nodes`].
fn displaced(
    nodes: &[usize],
    problem: &Problem<'_>,
    mounted: &Mounted,
    forward: &Forward<'_>,
    site: usize,
    drive: &Drive,
) -> Vec<Vec3> {
    let Some((tip, discs)) = forward.loads(site, drive) else {
        return vec![Vec3::zeros(); nodes.len()];
    };
    let weight = problem.bench.weight_field();
    nodes
        .par_iter()
        .map(|&node| {
            let position = &problem.bench.model.space().nodes()[node];
            let mut u = problem.bench.tip_responses()[site].at_node(node, position, &tip);
            for (disc, f) in mounted.discs.iter().zip(discs.as_slice().chunks_exact(3)) {
                u += disc.response.at_node(node, position) * Vec3::new(f[0], f[1], f[2]);
            }
            if let Some(nodal) = weight {
                u += Vec3::from_fn(|i, _| nodal[3 * node + i]) * drive[super::evidence::WEIGHT];
            }
            u / forward.modulus
        })
        .collect()
}

/// Markers in the frame nearest to the deepest instant.
fn markers(
    recording: &Recording,
    evidence: &Evidence,
    index: usize,
    at_s: f64,
    drive: &DriveTrack<'_>,
    map: &nalgebra::DMatrix<f64>,
) -> Vec<MarkerView> {
    let times = &recording.markers.frame_time_s;
    let poke = &recording.pokes[index];
    let frames = Rows::new(times).within(poke.start_s, poke.end_s);
    let Some(frame) = frames.min_by(|&a, &b| (times[a] - at_s).abs().total_cmp(&(times[b] - at_s).abs()))
    else {
        return Vec::new();
    };
    let Some(Driving { x, .. }) = drive.at(times[frame], index) else { return Vec::new() };
    let rows = &recording.markers.rows;
    let first = rows.partition_point(|r| (r.frame as usize) < frame);
    rows[first..]
        .iter()
        .take_while(|r| r.frame as usize == frame)
        .map(|row| {
            let m = row.marker as usize;
            let rest_m = evidence.rest[m].0;
            let modelled = map.rows(3 * m, 3) * x;
            MarkerView {
                number: recording.markers.numbers[m],
                rest_m,
                measured_m: Vec3::from(row.position_m) - rest_m,
                modelled_m: Vec3::new(modelled[0], modelled[1], modelled[2]),
            }
        })
        .collect()
}
