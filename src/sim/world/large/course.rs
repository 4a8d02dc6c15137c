//! A session of a phantom at large strain: where each tip goes, and the way that it takes there.

use super::super::condensed::{SessionBody, support_rows};
use super::super::motion::Contact;
use super::super::phantom::PhantomPlan;
use super::super::plan::{Hold, World};
use super::descent::{Descent, Ways};
use super::effect::material;
use super::solid::Solid;
use crate::geometry::Vec3;
use crate::sim::SimError;
use crate::sim::hex_mesh::{Feature, Grading, HexMesh, Place};
use crate::sim::linear::Compliance;
use crate::sim::load_path::{LoadPath, State};
use crate::sim::supports::{Shape, Support};
use crate::sim::unknowns::{Row, Unknowns};
use nalgebra::DVector;
use rayon::prelude::*;

/// Sizes of the boxes of one tip's mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// Far from everything, and at the end of the glue (m).
    pub(super) cell_m: f64,
    pub(super) glue_end_m: f64,
    /// At the rims of the tip, of patches and of spots, in their radii.
    pub(super) tip_share: f64,
    pub(super) patch_share: f64,
    pub(super) spot_share: f64,
    /// How much longer boxes may be per distance from these.
    pub(super) growth: f64,
    pub(super) halvings: u32,
    /// Points of integration along each edge of a box.
    pub(super) along: usize,
}

/// About 1.2 s of one core a tip. Measured against rims of a quarter radius and boxes of 8 mm (`refinement_study` in the tests;
/// neo-Hookean and Fung, 3 mm deep with a tip of 8 mm): forces 0.08 % off over the free part of the slab, 0.36 % over the glue
/// and on a side, markers 0.2 % to 1.1 % of the largest displacement; but 1.7 % and 5 % where the rim of the tip is 2 mm from
/// an edge, which bulges out. With softening 0.24 % and 0.22 %. Three points along an edge come from above and are 1.5 % off.
pub(super) const USUAL: Cut = Cut {
    cell_m: 0.0125,
    glue_end_m: 0.0065,
    tip_share: 0.55,
    patch_share: 1.3,
    spot_share: 0.8,
    growth: 1.0,
    halvings: 2,
    along: 2,
};

/// Depths closer than this are one (m).
const SAME_M: f64 = 1e-9;

/// The phantom at large strain: the ways that its tips take, and how deep each has been.
pub(in super::super) struct LargeBody {
    lines: Vec<Line>,
    /// The first way of each line, then the ways back.
    paths: Vec<LoadPath>,
    /// Of each line: the depth from which a way back begins (m), and the way.
    back: Vec<Vec<(f64, usize)>>,
    deepest: Vec<f64>,
    stage_compliance: f64,
    markers: usize,
}

/// A way, by its index, and how far along it the tip is (m).
type Along = (usize, f64);

/// What happened.
pub(in super::super) struct LargeCourse {
    step_s: f64,
    body: LargeBody,
    /// Where the tip was at every instant.
    places: Vec<Option<Along>>,
}

/// One line along which a tip goes in.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Line {
    pub(super) tip: usize,
    pub(super) direction: Vec3,
    /// Depths from which it goes back, ascending (m), each deeper than all before.
    pub(super) turns: Vec<f64>,
}

impl LargeBody {
    /// The ways that `contacts` go; none for a world whose material is linear.
    pub(in super::super) fn of(
        world: &World,
        body: &SessionBody,
        contacts: &[Option<Contact>],
        stage_compliance: f64,
        markers: &[[f64; 3]],
    ) -> Result<Option<Self>, SimError> {
        if material(world).is_none() {
            return Ok(None);
        }
        let lines = lines(contacts);
        let ways: Vec<Ways> = lines
            .par_iter()
            .map(|line| Ok(corrected(ways(world, line, markers, &USUAL)?, &linear(world, body, line)?)))
            .collect::<Result<_, SimError>>()?;
        let mut paths: Vec<LoadPath> = ways.iter().map(|w| w.first.clone()).collect();
        let mut back = Vec::new();
        for way in ways {
            let from = paths.len();
            back.push(way.again.iter().enumerate().map(|(i, a)| (a.0, from + i)).collect::<Vec<_>>());
            paths.extend(way.again.into_iter().map(|a| a.1));
        }
        let deepest = vec![0.0; lines.len()];
        Ok(Some(Self { lines, paths, back, deepest, stage_compliance, markers: markers.len() }))
    }

