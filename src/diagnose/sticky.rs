//! Dry friction beside the springs of a restraint: each disc also pulls by a spring in series with a slider, which follows when it is stretched
//! beyond a slip (the elastoplastic element of Iwan 1966). Its loop is the same at any rate, and what has slid stays where it is.
//!
//! No entry of the catalogue says so, but a restraint with memory can stand in for it: both pull less on the way back. So it is looked for with
//! the entries, and what is explained best with it is called unexplained.

use super::dual::{Dual, MOST, resized};
use super::model::Model;
use super::refit::Fitted;
use crate::geometry::Vec3;
use nalgebra::DMatrix;
use num_dual::DualNum;

/// What drags beside springs of stiffness `k`: a disc at `u` with its slider at `s` is also pulled by `−r k (u − s)`, and `s` follows so that
/// `|u − s|` is at most the slip.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sticky<const N: usize = MOST> {
    /// Stiffness in series with the sliders, over that of the springs.
    pub ratio: Dual<N>,
    /// By so much it is stretched before they slide (m, above 0).
    pub slip_m: Dual<N>,
}

impl Sticky {
    /// With derivatives by the first `N` parameters.
    pub(super) fn resized<const N: usize>(&self) -> Sticky<N> {
        Sticky { ratio: resized(&self.ratio), slip_m: resized(&self.slip_m) }
    }
}

/// A restraint that slips sooner (m) is glue.
pub(super) const SMALLEST_SLIP_M: f64 = 1e-6;

/// A direction that turns by less than this is the same.
const SAME: f64 = 1e-6;

/// The sliders of all discs of one group.
pub(super) struct Sliders<const N: usize> {
    /// Stiffness in series (N/m) and slip (m); none where nothing drags.
    law: Option<(Dual<N>, Dual<N>)>,
    /// Where they are (m).
    at: Vec<[Dual<N>; 3]>,
    /// Those that slide at this row, or are expected to.
    slides: Vec<Option<Slide<N>>>,
}

/// One that slides.
#[derive(Debug, Clone, Copy)]
struct Slide<const N: usize> {
    /// Where to: a unit vector.
    along: [Dual<N>; 3],
    /// From where it is to where the disc is (m).
    stretch_m: Dual<N>,
}

impl<const N: usize> Sliders<N> {
    /// At rest, beside springs of so much (N/m).
    pub(super) fn new(sticky: Option<Sticky<N>>, stiffness: Dual<N>, discs: usize) -> Self {
        let discs = if sticky.is_some() { discs } else { 0 };
        let law = sticky.map(|sticky| (sticky.ratio * stiffness, sticky.slip_m));
        Self { law, at: vec![[Dual::from(0.0); 3]; discs], slides: vec![None; discs] }
    }

    /// What the matrix of a row depends on: whether each slides, and where to.
    pub(super) fn state(&self) -> impl Iterator<Item = Option<[f64; 4]>> + '_ {
        let state = |s: &Slide<N>| [s.along[0].re, s.along[1].re, s.along[2].re, s.stretch_m.re];
        self.slides.iter().map(move |slide| slide.as_ref().map(state))
    }

    /// What they add to the law `−K u + p` of the n-th disc, a slider's about where it was last turned to (Newton's step of the return along
    /// the stretch, Simo and Hughes 1998, section 3.3).
    pub(super) fn pull(&self, n: usize) -> ([[Dual<N>; 3]; 3], [Dual<N>; 3]) {
        let none = Dual::from(0.0);
        let Some((stiffness, slip)) = self.law else { return ([[none; 3]; 3], [none; 3]) };
        let at = self.at[n];
        let by = |entry: &dyn Fn(usize, usize) -> Dual<N>| -> [[Dual<N>; 3]; 3] {
            std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
        };
        let one = |i: usize, j: usize| Dual::from(if i == j { 1.0 } else { 0.0 });
        let (k, force) = match self.slides[n] {
            None => (by(&|i, j| stiffness * one(i, j)), [none; 3]),
            Some(Slide { along, stretch_m }) => {
                let turn = stiffness * slip / stretch_m;
                let k = by(&|i, j| turn * (one(i, j) - along[i] * along[j]));
                (k, along.map(|a| stiffness * slip * a))
            }
        };
        let p = std::array::from_fn(|i| (0..3).map(|j| k[i][j] * at[j]).sum::<Dual<N>>() - force[i]);
        (k, p)
    }

    /// Which of them slide, and where to, if the discs are displaced by `u` at this row: whether that is news.
    pub(super) fn turn(&mut self, u: &[Dual<N>]) -> bool {
        let Some((_, slip)) = self.law else { return false };
        let mut news = false;
        for (n, slide) in self.slides.iter_mut().enumerate() {
            let stretch: [Dual<N>; 3] = std::array::from_fn(|i| u[3 * n + i] - self.at[n][i]);
            let squared: Dual<N> = stretch.iter().map(|s| *s * *s).sum();
            let next = (squared.re > slip.re * slip.re).then(|| {
                let stretch_m = squared.sqrt();
                Slide { along: stretch.map(|s| s / stretch_m), stretch_m }
            });
            news |= match (&slide, &next) {
                (None, None) => false,
                (Some(a), Some(b)) => (0..3).any(|i| (a.along[i].re - b.along[i].re).abs() > SAME),
                _ => true,
            };
            *slide = next;
        }
        news
    }

    /// Goes on to displacements `u`, for which they were turned: what slides stays as far behind as it stretches, and is expected to slide on.
    pub(super) fn advance(&mut self, u: &[Dual<N>]) {
        let Some((_, slip)) = self.law else { return };
        for (n, slide) in self.slides.iter().enumerate() {
            if let Some(Slide { along, .. }) = slide {
                self.at[n] = std::array::from_fn(|i| u[3 * n + i] - slip * along[i]);
            }
        }
    }
}

