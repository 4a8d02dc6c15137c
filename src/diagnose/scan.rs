//! Many small changes of the body, each judged in a millisecond: by how much would it lower the sum of squares?
//!
//! Without memory, what is read in a poke is in proportion to the tip's displacement: `F = E k x`, `u = m x`, one 3 × 3 and
//! one 3 markers × 3 matrix a site. A change of the body changes them by `δk`, `δm`; all rows enter through `Σ x xᵀ` and
//! `Σ r xᵀ`, and the part that modulus, patches, the elements' shares and what acts already can absorb is projected out. What acts need
//! not be in proportion to the displacement: its columns are signals in time, as the residual is.

use super::along_path::{Signals, Site, sites};
use super::body::Body;
use super::bulk::BodyChange;
use super::dual::{Dual, DualSolver, Field, gradient};
use super::model::Model;
use super::refit::Fitted;
use nalgebra::{DMatrix, DVector, Matrix3};

/// What is read per displacement of the tip at every site: force (3 × 3, N/m), markers (3 markers × 3).
#[derive(Debug, Clone)]
struct Maps(Vec<(Matrix3<f64>, DMatrix<f64>)>);

/// Sums over all rows, as a scalar product of maps that are written as vectors.
struct Sums {
    sites: Vec<Site>,
    /// Inverse variance of each force component (1/N²) and marker component (1/m²).
    weight: ([f64; 3], Vec<f64>),
    /// What acts already, and the residual.
    signals: Signals,
    /// By how much the error of its rest position, which stays, makes a sum over the frames of each marker component weigh less.
    stays: DVector<f64>,
}

/// A fitted reading, ready to be asked about changes of the body.
pub(super) struct Scan {
    modulus: f64,
    /// `k/E` of every disc (1/m).
    discs: Vec<f64>,
    body: Body,
    maps: Maps,
    sums: Sums,
    /// The columns that absorb, one a row, and the residual: their scalar product with a map as a vector.
    columns: DMatrix<f64>,
    residual: DVector<f64>,
    /// Inverse of the normal matrix of the columns, and their product with the residual.
    covariance: DMatrix<f64>,
    pull: DVector<f64>,
}

impl Scan {
    /// Of a fitted reading. `None` where the body has no answer.
    pub(super) fn new(model: &Model<'_>, fitted: &Fitted) -> Option<Self> {
        let marched = model.march(&fitted.acting, &fitted.at)?;
        let fittable = model.base();
        let modulus = fitted.at[0].exp();
        let stiffness = model.disc_stiffness(&fitted.acting, &fitted.at);
        let stays = fitted.staying(model);
        let (sites, signals) = sites(model, fitted, &marched, &stays);
        let body = marched.body;
        let discs: Vec<f64> = stiffness.iter().map(|k| k.re / modulus).collect();
        let maps = maps(&Compliance::of(&body), &discs, modulus)?;
        let count = model.settled.evidence.rest.len();
        let markers = (0..3 * count).map(|i| model.marker_sd[i % 3].powi(-2)).collect();
        let weight = (model.force_sd.map(|s| s.powi(-2) / model.correlation.force), markers);
        let mut columns = derivatives(&body, &stiffness, fitted.at[0], fittable)?;
        let (in_proportion, acting) = (fittable + 2 * body.sites, fitted.acting.knobs.len());
        columns.extend((0..2 * body.sites).map(|share| maps.share(share % body.sites, share / body.sites)));
        let sums = Sums { sites, weight, signals, stays: stays.1 };
        let vectors: Vec<DVector<f64>> = columns.iter().map(Maps::vector).collect();
        let mut weighed: Vec<_> = columns.iter().map(|column| sums.weighed(column).transpose()).collect();
        weighed.extend((0..acting).map(|knob| sums.signal(knob).transpose()));
        // Inverse variance that the parameter of every column is known to have beforehand. What may not change absorbs nothing.
        let prior = model.prior_precision(&fitted.acting);
        let parameters =
            (0..fittable).chain(fittable + acting..fitted.at.len()).chain(fittable..fittable + acting);
        let of = |i| if model.frozen(&fitted.acting, i) { f64::MAX.sqrt() } else { prior[i] };
        let prior: Vec<f64> = parameters.map(of).collect();
        let columns = DMatrix::from_rows(&weighed);
        let n = columns.nrows();
        let crossed = &columns * DMatrix::from_columns(&vectors);
        let normal = DMatrix::from_fn(n, n, |i, j| {
            let product = match (i.checked_sub(in_proportion), j.checked_sub(in_proportion)) {
                (Some(a), Some(b)) => sums.signals.products[(a, b)],
                (_, None) => crossed[(i, j)],
                (None, Some(_)) => crossed[(j, i)],
            };
            product + if i == j { prior[i] } else { 0.0 }
        });
        // Scaled, as moduli, metres and shares differ by orders. What changes nothing absorbs nothing.
        let scale = normal.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 });
        let scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] * scale[i] * scale[j]);
        let inverse = (scaled + DMatrix::identity(n, n) * 1e-10).cholesky()?.inverse();
        let covariance = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let residual = sums.signal(acting);
        let pull = DVector::from_fn(n, |i, _| match i.checked_sub(in_proportion) {
            Some(knob) => sums.signals.products[(knob, acting)],
            None => residual.dot(&vectors[i]),
        });
        Some(Self { modulus, discs, body, maps, sums, columns, residual, covariance, pull })
    }

    /// By how much the sum of squares falls with the best positive amount of this change. `None` where the changed body has
    /// no answer.
    pub(super) fn gain(&self, change: &BodyChange) -> Option<f64> {
        let sum = |own: &Field, more: &Field| &own.value + &more.value;
        let changed = Compliance {
            tips_tips: &sum(&self.body.tips_tips, &change.tips_tips),
            discs_tips: &sum(&self.body.discs_tips, &change.discs_tips),
            discs_discs: &sum(&self.body.discs_discs, &change.discs_discs),
            markers: &sum(&self.body.markers, &change.markers),
        };
        let column = maps(&changed, &self.discs, self.modulus)?.less(&self.maps);
        let vector = column.vector();
        let with_columns = &self.columns * &vector;
        let absorbed = &self.covariance * &with_columns;
        let pull = self.residual.dot(&vector) - absorbed.dot(&self.pull);
        let size = self.sums.weighed(&column).dot(&vector) - absorbed.dot(&with_columns);
        (size > 0.0).then(|| pull.max(0.0).powi(2) / size)
    }
}

