//! Which detection is which dot, given where dots were and a shift of them all: seeds, growth, and what is taken back.
//!
//! Seeds are dots that lie where the shift puts them, with no other explanation within reach. From there identity grows dot by dot: what
//! has three certain neighbours or more is predicted from their motion, and is accepted where exactly one detection answers. At the end
//! everything must fit its neighbours once more: no triangle turned over, no dot far from where the others put it.

use super::assignment::assign;
use super::linker::Past;
use super::near::Near;
use super::prediction::{LEAST_SUPPORT, predict};
use super::reference::Reference;
use super::triangulation::orientation;
use crate::track::IdentitySettings;
use nalgebra::Vector2;

/// A rival within this many times the distance of the best makes a choice doubtful.
const RIVAL: f64 = 2.5;
/// A detection that differs from its neighbours by more than this factor in area, before and after, is only a part, or more than one.
const AREA: f64 = 1.15;
/// A dot that fits its neighbours worse than they fit theirs, by this factor and this part of a spacing, is something else in its place.
const STRANGE: [f64; 2] = [4.0, 0.05];
/// Neighbours that a dot asks for first; then fewer.
const SUPPORTS: [usize; 3] = [6, 4, LEAST_SUPPORT];

/// What a frame offers.
pub(super) struct Detections<'a> {
    pub(super) places: &'a [Vector2<f64>],
    /// Areas (px²).
    pub(super) areas: &'a [f64],
    /// Whether each is a whole dot.
    pub(super) whole: &'a [bool],
    pub(super) near: Near<'a>,
}

/// An attempt to explain a frame.
#[derive(Debug, Clone)]
pub(super) struct Matching {
    /// The shift that it began with (px).
    pub(super) shift: Vector2<f64>,
    /// Detection of each dot.
    pub(super) of_dot: Vec<Option<usize>>,
    /// Dot of each detection.
    pub(super) of_detection: Vec<Option<usize>>,
    /// Where each dot was predicted to be, where anything was.
    pub(super) predicted: Vec<Option<Vector2<f64>>>,
    /// Which dots had more than one explanation.
    pub(super) doubtful: Vec<bool>,
    /// Distance of each dot from where its neighbours put it, in spacings.
    pub(super) misfit: Vec<f64>,
}

/// Everything that an attempt needs.
pub(super) struct Matcher<'a> {
    pub(super) reference: &'a Reference,
    pub(super) past: &'a [Past],
    pub(super) settings: &'a IdentitySettings,
    pub(super) seen: &'a Detections<'a>,
}

