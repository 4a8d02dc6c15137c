//! Steps of patches that have come to the rim of the search surface: from there they go along it.
//!
//! A patch that wants beyond the rim is brought back to it. What its step promised beyond is not had then, and the other parameters have answered
//! to a step that was not taken; damped until they hardly move, they creep. So the step is sought anew with that patch given where it can go
//! (an active set, Nocedal and Wright 2006, section 16.5).

use super::problem::{Linearised, Moved, Parameter};
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector};

/// Orthonormal directions in the parameters, and how far the step goes along each.
#[derive(Debug, Default)]
pub(super) struct Given(Vec<(DVector<f64>, f64)>);

/// What is left of a direction beside those that are given already, or of one across the surface, from where on it is another.
const ANOTHER: f64 = 0.1;

/// Who comes short by less than this (m) does so by rounding.
const ROUNDING_M: f64 = 1e-9;

impl Given {
    /// Gives patches that could not go where a step wanted them the way that they went. Whether any was not given yet.
    pub(super) fn take(&mut self, at: &Linearised, moved: &Moved) -> bool {
        let before = self.0.len();
        for &(patch, short) in moved.held_back.iter().filter(|(_, short)| short.norm() > ROUNDING_M) {
            let along = |way: &Vec3| {
                let of = |parameter: &Parameter| match parameter {
                    Parameter::Shift(p, tangent) if *p == patch => tangent.dot(way),
                    _ => 0.0,
                };
                DVector::from_iterator(at.parameters.len(), at.parameters.iter().map(of))
            };
            let went = along(&(moved.state.patches[patch].centre - at.state.patches[patch].centre));
            self.add(along(&short.normalize()), &went);
        }
        self.0.len() > before
    }

    /// One direction more, as far as `went` does.
    fn add(&mut self, mut direction: DVector<f64>, went: &DVector<f64>) {
        for (given, _) in &self.0 {
            direction -= given * given.dot(&direction);
        }
        if let Some(direction) = direction.try_normalize(ANOTHER) {
            let far = direction.dot(went);
            self.0.push((direction, far));
        }
    }

    /// The least of `xᵀ N x − 2 gᵀ x + xᵀ D x` with what is given; the damping `D` is diagonal and holds what is free back. `None` where that is
    /// not positive definite.
    pub(super) fn least(
        &self,
        normal: &DMatrix<f64>,
        gradient: &DVector<f64>,
        damping: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let mut given = DVector::zeros(gradient.len());
        self.0.iter().for_each(|(direction, far)| given.axpy(*far, direction, 1.0));
        let mut free = DMatrix::identity(gradient.len(), gradient.len());
        self.0.iter().for_each(|(direction, _)| free.ger(-1.0, direction, direction, 1.0));
        let mut matrix = &free * (normal + DMatrix::from_diagonal(damping)) * &free;
        // Any positive number: along what is given the right-hand side is zero.
        let scale = damping.max();
        self.0.iter().for_each(|(direction, _)| matrix.ger(scale, direction, direction, 1.0));
        let right = &free * (gradient - normal * &given);
        Some(given + &free * matrix.cholesky()?.solve(&right))
    }
}

#[cfg(test)]
mod tests {
    use super::super::blocks::Blocks;
    use super::super::forward::Prediction;
    use super::super::problem::State;
    use super::super::restraint::{Mounted, Restraint};
    use super::*;

