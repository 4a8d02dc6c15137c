//! Ramp, hold and way back: what did the model leave out?
//!
//! Thresholds are in standard deviations of the noise and, so that nothing too small to matter is named, in shares of the peak.

use super::fault::{Fault, Name};
use super::marks::{flat, jumps, mean, noise, spikes};
use crate::calib::relaxation::{Choice, Phase, Recording};

/// Standard deviations from which a mean or a sample is not noise.
const SIGMAS: f64 = 6.0;
/// Share of the peak below which nothing is named.
const MATTERS: f64 = 0.002;
/// Share of the peak by which a jump must change the force.
const JUMP: f64 = 0.01;
/// Share of the peak that unseen rows may be missed by.
const MISSED: f64 = 0.02;
/// Share of the way that may meet no force.
const SLACK: f64 = 0.03;
/// Equal samples that no noisy sensor shows.
const EQUAL: usize = 6;
/// Gain in unseen data from which the shape of the elastic force is named.
const GAIN: f64 = 0.7;

/// Names what `choice` left out of a recording, or took in. `unseen` is the recording's share of [`Choice::unseen`].
pub fn diagnose(recording: &Recording, choice: &Choice, unseen: &[(usize, f64)]) -> Vec<Fault> {
    let peak = recording.peak() - recording.zero();
    let hold = recording.rows(Phase::Hold);
    let forces = |rows: &[usize]| -> Vec<f64> { rows.iter().map(|r| recording.force[*r]).collect() };
    let sigma = noise(&forces(&hold[hold.len() / 2..]));
    let see = Seen { recording, peak, sigma };
    let mut faults = Vec::new();
    faults.extend(see.zeros());
    // A force that stiffens begins flat, too: there slack can't be told.
    faults.extend(if choice.law.kind.stiffens { None } else { see.slack() });
    faults.extend(see.ramp_and_hold());
    // A zero that jumps takes the force with it: the same step at the end of the test tells the two apart.
    if faults.iter().any(|f| f.name == Name::ZeroMoved) && see.step_stays(&faults) {
        faults.retain(|f| f.name != Name::Slipped);
    }
    faults.extend(see.way_back());
    faults.extend(see.memory(unseen));
    faults.extend(see.stiffening(choice));
    let abrupt = faults.iter().any(|f| matches!(f.name, Name::Slipped | Name::Rise | Name::Saturated));
    faults.extend(if abrupt { None } else { see.unexplained(unseen) });
    faults
}

struct Seen<'a> {
    recording: &'a Recording,
    peak: f64,
    sigma: f64,
}

