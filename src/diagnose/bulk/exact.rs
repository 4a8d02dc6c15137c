//! A changed body on the same elements, factored anew: the exact difference with its exact derivatives.
//!
//! With `K'` the changed stiffness, `U' = K'⁻¹ F` the loads' fields: what is loaded sees `Fᵀ U'`, with the derivative
//! `−U'ᵀ ∂K' U'`; what is only seen, `Mᵀ U'`, with `−Mᵀ K'⁻¹ (∂K' U')`.

use super::ball::{Ball, BallPoint};
use super::changes::{BodyChange, Changed};
use super::glue::By;
use super::knob::BulkKnob;
use super::lab::Lab;
use crate::diagnose::DiagnoseError;
use crate::fem::{
    Constants, Moments, NodalForces, Part, Space, Varied, cell_stiffness, readings, tet_quadrature,
};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::sync::Arc;

/// Everything seen under everything loaded, less the baseline, with derivatives by each knob.
struct Difference {
    value: DMatrix<f64>,
    by: Vec<DMatrix<f64>>,
}

/// The glue of a hold that is as good as rigid gives so much (m): the derivative at zero is taken there, and what it
/// gives taken off again.
const RIGID_M: f64 = 1e-9;

/// What knobs of the whole body do alone.
pub(super) struct OfWhole {
    knobs: Vec<(BulkKnob, f64)>,
    difference: Difference,
}

/// Which points of which cell belong to the ball.
type Cells = Vec<(u32, Vec<BallPoint>)>;

