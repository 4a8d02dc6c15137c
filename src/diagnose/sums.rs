//! Sums of squares over many rows at once: rows with their derivatives → normal equations.

use nalgebra::{DMatrix, DVector};

/// One poke's part of a fit.
#[derive(Debug, Clone)]
pub(super) struct PokeSums {
    /// Number of values in all rows.
    pub values: usize,
    /// Sum of squares over the stated noise of all rows: of the force, of the markers.
    pub chi2: [f64; 2],
    /// Sum of squares over the effective noise of the rows that count.
    pub cost: f64,
    /// `Jᵀ J` of the rows that count.
    pub normal: DMatrix<f64>,
    /// `Jᵀ r` of the rows that count.
    pub gradient: DVector<f64>,
    /// What an error that stays with a marker takes off all of these.
    pub offsets: Offsets,
}

impl PokeSums {
    /// No rows, for so many parameters and markers.
    pub(super) fn empty(parameters: usize, markers: usize) -> Self {
        Self {
            values: 0,
            chi2: [0.0; 2],
            cost: 0.0,
            normal: DMatrix::zeros(parameters, parameters),
            gradient: DVector::zeros(parameters),
            offsets: Offsets {
                rows: DMatrix::zeros(3 * markers, parameters + 1),
                frames: DVector::zeros(3 * markers),
            },
        }
    }

    /// Takes note of values of a channel (0 force, 1 markers), whether a fit goes by them or not.
    pub(super) fn note(&mut self, channel: usize, values: usize, chi2: f64) {
        self.values += values;
        self.chi2[channel] += chi2;
    }

    /// Adds rows that count, given as columns `[J over fitted | share | residual]`, each over the noise. `share` is the index
    /// of the parameter that the share's column belongs to; `inflation` the factor by which correlation raises the variance of
    /// a mean.
    pub(super) fn add(&mut self, rows: &DMatrix<f64>, share: usize, inflation: f64) {
        let fitted = rows.ncols() - 2;
        let gram = gram(rows) / inflation;
        let place = |i: usize| if i < fitted { i } else { share };
        for i in 0..=fitted {
            for j in 0..=fitted {
                self.normal[(place(i), place(j))] += gram[(i, j)];
            }
            self.gradient[place(i)] += gram[(i, fitted + 1)];
        }
        self.cost += gram[(fitted + 1, fitted + 1)];
    }

    /// Adds rows of the force, three for every time, likewise, with an error that each component has during the whole poke, of variance
    /// `wander` over that of a row.
    ///
    /// With `n` rows and `f` the inflation `(f + w 1 1ᵀ)⁻¹ = (1 − w/(f + w n) 1 1ᵀ)/f`.
    pub(super) fn add_force(&mut self, rows: &DMatrix<f64>, share: usize, inflation: f64, wander: f64) {
        self.add(rows, share, inflation);
        let n = rows.nrows() / 3;
        let scale = (wander / (inflation + wander * n as f64) / inflation).sqrt();
        let sums = DMatrix::from_fn(3, rows.ncols(), |axis, j| {
            scale * (0..n).map(|i| rows[(3 * i + axis, j)]).sum::<f64>()
        });
        let mut off = Self::empty(self.gradient.len(), 0);
        off.add(&sums, share, 1.0);
        self.normal -= off.normal;
        self.gradient -= off.gradient;
        self.cost -= off.cost;
    }

    /// Adds three rows for every one of `markers`, likewise.
    pub(super) fn add_markers(
        &mut self,
        markers: impl Iterator<Item = usize>,
        rows: &DMatrix<f64>,
        share: usize,
        inflation: f64,
    ) {
        self.add(rows, share, inflation);
        let fitted = rows.ncols() - 2;
        let residual = self.gradient.len();
        let offsets = &mut self.offsets;
        for (n, marker) in markers.enumerate() {
            for axis in 0..3 {
                let (to, from) = (3 * marker + axis, 3 * n + axis);
                offsets.frames[to] += inflation.recip();
                for i in 0..fitted {
                    offsets.rows[(to, i)] += rows[(from, i)] / inflation;
                }
                offsets.rows[(to, share)] += rows[(from, fitted)] / inflation;
                offsets.rows[(to, residual)] += rows[(from, fitted + 1)] / inflation;
            }
        }
    }

