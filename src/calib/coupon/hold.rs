//! Ramp, hold and way back: what did the model leave out?
//!
//! Thresholds are in standard deviations of the noise and, so that nothing too small to matter is named, in shares of the peak. A mark alone is no name:
//! see [`super::held_out`].

use super::curve::{Base, Curve, Part, read};
use super::fault::{Fault, Name};
use super::held_out::{helps, level, line, rms};
use super::marks::mean;
use crate::calib::noise::{middle, noise, quantum};
use crate::calib::relaxation::{Choice, Phase, Recording};

/// Standard deviations from which a mean or a sample is not noise.
pub(super) const SIGMAS: f64 = 6.0;
/// Share of the peak below which nothing is named.
pub(super) const MATTERS: f64 = 0.002;
/// Share of the peak that unseen rows may be missed by.
const MISSED: f64 = 0.02;
/// Share of the way that may meet no force.
const SLACK: f64 = 0.03;
/// How much steeper a ramp must become to be called so.
const STEEPER: f64 = 1.2;
/// How much the rate of a steady ramp may change.
const STEADY: f64 = 0.2;
/// Rows of a ramp that tell where it begins, and share of the peak below which that is no load.
const BEGIN_ROWS: usize = 10;
const BEGUN: f64 = 0.01;
/// Rows that tell a level.
const LEVEL_ROWS: usize = 5;
/// Rows of the way back that tell the level of the free plate.
const FREE_ROWS: usize = 12;
/// How much the step of a slip and the shift of the zero may differ to be one thing, over the step.
const ALIKE: f64 = 0.3;
/// Share of the force lost in the hold below which that is not called memory.
const FALL: f64 = 0.02;

/// Names what `choice` left out of a recording, or took in. `unseen` is the recording's share of [`Choice::unseen`].
pub fn diagnose(recording: &Recording, choice: &Choice, unseen: &[(usize, f64)]) -> Vec<Fault> {
    // Whatever else is left out shows once the force stands where it belongs.
    let whole = |r: &Recording, than: &Recording| {
        [Phase::Ramp, Phase::Hold].iter().all(|phase| r.rows(*phase).len() >= than.rows(*phase).len() / 2)
    };
    let lead = Seen::new(recording).lead();
    let mended = lead.as_ref().map(|lead| recording.with_force_later(lead.early_s));
    let mended = mended.filter(|mended| whole(mended, recording));
    let see = Seen::new(mended.as_ref().unwrap_or(recording));
    let mut faults: Vec<Fault> = lead.into_iter().map(|lead| lead.fault).collect();
    faults.extend(see.zeros());
    faults.extend(see.ramp());
    for (fault, step) in see.jumps() {
        // A zero that jumps takes the force with it: the same step at the end of the test tells it from a slip.
        let stays = see.tail().map(|(_, end)| (step - (end - recording.zero())).abs() < ALIKE * step.abs());
        let named = match stays {
            Some(true) => {
                faults.retain(|f| f.name != Name::ZeroMoved);
                let shown = format!("{}, and unloaded the sensor is off by the same", fault.shown);
                Fault { name: Name::ZeroMoved, shown, ..fault }
            }
            Some(false) if step < 0.0 => fault,
            None if step < 0.0 => Fault { or: vec![Name::ZeroMoved], ..fault },
            _ => Fault { name: Name::Unexplained, held_out: None, ..fault },
        };
        faults.push(named);
    }
    faults.extend(see.spikes());
    faults.extend(see.saturated());
    faults.extend(see.rise());
    faults.extend(see.not_held());
    faults.extend(see.way_back());
    faults.extend(see.memory(unseen));
    if !faults.iter().any(|f| f.name == Name::Stiffening) {
        faults.extend(see.stiffening(choice));
    }
    // What is named of the ramp and of the hold's steps explains that a model misses them.
    let explains = |f: &Fault| {
        use Name::{Lag, Lead, LoadedBefore, Rise, Saturated, Slack, Slipped, Unexplained};
        [Slipped, Rise, Saturated, Unexplained, Slack, LoadedBefore, Lag, Lead].contains(&f.name)
    };
    let explained = faults.iter().any(explains);
    faults.extend(if explained { None } else { see.unexplained("unseen data is", unseen) });
    let shapes = |f: &Fault| explains(f) || matches!(f.name, Name::Stiffening | Name::NotHeld | Name::Spikes);
    if !faults.iter().any(shapes) {
        faults.extend(see.missed(choice));
    }
    faults
}

