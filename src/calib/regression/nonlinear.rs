//! Which parameters p minimise Σ r(p)²? Levenberg and Marquardt's method in a trusted region, after Moré (1978).
//!
//! The region |D s| ≤ Δ has the scale D of the greatest column lengths of J so far. A step is taken where it lowers Σ r² by at least 1e-4 of what
//! the linear model promises; Δ grows or shrinks by how good the promise was. Parameters on a bound that would leave it are held for the step.
//! Close to a minimum Σ r² changes less than its own rounding: there whole steps are taken as long as they lower |Qᵀr|, the part of the residual
//! that the parameters reach. The search ends at a minimum (see `offset`), and says so where it ends elsewhere.

use super::RegressionError;
use super::model::{Model, Options, Regression, Termination};
use super::offset::{is_minimum, is_rounding};
use super::trust::Triangle;
use nalgebra::{DMatrix, DVector};

/// Share of the promise from which a step is taken.
const TAKEN: f64 = 1e-4;
/// Promise over Σ r² from which rounding hides whether it was kept.
const HIDDEN: f64 = 1e-10;
/// A whole step must lower |Qᵀr|² to this share to be one of the last ones.
const LOWERED: f64 = 0.5;
/// A radius this small beside the parameters cannot change them.
const SMALLEST: f64 = 1e-17;

/// Fits from `start`.
///
/// # Errors
/// [`RegressionError`]: too few values, bounds of another length, a start out of them.
pub fn fit(model: &impl Model, start: &[f64], options: &Options) -> Result<Regression, RegressionError> {
    Search::new(model, start, options)?.run()
}

struct Search<'a, M: Model> {
    model: &'a M,
    options: &'a Options,
    at: DVector<f64>,
    residuals: DVector<f64>,
    squares: f64,
    scale: DVector<f64>,
    steps: usize,
}

impl<'a, M: Model> Search<'a, M> {
    fn new(model: &'a M, start: &[f64], options: &'a Options) -> Result<Self, RegressionError> {
        let p = start.len();
        if !options.bounds.is_empty() && options.bounds.len() != p {
            return Err(RegressionError::Length {
                what: "the bounds",
                found: options.bounds.len(),
                expected: p,
            });
        }
        for (index, (start, [low, high])) in start.iter().zip(&options.bounds).enumerate() {
            if !(low..=high).contains(&start) {
                return Err(RegressionError::OutOfBounds { index, start: *start, low: *low, high: *high });
            }
        }
        let residuals = model.residuals(start).unwrap_or_else(|| DVector::from_element(p, f64::NAN));
        if p == 0 || residuals.len() < p {
            return Err(RegressionError::TooFew { values: residuals.len(), parameters: p });
        }
        let squares = residuals.norm_squared();
        let at = DVector::from_column_slice(start);
        Ok(Self { model, options, at, residuals, squares, scale: DVector::zeros(p), steps: 0 })
    }

