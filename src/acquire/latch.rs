//! Whether a run has to stop, and why: set once, by whoever sees it first, from any thread.

use crate::clock::HostTime;
use crate::device::Stopper;
use std::fmt;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Whoever watches the force takes note within this time, or does not watch any more.
const NOTED_WITHIN: Duration = Duration::from_millis(250);

/// Name and unit of a component of the sensor's reading.
pub(super) fn component(axis: usize) -> (&'static str, &'static str) {
    [("Fx", "N"), ("Fy", "N"), ("Fz", "N"), ("Tx", "N·m"), ("Ty", "N·m"), ("Tz", "N·m")][axis % 6]
}

/// Why a run was stopped before its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// More force or torque than the limit along an axis of the sensor: 0 to 2 force, 3 to 5 torque.
    Limit {
        /// Axis of the sensor.
        axis: usize,
        /// Reading less its zero (N or N·m).
        value: f64,
        /// Limit (N or N·m).
        limit: f64,
    },
    /// The sensor says that its readings are not to be trusted.
    SensorStatus {
        /// Status word.
        status: u32,
    },
    /// The sensor repeats one reading.
    SensorFrozen,
    /// The sensor's stream began anew: somebody else asked for it, or the sensor restarted.
    SensorRestarted,
    /// No record for too long.
    SensorSilent {
        /// How long (ms).
        for_ms: u64,
    },
    /// For too long only records came that were already old.
    SensorLate {
        /// How old, beyond the youngest so far (ms).
        by_ms: u64,
    },
    /// Too many records in a row never came.
    SensorGap {
        /// How many.
        records: u32,
    },
    /// The sensor is not there any more.
    SensorLost,
    /// The stage is not there any more, or does not answer.
    StageSilent,
    /// The stage has latched a fault of its own.
    StageFault {
        /// Its code.
        code: u8,
    },
    /// The controller was reset.
    StageReset,
    /// The stage stands where it was not sent to, or is on its way for far too long.
    StageAstray,
    /// The stage refuses to do what was asked.
    StageRefuses,
    /// What is recorded does not reach the disk.
    Recorder,
    /// The camera is not there any more.
    CameraLost,
    /// A person pressed the key or Ctrl-C.
    Asked,
    /// A part of this program gave up.
    Panic,
}

impl Cause {
    /// Whether the tip may be taken back out of the phantom after it. Not when a person asked for the stop, who may have had a hand in
    /// between, and not when the stage is not to be trusted.
    pub fn may_retract(&self) -> bool {
        match self {
            Self::Limit { .. }
            | Self::SensorStatus { .. }
            | Self::SensorFrozen
            | Self::SensorRestarted
            | Self::SensorSilent { .. }
            | Self::SensorLate { .. }
            | Self::SensorGap { .. }
            | Self::SensorLost
            | Self::Recorder
            | Self::CameraLost => true,
            Self::StageSilent
            | Self::StageFault { .. }
            | Self::StageReset
            | Self::StageAstray
            | Self::StageRefuses
            | Self::Asked
            | Self::Panic => false,
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Limit { axis, value, limit } => {
                let (name, unit) = component(axis);
                write!(f, "{name} of the sensor is {value:.3} {unit}; the limit is {limit:.3} {unit}")
            }
            Self::SensorStatus { status } => write!(f, "the force sensor reports status {status:#010x}"),
            Self::SensorFrozen => f.write_str("the force sensor repeats one reading: its clock stands"),
            Self::SensorRestarted => {
                f.write_str("the force sensor's stream began anew: another client, or the sensor restarted")
            }
            Self::SensorSilent { for_ms } => write!(f, "the force sensor said nothing for {for_ms} ms"),
            Self::SensorLate { by_ms } => write!(
                f,
                "the force sensor's records arrive {by_ms} ms late: the network or this computer holds them up"
            ),
            Self::SensorGap { records } => {
                write!(f, "{records} records of the force sensor in a row were lost")
            }
            Self::SensorLost => f.write_str("the force sensor is lost"),
            Self::StageSilent => f.write_str("the stage is lost or does not answer"),
            Self::StageFault { code } => write!(f, "the stage has latched fault {code}"),
            Self::StageReset => f.write_str("the stage's controller was reset"),
            Self::StageAstray => f.write_str("the stage is not where it was sent to"),
            Self::StageRefuses => f.write_str("the stage refuses to do what it was asked"),
            Self::Recorder => f.write_str("what is recorded does not reach the disk"),
            Self::CameraLost => f.write_str("the camera is lost"),
            Self::Asked => f.write_str("stopped by hand"),
            Self::Panic => f.write_str("a part of the program gave up"),
        }
    }
}

