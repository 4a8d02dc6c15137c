//! Which dots were in full view: what covers a dot in part, or cuts its light in two, moves its centre.
//!
//! A disc of even brightness explains all but a thousandth or so of what a picture shows of a dot: paint is ragged, and stays so. Where a rod
//! in front of it hides a sliver, or the edge of a shadow lies across it, more is left: 0.007 of the variance where the centre is off by a
//! twentieth of a pixel, 0.02 at a tenth (on the simulated bench, dots of 4.5 px radius). Each dot is compared with itself at its best, for it may be
//! half in a shadow while it rests, and with what the other dots of the frame have lost, for motion blurs all of them.

use super::follow::{FollowedFrame, Place};

/// So much more left unexplained is no full view (share of the variance).
const MORE: f64 = 0.003;
/// A dot at its best: better than all but this share of its frames, so that no single one decides.
const BEST: f64 = 0.02;

/// The place of a dot that was not in full view.
pub(super) struct Unclear {
    /// Which of the frames, from 0.
    pub(super) frame: usize,
    pub(super) dot: usize,
    pub(super) place: Place,
}

/// Takes away the places of dots that were not in full view, and hands them out.
pub(super) fn leave_out_unclear(frames: &mut [FollowedFrame]) -> Vec<Unclear> {
    let dots = frames.first().map_or(0, |frame| frame.places.len());
    let best: Vec<f64> = (0..dots)
        .map(|dot| {
            let seen = frames.iter().filter_map(|frame| Some(frame.places[dot].as_ref()?.unexplained));
            quantile(seen.collect(), BEST)
        })
        .collect();
    let mut left_out = Vec::new();
    for (number, frame) in frames.iter_mut().enumerate() {
        let seen = frame.places.iter().zip(&best);
        let more: Vec<f64> = seen.filter_map(|(p, best)| Some(p.as_ref()?.unexplained - best)).collect();
        let limit = MORE + quantile(more, 0.5).max(0.0);
        for (dot, (place, best)) in frame.places.iter_mut().zip(&best).enumerate() {
            if let Some(place) = place.take_if(|p| p.unexplained - best > limit) {
                left_out.push(Unclear { frame: number, dot, place });
            }
        }
    }
    left_out
}

/// The value that this share of the others is below; 0 of none.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    let place = (share * values.len() as f64) as usize;
    if place >= values.len() {
        return 0.0;
    }
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::HostTime;
    use crate::geometry::{Mat3, Vec3};

    /// Three dots: one always clear, one that rests half in a shadow, one that is hidden now and then; all blurred in frame 30.
    #[test]
    fn dots_in_part_of_a_view_are_gaps() {
        let unexplained = |frame: u32, dot: u32| {
            let own = match dot {
                1 if frame < 20 => 0.012,
                2 if frame == 25 => 0.008,
                _ => 0.001 * f64::from(1 + dot),
            };
            own + if frame == 30 { 0.01 } else { 0.0 }
        };
        let place = |unexplained| {
            let (position_m, covariance_m2) = (Vec3::zeros(), Mat3::identity());
            Some(Place { position_m, covariance_m2, centre_px: [0.0; 2], unexplained })
        };
        let mut frames: Vec<FollowedFrame> = (0..40)
            .map(|number| FollowedFrame {
                segment: 1,
                host: HostTime::from_nanos(u64::from(number)),
                number,
                places: (0..3)
                    .map(|dot| place(unexplained(number, dot)).filter(|_| dot < 2 || number != 26))
                    .collect(),
                unplaced: Vec::new(),
                others: 0,
            })
            .collect();
        let left_out = leave_out_unclear(&mut frames);
        let named = |frame| left_out.iter().filter(|u| u.frame == frame).map(|u| u.dot).collect::<Vec<_>>();
        assert_eq!((left_out.len(), named(19), named(25)), (21, vec![1], vec![2]));
        for frame in &frames {
            let seen: Vec<bool> = frame.places.iter().map(Option::is_some).collect();
            let expected = [true, frame.number >= 20, ![25, 26].contains(&frame.number)];
            assert_eq!(seen, expected, "{}", frame.number);
        }
        assert!(leave_out_unclear(&mut []).is_empty());
    }
}
