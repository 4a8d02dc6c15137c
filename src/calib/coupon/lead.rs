//! Does the force come before the way?
//!
//! | while the way rests, the force | while the ramp goes on, or is held, it | what that is |
//! | --- | --- | --- |
//! | rises | falls, sample by sample | a force that is recorded earlier than the way |
//! | rests | falls | the specimen gives way |
//! | is not recorded, the ramp begins with one | falls, sample by sample | an earlier force, or a file that begins late on a specimen that gives way |
//!
//! The same holds for a force that falls before the crosshead turns: where a machine records faster in some phases than in others, one of both may lie
//! between samples.

use super::fault::{Fault, Name};
use super::held_out::{line, rms};
use super::hold::{MATTERS, SIGMAS, Seen};
use super::marks::mean;
use crate::calib::noise::{middle, noise};
use crate::calib::relaxation::Phase;

/// Samples of the ramp that fall, at least, and of the rest that rise.
const FALLING: usize = 5;
const RISING: usize = 3;
/// Share of the peak by which it must fall.
const FALLEN: f64 = 0.005;
/// Share of the fall that may lie between two samples: more is a slip.
const SUDDEN: f64 = 0.5;
/// Samples before the fall that tell how the ramp would have gone on.
const BEFORE: usize = 10;
/// Shares of the way on which the ramp is a line in time.
const LINE: [f64; 2] = [0.6, 0.95];
/// Share of the way by which the crosshead has turned: it starts slowly, so that its line in time does not tell.
const MOVED: f64 = 0.002;
/// And what the encoder's noise may be of it.
const COARSE: f64 = 2.0;
/// Samples of the hold that tell its place, and of a rest that tell its force.
const PLACE: usize = 5;
/// How much longer than it falls the force may rise before the way, and what part of that it must rise: the sensor tells some while after.
const ALIKE: f64 = 0.4;
const PART: f64 = 0.3;

/// A force that comes early.
pub(super) struct Lead {
    /// By how much (s).
    pub(super) early_s: f64,
    pub(super) fault: Fault,
}

/// Where a force falls too early.
struct Falls {
    early_s: f64,
    /// Rows from where it falls to where the way would let it.
    rows: Vec<usize>,
    /// What the way says of the force at these rows.
    says: Vec<f64>,
    before: &'static str,
}

