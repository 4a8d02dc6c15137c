//! What changes from cycle to cycle, and on the way back: each is the first way out made less, moved along, or moved down; fitted to every
//! other block of the way, it predicts the blocks between.
//!
//! | reading | y(x) from the first way out y₁ | name |
//! | --- | --- | --- |
//! | less | (α + β u) y₁(x) | softening from cycle to cycle; memory on the way back |
//! | along | y₁(x − d) | set, or slip in the grips; on the way back memory or friction |
//! | down | y₁(x) − c | the zero moved; friction on the way back |
//!
//! With one cycle, less on the way back may be memory as well as softening or a set. A way back above the way out gives energy, which no specimen
//! does: the drive has play, the force comes late, or the zero moves meanwhile. What predicts about as well as the best is not told from it.

use super::curve::solve;
use super::fault::{Fault, Name};
use super::held_out::{helps, rms};
use super::marks::between;
use super::specimen::{Specimen, comparable};
use crate::calib::bands::Branch;

/// Blocks of a way.
const BLOCKS: usize = 10;
/// Share of the greatest force by which a way must be missed for it to matter.
const MATTERS: f64 = 0.01;
/// A reading that predicts so much worse than the best is out.
const WORSE: f64 = 1.25;
/// Shifts tried, over the way.
const SHIFT_TO: f64 = 0.2;
const SHIFTS: usize = 160;

/// How a way follows from the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reading {
    Less,
    Along,
    Down,
}

/// A reading with its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    None,
    /// α and β.
    Less(f64, f64),
    /// d.
    Along(f64),
    /// −c.
    Down(f64),
}

impl Change {
    fn size(self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Less(a, b) => 1.0 - a - 0.5 * b,
            Self::Along(size) | Self::Down(size) => size,
        }
    }
}

/// A way's rows where the first way knows a force: x, y, and y₁.
struct Beside {
    rows: Vec<(f64, f64, f64)>,
    first: Vec<(f64, f64)>,
    low: f64,
    high: f64,
}

impl Beside {
    fn new(first: Vec<(f64, f64)>, other: &[(f64, f64)]) -> Option<Self> {
        let low = first.first()?.0.max(other.first()?.0);
        let high = first.last()?.0.min(other.last()?.0);
        let rows: Vec<(f64, f64, f64)> = other
            .iter()
            .filter(|(x, _)| (low..=high).contains(x))
            .filter_map(|(x, y)| Some((*x, *y, between(&first, *x)?)))
            .collect();
        (rows.len() >= 2 * BLOCKS && high > low).then_some(Self { rows, first, low, high })
    }

    /// Root mean square missed in the blocks between, and how much there is of it (1, x or y).
    fn missed(&self, reading: Option<Reading>) -> Option<(f64, f64)> {
        let mut left = Vec::new();
        let mut sizes = Vec::new();
        for half in 0..2 {
            let seen = |i: usize| (i * BLOCKS / self.rows.len()) % 2 == half;
            let (known, unseen): (Vec<usize>, Vec<usize>) = (0..self.rows.len()).partition(|i| seen(*i));
            let change = reading.map_or(Some(Change::None), |r| self.fit(r, &known))?;
            sizes.push(change.size());
            left.extend(unseen.iter().filter_map(|i| Some(self.rows[*i].1 - self.say(change, *i)?)));
        }
        Some((rms(&left), 0.5 * (sizes[0] + sizes[1])))
    }

    /// Force of a row, if the first way changed so.
    fn say(&self, change: Change, row: usize) -> Option<f64> {
        let (x, _, first) = self.rows[row];
        match change {
            Change::None => Some(first),
            Change::Less(a, b) => Some((a + b * self.place(x)) * first),
            Change::Along(shift) => between(&self.first, x - shift),
            Change::Down(off) => Some(first + off),
        }
    }

    fn place(&self, x: f64) -> f64 {
        (x - self.low) / (self.high - self.low)
    }

    fn fit(&self, reading: Reading, known: &[usize]) -> Option<Change> {
        let rows = || known.iter().map(|i| self.rows[*i]);
        match reading {
            Reading::Less => {
                let design: Vec<Vec<f64>> = rows().map(|(x, _, f)| vec![f, f * self.place(x)]).collect();
                let points: Vec<(f64, f64)> = rows().map(|(x, y, _)| (x, y)).collect();
                let (found, _) = solve(&design, &points)?;
                Some(Change::Less(found[0], found[1]))
            }
            Reading::Down => {
                Some(Change::Down(rows().map(|(_, y, f)| y - f).sum::<f64>() / known.len() as f64))
            }
            Reading::Along => {
                let most = SHIFT_TO * (self.high - self.low);
                let tried = (0..=SHIFTS).filter_map(|k| {
                    let change = Change::Along(most * (2.0 * k as f64 / SHIFTS as f64 - 1.0));
                    let left: Vec<f64> =
                        known.iter().filter_map(|i| Some(self.rows[*i].1 - self.say(change, *i)?)).collect();
                    (2 * left.len() > known.len()).then(|| (change, rms(&left)))
                });
                tried.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(change, _)| change)
            }
        }
    }
}

/// Best reading, those not told from it, sizes, and what is missed without and with it.
struct Found {
    best: (Reading, f64),
    or: Vec<(Reading, f64)>,
    held_out: [f64; 2],
}

