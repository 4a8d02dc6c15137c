//! Sums over the rows that count, for what is in proportion to the tip's displacement: `Σ x xᵀ` of that displacement, and `Σ s xᵀ` of signals, which
//! are the columns of what acts and the residual.

use super::model::{Marched, Model};
use super::refit::Fitted;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Sums of one site.
pub(super) struct Site {
    /// `Σ x xᵀ` over the force's rows (m²).
    pub drive: Matrix3<f64>,
    /// Of each marker component, over the frames in which it is seen.
    pub seen: Vec<Seen>,
    /// `Σ s xᵀ` of the force (N m), of every signal.
    pub cross: Vec<Matrix3<f64>>,
}

/// Sums over the frames in which a marker component is seen.
#[derive(Debug, Clone, Default)]
pub(super) struct Seen {
    /// `Σ x xᵀ` (m²).
    pub drive: Matrix3<f64>,
    /// `Σ x` (m).
    pub path: Vector3<f64>,
    /// `Σ s x` (m²), of every signal.
    pub cross: Vec<Vector3<f64>>,
}

/// Those of one poke, not weighed yet by the errors that last it.
#[derive(Debug, Clone)]
pub(super) struct InPoke {
    frames: f64,
    plain: Seen,
    /// `Σ s` (m) of every signal, and `Σ s sᵀ` (m²).
    sums: DVector<f64>,
    products: DMatrix<f64>,
}

impl InPoke {
    pub(super) fn new(signals: usize) -> Self {
        let plain = Seen { cross: vec![Vector3::zeros(); signals], ..Seen::default() };
        Self { frames: 0.0, plain, sums: DVector::zeros(signals), products: DMatrix::zeros(signals, signals) }
    }

    pub(super) fn add(&mut self, x: &Vector3<f64>, signals: &DVector<f64>) {
        self.frames += 1.0;
        self.sums += signals;
        self.products.ger(1.0, signals, signals, 1.0);
        self.plain.drive += x * x.transpose();
        self.plain.path += x;
        self.plain.cross.iter_mut().zip(signals).for_each(|(cross, s)| *cross += x * *s);
    }

    /// Weighed by an error that lasts over all these frames, of this variance over that of one:
    /// `(1 + ℓ 1 1ᵀ)⁻¹ = 1 − ℓ/(1 + ℓ n) 1 1ᵀ`.
    pub(super) fn weighed(&self, lasting: f64) -> Seen {
        let Seen { drive, path, cross } = &self.plain;
        let scale = self.scale(lasting);
        let less = lasting * scale;
        Seen {
            drive: drive - path * path.transpose() * less,
            path: path * scale,
            cross: cross.iter().zip(&self.sums).map(|(cross, sum)| cross - path * (sum * less)).collect(),
        }
    }

    /// Scalar products of the signals (m²), and their sums (m), weighed likewise.
    fn weighed_signals(&self, lasting: f64) -> (DMatrix<f64>, DVector<f64>) {
        let scale = self.scale(lasting);
        (&self.products - &self.sums * self.sums.transpose() * (lasting * scale), &self.sums * scale)
    }

    /// By how much a sum over these frames weighs less.
    fn scale(&self, lasting: f64) -> f64 {
        (1.0 + lasting * self.frames).recip()
    }
}

impl Seen {
    /// Another poke at the same site.
    fn join(&mut self, other: &Self) {
        self.drive += other.drive;
        self.path += other.path;
        self.cross.iter_mut().zip(&other.cross).for_each(|(cross, other)| *cross += other);
    }
}

/// What is the same for all rows of the recording: the columns of what acts, and last the residual.
pub(super) struct Signals {
    /// `Σ s` over the frames of each marker component (m), one column a signal: of what acts over those of pokes, of the residual over all.
    pub stay: DMatrix<f64>,
    /// Scalar products of the signals.
    pub products: DMatrix<f64>,
}

impl Signals {
    /// Of `products` that the errors of rest positions are not taken off yet: `stays` is by how much these make a sum weigh less, `weight` the inverse
    /// variance (1/m²) of each marker component.
    fn new(
        stay: DMatrix<f64>,
        products: DMatrix<f64>,
        stays: &DVector<f64>,
        weight: impl Fn(usize) -> f64,
    ) -> Self {
        let weighed =
            DMatrix::from_fn(stay.nrows(), stay.ncols(), |c, s| stays[c] * weight(c) * stay[(c, s)]);
        Self { products: products - stay.tr_mul(&weighed), stay }
    }
}

