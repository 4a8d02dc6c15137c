//! From components to candidates: each is looked at on the level half-way between its own surroundings and its own top.
//!
//! A component that is no dot at that level (two dots that flow together, a dot in the halo of a glare) is cut at higher levels until
//! its parts are dots or too small: a walk up the component tree (Salembier, Oliveras & Garrido 1998) along levels worth a look.

use super::runs::{Components, Run, runs_higher};
use super::shape::Shape;
use super::threshold::Levels;
use crate::track::{DotSettings, GreyView};

/// Something that may be a dot.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// Area and moments on its half-way level.
    pub(super) shape: Shape,
    /// Grey level around it.
    pub(super) base: f64,
    /// Grey level of its upper part.
    pub(super) top: f64,
    /// Whether it reaches the border of the picture.
    pub(super) border: bool,
    /// Whether it flows together with something else above its half-way level.
    pub(super) merged: bool,
}

/// Cuts of one component; each takes away a third of the height that is left.
const MOST_CUTS: usize = 6;

/// A walk through components.
pub(super) struct Search<'a> {
    pub(super) view: &'a GreyView<'a>,
    pub(super) settings: &'a DotSettings,
    pub(super) least_height: f64,
    pub(super) found: Vec<Candidate>,
}

impl Search<'_> {
    /// Every component above the levels.
    pub(super) fn all(&mut self, runs: &[Run], levels: &Levels) {
        for component in Components::of(runs).iter() {
            let level = levels.at(component[0].from as usize, component[0].y as usize);
            self.examine(component, level, 0, false);
        }
    }

    fn least_area(&self) -> f64 {
        let least = self.settings.radius_px[0];
        0.5 * std::f64::consts::PI * least * least / self.settings.most_aspect
    }

    fn examine(&mut self, runs: &[Run], level: u8, cuts: usize, merged: bool) {
        let area: usize = runs.iter().map(|r| (r.to - r.from) as usize).sum();
        if (area as f64) < self.least_area() {
            return;
        }
        let (base, top) = (self.around(runs, level), self.top(runs, area));
        if top - base < self.least_height {
            return;
        }
        let half = (0.5 * (base + top)) as u8;
        if half <= level {
            // It is above its half-way level already: cut from above, out of something brighter around it.
            self.decide(runs, level, base, top, cuts, merged);
            return;
        }
        let higher = runs_higher(self.view, runs, half);
        let parts = Components::of(&higher);
        let mut large = parts.iter().filter(|p| self.area(p) >= self.least_area());
        let (Some(first), second) = (large.next(), large.next()) else { return };
        if second.is_none() {
            self.decide(first, half, base, top, cuts, merged);
            return;
        }
        let parts: Vec<&[Run]> = [first].into_iter().chain(second).chain(large).collect();
        for part in parts {
            self.examine_again(part, half, cuts, merged);
        }
    }

    fn examine_again(&mut self, runs: &[Run], level: u8, cuts: usize, merged: bool) {
        if cuts < MOST_CUTS {
            self.examine(runs, level, cuts + 1, merged);
        }
    }

    fn area(&self, runs: &[Run]) -> f64 {
        runs.iter().map(|r| f64::from(r.to - r.from)).sum()
    }

    /// A dot is kept; anything else is cut.
    fn decide(&mut self, runs: &[Run], level: u8, base: f64, top: f64, cuts: usize, merged: bool) {
        let shape = Shape::of(runs);
        let [width, height] = self.view.size();
        let border = runs
            .iter()
            .any(|r| r.from <= 1 || r.y <= 1 || r.to as usize + 1 >= width || r.y as usize + 2 >= height);
        if shape.is_dot(self.settings) {
            self.found.push(Candidate { shape, base, top, border, merged });
            return;
        }
        if shape.area < 2.0 * self.least_area() || cuts >= MOST_CUTS {
            return;
        }
        let next = f64::from(level) + ((top - f64::from(level)) / 3.0).max(1.0);
        if next >= 254.0 {
            return;
        }
        let higher = runs_higher(self.view, runs, next as u8);
        for part in Components::of(&higher).iter() {
            self.examine_again(part, next as u8, cuts, true);
        }
    }

    /// Median grey level of the pixels beside the component's ends that are not above its level.
    fn around(&self, runs: &[Run], level: u8) -> f64 {
        let [width, _] = self.view.size();
        let mut counts = [0_u32; 256];
        for run in runs {
            let row = self.view.row(run.y as usize);
            for x in [run.from.checked_sub(3), Some(run.to + 2)].into_iter().flatten() {
                if (x as usize) < width && row[x as usize] <= level {
                    counts[usize::from(row[x as usize])] += 1;
                }
            }
        }
        quantile(&counts, 0.5).unwrap_or_else(|| f64::from(level))
    }

    /// Upper quarter of the component's grey levels.
    fn top(&self, runs: &[Run], area: usize) -> f64 {
        let mut counts = [0_u32; 256];
        // Of a huge component every 16th row says enough.
        let step = if area > 20_000 { 16 } else { 1 };
        for &p in runs.iter().step_by(step).flat_map(|r| r.pixels(self.view)) {
            counts[usize::from(p)] += 1;
        }
        quantile(&counts, 0.75).unwrap_or(0.0)
    }
}

fn quantile(counts: &[u32; 256], share: f64) -> Option<f64> {
    let total: u32 = counts.iter().sum();
    let mut left = share * f64::from(total);
    for (value, &count) in counts.iter().enumerate() {
        left -= f64::from(count);
        if left < 0.0 {
            return Some(value as f64);
        }
    }
    None
}
