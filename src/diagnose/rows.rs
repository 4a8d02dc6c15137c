//! Rows of the recording against the model: residuals with their derivatives, over the noise.

use super::camera::{between, columns_between, shown};
use super::dual::{Dual, gradient, with_gradient};
use super::extra::Depth;
use super::model::{Marched, Model};
use super::sums::PokeSums;
use super::track::{Frame, Track};
use nalgebra::{DMatrix, DVector};

impl Model<'_> {
    /// Sums of one poke.
    pub(super) fn track_sums(&self, marched: &Marched<'_>, at: &DVector<f64>, track: &Track) -> PokeSums {
        let (fitted, sites) = (marched.fitted, self.body.sites);
        let mut sums = self.no_sums(at.len());
        let share = [fitted + track.site, fitted + sites + track.site];
        let shares = share.map(|i| at[i]);
        for counts in [true, false] {
            let rows = self.force_rows(track, marched, shares[0], counts);
            sums.note(0, rows.nrows(), rows.column(fitted + 1).norm_squared());
            if counts {
                sums.add_force(&rows, share[0], self.correlation.force, self.correlation.wander);
            }
        }
        for frame in &track.frames {
            if let Some(rows) = self.marker_rows(track, frame, marched, shares[1]) {
                sums.note(1, rows.nrows(), self.stated_chi2(frame, &rows));
                if track.counts_at(frame.time_s) {
                    sums.add_markers(frame.markers(), &rows, share[1], 1.0);
                }
            }
        }
        sums.weigh_lasting(self.lasting());
        sums
    }

    /// No rows of anything.
    pub(super) fn no_sums(&self, parameters: usize) -> PokeSums {
        PokeSums::empty(parameters, self.settled.evidence.rest.len())
    }

    /// Frames of the mean that a marker's rest position is.
    pub(super) fn rest_frames(&self, marker: usize) -> f64 {
        self.settled.evidence.rest[marker].1.max(1) as f64
    }

    /// Variance of an error that lasts a poke along each axis, over that of a row.
    pub(super) fn lasting(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.correlation.lasting_m2[axis] / self.marker_sd[axis].powi(2))
    }

    /// Sum of squares of a frame's residuals over the stated noise, that of the rest positions among it.
    pub(super) fn stated_chi2(&self, frame: &Frame, rows: &DMatrix<f64>) -> f64 {
        let residual = rows.column(rows.ncols() - 1);
        let own = |(n, marker): (usize, usize)| {
            residual.fixed_rows::<3>(3 * n).norm_squared() / (1.0 + 1.0 / self.rest_frames(marker))
        };
        frame.markers().enumerate().map(own).sum()
    }

    /// Between the pokes: the force is that of a sensor whose zero wanders, the markers move by what is remembered.
    pub(super) fn rest_sums(&self, marched: &Marched<'_>, parameters: usize) -> PokeSums {
        let fitted = marched.fitted;
        let mut rows = DMatrix::zeros(3 * self.rest.len(), fitted + 2);
        for (n, (t, force)) in self.rest.iter().enumerate() {
            for axis in 0..3 {
                let model = marched.effects.drift_n_per_s[axis] * *t;
                let slope = gradient(&model, fitted);
                for i in 0..fitted {
                    rows[(3 * n + axis, i)] = slope[i] / self.force_sd[axis];
                }
                rows[(3 * n + axis, fitted + 1)] = (force[axis] - model.re) / self.force_sd[axis];
            }
        }
        let mut sums = self.no_sums(parameters);
        sums.add(&rows, fitted, self.correlation.force);
        let time_s: Vec<f64> = self.timeline.rows.iter().map(|row| row.time_s).collect();
        for pause in &self.pauses {
            let mut own = self.no_sums(parameters);
            for frame in pause {
                if let Some(rows) = self.resting_rows(frame, &time_s, marched) {
                    own.add_markers(frame.markers(), &rows, fitted, 1.0);
                }
            }
            own.weigh_lasting(self.lasting());
            sums.join(own);
        }
        sums
    }

    /// Columns `[J | share | residual]` of the force rows that count, or of those that do not, over the noise.
    pub(super) fn force_rows(
        &self,
        track: &Track,
        marched: &Marched<'_>,
        share: f64,
        counts: bool,
    ) -> DMatrix<f64> {
        let fitted = marched.fitted;
        let chosen: Vec<usize> = (0..track.time_s.len()).filter(|&i| track.counts[i] == counts).collect();
        let mut out = DMatrix::zeros(3 * chosen.len(), fitted + 2);
        for (n, &row) in chosen.iter().enumerate() {
            let felt = self.felt_at(track, marched, row);
            for axis in 0..3 {
                let (model, besides) = felt[axis];
                let all = model * (1.0 + share) + besides;
                let sd = self.force_sd[axis];
                let slope = gradient(&all, fitted);
                for i in 0..fitted {
                    out[(3 * n + axis, i)] = slope[i] / sd;
                }
                out[(3 * n + axis, fitted)] = model.re / sd;
                out[(3 * n + axis, fitted + 1)] = (track.force_n[row][axis] - all.re) / sd;
            }
        }
        out
    }

    /// What the sensor reads (N) at one row of a track along each axis: of the tip, and besides.
    pub(super) fn felt_at(&self, track: &Track, marched: &Marched<'_>, row: usize) -> [(Dual, Dual); 3] {
        let Marched { rows, effects, .. } = marched;
        let at = track.first_row + row;
        let more = self.added(marched, track.index, at).0;
        std::array::from_fn(|axis| {
            let of_tip = (rows.force[at][axis] + more[axis]) * effects.gain[axis];
            (of_tip, effects.drift_n_per_s[axis] * track.time_s[row])
        })
    }

    /// What a law that is not linear adds at one row of a march, as for this track: force (N) and, where it adds anything,
    /// markers (m).
    pub(super) fn added(
        &self,
        marched: &Marched<'_>,
        track: usize,
        row: usize,
    ) -> ([Dual; 3], Option<DVector<f64>>) {
        let Some((extra, shelf, modulus)) = &marched.extra else {
            return ([Dual::from(0.0); 3], None);
        };
        let all = shelf.at(extra, track, &marched.rows.depth[row], modulus, marched.fitted);
        let force = std::array::from_fn(|axis| {
            let by: Vec<(usize, f64)> = (0..marched.fitted).map(|p| (p, all[(axis, 1 + p)])).collect();
            with_gradient(all[(axis, 0)], &by) * *modulus
        });
        (force, Some(all.column(0).rows(3, all.nrows() - 3).into_owned()))
    }

    /// Columns `[J | share | residual]` of one frame's markers, over the noise; what the camera's sway may have moved
    /// together weighs less.
    pub(super) fn marker_rows(
        &self,
        track: &Track,
        frame: &Frame,
        marched: &Marched<'_>,
        share: f64,
    ) -> Option<DMatrix<f64>> {
        Some(self.seen_rows(frame, marched, &self.moved_at(track, frame, marched)?, share))
    }

    /// Displacements of all markers (m) that a frame of a poke shows: value, then derivatives. `None` outside of its rows.
    fn moved_at(&self, track: &Track, frame: &Frame, marched: &Marched<'_>) -> Option<DMatrix<f64>> {
        let Marched { rows, effects, fitted, .. } = marched;
        let ([left, right], s) = shown(&track.time_s, effects.lag_s, frame.time_s)?;
        let mut u = self.displacements(marched, [left, right].map(|row| track.first_row + row), s);
        if let Some((extra, shelf, modulus)) = &marched.extra {
            let [a, b] = [left, right].map(|row| rows.depth[track.first_row + row]);
            let depth = Depth { now: between(a.now, b.now, s), deepest: between(a.deepest, b.deepest, s) };
            let more = shelf.at(extra, track.index, &depth, modulus, *fitted);
            u += more.rows(3, u.nrows());
        }
        Some(u)
    }

    /// Displacements (m) of the markers seen in a frame of a poke, as the camera shows them: three components each, in the order of the frame.
    pub(super) fn shown_at(
        &self,
        track: &Track,
        frame: &Frame,
        marched: &Marched<'_>,
    ) -> Option<DVector<f64>> {
        let seen = self.in_view(frame, marched, &self.moved_at(track, frame, marched)?);
        Some(seen.column(marched.fitted).into_owned())
    }

    /// The same of a frame between pokes, whose error no site shares. `None` outside of what was marched through, at these times.
    fn resting_rows(&self, frame: &Frame, time_s: &[f64], marched: &Marched<'_>) -> Option<DMatrix<f64>> {
        let ([left, right], s) = shown(time_s, marched.effects.lag_s, frame.time_s)?;
        let at_rest = |row: usize| self.timeline.rows[row].contact.is_none();
        if !at_rest(left) || !at_rest(right) {
            return None;
        }
        let u = if marched.rows.loads[left].is_empty() {
            DMatrix::zeros(marched.body.markers.value.nrows(), marched.fitted + 1)
        } else {
            self.displacements(marched, [left, right], s)
        };
        let mut rows = self.seen_rows(frame, marched, &u, 0.0);
        rows.column_mut(marched.fitted).fill(0.0);
        Some(rows)
    }

    /// Displacements of all markers (m) between two rows of a march: value, then derivatives.
    fn displacements(&self, marched: &Marched<'_>, rows: [usize; 2], s: Dual) -> DMatrix<f64> {
        let Marched { body, .. } = marched;
        let [a, b] = rows.map(|row| &marched.rows.loads[row]);
        let columns = columns_between(a, b, &s);
        // Loads with their derivatives → displacements with theirs: one product.
        let mut u = &body.markers.value * &columns;
        for (p, change) in &body.markers.by {
            let mut column = u.column_mut(1 + p);
            column.gemv(1.0, change, &columns.column(0), 1.0);
        }
        u
    }

    /// Columns `[J | share | residual]` of a frame's markers where all of them are displaced by `u`.
    fn seen_rows(&self, frame: &Frame, marched: &Marched<'_>, u: &DMatrix<f64>, share: f64) -> DMatrix<f64> {
        let (fitted, seen) = (marched.fitted, &frame.seen);
        let mut out = self.in_view(frame, marched, u);
        let scale = DVector::from_fn(3 * seen.len(), |row, _| self.marker_sd[row % 3].recip());
        for (row, s) in scale.iter().enumerate() {
            let (marker_row, axis) = (row / 3, row % 3);
            out[(row, fitted + 1)] = (seen[marker_row].1[axis] - out[(row, fitted)] * (1.0 + share)) * s;
        }
        for (j, mut column) in out.column_iter_mut().enumerate().take(fitted + 1) {
            let all = if j < fitted { 1.0 + share } else { 1.0 };
            column.iter_mut().zip(&scale).for_each(|(x, s)| *x *= all * s);
        }
        self.take_off_sway(&mut out);
        out
    }

    /// Columns `[J | value | 0]` of the markers of one frame as the camera shows them (m), where all markers are displaced by `u`.
    fn in_view(&self, frame: &Frame, marched: &Marched<'_>, u: &DMatrix<f64>) -> DMatrix<f64> {
        let fitted = marched.fitted;
        let mut out = DMatrix::zeros(3 * frame.seen.len(), fitted + 2);
        if marched.effects.camera_acts() {
            turned(u, &marched.turn, frame, &mut out);
        } else {
            // Column by column, as they lie in memory.
            for (from, to) in (0..fitted).map(|j| (1 + j, j)).chain([(0, fitted)]) {
                let (from, mut to) = (u.column(from), out.column_mut(to));
                for (n, (marker, _)) in frame.seen.iter().enumerate() {
                    (0..3).for_each(|axis| to[3 * n + axis] = from[3 * marker + axis]);
                }
            }
        }
        self.picture.scale(frame, &marched.effects, fitted, &mut out);
        out
    }

    /// Whitens rows of one frame against a common motion along each axis.
    fn take_off_sway(&self, rows: &mut DMatrix<f64>) {
        let n = rows.nrows() / 3;
        for axis in 0..3 {
            let sway = self.correlation.sway_m2[axis];
            if sway == 0.0 || n == 0 {
                continue;
            }
            // Covariance 1 + (S/σ²) 1ᵀ1 per row: the square root of its inverse takes this share of the mean off.
            let sd = self.marker_sd[axis];
            let off = 1.0 - (1.0 + n as f64 * sway * SWAY_FRAMES / (sd * sd)).sqrt().recip();
            for mut column in rows.column_iter_mut() {
                let mean = (0..n).map(|i| column[3 * i + axis]).sum::<f64>() / n as f64;
                (0..n).for_each(|i| column[3 * i + axis] -= off * mean);
            }
        }
    }
}

