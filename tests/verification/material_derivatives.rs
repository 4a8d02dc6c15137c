//! Each law's stress is the derivative of its energy, its tangent the derivative of its stress, its
//! sensitivities the derivatives by its parameters; and it has the symmetries that mechanics demands.

use nalgebra::{Rotation3, Vector3};
use phantom_rig::fem::material::{Law, Material, MaterialError, Moduli, Parameter};
use phantom_rig::geometry::Mat3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const YOUNG: f64 = 1.0e4;
const POISSON: f64 = 0.47;

const LAWS: [Law; 7] = [
    Law::Linear,
    Law::NeoHookean,
    Law::Yeoh { stiffening: 0.0 },
    Law::Yeoh { stiffening: 1.7 },
    Law::Fung { stiffening: 0.0 },
    Law::Fung { stiffening: 1e-9 },
    Law::Fung { stiffening: 1.3 },
];

fn material(law: Law) -> Material {
    Material::new(Moduli::new(YOUNG, POISSON).expect("a proper solid"), law).expect("a proper law")
}

fn random(rng: &mut ChaCha8Rng, size: f64) -> Mat3 {
    Mat3::from_fn(|_, _| size * rng.random_range(-1.0..1.0))
}

/// Gradients from small to large, none inverted.
fn states() -> Vec<(Mat3, Mat3)> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut states = Vec::new();
    while states.len() < 40 {
        let h = random(&mut rng, [0.01, 0.1, 0.3, 0.6][states.len() % 4]);
        if (Mat3::identity() + h).determinant() > 0.3 {
            states.push((h, random(&mut rng, 1.0)));
        }
    }
    states
}

/// What a linear map of one gradient gives, as the tangent stores it.
fn apply(tangent: &nalgebra::SMatrix<f64, 9, 9>, h: &Mat3) -> Mat3 {
    Mat3::from_fn(|i, j| (0..9).map(|c| tangent[(3 * i + j, c)] * h[(c / 3, c % 3)]).sum())
}

/// Halving the step must quarter the remainder of a first-order Taylor expansion. Remainders at the level
/// of rounding are no evidence and pass.
fn assert_second_order(what: &str, floor: f64, remainder: impl Fn(f64) -> f64) {
    let (coarse, fine) = (remainder(2e-4), remainder(1e-4));
    let order = (coarse / fine).log2();
    assert!(
        fine < floor || (order - 2.0).abs() < 0.1,
        "{what}: remainders {coarse:e}, {fine:e}, order {order}"
    );
}

#[test]
fn stress_is_the_derivative_of_the_energy() {
    for law in LAWS {
        let m = material(law);
        for (h, d) in states() {
            let (energy, stress) = m.stress(&h).expect("not inverted");
            assert_eq!(energy, m.energy(&h).expect("not inverted"));
            assert_second_order(&format!("{law:?}"), 1e-11 * YOUNG, |t| {
                (m.energy(&(h + t * d)).expect("not inverted") - energy - t * stress.dot(&d)).abs()
            });
        }
    }
}

#[test]
fn tangent_is_the_derivative_of_the_stress() {
    for law in LAWS {
        let m = material(law);
        for (h, d) in states() {
            let at = m.response(&h).expect("not inverted");
            let (energy, stress) = m.stress(&h).expect("not inverted");
            assert_eq!(energy, at.energy);
            assert!((stress - at.stress).norm() <= 1e-14 * stress.norm());
            assert_second_order(&format!("{law:?}"), 1e-11 * YOUNG, |t| {
                let moved = m.stress(&(h + t * d)).expect("not inverted").1;
                (moved - at.stress - t * apply(&at.tangent, &d)).norm()
            });
        }
    }
}

