//! Which dots are followed: those of the first picture in which nothing moves, and those that it does not show and others of that time do.
//!
//! A dot that a hand, a glare or the tip hides in one picture is there in the others, in the same place. One that is hidden as long as nothing
//! moves has no place of rest, from which it could have moved: it is not followed, and counted in each frame that shows it.

use crate::track::Dot;

/// Pictures that are looked at: so many at least where there are as many, and fewer than twice that.
const PICTURES: usize = 16;
/// A dot that is so close to where another picture shows one is the same (px).
const SAME_PX: f64 = 1.0;
/// A dot must be in two pictures, and in one of so many: what is seen once may be a glint of something that moves.
const ONE_OF: usize = 4;

/// The dots of some of many pictures, evenly spread over them, however many will come.
pub(super) struct Thinned {
    pictures: Vec<Vec<Dot>>,
    every: usize,
    come: usize,
}

impl Default for Thinned {
    fn default() -> Self {
        Self { pictures: Vec::new(), every: 1, come: 0 }
    }
}

impl Thinned {
    /// Whether the next picture is one of those that are looked at.
    pub(super) fn takes_next(&mut self) -> bool {
        self.come += 1;
        (self.come - 1).is_multiple_of(self.every)
    }

    /// The dots of the picture that was asked for last.
    pub(super) fn put(&mut self, dots: Vec<Dot>) {
        self.pictures.push(dots);
        if self.pictures.len() >= 2 * PICTURES {
            let mut number = 0;
            self.pictures.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.every *= 2;
        }
    }

    /// The dots of the first picture, then those that only others show; how many those are.
    pub(super) fn reference(self) -> (Vec<Dot>, usize) {
        let mut pictures = self.pictures.into_iter();
        let mut dots = pictures.next().unwrap_or_default();
        let (first, others) = (dots.len(), pictures.collect::<Vec<_>>());
        for dot in others.iter().flatten() {
            let free = dots.iter().all(|d| d.distance_px(dot) > d.radius_px() + dot.radius_px());
            let is_in = |picture: &&Vec<Dot>| picture.iter().any(|d| d.distance_px(dot) < SAME_PX);
            let seen = others.iter().filter(is_in).count();
            if free && seen >= others.len().div_ceil(ONE_OF).max(2) {
                dots.push(*dot);
            }
        }
        let hidden = dots.len() - first;
        (dots, hidden)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    fn dot(x: f64) -> Dot {
        Dot {
            centre_px: [x, 20.0],
            covariance_px2: Matrix2::identity() * 1e-4,
            light: None,
            rim_px: Matrix2::identity() * 4.0,
            contrast: 100.0,
            background: 20.0,
            blur_px: Some(0.8),
            quality: 0.99,
            saturated: false,
            border: false,
            merged: false,
        }
    }

    #[test]
    fn pictures_are_spread_over_however_many_come() {
        for count in [1, 5, 31, 32, 1000] {
            let mut thinned = Thinned::default();
            for number in 0..count {
                if thinned.takes_next() {
                    thinned.put(vec![dot(f64::from(number))]);
                }
            }
            let taken: Vec<f64> = thinned.pictures.iter().map(|p| p[0].centre_px[0]).collect();
            assert!(
                taken[0] == 0.0 && taken.len() >= PICTURES.min(count as usize) && taken.len() < 2 * PICTURES
            );
            let step = taken.get(1).map_or(1.0, |second| second - taken[0]);
            assert!(taken.windows(2).all(|w| w[1] - w[0] == step), "{count}: {taken:?}");
            assert!(taken[taken.len() - 1] + 2.0 * step >= f64::from(count), "{count}: {taken:?}");
        }
    }

    #[test]
    fn what_the_first_picture_hides_is_added_and_what_passes_by_is_not() {
        let mut thinned = Thinned::default();
        for number in 0..12 {
            assert!(thinned.takes_next());
            let mut dots = vec![dot(20.0), dot(40.0)];
            // One comes into view, one is seen once, one wanders.
            dots.extend((number >= 4).then(|| dot(60.0 + 0.01 * f64::from(number))));
            dots.extend((number == 5).then(|| dot(80.0)));
            dots.push(dot(100.0 + 3.0 * f64::from(number)));
            thinned.put(dots);
        }
        let (dots, hidden) = thinned.reference();
        let places: Vec<f64> = dots.iter().map(|d| d.centre_px[0].round()).collect();
        assert_eq!((places, hidden), (vec![20.0, 40.0, 100.0, 60.0], 1));
    }
}
