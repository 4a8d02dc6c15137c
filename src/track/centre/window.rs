//! Which pixels tell where a dot is: those inside its rim and a margin around it, without what belongs to others.

use super::model::BlurredDisc;
use crate::track::GreyView;
use nalgebra::Vector2;
use wide::f32x8;

/// A pixel and its grey level.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) at: Vector2<f64>,
    pub(super) value: f64,
}

/// Eight pixels, in single precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Eight {
    /// Places, from an origin close by (px).
    pub(super) x: f32x8,
    pub(super) y: f32x8,
    pub(super) value: f32x8,
    /// 1, or 0 for a place that no pixel fills.
    pub(super) there: f32x8,
}

/// Fills `eights` with the pixels, their places told from `origin`.
pub(super) fn by_eights(samples: &[Sample], origin: Vector2<f64>, eights: &mut Vec<Eight>) {
    eights.clear();
    eights.extend(samples.chunks(8).map(|samples| {
        let each = |of: &dyn Fn(&Sample) -> f64| {
            let mut lanes = [0.0; 8];
            for (lane, sample) in lanes.iter_mut().zip(samples) {
                *lane = of(sample) as f32;
            }
            f32x8::from(lanes)
        };
        Eight {
            x: each(&|s| s.at.x - origin.x),
            y: each(&|s| s.at.y - origin.y),
            value: each(&|s| s.value),
            there: each(&|_| 1.0),
        }
    }));
}

/// Pixels this far outside the rim and above half the dot's height belong to another dot or to a glare (px).
const OWN: f64 = 2.0;

/// Pixels farther than this from the rim are certainly not on its blur (px); those nearer come first.
const RIM: f64 = 4.0;

/// Fills `samples` with the pixels within `margin` px of the dot's rim, those about the rim first.
pub(super) fn gather(view: &GreyView<'_>, dot: &BlurredDisc, margin: f64, samples: &mut Vec<Sample>) {
    samples.clear();
    let [width, height] = view.size();
    let Some(to_plane) = dot.to_circle().try_inverse() else { return };
    let centre = dot.centre();
    // Half-width of the ellipse {A⁻¹e : |e| = 1} along an axis is the length of that row of A⁻¹.
    let reach = [to_plane.row(0).norm() + margin, to_plane.row(1).norm() + margin];
    let from = |c: f64, r: f64| (c - r).ceil().max(0.0) as usize;
    let to = |c: f64, r: f64, most: usize| ((c + r).floor().max(-1.0) + 1.0).min(most as f64) as usize;
    let (x0, x1) = (from(centre.x, reach[0]), to(centre.x, reach[0], width));
    let half = dot.base() + 0.5 * dot.height();
    let mut about_rim = 0;
    for y in from(centre.y, reach[1])..to(centre.y, reach[1], height) {
        let row = view.row(y);
        for (x, &level) in row.iter().enumerate().take(x1).skip(x0) {
            let at = Vector2::new(x as f64, y as f64);
            let distance = dot.distance(at);
            let value = f64::from(level);
            if distance >= -margin && !(distance < -OWN && value > half) {
                samples.push(Sample { at, value });
                if distance.abs() < RIM {
                    let last = samples.len() - 1;
                    samples.swap(about_rim, last);
                    about_rim += 1;
                }
            }
        }
    }
}