/// Columns `[J | value]` of the markers of one frame in the camera's view, in metres: `u` holds displacements and their
/// derivatives (value first) of all markers.
fn turned(u: &DMatrix<f64>, turn: &[[Dual; 3]; 3], frame: &Frame, out: &mut DMatrix<f64>) {
    let fitted = u.ncols() - 1;
    // Derivatives of the camera's matrix: column, parameter, value.
    let turning: [Vec<(usize, usize, f64)>; 3] = [0, 1, 2].map(|axis: usize| {
        let by = |k: usize| gradient(&turn[axis][k], fitted);
        let all = (0..3).flat_map(|k| by(k).iter().enumerate().map(|(j, s)| (k, j, *s)).collect::<Vec<_>>());
        all.filter(|(.., slope)| *slope != 0.0).collect()
    });
    for (n, (marker, _)) in frame.seen.iter().enumerate() {
        let own = u.fixed_rows::<3>(3 * marker);
        for axis in 0..3 {
            let row = 3 * n + axis;
            for k in 0..3 {
                let t = turn[axis][k].re;
                out[(row, fitted)] += t * own[(k, 0)];
                for j in 0..fitted {
                    out[(row, j)] += t * own[(k, 1 + j)];
                }
            }
            for &(k, j, slope) in &turning[axis] {
                out[(row, j)] += slope * own[(k, 0)];
            }
        }
    }
}

/// Frames over which the camera's sway is taken to last.
const SWAY_FRAMES: f64 = 20.0;
