//! Does the force follow when the crosshead turns, and how does that go with a ramp that begins late?
//!
//! | the force begins late | and falls late where it turns | what that is |
//! | --- | --- | --- |
//! | yes | no | slack |
//! | no | yes | play in the drive, or in the grips |
//! | yes | by the same time | a force that is recorded later, or play on both ways: not told apart at one speed |

use super::held_out::{line, rms};
use super::hold::Seen;
use super::marks::mean;
use crate::calib::relaxation::Phase;

/// Rows of the hold that tell force and place before the turn.
const BEFORE: usize = 5;
/// Shares of the way on which the way back is a line in time.
const LINE: [f64; 2] = [0.95, 0.6];
/// Standard deviations, and share of the force at the turn, by which it must have fallen to follow.
const SIGMAS: f64 = 6.0;
const FALLEN: f64 = 0.02;
/// Rows that must follow, and that a delay must last.
const ROWS: usize = 3;
const LEAST: usize = 5;
/// How much two delays may differ to be one, over the longer one.
const ALIKE: f64 = 0.4;

/// A force that follows late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Turn {
    /// By how much (s), and the way lost (of the deformation's unit).
    pub(super) late_s: f64,
    pub(super) way: f64,
    /// Rows from the turn to where it follows.
    pub(super) rows: [usize; 2],
    /// Share of the peak missed in these rows if it had followed at once, and if it stays.
    pub(super) held_out: [f64; 2],
    /// Time between rows.
    spacing_s: f64,
}

impl Turn {
    /// Whether it is late by as much as a ramp that begins late by `start_s`.
    pub(super) fn is_like(&self, start_s: f64) -> bool {
        let most = self.late_s.max(start_s);
        (self.late_s - start_s).abs() <= ALIKE * most + ROWS as f64 * self.spacing_s
    }
}

impl Seen<'_> {
    /// None where the force follows at once, or where nothing is known of the way back.
    pub(super) fn turn(&self) -> Option<Turn> {
        let r = self.recording;
        let (hold, back) = (r.rows(Phase::Hold), r.rows(Phase::Unloading));
        if hold.len() < 2 * BEFORE || back.len() < 4 * LEAST {
            return None;
        }
        let known = &hold[hold.len() - BEFORE..];
        let place = mean(&known.iter().map(|row| r.deformation[*row]).collect::<Vec<_>>());
        let force = mean(&self.forces(known));
        let on_line = |row: &&usize| (LINE[1] * place..=LINE[0] * place).contains(&r.deformation[**row]);
        let rows: Vec<usize> = back.iter().filter(on_line).copied().collect();
        if rows.len() < LEAST {
            return None;
        }
        let times: Vec<f64> = rows.iter().map(|row| r.time_s[*row]).collect();
        let (rate, at, way) = line(&times, &rows.iter().map(|row| r.deformation[*row]).collect::<Vec<_>>());
        let spacing_s = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
        if rate >= 0.0 {
            return None;
        }
        let turned_s = at + (place - way) / rate;
        let limit = (SIGMAS * self.sigma).max(FALLEN * (force - r.zero()));
        let below = |row: usize| r.force[row] < force - limit;
        let follows = (0..back.len().saturating_sub(ROWS)).find(|k| (0..ROWS).all(|j| below(back[k + j])))?;
        let late_s = r.time_s[back[follows]] - turned_s;
        let lost: Vec<usize> =
            back[..follows].iter().copied().filter(|row| r.time_s[*row] >= turned_s).collect();
        // It stays: a force that rises at the turn is something else.
        let stays = lost.iter().all(|row| r.force[*row] < force + limit);
        if late_s < LEAST as f64 * spacing_s || lost.len() < LEAST || !stays {
            return None;
        }
        // As it falls once it follows.
        let then = &back[follows..(follows + 2 * LEAST).min(back.len())];
        let (fall, _, _) =
            line(&then.iter().map(|row| r.deformation[*row]).collect::<Vec<_>>(), &self.forces(then));
        let left = |says: &dyn Fn(usize) -> f64| {
            rms(&lost.iter().map(|row| r.force[*row] - says(*row)).collect::<Vec<_>>()) / self.peak
        };
        let held_out = [left(&|row| force + fall * (r.deformation[row] - place)), left(&|_| force)];
        Some(Turn { late_s, way: -rate * late_s, rows: [lost[0], back[follows]], held_out, spacing_s })
    }

    /// Mean rate of the ramp (deformation's unit over s).
    pub(super) fn rate(&self) -> f64 {
        let r = self.recording;
        let ramp = r.rows(Phase::Ramp);
        let times: Vec<f64> = ramp.iter().map(|row| r.time_s[*row]).collect();
        line(&times, &ramp.iter().map(|row| r.deformation[*row]).collect::<Vec<_>>()).0
    }
}