impl Seen<'_> {
    /// None where the force falls no earlier than the way lets it.
    pub(super) fn lead(&self) -> Option<Lead> {
        let r = self.recording;
        let falls = [self.falls_in_the_ramp(), self.falls_in_the_hold()];
        let mut falls = falls.into_iter().flatten().filter(|falls| self.is_gradual(&falls.rows));
        let (falls, or) =
            falls.find_map(|falls| self.begins_before_the_way(falls.early_s).map(|or| (falls, or)))?;
        // Every other sample, by the way and by the course that the others tell.
        let f = self.forces(&falls.rows);
        let times: Vec<f64> = falls.rows.iter().map(|row| r.time_s[*row]).collect();
        let seen = |list: &[f64]| list.iter().copied().step_by(2).collect::<Vec<_>>();
        let (slope, place, height) = line(&seen(&times), &seen(&f));
        let left = |says: &dyn Fn(usize) -> f64| {
            rms(&(1..f.len()).step_by(2).map(|k| f[k] - says(k)).collect::<Vec<_>>()) / self.peak
        };
        let held_out = [left(&|k| falls.says[k]), left(&|k| height + slope * (times[k] - place))];
        let begins = if or.is_empty() {
            "rises before the ramp begins"
        } else {
            "is not nothing where the file begins"
        };
        let shown =
            format!("the force falls from {:.2} s before {}, and {begins}", falls.early_s, falls.before);
        let ends = [falls.rows[0], falls.rows[falls.rows.len() - 1]];
        let fault = self.fault(Name::Lead, ends, shown, held_out)?;
        Some(Lead { early_s: falls.early_s, fault: Fault { or, ..fault } })
    }

    /// Whether it falls by enough, and sample by sample.
    fn is_gradual(&self, rows: &[usize]) -> bool {
        let f = self.forces(rows);
        let (Some(first), Some(last)) = (f.first(), f.last()) else { return false };
        let sudden = f.windows(2).map(|w| w[0] - w[1]).fold(0.0, f64::max);
        let fall = first - last;
        f.len() > FALLING
            && fall > (SIGMAS * noise(&f).max(self.sigma)).max(FALLEN * self.peak)
            && sudden < SUDDEN * fall
    }

    /// A force that falls while the ramp goes on. By the way, it would have gone on as before.
    fn falls_in_the_ramp(&self) -> Option<Falls> {
        let r = self.recording;
        let ramp = r.rows(Phase::Ramp);
        let f = self.forces(&ramp);
        let smooth = |k: usize| middle(&f[k - 1..k + 2]);
        let top = (1..f.len().saturating_sub(1)).max_by(|a, b| smooth(*a).total_cmp(&smooth(*b)))?;
        let before = &ramp[top.checked_sub(BEFORE)?..top];
        let way = |rows: &[usize]| rows.iter().map(|row| r.deformation[*row]).collect::<Vec<_>>();
        let (slope, place, height) = line(&way(before), &self.forces(before));
        let rows = ramp[top..].to_vec();
        let held = middle(&way(&r.rows(Phase::Hold)[..PLACE]));
        let on_line = |row: &&usize| (LINE[0] * held..=LINE[1] * held).contains(&r.deformation[**row]);
        let steady: Vec<usize> = ramp.iter().filter(on_line).copied().collect();
        let times: Vec<f64> = steady.iter().map(|row| r.time_s[*row]).collect();
        let (rate, at_s, at) = line(&times, &way(&steady));
        let early_s = at_s + (held - at) / rate - r.time_s[rows[0]];
        (rate > 0.0 && early_s > 0.0).then(|| Falls {
            early_s,
            says: way(&rows).iter().map(|w| height + slope * (w - place)).collect(),
            rows,
            before: "the ramp ends",
        })
    }

    /// A force that falls while the way is still held. By the way, it would have stayed.
    fn falls_in_the_hold(&self) -> Option<Falls> {
        let r = self.recording;
        let (hold, back) = (r.rows(Phase::Hold), r.rows(Phase::Unloading));
        let late = &hold[hold.len() - hold.len() / 10..];
        let stays = middle(&self.forces(late));
        let way: Vec<f64> = late.iter().map(|row| r.deformation[*row]).collect();
        let held = middle(&way);
        let moved = (MOVED * held).max(SIGMAS * noise(&way));
        // An encoder so noisy tells of the turn too late to be held against the force.
        if moved > COARSE * MOVED * held {
            return None;
        }
        let left = |row: &&usize| r.deformation[**row] < held - moved;
        let turned_s = r.time_s[*late.iter().chain(&back).find(left)?];
        let own = noise(&self.forces(&back)).max(self.sigma);
        let limit = (SIGMAS * own).max(MATTERS * self.peak);
        let early: Vec<usize> =
            late.iter().chain(&back).copied().filter(|row| r.time_s[*row] < turned_s).collect();
        let from = early.iter().rposition(|row| r.force[*row] > stays - limit)? + 1;
        let rows = early[from..].to_vec();
        Some(Falls {
            early_s: turned_s - r.time_s[*rows.first()?],
            says: vec![stays; rows.len()],
            rows,
            before: "the crosshead turns",
        })
    }

    /// Whether the force rises before the way does: what else it may be; none where it does not.
    fn begins_before_the_way(&self, early_s: f64) -> Option<Vec<Name>> {
        let r = self.recording;
        let (rest, ramp) = (r.rows(Phase::Rest), r.rows(Phase::Ramp));
        let own = noise(&self.forces(&rest)).max(self.sigma);
        let limit = (SIGMAS * own).max(MATTERS * self.peak);
        let free = self.tail().map(|(_, free)| free);
        if rest.len() < PLACE {
            let loaded = r.force[*ramp.first()?] - free? > limit;
            return loaded.then(|| vec![Name::LoadedBefore]);
        }
        let f = self.forces(&rest);
        let still = mean(&f[..PLACE.min(f.len() / 2)]);
        let rises = f.iter().rev().take_while(|v| **v > still + limit).count();
        let moves_s = r.time_s[*ramp.first()?];
        let before_s = moves_s - r.time_s[rest[rest.len() - rises.max(1)]];
        let rested_s = moves_s - r.time_s[rest[0]];
        let alike = (PART * early_s.min(rested_s)..=(1.0 + ALIKE) * early_s).contains(&before_s);
        (rises >= RISING && alike).then(Vec::new)
    }
}
