//! Homogeneous states with known stress. With h′ = dh/di of each law at i = Ī₁ − 3, the Cauchy stress is
//! σ = μ h′ J^(−5/3) dev(FFᵀ) + κ (J − 1) I, and P = J σ F⁻ᵀ.

use phantom_rig::fem::material::{Law, Material, Moduli};
use phantom_rig::geometry::{Mat3, Vec3};

const LAWS: [Law; 3] = [Law::NeoHookean, Law::Yeoh { stiffening: 0.8 }, Law::Fung { stiffening: 0.6 }];

/// h′ straight from the definitions of the laws.
fn slope(law: Law, i: f64) -> f64 {
    match law {
        Law::Linear | Law::NeoHookean => 1.0,
        Law::Yeoh { stiffening } => 1.0 + 2.0 * stiffening * i,
        Law::Fung { stiffening } => (stiffening * i).exp(),
    }
}

/// The root of a function that rises through zero between `low` and `high`.
fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    assert!(f(low) < 0.0 && f(high) > 0.0, "no sign change between {low} and {high}");
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) > 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

fn cauchy(material: &Material, stretches: Vec3) -> Vec3 {
    let h = Mat3::from_diagonal(&(stretches - Vec3::repeat(1.0)));
    let (_, p) = material.stress(&h).expect("not inverted");
    p.diagonal().component_mul(&stretches) / stretches.product()
}

/// Stretch λ along one axis, β across with no stress across:
/// 0 = ⅓ μ h′ J^(−5/3) (β² − λ²) + κ (J − 1), J = λβ², and along it σ = μ h′ J^(−5/3) (λ² − β²).
#[test]
fn uniaxial_stretch_with_free_sides() {
    for law in LAWS {
        for poisson in [0.3, 0.47, 0.4999] {
            let moduli = Moduli::new(9.0e3, poisson).expect("a proper solid");
            let material = Material::new(moduli, law).expect("a proper law");
            let (mu, kappa) = (moduli.shear(), moduli.bulk());
            for lambda in [0.6_f64, 0.9, 1.0, 1.2, 1.6] {
                let shear = |beta: f64| {
                    let j = lambda * beta * beta;
                    let i = j.powf(-2.0 / 3.0) * (lambda * lambda + 2.0 * beta * beta) - 3.0;
                    mu * slope(law, i) * j.powf(-5.0 / 3.0)
                };
                let beta = root(0.5 / lambda.sqrt(), 2.0 / lambda.sqrt(), |beta| {
                    let lateral = shear(beta) * (beta * beta - lambda * lambda) / 3.0;
                    lateral + kappa * (lambda * beta * beta - 1.0)
                });
                let expected = shear(beta) * (lambda * lambda - beta * beta);
                let sigma = cauchy(&material, Vec3::new(lambda, beta, beta));
                let scale = 1e-11 * kappa;
                assert!(
                    (sigma.x - expected).abs() < scale,
                    "{law:?} {poisson} {lambda}: {sigma:?} {expected}"
                );
                assert!(sigma.y.abs() < scale && sigma.z.abs() < scale);
            }
        }
    }
}

/// Incompressible limit, σ = μ (λ² − 1/λ) (Treloar 1943); the departure is of the order of μ/κ ≈ 1 − 2ν.
#[test]
fn nearly_incompressible_stretch_follows_treloar() {
    let moduli = Moduli::new(9.0e3, 0.499_999).expect("a proper solid");
    let material = Material::new(moduli, Law::NeoHookean).expect("a proper law");
    for lambda in [0.7_f64, 1.3, 2.0] {
        let treloar = moduli.shear() * (lambda * lambda - 1.0 / lambda);
        let beta =
            root(0.8 / lambda.sqrt(), 1.2 / lambda.sqrt(), |b| cauchy(&material, Vec3::new(lambda, b, b)).y);
        let sigma = cauchy(&material, Vec3::new(lambda, beta, beta)).x;
        assert!((sigma / treloar - 1.0).abs() < 2e-5, "{lambda}: {sigma} {treloar}");
    }
}

/// Stretch λ along two axes, β across with no stress across:
/// 0 = ⅔ μ h′ J^(−5/3) (β² − λ²) + κ (J − 1), J = λ²β, and in the plane σ = μ h′ J^(−5/3) (λ² − β²).
#[test]
fn equibiaxial_stretch_with_free_faces() {
    let moduli = Moduli::new(9.0e3, 0.45).expect("a proper solid");
    let (mu, kappa) = (moduli.shear(), moduli.bulk());
    for law in LAWS {
        let material = Material::new(moduli, law).expect("a proper law");
        for lambda in [0.8_f64, 1.1, 1.4] {
            let shear = |beta: f64| {
                let j = lambda * lambda * beta;
                let i = j.powf(-2.0 / 3.0) * (2.0 * lambda * lambda + beta * beta) - 3.0;
                mu * slope(law, i) * j.powf(-5.0 / 3.0)
            };
            let guess = 1.0 / (lambda * lambda);
            let beta = root(0.5 * guess, 2.0 * guess, |beta| {
                2.0 / 3.0 * shear(beta) * (beta * beta - lambda * lambda)
                    + kappa * (lambda * lambda * beta - 1.0)
            });
            let expected = shear(beta) * (lambda * lambda - beta * beta);
            let sigma = cauchy(&material, Vec3::new(lambda, lambda, beta));
            assert!((sigma.x - expected).abs() < 1e-10 * kappa, "{law:?} {lambda}: {sigma:?} {expected}");
            assert!(sigma.z.abs() < 1e-10 * kappa);
        }
    }
}

/// F = I + γ e₁⊗e₂: J = 1, Ī₁ − 3 = γ², σ₁₂ = μ h′ γ, σ₁₁ = ⅔ μ h′ γ², σ₂₂ = σ₃₃ = −⅓ μ h′ γ².
/// Rivlin's universal relation σ₁₁ − σ₂₂ = γ σ₁₂ is contained in it.
#[test]
fn simple_shear() {
    let moduli = Moduli::new(9.0e3, 0.47).expect("a proper solid");
    for law in LAWS {
        let material = Material::new(moduli, law).expect("a proper law");
        for gamma in [1e-6, 0.1, 0.5, -1.2] {
            let mut h = Mat3::zeros();
            h[(0, 1)] = gamma;
            let (_, p) = material.stress(&h).expect("not inverted");
            let sigma = p * (Mat3::identity() + h).transpose();
            let g = moduli.shear() * slope(law, gamma * gamma);
            let square = gamma * gamma * g;
            let expected = Mat3::new(
                2.0 / 3.0 * square,
                g * gamma,
                0.0,
                g * gamma,
                -square / 3.0,
                0.0,
                0.0,
                0.0,
                -square / 3.0,
            );
            assert!((sigma - expected).norm() < 1e-13 * expected.norm(), "{law:?} {gamma}");
        }
    }
}

/// W(J) = κ/2 (J − 1)² in a pure change of volume, whatever the law.
#[test]
fn pure_change_of_volume() {
    let moduli = Moduli::new(9.0e3, 0.47).expect("a proper solid");
    for law in LAWS {
        let material = Material::new(moduli, law).expect("a proper law");
        for lambda in [0.7_f64, 1.0, 1.3] {
            let pressure = moduli.bulk() * (lambda.powi(3) - 1.0);
            let sigma = cauchy(&material, Vec3::repeat(lambda));
            assert!((sigma - Vec3::repeat(pressure)).norm() < 1e-12 * moduli.bulk());
        }
    }
}