impl Lab<'_> {
    /// The body with all of `knobs` at their values, less the baseline; derivatives by each of them.
    ///
    /// # Errors
    /// [`DiagnoseError::KnobMissing`], [`DiagnoseError::KnobOutOfRange`], [`DiagnoseError::GlueGone`]; what the elements
    /// refuse.
    pub fn changed(&self, knobs: &[(BulkKnob, f64)]) -> Result<BodyChange, DiagnoseError> {
        let mut difference = self.difference(knobs)?;
        // What the elements miss under the loads themselves, of what changes the whole body.
        let whole: Vec<(usize, (BulkKnob, f64))> =
            knobs.iter().copied().enumerate().filter(|(_, (knob, _))| knob.of_the_whole()).collect();
        if !whole.is_empty() {
            let all_whole = knobs.iter().all(|(knob, _)| knob.of_the_whole() || *knob == BulkKnob::Finer);
            let alone = if all_whole {
                None
            } else {
                let knobs: Vec<(BulkKnob, f64)> = whole.iter().map(|(_, knob)| *knob).collect();
                Some(self.of_whole(&knobs)?)
            };
            let of_whole = alone.as_deref().map_or(&difference, |alone| &alone.difference);
            let value = self.own.missed(&of_whole.value);
            let slope = |(i, (index, _)): (usize, &(usize, _))| {
                self.own.missed(&of_whole.by[if all_whole { *index } else { i }])
            };
            let by: Vec<DMatrix<f64>> = whole.iter().enumerate().map(slope).collect();
            difference.value += value;
            whole.iter().zip(by).for_each(|((index, _), by)| difference.by[*index] += by);
        }
        let mut change = BodyChange::of(&difference.value, &difference.by, self.sites);
        if let Some(index) = knobs.iter().position(|(knob, _)| *knob == BulkKnob::Finer)
            && let Some(finer) = self.finer()?
        {
            change.add_share(finer, knobs[index].1, index);
        }
        Ok(change)
    }

    /// What `knobs` of the whole body do alone. While another change is looked for beside them they often stay where they are.
    fn of_whole(&self, knobs: &[(BulkKnob, f64)]) -> Result<Arc<OfWhole>, DiagnoseError> {
        let made = || Ok(OfWhole { knobs: knobs.to_vec(), difference: self.difference(knobs)? });
        self.whole.get(|known| known.knobs == knobs, made)
    }

    fn difference(&self, knobs: &[(BulkKnob, f64)]) -> Result<Difference, DiagnoseError> {
        let mut changed = Changed::of(knobs, self.model.poisson_ratio())?;
        if knobs.iter().all(|(knob, _)| *knob == BulkKnob::Finer) {
            let none = DMatrix::zeros(self.seen.len(), self.loads);
            return Ok(Difference { by: vec![none.clone(); knobs.len()], value: none });
        }
        let gives = knobs.iter().position(|(knob, _)| *knob == BulkKnob::BaseGive);
        let asked_m = changed.give_m;
        if gives.is_some() {
            changed.give_m = asked_m.max(RIGID_M);
        }
        let space = self.model.space();
        let cells = changed.inclusion.map_or_else(Vec::new, |i| i.ball.cells(space, false));
        let constants = changed.law.constants();
        let nu = self.model.poisson_ratio();
        let plain = constants == Constants::isotropic(nu);
        let of_cell = |cell: u32| whole_moments(space, cell).stiffness(&constants);
        let of_ball = |of_ball: &(u32, Vec<BallPoint>)| {
            let own = ball_moments(space, of_ball, &changed).stiffness(&constants);
            let before = if plain { cell_stiffness(space, of_ball.0, nu) } else { of_cell(of_ball.0) };
            (of_ball.0, own.iter().zip(&before).map(|(a, b)| a - b).collect())
        };
        let more: Vec<(u32, Vec<f64>)> = cells.par_iter().map(of_ball).collect();
        let varied = if gives.is_some() || changed.loose.is_some() {
            let hold = self.glue.hold(space, changed.loose.as_ref(), changed.give_m)?;
            let loose = self.loose()?;
            let made;
            let stiffness = if plain {
                self.loose_stiffness(loose)
            } else {
                made = self.model.loose_stiffness(loose, of_cell);
                &made
            };
            self.model.varied_hold(loose, stiffness, &more, &hold.springs, hold.kept)?
        } else if plain {
            self.model.varied(self.stiffness(), &more)?
        } else {
            self.model.varied(&self.model.stiffness(of_cell), &more)?
        };
        let fields = varied.displace(&self.forces)?;
        let mut value = readings(&self.seen, &fields) - &self.before;
        let by = self.derivatives(knobs, &changed, &cells, &varied, &fields)?;
        if let Some(index) = gives.filter(|_| changed.give_m > asked_m) {
            value -= &by[index] * (changed.give_m - asked_m);
        }
        Ok(Difference { value, by })
    }

    /// By each knob, of everything seen under everything loaded.
    fn derivatives(
        &self,
        knobs: &[(BulkKnob, f64)],
        changed: &Changed,
        cells: &Cells,
        varied: &Varied<'_>,
        fields: &DMatrix<f64>,
    ) -> Result<Vec<DMatrix<f64>>, DiagnoseError> {
        let (seen, loads, components) = (self.seen.len(), self.loads, fields.ncols());
        let moving: Vec<usize> = (0..knobs.len()).filter(|&k| knobs[k].0 != BulkKnob::Finer).collect();
        let mut pushed = DMatrix::zeros(moving.len() * loads, components);
        let mut by = vec![DMatrix::zeros(seen, loads); knobs.len()];
        let of_knob = |&knob: &usize| {
            let mut forces = NodalForces::of(fields);
            self.each_part(knobs[knob].0, changed, cells, &mut |part| forces.add(&part));
            (-forces.work(fields), forces.whole())
        };
        let worked: Vec<(DMatrix<f64>, DMatrix<f64>)> = moving.par_iter().map(of_knob).collect();
        for (at, (&knob, (work, whole))) in moving.iter().zip(&worked).enumerate() {
            by[knob].rows_mut(0, loads).copy_from(work);
            pushed.rows_mut(at * loads, loads).copy_from(whole);
        }
        if seen > loads && !moving.is_empty() {
            let displaced = varied.displace(&pushed)?;
            let read = readings(&self.seen[loads..], &displaced);
            for (at, &knob) in moving.iter().enumerate() {
                by[knob].rows_mut(loads, seen - loads).copy_from(&-read.columns(at * loads, loads));
            }
        }
        Ok(by)
    }

    /// The parts of the stiffness' derivative by a knob.
    fn each_part(&self, knob: BulkKnob, changed: &Changed, cells: &Cells, each: &mut dyn FnMut(Part)) {
        let space = self.model.space();
        let constants = changed.law.constants();
        match knob {
            BulkKnob::BallCentre(_) | BulkKnob::BallRadius | BulkKnob::BallRatio => {
                let Some(inclusion) = changed.inclusion else { return };
                for (cell, points) in cells {
                    let weigh = |p: &BallPoint| match knob {
                        BulkKnob::BallCentre(axis) => p.by[axis] * inclusion.by_share(p.share),
                        BulkKnob::BallRadius => p.by[3] * inclusion.by_share(p.share),
                        _ => inclusion.by_log_ratio(p.share),
                    };
                    if points.iter().any(|p| weigh(p) != 0.0) {
                        let points = points.iter().map(|p| (p.at, p.weight * weigh(p)));
                        each(Moments::new(space, *cell, points).part(space, *cell, &constants));
                    }
                }
            }
            BulkKnob::Along(_) | BulkKnob::Turn(_) | BulkKnob::Poisson => {
                let slope = match knob {
                    BulkKnob::Along(_) => changed.law.by_log_ratio(),
                    BulkKnob::Turn(which) => changed.law.by_tilt(which),
                    _ => changed.law.by_poisson_ratio(),
                };
                let mut known = cells.iter().peekable();
                for cell in 0..space.cells().len() as u32 {
                    let moments = match known.next_if(|(c, _)| *c == cell) {
                        Some(of_ball) => ball_moments(space, of_ball, changed),
                        None => whole_moments(space, cell),
                    };
                    each(moments.part(space, cell, &slope));
                }
            }
            BulkKnob::LooseCentre(_) | BulkKnob::LooseRadius | BulkKnob::BaseGive => {
                let by = match knob {
                    BulkKnob::LooseCentre(axis) => By::Centre(axis),
                    BulkKnob::LooseRadius => By::Radius,
                    _ => By::Give,
                };
                let parts = self.glue.change(space, changed.loose.as_ref(), changed.give_m, by);
                parts.into_iter().for_each(each);
            }
            BulkKnob::Finer => {}
        }
    }
}

/// Of a cell of which some points belong to the ball.
fn ball_moments(space: &Space, (cell, points): &(u32, Vec<BallPoint>), changed: &Changed) -> Moments {
    let points =
        points.iter().map(|p| (p.at, p.weight * changed.inclusion.map_or(1.0, |i| i.modulus(p.share))));
    Moments::new(space, *cell, points)
}

/// Of a cell that is alike everywhere.
pub(super) fn whole_moments(space: &Space, cell: u32) -> Moments {
    Moments::new(space, cell, tet_quadrature(space.order().stiffness_degree().max(2)))
}

/// Of the part of a cell that belongs to a ball.
pub(super) fn shared_moments(space: &Space, ball: &Ball, quick: bool) -> Vec<(u32, Moments)> {
    ball.cells(space, quick)
        .into_iter()
        .map(|(cell, points)| {
            (cell, Moments::new(space, cell, points.iter().map(|p| (p.at, p.weight * p.share))))
        })
        .collect()
}
