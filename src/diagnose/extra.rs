//! What strain that is not small, damage and weight add to every row: curves of the depth, for the law that acts.
//!
//! Added to the answer of the linear body as it stands, without memory of its own.

use super::dual::{Dual, gradient};
use super::error::DiagnoseError;
use super::large::{Bench, Curve, Curves, Lab, Softening, Stiffened, Stiffening, StiffeningLaw, Weight};
use super::track::Track;
use crate::fem::Order;
use crate::geometry::Vec3;
use crate::inverse::{Restraint, Settled};
use nalgebra::DMatrix;
use std::sync::{Arc, OnceLock};

/// A law that is not linear in the displacement.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::large_enum_variant, reason = "one a march")]
pub(super) enum Large {
    /// Neo-Hookean.
    FiniteStrain,
    /// Stiffer with strain; contains the one before.
    Stiffening(StiffeningLaw, Dual),
    /// Softer after the deepest load: share, logarithm of the scale (J/m³).
    Softening(Dual, Dual),
    /// Weight (m/s²): what it does to a body that always carries it, or what comes and goes with the tip.
    Weight {
        /// Whether it only acts while the tip touches.
        comes_and_goes: bool,
        /// Acceleration.
        gravity: [Dual; 3],
    },
}

/// Curves of all laws at every place and direction that is poked, each worked out when first needed.
pub(super) struct Shelf {
    /// Second-order elements. First-order ones lock under a tip, and get even the sign of what finite strain does wrong.
    lab: Arc<Lab>,
    /// For a look: curves through few depths.
    rough: bool,
    /// For a look at what softens and what weighs: first-order elements on the mesh as given, where they can take it.
    coarse: Option<Lab>,
    /// Index of every track's curve.
    of_track: Vec<usize>,
    stiffening: [Stiffening; 2],
    softening: OnceLock<Softening>,
    weight: OnceLock<Vec<Weight>>,
    density_kg_m3: f64,
    /// The restraint that the body has.
    restraint: Vec<Restraint>,
}

