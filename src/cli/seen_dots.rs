//! The dots of a frame as they are drawn: for the strip of `track` and for what `run` shows live.

use crate::device::{DotInPicture, Sight};
use crate::report::{Mark, MarkedDot};
use std::fmt::Write as _;

/// What the marks of a picture mean.
pub(super) const LEGEND: [(Mark, &str); 4] = [
    (Mark::Certain, "certain"),
    (Mark::Uncertain, "uncertain: no sure place, or partly covered"),
    (Mark::Lost, "lost: not seen, drawn where it was last"),
    (Mark::New, "new: looks like a dot, taken for none of them"),
];

/// What stands above a picture: its time, its frame, and how many dots are followed in it.
pub(super) fn caption(time_s: f64, number: u32, dots: &[DotInPicture]) -> String {
    let count = |sight| dots.iter().filter(|dot| dot.sight == sight).count();
    let (certain, new) = (count(Sight::Certain), count(Sight::New));
    let mut said = format!("{time_s:.3} s, frame {number}: {certain} of {} dots certain", dots.len() - new);
    for (sight, word) in [(Sight::Uncertain, "uncertain"), (Sight::Lost, "lost"), (Sight::New, "new")] {
        if count(sight) > 0 {
            let _ = write!(said, ", {} {word}", count(sight));
        }
    }
    said
}

/// The dots with their marks.
pub(super) fn marked(dots: &[DotInPicture]) -> Vec<MarkedDot> {
    let marked = |dot: &DotInPicture| MarkedDot {
        number: dot.number,
        centre_px: dot.centre_px,
        radius_px: dot.radius_px,
        mark: match dot.sight {
            Sight::Certain => Mark::Certain,
            Sight::Uncertain => Mark::Uncertain,
            Sight::Lost => Mark::Lost,
            Sight::New => Mark::New,
        },
    };
    dots.iter().map(marked).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_caption_counts_what_is_followed_and_what_is_new() {
        let dots = |sights: &[Sight]| -> Vec<DotInPicture> {
            let dot = |sight: &Sight| DotInPicture {
                number: (*sight != Sight::New).then_some(7),
                centre_px: [1.0, 2.0],
                radius_px: 3.0,
                sight: *sight,
            };
            sights.iter().map(dot).collect()
        };
        let some = dots(&[Sight::Certain, Sight::Lost, Sight::Certain, Sight::New, Sight::Uncertain]);
        assert_eq!(
            caption(12.3456, 370, &some),
            "12.346 s, frame 370: 2 of 4 dots certain, 1 uncertain, 1 lost, 1 new"
        );
        assert_eq!(caption(-0.25, 0, &dots(&[Sight::Certain])), "-0.250 s, frame 0: 1 of 1 dots certain");
        assert_eq!(caption(0.0, 1, &[]), "0.000 s, frame 1: 0 of 0 dots certain");
        let drawn: Vec<_> = marked(&some).into_iter().map(|dot| (dot.number, dot.mark)).collect();
        assert_eq!((drawn[0], drawn[3]), ((Some(7), Mark::Certain), (None, Mark::New)));
        assert_eq!((drawn[1].1, drawn[4].1), (Mark::Lost, Mark::Uncertain));
    }
}