/// Sums over the rows that count. `stays` is what the residual adds up to for each marker component over all frames, and by how much such sums weigh
/// less.
pub(super) fn sites(
    model: &Model<'_>,
    fitted: &Fitted,
    marched: &Marched,
    stays: &(DVector<f64>, DVector<f64>),
) -> (Vec<Site>, Signals) {
    let components = 3 * model.settled.evidence.rest.len();
    // Of the columns `[J | share | residual]` those of what acts, and the residual.
    let signals: Vec<usize> = (model.base()..marched.fitted).chain([marched.fitted + 1]).collect();
    let count = signals.len();
    let none = || {
        let seen = vec![InPoke::new(count).plain; components];
        Site { drive: Matrix3::zeros(), seen, cross: vec![Matrix3::zeros(); count] }
    };
    let lasting = model.lasting();
    let weight = |c: usize| model.marker_sd[c % 3].powi(-2);
    let mut sites: Vec<Site> = (0..model.body.sites).map(|_| none()).collect();
    let mut stay = DMatrix::zeros(components, count);
    let mut products = DMatrix::zeros(count, count);
    for track in &model.tracks {
        let share = |channel: usize| fitted.at[marched.fitted + channel * model.body.sites + track.site];
        let site = &mut sites[track.site];
        let rows = model.force_rows(track, marched, share(0), true).select_columns(&signals);
        products += rows.tr_mul(&rows) / model.correlation.force;
        let counted = (0..track.time_s.len()).filter(|&i| track.counts[i]);
        for (n, row) in counted.enumerate() {
            let x = track.reported_m[row];
            site.drive += x * x.transpose();
            for axis in 0..3 {
                for (signal, cross) in site.cross.iter_mut().enumerate() {
                    let s = rows[(3 * n + axis, signal)] * model.force_sd[axis];
                    (0..3).for_each(|i| cross[(axis, i)] += s * x[i]);
                }
            }
        }
        let mut own = vec![InPoke::new(count); components];
        for frame in track.frames.iter().filter(|f| track.counts_at(f.time_s)) {
            let Some(rows) = model.marker_rows(track, frame, marched, share(1)) else { continue };
            let rows = rows.select_columns(&signals);
            let right = track.time_s.partition_point(|t| *t < frame.time_s).min(track.time_s.len() - 1);
            for (n, marker) in frame.markers().enumerate() {
                for axis in 0..3 {
                    let s = rows.row(3 * n + axis).transpose() * model.marker_sd[axis];
                    own[3 * marker + axis].add(&track.reported_m[right], &s);
                }
            }
        }
        for (c, (all, own)) in site.seen.iter_mut().zip(own).enumerate() {
            let (own_products, sums) = own.weighed_signals(lasting[c % 3]);
            products += own_products * weight(c);
            let so_far = stay.row(c) + sums.transpose();
            stay.set_row(c, &so_far);
            all.join(&own.weighed(lasting[c % 3]));
        }
    }
    stay.set_column(count - 1, &stays.0);
    (sites, Signals::new(stay, products, &stays.1, weight))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    /// An error that lasts takes off what all frames of a poke have in common, the more the larger it is: against the inverse covariance.
    #[test]
    fn an_error_that_lasts_is_weighed_by_its_covariance() {
        let xs = [Vec3::new(2.0, 0.0, 1.0), Vec3::new(-1.0, 1.0, 1.0), Vec3::new(0.5, 0.2, 0.1)];
        let residuals = Vec3::new(0.3, -0.2, 0.7);
        let lasting = 0.4;
        let covariance = Matrix3::identity() + Matrix3::repeat(lasting);
        let precision = covariance.try_inverse().expect("positive definite");
        let drives = Matrix3::from_columns(&xs).transpose();
        let mut seen = InPoke::new(1);
        xs.iter().zip(residuals.iter()).for_each(|(x, r)| seen.add(x, &DVector::from_element(1, *r)));
        let weighed = seen.weighed(lasting);
        let ones = Vec3::repeat(1.0);
        assert!((weighed.drive - drives.transpose() * precision * drives).amax() < 1e-12);
        assert!((weighed.cross[0] - drives.transpose() * precision * residuals).amax() < 1e-12);
        assert!((weighed.path - drives.transpose() * precision * ones).amax() < 1e-12);
    }

    /// Two signals that one component of a marker shows in two pokes, with an error that lasts a poke and one of its rest position, a mean over five
    /// frames: against the inverse of the whole covariance.
    #[test]
    fn signals_are_multiplied_as_their_covariance_says() {
        let (lasting, rest, weight) = (0.4, 5.0, 3.0);
        let values = DMatrix::from_fn(7, 2, |i, j| ((i * i * 5 + 7 * j + i * j) % 11) as f64 / 5.0 - 1.0);
        let pokes = [0..4, 4..7];
        let (mut stay, mut products) = (DMatrix::zeros(1, 2), DMatrix::zeros(2, 2));
        let mut frames = 0.0;
        for poke in &pokes {
            let mut own = InPoke::new(2);
            poke.clone().for_each(|i| own.add(&Vec3::x(), &values.row(i).transpose()));
            let (more, sums) = own.weighed_signals(lasting);
            products += more * weight;
            stay += sums.transpose();
            frames += own.frames * own.scale(lasting);
        }
        let stays = DVector::from_element(1, 1.0 / (rest + frames));
        let found = Signals::new(stay, products, &stays, |_| weight).products;
        let covariance = DMatrix::from_fn(7, 7, |i, j| {
            let together = pokes.iter().any(|poke| poke.contains(&i) && poke.contains(&j));
            f64::from(u8::from(i == j)) + lasting * f64::from(u8::from(together)) + 1.0 / rest
        });
        let expected = values.tr_mul(&covariance.lu().solve(&values).expect("definite")) * weight;
        assert!((&found - &expected).amax() < 1e-12, "{found} {expected}");
    }
}
