//! Dumb-bells and bands: what did a plain spring leave out, on the way out, from cycle to cycle, and on the way back?

use super::curve::{Base, Curve, LEAST_ROWS, Part, Readings, Scored, Shape, read};
use super::cycles;
use super::fault::{Fault, Name};
use super::held_out::{helps, level};
use super::marks::mean;
use super::plateau::plateau;
use crate::calib::bands::{Branch, Stretching};
use crate::calib::dumbbell::Pull;
use crate::calib::noise::noise;

/// Share of the greatest force below which a way that is missed is met well enough.
const WELL: f64 = 0.003;
/// Share of the greatest force that even the best model may miss before it is said that something can't be told.
const MISSED: f64 = 0.02;
/// Standard deviations of the noise that unseen rows may be missed by.
const NOISE: f64 = 2.0;
/// How much a slope must change to be called so.
const BENT: f64 = 0.03;

/// What is deformed, and what the numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Strain and engineering stress (Pa).
    Dumbbell,
    /// Extension (m) and force (N).
    Band,
}

/// A specimen that was pulled, and perhaps let back. Lists are of one length.
#[derive(Debug, Clone, PartialEq)]
pub struct Specimen {
    /// File and specimen.
    pub label: String,
    pub(super) kind: Kind,
    /// Strain, or extension (m).
    pub(super) x: Vec<f64>,
    /// Engineering stress (Pa), or force (N).
    pub(super) y: Vec<f64>,
    /// Line of the file.
    pub(super) lines: Vec<u64>,
    pub(super) branches: Vec<Branch>,
}

impl Specimen {
    /// A dumb-bell within strains up to `to`.
    pub fn of_dumbbell(pull: &Pull, to: f64) -> Self {
        let rows: Vec<usize> = (0..pull.strain.len()).filter(|r| pull.strain[*r] <= to).collect();
        let pick = |list: &[f64]| -> Vec<f64> { rows.iter().map(|r| list[*r]).collect() };
        let (x, y) = (pick(&pull.strain), pick(&pull.stress));
        let branches = Stretching::new(String::new(), x.clone(), y.clone()).branches;
        let lines = rows.iter().map(|r| pull.lines[*r]).collect();
        Self { label: pull.label.clone(), kind: Kind::Dumbbell, x, y, lines, branches }
    }

    /// Bands.
    pub fn of_bands(bands: &Stretching) -> Self {
        Self {
            label: bands.label.clone(),
            kind: Kind::Band,
            x: bands.extension_m.clone(),
            y: bands.force_n.clone(),
            lines: bands.lines.clone(),
            branches: bands.branches.clone(),
        }
    }

