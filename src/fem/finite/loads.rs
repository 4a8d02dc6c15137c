//! What acts on a held body: prescribed displacements, dead forces, weight, springs and pads.
//!
//! A disc pulls by a uniform traction, whose nodal forces for a unit total force along axis i are the weights of
//! the functional "mean displacement of the disc along i" (reciprocity). Springs and pads are therefore ties
//! along a functional; three of them, one an axis, make a patch: [`crate::fem::Spot::weights`].

use super::{FiniteError, HeldBody};
use crate::fem::Functional;
use crate::geometry::Vec3;

/// How a tie pulls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TieKind {
    /// λ = k (b·u − d), `stiffness` k ≥ 0 (N/m).
    Spring {
        /// k (N/m).
        stiffness: f64,
    },
    /// b·u = d, whatever the force.
    Rigid,
}

/// One spring or one constraint along a functional of the displacement.
#[derive(Debug, Clone, PartialEq)]
pub struct Tie {
    /// b: what is pulled.
    pub functional: Functional,
    /// Displacement d of the far end (m).
    pub displacement: f64,
    /// How it pulls.
    pub kind: TieKind,
}

impl Tie {
    /// A patch on springs, alike along all axes: `stiffness` (N/m) is the patch's total.
    pub fn springs(patch: &[Functional; 3], stiffness: f64) -> [Self; 3] {
        patch.clone().map(|functional| Self {
            functional,
            displacement: 0.0,
            kind: TieKind::Spring { stiffness },
        })
    }

    /// A patch on a spring that acts along the unit vector `direction` only, its far end moved by
    /// `displacement` (m) along it.
    pub fn spring_along(
        patch: &[Functional; 3],
        direction: &Vec3,
        stiffness: f64,
        displacement: f64,
    ) -> Self {
        let mut functional = Functional::new();
        for (weights, share) in patch.iter().zip(direction.iter()) {
            functional.extend(weights.iter().filter(|_| *share != 0.0).map(|&(c, w)| (c, w * share)));
        }
        Self { functional, displacement, kind: TieKind::Spring { stiffness } }
    }

    /// A pad: the patch's mean displacement is `displacement` (m), its traction uniform.
    pub fn pad(patch: &[Functional; 3], displacement: &Vec3) -> [Self; 3] {
        std::array::from_fn(|i| Self {
            functional: patch[i].clone(),
            displacement: displacement[i],
            kind: TieKind::Rigid,
        })
    }

    /// b·u (m).
    pub(super) fn of(&self, u: &[f64]) -> f64 {
        self.functional.iter().map(|&(c, w)| w * u[c as usize]).sum()
    }

    /// 1/k (m/N), 0 when rigid; `None`: a spring without stiffness, which takes no part.
    pub(super) fn compliance(&self) -> Option<f64> {
        match self.kind {
            TieKind::Spring { stiffness } => Some(1.0 / stiffness).filter(|c| c.is_finite()),
            TieKind::Rigid => Some(0.0),
        }
    }
}

/// Everything that acts on a body. All zero by default.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Loads {
    /// Displacements (m) of held components (`3 n + i`); held components not listed stay at 0. A component
    /// listed twice has the last value.
    pub prescribed: Vec<(usize, f64)>,
    /// Dead forces (N) on components (`3 n + i`); entries on the same component add up.
    pub forces: Vec<(u32, f64)>,
    /// Dead force per undeformed volume (N/m³), such as density times gravity.
    pub body_force: Vec3,
    /// Springs and rigid ties.
    pub ties: Vec<Tie>,
}

impl Loads {
    /// Spreads a total force (N) uniformly over a patch.
    pub fn push_force(&mut self, patch: &[Functional; 3], force: &Vec3) {
        for (weights, &total) in patch.iter().zip(force.iter()) {
            self.forces.extend(weights.iter().filter(|_| total != 0.0).map(|&(c, w)| (c, w * total)));
        }
    }
}

/// Loads in the numbering of a body, at one share of the way from a start to their full size.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Level {
    /// Displacement (m) of each held component, in the order of `HeldBody::held`.
    pub(super) held: Vec<f64>,
    /// Dead force (N) on every component.
    pub(super) external: Vec<f64>,
    /// d (m) of each tie.
    pub(super) targets: Vec<f64>,
}

impl Level {
    /// The full loads, checked.
    pub(super) fn full(body: &HeldBody, loads: &Loads) -> Result<Self, FiniteError> {
        let components = body.space().components();
        let finite = |what, index: usize, value: f64| {
            if value.is_finite() {
                return Ok(());
            }
            Err(FiniteError::Value { what, index, value, expected: "a finite number" })
        };
        let within = |component: u32, what| {
            let found = component as usize + 1;
            if found <= components {
                return Ok(());
            }
            Err(FiniteError::Length { what, expected: components, found })
        };
        let mut displacement = vec![0.0; components];
        for (index, &(component, value)) in loads.prescribed.iter().enumerate() {
            finite("prescribed displacement", index, value)?;
            if component >= components || !body.is_held(component) {
                return Err(FiniteError::NotHeld { component });
            }
            displacement[component] = value;
        }
        let mut external = vec![0.0; components];
        for (index, &(component, value)) in loads.forces.iter().enumerate() {
            finite("force", index, value)?;
            within(component, "components of the loaded body")?;
            external[component as usize] += value;
        }
        for (axis, &value) in loads.body_force.iter().enumerate() {
            finite("body force", axis, value)?;
        }
        body.add_body_force(&loads.body_force, &mut external);
        for (index, tie) in loads.ties.iter().enumerate() {
            finite("displacement of tie", index, tie.displacement)?;
            for &(component, weight) in &tie.functional {
                finite("weight of tie", index, weight)?;
                within(component, "components of the tied body")?;
            }
            if let TieKind::Spring { stiffness: value } = tie.kind
                && !(value >= 0.0 && value.is_finite())
            {
                let expected = "a finite number, not negative";
                return Err(FiniteError::Value { what: "stiffness of tie", index, value, expected });
            }
        }
        let held = body.held().iter().map(|&c| displacement[c as usize]).collect();
        Ok(Self { held, external, targets: loads.ties.iter().map(|t| t.displacement).collect() })
    }

    /// The level at `share` (–) of the way from `self` to `to`; exactly `to` at 1.
    pub(super) fn towards(&self, to: &Self, share: f64) -> Self {
        let mix = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).map(|(&a, &b)| if share == 1.0 { b } else { a + share * (b - a) }).collect()
        };
        Self {
            held: mix(&self.held, &to.held),
            external: mix(&self.external, &to.external),
            targets: mix(&self.targets, &to.targets),
        }
    }
}