pub(super) struct Seen<'a> {
    pub(super) recording: &'a Recording,
    pub(super) peak: f64,
    /// Noise of the hold's second half.
    pub(super) sigma: f64,
    /// Step in which the sensor counts; zero where it shows none.
    pub(super) step: f64,
}

impl<'a> Seen<'a> {
    fn new(recording: &'a Recording) -> Self {
        let peak = recording.peak() - recording.zero();
        let hold = recording.rows(Phase::Hold);
        let forces: Vec<f64> = hold[hold.len() / 2..].iter().map(|r| recording.force[*r]).collect();
        Self { recording, peak, sigma: noise(&forces), step: quantum(&recording.force) }
    }

    pub(super) fn forces(&self, rows: &[usize]) -> Vec<f64> {
        rows.iter().map(|r| self.recording.force[*r]).collect()
    }

    pub(super) fn fault(
        &self,
        name: Name,
        rows: [usize; 2],
        shown: String,
        held_out: [f64; 2],
    ) -> Option<Fault> {
        let lines = rows.map(|r| self.recording.lines[r]);
        helps(held_out).then(|| Fault { name, or: Vec::new(), lines, shown, held_out: Some(held_out) })
    }

    pub(super) fn say(&self, force: f64) -> String {
        let (scale, unit) = if self.recording.force_unit == "N" { (1.0, "N") } else { (1e-3, "kPa") };
        format!("{:.4} {unit} ({:.1} % of the peak)", scale * force, 100.0 * force / self.peak)
    }

    /// The flat end of the way back: rows, and mean force; none where the file ends before the force does.
    pub(super) fn tail(&self) -> Option<(Vec<usize>, f64)> {
        let back = self.recording.rows(Phase::Unloading);
        let rows = back[back.len() - back.len() / 4..].to_vec();
        if rows.len() < FREE_ROWS {
            return None;
        }
        let f = self.forces(&rows);
        let half = f.len() / 2;
        let still = (mean(&f[..half]) - mean(&f[half..])).abs()
            < (SIGMAS * noise(&f) / (half as f64).sqrt()).max(1e-3 * self.peak);
        still.then(|| (rows, mean(&f)))
    }

    /// Force where nothing pulls yet, with its rows.
    fn rest(&self) -> Option<(Vec<usize>, f64)> {
        let rows = self.recording.rows(Phase::Rest);
        (rows.len() >= LEVEL_ROWS).then(|| (rows.clone(), middle(&self.forces(&rows))))
    }

    /// Whether a level is off another by more than its noise and by enough.
    fn differs(&self, rows: &[usize], off: f64) -> bool {
        let own = noise(&self.forces(rows)).max(self.sigma);
        off.abs() > (SIGMAS * own / (rows.len() as f64).sqrt()).max(MATTERS * self.peak)
    }

