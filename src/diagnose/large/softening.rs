//! `stress-softening`: the stress is that of small strain times 1 − r (1 − exp(−(w_max − w)/m)).
//!
//! The density `w` at a point is that of the linear answer, `w = E x² w₁` with `w₁` that of a unit modulus at unit depth,
//! and the largest one that of the greatest depth so far at this place: w_max − w = E q w₁, q = x_max² − x². Then the
//! damage φ = 1 − exp(−E q w₁ / m) is known beforehand, and depends on depths, modulus and m by z = E q w̄ / m alone
//! (w̄: mean of w₁, weighed by itself). With it the body is linear again: (K − r K_φ) u = forces of the ties. Its answer
//! is the series u = x Σ rⁿ uₙ, K uₙ₊₁ = K_φ uₙ with the tip held, cut after r³: the terms fall like the powers of r
//! times how much φ varies. Tabulated in z.
//!
//! Left out: what other places' pokes have softened; the change of `w` by softening; softening at large strain.

use super::super::error::DiagnoseError;
use super::lab::{Lab, Seat};
use super::points::{forces, gradients};
use crate::fem::material::{Law, Material};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Terms of the series.
const TERMS: usize = 3;

/// Knots s = z/(1 + z): no damage, …, all of it.
const KNOTS: [f64; 8] = [0.0, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95, 1.0];

/// Softening at every poke of a lab, in its order.
#[derive(Debug, Clone)]
pub struct Softening {
    /// One a poke.
    pub pokes: Vec<Softened>,
}

/// What softening adds at one poke.
#[derive(Debug, Clone)]
pub struct Softened {
    /// w̄ (J/m³ per Pa of modulus and m² of depth, that is 1/m²).
    pub mean_density: f64,
    /// At every knot: column n − 1 is what uₙ reads, over sⁿ; rows as in [`Curve`](super::Curve), per m of depth.
    knots: Vec<DMatrix<f64>>,
}

/// What is added at one instant, with its derivatives. Rows as in [`Curve`](super::Curve).
#[derive(Debug, Clone)]
pub struct Softer {
    /// Force over modulus (N/Pa), markers (m).
    pub value: DVector<f64>,
    /// By r.
    pub by_softening: DVector<f64>,
    /// By the logarithm of m (less: by that of the modulus).
    pub by_log_scale: DVector<f64>,
    /// By the depth x (per m), x_max kept.
    pub by_depth: DVector<f64>,
}

impl Lab {
    /// Tabulates `stress-softening` at every poke.
    ///
    /// # Errors
    /// What the linear solver reports.
    pub fn softening(&self) -> Result<Softening, DiagnoseError> {
        let material = Material::new(self.moduli, Law::Linear)?;
        let pokes = self.seats.par_iter().map(|seat| self.softened(seat, &material));
        Ok(Softening { pokes: pokes.collect::<Result<_, _>>()? })
    }

    fn softened(&self, seat: &Seat, material: &Material) -> Result<Softened, DiagnoseError> {
        let space = self.body.space();
        let points = gradients(space, &seat.along.displacement);
        let density = points.iter().map(|(_, h)| material.energy(h)).collect::<Result<Vec<_>, _>>()?;
        let moment = |power: i32| -> f64 {
            points.iter().zip(&density).map(|((volume, _), w)| volume * w.powi(power)).sum()
        };
        let mean_density = moment(2) / moment(1);
        let ends = vec![0.0; seat.tied.ties().len()];
        let knot = |&s: &f64| -> Result<DMatrix<f64>, DiagnoseError> {
            let damage = |w: f64| match s {
                0.0 => w / mean_density,
                1.0 => 1.0,
                s => -(-s / (1.0 - s) * w / mean_density).exp_m1() / s,
            };
            let damage: Vec<f64> = density.iter().map(|&w| damage(w)).collect();
            let mut columns = Vec::with_capacity(TERMS);
            let mut last = seat.along.clone();
            for _ in 0..TERMS {
                let of_damage = forces(space, &last.displacement, |point, h| {
                    // The linear law knows no gradient that it refuses.
                    material
                        .stress(h)
                        .map_or_else(|_| crate::geometry::Mat3::zeros(), |(_, p)| p * damage[point])
                });
                last = seat.tied.linear(&self.body, &of_damage, &ends)?;
                columns.push(self.readings(&last));
            }
            Ok(DMatrix::from_columns(&columns))
        };
        Ok(Softened { mean_density, knots: KNOTS.iter().map(knot).collect::<Result<_, _>>()? })
    }
}

