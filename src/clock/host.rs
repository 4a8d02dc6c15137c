//! What time is it on this machine: nanoseconds of its monotonic clock.
//!
//! Every raw sample carries such a time. It never jumps, nobody sets it, and on Linux it is the clock of the kernel's own time stamps
//! (video buffers, serial input), so that they compare. It says nothing about the date, and it starts anew when the machine does.

use rustix::time::{ClockId, clock_gettime};
use std::time::Duration;

/// An instant on the host's monotonic clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct HostTime {
    nanos: u64,
}

impl HostTime {
    /// The instant that many nanoseconds after the clock's start.
    pub const fn from_nanos(nanos: u64) -> Self {
        Self { nanos }
    }

    /// Now.
    pub fn now() -> Self {
        let time = clock_gettime(ClockId::Monotonic);
        // The monotonic clock starts at zero and neither part is ever negative.
        Self { nanos: time.tv_sec.unsigned_abs() * 1_000_000_000 + time.tv_nsec.unsigned_abs() }
    }

    /// Nanoseconds since the clock's start.
    pub const fn nanos(self) -> u64 {
        self.nanos
    }

    /// How long after `earlier` this is; nothing when it is not.
    pub const fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.nanos.saturating_sub(earlier.nanos))
    }

    /// How long until this instant; nothing when it has passed.
    pub fn remaining(self) -> Duration {
        self.since(Self::now())
    }

    /// Seconds after `origin`, negative before it.
    pub fn seconds_after(self, origin: Self) -> f64 {
        if self.nanos >= origin.nanos {
            (self.nanos - origin.nanos) as f64 * 1e-9
        } else {
            -((origin.nanos - self.nanos) as f64 * 1e-9)
        }
    }
}

impl std::ops::Add<Duration> for HostTime {
    type Output = Self;

    fn add(self, duration: Duration) -> Self {
        let nanos = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        Self { nanos: self.nanos.saturating_add(nanos) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_have_a_sign_and_durations_do_not() {
        let (a, b) = (HostTime::from_nanos(1_500_000_000), HostTime::from_nanos(4_000_000_000));
        assert_eq!(b.seconds_after(a), 2.5);
        assert_eq!(a.seconds_after(b), -2.5);
        assert_eq!(b.since(a), Duration::from_millis(2500));
        assert_eq!(a.since(b), Duration::ZERO);
        assert_eq!(a + Duration::from_millis(2500), b);
    }

    #[test]
    fn the_clock_goes_forwards() {
        let first = HostTime::now();
        let second = HostTime::now();
        assert!(second >= first && first.nanos() > 0);
    }
}
