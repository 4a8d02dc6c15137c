//! What happens at one place of a ramp, a hold or a way back: jumps, spikes, a sensor at its end, a rise, a crosshead that moves, a plate that
//! sticks.

use super::fault::{Fault, Name};
use super::held_out::{rms, step, trend};
use super::hold::{MATTERS, SIGMAS, Seen};
use super::marks::{jumps, mean, spikes, without_spikes};
use super::plateau::{Plateau, plateau};
use super::steps::steps;
use crate::calib::noise::noise;
use crate::calib::relaxation::Phase;
use std::ops::Range;

/// Share of the peak by which a jump must change the force.
const JUMP: f64 = 0.01;
/// Steps of the sensor below which nothing is a jump or a spike.
const STEPS: f64 = 2.5;
/// Samples of a hold that show a sensor's end where the deformation stops.
const STAYS: usize = 3;
/// Share of the deformation that may move in a hold.
const MOVED: f64 = 0.005;
/// Parts of a hold that are compared.
const PARTS: usize = 20;
/// Rows in a row that are no spike.
const STICKS: usize = 3;

/// A ramp that ends at the sensor's end.
struct EndOfTheSensor {
    plateau: Plateau,
    /// Samples of the hold that it goes on for.
    held: usize,
}

impl Seen<'_> {
    /// The least change of a force that is a jump or a spike: the sensor's own steps are none.
    fn least(&self) -> f64 {
        (JUMP * self.peak).max(STEPS * self.step)
    }

    /// The first jump of the ramp, and the steps of the hold, each with its size.
    pub(super) fn jumps(&self) -> Vec<(Fault, f64)> {
        let mut found: Vec<(Fault, f64)> = self.jump_of_the_ramp().into_iter().collect();
        found.extend(self.steps_of_the_hold());
        found
    }

    fn jump_of_the_ramp(&self) -> Option<(Fault, f64)> {
        let r = self.recording;
        let whole = r.deformation.iter().copied().fold(0.0, f64::max);
        let rows = r.rows(Phase::Ramp);
        let f = self.forces(&rows);
        let times: Vec<f64> = rows.iter().map(|row| r.time_s[*row]).collect();
        let sigma = noise(&f).max(self.sigma);
        let f = without_spikes(&times, &f, &spikes(&times, &f, sigma, self.least()));
        jumps(&f, sigma, self.least()).into_iter().find_map(|(at, excess)| {
            // A file that pauses, or a crosshead that steps back, changes the force by itself.
            let gap = times[at] - times[at - 1] > 3.0 * (times[at - 1] - times[at - 2]);
            let way = r.deformation[rows[at]] - r.deformation[rows[at - 1]];
            if gap || way < -1e-3 * whole {
                return None;
            }
            let how = if excess < 0.0 { "drops" } else { "jumps up" };
            let shown = format!(
                "at {:.2} s the force {how} by {} between two samples",
                times[at],
                self.say(excess.abs())
            );
            let held_out = step(&times, &f, at, self.peak)?;
            let fault = self.fault(Name::Slipped, [rows[at - 1], rows[at]], shown, held_out)?;
            Some((fault, f[at] - f[at - 1]))
        })
    }

    fn steps_of_the_hold(&self) -> Vec<(Fault, f64)> {
        let r = self.recording;
        let rows = r.rows(Phase::Hold);
        // Where an encoder is noisy the ramp's last rows count as held: the hold's forces begin behind the greatest.
        let early = &rows[..rows.len() / 4];
        let top = early.iter().position(|row| early.iter().all(|other| r.force[*other] <= r.force[*row]));
        // Where a sensor at its end shows the force again, that is no step.
        let ended = self.end_of_the_sensor().map_or(0, |end| end.held);
        let rows = &rows[top.map_or(0, |top| top + 1).max(ended).min(rows.len() - 1)..];
        let begin = r.rows(Phase::Ramp).first().map_or(r.time_s[rows[0]], |row| r.time_s[*row]);
        let times: Vec<f64> = rows.iter().map(|row| r.time_s[*row]).collect();
        let shortest = times.get(1).map_or(1.0, |t| t - times[0]);
        // Forces that relax are nearly straight in the logarithm of time.
        let at: Vec<f64> = times.iter().map(|t| (t - begin).max(shortest).ln()).collect();
        let f = self.forces(rows);
        let f = without_spikes(&times, &f, &spikes(&times, &f, noise(&f).max(self.sigma), self.least()));
        let found = steps(&times, &at, &f, noise(&f).max(self.sigma), self.least());
        found
            .into_iter()
            .filter_map(|s| {
                let how = if s.size < 0.0 { "drops" } else { "jumps up" };
                let [from, to] = s.ends;
                let within = if to - from == 1 {
                    "between two samples".to_owned()
                } else {
                    format!("within {:.2} s", times[to] - times[from])
                };
                let shown =
                    format!("at {:.2} s the force {how} by {} {within}", times[to], self.say(s.size.abs()));
                let held_out = s.missed.map(|m| m / self.peak);
                Some((self.fault(Name::Slipped, [rows[from], rows[to]], shown, held_out)?, s.size))
            })
            .collect()
    }

    /// Samples that their neighbours do not know. Held out: the next sample, predicted with them and without.
    pub(super) fn spikes(&self) -> Option<Fault> {
        let r = self.recording;
        let mut rows = r.rows(Phase::Ramp);
        let sigma = noise(&self.forces(&rows)).max(self.sigma);
        rows.extend(r.rows(Phase::Hold));
        let f = self.forces(&rows);
        let times: Vec<f64> = rows.iter().map(|row| r.time_s[*row]).collect();
        let all = spikes(&times, &f, sigma, self.least());
        // Of a run of n, the sample behind it from that before the run or the run's last, and the one after.
        let next = |run: &Range<usize>, from: usize| {
            let share = (times[run.end] - times[from]) / (times[run.end + 1] - times[from]);
            f[run.end] - f[from] - share * (f[run.end + 1] - f[from])
        };
        let with: Vec<f64> = all.iter().map(|run| next(run, run.end - 1)).collect();
        let without: Vec<f64> = all.iter().map(|run| next(run, run.start - 1)).collect();
        let (first, last) = (rows[all.first()?.start], rows[all.last()?.end - 1]);
        let longest = all.iter().map(Range::len).max()?;
        let shown = match (all.len(), longest) {
            (1, 1) => format!("at {:.2} s one sample stands alone, far off its neighbours", r.time_s[first]),
            (n, 1) => format!("{n} samples stand alone, far off their neighbours"),
            (1, n) => format!("at {:.2} s {n} samples stand off those around them", r.time_s[first]),
            (places, n) => format!("at {places} places up to {n} samples stand off those around them"),
        };
        self.fault(Name::Spikes, [first, last], shown, [rms(&with) / self.peak, rms(&without) / self.peak])
    }

    /// A force that stays while the ramp goes on. Held out: the second half of it. Where neither equal samples nor a force that stays on in the
    /// hold show the sensor, the specimen itself may have given way.
    pub(super) fn saturated(&self) -> Option<Fault> {
        let EndOfTheSensor { plateau, held } = self.end_of_the_sensor()?;
        let ramp = self.recording.rows(Phase::Ramp);
        let or = if plateau.exact || held >= 2 * STAYS { Vec::new() } else { vec![Name::Flattening] };
        let shown = format!(
            "{} samples of the ramp show the same {}",
            ramp.len() - plateau.from,
            self.say(plateau.level)
        );
        let rows = [ramp[plateau.from], ramp[ramp.len() - 1]];
        let fault = self.fault(Name::Saturated, rows, shown, plateau.missed.map(|m| m / self.peak))?;
        Some(Fault { or, ..fault })
    }

    fn end_of_the_sensor(&self) -> Option<EndOfTheSensor> {
        let r = self.recording;
        let ramp = r.rows(Phase::Ramp);
        let way: Vec<f64> = ramp.iter().map(|row| r.deformation[*row]).collect();
        let f = self.forces(&ramp);
        let sigma = noise(&f);
        // A spike is no greatest value.
        let alone = spikes(&r.time_s, &r.force, sigma.max(self.sigma), self.least());
        let greatest =
            without_spikes(&r.time_s, &r.force, &alone).into_iter().fold(f64::NEG_INFINITY, f64::max);
        let last = *f.last()?;
        let hold = r.rows(Phase::Hold);
        let behind = hold.iter().take_while(|row| r.force[**row] == last).count();
        let plateau = plateau(&way, &f, greatest, behind)?;
        let on = |row: &usize| (r.force[*row] - plateau.level).abs() <= 4.0 * sigma;
        // Its first samples may still belong to the way.
        let held = hold.iter().enumerate().take_while(|(k, row)| *k < STAYS || on(row)).count();
        Some(EndOfTheSensor { plateau, held })
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
