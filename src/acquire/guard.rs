//! Is the force still within its limits, and is the sensor still telling the truth? Watched on raw counts, by a thread of its own.
//!
//! The thread owns the sensor. It compares every record with limits that were turned into counts beforehand, and trips the
//! [`Latch`] itself; only then are the records handed on. Once it runs it allocates nothing, waits for nobody, and touches no disk.
//! What it does not know, it takes for a reason to stop.

use super::latch::{Cause, Latch, StopOnPanic};
use super::live::LiveForce;
use crate::clock::HostTime;
use crate::device::{DeviceError, ForceFormat, ForceRecord, ForceSensor, SequenceStep, SequenceTracker};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How long one wait for records may take: so often it is looked whether the watch is over.
const WAIT: Duration = Duration::from_millis(2);
/// Share of a limit by which more force than before stops the tip on its way out.
const MARGIN: f64 = 0.1;
/// A sensor's clock may run slower than the host's by this share: no two quartzes are so far apart.
const CREEP: f64 = 2e-4;
/// Room for records: more than a socket hands over between two looks.
const ROOM: usize = 4096;

/// What the force may be, and what the sensor may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Limits {
    /// Largest reading less the zero, along each axis of the sensor (N, N·m).
    pub(super) wrench: [f64; 6],
    /// Reading with nothing at the tip (counts).
    pub(super) zero: [f64; 6],
    /// Longest silence; for as long records are put up with that are too old.
    pub(super) silence: Duration,
    /// How old a record may be when it arrives, beyond the youngest so far.
    pub(super) age: Duration,
    /// Most records in a row that may be lost.
    pub(super) gap: u32,
    /// Most records in a row with the sensor's clock standing.
    pub(super) frozen: u32,
}

/// The limits in counts, compared with integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Window {
    low: [i32; 6],
    high: [i32; 6],
}

impl Window {
    fn new(limits: &Limits, format: &ForceFormat) -> Self {
        let scale = format.scale();
        // Casts saturate: a limit beyond what counts can say never trips, which the pre-flight refuses.
        let bound =
            |axis: usize, sign: f64| (limits.zero[axis] + sign * limits.wrench[axis] * scale[axis]) as i32;
        Self { low: std::array::from_fn(|a| bound(a, -1.0)), high: std::array::from_fn(|a| bound(a, 1.0)) }
    }

    /// The first axis outside.
    fn outside(&self, counts: [i32; 6]) -> Option<usize> {
        (0..6).find(|&axis| counts[axis] < self.low[axis] || counts[axis] > self.high[axis])
    }
}

/// How old records are when they arrive, beyond the youngest so far: by the sensor's clock, which no network holds up.
#[derive(Debug)]
struct Age {
    tick_s: f64,
    /// Arrival and count of the last record.
    last: Option<(HostTime, u32)>,
    /// By how much the host's clock is ahead of the sensor's now, and was at least (s, from the first record).
    ahead_s: f64,
    least_s: f64,
}

impl Age {
    fn new(format: &ForceFormat) -> Self {
        Self { tick_s: 1.0 / format.tick_hz, last: None, ahead_s: 0.0, least_s: 0.0 }
    }

    /// Age of a record (s).
    fn of(&mut self, record: &ForceRecord) -> f64 {
        if let Some((arrived, count)) = self.last.replace((record.host, record.ft_sequence)) {
            let passed_s = record.host.seconds_after(arrived);
            let ticks = record.ft_sequence.wrapping_sub(count) as i32;
            self.ahead_s += passed_s - f64::from(ticks) * self.tick_s;
            self.least_s = (self.least_s + CREEP * passed_s).min(self.ahead_s);
        }
        self.ahead_s - self.least_s
    }
}

/// The judgement of one stream, record by record.
#[derive(Debug)]
struct Judge {
    limits: Limits,
    format: ForceFormat,
    window: Window,
    tracker: SequenceTracker,
    frozen: u32,
    age: Age,
    /// Since when only old records have come.
    old_since: Option<HostTime>,
    is_widened: bool,
}

