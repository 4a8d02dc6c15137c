//! Is a component a dot: its area, its second moments, and how nearly it is an ellipse.

use super::runs::Run;
use crate::track::DotSettings;
use nalgebra::{Matrix2, Vector2};

/// Moments of the area of a component.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Area (px²).
    pub(super) area: f64,
    /// Centre of area (px).
    pub(super) centre: Vector2<f64>,
    /// Second central moments over the area (px²).
    pub(super) moments: Matrix2<f64>,
}

/// How much of the ellipse with the same moments a dot must fill. A square fills 95 %, two discs that touch 89 %; a small ragged disc of
/// 20 pixels 93 %.
const LEAST_FILL: f64 = 0.85;

impl Shape {
    pub(super) fn of(runs: &[Run]) -> Self {
        let Some(first) = runs.first() else {
            return Self { area: 0.0, centre: Vector2::zeros(), moments: Matrix2::zeros() };
        };
        // Sums about the first pixel stay small.
        let origin = Vector2::new(f64::from(first.from), f64::from(first.y));
        let (mut n, mut s, mut xx, mut xy, mut yy) = (0.0, Vector2::zeros(), 0.0, 0.0, 0.0);
        for run in runs {
            let count = f64::from(run.to - run.from);
            let x = 0.5 * (f64::from(run.from) + f64::from(run.to) - 1.0) - origin.x;
            let y = f64::from(run.y) - origin.y;
            n += count;
            s += Vector2::new(x, y) * count;
            xx += count * (x * x + (count * count - 1.0) / 12.0);
            xy += count * x * y;
            yy += count * y * y;
        }
        let mean = s / n;
        // A pixel is a square of its own second moment 1/12.
        let moments = Matrix2::new(
            xx / n - mean.x * mean.x + 1.0 / 12.0,
            xy / n - mean.x * mean.y,
            xy / n - mean.x * mean.y,
            yy / n - mean.y * mean.y + 1.0 / 12.0,
        );
        Self { area: n, centre: origin + mean, moments }
    }

    /// Longest over shortest diameter of the ellipse with the same moments.
    pub(super) fn aspect(&self) -> f64 {
        let half = 0.5 * self.moments.trace();
        let root = (half * half - self.moments.determinant()).max(0.0).sqrt();
        ((half + root) / (half - root).max(1e-12)).sqrt()
    }

    /// Share of the ellipse with the same moments that is filled: an ellipse with semi-axes a and b has the moments a²/4 and b²/4.
    pub(super) fn fill(&self) -> f64 {
        self.area / (4.0 * std::f64::consts::PI * self.moments.determinant().max(1e-12).sqrt())
    }

    pub(super) fn is_dot(&self, settings: &DotSettings) -> bool {
        let [least, most] = settings.radius_px;
        let longer = 2.0 * (0.5 * self.moments.trace()).sqrt();
        self.area >= 0.8 * std::f64::consts::PI * least * least / settings.most_aspect
            && (0.8 * least..=1.25 * most).contains(&longer)
            && self.aspect() <= settings.most_aspect
            && self.fill() >= LEAST_FILL
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn painted(inside: impl Fn(f64, f64) -> bool) -> Shape {
        let mut runs = Vec::new();
        for y in 0..60_u32 {
            // One run a pixel: moments add up the same.
            runs.extend((0..60).filter(|&x| inside(f64::from(x), f64::from(y))).map(|x| Run {
                y,
                from: x,
                to: x + 1,
            }));
        }
        Shape::of(&runs)
    }

    #[test]
    fn discs_are_dots_and_pairs_are_none() {
        let settings = DotSettings::default();
        let disc = painted(|x, y| (x - 30.3).hypot(y - 29.6) <= 6.0);
        assert!((disc.centre - Vector2::new(30.3, 29.6)).norm() < 0.1);
        assert!(disc.is_dot(&settings) && (disc.fill() - 1.0).abs() < 0.03);
        let pair = painted(|x, y| (x - 24.0).hypot(y - 30.0).min((x - 36.0).hypot(y - 30.0)) <= 6.0);
        assert!(!pair.is_dot(&settings), "{} {}", pair.fill(), pair.aspect());
        let tilted = painted(|x, y| ((x - 30.0) / 6.0).hypot((y - 30.0) / 3.5) <= 1.0);
        assert!(tilted.is_dot(&settings) && (tilted.aspect() - 6.0 / 3.5).abs() < 0.2);
        let bar = painted(|x, y| (x - 30.0).abs() < 14.0 && (y - 30.0).abs() < 2.0);
        assert!(!bar.is_dot(&settings));
    }
}
