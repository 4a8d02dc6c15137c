//! What is changed: knobs with values → one description of the changed body; and what the change does.

use super::ball::Ball;
use super::knob::BulkKnob;
use super::laws::{Along, Law, deviatoric};
use super::loose::Loosened;
use crate::diagnose::DiagnoseError;
use crate::diagnose::dual::Field;
use crate::geometry::Vec3;
use nalgebra::DMatrix;

/// Difference, altered less baseline, of everything in a body of a march in time, for a unit modulus (1/m), in
/// the same layout, at the knobs' values; derivatives there by the knobs, which count as they were given.
#[derive(Debug, Clone)]
pub struct BodyChange {
    /// Tips under tips (3 sites × 3 sites).
    pub tips_tips: Field,
    /// Discs under tips (3 discs × 3 sites).
    pub discs_tips: Field,
    /// Discs under discs (3 discs × 3 discs).
    pub discs_discs: Field,
    /// Markers under tips and under discs, side by side (3 markers × (3 sites + 3 discs)).
    pub markers: Field,
}

impl BodyChange {
    /// From matrices of everything seen (tips, discs, markers) under everything loaded (tips, discs): the value, and the
    /// derivative by each knob.
    pub(super) fn of(value: &DMatrix<f64>, by: &[DMatrix<f64>], sites: usize) -> Self {
        let (loads, tips) = (value.ncols(), 3 * sites);
        let field = |part: &dyn Fn(&DMatrix<f64>) -> DMatrix<f64>| Field {
            value: part(value),
            by: by.iter().enumerate().map(|(knob, d)| (knob, part(d))).collect(),
        };
        let block = |m: &DMatrix<f64>, row: usize, rows: usize, column: usize, columns: usize| {
            m.view((row, column), (rows, columns)).into_owned()
        };
        let even = |m: DMatrix<f64>| (&m + m.transpose()) * 0.5;
        Self {
            tips_tips: field(&|m| even(block(m, 0, tips, 0, tips))),
            discs_tips: field(&|m| block(m, tips, loads - tips, 0, tips)),
            discs_discs: field(&|m| even(block(m, tips, loads - tips, tips, loads - tips))),
            markers: field(&|m| block(m, loads, m.nrows() - loads, 0, loads)),
        }
    }
}

impl BodyChange {
    /// The change after small steps of its knobs, by its derivatives.
    pub fn moved(&self, steps: &[f64]) -> Self {
        let mut moved = self.clone();
        for field in moved.fields() {
            for (knob, by) in &field.by {
                field.value += by * steps[*knob];
            }
        }
        moved
    }

    /// Both together; their knobs are the same.
    pub fn plus(&self, other: &Self) -> Self {
        self.with(other, 1.0)
    }

    /// What this one changes beyond another of the same knobs.
    pub fn less(&self, other: &Self) -> Self {
        self.with(other, -1.0)
    }

    fn with(&self, other: &Self, share: f64) -> Self {
        let (mut sum, mut other) = (self.clone(), other.clone());
        for (field, more) in sum.fields().into_iter().zip(other.fields()) {
            field.value += &more.value * share;
            for ((knob, by), (same, more)) in field.by.iter_mut().zip(&more.by) {
                debug_assert_eq!(knob, same);
                *by += more * share;
            }
        }
        sum
    }

    /// As much in the other direction.
    pub(super) fn opposite(&self) -> Self {
        let mut opposite = self.clone();
        opposite.fields().into_iter().for_each(|field| field.value.neg_mut());
        opposite
    }

    /// Without derivatives.
    pub(super) fn plain(
        tips_tips: DMatrix<f64>,
        discs_tips: DMatrix<f64>,
        discs_discs: DMatrix<f64>,
        markers: DMatrix<f64>,
    ) -> Self {
        let field = |value| Field { value, by: Vec::new() };
        Self {
            tips_tips: field(tips_tips),
            discs_tips: field(discs_tips),
            discs_discs: field(discs_discs),
            markers: field(markers),
        }
    }

    fn fields(&mut self) -> [&mut Field; 4] {
        [&mut self.tips_tips, &mut self.discs_tips, &mut self.discs_discs, &mut self.markers]
    }

    /// Adds `share` of another change.
    pub(super) fn add(&mut self, other: &Self, share: f64) {
        let mut other = other.clone();
        for (field, more) in self.fields().into_iter().zip(other.fields()) {
            field.value += &more.value * share;
        }
    }

    /// As [`BodyChange::add`], the share being the knob of this index.
    pub(super) fn add_share(&mut self, other: &Self, share: f64, knob: usize) {
        self.add(other, share);
        let mut other = other.clone();
        for (field, more) in self.fields().into_iter().zip(other.fields()) {
            for (index, by) in &mut field.by {
                if *index == knob {
                    *by += &more.value;
                }
            }
        }
    }
}

