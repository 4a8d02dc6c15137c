//! Which grey picture belongs to which depth picture: the one that was taken within half an interval of frames.
//!
//! Both streams come in the order of their times. Of two pictures too far apart the earlier one has no partner any more.

use std::collections::VecDeque;

/// Pictures of one stream that wait for partners, at most: a stream whose partner has died does not pile up.
pub(super) const WAITING: usize = 4;

/// Pictures with their times (s) that wait for partners.
#[derive(Debug)]
pub(super) struct Pairing<G, D> {
    grey: VecDeque<(f64, G)>,
    depth: VecDeque<(f64, D)>,
    tolerance_s: f64,
    unpaired: u64,
}

impl<G, D> Pairing<G, D> {
    pub(super) fn new(interval_s: f64) -> Self {
        let (grey, depth) = (VecDeque::with_capacity(WAITING + 1), VecDeque::with_capacity(WAITING + 1));
        Self { grey, depth, tolerance_s: 0.5 * interval_s, unpaired: 0 }
    }

    pub(super) fn add_grey(&mut self, time_s: f64, picture: G) {
        self.grey.push_back((time_s, picture));
        self.unpaired += u64::from(self.grey.len() > WAITING && self.grey.pop_front().is_some());
    }

    pub(super) fn add_depth(&mut self, time_s: f64, picture: D) {
        self.depth.push_back((time_s, picture));
        self.unpaired += u64::from(self.depth.len() > WAITING && self.depth.pop_front().is_some());
    }

    /// The next pair.
    pub(super) fn next(&mut self) -> Option<(G, D)> {
        loop {
            let (grey, depth) = (self.grey.front()?.0, self.depth.front()?.0);
            let apart = (grey - depth).abs();
            let closer =
                |next: Option<f64>, other: f64| next.is_some_and(|next| (next - other).abs() < apart);
            if apart > self.tolerance_s && grey < depth || closer(self.grey.get(1).map(|g| g.0), depth) {
                self.grey.pop_front();
            } else if apart > self.tolerance_s || closer(self.depth.get(1).map(|d| d.0), grey) {
                self.depth.pop_front();
            } else {
                return self.grey.pop_front().map(|g| g.1).zip(self.depth.pop_front().map(|d| d.1));
            }
            self.unpaired += 1;
        }
    }

    /// Waiting grey pictures, waiting depth pictures.
    pub(super) fn waiting(&self) -> [usize; 2] {
        [self.grey.len(), self.depth.len()]
    }

    /// Pictures without a partner so far.
    pub(super) fn unpaired(&self) -> u64 {
        self.unpaired
    }

    /// Nothing comes any more: what waits has no partner.
    pub(super) fn finish(&mut self) {
        self.unpaired += (self.grey.len() + self.depth.len()) as u64;
        self.grey.clear();
        self.depth.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of numbers, and how many had no partner, when grey and depth pictures come in the order of their times (s).
    fn pairs(grey: &[f64], depth: &[f64]) -> (Vec<(usize, usize)>, u64) {
        let mut pairing = Pairing::new(0.1);
        let mut pairs = Vec::new();
        let mut all: Vec<(f64, bool, usize)> = grey.iter().enumerate().map(|(n, &t)| (t, true, n)).collect();
        all.extend(depth.iter().enumerate().map(|(n, &t)| (t, false, n)));
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (time, is_grey, n) in all {
            if is_grey {
                pairing.add_grey(time, n);
            } else {
                pairing.add_depth(time, n);
            }
            pairs.extend(std::iter::from_fn(|| pairing.next()));
        }
        pairing.finish();
        (pairs, pairing.unpaired())
    }

    #[test]
    fn neighbours_in_time_are_pairs() {
        assert_eq!(pairs(&[0.0, 0.1, 0.2], &[0.02, 0.09, 0.23]), (vec![(0, 0), (1, 1), (2, 2)], 0));
    }

    #[test]
    fn who_has_no_partner_is_counted_and_shifts_nobody() {
        assert_eq!(pairs(&[0.0, 0.1, 0.2, 0.3], &[0.0, 0.2, 0.3]), (vec![(0, 0), (2, 1), (3, 2)], 1));
        assert_eq!(pairs(&[0.1, 0.3], &[0.0, 0.1, 0.2, 0.3]), (vec![(0, 1), (1, 3)], 2));
        assert_eq!(pairs(&[], &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5]), (vec![], 6));
    }

    #[test]
    fn half_an_interval_apart_is_too_far() {
        assert_eq!(pairs(&[0.0], &[0.051]), (vec![], 2));
        assert_eq!(pairs(&[0.0], &[0.049]), (vec![(0, 0)], 0));
    }

    /// Whoever runs ahead waits; the closest of those that wait is taken.
    #[test]
    fn the_closer_one_is_taken() {
        let mut pairing = Pairing::new(0.1);
        pairing.add_grey(0.0, 0);
        pairing.add_grey(0.04, 1);
        pairing.add_depth(0.045, 0);
        assert_eq!((pairing.next(), pairing.next(), pairing.unpaired()), (Some((1, 0)), None, 1));
    }
}
