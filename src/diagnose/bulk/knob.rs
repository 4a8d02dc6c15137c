//! Parameters of the body's linear changes: ids and units of the catalogue.

use super::laws::Along;
use crate::diagnose::Physics;
use crate::geometry::Vec3;

/// One parameter of a linear change of the body. At most one ball, one axis, one disc of loose glue at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BulkKnob {
    /// Coordinate of the ball's centre along an axis (m).
    BallCentre(usize),
    /// Radius of the ball (m).
    BallRadius,
    /// Logarithm of the ball's modulus over the phantom's.
    BallRatio,
    /// Logarithm of `modulus_ratio = 1 + c` along this direction (any length but zero).
    Along([f64; 3]),
    /// Tilt of that direction towards the first (0) or second (1) tangent of its
    /// [basis](crate::geometry::basis_from_axis) (tangent of the angle).
    Turn(usize),
    /// True Poisson's ratio less the stated one.
    Poisson,
    /// Coordinate of the centre of loose glue along x (0) or y (1) (m).
    LooseCentre(usize),
    /// Radius of the loose glue (m).
    LooseRadius,
    /// The hold's compliance times the modulus, `E / foundation_pa_per_m` (m): how thick a layer of the phantom would
    /// give as much in a plain stretch. Zero is the baseline.
    BaseGive,
    /// Share of the difference that finer elements make. Zero is the baseline, 1 the finer elements.
    Finer,
}

/// Tangents of an axis.
const TANGENTS: [&str; 2] = ["first tangent", "second tangent"];

impl BulkKnob {
    /// The entry of the catalogue that it belongs to.
    pub fn physics(self) -> Physics {
        match self {
            Self::BallCentre(_) | Self::BallRadius | Self::BallRatio => Physics::Inclusion,
            Self::Along(_) | Self::Turn(_) => Physics::Anisotropy,
            Self::Poisson => Physics::PoissonRatio,
            Self::LooseCentre(_) | Self::LooseRadius => Physics::BaseDebonding,
            Self::BaseGive => Physics::CompliantBase,
            Self::Finer => Physics::CoarseMesh,
        }
    }

    /// Id of the parameter, and for one axis of several whose ids do not say it, which.
    pub fn id(self) -> (&'static str, Option<&'static str>) {
        match self {
            Self::BallCentre(0) | Self::LooseCentre(0) => ("centre_x_m", None),
            Self::BallCentre(1) | Self::LooseCentre(_) => ("centre_y_m", None),
            Self::BallCentre(_) => ("centre_z_m", None),
            Self::BallRadius | Self::LooseRadius => ("radius_m", None),
            Self::BallRatio | Self::Along(_) => ("modulus_ratio", None),
            Self::Turn(towards) => ("axis", Some(TANGENTS[towards.min(1)])),
            Self::Poisson => ("poisson_ratio", None),
            Self::BaseGive => ("foundation_pa_per_m", None),
            Self::Finer => ("finer_share", None),
        }
    }

    /// The value and its derivative by the knob in the catalogue's terms, for a body of `modulus` (Pa) and the stated
    /// Poisson's ratio. The foundation of a rigid hold is infinite.
    pub fn said(self, value: f64, modulus: f64, poisson_ratio: f64) -> (f64, f64) {
        match self {
            Self::BallRatio | Self::Along(_) => (value.exp(), value.exp()),
            Self::Poisson => (poisson_ratio + value, 1.0),
            Self::BaseGive => (modulus / value, -modulus / (value * value)),
            _ => (value, 1.0),
        }
    }

    /// Direction of the stiffer axis that these knobs say, a unit vector: the catalogue's `axis`; and its derivatives by the two tilts.
    pub fn axis(knobs: &[(Self, f64)]) -> Option<(Vec3, [Vec3; 2])> {
        let tilt = [0, 1]
            .map(|i| knobs.iter().find(|(knob, _)| *knob == Self::Turn(i)).map_or(0.0, |(_, value)| *value));
        knobs.iter().find_map(|(knob, value)| match knob {
            Self::Along(axis) => {
                let along = Along::new(*axis, tilt, value.exp());
                Some((along.direction(), along.tilted()))
            }
            _ => None,
        })
    }

    /// Whether it says where a change is, or how large.
    pub fn is_place(self) -> bool {
        matches!(self, Self::BallCentre(_) | Self::BallRadius | Self::LooseCentre(_) | Self::LooseRadius)
    }

    /// Whether it changes the whole body alike, so that even what is smaller than an element changes in proportion.
    pub(super) fn of_the_whole(self) -> bool {
        matches!(self, Self::Along(_) | Self::Turn(_) | Self::Poisson)
    }
}