    /// Takes the tip to the next instant's place.
    pub(in super::super) fn step(&mut self, contact: &Contact) -> Along {
        let line = self.lines.iter().position(|l| l.holds(contact)).unwrap_or(0);
        let target = contact.target.dot(&contact.direction);
        let deepest = self.deepest[line];
        let nearest =
            self.back[line].iter().min_by(|a, b| (a.0 - deepest).abs().total_cmp(&(b.0 - deepest).abs()));
        let path = match nearest {
            Some(&(_, path)) if target < deepest - SAME_M => path,
            _ => line,
        };
        self.deepest[line] = deepest.max(target);
        (path, reached(&self.paths[path], target, contact.direction, self.stage_compliance))
    }

    /// Force of the tip on the phantom (N).
    pub(in super::super) fn force(&self, (path, depth): Along) -> Vec3 {
        self.paths[path].force(depth).into()
    }

    /// Displacements of the markers (m), three a marker.
    pub(in super::super) fn moved(&self, (path, depth): Along) -> DVector<f64> {
        let rows = (0..self.markers).flat_map(|m| self.paths[path].watched(depth, m));
        DVector::from_iterator(3 * self.markers, rows)
    }
}

impl LargeCourse {
    /// Goes through the instants of `contacts`; none for a world whose material is linear.
    pub(in super::super) fn of(
        world: &World,
        body: &SessionBody,
        contacts: &[Option<Contact>],
        step_s: f64,
        stage_compliance: f64,
        markers: &[[f64; 3]],
    ) -> Result<Option<Self>, SimError> {
        let Some(mut body) = LargeBody::of(world, body, contacts, stage_compliance, markers)? else {
            return Ok(None);
        };
        let places = contacts.iter().map(|contact| contact.as_ref().map(|c| body.step(c))).collect();
        Ok(Some(Self { step_s, body, places }))
    }

    /// Force at a time (N).
    pub(in super::super) fn force_at(&self, time_s: f64) -> Vec3 {
        let force = |at: Along| DVector::from_column_slice(self.body.force(at).as_slice());
        self.blend(time_s, force, 3).fixed_rows::<3>(0).into_owned()
    }

    /// Displacements of the markers at a time (m).
    pub(in super::super) fn moved_at(&self, time_s: f64) -> DVector<f64> {
        self.blend(time_s, |at| self.body.moved(at), 3 * self.body.markers)
    }

    /// A quantity of `n` numbers between the two instants around a time.
    fn blend(&self, time_s: f64, of: impl Fn(Along) -> DVector<f64>, n: usize) -> DVector<f64> {
        let place = (time_s / self.step_s).clamp(0.0, (self.places.len() - 1) as f64);
        let nearest = place.round();
        let place = if (place - nearest).abs() < 1e-6 { nearest } else { place };
        let before = (place as usize).min(self.places.len() - 2);
        let share = place - before as f64;
        let at = |i: usize| self.places[i].map_or_else(|| DVector::zeros(n), &of);
        if share == 0.0 { at(before) } else { at(before) * (1.0 - share) + at(before + 1) * share }
    }
}

impl Line {
    fn holds(&self, contact: &Contact) -> bool {
        self.tip == contact.tip && self.direction == contact.direction
    }
}

/// The lines of a session with the depths from which the tips turn back.
fn lines(contacts: &[Option<Contact>]) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    let mut deepest: Vec<f64> = Vec::new();
    for contact in contacts.iter().flatten() {
        let depth = contact.target.dot(&contact.direction);
        let line = lines.iter().position(|l| l.holds(contact)).unwrap_or_else(|| {
            lines.push(Line { tip: contact.tip, direction: contact.direction, turns: Vec::new() });
            deepest.push(0.0);
            lines.len() - 1
        });
        let turns = &mut lines[line].turns;
        if depth < deepest[line] - SAME_M && turns.last().is_none_or(|&t| t < deepest[line] - SAME_M) {
            turns.push(deepest[line]);
        }
        deepest[line] = deepest[line].max(depth);
    }
    for (line, deepest) in lines.iter_mut().zip(deepest) {
        if line.turns.last().is_none_or(|&t| t < deepest - SAME_M) && deepest > 0.0 {
            line.turns.push(deepest);
        }
    }
    lines.retain(|l| !l.turns.is_empty());
    lines
}

