//! One frame after another: what is remembered of each dot, and which detection it is.

use super::matching::{Detections, Matcher, Matching};
use super::near::Near;
use super::reference::Reference;
use crate::track::{Dot, IdentitySettings, TrackError};
use nalgebra::Vector2;

/// Why a dot has no identity in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lost {
    /// Nothing was where it should be: hidden, or only partly to be seen.
    NotSeen,
    /// Something was, but it might be another dot, or more than one thing might be it.
    Doubtful,
    /// Several motions of all dots explain the frame about as well.
    Ambiguous,
    /// Too few certain neighbours to tell where to look.
    Alone,
}

/// What is remembered of a dot.
#[derive(Debug, Clone, Copy)]
pub(super) struct Past {
    /// Where it was last (px), or where its neighbours put it.
    pub(super) place: Vector2<f64>,
    /// Motion from frame to frame (px), where it was in the last two.
    pub(super) velocity: Option<Vector2<f64>>,
    /// Frames since it was last seen.
    pub(super) unseen: u32,
    /// Area in the reference (px²).
    pub(super) reference_area: f64,
}

/// Cost of a dot that should be visible and is not (nats): one in seven dots may be hidden.
const HIDDEN: f64 = 2.0;
/// Cost of a detection that is nobody (nats): one in twenty may be a glint.
const NOBODY: f64 = 3.0;
/// What a dot off its place by this part of its spacing costs ½ nat, and the most that it can cost.
const OFF: f64 = 0.03;
const MOST_OFF: f64 = 3.0;
/// Share of the dots that explain themselves without a shift, from which no shift is looked for.
const ENOUGH: f64 = 0.5;
/// Shifts that are tried.
const MOST_SHIFTS: usize = 12;
/// Share of dots that a shift must put onto detections to be tried.
const LEAST_VOTES: f64 = 0.25;

/// Follows dots through frames.
#[derive(Debug, Clone)]
pub(in crate::track) struct Linker {
    reference: Reference,
    past: Vec<Past>,
    settings: IdentitySettings,
    size_px: [usize; 2],
    /// Whether the reference picture shows that there are no dots but those of the reference: a spacing and a half of nothing all round.
    /// Otherwise dots may come into the picture from outside, and detections beyond the others prove nothing.
    closed: bool,
}

impl Linker {
    /// From the dots of a reference picture of size `size_px`, in whose order dots are numbered.
    pub(in crate::track) fn new(
        dots: &[Dot],
        settings: IdentitySettings,
        size_px: [usize; 2],
    ) -> Result<Self, TrackError> {
        let reference = Reference::new(dots.iter().map(|d| d.centre_px.into()).collect())?;
        let past = dots
            .iter()
            .map(|d| Past { place: d.centre_px.into(), velocity: None, unseen: 0, reference_area: area(d) })
            .collect();
        let margin = 1.5 * reference.typical_spacing();
        let closed = reference
            .places
            .iter()
            .all(|p| (0..2).all(|k| p[k] > margin && p[k] < size_px[k] as f64 - 1.0 - margin));
        Ok(Self { reference, past, settings, size_px, closed })
    }

    /// The detection of each dot in the next frame; `skipped` frames were lost since the last.
    pub(in crate::track) fn step(&mut self, dots: &[Dot], skipped: u32) -> Vec<Result<usize, Lost>> {
        for past in self.past.iter_mut().filter(|_| skipped > 0) {
            // Who knows what happened meanwhile.
            past.unseen = past.unseen.saturating_add(skipped);
        }
        let places: Vec<Vector2<f64>> = dots.iter().map(|d| d.centre_px.into()).collect();
        let areas: Vec<f64> = dots.iter().map(area).collect();
        let whole: Vec<bool> = dots.iter().map(Dot::is_whole).collect();
        let near = Near::new(&places, self.reference.typical_spacing());
        let seen = Detections { places: &places, areas: &areas, whole: &whole, near };
        let explained = self.explain(&seen);
        let result = (0..self.past.len())
            .map(|i| match &explained {
                None => Err(Lost::Ambiguous),
                Some(m) => m.of_dot[i].ok_or(match (m.doubtful[i], m.predicted[i]) {
                    (true, _) => Lost::Doubtful,
                    (false, Some(_)) => Lost::NotSeen,
                    (false, None) => Lost::Alone,
                }),
            })
            .collect();
        self.remember(explained.as_ref(), &places);
        result
    }

