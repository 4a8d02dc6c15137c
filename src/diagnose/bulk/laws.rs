//! The constants of a body that is alike everywhere, and their derivatives: Poisson's ratio and a stiffer axis.
//!
//! `D = λ(ν) 1⊗1 + 2 μ(ν) I + c (a⊗a)⊗(a⊗a)` over the modulus, `c = modulus_ratio − 1`: under a plain stretch along `a`
//! the modulus is `1 + c` (the catalogue's definition; the lateral strain is that of the isotropic body).

use crate::fem::Constants;
use crate::geometry::{Mat3, Vec3, basis_from_axis};

/// A stiffer axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Along {
    direction: Vec3,
    /// Its derivatives by the two tilts.
    tilted: [Vec3; 2],
    /// `1 + c`.
    ratio: f64,
}

impl Along {
    /// Along `axis`, tilted by two small angles (as tangents).
    pub(super) fn new(axis: [f64; 3], tilt: [f64; 2], ratio: f64) -> Self {
        let basis = basis_from_axis(&Vec3::from(axis).normalize());
        let [s, t, n] = [0, 1, 2].map(|i| basis.column(i).into_owned());
        let long = n + s * tilt[0] + t * tilt[1];
        let direction = long.normalize();
        let tilted = [s, t].map(|s| (s - direction * direction.dot(&s)) / long.norm());
        Self { direction, tilted, ratio }
    }

    /// Unit vector.
    pub(super) fn direction(&self) -> Vec3 {
        self.direction
    }

    /// Derivatives of the unit vector by the two tilts.
    pub(super) fn tilted(&self) -> [Vec3; 2] {
        self.tilted
    }

    fn dyad(&self) -> Mat3 {
        self.direction * self.direction.transpose()
    }
}

/// The constants of the whole body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Law {
    pub poisson_ratio: f64,
    pub along: Option<Along>,
}

impl Law {
    pub(super) fn constants(&self) -> Constants {
        let mut all = Constants::isotropic(self.poisson_ratio);
        all.dyads.extend(self.along.map(|a| (a.ratio - 1.0, a.dyad(), a.dyad())));
        all
    }

    /// By Poisson's ratio.
    pub(super) fn by_poisson_ratio(&self) -> Constants {
        let nu = self.poisson_ratio;
        let lambda = (1.0 + 2.0 * nu * nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)).powi(2);
        Constants { lambda, mu: -0.5 / (1.0 + nu).powi(2), dyads: Vec::new() }
    }

    /// By the logarithm of the ratio.
    pub(super) fn by_log_ratio(&self) -> Constants {
        let dyads = self.along.map(|a| (a.ratio, a.dyad(), a.dyad())).into_iter().collect();
        Constants { lambda: 0.0, mu: 0.0, dyads }
    }

    /// By a tilt of the axis.
    pub(super) fn by_tilt(&self, which: usize) -> Constants {
        let mut dyads = Vec::new();
        if let Some(a) = self.along {
            let turned =
                a.direction * a.tilted[which].transpose() + a.tilted[which] * a.direction.transpose();
            dyads = vec![(a.ratio - 1.0, a.dyad(), turned), (a.ratio - 1.0, turned, a.dyad())];
        }
        Constants { lambda: 0.0, mu: 0.0, dyads }
    }
}

/// What a ball of so many times the modulus does to the stiffness, seen from fields that do not know of it: constants of a
/// homogeneous change, volumetric and deviatoric part each less than `ratio − 1` as the ball screens itself.
///
/// Eshelby (1957): a ball in an unbounded body of the same Poisson's ratio under a uniform strain changes the energy as
/// `(ratio − 1) / (1 + α (ratio − 1))` times its undisturbed volumetric energy and `(ratio − 1) / (1 + β (ratio − 1))`
/// times its deviatoric one, `α = (1 + ν) / (3 (1 − ν))`, `β = 2 (4 − 5ν) / (15 (1 − ν))`.
pub(super) fn screened(ratio: f64, poisson_ratio: f64) -> Constants {
    let (nu, less) = (poisson_ratio, ratio - 1.0);
    let alpha = (1.0 + nu) / (3.0 * (1.0 - nu));
    let beta = deviatoric(nu);
    let bulk = less / (1.0 + alpha * less) / (3.0 * (1.0 - 2.0 * nu));
    let mu = less / (1.0 + beta * less) * 0.5 / (1.0 + nu);
    Constants { lambda: bulk - 2.0 / 3.0 * mu, mu, dyads: Vec::new() }
}

/// Eshelby's `β`: how much of a ball's strain its surroundings take back, for a change of shape.
pub(super) fn deviatoric(poisson_ratio: f64) -> f64 {
    2.0 * (4.0 - 5.0 * poisson_ratio) / (15.0 * (1.0 - poisson_ratio))
}
