//! A band's test, cut where it turns round.

use super::BandError;
use crate::calib::export::{Loading, Place, Quantity, Table};
use crate::calib::slip::slip;
use std::cmp::Ordering;

/// Share of the whole way by which the crosshead must come back before it counts as turned.
const TURN: f64 = 0.02;
/// Rows of a branch.
const LEAST_ROWS: usize = 8;

/// Rows in one direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Branch {
    /// First row.
    pub from: usize,
    /// Last row.
    pub to: usize,
    /// Longer and longer.
    pub loading: bool,
    /// Cycle, from 1.
    pub cycle: usize,
}

/// A test. Lists are of one length.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretching {
    /// File and specimen.
    pub label: String,
    /// Extension (m).
    pub extension_m: Vec<f64>,
    /// Force (N).
    pub force_n: Vec<f64>,
    /// Line of the file.
    pub lines: Vec<u64>,
    /// In the order of time.
    pub branches: Vec<Branch>,
}

impl Stretching {
    /// From a table with extension and force.
    ///
    /// # Errors
    /// [`BandError`]: another way of loading, columns that are missing or without a unit, nothing stretched, a slip.
    pub fn from_table(table: &Table) -> Result<Self, BandError> {
        let how = match table.loading {
            Some(Loading::Flexure) => Some("bent"),
            Some(Loading::Compression) => Some("pressed"),
            _ => None,
        };
        if let Some(how) = how {
            return Err(BandError::NotPulled { place: table.place.to_string(), how });
        }
        let series = table.series(&[Quantity::Extension, Quantity::Force])?;
        let stem = table.place.origin.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let label = if table.label.is_empty() { stem } else { format!("{stem} {}", table.label) };
        let [extension, force] = &series.values[..] else { unreachable!("two were asked for") };
        // A band can only be pulled: where both go down together, a pull is written negative.
        let goes = |v: &[f64]| v.iter().map(|x| x - v[0]).sum::<f64>();
        let sign = if goes(extension) < 0.0 && goes(force) < 0.0 { -1.0 } else { 1.0 };
        let turned = |v: &[f64]| v.iter().map(|x| sign * x).collect();
        let mut found = Self::new(label, turned(extension), turned(force));
        found.lines = series.lines;
        if found.branches.is_empty() {
            let place = table.column(Quantity::Extension)?.place.to_string();
            return Err(BandError::NoBranch { place, needed: LEAST_ROWS });
        }
        for branch in found.branches.iter().filter(|b| b.loading) {
            let force = &found.force_n[branch.from..=branch.to];
            if let Some(at) = slip(force) {
                let line = found.lines[branch.from + at];
                let place = Place { line, ..table.column(Quantity::Force)?.place.clone() };
                let (before, after) = (force[at - 1], force[at]);
                return Err(BandError::Slipped { place: place.to_string(), before, after });
            }
        }
        Ok(found)
    }

    /// From lists of one length.
    pub fn new(label: String, extension_m: Vec<f64>, force_n: Vec<f64>) -> Self {
        let branches = branches(&extension_m);
        let lines = (1..=extension_m.len() as u64).collect();
        Self { label, extension_m, force_n, lines, branches }
    }

    /// Points of a branch, in order of extension.
    pub(super) fn points(&self, branch: &Branch) -> Vec<(f64, f64)> {
        let mut points: Vec<(f64, f64)> =
            (branch.from..=branch.to).map(|r| (self.extension_m[r], self.force_n[r])).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    }

    /// Work that a cycle swallows over the work put in; none without its way back.
    pub(super) fn swallowed(&self, loading: &Branch) -> Option<f64> {
        let back = self.branches.iter().find(|b| !b.loading && b.cycle == loading.cycle)?;
        let (up, down) = (self.points(loading), self.points(back));
        let low = up.first()?.0.max(down.first()?.0);
        let high = up.last()?.0.min(down.last()?.0);
        let work = |p: &[(f64, f64)]| -> f64 {
            p.windows(2)
                .filter(|w| w[0].0 >= low && w[1].0 <= high)
                .map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0))
                .sum()
        };
        let put_in = work(&up);
        (put_in > 0.0).then(|| 1.0 - work(&down) / put_in)
    }
}

fn branches(x: &[f64]) -> Vec<Branch> {
    let high = x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let low = x.iter().copied().fold(f64::INFINITY, f64::min);
    let turn = TURN * (high - low);
    if turn.partial_cmp(&0.0) != Some(Ordering::Greater) {
        return Vec::new();
    }
    let mut corners = vec![0];
    let (mut extreme, mut up) = (0, None);
    for row in 1..x.len() {
        let way = x[row] - x[extreme];
        match up {
            None if way.abs() > turn => (up, extreme) = (Some(way > 0.0), row),
            Some(rising) if (way > 0.0) == rising && way != 0.0 => extreme = row,
            Some(rising) if way.abs() > turn => {
                corners.push(extreme);
                (up, extreme) = (Some(!rising), row);
            }
            _ => {}
        }
    }
    corners.push(if up.is_some() { extreme } else { x.len() - 1 });
    let mut cycle = 1;
    let mut list: Vec<Branch> = Vec::new();
    for pair in corners.windows(2) {
        let loading = x[pair[1]] > x[pair[0]];
        if pair[1] - pair[0] + 1 < LEAST_ROWS {
            continue;
        }
        if loading && !list.is_empty() {
            cycle += 1;
        }
        list.push(Branch { from: pair[0], to: pair[1], loading, cycle });
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_cycles_have_four_branches() {
        let x: Vec<f64> = (0..80)
            .map(|i| if (i / 20) % 2 == 0 { f64::from(i % 20) } else { f64::from(20 - i % 20) })
            .collect();
        let found = Stretching::new("a".to_owned(), x.clone(), x);
        let kinds: Vec<(bool, usize)> = found.branches.iter().map(|b| (b.loading, b.cycle)).collect();
        assert_eq!(kinds, [(true, 1), (false, 1), (true, 2), (false, 2)]);
    }
}
