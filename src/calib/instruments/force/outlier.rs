//! Which weight do the others contradict?
//!
//! The errors of a reading have two sizes: its noise, and what the weights' places and masses leave, as it is stated or less of it
//! (`two_sizes`). Both are found from the table itself, for each reading and without the row that is judged: an unloaded row is held against
//! the noise alone, and a table whose places are better than stated against what they are. Each row is judged twice:
//!
//! - **Against all others**, those at its own place too: is this weight what it is said to be? The six t are made the normal numbers of the
//!   same chance, and the sum of their squares goes against χ² with 6 degrees of freedom. Where one factor on the weight explains what is
//!   off, that is said: the wrong weight was hung, or written down.
//! - **Against the model**, its place known as stated only: is this place what it is said to be? The greatest t of the six counts, its chance times
//!   six, since what a place does shows in several readings at once.
//!
//! Chances are multiplied by the number of rows (Bonferroni), and the two judgements have half of [`CHANCE`] each.
//!
//! Tests: `tests/calibration/force.rs`: sound tables with places as stated, better, and exact; a wrong weight; a wrong place.

use super::calibration::{Known, shared};
use super::two_sizes::{Contrasts, RowOff, Sizes};
use super::{COMPONENTS, Hold};
use crate::calib::instruments::least_squares::solve;
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

/// What rows are judged by.
pub(super) struct Judged<'a> {
    pub(super) holds: &'a [Hold],
    pub(super) wrenches: &'a [[f64; 6]],
    pub(super) known: &'a Known,
    /// The design, a row for each hold.
    pub(super) x: &'a DMatrix<f64>,
    /// Where the columns of the wrench begin in it.
    pub(super) first: usize,
    /// Sensitivities, near enough to say what a place that is off does to a reading.
    pub(super) a: &'a SMatrix<f64, 6, 6>,
}

/// Rows that the others contradict, worst first. One is named, taken away, and the rest looked at again.
pub(super) fn misfits(judged: &Judged<'_>) -> Vec<Misfit> {
    let count = judged.holds.len();
    let mut left: Vec<usize> = (0..count).collect();
    let mut named = Vec::new();
    while left.len() > judged.x.ncols() + 3 && named.len() < count / 4 {
        let Some((at, misfit)) = judged.worst(&left) else { break };
        named.push(misfit);
        left.remove(at);
    }
    named
}

/// One reading of the rows that are left.
struct Channel {
    contrasts: Contrasts,
    sizes: Sizes,
}

