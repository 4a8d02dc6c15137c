//! A round region with a soft rim: distance from its centre → share of the place that belongs to it, with derivatives.
//!
//! The share falls from 1 to 0 across a rim of a fixed share of the radius, `w = ½ + (15/16)(t − ⅔ t³ + ⅕ t⁵)`,
//! `t = (â − ρ) / (δ â)` in [−1, 1]: the mean of sharp regions with radii spread by the kernel `(15/16)(1 − τ²)²`, whose
//! variance is 1/7. Their mean volume is `4/3 π â³ (1 + 3 δ²/7)`, their mean area `π â² (1 + δ²/7)`, so that `â` is
//! chosen to keep volume or area exact. Why soft: what a region does to the elements is then a smooth function of its
//! place and size, with derivatives by quadrature.

/// Half the rim's width over the radius, `δ`.
const SOFT: f64 = 0.25;

/// A soft-rimmed ball or disc.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rim {
    /// `â` (m).
    edge: f64,
    /// `dâ/da`.
    rate: f64,
}

/// Share of a place with its derivatives by the distance from the centre and by the radius (1/m).
#[derive(Debug, Clone, Copy)]
pub(super) struct Share {
    pub share: f64,
    pub by_distance: f64,
    pub by_radius: f64,
}

impl Rim {
    /// Of a ball with the volume of a sharp one of this radius (m).
    pub(super) fn of_ball(radius_m: f64) -> Self {
        Self::scaled(radius_m, (1.0 + 3.0 * SOFT * SOFT / 7.0).cbrt())
    }

    /// Of a disc with the area of a sharp one of this radius (m).
    pub(super) fn of_disc(radius_m: f64) -> Self {
        Self::scaled(radius_m, (1.0 + SOFT * SOFT / 7.0).sqrt())
    }

    fn scaled(radius_m: f64, by: f64) -> Self {
        Self { edge: radius_m / by, rate: 1.0 / by }
    }

    /// Beyond this distance (m) nothing belongs to it.
    pub(super) fn reach(&self) -> f64 {
        self.edge * (1.0 + SOFT)
    }

    /// Within this distance (m) everything does.
    pub(super) fn core(&self) -> f64 {
        self.edge * (1.0 - SOFT)
    }

    /// Half the rim's width (m).
    pub(super) fn width(&self) -> f64 {
        self.edge * SOFT
    }

    /// At a distance from the centre (m).
    pub(super) fn at(&self, distance: f64) -> Share {
        let t = (self.edge - distance) / (SOFT * self.edge);
        if t >= 1.0 || t <= -1.0 {
            return Share { share: if t > 0.0 { 1.0 } else { 0.0 }, by_distance: 0.0, by_radius: 0.0 };
        }
        let share = 0.5 + 15.0 / 16.0 * (t - 2.0 / 3.0 * t.powi(3) + 0.2 * t.powi(5));
        let slope = 15.0 / 16.0 * (1.0 - t * t).powi(2) / (SOFT * self.edge);
        Share { share, by_distance: -slope, by_radius: slope * distance / self.edge * self.rate }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume and area are those of the sharp region; derivatives are those of the share.
    #[test]
    fn the_size_is_exact_and_the_slopes_are_right() {
        let radius = 0.009;
        let sum = |rim: Rim, power: i32| -> f64 {
            let (n, step) = (20_000, rim.reach() / 20_000.0);
            (0..n).map(|i| (f64::from(i) + 0.5) * step).map(|r| rim.at(r).share * r.powi(power) * step).sum()
        };
        assert!((3.0 * sum(Rim::of_ball(radius), 2) / radius.powi(3) - 1.0).abs() < 1e-7);
        assert!((2.0 * sum(Rim::of_disc(radius), 1) / radius.powi(2) - 1.0).abs() < 1e-7);
        let h = 1e-7;
        for distance in [0.0, 0.0071, 0.009, 0.0104, 0.02] {
            let at = |d: f64, a: f64| Rim::of_ball(a).at(d).share;
            let exact = Rim::of_ball(radius).at(distance);
            let by_distance = (at(distance + h, radius) - at(distance - h, radius)) / (2.0 * h);
            let by_radius = (at(distance, radius + h) - at(distance, radius - h)) / (2.0 * h);
            assert!(
                (exact.by_distance - by_distance).abs() < 1e-3 && (exact.by_radius - by_radius).abs() < 1e-3
            );
        }
    }
}