impl Sums {
    /// What a map's scalar product with others is taken with: driven and over the variance.
    fn weighed(&self, maps: &Maps) -> DVector<f64> {
        let mut stays = DVector::zeros(self.stays.len());
        for ((_, markers), site) in maps.0.iter().zip(&self.sites) {
            for (c, seen) in site.seen.iter().enumerate() {
                stays[c] += (markers.fixed_view::<1, 3>(c, 0) * seen.path)[0];
            }
        }
        stays.component_mul_assign(&self.stays);
        let parts = maps.0.iter().zip(&self.sites).map(|((force, markers), site)| {
            let mut driven = DMatrix::zeros(stays.len(), 3);
            for (c, seen) in site.seen.iter().enumerate() {
                let own = markers.fixed_view::<1, 3>(c, 0) * seen.drive - seen.path.transpose() * stays[c];
                driven.fixed_view_mut::<1, 3>(c, 0).copy_from(&own);
            }
            (self.over_variance(force * site.drive), self.markers_over_variance(driven))
        });
        Maps(parts.collect()).vector()
    }

    /// The same of a signal.
    fn signal(&self, signal: usize) -> DVector<f64> {
        let stays = self.signals.stay.column(signal).component_mul(&self.stays);
        let parts = self.sites.iter().map(|site| {
            let mut markers = DMatrix::zeros(stays.len(), 3);
            for (c, seen) in site.seen.iter().enumerate() {
                let own = (seen.cross[signal] - seen.path * stays[c]).transpose();
                markers.fixed_view_mut::<1, 3>(c, 0).copy_from(&own);
            }
            (self.over_variance(site.cross[signal]), self.markers_over_variance(markers))
        });
        Maps(parts.collect()).vector()
    }

    fn over_variance(&self, mut force: Matrix3<f64>) -> Matrix3<f64> {
        force.row_iter_mut().zip(&self.weight.0).for_each(|(mut row, weight)| row *= *weight);
        force
    }

    fn markers_over_variance(&self, mut markers: DMatrix<f64>) -> DMatrix<f64> {
        for mut column in markers.column_iter_mut() {
            column.iter_mut().zip(&self.weight.1).for_each(|(x, weight)| *x *= weight);
        }
        markers
    }
}

impl Maps {
    /// All entries in a row: site by site force, then markers.
    fn vector(&self) -> DVector<f64> {
        let all = self.0.iter().flat_map(|(force, markers)| force.iter().chain(markers.iter()));
        DVector::from_iterator(
            self.0.iter().map(|(force, markers)| force.len() + markers.len()).sum(),
            all.copied(),
        )
    }

    fn less(&self, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| (a.0 - b.0, &a.1 - &b.1)).collect())
    }

    /// Only the force (0) or the markers (1) of one site.
    fn share(&self, site: usize, channel: usize) -> Self {
        let only = |(i, (force, markers)): (usize, &(Matrix3<f64>, DMatrix<f64>))| {
            let keep = |c: usize| f64::from(u8::from(i == site && c == channel));
            (force * keep(0), markers * keep(1))
        };
        Self(self.0.iter().enumerate().map(only).collect())
    }
}

