//! A tip at its site: compliance of its ports, restraint taken in → forces on the ports for every entry of the drive.
//!
//! The drive's entries are what the tip answers to ([`Lift`]). Pads and flat faces are linear in them. A sphere is
//! pressed to as many depths as the series has terms; its coefficients follow.

use super::error::InverseError;
use super::evidence::DRIVE;
use super::lift::{ASIDE, Lift, TERMS, terms};
use crate::fem::{Pressed, Tip};
use crate::geometry::{Vec3, basis_from_axis};
use nalgebra::{DMatrix, SMatrix};

/// A tip at one site.
#[derive(Debug, Clone)]
pub struct Grip {
    /// The tip.
    pub tip: Tip,
    /// Displacements (m) to which a sphere is pressed, each with the radius (m) within which the contact is resolved.
    knots: Vec<(Vec3, f64)>,
    /// From forces at the knots to coefficients of the drive's entries: `knots × DRIVE`.
    combine: DMatrix<f64>,
    /// Radius (m) at which the contact of a sphere that sticks moves aside.
    aside_radius: Option<f64>,
}

/// A tip that has taken hold of a body, for a unit modulus.
pub(super) struct Held {
    /// Forces on the ports for each entry of the drive: `3 ports × DRIVE`; zero for the weight.
    pub by_drive: DMatrix<f64>,
    /// Forces on the ports that take a displacement of the ports back.
    pub tangent: DMatrix<f64>,
    pressed: Vec<Pressed>,
    combine: DMatrix<f64>,
    /// A sphere that sticks, moved aside.
    aside: Option<Pressed>,
    linear: bool,
    inward: Vec3,
}

/// Where a sphere is pressed: shares of `√(deepest)`.
const KNOTS: [f64; TERMS] = [0.35, 0.6, 0.82, 1.0];

/// The one of these at which the way aside is taken.
const ASIDE_KNOT: usize = 2;

impl Grip {
    /// A tip with its lift; `free` is the compliance of its ports ([`Tip::compliance`]) without restraint.
    pub fn new(tip: Tip, lift: &Lift, free: &DMatrix<f64>) -> Result<Self, InverseError> {
        let (path, deepest_m) = match lift {
            Lift::Whole | Lift::Depth(_) => {
                let (knots, combine) = (Vec::new(), DMatrix::zeros(0, DRIVE));
                return Ok(Self { tip, knots, combine, aside_radius: None });
            }
            Lift::Series { inward, deepest_m } => (inward, deepest_m),
            Lift::Sticking { path, deepest_m, .. } => (path, deepest_m),
        };
        let mut knots = Vec::with_capacity(TERMS);
        let mut values = SMatrix::<f64, TERMS, TERMS>::zeros();
        for (k, s) in KNOTS.into_iter().enumerate() {
            let to = path * (deepest_m * s * s);
            knots.push((to, tip.resolved_radius(free, &to)?));
            values.set_column(k, &SMatrix::from(terms(s * s)));
        }
        let aside_radius = match lift {
            Lift::Sticking { .. } => Some(tip.press(free, &knots[ASIDE_KNOT].0)?.contact_radius_m),
            _ => None,
        };
        // The powers are independent at different depths.
        let inverse = values.try_inverse().unwrap_or_default();
        let mut combine = DMatrix::zeros(TERMS, DRIVE);
        combine.columns_mut(0, TERMS).copy_from(&inverse);
        Ok(Self { tip, knots, combine, aside_radius })
    }

    /// Forces on the ports per displacement of the tip (`3 ports × 3`, N/m for a unit modulus) on a body whose
    /// `compliance` they feel; `None` where the force is not in proportion to the displacement.
    pub fn by_displacement(&self, compliance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        if !self.knots.is_empty() {
            return None;
        }
        self.tip.press(compliance, &self.tip.inward()).ok().map(|pressed| pressed.by_displacement)
    }

    /// Takes hold of a body whose `compliance` the ports feel.
    pub(super) fn hold(&self, compliance: &DMatrix<f64>) -> Result<Held, InverseError> {
        let inward = self.tip.inward();
        if self.knots.is_empty() {
            // In proportion to the displacement, so that any depth will do.
            let pressed = self.tip.press(compliance, &inward)?;
            let mut by_drive = DMatrix::zeros(pressed.forces.len(), DRIVE);
            by_drive.columns_mut(0, 3).copy_from(&pressed.by_displacement);
            let (tangent, combine) = (pressed.tangent.clone(), DMatrix::zeros(0, DRIVE));
            return Ok(Held {
                by_drive,
                tangent,
                pressed: vec![pressed],
                combine,
                aside: None,
                linear: true,
                inward,
            });
        }
        let pressed = self
            .knots
            .iter()
            .map(|(to, radius)| self.tip.press_within(compliance, to, *radius))
            .collect::<Result<Vec<_>, _>>()?;
        let forces = DMatrix::from_columns(&pressed.iter().map(|p| p.forces.clone()).collect::<Vec<_>>());
        let mut by_drive = forces * &self.combine;
        let aside = match self.aside_radius {
            Some(radius) => Some(self.tip.stuck(compliance, radius)?),
            None => None,
        };
        if let Some(stuck) = &aside {
            aside_columns(&mut by_drive, &stuck.by_displacement, &inward);
        }
        let tangent = DMatrix::zeros(by_drive.nrows(), by_drive.nrows());
        Ok(Held { by_drive, tangent, pressed, combine: self.combine.clone(), aside, linear: false, inward })
    }
}

impl Held {
    /// Change of [`Held::by_drive`] with the compliance.
    pub(super) fn change(&self, compliance: &DMatrix<f64>) -> DMatrix<f64> {
        if self.linear {
            return -(&self.tangent * (compliance * &self.by_drive));
        }
        let forces: Vec<_> = self.pressed.iter().map(|p| p.change(compliance)).collect();
        let mut change = DMatrix::from_columns(&forces) * &self.combine;
        if let Some(stuck) = &self.aside {
            let by_displacement = -(&stuck.tangent * (compliance * &stuck.by_displacement));
            aside_columns(&mut change, &by_displacement, &self.inward);
        }
        change
    }

    /// Change of [`Held::tangent`] with the compliance.
    pub(super) fn tangent_change(&self, compliance: &DMatrix<f64>) -> DMatrix<f64> {
        -(&self.tangent * (compliance * &self.tangent))
    }
}

/// Writes the columns of the ways aside: `by_displacement` along the two tangents, per unit of `√(δ / deepest)`.
fn aside_columns(by_drive: &mut DMatrix<f64>, by_displacement: &DMatrix<f64>, inward: &Vec3) {
    let tangents = basis_from_axis(inward).fixed_columns::<2>(0) / KNOTS[ASIDE_KNOT];
    by_drive.columns_mut(ASIDE, 2).copy_from(&(by_displacement * tangents));
}
