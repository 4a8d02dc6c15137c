//! Is the Jacobian of the inverse problem the derivative of its residual: every parameter, by stage and by wrench,
//! with weight and without, against central differences.

use super::small::{body, problem, recording};
use nalgebra::DVector;
use phantom_rig::geometry::Vec3;
use phantom_rig::inverse::{Driven, Evidence, Linearised, Parameter, Problem, Restraint, State};
use phantom_rig::observation::{Contact, Tip, TipShape};

/// Springs through one patch, and a soft glued spot: both kinds of restraint.
fn state() -> State {
    let patch = |x: f64, y: f64, softness: f64, glued: bool| Restraint {
        centre: Vec3::new(x, y, 0.0),
        radius_m: 0.004,
        softness,
        glued,
    };
    State {
        modulus: 9.3e3,
        patches: vec![patch(0.033, 0.014, 150.0, false), patch(0.047, 0.034, 20.0, true)],
    }
}

fn residual(problem: &Problem<'_>, state: &State) -> DVector<f64> {
    let mounted = problem.mount(&state.patches).expect("on the surface");
    problem.residual(&mounted, state.modulus).expect("positive definite")
}

/// Relative distance of the Jacobian's column from the central difference of the residual (with its sign).
fn gap(problem: &Problem<'_>, at: &Linearised, column: usize, step: f64) -> f64 {
    let mut by = DVector::zeros(at.parameters.len());
    by[column] = step;
    let forth = residual(problem, &problem.moved(at, &by).state);
    let back = residual(problem, &problem.moved(at, &-by).state);
    let difference = (back - forth) / (2.0 * step);
    (at.jacobian.column(column) - &difference).norm() / difference.norm()
}

/// Moduli and softness: exact but for the difference's own error, `step²`. Places: the elements under a disc do
/// not move with it, and what its own near field leaves to them is evaluated by reciprocity, so that a shift's column
/// agrees to the discretisation's accuracy only, up to two per cent of the force where the mesh is this coarse. A Gauss–Newton step needs
/// no better.
#[test]
fn every_column_is_the_derivative_of_the_residual() {
    let tip = |shape, contact| Tip { shape, contact };
    let pad = tip(TipShape::Pad, Contact::Bonded);
    let flat = tip(TipShape::Flat, Contact::Bonded);
    let mut cases = Vec::new();
    for heavy in [false, true] {
        cases.extend([(Driven::ByStage, heavy, pad), (Driven::ByWrench, heavy, pad)]);
        cases.push((Driven::ByStage, heavy, flat));
    }
    for shape in [TipShape::Pad, TipShape::Flat, TipShape::Sphere { radius_m: 0.006 }] {
        cases.push((Driven::ByStage, false, tip(shape, Contact::Unilateral)));
    }
    cases.push((Driven::ByStage, false, tip(TipShape::Sphere { radius_m: 0.006 }, Contact::Bonded)));
    for (driven, heavy, tip) in cases {
        let case = format!("{driven:?}, heavy {heavy}, {tip:?}");
        let recording = recording(body(), heavy, tip);
        let evidence = Evidence::new(&recording, Some(driven)).expect("a stage and a wrench");
        let problem = problem(&recording, &evidence);
        let at = problem.linearise(&state()).expect("sound");
        let shifts = at.parameters.iter().filter(|p| matches!(p, Parameter::Shift(..))).count();
        assert_eq!((at.parameters.len(), shifts), (8, 4));
        for (column, parameter) in at.parameters.iter().enumerate() {
            let (step, tolerance) = match parameter {
                Parameter::Shift(..) => (2e-4, 0.025),
                Parameter::LogRadius(_) => (2e-2, 0.025),
                Parameter::LogModulus | Parameter::LogSoftness(_) => (1e-3, 1e-4),
            };
            let gap = gap(&problem, &at, column, step);
            println!("{case}, {parameter:?}: {gap:.1e}");
            assert!(gap < tolerance, "{case}, {parameter:?}: {gap:.1e}");
        }
    }
}
