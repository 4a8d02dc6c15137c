//! When each poke happens and how deep the stage is at any time.

use super::SimError;
use super::draw::PokePlan;

/// One poke on the recording's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scheduled {
    pub(super) plan: PokePlan,
    pub(super) start_s: f64,
    pub(super) end_s: f64,
}

/// The whole session.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Timeline {
    pub(super) rest_until_s: f64,
    pub(super) pokes: Vec<Scheduled>,
    pub(super) end_s: f64,
}

/// Starts and ends fall on multiples of this (s): a whole number of rows of every instrument.
const TICK_S: f64 = 0.1;

fn ticks(at_least_s: f64) -> f64 {
    // A duration that is a whole number of ticks up to rounding takes no further one.
    (at_least_s / TICK_S - 1e-9).ceil()
}

impl Timeline {
    /// Rest, then the pokes with pauses between them.
    pub(super) fn new(plans: &[PokePlan], pause_s: f64) -> Result<Self, SimError> {
        let mut now = ticks(pause_s);
        let seconds = |ticks: f64| ticks / (1.0 / TICK_S).round();
        let rest_until_s = seconds(now);
        let mut pokes = Vec::with_capacity(plans.len());
        for (plan, number) in plans.iter().zip(1..) {
            let figures = [("depth", plan.depth_m), ("rate", plan.rate_m_s), ("radius", plan.radius_m)];
            for (what, value) in figures {
                if !(value > 0.0 && value.is_finite()) {
                    return Err(SimError::BadPoke { number, what, value });
                }
            }
            let end = now + ticks(2.0 * plan.depth_m / plan.rate_m_s + plan.hold_s);
            pokes.push(Scheduled { plan: *plan, start_s: seconds(now), end_s: seconds(end) });
            now = end + ticks(pause_s);
        }
        Ok(Self { rest_until_s, pokes, end_s: seconds(now) })
    }

    /// The poke in progress at `time_s` with its depth (m).
    pub(super) fn at(&self, time_s: f64) -> Option<(usize, f64)> {
        let poke = self.pokes.partition_point(|p| p.end_s < time_s);
        let scheduled = self.pokes.get(poke).filter(|p| p.start_s <= time_s)?;
        Some((poke, scheduled.depth(time_s)))
    }
}

impl Scheduled {
    /// Depth (m) at a time inside the poke.
    fn depth(&self, time_s: f64) -> f64 {
        let moving_s = (time_s - self.start_s).min(self.end_s - time_s);
        (self.plan.rate_m_s * moving_s).clamp(0.0, self.plan.depth_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(depth_m: f64, rate_m_s: f64, hold_s: f64) -> PokePlan {
        PokePlan { site_m: [0.0; 3], direction: [0.0, 0.0, -1.0], radius_m: 0.008, depth_m, rate_m_s, hold_s }
    }

    #[test]
    fn a_poke_ramps_holds_and_ramps_back() {
        let line = Timeline::new(&[plan(0.003, 0.003, 2.0), plan(0.002, 0.004, 0.53)], 1.0).expect("good");
        assert_eq!(line.rest_until_s, 1.0);
        assert_eq!((line.pokes[0].start_s, line.pokes[0].end_s), (1.0, 5.0));
        assert_eq!((line.pokes[1].start_s, line.pokes[1].end_s), (6.0, 7.6));
        assert_eq!(line.end_s, 8.6);
        assert_eq!(line.at(0.9), None);
        assert_eq!(line.at(5.5), None);
        assert_eq!(line.at(8.0), None);
        assert_eq!(line.at(1.0), Some((0, 0.0)));
        assert_eq!(line.at(3.0), Some((0, 0.003)));
        let (poke, depth) = line.at(4.5).expect("in contact");
        assert!(poke == 0 && (depth - 0.0015).abs() < 1e-12);
        assert_eq!(line.at(5.0), Some((0, 0.0)));
        assert_eq!(line.at(6.8), Some((1, 0.002)));
    }

    #[test]
    fn a_poke_that_does_not_move_is_refused() {
        let refused = Timeline::new(&[plan(0.003, 0.0, 2.0)], 1.0);
        assert_eq!(refused, Err(SimError::BadPoke { number: 1, what: "rate", value: 0.0 }));
    }
}
