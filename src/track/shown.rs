//! What a person should be shown of the dots of each frame: where every one is or was last, and what is known of it.

use super::{Dot, Frame, Lost, State};
use crate::device::{DotInPicture, Sight};

/// The dots of the last frame, to be drawn into its picture.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ShownDots {
    /// Those of the reference in their order, then what else looks like one.
    dots: Vec<DotInPicture>,
    followed: usize,
}

impl ShownDots {
    /// Those of a reference picture, where they are in it; lost until a frame shows them.
    pub fn of_reference(reference: &[Dot]) -> Self {
        let resting = |(number, dot): (u32, &Dot)| DotInPicture {
            number: Some(number),
            centre_px: dot.centre_px,
            radius_px: dot.radius_px(),
            sight: Sight::Lost,
        };
        let dots: Vec<_> = (0..).zip(reference).map(resting).collect();
        Self { followed: dots.len(), dots }
    }

    /// A frame in which nothing was followed.
    pub fn lose(&mut self) {
        self.dots.truncate(self.followed);
        self.dots.iter_mut().for_each(|dot| dot.sight = Sight::Lost);
    }

    /// The next frame of the tracker of the same reference.
    pub fn take(&mut self, frame: &Frame) {
        self.lose();
        for (shown, state) in self.dots.iter_mut().zip(&frame.dots) {
            shown.sight = match state {
                State::Certain { place: Ok(_), .. } => Sight::Certain,
                State::Certain { place: Err(_), .. }
                | State::Lost(Lost::Doubtful | Lost::Ambiguous | Lost::Alone) => Sight::Uncertain,
                State::Lost(Lost::NotSeen) => Sight::Lost,
            };
            if let State::Certain { dot, .. } = state {
                (shown.centre_px, shown.radius_px) = (dot.centre_px, dot.radius_px());
            }
        }
        // Where it is not known how all dots moved, nothing is known to be none of them.
        if frame.dots.contains(&State::Lost(Lost::Ambiguous)) {
            return;
        }
        let strangers = frame.strangers.iter().map(|dot| DotInPicture {
            number: None,
            centre_px: dot.centre_px,
            radius_px: dot.radius_px(),
            sight: Sight::New,
        });
        // What may be a dot of the reference is shown as that.
        let known = |stranger: &DotInPicture| {
            self.dots.iter().any(|dot| {
                let [dx, dy] = [0, 1].map(|a| dot.centre_px[a] - stranger.centre_px[a]);
                dot.sight == Sight::Uncertain && dx.hypot(dy) < dot.radius_px + stranger.radius_px
            })
        };
        let new: Vec<_> = strangers.filter(|stranger| !known(stranger)).collect();
        self.dots.extend(new);
    }

    /// All of them.
    pub fn dots(&self) -> &[DotInPicture] {
        &self.dots
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::NoDepth;
    use nalgebra::Matrix2;

    fn dot(x: f64) -> Dot {
        Dot {
            centre_px: [x, 5.0],
            covariance_px2: Matrix2::identity(),
            light: None,
            rim_px: Matrix2::identity() * 3.0,
            contrast: 100.0,
            background: 20.0,
            blur_px: None,
            quality: 0.0,
            saturated: false,
            border: false,
            merged: false,
        }
    }

    /// Dot 0 moves and has no depth, dot 1 is hidden, dot 2 may be another; something that may be it lies beside it, something new at 70 px.
    #[test]
    fn dots_are_shown_where_they_were_seen_last() {
        let mut shown = ShownDots::of_reference(&[dot(10.0), dot(20.0), dot(30.0)]);
        let frame =
            |dots: Vec<State>, strangers: Vec<Dot>| Frame { time_s: 0.0, dots, strangers, noise: 1.0 };
        let seen = |x: f64| State::Certain { dot: dot(x), place: Err(NoDepth::NoPicture) };
        let lost = State::Lost;
        let told = |shown: &ShownDots| -> Vec<_> {
            shown.dots().iter().map(|d| (d.number, d.centre_px[0], d.sight)).collect()
        };
        shown.take(&frame(
            vec![seen(12.0), lost(Lost::NotSeen), lost(Lost::Doubtful)],
            vec![dot(32.0), dot(70.0)],
        ));
        assert_eq!(
            told(&shown),
            [
                (Some(0), 12.0, Sight::Uncertain),
                (Some(1), 20.0, Sight::Lost),
                (Some(2), 30.0, Sight::Uncertain),
                (None, 70.0, Sight::New)
            ]
        );
        shown.take(&frame(vec![lost(Lost::Alone), seen(21.0), lost(Lost::Ambiguous)], vec![dot(70.0)]));
        assert_eq!(
            told(&shown),
            [
                (Some(0), 12.0, Sight::Uncertain),
                (Some(1), 21.0, Sight::Uncertain),
                (Some(2), 30.0, Sight::Uncertain)
            ]
        );
        shown.lose();
        assert!(shown.dots().iter().all(|d| d.sight == Sight::Lost));
    }
}