fn compare(specimen: &Specimen, first: &Branch, other: &Branch) -> Option<Found> {
    let (one, two) = (specimen.points(first), specimen.points(other));
    if !comparable(&one, &two) {
        return None;
    }
    let beside = Beside::new(one, &two)?;
    let (without, _) = beside.missed(None)?;
    let mut tried: Vec<(Reading, f64, f64)> = [Reading::Less, Reading::Along, Reading::Down]
        .into_iter()
        .filter_map(|r| beside.missed(Some(r)).map(|(missed, size)| (r, missed, size)))
        .collect();
    tried.sort_by(|a, b| a.1.total_cmp(&b.1));
    let best = *tried.first()?;
    let held_out = [without / specimen.peak(), best.1 / specimen.peak()];
    (helps(held_out) && held_out[0] > MATTERS).then(|| Found {
        best: (best.0, best.2),
        or: tried[1..].iter().filter(|t| t.1 <= WORSE * best.1).map(|t| (t.0, t.2)).collect(),
        held_out,
    })
}

/// The last way out against the first.
pub(super) fn from_cycle_to_cycle(specimen: &Specimen) -> Option<Fault> {
    let mut out = specimen.branches.iter().filter(|b| b.loading);
    let (first, last) = (out.next()?, out.next_back()?);
    let found = compare(specimen, first, last)?;
    let name = |reading: Reading| match reading {
        Reading::Less => Name::Softening,
        Reading::Along => Name::Lengthened,
        Reading::Down => Name::ZeroMoved,
    };
    let (reading, size) = found.best;
    let shown = match reading {
        Reading::Less => {
            let more = if size < 0.0 { "more" } else { "less" };
            format!(
                "in cycle {} the force is {:.1} % {more} than in the first",
                last.cycle,
                100.0 * size.abs()
            )
        }
        Reading::Along => {
            let more = if size < 0.0 { "less" } else { "more" };
            format!("in cycle {} the same force comes at {} {more}", last.cycle, specimen.say_x(size.abs()))
        }
        Reading::Down => {
            format!("in cycle {} the force is off by {} throughout", last.cycle, specimen.say_y(size))
        }
    };
    // No specimen grows stiffer or shorter for being stretched.
    let names = |all: Vec<(Reading, f64)>| -> Vec<Name> {
        let can = all.into_iter().filter(|(r, size)| *size > 0.0 || *r == Reading::Down);
        can.map(|(r, _)| name(r)).collect()
    };
    let mut all = names(std::iter::once((reading, size)).chain(found.or).collect());
    let lines = [specimen.lines[last.from], specimen.lines[last.to]];
    if all.is_empty() {
        return Some(Fault { name: Name::Unexplained, or: Vec::new(), lines, shown, held_out: None });
    }
    Some(Fault { name: all.remove(0), or: all, lines, shown, held_out: Some(found.held_out) })
}

/// The way back of the last cycle against its way out.
pub(super) fn way_back(specimen: &Specimen) -> Option<Fault> {
    let back = specimen.branches.iter().rfind(|b| !b.loading)?;
    let out = specimen.branches.iter().rfind(|b| b.loading && b.cycle == back.cycle)?;
    let found = compare(specimen, out, back)?;
    let (reading, size) = found.best;
    let lines = [specimen.lines[back.from], specimen.lines[back.to]];
    let fault = |mut all: Vec<Name>, shown: String| {
        let name = all.remove(0);
        Some(Fault { name, or: all, lines, shown, held_out: Some(found.held_out) })
    };
    let gives = if reading == Reading::Down { size > 0.0 } else { size < 0.0 };
    let way = format!("on the way back of cycle {}", back.cycle);
    if gives {
        let more = match reading {
            Reading::Along => format!("the same force comes at {} less", specimen.say_x(-size)),
            Reading::Less => format!("the force is {:.1} % more", -100.0 * size),
            Reading::Down => format!("the force is {} more throughout", specimen.say_y(size)),
        };
        let shown = format!("{way} {more}: such a loop gives energy, which no specimen does");
        let down = reading == Reading::Down || found.or.iter().any(|(r, _)| *r == Reading::Down);
        let drifts = down.then_some(Name::ZeroMoved);
        return fault([Name::Play, Name::Lag].into_iter().chain(drifts).collect(), shown);
    }
    let settled = specimen.branches.iter().filter(|b| b.loading).count() > 1;
    // Behind the first cycle nothing softens or takes a set any more: cycles that changed are named by themselves.
    let names = |reading: Reading| -> Vec<Name> {
        match (reading, settled) {
            (Reading::Less, true) => vec![Name::Memory],
            (Reading::Less, false) => vec![Name::Memory, Name::Softening],
            (Reading::Along, true) => vec![Name::Memory, Name::Friction],
            (Reading::Along, false) => vec![Name::Memory, Name::Softening, Name::Friction, Name::Lengthened],
            (Reading::Down, _) => vec![Name::Friction],
        }
    };
    let shown = match reading {
        Reading::Less => format!("{way} the force is {:.1} % less", 100.0 * size),
        Reading::Along => format!("{way} the same force comes at {} more", specimen.say_x(size)),
        Reading::Down => format!("{way} the force is off by {} throughout", specimen.say_y(size)),
    };
    let mut all: Vec<Name> = names(reading);
    // A shift or a constant on the way back is how a short loop of any rubber looks, too.
    let others = found.or.iter().map(|(r, _)| *r).chain((reading != Reading::Less).then_some(Reading::Less));
    for name in others.flat_map(names) {
        if !all.contains(&name) {
            all.push(name);
        }
    }
    fault(all, shown)
}