/// What is known of a stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tripped {
    /// Why.
    pub cause: Cause,
    /// When what caused it had arrived.
    pub seen: HostTime,
    /// When the stop bytes had been handed to the operating system; none when that failed.
    pub sent: Option<HostTime>,
}

/// Set once. Setting it stops the stage from the thread that sets it, before anything else is done. While the tip is taken out after a
/// stop it is armed once more, and stops that as well.
pub struct Latch {
    stopper: Box<dyn Stopper>,
    asked: AtomicBool,
    tripped: OnceLock<Tripped>,
    /// A person asked for a stop, first or later.
    by_hand: AtomicBool,
    /// The tip is to be taken out, and whoever watches the force has taken note.
    going_out: AtomicBool,
    noted: AtomicBool,
    /// The stage moves after the stop.
    armed: AtomicBool,
    again: AtomicBool,
}

impl fmt::Debug for Latch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Latch").field("tripped", &self.tripped.get()).finish_non_exhaustive()
    }
}

impl Latch {
    /// Open, with a way to the stage.
    pub fn new(stopper: Box<dyn Stopper>) -> Self {
        let [asked, by_hand, going_out, noted, armed, again] = [(); 6].map(|()| AtomicBool::new(false));
        Self { stopper, asked, tripped: OnceLock::new(), by_hand, going_out, noted, armed, again }
    }

    /// Stops the stage: the first time, and while the tip is being taken out. The first cause stays. Allocates nothing.
    pub fn trip(&self, cause: Cause, seen: HostTime) {
        if cause == Cause::Asked {
            self.by_hand.store(true, Ordering::Release);
        }
        // The bytes go out before the cause can be read: whoever sees the latch set may rely on them.
        if self.asked.swap(true, Ordering::AcqRel) {
            if self.armed.swap(false, Ordering::AcqRel) {
                self.again.store(true, Ordering::Release);
                // The stage is watched by whoever takes it out, who sees that it goes on should this fail.
                let _ = self.stopper.stop_now();
            }
            return;
        }
        let sent = self.stopper.stop_now().ok();
        // Only the first caller comes this far.
        let _ = self.tripped.set(Tripped { cause, seen, sent });
    }

