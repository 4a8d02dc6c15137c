//! What was fitted, in the catalogue's terms.

use super::bulk::BulkKnob;
use super::diagnosis::{Estimate, Found, Parameter};
use super::knob::Knob;
use super::model::Model;
use super::physics::Physics;
use super::refit::Fitted;
use nalgebra::DMatrix;

/// Parameters of every effect of a reading, in the order of `physics`.
pub(super) fn parameters(
    model: &Model<'_>,
    fitted: &Fitted,
    covariance: Option<&DMatrix<f64>>,
    physics: &[Physics],
) -> Vec<Found> {
    physics
        .iter()
        .map(|&physics| {
            let mut parameters: Vec<Parameter> = Vec::new();
            for (i, knob) in fitted.acting.knobs.iter().enumerate().filter(|(_, k)| k.physics() == physics) {
                let at = model.base() + i;
                let sd = covariance.map_or(f64::NAN, |c| c[(at, at)].max(0.0).sqrt());
                let sd = sd.hypot(by_elements(*knob, fitted.at[at]));
                let estimate = said(model, fitted, *knob, fitted.at[at], sd);
                match parameters.iter_mut().find(|p| p.id == knob.id()) {
                    Some(known) => known.values.push(estimate),
                    None => parameters.push(Parameter {
                        id: knob.id(),
                        values: vec![estimate],
                        list: knob.list(),
                    }),
                }
            }
            complete(model, fitted, physics, &mut parameters);
            Found { physics, parameters }
        })
        .collect()
}

/// Standard deviation that elements leave of where a change of the body is and how large, as seen on recordings of another
/// finite-element code with elements of another size.
fn by_elements(knob: Knob, value: f64) -> f64 {
    match knob {
        Knob::Bulk(BulkKnob::BallCentre(_) | BulkKnob::LooseCentre(_)) => PLACE_M,
        Knob::Bulk(BulkKnob::BallRadius | BulkKnob::LooseRadius) => RADIUS * value,
        Knob::Bulk(BulkKnob::BallRatio) => RATIO,
        _ => 0.0,
    }
}

/// Of a coordinate (m), of a radius (relative), of the logarithm of a ball's modulus.
const PLACE_M: f64 = 1e-3;
const RADIUS: f64 = 0.12;
const RATIO: f64 = 0.3;

fn said(model: &Model<'_>, fitted: &Fitted, knob: Knob, value: f64, sd: f64) -> Estimate {
    if let Knob::Bulk(bulk) = knob {
        let nu = model.settled.recording.phantom.poisson_ratio;
        let (value, slope) = bulk.said(value, fitted.at[0].exp(), nu);
        return Estimate { value, sd: slope.abs() * sd };
    }
    if knob.by_logarithm() {
        Estimate { value: value.exp(), sd: value.exp() * sd }
    } else {
        Estimate { value, sd }
    }
}

/// What follows from the others or was taken as given.
fn complete(model: &Model<'_>, fitted: &Fitted, physics: Physics, parameters: &mut Vec<Parameter>) {
    match physics {
        // Gains are told from the modulus only as ratios: that of z is 1.
        Physics::ForceGain => {
            if let Some(gain) = parameters.iter_mut().find(|p| p.id == "gain") {
                gain.values.push(Estimate { value: 1.0, sd: 0.0 });
            }
        }
        Physics::SlackBand => {
            let value = model.springs_n_per_m(&fitted.acting, &fitted.at);
            let total = Estimate { value, sd: f64::NAN };
            parameters.push(Parameter { id: "stiffness_n_per_m", values: vec![total], list: false });
            let direction = fitted.acting.knobs.iter().find_map(|knob| match knob {
                Knob::Gap(direction) => Some(*direction),
                _ => None,
            });
            if let Some(direction) = direction {
                let values = direction.map(|value| Estimate { value, sd: 0.0 }).to_vec();
                parameters.push(Parameter { id: "direction", values, list: true });
            }
        }
        // It has no parameter of its own.
        Physics::FiniteStrain => parameters.clear(),
        Physics::Anisotropy => {
            let along = fitted.acting.knobs.iter().find_map(|knob| match knob {
                Knob::Bulk(BulkKnob::Along(axis)) => Some(*axis),
                _ => None,
            });
            if let Some(axis) = along {
                let values = axis.map(|value| Estimate { value, sd: 0.0 }).to_vec();
                parameters.push(Parameter { id: "axis", values, list: true });
            }
        }
        _ => {}
    }
}
