//! What strain that is not small, damage and weight add to every row: curves of the depth, for the law that acts.
//!
//! Added to the answer of the linear body as it stands, without memory of its own.

use super::dual::{Dual, gradient};
use super::error::DiagnoseError;
use super::large::{Bench, Curve, Curves, Lab, Softening, Stiffened, Stiffening, StiffeningLaw, Weight};
use super::track::Track;
use crate::fem::Order;
use crate::geometry::Vec3;
use crate::inverse::Settled;
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
        Ok(Self { rough: true, coarse, ..Self::with(lab, of_track) })
    }

    /// The same for refits.
    pub(super) fn in_full(&self) -> Self {
        Self::with(Arc::clone(&self.lab), self.of_track.clone())
    }

    fn with(lab: Arc<Lab>, of_track: Vec<usize>) -> Self {
        let (softening, weight) = (OnceLock::new(), OnceLock::new());
        let stiffening = [StiffeningLaw::Fung, StiffeningLaw::Yeoh].map(Stiffening::new);
        Self { lab, rough: false, coarse: None, of_track, stiffening, softening, weight }
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
        modulus: f64,
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
                    modulus,
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
                let (table, size) =
                    if *comes_and_goes { (&weight.acting, 1.0) } else { (&weight.strained, depth.now.re) };
                let mut all = DMatrix::zeros(table.nrows(), 1 + fitted);
                for (axis, g) in gravity.iter().enumerate() {
                    let own = table.column(axis).into_owned();
                    all.column_mut(0).axpy(g.re * size, &own, 1.0);
                    let by: Vec<f64> = gradient(g, fitted).iter().map(|d| d * size).collect();
                    add_products(&mut all, &own, &by);
                    if !comes_and_goes {
                        let by: Vec<f64> = by_depth.iter().map(|d| d * g.re).collect();
                        add_products(&mut all, &own, &by);
                    }
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
