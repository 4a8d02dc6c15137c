//! Which pixels tell where a dot is: those inside its rim and a margin around it, without what belongs to others.

use super::model::BlurredDisc;
use crate::track::GreyView;
use nalgebra::Vector2;

/// A pixel and its grey level.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) at: Vector2<f64>,
    pub(super) value: f64,
}

/// Pixels this far outside the rim and above half the dot's height belong to another dot or to a glare (px).
const OWN: f64 = 2.0;

/// Fills `samples` with the pixels within `margin` px of the dot's rim.
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
    for y in from(centre.y, reach[1])..to(centre.y, reach[1], height) {
        let row = view.row(y);
        for (x, &level) in row.iter().enumerate().take(x1).skip(x0) {
            let at = Vector2::new(x as f64, y as f64);
            let distance = dot.distance(at);
            let value = f64::from(level);
            if distance >= -margin && !(distance < -OWN && value > half) {
                samples.push(Sample { at, value });
            }
        }
    }
}