    /// Adds another part.
    pub(super) fn join(&mut self, other: Self) {
        self.cost += other.cost;
        self.normal += other.normal;
        self.gradient += other.gradient;
        self.offsets.add(&other.offsets);
    }

    /// Weighs everything by an error that each marker has during the whole poke, of this variance along each axis over that of
    /// a row.
    ///
    /// With `n` rows and `ℓ` that variance `(1 + ℓ 1 1ᵀ)⁻¹ = 1 − ℓ/(1 + ℓ n) 1 1ᵀ`.
    pub(super) fn weigh_lasting(&mut self, lasting: [f64; 3]) {
        let scale = DVector::from_fn(self.offsets.frames.len(), |i, _| {
            (1.0 + lasting[i % 3] * self.offsets.frames[i]).recip()
        });
        let weight = DVector::from_fn(scale.len(), |i, _| lasting[i % 3] * scale[i]);
        let off = self.offsets.taken_off(&weight);
        self.normal -= off.normal;
        self.gradient -= off.gradient;
        self.cost -= off.cost;
        self.offsets.frames.component_mul_assign(&scale);
        for mut column in self.offsets.rows.column_iter_mut() {
            column.component_mul_assign(&scale);
        }
    }
}

/// Sums over the frames of each component of each marker.
#[derive(Debug, Clone)]
pub(super) struct Offsets {
    /// `[J | r]`: one row a component.
    pub rows: DMatrix<f64>,
    /// So many frames each.
    pub frames: DVector<f64>,
}

/// What is taken off the sums.
pub(super) struct TakenOff {
    /// Off `JᵀJ`.
    pub normal: DMatrix<f64>,
    /// Off `Jᵀr`.
    pub gradient: DVector<f64>,
    /// Off the sum of squares.
    pub cost: f64,
}

impl Offsets {
    /// Adds those of another part.
    pub(super) fn add(&mut self, other: &Self) {
        self.rows += &other.rows;
        self.frames += &other.frames;
    }

    /// `[J | r]ᵀ W [J | r]` with a weight for each component.
    pub(super) fn taken_off(&self, weight: &DVector<f64>) -> TakenOff {
        let n = self.rows.ncols() - 1;
        let mut weighed = self.rows.clone();
        for mut column in weighed.column_iter_mut() {
            column.component_mul_assign(weight);
        }
        let all = self.rows.tr_mul(&weighed);
        TakenOff {
            normal: all.view((0, 0), (n, n)).into_owned(),
            gradient: all.view((0, n), (n, 1)).column(0).into_owned(),
            cost: all[(n, n)],
        }
    }
}