impl Matcher<'_> {
    /// Explains the frame by a shift of all dots and what deforms them. Without `anyone`, seeds are only dots that the last frame held, so
    /// that with no shift a seed would be wrong only if a dot had moved farther than dots do.
    pub(super) fn attempt(&self, shift: Vector2<f64>, anyone: bool) -> Matching {
        let count = self.reference.len();
        let mut m = Matching {
            shift,
            of_dot: vec![None; count],
            of_detection: vec![None; self.seen.places.len()],
            predicted: vec![None; count],
            doubtful: vec![false; count],
            misfit: vec![0.0; count],
        };
        self.seed(&mut m, shift, anyone);
        // Dots go on as they did; what did something else is found from its neighbours' motion alone.
        for steady in [true, false] {
            for least in SUPPORTS {
                while self.grow(&mut m, least, steady) {}
            }
        }
        self.take_back(&mut m);
        m
    }

    fn seed(&self, m: &mut Matching, shift: Vector2<f64>, anyone: bool) {
        // Farther from its place than this, a dot's neighbour could have come instead.
        let gate = self.settings.gate.min(0.5 * (1.0 - self.settings.most_motion));
        let mut claims: Vec<Vec<usize>> = vec![Vec::new(); self.seen.places.len()];
        for (i, past) in self.past.iter().enumerate() {
            if past.unseen > 0 && !anyone {
                continue;
            }
            let spacing = self.reference.spacing[i];
            let mut close = self.seen.near.within(past.place + shift, gate * spacing);
            if let (Some((j, _)), None) = (close.next(), close.next()) {
                claims[j].push(i);
            }
        }
        for (j, claim) in claims.iter().enumerate() {
            if let (&[i], true) = (claim.as_slice(), self.seen.whole[j]) {
                m.of_dot[i] = Some(j);
            }
        }
        // A seed moves as its neighbours do, or it is none.
        let moved: Vec<Option<Vector2<f64>>> =
            (0..m.of_dot.len()).map(|i| Some(self.seen.places[m.of_dot[i]?] - self.past[i].place)).collect();
        for i in 0..moved.len() {
            let Some(own) = moved[i] else { continue };
            let mut others: Vec<Vector2<f64>> =
                self.reference.support[i].iter().filter_map(|&k| moved[k]).collect();
            let typical =
                (others.len() >= 2).then(|| Vector2::new(middle(&mut others, 0), middle(&mut others, 1)));
            let agrees = typical.is_some_and(|t| (own - t).norm() <= 0.5 * gate * self.reference.spacing[i]);
            match (agrees, m.of_dot[i]) {
                (true, Some(j)) => m.of_detection[j] = Some(i),
                _ => m.of_dot[i] = None,
            }
        }
    }

    /// Where the certain neighbours of a dot put it. A dot of the last frame moved as they did, or, where dots move steadily, goes on as it
    /// did but for what changed in their motion; any other dot is where it belongs between them.
    fn prediction(&self, m: &Matching, i: usize, steady: bool) -> Option<(Vector2<f64>, usize)> {
        let spacing = self.reference.spacing[i];
        let certain = self.reference.support[i].iter().filter_map(|&k| Some((k, m.of_dot[k]?)));
        let own = &self.past[i];
        if own.unseen == 0 {
            let velocity = |past: &Past| if steady { past.velocity } else { Some(Vector2::zeros()) };
            let known = certain.clone().filter(|&(k, _)| self.past[k].unseen == 0).filter_map(|(k, j)| {
                let other = &self.past[k];
                Some((other.place - own.place, self.seen.places[j] - other.place - velocity(other)?))
            });
            if let Some(velocity) = velocity(own)
                && let Some((change, count)) = predict(known, spacing)
            {
                return Some((own.place + velocity + change, count));
            }
        }
        let home = self.reference.places[i];
        let from_reference = certain.map(|(k, j)| {
            let other = self.reference.places[k];
            (other - home, self.seen.places[j] - other)
        });
        let (change, count) = predict(from_reference, spacing)?;
        Some((home + change, count))
    }

    /// One round: every dot with enough certain neighbours is looked for. Whether any was found.
    fn grow(&self, m: &mut Matching, least: usize, steady: bool) -> bool {
        let gate = self.settings.gate;
        let mut wanted: Vec<(usize, Vector2<f64>)> = Vec::new();
        for i in 0..self.reference.len() {
            if m.of_dot[i].is_some() || m.doubtful[i] {
                continue;
            }
            if let Some((place, _)) = self.prediction(m, i, steady).filter(|&(_, support)| support >= least) {
                m.predicted[i] = Some(place);
                wanted.push((i, place));
            }
        }
        let free = |m: &Matching, j: usize| m.of_detection[j].is_none() && self.seen.whole[j];
        let mut found = false;
        for cluster in self.clusters(&wanted) {
            let mut columns: Vec<usize> = cluster
                .iter()
                .flat_map(|&w| self.seen.near.within(wanted[w].1, gate * self.reference.spacing[wanted[w].0]))
                .map(|(j, _)| j)
                .filter(|&j| free(m, j))
                .collect();
            columns.sort_unstable();
            columns.dedup();
            let reach = |row: usize, column: usize| {
                let (i, place) = wanted[cluster[row]];
                (self.seen.places[columns[column]] - place).norm() / self.reference.spacing[i]
            };
            let choice = assign(cluster.len(), columns.len(), gate * gate, |row, column| {
                let distance = reach(row, column);
                (distance <= gate).then_some(distance * distance)
            });
            for (row, column) in choice.into_iter().enumerate() {
                let Some(column) = column else { continue };
                let (i, j, distance) = (wanted[cluster[row]].0, columns[column], reach(row, column));
                // A tenth of the gate is as good as exact.
                let rival = (RIVAL * distance.max(0.1 * gate)).min(1.5 * gate);
                let other_detection = (0..columns.len()).any(|c| c != column && reach(row, c) <= rival);
                let other_dot = (0..cluster.len()).any(|r| r != row && reach(r, column) <= rival);
                if other_detection || other_dot {
                    m.doubtful[i] = true;
                } else if self.is_alike(m, i, j) {
                    m.of_dot[i] = Some(j);
                    m.of_detection[j] = Some(i);
                    found = true;
                }
            }
        }
        found
    }

    /// Wanted dots whose gates overlap, so that they may want the same detection.
    fn clusters(&self, wanted: &[(usize, Vector2<f64>)]) -> Vec<Vec<usize>> {
        let mut cluster: Vec<usize> = (0..wanted.len()).collect();
        for a in 0..wanted.len() {
            for b in a + 1..wanted.len() {
                let reach = 1.5
                    * self.settings.gate
                    * (self.reference.spacing[wanted[a].0] + self.reference.spacing[wanted[b].0]);
                if (wanted[a].1 - wanted[b].1).norm() < reach && cluster[a] != cluster[b] {
                    let (keep, drop) = (cluster[a].min(cluster[b]), cluster[a].max(cluster[b]));
                    cluster.iter_mut().filter(|c| **c == drop).for_each(|c| *c = keep);
                }
            }
        }
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); wanted.len()];
        for (w, &c) in cluster.iter().enumerate() {
            members[c].push(w);
        }
        members.retain(|list| !list.is_empty());
        members
    }

    /// Whether a detection has the size that the dot has in the reference, changed as its certain neighbours' sizes changed.
    fn is_alike(&self, m: &Matching, i: usize, j: usize) -> bool {
        let change = |i: usize, j: usize| self.seen.areas[j] / self.past[i].reference_area;
        let mut changes: Vec<f64> =
            self.reference.support[i].iter().filter_map(|&k| Some(change(k, m.of_dot[k]?))).collect();
        if changes.is_empty() {
            return true;
        }
        let half = changes.len() / 2;
        let typical = *changes.select_nth_unstable_by(half, f64::total_cmp).1;
        let ratio = change(i, j) / typical;
        (1.0 / AREA..=AREA).contains(&ratio)
    }

    /// Gives up what does not fit its neighbours.
    fn take_back(&self, m: &mut Matching) {
        let count = self.reference.len();
        let mut wrong = vec![false; count];
        for (i, wrong) in wrong.iter_mut().enumerate() {
            let Some(j) = m.of_dot[i] else { continue };
            match self.prediction(m, i, false) {
                Some((place, _)) => {
                    m.misfit[i] = (self.seen.places[j] - place).norm() / self.reference.spacing[i];
                    *wrong = m.misfit[i] > 1.2 * self.settings.gate || !self.is_alike(m, i, j);
                }
                None => *wrong = true,
            }
        }
        for (i, wrong) in wrong.iter_mut().enumerate().filter(|(i, _)| m.of_dot[*i].is_some()) {
            let support = self.reference.support[i].iter();
            let mut around: Vec<f64> =
                support.filter(|&&k| m.of_dot[k].is_some()).map(|&k| m.misfit[k]).collect();
            let half = around.len() / 2;
            if half > 0 {
                let typical = *around.select_nth_unstable_by(half, f64::total_cmp).1;
                *wrong |= m.misfit[i] > STRANGE[0] * typical + STRANGE[1];
            }
        }
        for t in &self.reference.triangles {
            let [Some(a), Some(b), Some(c)] = t.map(|i| m.of_dot[i]) else { continue };
            let [a, b, c] = [a, b, c].map(|j| self.seen.places[j]);
            let before = t.map(|i| self.reference.places[i]);
            // Nearly flat triangles of the reference turn over by themselves.
            let area = orientation(before[0], before[1], before[2]);
            let edge = t.iter().map(|&i| self.reference.spacing[i]).fold(f64::MAX, f64::min);
            if area > 0.2 * edge * edge && orientation(a, b, c) <= 0.0 {
                t.iter().for_each(|&i| wrong[i] = true);
            }
        }
        for (i, _) in wrong.into_iter().enumerate().filter(|&(_, wrong)| wrong) {
            if let Some(j) = m.of_dot[i].take() {
                m.of_detection[j] = None;
                m.doubtful[i] = true;
            }
        }
    }
}

fn middle(values: &mut [Vector2<f64>], axis: usize) -> f64 {
    let half = values.len() / 2;
    values.select_nth_unstable_by(half, |a, b| a[axis].total_cmp(&b[axis])).1[axis]
}