impl Judge {
    fn new(limits: Limits, format: ForceFormat) -> Self {
        Self {
            limits,
            format,
            window: Window::new(&limits, &format),
            tracker: SequenceTracker::new(format.ticks_a_record()),
            frozen: 0,
            age: Age::new(&format),
            old_since: None,
            is_widened: false,
        }
    }

    /// While the tip is taken out, what was reached on the way in is no reason to stop; more than that by a tenth of the limit is.
    fn widen(&mut self, reached: [i32; 6]) {
        let scale = self.format.scale();
        let limits = Limits {
            wrench: std::array::from_fn(|axis| {
                self.limits.wrench[axis].max(f64::from(reached[axis]).abs() / scale[axis])
                    + MARGIN * self.limits.wrench[axis]
            }),
            ..self.limits
        };
        self.window = Window::new(&limits, &self.format);
        self.is_widened = true;
    }

    /// Why to stop at this record, if at all.
    fn cause(&mut self, record: &ForceRecord) -> Option<Cause> {
        if record.status & self.format.stop_mask != 0 && !self.is_widened {
            return Some(Cause::SensorStatus { status: record.status });
        }
        if let Some(axis) = self.window.outside(record.counts) {
            let value = (f64::from(record.counts[axis]) - self.limits.zero[axis]) / self.format.scale()[axis];
            return Some(Cause::Limit { axis, value, limit: self.limits.wrench[axis] });
        }
        // A sensor that was the reason to stop is none to leave the tip where it is.
        if self.is_widened {
            return None;
        }
        match self.tracker.observe(record) {
            SequenceStep::Frozen => self.frozen += 1,
            SequenceStep::Gap(records) if records > self.limits.gap => {
                return Some(Cause::SensorGap { records });
            }
            SequenceStep::Restarted => return Some(Cause::SensorRestarted),
            SequenceStep::First | SequenceStep::Next | SequenceStep::Gap(_) => self.frozen = 0,
            SequenceStep::Duplicate | SequenceStep::Late => {}
        }
        if self.frozen > self.limits.frozen {
            return Some(Cause::SensorFrozen);
        }
        let age = Duration::from_secs_f64(self.age.of(record));
        if age <= self.limits.age {
            self.old_since = None;
            return None;
        }
        let since = *self.old_since.get_or_insert(record.host);
        (record.host.since(since) > self.limits.silence).then(|| Cause::SensorLate { by_ms: millis(age) })
    }
}

/// Watches `sensor` until `over`, or until it is lost; trips `latch` at the first reason to stop, and goes on watching and recording
/// after it: what follows a stop is worth knowing. `hand` is given all records, also when
/// there are none, and must neither wait nor allocate.
///
/// # Errors
/// [`DeviceError`]: the sensor is lost. The latch is tripped then.
pub(super) fn watch(
    sensor: &mut dyn ForceSensor,
    limits: Limits,
    latch: &Latch,
    live: &LiveForce,
    over: &AtomicBool,
    mut hand: impl FnMut(&[ForceRecord]),
) -> Result<(), DeviceError> {
    let _stop = StopOnPanic(latch);
    let mut judge = Judge::new(limits, *sensor.format());
    let mut records: Vec<ForceRecord> = Vec::with_capacity(ROOM);
    let mut last = HostTime::now();
    while !over.load(Ordering::Acquire) {
        records.clear();
        if let Err(lost) = sensor.receive(HostTime::now() + WAIT, &mut records) {
            latch.trip(Cause::SensorLost, HostTime::now());
            return Err(lost);
        }
        for record in &records {
            if let Some(cause) = judge.cause(record) {
                latch.trip(cause, record.host);
            }
            live.see(record.counts, latch.tripped().is_some());
        }
        live.count(sensor.losses());
        if latch.is_going_out() && !judge.is_widened {
            judge.widen(live.farthest_after_stop());
            latch.note();
        }
        match records.last() {
            Some(record) => last = record.host,
            None => {
                let now = HostTime::now();
                let silent = now.since(last);
                if silent > judge.limits.silence && !judge.is_widened {
                    latch.trip(Cause::SensorSilent { for_ms: millis(silent) }, now);
                }
            }
        }
        hand(&records);
    }
    Ok(())
}

fn millis(duration: Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