    fn explain(&self, seen: &Detections<'_>) -> Option<Matching> {
        let matcher =
            Matcher { reference: &self.reference, past: &self.past, settings: &self.settings, seen };
        let still = matcher.attempt(Vector2::zeros(), false);
        let count = |m: &Matching| m.of_dot.iter().flatten().count() as f64;
        let possible = (self.past.iter().filter(|p| p.unseen == 0).count())
            .max(self.past.len() / 4)
            .min(seen.places.len());
        if count(&still) >= ENOUGH * possible as f64 && count(&still) > 0.0 {
            return Some(still);
        }
        let mut tried: Vec<(f64, Matching)> = vec![(self.evidence(&still, seen), still)];
        for shift in self.shifts(seen) {
            let attempt = matcher.attempt(shift, true);
            if !self.is_possible(&attempt, seen) {
                continue;
            }
            let same = |other: &Matching| {
                let differing = attempt
                    .of_dot
                    .iter()
                    .zip(&other.of_dot)
                    .filter(|(a, b)| a.is_some() && b.is_some() && a != b);
                differing.count() == 0
            };
            let evidence = self.evidence(&attempt, seen);
            match tried.iter_mut().find(|(_, other)| same(other) && count(other) > 0.0) {
                Some(known) if known.0 < evidence => *known = (evidence, attempt),
                Some(_) => {}
                None => tried.push((evidence, attempt)),
            }
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let margin = tried.get(1).map_or(f64::INFINITY, |second| tried[0].0 - second.0);
        let (_, best) = tried.swap_remove(0);
        let enough = count(&best) >= LEAST_VOTES * self.past.len() as f64;
        (enough && margin >= self.settings.least_evidence).then_some(best)
    }

    /// Shifts that put many dots onto detections: peaks of the histogram of all differences (Ballard 1981).
    fn shifts(&self, seen: &Detections<'_>) -> Vec<Vector2<f64>> {
        let spacing = self.reference.typical_spacing();
        let bin = spacing / 8.0;
        // Every place that the dots can have reached since they were last seen must be looked at, or the truth may not be among what is tried.
        let frames = self.past.iter().map(|p| p.unseen).min().unwrap_or(0);
        let farthest = (self.size_px[0] as f64).hypot(self.size_px[1] as f64);
        let reach =
            (1.1 * self.settings.most_motion * spacing * (f64::from(frames) + 1.0) + bin).min(farthest);
        let half = (reach / bin).ceil() as usize;
        let wide = 2 * half + 3;
        let mut votes = vec![0.0; wide * wide];
        for past in &self.past {
            for (j, _) in seen.near.within(past.place, reach) {
                let at = (seen.places[j] - past.place) / bin;
                let (x, y) = (at.x + half as f64 + 1.0, at.y + half as f64 + 1.0);
                let (i, j) = (x as usize, y as usize);
                let (fx, fy) = (x.fract(), y.fract());
                for (di, dj, w) in [
                    (0, 0, (1.0 - fx) * (1.0 - fy)),
                    (1, 0, fx * (1.0 - fy)),
                    (0, 1, (1.0 - fx) * fy),
                    (1, 1, fx * fy),
                ] {
                    if i + di < wide && j + dj < wide {
                        votes[(j + dj) * wide + i + di] += w;
                    }
                }
            }
        }
        let sum = |i: usize, j: usize| -> f64 {
            (j - 1..=j + 1).map(|y| (i - 1..=i + 1).map(|x| votes[y * wide + x]).sum::<f64>()).sum()
        };
        let mut peaks: Vec<(f64, usize, usize)> = Vec::new();
        for j in 1..wide - 1 {
            for i in 1..wide - 1 {
                let here = sum(i, j);
                if here >= LEAST_VOTES * self.past.len() as f64 {
                    peaks.push((here, i, j));
                }
            }
        }
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut chosen: Vec<(usize, usize)> = Vec::new();
        for (_, i, j) in peaks {
            if chosen.len() < MOST_SHIFTS && chosen.iter().all(|&(a, b)| a.abs_diff(i).max(b.abs_diff(j)) > 2)
            {
                chosen.push((i, j));
            }
        }
        let offset = |i: usize| (i as f64 - half as f64 - 1.0) * bin;
        chosen.into_iter().map(|(i, j)| Vector2::new(offset(i), offset(j))).collect()
    }

    /// Whether dots need not have moved farther than dots do: the median over those that the last frame held.
    fn is_possible(&self, m: &Matching, seen: &Detections<'_>) -> bool {
        let mut moved: Vec<f64> = (m.of_dot.iter().zip(&self.past).enumerate())
            .filter(|(_, (_, past))| past.unseen == 0)
            .filter_map(|(i, (j, past))| {
                Some((seen.places[(*j)?] - past.place).norm() / self.reference.spacing[i])
            })
            .collect();
        let half = moved.len() / 2;
        moved.is_empty() || *moved.select_nth_unstable_by(half, f64::total_cmp).1 <= self.settings.most_motion
    }

    /// How well an attempt explains the frame (nats, up to a constant).
    fn evidence(&self, m: &Matching, seen: &Detections<'_>) -> f64 {
        let inside = |p: Vector2<f64>, margin: f64| {
            (0..2).all(|k| p[k] > margin && p[k] < self.size_px[k] as f64 - margin)
        };
        let spacing = self.reference.typical_spacing();
        let mut evidence = 0.0;
        for i in 0..self.past.len() {
            match m.of_dot[i] {
                Some(_) => evidence -= (0.5 * (m.misfit[i] / OFF).powi(2)).min(MOST_OFF),
                None => {
                    // Outside the picture, or nearly so, nobody expects it.
                    let place = m.predicted[i].unwrap_or(self.past[i].place + m.shift);
                    evidence -= if inside(place, 0.5 * spacing) { HIDDEN } else { 0.0 };
                }
            }
        }
        for (j, dot) in m.of_detection.iter().enumerate() {
            if dot.is_none() && seen.whole[j] && (self.closed || surrounded(m, seen, j, 2.2 * spacing)) {
                evidence -= NOBODY;
            }
        }
        evidence
    }

    fn remember(&mut self, explained: Option<&Matching>, places: &[Vector2<f64>]) {
        for (i, past) in self.past.iter_mut().enumerate() {
            match explained.and_then(|m| m.of_dot[i]) {
                Some(j) => {
                    let known = past.unseen == 0;
                    past.velocity = known.then(|| places[j] - past.place);
                    past.place = places[j];
                    past.unseen = 0;
                }
                None => {
                    past.velocity = None;
                    past.unseen = past.unseen.saturating_add(1);
                    if let Some(place) = explained.and_then(|m| m.predicted[i]) {
                        past.place = place;
                    }
                }
            }
        }
    }
}

/// Area of a dot's image (px²).
fn area(dot: &Dot) -> f64 {
    std::f64::consts::PI * dot.rim_px.determinant()
}

/// Whether certain dots lie on all four sides of a detection.
fn surrounded(m: &Matching, seen: &Detections<'_>, j: usize, radius: f64) -> bool {
    let mut sides = [false; 4];
    for (k, _) in seen.near.within(seen.places[j], radius).filter(|&(k, _)| m.of_detection[k].is_some()) {
        let away = seen.places[k] - seen.places[j];
        sides[usize::from(away.x > 0.0) + 2 * usize::from(away.y > 0.0)] = true;
    }
    sides.iter().all(|&side| side)
}
