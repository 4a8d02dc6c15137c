//! Where does a rising force stop at the sensor's end?
//!
//! A sensor at its end shows the same from there on, while the deformation goes on, and nothing greater anywhere. Samples that are equal to the last
//! digit show it by themselves, as long as the force would have risen by more than they can resolve; noisy ones lie on a level within
//! their noise, behind a way that rose many times as steeply.

use super::held_out::line;
use super::marks::mean;
use crate::calib::noise::{middle, noise, quantum};

/// Samples of a plateau at least, and before it.
const ROWS: usize = 6;
/// Of equal ones, samples that lie on the way.
const MOVING: usize = 3;
/// Samples before it that tell the slope, at most.
const BEFORE: usize = 40;
/// Standard deviations within which a noisy plateau lies, and that the force would have risen by.
const WITHIN: f64 = 4.0;
const RISEN: f64 = 10.0;
/// Steps of the sensor that it would have risen by.
const STEPS: f64 = 3.0;
/// Share of the greatest force that it would have risen by.
const MATTERS: f64 = 0.02;
/// Share of that rise which may be left.
const LEFT: f64 = 0.1;
/// Share of samples that lie on the level.
const MOST: f64 = 0.95;

/// A plateau at the end of a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plateau {
    /// Its first sample; it goes on to the last.
    pub(super) from: usize,
    /// Its force.
    pub(super) level: f64,
    /// Whether the samples are equal to the last digit.
    pub(super) exact: bool,
    /// Root mean square that its second half is missed by if the force had gone on, and with the plateau.
    pub(super) missed: [f64; 2],
}

/// The plateau at the end of a way out: deformation and force in order. `greatest`: force of the whole recording; `behind`: how many samples behind
/// the way, where the deformation stands, are equal to its last one.
pub(super) fn plateau(way: &[f64], force: &[f64], greatest: f64, behind: usize) -> Option<Plateau> {
    let last = *force.last()?;
    let equal = force.iter().rev().take_while(|f| **f == last).count();
    let sigma = noise(force);
    let exact = equal >= MOVING && equal + behind >= ROWS;
    let top = force.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let high: Vec<f64> = force.iter().copied().filter(|f| *f >= top - 2.0 * WITHIN * sigma).collect();
    let (level, band) = if exact { (last, 0.0) } else { (middle(&high), WITHIN * sigma) };
    let on = |f: &f64| (f - level).abs() <= band;
    // From here on (nearly) all lie on the level.
    let share =
        |from: usize| force[from..].iter().filter(|f| on(f)).count() as f64 / (force.len() - from) as f64;
    let from = if exact {
        force.len() - equal
    } else {
        (0..force.len()).find(|from| on(&force[*from]) && share(*from) >= MOST)?
    };
    let rows = if exact { MOVING } else { ROWS };
    if force.len() - from < rows || from < ROWS || greatest > level + 2.0 * band + sigma {
        return None;
    }
    let before = from.saturating_sub((force.len() - from).clamp(ROWS, BEFORE));
    let (slope, place, height) = line(&way[before..from], &force[before..from]);
    let advance = way[way.len() - 1] - way[from];
    let risen = slope * advance;
    // Equal samples have no noise to hide in.
    let hidden = if exact { 0.0 } else { RISEN * sigma };
    let limit = hidden.max(STEPS * quantum(force)).max(MATTERS * greatest.abs());
    let (left, _, _) = line(&way[from..], &force[from..]);
    if advance <= 0.0 || risen < limit || (left * advance).abs() > LEFT * risen {
        return None;
    }
    let half = from + (force.len() - from) / 2;
    let rms = |says: &dyn Fn(usize) -> f64| {
        mean(&(half..force.len()).map(|k| (force[k] - says(k)).powi(2)).collect::<Vec<_>>()).sqrt()
    };
    let missed = [rms(&|k| height + slope * (way[k] - place)), rms(&|_| level)];
    Some(Plateau { from, level, exact, missed })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(of: impl Fn(f64) -> f64) -> Option<Plateau> {
        let way: Vec<f64> = (0..200).map(|k| 0.005 * f64::from(k)).collect();
        let force: Vec<f64> = way.iter().map(|x| of(*x)).collect();
        plateau(&way, &force, force.iter().copied().fold(0.0, f64::max), 0)
    }

    #[test]
    fn a_sensor_at_its_end_is_told_from_rounding_and_from_a_course_that_flattens() {
        let rough = |x: f64| 0.002 * (9e4 * x * x).sin();
        let clipped = found(|x| x.min(0.8)).expect("a plateau");
        assert!(clipped.exact && clipped.level == 0.8 && clipped.from == 160, "{clipped:?}");
        let noisy = found(|x| x.min(0.8) + rough(x)).expect("a plateau");
        assert!(!noisy.exact && (noisy.level - 0.8).abs() < 0.002, "{noisy:?}");
        assert_eq!(found(|x| (x / 0.05).round() * 0.05), None);
        assert_eq!(found(|x| x + rough(x)), None);
        assert_eq!(found(|x| 1.0 - (-3.0 * x).exp() + rough(x)), None);
        // Greater forces elsewhere: no sensor's end.
        let way: Vec<f64> = (0..100).map(f64::from).collect();
        let force: Vec<f64> = way.iter().map(|x| x.min(70.0)).collect();
        assert_eq!(plateau(&way, &force, 90.0, 0), None);
    }
}