    /// Greatest force or stress, from the first.
    pub(super) fn peak(&self) -> f64 {
        self.y.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    /// Points of a branch, in order of x.
    pub(super) fn points(&self, branch: &Branch) -> Vec<(f64, f64)> {
        let mut points: Vec<(f64, f64)> = (branch.from..=branch.to).map(|r| (self.x[r], self.y[r])).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    }

    fn base(&self) -> Base {
        if self.kind == Kind::Dumbbell { Base::NeoHookean } else { Base::Straight }
    }

    pub(super) fn say_x(&self, x: f64) -> String {
        if self.kind == Kind::Dumbbell { format!("a strain of {x:.3}") } else { format!("{:.2} mm", 1e3 * x) }
    }

    pub(super) fn say_y(&self, y: f64) -> String {
        let share = 100.0 * y / self.peak();
        if self.kind == Kind::Dumbbell {
            format!("{:.3} kPa ({share:.1} % of the greatest)", 1e-3 * y)
        } else {
            format!("{y:.3} N ({share:.1} % of the greatest)")
        }
    }

    /// Lines of the rows of a branch with x between two places.
    pub(super) fn lines_of(&self, branch: &Branch, from: f64, to: f64) -> [u64; 2] {
        let rows = (branch.from..=branch.to).filter(|r| (from..=to).contains(&self.x[*r]));
        let lines: Vec<u64> = rows.map(|r| self.lines[r]).collect();
        let first = lines.iter().min().copied().unwrap_or(self.lines[branch.from]);
        [first, lines.iter().max().copied().unwrap_or(first)]
    }

    /// Names what a plain spring leaves out.
    pub fn diagnose(&self) -> Vec<Fault> {
        let Some(first) = self.branches.iter().find(|b| b.loading) else { return Vec::new() };
        let points = self.points(first);
        let mut faults = Vec::new();
        let saturated = self.saturated(first, &points);
        if let Some(readings) = read(self.base(), &points) {
            faults.extend(self.way_out(first, &points, &readings));
        }
        if let Some(fault) = saturated {
            // The end of the way out shows the sensor, and nothing of shapes.
            faults.retain(|f| f.name == Name::SensorZero);
            faults.push(fault);
            return faults;
        }
        faults.extend(cycles::from_cycle_to_cycle(self));
        // A zero that moves from cycle to cycle moves on the way back, too.
        let moves = faults.iter().any(|f| f.name == Name::ZeroMoved);
        faults.extend(cycles::way_back(self).filter(|f| !(moves && f.or.contains(&Name::ZeroMoved))));
        faults
    }

    fn way_out(&self, branch: &Branch, points: &[(f64, f64)], readings: &Readings) -> Vec<Fault> {
        let peak = self.peak();
        let mut faults = Vec::new();
        let Some(best) = readings.left.first() else { return faults };
        let within = |part: &Part| readings.left.iter().all(|(s, _)| s.has(*part));
        // A force where a band's file begins is in its base; what the rows in the slack show is asked below.
        let parts: &[Part] = if self.base() == Base::Straight {
            &[Part::Slack, Part::Bend]
        } else {
            &[Part::Slack, Part::Zero, Part::Bend]
        };
        let sure: Vec<Part> = parts.iter().copied().filter(within).collect();
        let open: Vec<Part> = parts
            .iter()
            .copied()
            .filter(|p| !within(p) && readings.left.iter().any(|(s, _)| s.has(*p)))
            .collect();
        let missed = |parts: &[Part]| [readings.without(parts) / peak, best.1 / peak];
        for part in &sure {
            faults.extend(self.fault(branch, points, *best, *part, &[], missed(&[*part])));
        }
        let likeliest = open.iter().copied().find(|p| best.0.has(*p));
        if let Some(part) = likeliest {
            let of = |p: Part| readings.left.iter().map(|(s, _)| *s).find(|s| s.has(p));
            let rivals = open.iter().copied().filter(|p| *p != part);
            let others: Vec<(Part, Shape)> = rivals.filter_map(|p| Some((p, of(p)?))).collect();
            faults.extend(self.fault(branch, points, *best, part, &others, missed(&open)));
        }
        if let Some(slack) = faults.iter().find(|f| f.name == Name::Slack && f.or.is_empty()) {
            let fault = self.slack_band(branch, slack);
            faults.extend(fault);
        }
        let values: Vec<f64> = points.iter().map(|p| p.1).collect();
        if best.1 > (MISSED * peak).max(NOISE * noise(&values)) {
            let last = points[points.len() - 1].0;
            faults.push(Fault {
                name: Name::Unexplained,
                or: Vec::new(),
                lines: self.lines_of(branch, points[0].0, last),
                shown: format!(
                    "on the first way out unseen rows are missed by {} whatever is in the model",
                    self.say_y(best.1)
                ),
                held_out: None,
            });
        }
        faults
    }

    /// A force that stays while the way goes on. Where samples are not equal, the specimen itself may have given way.
    fn saturated(&self, branch: &Branch, points: &[(f64, f64)]) -> Option<Fault> {
        let (way, force): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
        let greatest = self.y.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let found = plateau(&way, &force, greatest, 0)?;
        let held_out = found.missed.map(|m| m / self.peak());
        helps(held_out).then(|| Fault {
            name: Name::Saturated,
            or: if found.exact { Vec::new() } else { vec![Name::Flattening] },
            lines: self.lines_of(branch, way[found.from], way[way.len() - 1]),
            shown: format!(
                "the last {} samples of the way out show the same {}",
                way.len() - found.from,
                self.say_y(found.level)
            ),
            held_out: Some(held_out),
        })
    }

    /// What the sensor shows while a band is slack.
    fn slack_band(&self, branch: &Branch, slack: &Fault) -> Option<Fault> {
        let rows =
            (branch.from..=branch.to).filter(|r| (slack.lines[0]..=slack.lines[1]).contains(&self.lines[*r]));
        let shown: Vec<f64> = rows.map(|r| self.y[r]).collect();
        let held_out = level(&shown, 0.0, self.peak());
        let named = self.base() == Base::Straight && helps(held_out) && held_out[0] > WELL;
        named.then(|| Fault {
            name: Name::SensorZero,
            or: Vec::new(),
            lines: slack.lines,
            shown: format!("while the band is slack the sensor shows {}", self.say_y(mean(&shown))),
            held_out: Some(held_out),
        })
    }

    /// The fault of a part, or of it and others that predict alike; none where it helps too little.
    fn fault(
        &self,
        branch: &Branch,
        points: &[(f64, f64)],
        (shape, _): Scored,
        part: Part,
        others: &[(Part, Shape)],
        held_out: [f64; 2],
    ) -> Option<Fault> {
        if !helps(held_out) || held_out[0] < WELL {
            return None;
        }
        let curve = Curve::fit(self.base(), shape, points)?;
        let (first, last) = (points[0].0, points[points.len() - 1].0);
        let zero = curve.zero();
        let beside = if zero > 0.0 { vec![Name::LoadedBefore] } else { Vec::new() };
        let (name, shown, to) = match part {
            Part::Slack => {
                let way = self.say_x(curve.slack);
                (Name::Slack, format!("no force before {way}"), curve.slack)
            }
            Part::Zero => {
                let shown = format!("where nothing pulls yet the sensor shows {}", self.say_y(zero));
                (Name::SensorZero, shown, if shape.slack { curve.slack } else { last })
            }
            Part::Bend => {
                let steepens = curve.steepens();
                if (steepens - 1.0).abs() < BENT || !steepens.is_finite() {
                    return None;
                }
                let name = if steepens > 1.0 { Name::Stiffening } else { Name::Flattening };
                let plain = Curve::fit(self.base(), shape.without(Part::Bend), points)?;
                let off = |x: f64| (curve.at(x) - plain.at(x)).abs();
                let most = points.iter().map(|p| off(p.0)).fold(0.0, f64::max);
                let shown = format!(
                    "from the first to the last fifth of the way the slope grows {steepens:.2}-fold beyond the plain spring's; a plain one \
                     misses up to {}",
                    self.say_y(most)
                );
                (name, shown, last)
            }
        };
        let zeros = others.iter().filter(|(p, _)| *p == Part::Zero);
        let shown = zeros.filter_map(|(_, shape)| Curve::fit(self.base(), *shape, points)).fold(
            shown,
            |text, curve| {
                format!("{text}; or the sensor shows {} where nothing pulls", self.say_y(curve.zero()))
            },
        );
        let mut or: Vec<Name> = others
            .iter()
            .map(|(part, shape)| match part {
                Part::Slack => Name::Slack,
                Part::Zero => Name::SensorZero,
                Part::Bend => {
                    let steepens = Curve::fit(self.base(), *shape, points).is_none_or(|c| c.steepens() > 1.0);
                    if steepens { Name::Stiffening } else { Name::Flattening }
                }
            })
            .collect();
        // Where rows lie in the slack, nothing pulled there.
        if part == Part::Zero && !shape.slack {
            or.extend(beside);
        }
        Some(Fault { name, or, lines: self.lines_of(branch, first, to), shown, held_out: Some(held_out) })
    }
}

/// Enough rows on both ways to compare.
pub(super) fn comparable(a: &[(f64, f64)], b: &[(f64, f64)]) -> bool {
    a.len() >= LEAST_ROWS && b.len() >= LEAST_ROWS
}
