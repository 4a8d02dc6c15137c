//! Where the simulated stage has been, told by its emulator and asked for by whatever is felt or seen there.
//!
//! Devices live in threads of their own, and a computer may wake one of them late. What a sensor felt at a time follows from where the
//! stage was at that time, not from where it is when the sensor's thread is woken: so positions are told with their times, and who asks
//! for a time that nobody has told of yet waits.

use crate::clock::HostTime;
use crate::device::AXES;
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Where the stage has been; at zero until somebody tells.
#[derive(Clone, Default)]
pub(super) struct StagePath(Arc<(Mutex<Told>, Condvar)>);

#[derive(Default)]
struct Told {
    /// Time and position (m). Between two it went straight.
    knots: VecDeque<(HostTime, [f64; AXES])>,
    /// Whether more will be told.
    goes_on: bool,
}

/// Tells where the stage is, as long as it is kept.
pub struct StageTeller(StagePath);

impl StagePath {
    /// Begins to tell.
    pub(super) fn teller(&self) -> StageTeller {
        self.lock().goes_on = true;
        StageTeller(self.clone())
    }

    /// Where the stage was at a time (m). Waits until that has been told; what was before is forgotten.
    pub(super) fn at(&self, time: HostTime) -> [f64; AXES] {
        let mut told = self.lock();
        while told.goes_on && told.knots.back().is_none_or(|(last, _)| *last < time) {
            told = self.0.1.wait(told).unwrap_or_else(PoisonError::into_inner);
        }
        while told.knots.get(1).is_some_and(|(next, _)| *next <= time) {
            told.knots.pop_front();
        }
        match (told.knots.front(), told.knots.get(1)) {
            (Some((from, a)), Some((to, b))) => {
                let share = (time.seconds_after(*from) / to.seconds_after(*from)).clamp(0.0, 1.0);
                std::array::from_fn(|axis| a[axis] + share * (b[axis] - a[axis]))
            }
            (Some((_, at)), None) => *at,
            (None, _) => [0.0; AXES],
        }
    }

    fn lock(&self) -> MutexGuard<'_, Told> {
        // Between two knots it is sound at any time.
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl StageTeller {
    /// It was at `position_m` (m) at a time, which is none before the last.
    pub fn tell(&self, time: HostTime, position_m: [f64; AXES]) {
        let mut told = self.0.lock();
        let count = told.knots.len();
        // A stage that stands needs two knots, however long it stands.
        if count > 1 && told.knots.range(count - 2..).all(|(_, at)| *at == position_m) {
            told.knots[count - 1].0 = time;
        } else {
            told.knots.push_back((time, position_m));
        }
        drop(told);
        self.0.0.1.notify_all();
    }
}

impl Drop for StageTeller {
    fn drop(&mut self) {
        self.0.lock().goes_on = false;
        self.0.0.1.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn ms(ms: u64) -> HostTime {
        HostTime::from_nanos(1_000_000_000 + ms * 1_000_000)
    }

    #[test]
    fn between_two_knots_it_went_straight() {
        let path = StagePath::default();
        assert_eq!(path.at(ms(0)), [0.0; 2]);
        let stage = path.teller();
        for (time, at) in [(1, 0.0), (2, 0.0), (50, 0.0), (60, 0.01), (61, 0.01), (70, 0.01), (90, 0.01)] {
            stage.tell(ms(time), [at, 0.5]);
        }
        assert_eq!(path.lock().knots.len(), 4);
        assert_eq!(path.at(ms(0)), [0.0, 0.5]);
        assert_eq!(path.at(ms(50)), [0.0, 0.5]);
        let [x, _] = path.at(ms(57));
        assert!((x - 0.007).abs() < 1e-12, "{x}");
        assert_eq!(path.at(ms(80)), [0.01, 0.5]);
        assert_eq!(path.lock().knots.len(), 2);
        // Nobody tells any more: it stays.
        drop(stage);
        assert_eq!(path.at(ms(1000)), [0.01, 0.5]);
    }

    #[test]
    fn who_asks_too_early_waits() {
        let path = StagePath::default();
        let stage = path.teller();
        stage.tell(ms(0), [0.0; 2]);
        std::thread::scope(|scope| {
            let asked = scope.spawn(|| path.at(ms(5)));
            std::thread::sleep(Duration::from_millis(20));
            assert!(!asked.is_finished());
            stage.tell(ms(10), [0.1, 0.2]);
            let at = asked.join().expect("an answer");
            assert!((at[0] - 0.05).abs() < 1e-12 && (at[1] - 0.1).abs() < 1e-12, "{at:?}");
            let asked = scope.spawn(|| path.at(ms(50)));
            drop(stage);
            assert_eq!(asked.join().expect("an answer"), [0.1, 0.2]);
        });
    }
}
