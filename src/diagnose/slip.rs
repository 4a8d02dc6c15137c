//! Coulomb friction under a tip: what it lets go of the surface, from what it would feel if it held on.
//!
//! A tip that takes the surface along feels the force `q`, of `t` along the surface and `n` into it. Were its path shorter by `s`, it would be
//! `q − K s`, `K` the stiffness of everything under it. It holds on while `|t| ≤ μ n`; else it slides by the `s` along the surface with
//! `t − K_tt s = μ (n − K_nt s) s/|s|`: what it feels along the surface is against the way that the surface goes under it. Where that would
//! have to pull, it has come off, and feels nothing.

use super::dual::{Dual, DualSolver};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use num_dual::DualNum;
use std::f64::consts::PI;

/// Newton iterations, and halvings of each.
const ITERATIONS: usize = 50;
const HALVINGS: usize = 30;
/// What the law may leave, over the forces.
const TOLERANCE: f64 = 1e-12;

/// Angles that are tried beside that of the force, on either side of it.
const TURNS: usize = 12;

/// What the tip lets go of its path: along two axes in the surface and, where it has come off, into it. `firm`: its force along these axes
/// if it held on; `stiffness`: by its path along them. `None` where no slip obeys the law.
pub(super) fn let_go<const N: usize>(
    firm: &[Dual<N>; 3],
    stiffness: &[[Dual<N>; 3]; 3],
    friction: Dual<N>,
) -> Option<[Dual<N>; 3]> {
    let law = Law {
        firm: firm.map(|f| f.re),
        stiffness: stiffness.map(|row| row.map(|k| k.re)),
        friction: friction.re,
    };
    let [x, y, into] = law.firm;
    if x.hypot(y) <= law.friction * into {
        return Some([Dual::from(0.0); 3]);
    }
    let along = y.atan2(x);
    // One more step of Newton's, with derivatives, gives those of the solution.
    let slide = |(size, angle): (f64, f64)| {
        let left = law_left(firm, stiffness, friction, Dual::from(size), Dual::from(angle));
        let inverse = law.slope(size, angle).try_inverse()?;
        let step = |i: usize| -(left[0] * inverse[(i, 0)] + left[1] * inverse[(i, 1)]);
        let (size, angle) = (step(0) + size, step(1) + angle);
        Some([size * angle.cos(), size * angle.sin(), Dual::from(0.0)])
    };
    if let Some(found) = law.solved(along) {
        return slide(found);
    }
    let matrix = DMatrix::from_fn(3, 3, |i, j| stiffness[i][j]);
    let all = DualSolver::new(&matrix)?.solve(&DVector::from_column_slice(firm))?;
    // Without a force it is clear of the surface.
    if all[2].re <= 0.0 {
        return Some([all[0], all[1], all[2]]);
    }
    // Where the surface bulges much before a tip that slides, the way of the force is too far from that of the slip.
    let mut turned =
        (1..=TURNS).flat_map(|turn| [1.0, -1.0].map(|side| side * PI * turn as f64 / TURNS as f64));
    turned.find_map(|turn| law.solved(along + turn)).and_then(slide)
}

/// What the law leaves along the surface where the slip has this size and angle.
fn law_left<T: DualNum + Copy>(
    firm: &[T; 3],
    stiffness: &[[T; 3]; 3],
    friction: T,
    size: T,
    angle: T,
) -> [T; 2] {
    let to = [angle.cos(), angle.sin()];
    let along = |row: &[T; 3]| row[0] * to[0] + row[1] * to[1];
    let pressed = firm[2] - size * along(&stiffness[2]);
    std::array::from_fn(|i| firm[i] - size * along(&stiffness[i]) - friction * pressed * to[i])
}

/// The same without derivatives.
struct Law {
    firm: [f64; 3],
    stiffness: [[f64; 3]; 3],
    friction: f64,
}

impl Law {
    fn left(&self, size: f64, angle: f64) -> Vector2<f64> {
        Vector2::from(law_left(&self.firm, &self.stiffness, self.friction, size, angle))
    }

    /// How the tip is pressed on, and its derivatives by size and angle of the slip.
    fn pressed(&self, size: f64, angle: f64) -> (f64, [f64; 2]) {
        let [x, y, _] = self.stiffness[2];
        let (sin, cos) = angle.sin_cos();
        let along = x * cos + y * sin;
        (self.firm[2] - size * along, [-along, -size * (y * cos - x * sin)])
    }

    /// Derivatives of what is left by size and angle of the slip.
    fn slope(&self, size: f64, angle: f64) -> Matrix2<f64> {
        let (sin, cos) = angle.sin_cos();
        let (to, turned) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
        let k = Matrix2::from_fn(|i, j| self.stiffness[i][j]);
        let (pressed, by) = self.pressed(size, angle);
        let by_size = -(k * to) - to * (self.friction * by[0]);
        let by_angle = -(k * turned) * size - (to * by[1] + turned * pressed) * self.friction;
        Matrix2::from_columns(&[by_size, by_angle])
    }

