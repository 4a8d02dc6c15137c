//! Ramp, hold and unloading of one specimen, from a table.

use super::RelaxationError;
use super::phases::phases;
use crate::calib::export::{Column, Quantity, Table};
use crate::calib::noise::middle;
use std::cmp::Ordering;

/// Rows that a hold must have.
const LEAST_ROWS: usize = 8;
/// Rows of a rest that tell a level.
const REST_ROWS: usize = 5;
/// What happens at a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Before it moves.
    Rest,
    /// Going to the hold.
    Ramp,
    /// Held.
    Hold,
    /// On the way back.
    Unloading,
}

/// A test. Lists are of one length.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// File and specimen.
    pub label: String,
    /// Time (s).
    pub time_s: Vec<f64>,
    /// Deformation from the start, positive in the direction of the ramp (m or 1).
    pub deformation: Vec<f64>,
    /// Force, positive in the direction of the ramp (N or Pa).
    pub force: Vec<f64>,
    /// Its standard deviation, where the file says one.
    pub force_sd: Option<Vec<f64>>,
    /// What happens.
    pub phase: Vec<Phase>,
    /// Line of the file.
    pub lines: Vec<u64>,
    /// Rows of later cycles, which are left out.
    pub later_rows: usize,
    /// Unit of the deformation in SI.
    pub deformation_unit: &'static str,
    /// Unit of the force in SI.
    pub force_unit: &'static str,
}

impl Recording {
    /// From a table with times, a deformation (gap, extension or strain) and a force or stress; a column `SD` is the latter's deviation.
    ///
    /// # Errors
    /// [`RelaxationError`]: columns that are missing or without a unit, no ramp, no hold, no force.
    pub fn from_table(table: &Table) -> Result<Self, RelaxationError> {
        let first = |choices: &[Quantity]| {
            let found = choices.iter().find(|q| table.all(**q).next().is_some());
            *found.unwrap_or(&choices[0])
        };
        let deformation = first(&[Quantity::Strain, Quantity::Gap, Quantity::Extension]);
        let force = first(&[Quantity::Force, Quantity::Stress]);
        let series = table.series(&[Quantity::Time, deformation, force])?;
        let [time, place, load] = &series.values[..] else { unreachable!("three were asked for") };
        let heading = |q| table.column(q).map(|c| c.place.to_string());
        let spread = |v: &[f64]| {
            v.iter().copied().fold(f64::NEG_INFINITY, f64::max)
                - v.iter().copied().fold(f64::INFINITY, f64::min)
        };
        if spread(place).partial_cmp(&0.0) != Some(Ordering::Greater) {
            return Err(RelaxationError::NoRamp { place: heading(deformation)?, spread: 0.0 });
        }
        let start = place[0];
        let farthest =
            place.iter().map(|p| p - start).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        let way = farthest.signum();
        let deformation_list: Vec<f64> = place.iter().map(|p| way * (p - start)).collect();
        let peak =
            load.iter().map(|f| f - load[0]).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        if peak == 0.0 {
            return Err(RelaxationError::NoForce { place: heading(force)?, force: peak });
        }
        let force_list: Vec<f64> = load.iter().map(|f| peak.signum() * f).collect();
        let phase = phases(time, &deformation_list);
        let rows = phase.len();
        let resting: Vec<f64> =
            (0..rows).filter(|r| phase[*r] == Phase::Rest).map(|r| deformation_list[r]).collect();
        // An encoder's first value is no better than its noise.
        let start = if resting.len() < REST_ROWS { 0.0 } else { middle(&resting) };
        let deformation_list: Vec<f64> = deformation_list[..rows].iter().map(|d| d - start).collect();
        let held = phase.iter().filter(|p| **p == Phase::Hold).count();
        if held < LEAST_ROWS {
            return Err(RelaxationError::NoHold {
                place: heading(deformation)?,
                rows: held,
                needed: LEAST_ROWS,
            });
        }
        let sd = table.columns.iter().find(|c| is_sd(c) && c.printed.len() == table.lines.len());
        let printed = &table.column(force)?.printed;
        let told = printed.iter().position(|v| *v != 0.0).unwrap_or(0);
        let scale = table.column(force)?.si_or_why()?[told] / printed[told];
        let force_sd = sd.filter(|_| series.lines.len() == table.lines.len());
        Ok(Self {
            label: table.place.origin.file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            time_s: time[..rows].to_vec(),
            deformation: deformation_list,
            force: force_list[..rows].to_vec(),
            force_sd: force_sd.map(|c| c.printed[..rows].iter().map(|v| (v * scale).abs()).collect()),
            phase,
            lines: series.lines[..rows].to_vec(),
            later_rows: series.lines.len() - rows,
            deformation_unit: if deformation == Quantity::Strain { "" } else { "m" },
            force_unit: if force == Quantity::Force { "N" } else { "Pa" },
        })
    }

    /// The same with forces that were written down later by `by_s` (s): each stands where the deformation was then.
    #[must_use]
    pub fn with_force_later(&self, by_s: f64) -> Self {
        let reached = |t: f64| {
            let next = self.time_s.partition_point(|other| *other < t).clamp(1, self.time_s.len() - 1);
            let [a, b] = [next - 1, next].map(|row| (self.time_s[row], self.deformation[row]));
            a.1 + (b.1 - a.1) * ((t - a.0) / (b.0 - a.0)).clamp(0.0, 1.0)
        };
        let deformation: Vec<f64> = self.time_s.iter().map(|t| reached(t + by_s)).collect();
        let phase = phases(&self.time_s, &deformation);
        // What belongs to no cycle any more is the end of the way back.
        let rest = vec![Phase::Unloading; deformation.len() - phase.len()];
        Self { deformation, phase: [phase, rest].concat(), ..self.clone() }
    }

    /// Rows of a phase.
    pub fn rows(&self, phase: Phase) -> Vec<usize> {
        (0..self.phase.len()).filter(|r| self.phase[*r] == phase).collect()
    }

    /// Greatest force.
    pub fn peak(&self) -> f64 {
        self.force.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Median force before it moves; zero where the recording begins with the ramp. Why the median: the last rows of a rest may already meet
    /// the specimen, since the encoder tells of a way later than the sensor of a force.
    pub fn zero(&self) -> f64 {
        let rest = self.rows(Phase::Rest);
        if rest.len() < REST_ROWS {
            return 0.0;
        }
        let mut forces: Vec<f64> = rest.iter().map(|r| self.force[*r]).collect();
        forces.sort_by(f64::total_cmp);
        let n = forces.len();
        0.5 * (forces[(n - 1) / 2] + forces[n / 2])
    }
}

fn is_sd(column: &Column) -> bool {
    let name = column.name.trim().to_lowercase();
    ["sd", "std", "stdev", "standard deviation"].contains(&name.as_str())
}