/// Values of a [`Body`].
struct Compliance<'a> {
    tips_tips: &'a DMatrix<f64>,
    discs_tips: &'a DMatrix<f64>,
    discs_discs: &'a DMatrix<f64>,
    markers: &'a DMatrix<f64>,
}

impl<'a> Compliance<'a> {
    fn of(body: &'a Body) -> Self {
        Self {
            tips_tips: &body.tips_tips.value,
            discs_tips: &body.discs_tips.value,
            discs_discs: &body.discs_discs.value,
            markers: &body.markers.value,
        }
    }
}

/// Readings per displacement of the tip; unknowns are the tip's force and the discs' displacements.
fn maps(body: &Compliance<'_>, discs: &[f64], modulus: f64) -> Option<Maps> {
    let (a, b, d) = (body.tips_tips, body.discs_tips, body.discs_discs);
    let (n, sites) = (d.nrows(), a.nrows() / 3);
    let one = |site: usize| {
        let s = 3 * site;
        let mut matrix = DMatrix::zeros(3 + n, 3 + n);
        matrix.view_mut((0, 0), (3, 3)).copy_from(&a.view((s, s), (3, 3)));
        for j in 0..n {
            for i in 0..3 {
                matrix[(3 + j, i)] = -b[(j, s + i)];
                matrix[(i, 3 + j)] = -b[(j, s + i)] * discs[j / 3];
            }
            for i in 0..n {
                matrix[(3 + i, 3 + j)] = d[(i, j)] * discs[j / 3];
            }
            matrix[(3 + j, 3 + j)] += 1.0;
        }
        let mut right = DMatrix::zeros(3 + n, 3);
        right.fill_diagonal(1.0);
        let solved = matrix.lu().solve(&right)?;
        let force = solved.fixed_view::<3, 3>(0, 0).into_owned();
        let force_by_axis = DMatrix::from_column_slice(3, 3, force.as_slice());
        let mut markers: DMatrix<f64> = body.markers.columns(s, 3) * force_by_axis;
        let pull = DMatrix::from_fn(n, 3, |j, axis| -discs[j / 3] * solved[(3 + j, axis)]);
        markers += body.markers.columns(3 * sites, n) * pull;
        Some((force * modulus, markers))
    };
    (0..sites).map(one).collect::<Option<_>>().map(Maps)
}

/// Derivatives of the maps by the baseline's parameters.
fn derivatives(body: &Body, stiffness: &[Dual], log_modulus: f64, parameters: usize) -> Option<Vec<Maps>> {
    let (a, b, d) = (body.tips_tips.dual(), body.discs_tips.dual(), body.discs_discs.dual());
    let n = d.nrows();
    let modulus = num_dual::DualNum::exp(&super::dual::variable(log_modulus, 0));
    let discs: Vec<Dual> = stiffness.iter().map(|k| *k / modulus).collect();
    let mut columns = vec![Maps(Vec::new()); parameters];
    for site in 0..body.sites {
        let s = 3 * site;
        let matrix = DMatrix::from_fn(3 + n, 3 + n, |i, j| match (i.checked_sub(3), j.checked_sub(3)) {
            (None, None) => a[(s + i, s + j)],
            (Some(i), None) => -b[(i, s + j)],
            (None, Some(j)) => -b[(j, s + i)] * discs[j / 3],
            (Some(i), Some(j)) => d[(i, j)] * discs[j / 3] + f64::from(u8::from(i == j)),
        });
        let solver = DualSolver::new(&matrix)?;
        let mut by = vec![(Matrix3::zeros(), DMatrix::zeros(body.markers.value.nrows(), 3)); parameters];
        for axis in 0..3 {
            let right = DVector::from_fn(3 + n, |i, _| Dual::from(f64::from(u8::from(i == axis))));
            let solved = solver.solve(&right)?;
            let mut loads = vec![Dual::from(0.0); body.markers.value.ncols()];
            for i in 0..3 {
                loads[s + i] = solved[i];
                let force = gradient(&(solved[i] * modulus), parameters);
                for (p, (k, _)) in by.iter_mut().enumerate() {
                    k[(i, axis)] = force[p];
                }
            }
            for j in 0..n {
                loads[3 * body.sites + j] = -solved[3 + j] * discs[j / 3];
            }
            let plain = DVector::from_iterator(loads.len(), loads.iter().map(|l| l.re));
            let slopes: Vec<DVector<f64>> = loads.iter().map(|l| gradient(l, parameters)).collect();
            for (p, (_, markers)) in by.iter_mut().enumerate() {
                let slope = DVector::from_iterator(loads.len(), slopes.iter().map(|s| s[p]));
                markers.set_column(axis, &(&body.markers.value * slope));
            }
            for (p, change) in body.markers.by.iter().filter(|(p, _)| *p < parameters) {
                let mut column = by[*p].1.column_mut(axis);
                column.gemv(1.0, change, &plain, 1.0);
            }
        }
        columns.iter_mut().zip(by).for_each(|(maps, one)| maps.0.push(one));
    }
    Some(columns)
}

