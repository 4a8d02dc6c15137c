//! What is worth refitting: every entry of the catalogue at first order, and of them the contenders of a round.

use super::model::Model;
use super::physics::Physics;
use super::refit::{Effort, Fitted, IN_FULL, descend_from};
use super::select::extended;
use super::starts::{Start, starts};
use rayon::prelude::*;

/// One entry after a look at first order.
#[derive(Debug, Clone)]
pub(super) struct Screened {
    /// Where a fit begins.
    pub start: Start,
    /// By how much it would lower the sum of squares.
    pub gain: f64,
}

/// A look at first order, where it does not start from the baseline: a step to the start's own valley, and one by which it is judged.
const LOOK: Effort<'static> = Effort { steps: 1, ..IN_FULL };

/// So many entries are refitted in full in each round, if they promise this share of what the best one does.
const BEST: usize = 5;
const PROMISING: f64 = 0.15;

/// Those of which more is asked than they promise are refitted if they promise this share of the best that earns what is asked of it: whatever
/// explains as much casts doubt on it.
const RIVAL: f64 = 0.5;
/// At most so many of them.
const RIVALS: usize = 2;

/// Every entry but those that act already, from all its starts; the most promising first.
pub(super) fn screen(model: &Model<'_>, current: &Fitted, physics: &[Physics]) -> Vec<Screened> {
    let mut screened: Vec<Screened> = starts(model, current)
        .into_par_iter()
        .filter(|start| !physics.contains(&start.physics))
        .filter_map(|start| {
            if let Some(gain) = start.gain {
                return Some(Screened { start, gain });
            }
            let (acting, at) = extended(model, current.place(), &start.knobs);
            // Changes of the body that act already move little in one step.
            let begun = Fitted::near(model, &acting, at, current)?;
            // What starts from the baseline itself is judged there.
            let neutral = (begun.cost - current.cost).abs() < 1e-9 * current.cost;
            let looked = match neutral {
                true => begun,
                false => descend_from(model, begun, Effort { near: Some(current), ..LOOK }),
            };
            let gain = current.cost - looked.cost + looked.promised(model);
            Some(Screened { start, gain })
        })
        .collect();
    screened.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    screened
}

/// What is refitted in a round.
pub(super) struct Contenders<'a> {
    /// For every entry its starts: those first that earn what is asked of them.
    pub entries: Vec<Vec<&'a Screened>>,
    /// A gain from which on others are rivals.
    pub rivals_from: f64,
}

/// Of entries in the order of their gain the best that earn what is asked of them, and rivals: those that gain as much without earning it.
pub(super) fn contenders(screened: &[Screened], earns: impl Fn(&Screened) -> bool) -> Contenders<'_> {
    let most = screened.first().map_or(0.0, |s| s.gain);
    let promising = || screened.iter().filter(|s| s.gain > PROMISING * most);
    let (earning, others): (Vec<&Screened>, Vec<&Screened>) = promising().partition(|s| earns(s));
    let rivals_from = earning.first().map_or(f64::INFINITY, |best| RIVAL * best.gain);
    let mut entries = best_of_each(&earning, BEST);
    // Another start of an entry that earns it is no rival.
    let earned: Vec<Physics> = entries.iter().map(|starts| starts[0].start.physics).collect();
    let rival = |s: &&Screened| s.gain > rivals_from && !earned.contains(&s.start.physics);
    let rivals: Vec<&Screened> = others.into_iter().filter(rival).collect();
    entries.extend(best_of_each(&rivals, RIVALS));
    Contenders { entries, rivals_from }
}

/// The best start of the best few entries, and a second one that promises a good part of it.
fn best_of_each<'a>(sorted: &[&'a Screened], entries: usize) -> Vec<Vec<&'a Screened>> {
    let mut each: Vec<Vec<&Screened>> = Vec::new();
    for &screened in sorted {
        let same = each.iter().position(|s| s[0].start.physics == screened.start.physics);
        match same {
            Some(same) if each[same].len() < 2 && screened.gain > SECOND * each[same][0].gain => {
                each[same].push(screened);
            }
            None if each.len() < entries => each.push(vec![screened]),
            _ => {}
        }
    }
    each
}

/// That part.
const SECOND: f64 = 0.3;

#[cfg(test)]
mod tests {
    use super::*;

    fn screened(physics: Physics, gain: f64) -> Screened {
        Screened { start: Start { physics, knobs: Vec::new(), gain: None }, gain }
    }

    /// However many gain more without earning it, what earns it is refitted, and the two that gain most beside it; what gains less than half of it
    /// is no rival.
    #[test]
    fn rivals_do_not_crowd_out_what_earns_its_place() {
        let more = [
            Physics::Inclusion,
            Physics::Anisotropy,
            Physics::CameraMisalignment,
            Physics::UnevenScale,
            Physics::SelfWeight,
        ];
        let mut all: Vec<Screened> = more
            .iter()
            .zip([400.0, 350.0, 320.0, 300.0, 280.0])
            .map(|(p, gain)| screened(*p, gain))
            .collect();
        all.push(screened(Physics::StageBacklash, 150.0));
        all.push(screened(Physics::TipSlip, 70.0));
        let of = |physics: Physics| {
            let found = contenders(&all, |s| s.start.physics == physics);
            let names: Vec<Physics> = found.entries.iter().map(|e| e[0].start.physics).collect();
            (names, found.rivals_from)
        };
        let expected = vec![Physics::StageBacklash, Physics::Inclusion, Physics::Anisotropy];
        assert_eq!(of(Physics::StageBacklash), (expected, 75.0));
        assert_eq!(
            of(Physics::Inclusion),
            (vec![Physics::Inclusion, Physics::Anisotropy, Physics::CameraMisalignment], 200.0)
        );
        assert_eq!(of(Physics::Drying), (Vec::new(), f64::INFINITY));
    }
}