    fn run(mut self) -> Result<Regression, RegressionError> {
        let p = self.at.len();
        let mut radius = None;
        let termination = loop {
            if !self.squares.is_finite() {
                break Termination::NoStart;
            }
            let Some(jacobian) = self.model.jacobian(self.at.as_slice()) else { break Termination::NoStart };
            if jacobian.iter().any(|v| !v.is_finite()) {
                break if self.steps == 0 { Termination::NoStart } else { Termination::Stagnated };
            }
            for j in 0..p {
                let length = jacobian.column(j).norm();
                self.scale[j] = self.scale[j].max(length);
            }
            let scale = self.scale.map(|s| if s > 0.0 { s } else { 1.0 });
            let free = self.free(&self.at, &self.residuals, &jacobian);
            let columns = jacobian.select_columns(&free);
            let free_scale = scale.select_rows(&free);
            if free.is_empty() {
                break Termination::Minimum;
            }
            let triangle = Triangle::new(&columns, &self.residuals, &free_scale);
            if is_minimum(
                triangle.reached(),
                self.squares,
                self.residuals.len(),
                free.len(),
                self.options.offset,
            ) {
                break Termination::Minimum;
            }
            let length = scale.component_mul(&self.at).norm();
            let mut delta = radius.unwrap_or(self.options.radius * if length > 0.0 { length } else { 1.0 });
            let moved = loop {
                if self.steps >= self.options.steps {
                    break None;
                }
                self.steps += 1;
                let Some((step, step_length, promise)) = triangle.within(delta) else { break Some(false) };
                let next = self.placed(&free, &step);
                let residuals = self.model.residuals(next.as_slice());
                let squares = residuals.as_ref().map_or(f64::NAN, |r| r.norm_squared());
                let ratio = if promise > 0.0 { (self.squares - squares) / promise } else { 0.0 };
                if !ratio.is_finite() || ratio < 0.25 {
                    delta = 0.25 * delta.min(step_length);
                } else if ratio > 0.75 && step_length >= 0.9 * delta {
                    delta *= 2.0;
                }
                if ratio >= TAKEN
                    && squares < self.squares
                    && let Some(residuals) = residuals
                {
                    (self.at, self.residuals, self.squares) = (next, residuals, squares);
                    break Some(true);
                }
                if delta <= SMALLEST * length.max(f64::MIN_POSITIVE) {
                    break Some(false);
                }
            };
            radius = Some(delta);
            match moved {
                None => break Termination::StepsUsedUp,
                Some(true) => {}
                Some(false) => break Termination::Stagnated,
            }
        };
        let termination = match termination {
            Termination::Minimum | Termination::Stagnated => self.polish(termination),
            other => other,
        };
        Ok(self.closed(termination))
    }

    /// Jacobian, free parameters and triangle of a place.
    fn reduce(&self, at: &DVector<f64>, residuals: &DVector<f64>) -> Option<(Vec<usize>, Triangle)> {
        let jacobian = self.model.jacobian(at.as_slice()).filter(|j| j.iter().all(|v| v.is_finite()))?;
        let free = self.free(at, residuals, &jacobian);
        let columns = jacobian.select_columns(&free);
        let lengths = DVector::from_iterator(
            free.len(),
            columns.column_iter().map(|c| c.norm()).map(|l| if l > 0.0 { l } else { 1.0 }),
        );
        (!free.is_empty()).then(|| (free, Triangle::new(&columns, residuals, &lengths)))
    }

    /// Whole steps where rounding hides what they do to Σ r²; whether the end is a minimum.
    fn polish(&mut self, so_far: Termination) -> Termination {
        let Some((mut free, mut triangle)) = self.reduce(&self.at, &self.residuals) else { return so_far };
        while triangle.reached() > 0.0 && triangle.reached() <= HIDDEN * self.squares {
            let Some(step) = triangle.whole() else { break };
            let next = self.placed(&free, &triangle.in_parameters(&step));
            let Some(residuals) = self.model.residuals(next.as_slice()) else { break };
            let Some((next_free, next_triangle)) = self.reduce(&next, &residuals) else { break };
            let squares = residuals.norm_squared();
            let higher = squares > (1.0 + HIDDEN) * self.squares;
            // Not a number is no lower.
            let lower = next_triangle.reached() <= LOWERED * triangle.reached();
            if higher || next_free != free || !lower {
                break;
            }
            (self.at, self.residuals, self.squares) = (next, residuals, squares);
            (free, triangle) = (next_free, next_triangle);
        }
        if is_minimum(triangle.reached(), self.squares, self.residuals.len(), free.len(), self.options.offset)
        {
            return Termination::Minimum;
        }
        let at = self.at.select_rows(&free);
        match triangle.whole() {
            Some(s) if is_rounding(triangle.in_parameters(&s).as_slice(), at.as_slice()) => {
                Termination::Rounding
            }
            _ => Termination::Stagnated,
        }
    }

    /// Parameters that are not held: at a bound that lower Σ r² would push them through, or without any say at this place.
    fn free(&self, at: &DVector<f64>, residuals: &DVector<f64>, jacobian: &DMatrix<f64>) -> Vec<usize> {
        let gradient = jacobian.tr_mul(residuals);
        (0..at.len())
            .filter(|&j| {
                if jacobian.column(j).iter().all(|v| *v == 0.0) {
                    return false;
                }
                let Some([low, high]) = self.options.bounds.get(j) else { return true };
                !(at[j] <= *low && gradient[j] >= 0.0 || at[j] >= *high && gradient[j] <= 0.0)
            })
            .collect()
    }