    /// The free plate behind the test shows the sensor's zero. Before the test the plate may already touch: more force there than behind
    /// is a zero that moved, or a specimen that was pressed.
    fn zeros(&self) -> Vec<Fault> {
        let (rest, tail) = (self.rest(), self.tail());
        let mut found = Vec::new();
        let ends = |rows: &[usize]| [rows[0], rows[rows.len() - 1]];
        let off = |rows: &[usize], from: f64| level(&self.forces(rows), from, self.peak);
        match (&rest, &tail) {
            (Some((rows, before)), None) if self.differs(rows, *before) => {
                let shown = format!("before anything moves the sensor shows {}", self.say(*before));
                let fault = self.fault(Name::SensorZero, ends(rows), shown, off(rows, 0.0));
                let pressed = if *before > 0.0 { vec![Name::LoadedBefore] } else { Vec::new() };
                found.extend(fault.map(|f| Fault { or: pressed, ..f }));
            }
            (_, Some((rows, free))) => {
                if rest.is_none() {
                    found.extend(self.began_loaded(*free));
                }
                let before = rest.as_ref().map(|(_, before)| *before);
                let moved = before.is_some_and(|b| self.differs(rows, free - b));
                let began = before.unwrap_or(0.0);
                let began_off = rest.as_ref().is_none_or(|(rows, b)| self.differs(rows, *b));
                if self.differs(rows, *free) && (!moved || began_off) {
                    let shown =
                        format!("with the plate free behind the test the sensor shows {}", self.say(*free));
                    found.extend(self.fault(Name::SensorZero, ends(rows), shown, off(rows, 0.0)));
                }
                if moved {
                    let shown = format!(
                        "with the plate free behind the test the sensor shows {}, before the test {}",
                        self.say(*free),
                        self.say(began)
                    );
                    let fault = self.fault(Name::ZeroMoved, ends(rows), shown, off(rows, began));
                    let pressed = if began > *free { vec![Name::LoadedBefore] } else { Vec::new() };
                    found.extend(fault.map(|f| Fault { or: pressed, ..f }));
                }
            }
            _ => {}
        }
        found
    }

    /// A file that begins with the ramp, at a force that is not that of the free plate: the line through its first rows says which. Held out: every
    /// other of them, by the free plate's force going on from there and by the line.
    fn began_loaded(&self, free: f64) -> Option<Fault> {
        let r = self.recording;
        // The first row has not moved yet, wherever the file begins.
        let moves: Vec<usize> = [Phase::Rest, Phase::Ramp].into_iter().flat_map(|p| r.rows(p)).collect();
        let rows = &moves[..moves.len().min(BEGIN_ROWS)];
        let way: Vec<f64> = rows.iter().map(|row| r.deformation[*row]).collect();
        let f = self.forces(rows);
        let (slope, place, height) = line(&way, &f);
        // A course that begins steeply reaches less than its line says.
        let began = (height + slope * (way.first()? - place)).min(*f.first()?);
        let own = noise(&f).max(self.sigma);
        let limit = (SIGMAS * own).max(BEGUN * self.peak).max(self.step);
        if rows.len() < BEGIN_ROWS || began - free < limit {
            return None;
        }
        let left = |base: f64| {
            let off = (1..rows.len()).step_by(2).map(|k| f[k] - base - slope * (way[k] - way[0]));
            rms(&off.collect::<Vec<_>>()) / self.peak
        };
        let shown = format!(
            "where the file begins the force is {} above that of the free plate behind the test: its first part is missing",
            self.say(began - free)
        );
        let fault = self.fault(
            Name::LoadedBefore,
            [rows[0], rows[rows.len() - 1]],
            shown,
            [left(free), left(began)],
        )?;
        Some(Fault { or: vec![Name::ZeroMoved], ..fault })
    }