/// What one law adds, ready to be asked row by row.
#[expect(clippy::large_enum_variant, reason = "one a march")]
pub(super) enum Extra<'a> {
    /// One curve a poke.
    Curves(Arc<Curves>),
    /// Curves with their derivative by a parameter.
    Stiffened(Stiffened, Dual),
    /// Damage.
    Softening(&'a Softening, Dual, Dual),
    /// Weight.
    Weight(&'a [Weight], bool, [Dual; 3]),
}

/// Where a row stands: depth of the tip and greatest depth so far at its place (m).
#[derive(Debug, Clone, Copy)]
pub(super) struct Depth {
    /// Now.
    pub now: Dual,
    /// So far.
    pub deepest: Dual,
}

/// Springs are near within this share of their radius, and to this in the logarithm of their softness.
const NEAR_SHIFT: f64 = 0.5;
const NEAR_LOG: f64 = 0.3;

/// Two pokes are in one direction within this.
const SAME_DIRECTION: f64 = 1e-6;

impl Shelf {
    /// For a look at the pokes of a recording. Nothing but the linear answers is worked out yet.
    ///
    /// # Errors
    /// As [`Lab::new`] and [`Bench::of`].
    pub(super) fn rough(settled: &Settled<'_>, tracks: &[Track]) -> Result<Self, DiagnoseError> {
        let mut places: Vec<(usize, Vec3, f64)> = Vec::new();
        let mut of_track = Vec::new();
        for track in tracks {
            let deepest = track.depth_m.iter().copied().fold(0.0, f64::max);
            let same =
                |p: &(usize, Vec3, f64)| p.0 == track.site && (p.1 - track.direction).norm() < SAME_DIRECTION;
            let place = places.iter().position(same).unwrap_or_else(|| {
                places.push((track.site, track.direction, 0.0));
                places.len() - 1
            });
            places[place].2 = places[place].2.max(deepest);
            of_track.push(place);
        }
        let mut bench = Bench::of(settled, &places)?;
        let lab = Arc::new(Lab::new(&bench, Order::P2)?);
        bench.mesh.clone_from(&settled.recording.mesh);
        // Glued spots may be too close together for them.
        let coarse = Lab::new(&bench, Order::P1).ok();
        let density_kg_m3 = settled.recording.phantom.density_kg_m3;
        let restraint = settled.at.state.patches.clone();
        Ok(Self { rough: true, coarse, ..Self::with(lab, of_track, density_kg_m3, restraint) })
    }

    /// Whether what the laws add is as good as the same with this restraint: what differs between a law and the linear body hardly knows where
    /// springs are to within half a radius. Glue must be [alike](Restraint::alike).
    pub(super) fn serves(&self, restraint: &[Restraint]) -> bool {
        let near = |one: &Restraint, other: &Restraint| {
            let springs = one.softness > 0.0 && other.softness > 0.0 && one.radius_m == other.radius_m;
            let close = (one.centre - other.centre).norm() <= NEAR_SHIFT * one.radius_m
                && (one.softness / other.softness).ln().abs() <= NEAR_LOG;
            (springs && close) || one.alike(other)
        };
        Restraint::paired(restraint, &self.restraint, near)
    }

    /// The same for refits.
    pub(super) fn in_full(&self) -> Self {
        let (lab, of_track) = (Arc::clone(&self.lab), self.of_track.clone());
        Self::with(lab, of_track, self.density_kg_m3, self.restraint.clone())
    }

    fn with(lab: Arc<Lab>, of_track: Vec<usize>, density_kg_m3: f64, restraint: Vec<Restraint>) -> Self {
        let (softening, weight) = (OnceLock::new(), OnceLock::new());
        let stiffening = Stiffening::of([StiffeningLaw::Fung, StiffeningLaw::Yeoh]);
        Self {
            lab,
            rough: false,
            coarse: None,
            of_track,
            stiffening,
            softening,
            weight,
            density_kg_m3,
            restraint,
        }
    }

    /// Elements for what softens and what weighs.
    fn mild(&self) -> &Lab {
        self.coarse.as_ref().unwrap_or(&self.lab)
    }

    /// A scale of softening (J/m³) at which the deepest poke does its typical damage, for a body of this modulus (Pa).
    ///
    /// # Errors
    /// What the elements report.
    pub(super) fn typical_scale(&self, modulus: f64, tracks: &[Track]) -> Result<f64, DiagnoseError> {
        let softening = self.softening()?;
        let energy = |(i, track): (usize, &Track)| {
            let deepest = track.depth_m.iter().copied().fold(0.0, f64::max);
            modulus * softening.pokes[self.of_track[i]].mean_density * deepest * deepest
        };
        Ok(tracks.iter().enumerate().map(energy).fold(f64::MIN_POSITIVE, f64::max))
    }

    /// Whether large strain alone could be worked out as deep as the recording goes.
    pub(super) fn strains_in_full(&self) -> bool {
        let known = self.stiffening[0].at_zero(&self.lab);
        known.is_ok_and(|curves| curves.pokes.iter().all(|curve| curve.stopped.is_none()))
    }

    /// What a law adds.
    ///
    /// # Errors
    /// What the elements report.
    pub(super) fn extra<'a>(&'a self, large: &Large) -> Result<Extra<'a>, DiagnoseError> {
        Ok(match large {
            Large::FiniteStrain if self.rough => Extra::Curves(self.stiffening[0].roughly_zero(&self.lab)?),
            Large::FiniteStrain => Extra::Curves(self.stiffening[0].at_zero(&self.lab)?),
            Large::Stiffening(law, b) => {
                let curves = &self.stiffening[usize::from(*law == StiffeningLaw::Yeoh)];
                let at =
                    if self.rough { curves.roughly(&self.lab, b.re)? } else { curves.at(&self.lab, b.re)? };
                Extra::Stiffened(at, *b)
            }
            Large::Softening(share, log_scale) => Extra::Softening(self.softening()?, *share, *log_scale),
            Large::Weight { comes_and_goes, gravity } => {
                Extra::Weight(self.weight()?, *comes_and_goes, *gravity)
            }
        })
    }

    fn softening(&self) -> Result<&Softening, DiagnoseError> {
        match self.softening.get() {
            Some(softening) => Ok(softening),
            None => {
                let made = self.mild().softening()?;
                Ok(self.softening.get_or_init(|| made))
            }
        }
    }

    fn weight(&self) -> Result<&[Weight], DiagnoseError> {
        match self.weight.get() {
            Some(weight) => Ok(weight),
            None => {
                let made = self.mild().weight()?;
                Ok(self.weight.get_or_init(|| made))
            }
        }
    }

    /// What is added at one row, for a unit modulus: force (N/Pa), then markers (m); the value, then its derivative by each
    /// of the `fitted` parameters. The modulus' part in damage is left to its scale.
    pub(super) fn at(
        &self,
        extra: &Extra<'_>,
        track: usize,
        depth: &Depth,
        modulus: &Dual,
        fitted: usize,
    ) -> DMatrix<f64> {
        let place = self.of_track[track];
        let by_depth = gradient(&depth.now, fitted);
        let with_curve = |curve: &Curve| {
            let x = depth.now.re;
            let value = curve.at(x);
            let slope = curve.slope(x);
            let mut all = DMatrix::zeros(value.len(), 1 + fitted);
            all.set_column(0, &value);
            add_products(&mut all, &slope, by_depth.as_slice());
            all
        };
        match extra {
            Extra::Curves(curves) => with_curve(&curves.pokes[place]),
            Extra::Stiffened(stiffened, b) => {
                let mut all = with_curve(&stiffened.curves.pokes[place]);
                let by_b = stiffened.by_stiffening.pokes[place].at(depth.now.re);
                add_products(&mut all, &by_b, gradient(b, fitted).as_slice());
                all
            }
            Extra::Softening(softening, share, log_scale) => {
                let softer = softening.pokes[place].at(
                    depth.now.re,
                    depth.deepest.re.max(depth.now.re),
                    share.re,
                    log_scale.re.exp(),
                    modulus.re,
                );
                let mut all = DMatrix::zeros(softer.value.len(), 1 + fitted);
                all.set_column(0, &softer.value);
                add_products(&mut all, &softer.by_softening, gradient(share, fitted).as_slice());
                add_products(&mut all, &softer.by_log_scale, gradient(log_scale, fitted).as_slice());
                add_products(&mut all, &softer.by_depth, by_depth.as_slice());
                all
            }
            Extra::Weight(weight, comes_and_goes, gravity) => {
                let weight = &weight[place];
                let (table, size) = match comes_and_goes {
                    true => (&weight.acting, Dual::from(1.0)),
                    false => (&weight.strained, depth.now),
                };
                let mut all = DMatrix::zeros(table.nrows(), 1 + fitted);
                for (axis, g) in gravity.iter().enumerate() {
                    let own = table.column(axis).into_owned();
                    let load = *g * size * self.density_kg_m3 / *modulus;
                    all.column_mut(0).axpy(load.re, &own, 1.0);
                    add_products(&mut all, &own, gradient(&load, fitted).as_slice());
                }
                all
            }
        }
    }
}