    fn placed(&self, free: &[usize], step: &DVector<f64>) -> DVector<f64> {
        let mut next = self.at.clone();
        for (&j, s) in free.iter().zip(step.iter()) {
            next[j] += s;
            if let Some([low, high]) = self.options.bounds.get(j) {
                next[j] = next[j].clamp(*low, *high);
            }
        }
        next
    }

    fn closed(self, termination: Termination) -> Regression {
        let (p, n) = (self.at.len(), self.residuals.len());
        let at_bound: Vec<bool> = (0..p)
            .map(|j| self.options.bounds.get(j).is_some_and(|b| self.at[j] <= b[0] || self.at[j] >= b[1]))
            .collect();
        let mut free: Vec<usize> = (0..p).filter(|j| !at_bound[*j]).collect();
        let variance = if n > free.len() { self.squares / (n - free.len()) as f64 } else { 0.0 };
        let mut covariance = DMatrix::zeros(p, p);
        if let Some(jacobian) =
            self.model.jacobian(self.at.as_slice()).filter(|j| j.iter().all(|v| v.is_finite()))
        {
            // What has no say at this place is open; it leaves the others as they are.
            let (said, open) = free.iter().partition(|j| jacobian.column(**j).iter().any(|v| *v != 0.0));
            free = said;
            let open: Vec<usize> = open;
            open.iter().for_each(|j| covariance[(*j, *j)] = f64::NAN);
            let columns = jacobian.select_columns(&free);
            let lengths = DVector::from_iterator(
                free.len(),
                columns.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)),
            );
            let inverse =
                (!free.is_empty()).then(|| Triangle::new(&columns, &self.residuals, &lengths).inverse());
            for (a, &i) in free.iter().enumerate() {
                for (b, &j) in free.iter().enumerate() {
                    covariance[(i, j)] = match &inverse {
                        Some(Some(inverse)) => variance * inverse.row(a).dot(&inverse.row(b)),
                        _ => f64::NAN,
                    };
                }
            }
        }
        Regression {
            sd: (0..p).map(|i| covariance[(i, i)].sqrt()).collect(),
            parameters: self.at.as_slice().to_vec(),
            covariance,
            squares: self.squares,
            values: n,
            steps: self.steps,
            termination,
            at_bound,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y = p x, on lists.
    struct Line([f64; 3], [f64; 3]);

    impl Model for Line {
        fn residuals(&self, p: &[f64]) -> Option<DVector<f64>> {
            Some(DVector::from_iterator(3, self.0.iter().zip(&self.1).map(|(x, y)| y - p[0] * x)))
        }

        fn jacobian(&self, _: &[f64]) -> Option<DMatrix<f64>> {
            Some(-DMatrix::from_column_slice(3, 1, &self.0))
        }
    }

    /// What is left is at right angles to the model to the last bit: the search must see that it has nothing more to do.
    #[test]
    fn a_residual_that_the_parameter_cannot_reach_at_all_ends_the_search() {
        let line = Line([1.0, 0.0, 0.0], [2.0, 1.0, 0.0]);
        let found = fit(&line, &[1.0], &Options::default()).expect("sound");
        assert_eq!((found.termination, found.parameters[0]), (Termination::Minimum, 2.0));
    }

    #[test]
    fn a_bound_is_kept_and_named() {
        let line = Line([1.0, 2.0, 3.0], [2.0, 4.0, 6.1]);
        let options = Options { bounds: vec![[0.0, 1.5]], ..Options::default() };
        let found = fit(&line, &[1.0], &options).expect("sound");
        assert!(found.termination.is_answer() && found.at_bound == [true] && found.parameters[0] == 1.5);
        assert!(matches!(fit(&line, &[2.0], &options), Err(RegressionError::OutOfBounds { .. })));
    }
}