/// `RᵀR`: columns lie in memory one after the other.
fn gram(rows: &DMatrix<f64>) -> DMatrix<f64> {
    let n = rows.ncols();
    let mut gram = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let product = rows.column(i).dot(&rows.column(j));
            gram[(i, j)] = product;
            gram[(j, i)] = product;
        }
    }
    gram
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two fitted parameters and the second of two shares, by hand.
    #[test]
    fn rows_add_up_by_hand() {
        let mut sums = PokeSums::empty(4, 0);
        let rows = DMatrix::from_row_slice(2, 4, &[1.0, 2.0, 3.0, 4.0, 0.0, 1.0, -1.0, 2.0]);
        sums.note(1, 2, 20.0);
        sums.add(&rows, 3, 2.0);
        assert_eq!((sums.values, sums.chi2, sums.cost), (2, [0.0, 20.0], 10.0));
        assert_eq!(sums.normal[(0, 1)], 1.0);
        assert_eq!(sums.normal[(3, 1)], 2.5);
        assert_eq!(sums.normal[(2, 2)], 0.0);
        assert_eq!(sums.gradient.as_slice(), [2.0, 5.0, 0.0, 5.0]);
    }

    /// Against the inverse of the whole covariance: four times, three components, by an axis of its own each.
    #[test]
    fn a_zero_that_wanders_weighs_as_its_covariance_says() {
        let (inflation, wander) = (1.7, 0.4);
        let rows = DMatrix::from_fn(12, 4, |i, j| ((i * i * 5 + 7 * j + i * j) % 19) as f64 / 9.0 - 1.0);
        let mut sums = PokeSums::empty(3, 0);
        sums.add_force(&rows, 2, inflation, wander);
        let covariance = DMatrix::from_fn(12, 12, |i, j| {
            inflation * f64::from(u8::from(i == j)) + wander * f64::from(u8::from(i % 3 == j % 3))
        });
        let expected = rows.tr_mul(&covariance.lu().solve(&rows).expect("definite"));
        assert!((&sums.normal - expected.view((0, 0), (3, 3))).amax() < 1e-12);
        assert!((&sums.gradient - expected.view((0, 3), (3, 1))).amax() < 1e-12);
        assert!((sums.cost - expected[(3, 3)]).abs() < 1e-12);
    }

    /// Against the inverse of the whole covariance: two markers, the second in every other frame, two pokes, with an error that lasts a poke and one
    /// that lasts for ever.
    #[test]
    fn errors_that_stay_weigh_as_their_covariance_says() {
        let (lasting, rest) = ([0.3, 0.0, 0.7], 5.0);
        let value = |i: usize| ((i * i * 7 + 3 * i) % 23) as f64 / 11.0 - 1.0;
        let mut parts = Vec::new();
        // Poke, marker, axis of every row, and the row.
        let mut all: Vec<(usize, usize, usize, [f64; 4])> = Vec::new();
        for poke in 0..2 {
            let mut sums = PokeSums::empty(3, 2);
            for frame in 0..4 {
                let seen: Vec<usize> = if frame % 2 == 0 { vec![0, 1] } else { vec![0] };
                let rows =
                    DMatrix::from_fn(3 * seen.len(), 4, |i, j| value(all.len() + 5 * i + 31 * j + poke));
                for (i, row) in rows.row_iter().enumerate() {
                    all.push((poke, seen[i / 3], i % 3, std::array::from_fn(|j| row[j])));
                }
                sums.add_markers(seen.into_iter(), &rows, 2, 1.0);
            }
            sums.weigh_lasting(lasting);
            parts.push(sums);
        }
        let mut offsets = parts[0].offsets.clone();
        offsets.add(&parts[1].offsets);
        let off = offsets.taken_off(&offsets.frames.map(|n| (rest + n).recip()));
        let n = all.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| {
            let (a, b) = (&all[i], &all[j]);
            let same = f64::from(u8::from((a.1, a.2) == (b.1, b.2)));
            f64::from(u8::from(i == j)) + same * (lasting[a.2] * f64::from(u8::from(a.0 == b.0)) + 1.0 / rest)
        });
        let rows = DMatrix::from_fn(n, 4, |i, j| all[i].3[j]);
        let expected = rows.tr_mul(&covariance.lu().solve(&rows).expect("definite"));
        let found = &parts[0].normal + &parts[1].normal - off.normal;
        assert!((found - expected.view((0, 0), (3, 3))).amax() < 1e-12);
        let found = &parts[0].gradient + &parts[1].gradient - off.gradient;
        assert!((found - expected.view((0, 3), (3, 1))).amax() < 1e-12);
        assert!((parts[0].cost + parts[1].cost - off.cost - expected[(3, 3)]).abs() < 1e-12);
    }
}