impl Model<'_> {
    /// By how much the springs are stretched at most (m), where a reading has no memory; `None` where it has no answer.
    pub(super) fn stretched_m(&self, fitted: &Fitted) -> Option<f64> {
        let marched = self.march(&fitted.acting, &fitted.at)?;
        let modulus = fitted.at[0].exp();
        let stiffness = self.disc_stiffness(&fitted.acting, &fitted.at);
        let first = 3 * self.body.sites;
        let at_a_row = |load: &DMatrix<f64>| {
            let disc = |(d, k): (usize, &Dual)| {
                let pull = Vec3::from_fn(|i, _| load[(first + 3 * d + i, 0)] * modulus);
                if k.re > 0.0 { pull.norm() / k.re } else { 0.0 }
            };
            stiffness.iter().enumerate().map(disc).fold(0.0, f64::max)
        };
        Some(marched.rows.loads.iter().filter(|load| !load.is_empty()).map(at_a_row).fold(0.0, f64::max))
    }
}

/// What to look for where the restraint drags.
pub(super) const ADVICE: &str =
    "what drags at any rate alike is friction: look for bands that rub, or whose first pull differs";

#[cfg(test)]
mod tests {
    use super::super::dual::{gradient, variable};
    use super::*;

    /// 50 N/m in series with sliders that slip after 0.2 mm: out to 1 mm and back, in two directions that are not the axes', with the
    /// derivatives by both. Between the turns the force is that of the spring alone.
    #[test]
    fn a_slider_follows_what_stretches_it() {
        let sticky = Sticky { ratio: variable(0.5, 0), slip_m: variable(2e-4, 1) };
        let mut sliders = Sliders::new(Some(sticky), Dual::from(100.0), 2);
        let axes = [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0]];
        for (way_mm, expected_mm, by_slip, slides) in [
            (0.1, 0.1, 0.0, false),
            (0.6, 0.2, 1.0, true),
            (1.0, 0.2, 1.0, true),
            (0.9, 0.1, 1.0, false),
            (0.2, -0.2, -1.0, true),
            (0.3, -0.1, -1.0, false),
        ] {
            let u: Vec<Dual> = axes.iter().flatten().map(|a| Dual::from(1e-3 * way_mm * a)).collect();
            sliders.turn(&u);
            assert!(!sliders.turn(&u), "{way_mm}");
            for (n, axis) in axes.iter().enumerate() {
                let (k, p) = sliders.pull(n);
                for i in 0..3 {
                    let force = (0..3).fold(p[i], |f, j| f - k[i][j] * u[3 * n + j]);
                    let slopes = gradient(&force, 2);
                    assert!((force.re + 0.05 * expected_mm * axis[i]).abs() < 1e-12, "{way_mm}");
                    assert!((slopes[0] + 0.1 * expected_mm * axis[i]).abs() < 1e-12, "{way_mm}");
                    assert!((slopes[1] + 50.0 * by_slip * axis[i]).abs() < 1e-9, "{way_mm}");
                }
            }
            assert!(sliders.state().all(|state| state.is_some() == slides), "{way_mm}");
            sliders.advance(&u);
        }
        assert_eq!(Sliders::<1>::new(None, Dual::from(1.0), 4).pull(0).1, [Dual::from(0.0); 3]);
    }

    /// A slider that follows along x and is then pulled aside: the law is the tangent of the force at the stretch that it was turned to.
    #[test]
    fn a_slider_that_turns_has_the_tangent_of_its_force() {
        let (stiffness, slip) = (50.0, 2e-4);
        let sticky: Sticky = Sticky { ratio: Dual::from(0.5), slip_m: Dual::from(slip) };
        let mut sliders = Sliders::new(Some(sticky), Dual::from(100.0), 1);
        let dual = |u: Vec3| [0, 1, 2].map(|i| Dual::from(u[i]));
        let out = Vec3::new(1e-3, 0.0, 0.0);
        sliders.turn(&dual(out));
        sliders.advance(&dual(out));
        let aside = Vec3::new(1e-3, 3e-4, -2e-4);
        assert!(sliders.turn(&dual(aside)));
        let (k, p) = sliders.pull(0);
        let law = |u: Vec3| Vec3::from_fn(|i, _| (0..3).fold(p[i].re, |f, j| f - k[i][j].re * u[j]));
        let force = |u: Vec3| -stiffness * slip * (u - Vec3::new(1e-3 - slip, 0.0, 0.0)).normalize();
        assert!((law(aside) - force(aside)).norm() < 1e-15);
        for axis in 0..3 {
            let step = Vec3::ith(axis, 1e-8);
            let [linear, exact] = [law(aside + step) - law(aside), force(aside + step) - force(aside)];
            assert!((linear - exact).norm() < 1e-3 * stiffness * 1e-8, "{axis}: {linear} {exact}");
            assert!(exact.norm() > 1e-2 * stiffness * 1e-8, "{axis}");
        }
    }
}
