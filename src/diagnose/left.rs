//! What a reading leaves: means of the residual over parts of each poke, over what noise and elements may leave.
//!
//! A mean over many rows shows what white noise hides in each of them. Each poke is cut into pieces of its approach,
//! hold and retreat; in every piece every component of the force and of every marker has one mean. The error of a marker's rest position,
//! which all its means have in common, is estimated from all its frames and taken off: a second of rest before the first
//! poke knows it no better than a piece of a poke does, the whole recording does.

use super::diagnosis::{Channel, Phase};
use super::model::Model;
use super::refit::Fitted;
use super::track::Track;

/// All means of a reading.
#[derive(Debug, Clone)]
pub(super) struct Left {
    /// One for every piece and component.
    pub means: Vec<Mean>,
    /// Whether the force's zero wanders, so that its means in one poke err alike.
    pub wanders: bool,
}

/// One mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mean {
    /// Index of the poke's track.
    pub poke: usize,
    /// Its part.
    pub phase: Phase,
    /// What is read.
    pub channel: Channel,
    /// The marker, if it is one.
    pub marker: Option<usize>,
    /// Square of the mean over its expectation from noise and elements.
    pub square: f64,
}

/// Pieces of approach, hold and retreat.
const PIECES: [(Phase, usize); 3] = [(Phase::Approach, 3), (Phase::Hold, 2), (Phase::Retreat, 3)];

/// The tip is held from this share of the poke's depth on.
const HELD: f64 = 0.985;

/// What elements may get wrong of a component, relative to it and, for markers, to the largest one of the piece: one
/// standard deviation.
const ELEMENTS: [f64; 2] = [4e-3, 1.5e-3];

impl Left {
    /// Of a reading, the parameters given.
    pub(super) fn of(model: &Model<'_>, fitted: &Fitted) -> Option<Self> {
        let at = &fitted.at;
        let marched = model.march(&fitted.acting, at)?;
        let (stays_m, taken_off) = fitted.staying(model);
        let mut means = Vec::new();
        let markers = model.settled.evidence.rest.len();
        for (poke, track) in model.tracks.iter().enumerate() {
            let pieces = Pieces::of(track);
            let share = |channel: usize| at[marched.fitted + channel * model.body.sites + track.site];
            let mut sums = vec![Vec::new(); pieces.count()];
            for sum in &mut sums {
                sum.resize(3 + 3 * markers, Sum::default());
            }
            let rows = model.force_rows(track, &marched, share(0), true);
            let counted = (0..track.time_s.len()).filter(|&i| track.counts[i]);
            for (n, row) in counted.enumerate() {
                let piece = &mut sums[pieces.at(track.time_s[row])];
                for (axis, sum) in piece.iter_mut().take(3).enumerate() {
                    let row = rows.row(3 * n + axis);
                    sum.add(row[marched.fitted + 1], row[marched.fitted]);
                }
            }
            for frame in track.frames.iter().filter(|f| track.counts_at(f.time_s)) {
                let Some(rows) = model.marker_rows(track, frame, &marched, share(1)) else { continue };
                let piece = &mut sums[pieces.at(frame.time_s)];
                for (n, (marker, _)) in frame.seen.iter().enumerate() {
                    for axis in 0..3 {
                        let row = rows.row(3 * n + axis);
                        piece[3 + 3 * marker + axis].add(row[marched.fitted + 1], row[marched.fitted]);
                    }
                }
            }
            let along = largest_axis(&track.direction);
            for (piece, sums) in sums.iter().enumerate() {
                let phase = pieces.phase(piece);
                let largest = sums[3..].iter().map(|s| s.own.abs() / s.n.max(1.0)).fold(0.0, f64::max);
                for (i, sum) in sums.iter().enumerate().filter(|(_, s)| s.n > 0.0) {
                    let own = sum.own / sum.n.sqrt();
                    let (channel, marker, noise, elements) = if i < 3 {
                        let channel = if i == along { Channel::ForceAlong } else { Channel::ForceAcross };
                        (channel, None, 1.0 + sum.n * model.correlation.wander, (ELEMENTS[0] * own).powi(2))
                    } else {
                        let (marker, axis) = ((i - 3) / 3, (i - 3) % 3);
                        // With n of N frames and r at rest: 1 − n/(r + N), and what lasts.
                        let noise = 1.0 + sum.n * (model.lasting()[axis] - taken_off[i - 3]);
                        let all = ELEMENTS[1] * largest * sum.n.sqrt();
                        let elements = (ELEMENTS[0] * own).powi(2) + all * all;
                        (Channel::Markers(axis as u8), Some(marker), noise, elements)
                    };
                    let stays =
                        i.checked_sub(3).map_or(0.0, |i| stays_m[i] * taken_off[i] / model.marker_sd[i % 3]);
                    let square = (sum.residual - sum.n * stays).powi(2) / sum.n / (noise + elements);
                    means.push(Mean { poke, phase, channel, marker, square });
                }
            }
        }
        Some(Self { means, wanders: model.correlation.wanders })
    }

    /// Mean of the squares of some of the means, and how many they are.
    pub(super) fn mean_square(&self, which: impl Fn(&Mean) -> bool) -> (f64, usize) {
        let chosen: Vec<f64> = self.means.iter().filter(|m| which(m)).map(|m| m.square).collect();
        (chosen.iter().sum::<f64>() / chosen.len().max(1) as f64, chosen.len())
    }
}

/// Sums over a piece.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    n: f64,
    residual: f64,
    own: f64,
}

impl Sum {
    fn add(&mut self, residual: f64, own: f64) {
        self.n += 1.0;
        self.residual += residual;
        self.own += own;
    }
}

/// The axis that a direction is closest to.
fn largest_axis(direction: &crate::geometry::Vec3) -> usize {
    direction.iamax()
}

/// When which piece of a poke begins (s).
struct Pieces {
    starts_s: Vec<f64>,
    phases: Vec<Phase>,
}

impl Pieces {
    fn of(track: &Track) -> Self {
        let (first, last) = (track.time_s[0], track.time_s[track.time_s.len() - 1]);
        let held = HELD * track.depth_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let deep = |i: &usize| track.depth_m[*i] >= held;
        let from = (0..track.time_s.len()).find(deep).map_or(first, |i| track.time_s[i]);
        let to = (0..track.time_s.len()).rev().find(deep).map_or(last, |i| track.time_s[i]);
        let (mut starts_s, mut phases) = (Vec::new(), Vec::new());
        for ((phase, pieces), [start, end]) in PIECES.into_iter().zip([[first, from], [from, to], [to, last]])
        {
            for piece in 0..pieces {
                starts_s.push(start + (end - start) * piece as f64 / pieces as f64);
                phases.push(phase);
            }
        }
        Self { starts_s, phases }
    }

    fn count(&self) -> usize {
        self.starts_s.len()
    }

    fn at(&self, time_s: f64) -> usize {
        self.starts_s.partition_point(|t| *t <= time_s).saturating_sub(1)
    }

    fn phase(&self, piece: usize) -> Phase {
        self.phases[piece]
    }
}