impl Seen<'_> {
    fn fault(&self, name: Name, from: usize, to: usize, shown: String) -> Fault {
        Fault { name, lines: [self.recording.lines[from], self.recording.lines[to]], shown, held_out: None }
    }

    fn say(&self, force: f64) -> String {
        format!("{force:.4} {} ({:.1} % of the peak)", self.recording.force_unit, 100.0 * force / self.peak)
    }

    /// The flat end of the way back: rows, and mean force; none where the file ends before the force does.
    fn tail(&self) -> Option<(Vec<usize>, f64)> {
        let back = self.recording.rows(Phase::Unloading);
        let rows = back[back.len() - back.len() / 4..].to_vec();
        if rows.len() < 12 {
            return None;
        }
        let f: Vec<f64> = rows.iter().map(|r| self.recording.force[*r]).collect();
        let half = f.len() / 2;
        let own = noise(&f);
        let level = (mean(&f[..half]) - mean(&f[half..])).abs()
            < (SIGMAS * own / (half as f64).sqrt()).max(1e-3 * self.peak);
        level.then(|| (rows, mean(&f)))
    }

    fn zeros(&self) -> Vec<Fault> {
        let rest = self.recording.rows(Phase::Rest);
        let mut found = Vec::new();
        let zero = self.recording.zero();
        if rest.len() >= 5
            && zero.abs() > (SIGMAS * self.sigma / (rest.len() as f64).sqrt()).max(MATTERS * self.peak)
        {
            let shown = format!("before anything moves the sensor shows {}", self.say(zero));
            found.push(self.fault(Name::SensorZero, rest[0], rest[rest.len() - 1], shown));
        }
        if let Some((rows, end)) = self.tail() {
            let start = if rest.len() >= 5 { zero } else { self.recording.force[0] };
            if (end - start).abs() > (SIGMAS * self.sigma).max(MATTERS * self.peak) {
                let shown =
                    format!("unloaded it shows {}, before the test {}", self.say(end), self.say(start));
                found.push(self.fault(Name::ZeroMoved, rows[0], rows[rows.len() - 1], shown));
            }
        }
        found
    }

    /// Whether the drop of what looks like a slip is what the unloaded sensor is off by at the end.
    fn step_stays(&self, faults: &[Fault]) -> bool {
        let Some((_, end)) = self.tail() else { return false };
        let Some(slip) = faults.iter().find(|f| f.name == Name::Slipped) else { return false };
        let Some(at) = self.recording.lines.iter().position(|l| *l == slip.lines[1]) else { return false };
        let step = self.recording.force[at] - self.recording.force[at - 1];
        let moved = end - self.recording.zero();
        (step - moved).abs() < 0.3 * moved.abs()
    }

    fn slack(&self) -> Option<Fault> {
        let r = self.recording;
        let whole = r.deformation.iter().copied().fold(0.0, f64::max);
        let ramp = r.rows(Phase::Ramp);
        let limit = (SIGMAS * self.sigma).max(2.0 * MATTERS * self.peak);
        let zero = if r.rows(Phase::Rest).len() >= 5 { r.zero() } else { r.force[0] };
        let first = ramp.iter().find(|row| (r.force[**row] - zero).abs() > limit)?;
        let way = r.deformation[*first];
        (way > SLACK * whole).then(|| {
            let shown = format!("no force over the first {:.1} % of the way", 100.0 * way / whole);
            self.fault(Name::Slack, ramp[0], *first, shown)
        })
    }

    fn ramp_and_hold(&self) -> Vec<Fault> {
        let r = self.recording;
        let (ramp, hold) = (r.rows(Phase::Ramp), r.rows(Phase::Hold));
        let mut found = Vec::new();
        for rows in [&ramp, &hold] {
            let f: Vec<f64> = rows.iter().map(|row| r.force[*row]).collect();
            let sigma = noise(&f).max(self.sigma);
            for (at, step) in jumps(&f, sigma, JUMP * self.peak).into_iter().filter(|j| j.1 < 0.0).take(1) {
                // A file that pauses, or a crosshead that steps back, drops the force by itself.
                let before = rows[at - 1];
                let gap =
                    r.time_s[rows[at]] - r.time_s[before] > 3.0 * (r.time_s[before] - r.time_s[rows[at - 2]]);
                let back = r.deformation[rows[at]] < r.deformation[before] - 1e-3 * r.deformation[hold[0]];
                if !gap && !back {
                    let shown = format!(
                        "at {:.2} s the force drops by {} between two samples",
                        r.time_s[rows[at]],
                        self.say(-step)
                    );
                    found.push(self.fault(Name::Slipped, before, rows[at], shown));
                }
            }
            let off = spikes(&f, sigma, JUMP * self.peak);
            if let (Some(first), Some(last)) = (off.first(), off.last()) {
                let shown = format!("{} samples stand alone, far off their neighbours", off.len());
                found.push(self.fault(Name::Spikes, rows[*first], rows[*last], shown));
            }
        }
        let f: Vec<f64> = ramp.iter().map(|row| r.force[*row]).collect();
        let (at, count) = flat(&f);
        let high = f.get(at).is_some_and(|v| *v - r.zero() > 0.5 * self.peak);
        if count >= EQUAL && high && r.deformation[ramp[at + count - 1]] > r.deformation[ramp[at]] {
            let shown = format!("{count} samples of the ramp show the same {}", self.say(f[at]));
            found.push(self.fault(Name::Saturated, ramp[at], ramp[at + count - 1], shown));
        }
        found.extend(self.rise(&hold));
        let way = |row: usize| r.deformation[row];
        let (first, last) = (hold[hold.len() / 10], hold[hold.len() - 1]);
        let moved = (way(last) - way(first)).abs();
        if moved > 0.005 * way(first) {
            let shown =
                format!("the deformation moves by {:.2} % during the hold", 100.0 * moved / way(first));
            found.push(self.fault(Name::NotHeld, first, last, shown));
        }
        found
    }

    fn rise(&self, hold: &[usize]) -> Option<Fault> {
        let part = hold.len() / 20;
        if part < 3 {
            return None;
        }
        let level = |k: usize| {
            mean(&hold[k * part..(k + 1) * part].iter().map(|r| self.recording.force[*r]).collect::<Vec<_>>())
        };
        let least = (0..20).min_by(|a, b| level(*a).total_cmp(&level(*b)))?;
        let highest = (least..20).max_by(|a, b| level(*a).total_cmp(&level(*b)))?;
        let rise = level(highest) - level(least);
        let noise = SIGMAS * self.sigma / (part as f64).sqrt();
        (rise > noise.max(0.5 * JUMP * self.peak)).then(|| {
            let shown = format!("the force rises by {} while it is held", self.say(rise));
            self.fault(Name::Rise, hold[least * part], hold[(highest + 1) * part - 1], shown)
        })
    }

    fn way_back(&self) -> Option<Fault> {
        let (tail, end) = self.tail()?;
        let r = self.recording;
        let rows: Vec<usize> = r.rows(Phase::Unloading).into_iter().filter(|row| *row < tail[0]).collect();
        let limit = (SIGMAS * self.sigma).max(MATTERS * self.peak);
        let below: Vec<usize> = rows.into_iter().filter(|row| r.force[*row] < end - limit).collect();
        let (first, last) = (*below.first()?, *below.last()?);
        let deepest = below.iter().map(|row| end - r.force[*row]).fold(0.0, f64::max);
        // Three in a row at least: one sample is a spike.
        (below.len() >= 3).then(|| {
            let shown =
                format!("on the way back the force falls {} below that of the free plate", self.say(deepest));
            self.fault(Name::Sticking, first, last, shown)
        })
    }

    fn memory(&self, unseen: &[(usize, f64)]) -> Option<Fault> {
        let r = self.recording;
        let hold = r.rows(Phase::Hold);
        let top = r.peak();
        let end = mean(
            &hold[hold.len() - hold.len() / 10 - 1..].iter().map(|row| r.force[*row]).collect::<Vec<_>>(),
        );
        let fall = top - end;
        if fall < (SIGMAS * self.sigma).max(0.02 * self.peak) || unseen.is_empty() {
            return None;
        }
        let rms =
            |list: Vec<f64>| (list.iter().map(|v| v * v).sum::<f64>() / list.len() as f64).sqrt() / self.peak;
        let without = rms(unseen.iter().map(|(row, _)| r.force[*row] - top).collect());
        let with = rms(unseen.iter().map(|(_, left)| *left).collect());
        let shown = format!("the force falls by {} while it is held", self.say(fall));
        let mut fault = self.fault(Name::Memory, hold[0], hold[hold.len() - 1], shown);
        fault.held_out = Some([without, with]);
        Some(fault)
    }

    fn stiffening(&self, choice: &Choice) -> Option<Fault> {
        let best = |stiffens: bool| {
            let scores = choice.tried.iter().filter(|t| t.kind.stiffens == stiffens).filter_map(|t| t.score);
            scores.fold(f64::INFINITY, f64::min)
        };
        let (without, with) = (best(false), best(true));
        // One ramp tells little of shapes: only several rates or strains do.
        let ramp = self.recording.rows(Phase::Ramp);
        (choice.law.kind.stiffens && choice.unseen.len() > 1 && with < GAIN * without).then(|| {
            let shown =
                format!("missed in unseen rates: {without:.2} deviations without it, {with:.2} with it");
            self.fault(Name::Stiffening, ramp[0], ramp[ramp.len() - 1], shown)
        })
    }

    fn unexplained(&self, unseen: &[(usize, f64)]) -> Option<Fault> {
        let (first, last) = (unseen.first()?, unseen.last()?);
        let part = (unseen.len() / 20).max(1);
        let sd = |row: usize| self.recording.force_sd.as_ref().map_or(0.0, |sd| sd[row]);
        let beyond = |chunk: &[(usize, f64)]| {
            let off = mean(&chunk.iter().map(|u| u.1).collect::<Vec<_>>()).abs();
            let stated = 2.0 * mean(&chunk.iter().map(|u| sd(u.0)).collect::<Vec<_>>());
            (off > (MISSED * self.peak).max(SIGMAS * self.sigma).max(stated)).then_some(off)
        };
        let worst = unseen.chunks(part).filter_map(beyond).fold(0.0, f64::max);
        (worst > 0.0).then(|| {
            let shown =
                format!("unseen data is missed by up to {}, and nothing here explains it", self.say(worst));
            self.fault(Name::Unexplained, first.0, last.0, shown)
        })
    }
}