    /// A ramp that begins late, or grows steeper. Memory bends a steady ramp the other way: each term that relaxes takes more the longer it
    /// lasts, so that what grows steeper stiffens, or meets the plate bit by bit. What predicts alike is not told apart.
    fn ramp(&self) -> Vec<Fault> {
        let r = self.recording;
        let ramp = r.rows(Phase::Ramp);
        let zero = self.rest().map_or(0.0, |(_, zero)| zero);
        let mut points: Vec<(f64, f64)> =
            ramp.iter().map(|row| (r.deformation[*row], r.force[*row] - zero)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let base = Base::StraightFromZero;
        let Some((readings, best)) = read(base, &points).and_then(|r| Some((r.clone(), *r.left.first()?)))
        else {
            return Vec::new();
        };
        let all = |part: Part| readings.left.iter().all(|(shape, _)| shape.has(part));
        let any =
            |part: Part| readings.left.iter().find(|(shape, _)| shape.has(part)).map(|(shape, _)| *shape);
        let held_out = |parts: &[Part]| [readings.without(parts) / self.peak, best.1 / self.peak];
        let whole = r.deformation.iter().copied().fold(0.0, f64::max);
        let mut found = Vec::new();
        let steeper =
            any(Part::Bend).and_then(|shape| Curve::fit(base, shape, &points)).map(|c| c.steepens());
        let steeper = steeper.filter(|s| *s > STEEPER && self.is_steady(&ramp));
        let slack = any(Part::Slack).and_then(|shape| Curve::fit(base, shape, &points)).map(|c| c.slack);
        let slack = slack.filter(|s| *s > SLACK * whole);
        if let Some(slack) = slack.filter(|_| all(Part::Slack)) {
            let last = ramp.iter().copied().rfind(|row| r.deformation[*row] <= slack).unwrap_or(ramp[0]);
            let shown = format!("no force over the first {:.1} % of the way", 100.0 * slack / whole);
            let turn = self.turn().filter(|turn| turn.is_like(slack / self.rate()));
            let (name, or, shown) = match turn {
                None => (Name::Slack, Vec::new(), shown),
                Some(turn) => {
                    let late = format!("{shown}, and {:.2} s late where the crosshead turns", turn.late_s);
                    (Name::Lag, vec![Name::Play], late)
                }
            };
            let fault = self.fault(name, [ramp[0], last], shown, held_out(&[Part::Slack]));
            found.extend(fault.map(|f| Fault { or, ..f }));
        }
        if !found.iter().any(|f| f.name == Name::Lag)
            && let Some(turn) = self.turn()
        {
            let shown = format!("where the crosshead turns, the force stays for {:.2} s", turn.late_s);
            let way = format!("{shown}, over {:.3} mm", 1e3 * turn.way);
            let shown = if r.deformation_unit == "m" { way } else { shown };
            // So short a delay does not show where the ramp begins, nor does any where the file begins with it: the force may be late there, too.
            let shows = turn.way > SLACK * whole && self.rest().is_some();
            let or = if shows { Vec::new() } else { vec![Name::Lag] };
            let fault = self.fault(Name::Play, turn.rows, shown, turn.held_out);
            found.extend(fault.map(|f| Fault { or, ..f }));
        }
        if let Some(steeper) = steeper.filter(|_| all(Part::Bend) || (slack.is_some() && !all(Part::Slack))) {
            let or = if all(Part::Bend) { Vec::new() } else { vec![Name::Slack] };
            let parts: &[Part] = if or.is_empty() { &[Part::Bend] } else { &[Part::Bend, Part::Slack] };
            let shown = format!("the ramp is {steeper:.1} times as steep in its last fifth as in its first");
            let fault = self.fault(Name::Stiffening, [ramp[0], ramp[ramp.len() - 1]], shown, held_out(parts));
            found.extend(fault.map(|f| Fault { or, ..f }));
        }
        found
    }

    /// Whether the deformation goes on evenly.
    fn is_steady(&self, ramp: &[usize]) -> bool {
        let r = self.recording;
        let rate = |rows: &[usize]| match (rows.first(), rows.last()) {
            (Some(a), Some(b)) if b > a => {
                (r.deformation[*b] - r.deformation[*a]) / (r.time_s[*b] - r.time_s[*a])
            }
            _ => f64::NAN,
        };
        let third = ramp.len() / 3;
        let (early, late) = (rate(&ramp[..third]), rate(&ramp[ramp.len() - third..]));
        (late / early - 1.0).abs() < STEADY
    }

    /// Against the best force that stays, which the seen rows of the hold tell.
    fn memory(&self, unseen: &[(usize, f64)]) -> Option<Fault> {
        let r = self.recording;
        let hold = r.rows(Phase::Hold);
        let end = mean(&self.forces(&hold[hold.len() - hold.len() / 10 - 1..]));
        let fall = r.peak() - end;
        let (first, _) = unseen.first()?;
        if fall < (SIGMAS * self.sigma).max(FALL * self.peak) {
            return None;
        }
        let seen: Vec<usize> = hold.iter().copied().filter(|row| row < first).collect();
        let stays = if seen.is_empty() { r.peak() } else { mean(&self.forces(&seen)) };
        let left = |list: Vec<f64>| rms(&list) / self.peak;
        let held_out = [
            left(unseen.iter().map(|(row, _)| r.force[*row] - stays).collect()),
            left(unseen.iter().map(|(_, off)| *off).collect()),
        ];
        let shown = format!("the force falls by {} while it is held", self.say(fall));
        self.fault(Name::Memory, [hold[0], hold[hold.len() - 1]], shown, held_out)
    }

    /// What several rates tell of shapes.
    fn stiffening(&self, choice: &Choice) -> Option<Fault> {
        let best = |stiffens: bool| {
            let scores = choice.tried.iter().filter(|t| t.kind.stiffens == stiffens).filter_map(|t| t.score);
            scores.fold(f64::INFINITY, f64::min)
        };
        let ramp = self.recording.rows(Phase::Ramp);
        let (first, last) = (*ramp.first()?, *ramp.last()?);
        if !choice.law.kind.stiffens || choice.unseen.len() < 2 {
            return None;
        }
        // Scores are in deviations, stated ones or hundredths of the peak: as shares of the peak here, by their mean.
        let share = self.recording.force_sd.as_ref().map_or(0.01, |sd| mean(sd) / self.peak);
        let held_out = [false, true].map(|stiffens| share * best(stiffens));
        let shown = format!(
            "in unseen rates {:.2} deviations are missed without it, {:.2} with it",
            best(false),
            best(true)
        );
        self.fault(Name::Stiffening, [first, last], shown, held_out)
    }

    /// Rows that the fit saw, and misses nevertheless.
    fn missed(&self, choice: &Choice) -> Option<Fault> {
        let r = self.recording;
        let modelled = choice.law.force(r);
        let left = |phase: Phase| -> Vec<(usize, f64)> {
            r.rows(phase).into_iter().map(|row| (row, r.force[row] - modelled[row])).collect()
        };
        [Phase::Ramp, Phase::Hold]
            .into_iter()
            .find_map(|phase| self.unexplained("rows that were fitted are", &left(phase)))
    }

    /// Parts of rows with what a model misses of them, whose mean is too far off.
    fn unexplained(&self, what: &str, rows: &[(usize, f64)]) -> Option<Fault> {
        let part = (rows.len() / 20).max(1);
        let sd = |row: usize| self.recording.force_sd.as_ref().map_or(0.0, |sd| sd[row]);
        let beyond = |chunk: &[(usize, f64)]| {
            let off = mean(&chunk.iter().map(|u| u.1).collect::<Vec<_>>()).abs();
            let stated = 2.0 * mean(&chunk.iter().map(|u| sd(u.0)).collect::<Vec<_>>());
            let limit = (MISSED * self.peak).max(SIGMAS * self.sigma).max(stated);
            (off > limit).then_some((off, [chunk[0].0, chunk[chunk.len() - 1].0]))
        };
        let off: Vec<(f64, [usize; 2])> = rows.chunks(part).filter_map(beyond).collect();
        let (worst, at) = *off.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let lines = [off[0].1[0], off[off.len() - 1].1[1]].map(|row| self.recording.lines[row]);
        let shown = format!(
            "{what} missed by up to {} (about line {}), and nothing here explains it",
            self.say(worst),
            self.recording.lines[at[0]]
        );
        Some(Fault { name: Name::Unexplained, or: Vec::new(), lines, shown, held_out: None })
    }
}
