//! Which weight do the others contradict?
//!
//! Each row is judged by the fit without it: its residual over the standard deviation of a prediction, t = r / (s₍ᵢ₎ √(1 − h)), is Student
//! distributed with n − p − 1 degrees of freedom (Cook and Weisberg 1982, 2.2.2). Of the six readings together: each t is made the normal number
//! of the same chance, the sum of their squares goes against χ² with 6 degrees of freedom, and p is multiplied by the number of rows
//! (Bonferroni). Where one factor on the weight explains the residuals, that is
//! said: the wrong weight was hung, or written down.
//!
//! What the weights' places are known to is part of s: rows are divided by what their noise and places should leave, before.

use super::calibration::Known;
use super::{COMPONENTS, Hold};
use crate::calib::instruments::least_squares::Estimate;
use nalgebra::{DMatrix, DVector, SMatrix};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

/// Chance that a sound table has a row that is named.
const CHANCE: f64 = 0.01;
/// A factor explains a row where it leaves this share of what was too much.
const EXPLAINED: f64 = 0.1;

/// A row that the others contradict.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// Its line in the table, from 1.
    pub line: u64,
    /// The reading that shows it best.
    pub component: &'static str,
    /// By how much that is off (N or N·m).
    pub off: f64,
    /// The same over its standard deviation.
    pub sigmas: f64,
    /// Chance that noise does this in any of the rows.
    pub p: f64,
    /// What the weight would have to be (kg), where that explains it, and its standard deviation.
    pub as_mass_kg: Option<[f64; 2]>,
    /// What the table says that it is (kg).
    pub mass_kg: f64,
}

impl std::fmt::Display for Misfit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let unit = if self.component.starts_with('F') { "N" } else { "N·m" };
        write!(
            f,
            "line {}: the other rows contradict it: {} is off by {:+.4} {unit}, {:.0} standard deviations",
            self.line, self.component, self.off, self.sigmas
        )?;
        match self.as_mass_kg {
            Some([mass, sd]) => write!(
                f,
                "; it pulls like {:.1} ± {:.1} g, where the table says {:.1} g",
                1e3 * mass,
                1e3 * sd,
                1e3 * self.mass_kg
            ),
            None => write!(f, "; no other weight explains it: look at its direction and lever"),
        }
    }
}

/// Rows that the others contradict, worst first. `first`: where the columns of the wrench begin in the design `x`. One is named, taken away, and the rest looked at again.
pub(super) fn misfits(
    holds: &[Hold],
    wrenches: &[[f64; 6]],
    known: &Known,
    (x, first): (&DMatrix<f64>, usize),
    channels: &[Estimate],
    a: &SMatrix<f64, 6, 6>,
) -> Vec<Misfit> {
    let mut left: Vec<usize> = (0..holds.len()).collect();
    let mut named = Vec::new();
    while left.len() > x.ncols() + 2 && named.len() < holds.len() / 4 {
        let Some((at, misfit)) = worst(holds, wrenches, known, (x, first), channels, a, &left) else { break };
        named.push(misfit);
        left.remove(at);
    }
    named
}

/// What the other rows say of a reading in a row.
#[derive(Debug, Clone, Copy, Default)]
struct Off {
    /// By how much it is off what they predict, and the standard deviation of that.
    value: f64,
    sd: f64,
    /// The one over the other.
    t: f64,
    /// What they predict that the weight does to it.
    answer: f64,
}