impl Softened {
    /// What is added at depth `x` (m) after `deepest` (m, at least `x`) at this place, for the parameters `r` (–) and
    /// `m` (J/m³), the modulus being `young` (Pa).
    pub fn at(&self, x: f64, deepest: f64, r: f64, m: f64, young: f64) -> Softer {
        let x = x.max(0.0);
        let q = (deepest * deepest - x * x).max(0.0);
        let z = young * q * self.mean_density / m;
        let s = z / (1.0 + z);
        let (table, slope) = self.interpolated(s);
        // By ln z: ds = s (1 − s) d ln z.
        let rate = s * (1.0 - s);
        let sum = |of: &dyn Fn(i32) -> (f64, f64)| -> DVector<f64> {
            let weights: Vec<(f64, f64)> = (1..=TERMS as i32).map(of).collect();
            &table * DVector::from_iterator(TERMS, weights.iter().map(|w| w.0))
                + &slope * DVector::from_iterator(TERMS, weights.iter().map(|w| w.1))
        };
        let value = sum(&|n| ((r * s).powi(n), 0.0));
        let by_softening = sum(&|n| (f64::from(n) * (r * s).powi(n - 1) * s, 0.0)) * x;
        let by_log_z = sum(&|n| (f64::from(n) * (r * s).powi(n) * (1.0 - s), (r * s).powi(n) * rate)) * x;
        let by_depth = if q > 0.0 { &value - &by_log_z * (2.0 * x / q) } else { value.clone() };
        Softer { value: value * x, by_softening, by_log_scale: -by_log_z, by_depth }
    }

    /// The table at s, and its derivative by s: cubic through values with the slopes of parabolas through neighbours
    /// (Catmull & Rom 1974, for uneven knots).
    fn interpolated(&self, s: f64) -> (DMatrix<f64>, DMatrix<f64>) {
        let last = KNOTS.len() - 1;
        let i = KNOTS.partition_point(|&k| k <= s).clamp(1, last) - 1;
        let step = |i: usize| (&self.knots[i + 1] - &self.knots[i]) / (KNOTS[i + 1] - KNOTS[i]);
        let slope = |i: usize| -> DMatrix<f64> {
            let width = |i: usize| KNOTS[i + 1] - KNOTS[i];
            let (a, b) = match i {
                0 => (0, 1),
                i if i == last => (last - 1, last - 2),
                i => (i - 1, i),
            };
            let (wa, wb) = (width(a), width(b));
            if i == 0 || i == last {
                step(a) + (step(a) - step(b)) * (wa / (wa + wb))
            } else {
                (step(a) * wb + step(b) * wa) / (wa + wb)
            }
        };
        let width = KNOTS[i + 1] - KNOTS[i];
        let t = (s - KNOTS[i]) / width;
        let (from, to) = (&self.knots[i], &self.knots[i + 1]);
        let (out, into) = (slope(i) * width, slope(i + 1) * width);
        let value = from * (1.0 - t * t * (3.0 - 2.0 * t))
            + to * (t * t * (3.0 - 2.0 * t))
            + &out * (t * (1.0 - t).powi(2))
            - &into * (t * t * (1.0 - t));
        let change = (to - from) * (6.0 * t * (1.0 - t))
            + out * ((1.0 - t) * (1.0 - 3.0 * t))
            + into * (t * (3.0 * t - 2.0));
        (value, change / width)
    }
}