    /// Size and angle of the slip of a tip that stays on, looked for from this angle.
    fn solved(&self, mut angle: f64) -> Option<(f64, f64)> {
        let [x, y, into] = self.firm;
        let scale = x.hypot(y) + self.friction * into.abs();
        // What would do that way.
        let to = Vector2::new(angle.cos(), angle.sin());
        let (left, slope) = (self.left(0.0, angle).dot(&to), self.slope(0.0, angle).column(0).dot(&to));
        let mut size = if slope < 0.0 { (-left / slope).max(0.0) } else { 0.0 };
        let mut left = self.left(size, angle);
        for _ in 0..ITERATIONS {
            if left.norm() <= TOLERANCE * scale {
                return (size >= 0.0 && self.pressed(size, angle).0 >= 0.0).then_some((size, angle));
            }
            let step = self.slope(size, angle).lu().solve(&left)?;
            let shorter = (0..HALVINGS).map(|halvings| 0.5_f64.powi(halvings as i32)).find_map(|share| {
                let next = (size - share * step[0], angle - share * step[1]);
                let found = self.left(next.0, next.1);
                (found.norm() < left.norm()).then_some((next, found))
            });
            ((size, angle), left) = shorter?;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::dual::{gradient, variable};
    use super::*;

    const STIFFNESS: [[f64; 3]; 3] = [[30.0, 4.0, -9.0], [4.0, 6.0, 5.0], [-9.0, 5.0, 20.0]];

    fn dual(stiffness: [[f64; 3]; 3]) -> [[Dual; 3]; 3] {
        stiffness.map(|row| row.map(Dual::from))
    }

    /// What is felt after the slip.
    fn felt(firm: [f64; 3], slip: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| firm[i] - (0..3).map(|j| STIFFNESS[i][j] * slip[j]).sum::<f64>())
    }

    /// A surface five times as stiff along one axis as along the other, which also gives when it is pressed: friction's share of the pressure,
    /// against the way of the slip, which is not that of the force on a tip that holds on.
    #[test]
    fn friction_is_against_the_slip() {
        for (firm, friction) in [([0.3, -0.2, 0.5], 0.3), ([-0.1, 0.25, 0.6], 0.3), ([0.5, -0.4, 0.3], 0.2)] {
            let slip = let_go(&firm.map(Dual::from), &dual(STIFFNESS), Dual::from(friction)).expect("slides");
            let slip = slip.map(|s| s.re);
            let [x, y, pressed] = felt(firm, slip);
            let size = slip[0].hypot(slip[1]);
            assert!(pressed > 0.0 && size > 0.0 && slip[2] == 0.0, "{slip:?} {pressed}");
            for (felt, slip) in [(x, slip[0]), (y, slip[1])] {
                assert!((felt - friction * pressed * slip / size).abs() < 1e-12, "{felt} {slip} {pressed}");
            }
            let way = |x: f64, y: f64| y.atan2(x);
            assert!((way(slip[0], slip[1]) - way(firm[0], firm[1])).abs() > 0.05, "{slip:?}");
        }
    }

    /// Within the cone it holds on; what pulls comes off; and one that would pull if it held on may press while it slides.
    #[test]
    fn a_tip_holds_on_slides_or_comes_off() {
        let let_go = |firm: [f64; 3]| -> [f64; 3] {
            let slip = let_go(&firm.map(Dual::from), &dual(STIFFNESS), Dual::from(0.4)).expect("an answer");
            slip.map(|s| s.re)
        };
        assert_eq!(let_go([0.19, -0.05, 0.5]), [0.0; 3]);
        let off = [0.05, 0.02, -0.3];
        assert!(felt(off, let_go(off)).iter().all(|f| f.abs() < 1e-15));
        let pulls = [0.4, 0.0, -0.02];
        let slip = let_go(pulls);
        assert!(slip[2] == 0.0 && felt(pulls, slip)[2] > 0.0, "{slip:?}");
    }

    /// A tip that the surface bulges before: the search from the way of the force ends at nothing. It would be pressed in if it were off, so it
    /// slides.
    #[test]
    fn a_tip_that_is_pressed_in_slides() {
        let stiffness = [[1.0, 0.11, -0.48], [0.11, 0.15, -0.27], [-0.48, -0.27, 2.0]];
        let (firm, friction) = ([0.0218, -0.5999, 1.0], 0.6);
        let slip = let_go(&firm.map(Dual::from), &dual(stiffness), Dual::from(friction)).expect("slides");
        let slip = slip.map(|s| s.re);
        let felt = |i: usize| firm[i] - (0..3).map(|j| stiffness[i][j] * slip[j]).sum::<f64>();
        assert!(slip[2] == 0.0 && felt(2) > 0.8, "{slip:?}");
        let size = slip[0].hypot(slip[1]);
        for i in 0..2 {
            assert!((felt(i) - friction * felt(2) * slip[i] / size).abs() < 1e-11, "{slip:?}");
        }
    }

    /// Of one that slides, and of one that is off.
    #[test]
    fn a_slip_has_the_derivatives_of_its_differences() {
        for firm in [[0.3, -0.2, 0.5], [0.05, 0.02, -0.3]] {
            let at = |moved: [f64; 6]| {
                let mut stiffness = dual(STIFFNESS);
                stiffness[0][0] = variable(STIFFNESS[0][0] + moved[4], 4);
                stiffness[2][1] = variable(STIFFNESS[2][1] + moved[5], 5);
                let firm = std::array::from_fn(|i| variable(firm[i] + moved[i], i));
                let_go(&firm, &stiffness, variable(0.3 + moved[3], 3)).expect("an answer")
            };
            let here = at([0.0; 6]);
            for p in 0..6 {
                let moved = |h: f64| at(std::array::from_fn(|i| if i == p { h } else { 0.0 }));
                let (ahead, behind) = (moved(1e-6), moved(-1e-6));
                for i in 0..3 {
                    let slope = (ahead[i].re - behind[i].re) / 2e-6;
                    assert!((gradient(&here[i], 6)[p] - slope).abs() < 1e-8 + 1e-6 * slope.abs(), "{p} {i}");
                }
            }
        }
    }
}