    /// A patch half a millimetre from a rim, and a step of a millimetre across it and two along: it comes as far as the rim, and the step along it
    /// is sought anew. On the rim it stays there.
    #[test]
    fn a_patch_goes_to_the_rim_and_along_it() {
        let patch = |x: f64, y: f64| Restraint {
            centre: Vec3::new(x, y, 0.0),
            radius_m: 0.005,
            softness: 10.0,
            glued: false,
        };
        let state = |x, y| State { modulus: 1e4, patches: vec![patch(x, y)] };
        let at = |x: f64| Linearised {
            state: state(x, 0.0),
            mounted: Mounted { discs: Vec::new(), groups: Vec::new(), blocks: Blocks::default() },
            prediction: Prediction { sites: Vec::new() },
            residual: DVector::zeros(0),
            jacobian: DMatrix::zeros(0, 3),
            parameters: vec![
                Parameter::LogModulus,
                Parameter::Shift(0, Vec3::x()),
                Parameter::Shift(0, Vec3::y()),
            ],
            unrest: 0.0,
            unsettled: None,
        };
        let moved =
            |over: f64| Moved { state: state(0.0, 2e-3), held_back: vec![(0, Vec3::new(over, 0.0, 0.0))] };
        for (x, over) in [(-5e-4, 5e-4), (0.0, 1e-3)] {
            let mut given = Given::default();
            assert!(given.take(&at(x), &moved(over)) && !given.take(&at(x), &moved(over)), "{x}");
            let step =
                given.least(&normal(), &DVector::from_element(3, 1.0), &DVector::from_element(3, 1e-9));
            let step = step.expect("a step");
            assert!((step[1] + x).abs() < 1e-12 && step[2].abs() > 0.1, "{x}: {step}");
        }
        assert!(!Given::default().take(&at(0.0), &moved(1e-12)), "short by rounding only");
        assert!(!Given::default().take(&at(0.0), &Moved { state: state(0.0, 2e-3), held_back: Vec::new() }));
    }

    fn normal() -> DMatrix<f64> {
        DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 0.5, 1.0, 3.0, -0.7, 0.5, -0.7, 2.0])
    }

    /// With nothing given, what the normal equations say; with one direction given, no other step that has it is lower.
    #[test]
    fn the_step_is_the_least_that_has_what_is_given() {
        let (normal, gradient) = (normal(), DVector::from_vec(vec![1.0, -2.0, 0.3]));
        let damping = DVector::from_vec(vec![0.1, 0.2, 0.05]);
        let cost =
            |x: &DVector<f64>| (&normal * x).dot(x) - 2.0 * gradient.dot(x) + damping.component_mul(x).dot(x);
        let mut given = Given::default();
        let whole = given.least(&normal, &gradient, &damping).expect("a step");
        let residual = (&normal + DMatrix::from_diagonal(&damping)) * &whole - &gradient;
        assert!(residual.norm() < 1e-12, "{residual}");
        let direction = DVector::from_vec(vec![0.6, 0.8, 0.0]);
        given.add(direction.clone(), &DVector::from_vec(vec![0.3, 0.4, 9.0]));
        // Without damping of what is given, which is no choice.
        let step = given.least(&normal, &gradient, &DVector::from_element(3, 1e-12)).expect("a step");
        assert!((direction.dot(&step) - 0.5).abs() < 1e-12);
        let undamped = |x: &DVector<f64>| cost(x) - damping.component_mul(x).dot(x);
        for other in [[0.8, -0.6, 0.0], [0.0, 0.0, 1.0], [0.8, -0.6, 1.0]] {
            for share in [-1e-3, 1e-3] {
                let other = &step + DVector::from_row_slice(&other) * share;
                assert!(undamped(&other) > undamped(&step), "{other}");
            }
        }
    }

    /// In a corner a patch stays; a third direction of its own there is not.
    #[test]
    fn directions_are_given_once() {
        let mut given = Given::default();
        let went = DVector::from_vec(vec![0.0, 0.0, 0.0]);
        for direction in [[1.0, 0.0, 0.0], [1.0, 0.02, 0.0], [0.7, 0.7, 0.0], [0.0, 1.0, 0.0]] {
            given.add(DVector::from_row_slice(&direction), &went);
        }
        assert_eq!(given.0.len(), 2);
        let step = given.least(&normal(), &DVector::from_element(3, 1.0), &DVector::from_element(3, 1e-9));
        let step = step.expect("a step");
        assert!(step[0].abs() < 1e-12 && step[1].abs() < 1e-12 && (step[2] - 0.5).abs() < 1e-8, "{step}");
    }
}
