//! What happens at one place of a ramp, a hold or a way back: jumps, spikes, a sensor at its end, a rise, a crosshead that moves, a plate that
//! sticks.

use super::fault::{Fault, Name};
use super::held_out::{line, rms, step, trend};
use super::hold::{MATTERS, SIGMAS, Seen};
use super::marks::{flat, jumps, mean, noise, spikes};
use crate::calib::relaxation::Phase;

/// Share of the peak by which a jump must change the force.
const JUMP: f64 = 0.01;
/// Equal samples that no noisy sensor shows.
const EQUAL: usize = 6;
/// Share of the deformation that may move in a hold.
const MOVED: f64 = 0.005;
/// Parts of a hold that are compared.
const PARTS: usize = 20;
/// Rows in a row that are no spike.
const STICKS: usize = 3;

impl Seen<'_> {
    /// The first jump of the ramp and of the hold, each with its size.
    pub(super) fn jumps(&self) -> Vec<(Fault, f64)> {
        let r = self.recording;
        let whole = r.deformation.iter().copied().fold(0.0, f64::max);
        let mut found = Vec::new();
        for rows in [r.rows(Phase::Ramp), r.rows(Phase::Hold)] {
            let f = self.forces(&rows);
            let times: Vec<f64> = rows.iter().map(|row| r.time_s[*row]).collect();
            let sigma = noise(&f).max(self.sigma);
            for (at, excess) in jumps(&f, sigma, JUMP * self.peak) {
                // A file that pauses, or a crosshead that steps back, changes the force by itself.
                let gap = times[at] - times[at - 1] > 3.0 * (times[at - 1] - times[at - 2]);
                let way = r.deformation[rows[at]] - r.deformation[rows[at - 1]];
                if gap || way < -1e-3 * whole {
                    continue;
                }
                let how = if excess < 0.0 { "drops" } else { "jumps up" };
                let shown = format!(
                    "at {:.2} s the force {how} by {} between two samples",
                    times[at],
                    self.say(excess.abs())
                );
                let held_out = step(&times, &f, at, self.peak);
                let fault =
                    held_out.and_then(|h| self.fault(Name::Slipped, [rows[at - 1], rows[at]], shown, h));
                if let Some(fault) = fault {
                    found.push((fault, f[at] - f[at - 1]));
                    break;
                }
            }
        }
        found
    }

    /// Samples that their neighbours do not know. Held out: the next sample, predicted with them and without.
    pub(super) fn spikes(&self) -> Option<Fault> {
        let r = self.recording;
        let (mut all, mut with, mut without) = (Vec::new(), Vec::new(), Vec::new());
        for rows in [r.rows(Phase::Ramp), r.rows(Phase::Hold)] {
            let f = self.forces(&rows);
            for at in spikes(&f, noise(&f).max(self.sigma), JUMP * self.peak) {
                all.push(rows[at]);
                with.push(f[at + 1] - 0.5 * (f[at] + f[at + 2]));
                without.push(f[at + 1] - (f[at - 1] + 2.0 * f[at + 2]) / 3.0);
            }
        }
        let (first, last) = (*all.first()?, *all.last()?);
        let shown = format!("{} samples stand alone, far off their neighbours", all.len());
        self.fault(Name::Spikes, [first, last], shown, [rms(&with) / self.peak, rms(&without) / self.peak])
    }

    /// Equal samples near the peak while the ramp goes on. Held out: their second half.
    pub(super) fn saturated(&self) -> Option<Fault> {
        let r = self.recording;
        let ramp = r.rows(Phase::Ramp);
        let f = self.forces(&ramp);
        let (at, count) = flat(&f);
        let high = f.get(at).is_some_and(|v| *v - r.zero() > 0.5 * self.peak);
        let goes_on = || r.deformation[ramp[at + count - 1]] > r.deformation[ramp[at]];
        if count < EQUAL || !high || at < EQUAL || !goes_on() {
            return None;
        }
        let way = |k: usize| r.deformation[ramp[k]];
        let before: Vec<f64> = (at - EQUAL..at).map(way).collect();
        let (slope, place, height) = line(&before, &f[at - EQUAL..at]);
        let left: Vec<f64> =
            (at + count / 2..at + count).map(|k| f[k] - height - slope * (way(k) - place)).collect();
        let shown = format!("{count} samples of the ramp show the same {}", self.say(f[at]));
        self.fault(Name::Saturated, [ramp[at], ramp[at + count - 1]], shown, [rms(&left) / self.peak, 0.0])
    }

    /// A force that rises while it is held, which no relaxing model does.
    pub(super) fn rise(&self) -> Option<Fault> {
        let hold = self.recording.rows(Phase::Hold);
        let part = hold.len() / PARTS;
        if part < 3 {
            return None;
        }
        let level = |k: usize| mean(&self.forces(&hold[k * part..(k + 1) * part]));
        let least = (0..PARTS).min_by(|a, b| level(*a).total_cmp(&level(*b)))?;
        let highest = (least..PARTS).max_by(|a, b| level(*a).total_cmp(&level(*b)))?;
        let rise = level(highest) - level(least);
        let limit = (SIGMAS * self.sigma / (part as f64).sqrt()).max(0.5 * JUMP * self.peak);
        let rows = &hold[least * part..(highest + 1) * part];
        let times: Vec<f64> = rows.iter().map(|row| self.recording.time_s[*row]).collect();
        let shown = format!("the force rises by {} while it is held", self.say(rise));
        let held_out = trend(&times, &self.forces(rows), self.peak);
        let fault = self.fault(Name::Rise, [rows[0], rows[rows.len() - 1]], shown, held_out);
        fault.filter(|_| rise > limit)
    }

    /// A deformation that goes on in the hold; shares are of the deformation here.
    pub(super) fn not_held(&self) -> Option<Fault> {
        let r = self.recording;
        let hold = r.rows(Phase::Hold);
        let rows = &hold[hold.len() / 10..];
        let way: Vec<f64> = rows.iter().map(|row| r.deformation[*row]).collect();
        let times: Vec<f64> = rows.iter().map(|row| r.time_s[*row]).collect();
        let (first, last) = (*way.first()?, *way.last()?);
        let moved = (last - first).abs() / first.abs();
        let shown = format!("the deformation moves by {:.2} % during the hold", 100.0 * moved);
        let fault = self.fault(
            Name::NotHeld,
            [rows[0], rows[rows.len() - 1]],
            shown,
            trend(&times, &way, first.abs()),
        );
        fault.filter(|_| moved > MOVED)
    }

    /// A force below that of the free plate, right where the force on the plate ends. Held out: every other of these rows from its
    /// neighbours, by a plate that only pushes and by one that holds on.
    pub(super) fn way_back(&self) -> Option<Fault> {
        let (tail, free) = self.tail()?;
        let r = self.recording;
        let back: Vec<usize> = r.rows(Phase::Unloading).into_iter().filter(|row| *row < tail[0]).collect();
        let own = noise(&self.forces(&tail)).max(self.sigma);
        let limit = (SIGMAS * own).max(MATTERS * self.peak);
        let f = self.forces(&back);
        let first = f.iter().position(|v| *v < free - limit)?;
        // One row above is noise; two are the end of it.
        let end =
            (first..f.len()).find(|k| f[*k..].iter().take(2).all(|v| *v >= free - limit)).unwrap_or(f.len());
        let below = (first..end).filter(|k| f[*k] < free - limit).count();
        // The force came down to it: before, the plate was pushed.
        let pushed = first >= STICKS && mean(&f[first.saturating_sub(20).min(first - STICKS)..first]) > free;
        if below < STICKS || !pushed || end + 1 >= f.len() {
            return None;
        }
        let course = |k: usize| 0.5 * (f[k - 1] + f[k + 1]);
        let left = |says: &dyn Fn(usize) -> f64| -> f64 {
            rms(&(first..end).step_by(2).map(|k| f[k] - says(k)).collect::<Vec<_>>()) / self.peak
        };
        let held_out = [left(&|k| course(k).max(free)), left(&course)];
        let deepest = f[first..end].iter().map(|v| free - v).fold(0.0, f64::max);
        let shown = format!(
            "on the way back the force falls {} below that of the free plate, over {:.3} mm",
            self.say(deepest),
            1e3 * (r.deformation[back[first]] - r.deformation[back[end - 1]])
        );
        let shown = if r.deformation_unit == "m" { shown } else { shown.split(", over").next()?.to_owned() };
        self.fault(Name::Sticking, [back[first], back[end - 1]], shown, held_out)
    }
}