/// By central differences in the parameter, whose own error is of second order in the step.
#[test]
fn sensitivities_are_the_derivatives_by_the_parameters() {
    let build = |young: f64, poisson: f64, law: Law| {
        Material::new(Moduli::new(young, poisson).expect("a proper solid"), law).expect("a proper law")
    };
    let stiffer = |law: Law, by: f64| match law {
        Law::Linear | Law::NeoHookean => law,
        Law::Yeoh { stiffening } => Law::Yeoh { stiffening: stiffening + by },
        Law::Fung { stiffening } => Law::Fung { stiffening: stiffening + by },
    };
    for law in LAWS {
        for (h, _) in states() {
            for parameter in [Parameter::YoungModulus, Parameter::PoissonRatio, Parameter::Stiffening] {
                let at = |t: f64| {
                    let m = match parameter {
                        Parameter::YoungModulus => build(YOUNG + t, POISSON, law),
                        Parameter::PoissonRatio => build(YOUNG, POISSON + t, law),
                        Parameter::Stiffening => build(YOUNG, POISSON, stiffer(law, t)),
                    };
                    m.stress(&h).expect("not inverted").1
                };
                let step = if parameter == Parameter::YoungModulus { 1.0 } else { 1e-5 };
                let difference = (at(step) - at(-step)) / (2.0 * step);
                let exact = material(law).stress_sensitivity(&h, parameter).expect("not inverted");
                let scale = difference.norm() + 1e-6 * at(0.0).norm();
                assert!((difference - exact).norm() < 2e-6 * scale, "{law:?} {parameter:?}");
            }
        }
    }
}

#[test]
fn tangent_is_symmetric() {
    for law in LAWS {
        for (h, _) in states() {
            let a = material(law).response(&h).expect("not inverted").tangent;
            assert!((a - a.transpose()).norm() < 1e-14 * a.norm(), "{law:?}");
        }
    }
}

/// W(QF) = W(F) and P(QF) = Q P(F) for every rotation Q; isotropy: W(FQ) = W(F).
#[test]
fn rotations_store_no_energy() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for law in LAWS.into_iter().filter(|&l| l != Law::Linear) {
        let m = material(law);
        for (h, _) in states() {
            let axis = Vector3::from_fn(|_, _| rng.random_range(-3.0..3.0));
            let q = Rotation3::new(axis).into_inner();
            let f = Mat3::identity() + h;
            let (energy, stress) = m.stress(&h).expect("not inverted");
            let (turned_energy, turned) = m.stress(&(q * f - Mat3::identity())).expect("not inverted");
            assert!((turned_energy - energy).abs() < 1e-12 * (energy + YOUNG), "{law:?}");
            assert!((turned - q * stress).norm() < 1e-12 * (stress.norm() + YOUNG), "{law:?}");
            let isotropic = m.energy(&(f * q - Mat3::identity())).expect("not inverted");
            assert!((isotropic - energy).abs() < 1e-12 * (energy + YOUNG), "{law:?}");
        }
    }
}

/// The stress at a gradient of 1e-9 agrees with linear elasticity to a few times the strain: no digits are
/// lost to F = I + H, where the naive formula keeps seven.
#[test]
fn small_strain_is_linear_elasticity_to_every_digit() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for law in LAWS {
        for size in [1e-4, 1e-6, 1e-9, 1e-12] {
            let h = random(&mut rng, size);
            let (energy, stress) = material(law).stress(&h).expect("not inverted");
            let (linear_energy, linear) = material(Law::Linear).stress(&h).expect("always");
            assert!((stress - linear).norm() < (50.0 * size + 1e-13) * linear.norm(), "{law:?} {size}");
            assert!((energy / linear_energy - 1.0).abs() < 50.0 * size + 1e-13, "{law:?} {size}");
        }
        let at_rest = material(law).response(&Mat3::zeros()).expect("at rest");
        let linear = material(Law::Linear).response(&Mat3::zeros()).expect("at rest");
        assert_eq!((at_rest.energy, at_rest.stress), (0.0, Mat3::zeros()));
        assert!((at_rest.tangent - linear.tangent).norm() < 1e-14 * linear.tangent.norm(), "{law:?}");
    }
}

#[test]
fn an_inverted_state_is_an_error_that_carries_its_volume_ratio() {
    let inverted = Mat3::from_diagonal(&Vector3::new(0.0, 0.0, -1.25));
    for law in LAWS.into_iter().filter(|&l| l != Law::Linear) {
        let m = material(law);
        let expected = MaterialError::Inverted { jacobian: -0.25 };
        assert_eq!(m.energy(&inverted), Err(expected));
        assert_eq!(m.response(&inverted), Err(expected));
        assert_eq!(m.stress_sensitivity(&inverted, Parameter::YoungModulus), Err(expected));
    }
}