/// Depth d where d + c F(d) = target, by halving.
fn reached(path: &LoadPath, target: f64, direction: Vec3, stage_compliance: f64) -> f64 {
    if stage_compliance == 0.0 || target <= 0.0 {
        return target;
    }
    let (mut low, mut high) = (0.0, target);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        let force = Vec3::from(path.force(middle)).dot(&direction);
        if middle + stage_compliance * force > target { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// The ways of one tip on a mesh of its own.
pub(super) fn ways(world: &World, line: &Line, markers: &[[f64; 3]], cut: &Cut) -> Result<Ways, SimError> {
    let Some(material) = material(world) else { return Err(SimError::SingularSupports { supports: 0 }) };
    let plan = tip_plan(world, line.tip);
    let discs = plan.discs()?;
    let end = Place::GlueEnd { x: plan.slab.glue_end_m };
    let mut features = vec![Feature { place: end, cell_m: cut.glue_end_m, growth: cut.growth }];
    for (index, (patch, shape)) in discs.iter().enumerate() {
        let share = match shape {
            Shape::Held => cut.spot_share,
            Shape::Uniform if index == 0 => cut.tip_share,
            Shape::Uniform => cut.patch_share,
        };
        features.push(patch.feature(share, cut.growth));
    }
    let grading = Grading { cell_m: cut.cell_m, halvings: cut.halvings, finer_glue: None };
    let unknowns = Unknowns::new(HexMesh::new(plan.slab, &features, &grading)?);
    let mut compliances = vec![0.0];
    for hold in &world.holds {
        if let Hold::Springs { stiffness_n_per_m, .. } = hold {
            compliances.push(1.0 / stiffness_n_per_m);
        }
    }
    // Tip, springs in the order of the holds, then the functions of spots, which do not move.
    let supports = support_rows(&discs, &unknowns)
        .into_iter()
        .enumerate()
        .map(|(i, row)| Support { row, compliance: compliances.get(i).copied().unwrap_or(0.0) })
        .collect();
    let watched: Vec<Row> = markers.iter().map(|&p| unknowns.row_at(p)).collect();
    let softens = material.softening.is_some();
    let turns = if softens { &line.turns[..] } else { &line.turns[line.turns.len() - 1..] };
    let solid = Solid::new(&unknowns, material, cut.along)?;
    Descent::new(solid, supports, watched, line.direction).ways(turns, softens)
}

/// The phantom with one tip and the session's holds.
fn tip_plan(world: &World, tip: usize) -> PhantomPlan {
    let phantom = &world.phantom;
    let (mut patches, mut spots) = (Vec::new(), Vec::new());
    for hold in &world.holds {
        match *hold {
            Hold::Springs { patch, .. } => patches.extend(phantom.patches.get(patch)),
            Hold::Glued { spot } => spots.extend(phantom.spots.get(spot)),
        }
    }
    let sites = world.touched().get(tip).and_then(|&s| phantom.sites.get(s)).copied();
    PhantomPlan { sites: sites.into_iter().collect(), patches, spots, ..phantom.clone() }
}

/// Force and markers per depth at rest, from the accurate linear bench.
pub(super) fn linear(world: &World, body: &SessionBody, line: &Line) -> Result<State, SimError> {
    let n = 3 * (body.tips + body.springs);
    let compliance = Compliance {
        supports: body.supports.columns(0, n).into_owned(),
        watched: body.watched.columns(0, n).into_owned(),
    };
    let springs = world.holds.iter().filter_map(|hold| match *hold {
        Hold::Springs { stiffness_n_per_m, .. } => Some(1.0 / stiffness_n_per_m),
        Hold::Glued { .. } => None,
    });
    let held: Vec<(usize, f64)> = springs.enumerate().map(|(i, c)| (body.tips + i, c)).collect();
    let response = compliance.respond(world.young_modulus_pa, line.tip, &held)?;
    let moved = &response.watched * line.direction;
    Ok(State {
        force: (response.stiffness * line.direction).into(),
        watched: moved.as_slice().chunks_exact(3).map(|u| [u[0], u[1], u[2]]).collect(),
    })
}

/// Takes off what the elements get wrong in the linear answer, at every depth in proportion to it.
pub(super) fn corrected(ways: Ways, linear: &State) -> Ways {
    let off = linear.less(&ways.first.knots()[0].slope);
    let again = ways.again.into_iter().map(|(depth, path)| (depth, path.plus(&off))).collect();
    Ways { first: ways.first.plus(&off), again }
}

#[cfg(test)]
mod tests;