impl Judged<'_> {
    /// None where the rows do not tell all columns.
    fn channel(&self, rows: &[usize], c: usize) -> Option<Channel> {
        let contrasts = Contrasts::new(&self.design(rows), &self.reading(rows, c), &self.common(rows, c))?;
        let sizes = contrasts.sizes();
        Some(Channel { contrasts, sizes })
    }

    fn design(&self, rows: &[usize]) -> DMatrix<f64> {
        self.x.select_rows(rows)
    }

    fn reading(&self, rows: &[usize], c: usize) -> DVector<f64> {
        DVector::from_iterator(rows.len(), rows.iter().map(|&i| self.holds[i].reading[c]))
    }

    /// Covariance of what rows share, as stated.
    fn common(&self, rows: &[usize], c: usize) -> DMatrix<f64> {
        let holds: Vec<Hold> = rows.iter().map(|&i| self.holds[i]).collect();
        let wrenches: Vec<[f64; 6]> = rows.iter().map(|&i| self.wrenches[i]).collect();
        // The scale of all weights is taken up by the sensitivities.
        let known = Known { scale_share: 0.0, ..*self.known };
        let mut common = DMatrix::zeros(rows.len(), rows.len());
        for cause in shared(&holds, &wrenches, &known, &self.a.row(c).into()) {
            common.ger(1.0, &cause, &cause, 1.0);
        }
        common
    }

    /// The row that is contradicted most, with its index in `left`.
    fn worst(&self, left: &[usize]) -> Option<(usize, Misfit)> {
        // A reading that the model explains to the last digit contradicts nothing.
        let channels: Vec<(usize, Channel)> =
            (0..6).filter_map(|c| Some((c, self.channel(left, c)?))).collect();
        let of = |row: usize, way: Way| -> f64 {
            let squares =
                channels.iter().map(|(_, ch)| way(&ch.contrasts, row, ch.sizes, &ch.contrasts).t().powi(2));
            squares.sum()
        };
        let most = |way: Way| (0..left.len()).max_by(|&i, &j| of(i, way).total_cmp(&of(j, way)));
        let by_weight = most(Contrasts::against_all)?;
        let off = self.without(left, by_weight, &channels, Contrasts::against_all);
        let chance = chance_of_all(&off)? * left.len() as f64;
        if chance < 0.5 * CHANCE {
            let as_mass_kg = self.as_mass(left, by_weight, &off);
            return Some((by_weight, self.misfit(left[by_weight], &off, chance, as_mass_kg)));
        }
        let by_place = most(Contrasts::against_model)?;
        let off = self.without(left, by_place, &channels, Contrasts::against_model);
        let least = off.iter().map(|(_, off)| chance_of(off)).fold(1.0, f64::min);
        let chance = least * (off.len() * left.len()) as f64;
        (chance < 0.5 * CHANCE).then(|| (by_place, self.misfit(left[by_place], &off, chance, None)))
    }

    /// How far a row is off in each reading, judged by sizes that it has no part in.
    fn without(
        &self,
        left: &[usize],
        at: usize,
        channels: &[(usize, Channel)],
        way: Way,
    ) -> Vec<(usize, RowOff)> {
        let mut others = left.to_vec();
        others.remove(at);
        let one = |(c, whole): &(usize, Channel)| {
            let known = self.channel(&others, *c)?;
            Some((*c, way(&whole.contrasts, at, known.sizes, &known.contrasts)))
        };
        channels.iter().filter_map(one).collect()
    }

    fn misfit(
        &self,
        row: usize,
        off: &[(usize, RowOff)],
        chance: f64,
        as_mass_kg: Option<[f64; 2]>,
    ) -> Misfit {
        let hold = &self.holds[row];
        let most = off.iter().max_by(|(_, a), (_, b)| a.t().abs().total_cmp(&b.t().abs()));
        let (component, off) = most.map_or((0, RowOff::default()), |(c, off)| (*c, *off));
        Misfit {
            line: hold.line,
            component: COMPONENTS[component],
            off: off.value,
            sigmas: off.t().abs(),
            p: chance.min(1.0),
            as_mass_kg,
            mass_kg: hold.mass_kg,
        }
    }

    /// The factor on a weight that explains what its row is off, if one does; the others say what the weight does to each reading.
    fn as_mass(&self, left: &[usize], at: usize, off: &[(usize, RowOff)]) -> Option<[f64; 2]> {
        let mut others = left.to_vec();
        let row = others.remove(at);
        let (mut top, mut bottom, mut all) = (0.0, 0.0, 0.0);
        for (c, RowOff { value, sd, .. }) in off {
            let Sizes { noise2, share2 } = self.channel(&others, *c)?.sizes;
            let unit = DMatrix::identity(others.len(), others.len()) * noise2;
            let inverse = (self.common(&others, *c) * share2 + unit).cholesky()?.inverse();
            let beta = solve(&self.design(&others), &self.reading(&others, *c), &inverse)?.beta;
            let answer: f64 = (self.first..self.x.ncols()).map(|j| self.x[(row, j)] * beta[j]).sum();
            top += answer * value / (sd * sd);
            bottom += (answer / sd).powi(2);
            all += (value / sd).powi(2);
        }
        let factor = top / bottom;
        let rest = all - factor * top;
        let explains = bottom > 0.0 && rest < EXPLAINED * all && 1.0 + factor > 0.0;
        let mass_kg = self.holds[row].mass_kg;
        explains.then(|| [mass_kg * (1.0 + factor), mass_kg / bottom.sqrt()])
    }
}

/// How a row is judged.
type Way = fn(&Contrasts, usize, Sizes, &Contrasts) -> RowOff;

/// Chance of being so far off, to either side.
fn chance_of(off: &RowOff) -> f64 {
    // Beyond 38 standard deviations a chance is zero in double precision.
    StudentsT::new(0.0, 1.0, off.freedom).map_or(1.0, |student| (2.0 * student.sf(off.t().abs())).max(1e-300))
}

/// Chance of readings that are independent of each other and so far off together; none where nothing was read.
fn chance_of_all(off: &[(usize, RowOff)]) -> Option<f64> {
    let normal = Normal::standard();
    let score: f64 = off.iter().map(|(_, off)| normal.inverse_cdf(0.5 * chance_of(off)).powi(2)).sum();
    Some(ChiSquared::new(off.len() as f64).ok()?.sf(score))
}