#[cfg(test)]
mod tests {
    use super::super::along_path::InPoke;
    use super::*;
    use crate::geometry::Vec3;

    /// Sums over rows by hand: two rows of the sensor, and three frames, in one of which the second of two markers is hidden.
    #[test]
    fn the_scalar_product_is_the_sum_over_rows() {
        let force = Matrix3::new(1.0, 0.2, -0.3, 0.5, 2.0, 0.1, -0.7, 0.4, 3.0);
        let marker = Matrix3::new(0.3, -0.1, 0.2, 0.05, 0.6, -0.4, 0.15, 0.25, 0.9);
        let map = |scale: f64| {
            let markers =
                DMatrix::from_fn(6, 3, |i, j| marker[(i % 3, j)] * scale * if i < 3 { 1.0 } else { -0.6 });
            Maps(vec![(force * scale, markers)])
        };
        let (a, b) = (map(1.0), map(-0.5));
        let rows = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, -1.0, 4.0)];
        let frames = [Vec3::new(2.0, 0.0, 1.0), Vec3::new(-1.0, 1.0, 1.0), Vec3::new(0.5, 0.2, 0.1)];
        let seen = [&frames[..], &frames[1..]];
        let left = Vec3::new(0.3, -0.2, 0.7);
        let weight = ([1.0, 2.0, 3.0], vec![4.0, 5.0, 6.0, 4.0, 5.0, 6.0]);
        let outer = |of: &[Vec3]| of.iter().map(|x| x * x.transpose()).sum::<Matrix3<f64>>();
        let crossed = |of: &[Vec3]| of.iter().map(|x| left * x.transpose()).sum::<Matrix3<f64>>();
        let sums = |component: usize| {
            let mut sums = InPoke::new(1);
            let signal = DVector::from_element(1, left[component % 3]);
            seen[component / 3].iter().for_each(|x| sums.add(x, &signal));
            sums.weighed(0.0)
        };
        let site =
            Site { drive: outer(&rows), seen: (0..6).map(sums).collect(), cross: vec![crossed(&rows)] };
        // With r frames at rest and n seen (1 + 1 1ᵀ/r)⁻¹ = 1 − 1 1ᵀ/(r + n): two at rest.
        let share = |m: usize| 1.0 / (2.0 + seen[m].len() as f64);
        let stay = DMatrix::from_fn(6, 1, |i, _| left[i % 3] * seen[i / 3].len() as f64);
        let signals = Signals { stay, products: DMatrix::zeros(1, 1) };
        let stays = DVector::from_fn(6, |i, _| share(i / 3));
        let sums = Sums { sites: vec![site], weight: weight.clone(), signals, stays };

        // Products over all rows, and for a marker's component less a share of that of the sums over its frames.
        let product = |a: &Maps, b: &dyn Fn(Option<usize>, usize, &Vec3) -> f64| -> f64 {
            let (force, markers) = &a.0[0];
            let mut all = 0.0;
            for axis in 0..3 {
                let felt = |x: &Vec3| (force.row(axis) * x)[0] * b(None, axis, x);
                all += weight.0[axis] * rows.iter().map(felt).sum::<f64>();
                for (m, frames) in seen.iter().enumerate() {
                    let row = 3 * m + axis;
                    let own = |x: &Vec3| (markers.row(row) * x)[0];
                    let by_frame: f64 = frames.iter().map(|x| own(x) * b(Some(m), axis, x)).sum();
                    let (of_a, of_b): (f64, f64) =
                        (frames.iter().map(own).sum(), frames.iter().map(|x| b(Some(m), axis, x)).sum());
                    all += weight.1[row] * (by_frame - share(m) * of_a * of_b);
                }
            }
            all
        };
        let read = |marker: Option<usize>, axis: usize, x: &Vec3| match marker {
            None => (b.0[0].0.row(axis) * x)[0],
            Some(m) => (b.0[0].1.row(3 * m + axis) * x)[0],
        };
        let expected = product(&a, &read);
        assert!((sums.weighed(&a).dot(&b.vector()) - expected).abs() < 1e-12 * expected.abs());
        let pulled = product(&a, &|_, axis, _| left[axis]);
        assert!((sums.signal(0).dot(&a.vector()) - pulled).abs() < 1e-12 * pulled.abs());
    }
}