    /// Arms it once more for taking the tip out; false where a person asked for a stop, who may have had a hand in between. What stopped the
    /// run must not stop this: so whoever watches the force takes note first, unless nobody does any more.
    pub(super) fn arm_again(&self) -> bool {
        self.going_out.store(true, Ordering::Release);
        let until = HostTime::now() + NOTED_WITHIN;
        while !self.noted.load(Ordering::Acquire) && HostTime::now() < until {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.armed.store(true, Ordering::Release);
        !self.was_asked()
    }

    /// Whether a person asked for a stop, first or later.
    pub(super) fn was_asked(&self) -> bool {
        self.by_hand.load(Ordering::Acquire)
    }

    /// Whether the tip is to be taken out.
    pub(super) fn is_going_out(&self) -> bool {
        self.going_out.load(Ordering::Acquire)
    }

    /// Says that the force is watched as it has to be on the way out.
    pub(super) fn note(&self) {
        self.noted.store(true, Ordering::Release);
    }

    /// Whether it was tripped since it was armed again.
    pub(super) fn tripped_again(&self) -> bool {
        self.again.load(Ordering::Acquire)
    }

    /// Latches the stage again after it was cleared to take the tip out.
    pub(super) fn stop_again(&self) {
        self.armed.store(false, Ordering::Release);
        // The stage stands; a port that is gone now changes nothing.
        let _ = self.stopper.stop_now();
    }

    /// What stopped the run; none while nothing did.
    pub fn tripped(&self) -> Option<Tripped> {
        self.tripped.get().copied()
    }
}

/// Trips the latch when the thread that holds it panics.
#[derive(Debug)]
pub(super) struct StopOnPanic<'a>(pub(super) &'a Latch);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.trip(Cause::Panic, HostTime::now());
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::AtomicU32;

    /// Counts how often it was used.
    pub(in crate::acquire) struct Counted(pub(in crate::acquire) Arc<AtomicU32>);

    impl Stopper for Counted {
        fn stop_now(&self) -> std::io::Result<HostTime> {
            self.0.fetch_add(1, Ordering::SeqCst);
            Ok(HostTime::now())
        }
    }

    #[test]
    fn the_first_cause_stays_and_stops_the_stage_once() {
        let count = Arc::new(AtomicU32::new(0));
        let latch = Latch::new(Box::new(Counted(count.clone())));
        assert_eq!(latch.tripped(), None);
        latch.trip(Cause::Asked, HostTime::from_nanos(5));
        latch.trip(Cause::SensorLost, HostTime::from_nanos(6));
        let tripped = latch.tripped().expect("tripped");
        assert_eq!((tripped.cause, tripped.seen.nanos()), (Cause::Asked, 5));
        assert!(tripped.sent.is_some());
        assert_eq!(count.load(Ordering::SeqCst), 1);
    }

    #[test]
    fn a_stop_after_the_first_is_heard_while_the_tip_is_taken_out() {
        let count = Arc::new(AtomicU32::new(0));
        let latch = Latch::new(Box::new(Counted(count.clone())));
        let limit = Cause::Limit { axis: 2, value: 6.0, limit: 5.0 };
        latch.trip(limit, HostTime::from_nanos(5));
        latch.trip(limit, HostTime::from_nanos(6));
        assert!(latch.arm_again() && !latch.tripped_again());
        latch.trip(limit, HostTime::from_nanos(7));
        latch.trip(limit, HostTime::from_nanos(8));
        assert!(latch.tripped_again());
        assert_eq!(count.load(Ordering::SeqCst), 2, "once for each time that it was armed");
        // A person who stops it is the end of it, whatever stopped it before.
        latch.trip(Cause::Asked, HostTime::from_nanos(9));
        assert!(!latch.arm_again());
        assert_eq!(latch.tripped().expect("tripped").cause, limit);
    }

    /// What stopped the run trips it still until the watch knows of the way out, and must not stop that.
    #[test]
    fn what_stopped_the_run_does_not_stop_the_way_out() {
        let latch = Latch::new(Box::new(Counted(Arc::default())));
        latch.trip(Cause::SensorFrozen, HostTime::from_nanos(5));
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !latch.is_going_out() {
                    latch.trip(Cause::SensorFrozen, HostTime::now());
                }
                for _ in 0..20 {
                    latch.trip(Cause::SensorFrozen, HostTime::now());
                    std::thread::sleep(Duration::from_millis(1));
                }
                latch.note();
            });
            assert!(latch.arm_again());
        });
        assert!(!latch.tripped_again());
        latch.trip(Cause::Limit { axis: 2, value: 6.0, limit: 5.0 }, HostTime::now());
        assert!(latch.tripped_again());
    }

    #[test]
    fn a_thread_that_panics_stops_the_stage() {
        let count = Arc::new(AtomicU32::new(0));
        let latch = Arc::new(Latch::new(Box::new(Counted(count.clone()))));
        let shared = latch.clone();
        let thread = std::thread::spawn(move || {
            let _stop = StopOnPanic(&shared);
            panic!("on purpose");
        });
        assert!(thread.join().is_err());
        assert_eq!(latch.tripped().expect("tripped").cause, Cause::Panic);
        assert_eq!(count.load(Ordering::SeqCst), 1);
    }
}