/// Adds `slope` times each derivative to the derivatives' columns.
fn add_products(all: &mut DMatrix<f64>, slope: &nalgebra::DVector<f64>, derivatives: &[f64]) {
    for (p, d) in derivatives.iter().enumerate().filter(|(_, d)| **d != 0.0) {
        all.column_mut(1 + p).axpy(*d, slope, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::dual::variable;
    use super::super::large::Poke;
    use super::*;
    use crate::fem::Profile;
    use crate::mesh::{Block, block};
    use num_dual::DualNum;

    fn springs(x: f64, softness: f64) -> Restraint {
        Restraint { centre: Vec3::new(x, 0.0, 0.0), radius_m: 0.005, softness, glued: false }
    }

    /// A slab poked at its top, for which restraint at 10 and 40 mm was found.
    fn shelf() -> Shelf {
        let top = |x: f64| Vec3::new(x, 0.02, 0.02);
        let bench = Bench {
            mesh: block(&Block { size_m: [0.05, 0.04, 0.02], cells: [4, 3, 2] }).expect("a block"),
            fixed: "z-",
            observed: "z+",
            poisson_ratio: 0.45,
            profile: Profile::Uniform,
            pokes: vec![Poke { centre: top(0.02), direction: -Vec3::z(), radius_m: 0.007, deepest_m: 0.002 }],
            holds: Vec::new(),
            markers: vec![top(0.035)],
        };
        let lab = Arc::new(Lab::new(&bench, Order::P1).expect("a sound bench"));
        Shelf::with(lab, vec![0], 1050.0, vec![springs(0.01, 120.0), springs(0.04, 80.0)])
    }

    #[test]
    fn a_shelf_serves_where_springs_are_near() {
        let shelf = shelf();
        let glue = |x: f64| Restraint { softness: 0.0, glued: true, ..springs(x, 1.0) };
        assert!(shelf.serves(&[springs(0.0424, 100.0), springs(0.01, 100.0)]));
        for other in [
            vec![springs(0.01, 120.0)],
            vec![springs(0.01, 120.0), springs(0.0426, 80.0)],
            vec![springs(0.01, 165.0), springs(0.04, 80.0)],
            vec![springs(0.01, 120.0), glue(0.04)],
        ] {
            assert!(!shelf.serves(&other), "{other:?}");
        }
        let glued = Shelf { restraint: vec![glue(0.01)], ..shelf };
        assert!(glued.serves(&[glue(0.0104)]) && !glued.serves(&[glue(0.012)]));
    }

    /// The force that a body's weight puts on the tip does not know of its modulus; markers go the less the stiffer it is.
    #[test]
    fn weight_is_weighed_against_the_modulus() {
        let shelf = shelf();
        for comes_and_goes in [true, false] {
            let at = |log_modulus: f64, down: f64, depth: f64| {
                let gravity = [0.3, -0.2, -9.0 + down].map(Dual::from);
                let gravity = [gravity[0], gravity[1], variable(gravity[2].re, 1)];
                let law = Large::Weight { comes_and_goes, gravity };
                let now = variable(depth, 2);
                let modulus = variable(log_modulus, 0).exp();
                let extra = shelf.extra(&law).expect("it bears it");
                shelf.at(&extra, 0, &Depth { now, deepest: now }, &modulus, 3)
            };
            let here = at(9.2, 0.0, 1e-3);
            let stiffer = at(9.2 + 2.0_f64.ln(), 0.0, 1e-3);
            assert!((stiffer.column(0) * 2.0 - here.column(0)).amax() < 1e-12 * here.column(0).amax());
            let h = 1e-4;
            let moved = [[h, 0.0, 0.0], [0.0, h, 0.0], [0.0, 0.0, 1e-3 * h]];
            for (p, [log_modulus, down, depth]) in moved.into_iter().enumerate() {
                let by = |sign: f64| at(9.2 + sign * log_modulus, sign * down, 1e-3 + sign * depth);
                let slope = (by(1.0).column(0) - by(-1.0).column(0)) / (2.0 * (log_modulus + down + depth));
                let own = here.column(1 + p);
                assert!((slope - own).amax() <= 1e-6 * here.column(1).amax().max(own.amax()), "{p} {own}");
            }
        }
    }
}