/// A ball of another modulus.
///
/// Across its rim the modulus goes from the phantom's to the ball's as that of a fine mixture of both would (Hashin and
/// Shtrikman 1963, by Eshelby's deviatoric factor `β`): `1 + w R / (1 + β (1 − w) R)`, `R = ratio − 1`, `w` the share that
/// belongs to the ball. Why: with the plain mean the soft rim of a stiff ball would act as a larger ball.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inclusion {
    pub ball: Ball,
    /// Its modulus over the phantom's.
    pub ratio: f64,
    /// `β` for the stated Poisson's ratio.
    pub beta: f64,
}

impl Inclusion {
    /// Modulus over the phantom's where a share belongs to the ball.
    pub(super) fn modulus(&self, share: f64) -> f64 {
        let more = self.ratio - 1.0;
        1.0 + share * more / (1.0 + self.beta * (1.0 - share) * more)
    }

    /// Its derivative by the share.
    pub(super) fn by_share(&self, share: f64) -> f64 {
        let more = self.ratio - 1.0;
        more * (1.0 + self.beta * more) / (1.0 + self.beta * (1.0 - share) * more).powi(2)
    }

    /// Its derivative by the logarithm of the ratio.
    pub(super) fn by_log_ratio(&self, share: f64) -> f64 {
        share * self.ratio / (1.0 + self.beta * (1.0 - share) * (self.ratio - 1.0)).powi(2)
    }
}

/// A changed body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Changed {
    pub inclusion: Option<Inclusion>,
    pub law: Law,
    pub loose: Option<Loosened>,
    /// `E / foundation` (m).
    pub give_m: f64,
    /// Share of what finer elements add.
    pub finer: f64,
}

impl Changed {
    /// What these knobs say, for the stated Poisson's ratio.
    ///
    /// # Errors
    /// [`DiagnoseError::KnobMissing`] for half a place, [`DiagnoseError::KnobOutOfRange`].
    pub(super) fn of(knobs: &[(BulkKnob, f64)], poisson_ratio: f64) -> Result<Self, DiagnoseError> {
        let find = |knob: BulkKnob| knobs.iter().find(|k| k.0 == knob).map(|k| k.1);
        let need = |knob: BulkKnob| find(knob).ok_or(DiagnoseError::KnobMissing { id: knob.id().0 });
        let positive = |knob: BulkKnob| match need(knob) {
            Ok(value) if value <= 0.0 => Err(DiagnoseError::KnobOutOfRange { id: knob.id().0, value }),
            other => other,
        };
        if let Some((knob, value)) = knobs.iter().find(|(_, value)| !value.is_finite()) {
            return Err(DiagnoseError::KnobOutOfRange { id: knob.id().0, value: *value });
        }
        let any = |of: &dyn Fn(BulkKnob) -> bool| knobs.iter().any(|(knob, _)| of(*knob));
        let ball = |k| matches!(k, BulkKnob::BallCentre(_) | BulkKnob::BallRadius | BulkKnob::BallRatio);
        let inclusion = if any(&ball) {
            let [x, y, z] = [0, 1, 2].map(|axis| need(BulkKnob::BallCentre(axis)));
            let ball = Ball::new(Vec3::new(x?, y?, z?), positive(BulkKnob::BallRadius)?);
            Some(Inclusion { ball, ratio: need(BulkKnob::BallRatio)?.exp(), beta: deviatoric(poisson_ratio) })
        } else {
            None
        };
        let loose = if any(&|k| matches!(k, BulkKnob::LooseCentre(_) | BulkKnob::LooseRadius)) {
            let [x, y] = [0, 1].map(|axis| need(BulkKnob::LooseCentre(axis)));
            Some(Loosened { centre: [x?, y?], radius_m: positive(BulkKnob::LooseRadius)? })
        } else {
            None
        };
        let along = knobs.iter().find_map(|(knob, value)| match knob {
            BulkKnob::Along(axis) => {
                let tilt = [0, 1].map(|i| find(BulkKnob::Turn(i)).unwrap_or(0.0));
                Some(Along::new(*axis, tilt, value.exp()))
            }
            _ => None,
        });
        if along.is_none() && any(&|k| matches!(k, BulkKnob::Turn(_))) {
            return Err(DiagnoseError::KnobMissing { id: "modulus_ratio" });
        }
        let poisson_ratio = poisson_ratio + find(BulkKnob::Poisson).unwrap_or(0.0);
        if !(poisson_ratio > -1.0 && poisson_ratio < LARGEST_POISSON_RATIO) {
            return Err(DiagnoseError::KnobOutOfRange { id: "poisson_ratio", value: poisson_ratio });
        }
        let give_m = find(BulkKnob::BaseGive).unwrap_or(0.0);
        if give_m < 0.0 {
            return Err(DiagnoseError::KnobOutOfRange { id: "foundation_pa_per_m", value: give_m });
        }
        let finer = find(BulkKnob::Finer).unwrap_or(0.0);
        Ok(Self { inclusion, law: Law { poisson_ratio, along }, loose, give_m, finer })
    }
}

/// Up to here second-order elements answer without visible locking.
pub(super) const LARGEST_POISSON_RATIO: f64 = 0.4999;