fn worst(
    holds: &[Hold],
    wrenches: &[[f64; 6]],
    known: &Known,
    (x, first): (&DMatrix<f64>, usize),
    channels: &[Estimate],
    a: &SMatrix<f64, 6, 6>,
    left: &[usize],
) -> Option<(usize, Misfit)> {
    let (n, p) = (left.len(), x.ncols());
    let freedom = (n - p - 1) as f64;
    let (student, normal) = (StudentsT::new(0.0, 1.0, freedom).ok()?, Normal::standard());
    let mut scores = vec![0.0; n];
    let mut detail = vec![[Off::default(); 6]; n];
    for c in 0..6 {
        // What is expected of a row, over what is expected of one without load.
        let noise = robust(left.iter().map(|&i| channels[c].residuals[i]));
        let spread = |i: usize| {
            let places = place_sd(&holds[i], &wrenches[i], known, a, c);
            (1.0 + (places / noise).powi(2)).sqrt()
        };
        let scaled = DMatrix::from_fn(n, p, |i, j| x[(left[i], j)] / spread(left[i]));
        let y = DVector::from_fn(n, |i, _| holds[left[i]].reading[c] / spread(left[i]));
        let inverse = (scaled.transpose() * &scaled).cholesky()?.inverse();
        let beta = &inverse * (scaled.transpose() * &y);
        let residual = &y - &scaled * &beta;
        let sum = residual.norm_squared();
        for i in 0..n {
            let row = scaled.row(i).transpose();
            let lever = &inverse * &row;
            let free = (1.0 - row.dot(&lever)).max(1e-9);
            let without = ((sum - residual[i].powi(2) / free).max(1e-6 * sum) / freedom).sqrt();
            let t = residual[i] / (without * free.sqrt());
            // Beyond 38 standard deviations a chance is zero in double precision.
            scores[i] += normal.inverse_cdf(student.sf(t.abs()).max(1e-300)).powi(2);
            let beta = &beta - lever * (residual[i] / free);
            detail[i][c] = Off {
                value: residual[i] / free * spread(left[i]),
                sd: without / free.sqrt() * spread(left[i]),
                t,
                answer: (first..p).map(|j| x[(left[i], j)] * beta[j]).sum(),
            };
        }
    }
    let at = (0..n).max_by(|&i, &j| scores[i].total_cmp(&scores[j]))?;
    let chance = ChiSquared::new(6.0).ok()?.sf(scores[at]) * n as f64;
    if chance >= CHANCE {
        return None;
    }
    let hold = &holds[left[at]];
    let c = (0..6).max_by(|&i, &j| detail[at][i].t.abs().total_cmp(&detail[at][j].t.abs()))?;
    let misfit = Misfit {
        line: hold.line,
        component: COMPONENTS[c],
        off: detail[at][c].value,
        sigmas: detail[at][c].t.abs(),
        p: chance.min(1.0),
        as_mass_kg: as_mass(hold, &detail[at]),
        mass_kg: hold.mass_kg,
    };
    Some((at, misfit))
}

/// The factor on a weight that explains what its row is off, if one does.
fn as_mass(hold: &Hold, off: &[Off; 6]) -> Option<[f64; 2]> {
    let (mut top, mut bottom, mut all) = (0.0, 0.0, 0.0);
    for Off { value, sd, answer, .. } in off {
        top += answer * value / (sd * sd);
        bottom += (answer / sd).powi(2);
        all += (value / sd).powi(2);
    }
    let factor = top / bottom;
    let rest = all - factor * top;
    let explains = bottom > 0.0 && rest < EXPLAINED * all && 1.0 + factor > 0.0;
    explains.then(|| [hold.mass_kg * (1.0 + factor), hold.mass_kg / bottom.sqrt()])
}

/// What the place of a weight, and the weight, add to the deviation of a reading.
fn place_sd(hold: &Hold, wrench: &[f64; 6], known: &Known, a: &SMatrix<f64, 6, 6>, c: usize) -> f64 {
    let force = nalgebra::Vector3::new(wrench[0], wrench[1], wrench[2]);
    let answer: f64 = (0..6).map(|k| a[(c, k)] * wrench[k]).sum();
    let mut variance = (known.mass_share * answer).powi(2);
    for axis in 0..3 {
        let turned = nalgebra::Vector3::ith(axis, 1.0).cross(&force);
        let moment = hold.lever_m.cross(&turned);
        let tilt: f64 = (0..3).map(|k| a[(c, k)] * turned[k] + a[(c, 3 + k)] * moment[k]).sum();
        let shift: f64 = (0..3).map(|k| a[(c, 3 + k)] * turned[k]).sum();
        variance += (known.direction_rad * tilt).powi(2) + (known.lever_m * shift).powi(2);
    }
    variance.sqrt()
}

/// Standard deviation by the median of sizes (× 1.4826, normal distribution), which a few large ones do not move.
fn robust(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    (1.4826 * sizes.get(sizes.len() / 2).copied().unwrap_or(0.0)).max(f64::MIN_POSITIVE)
}
