//! When was a report or a record: its device's count on the host's clock, in seconds from an origin.

use crate::clock::{DeviceClock, HostTime};
use crate::session::ClockProbe;

/// A count that falls back by more than this tells of a device that was reset (s): records that come late are not so late.
const BACK_S: f64 = 1.0;
/// So does one that runs ahead of the host's clock by more than this (s): what waited to be fetched did not wait so long.
const AHEAD_S: f64 = 60.0;
/// In a stretch of so long (s) something arrives promptly, but for one stretch in so many: by less than this (s).
const STRETCH_S: f64 = 2.0;
const SELDOM: f64 = 0.2;
const SLIPPED_S: f64 = 0.02;
/// Counts after which a counter begins anew.
const WRAP: f64 = 4_294_967_296.0;
/// Of each span of so long only the promptest arrival is kept (s).
const SPAN_S: f64 = 0.1;

/// A count that wraps, made one that does not, with the arrivals that say how it runs.
#[derive(Debug, Clone)]
pub(super) struct Arrivals {
    tick_s: f64,
    origin: HostTime,
    /// Count, the same without wrapping, and host time (s) of the latest arrival.
    last: Option<(u32, u64, f64)>,
    /// Device time and host time (s): of each span the promptest.
    prompt: Vec<[f64; 2]>,
    /// Whether the count followed the clock all the time.
    steady: bool,
}

impl Arrivals {
    /// `tick_s` seconds a count; host times from `origin`.
    pub(super) fn new(tick_s: f64, origin: HostTime) -> Self {
        Self { tick_s, origin, last: None, prompt: Vec::new(), steady: true }
    }

    /// Takes the next arrival; its device time (s).
    pub(super) fn next(&mut self, count: u32, host: HostTime) -> f64 {
        let host = host.seconds_after(self.origin);
        let total = match self.last {
            // A record that comes late after all has an earlier count.
            Some((last, total, before)) => {
                let step = i64::from(count.wrapping_sub(last) as i32);
                let step_s = step as f64 * self.tick_s;
                self.steady &= step_s > -BACK_S && step_s < host - before + AHEAD_S;
                total.saturating_add_signed(step)
            }
            // Room below, for records that come before the first.
            None => u64::from(count) + (1 << 32),
        };
        self.last = Some((count, total, host));
        let device = total as f64 * self.tick_s;
        match self.prompt.last_mut() {
            Some(last) if device - last[0] < SPAN_S && device >= last[0] => {
                if host - device < last[1] - last[0] {
                    *last = [device, host];
                }
            }
            Some(last) if device < last[0] => {}
            _ => self.prompt.push([device, host]),
        }
        device
    }

    /// The device's clock; none where it was reset, where it slipped against the host's, or where nothing came.
    pub(super) fn clock(&self) -> Option<DeviceClock> {
        let clock = DeviceClock::from_arrivals(&self.prompt).filter(|_| self.steady)?;
        // Arrivals are late now and then. Where even the promptest of whole seconds are late again and again, the line is none.
        let mut latest: Vec<(u64, f64)> = Vec::new();
        for [device, host] in &self.prompt {
            let (stretch, late) = ((host / STRETCH_S) as u64, host - clock.host_s(*device));
            match latest.last_mut().filter(|last| last.0 == stretch) {
                Some(last) => last.1 = last.1.min(late),
                None => latest.push((stretch, late)),
            }
        }
        let late = latest.iter().filter(|(_, late)| *late > SLIPPED_S).count();
        (late as f64 <= SELDOM * latest.len() as f64).then_some(clock)
    }
}

/// By how long (s) even the promptest report of `clock` is late, at least and at most: as long as its bytes take on the line. A device's
/// count in an answer was read after the question was sent and before the answer had arrived, which bounds it from both sides; of several
/// answers the narrowest bounds count. Where the answers contradict each other the most is less than the least; none without answers.
pub(super) fn lateness(
    probes: impl IntoIterator<Item = ClockProbe>,
    clock: &DeviceClock,
    origin: HostTime,
) -> Option<[f64; 2]> {
    let [mut least, mut most] = [0.0, f64::INFINITY];
    for probe in probes {
        let [sent, received] = [probe.sent, probe.received].map(|time| time.seconds_after(origin));
        // A count that wraps: of all that show the same, the one of that time.
        let about = (0.5 * (sent + received) - clock.host_s(0.0)) / clock.rate() * probe.tick_hz;
        let wraps = ((about - probe.device_ticks as f64) / WRAP).round();
        let line = clock.host_s((probe.device_ticks as f64 + wraps * WRAP) / probe.tick_hz);
        least = f64::max(least, line - received);
        most = f64::min(most, line - sent);
    }
    most.is_finite().then_some([least, most])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reports take 4 ms to 30 ms, a question 1 ms and its answer 2 ms at least; the count wraps in between.
    #[test]
    fn reports_are_as_late_as_questions_and_answers_say() {
        let origin = HostTime::from_nanos(5_000_000_000);
        let at = |us: u64| HostTime::from_nanos(5_000_000_000 + us * 1000);
        let count = |us: u64| (u32::MAX - 3_000_000).wrapping_add(us as u32);
        let mut arrivals = Arrivals::new(1e-6, origin);
        let mut first_s = None;
        for n in 0..500_u64 {
            let us = n * 20_000;
            let device_s = arrivals.next(count(us), at(us + 4000 + (n * 7919) % 26_000));
            first_s.get_or_insert(device_s);
        }
        let clock = arrivals.clock().expect("steady");
        let probe = |us: u64, waited: u64| ClockProbe {
            device: "stage".to_owned(),
            sent: at(us - 1000 - waited),
            received: at(us + 2000 + 2 * waited),
            device_ticks: count(us).into(),
            tick_hz: 1e6,
        };
        let probes = [probe(1_000_000, 40_000), probe(2_500_000, 0), probe(7_000_000, 3000)];
        let [least_s, most_s] = lateness(probes.clone(), &clock, origin).expect("bounds");
        // Between 4 − 2 ms and 4 + 1 ms.
        assert!((least_s - 2e-3).abs() < 1e-4 && (most_s - 5e-3).abs() < 1e-4, "{least_s} to {most_s}");
        assert!((clock.host_s(first_s.expect("reports")) - 0.5 * (least_s + most_s)).abs() < 6e-4);
        assert_eq!(lateness([], &clock, origin), None);
        // An answer from before its question was asked: nothing agrees with it.
        let wrong = ClockProbe { sent: at(6_000_000), received: at(6_003_000), ..probes[1].clone() };
        let [least_s, most_s] =
            lateness([probes[0].clone(), probes[1].clone(), wrong], &clock, origin).expect("bounds");
        assert!(most_s < least_s - 1.0, "{least_s} to {most_s}");
    }

    /// 1 kHz counts that wrap, delays of 1 ms to 30 ms and of 2 s at the start: device times fall on the true ones plus the least delay.
    #[test]
    fn late_arrivals_of_a_wrapping_count_fall_into_place() {
        let origin = HostTime::from_nanos(5_000_000_000);
        let mut arrivals = Arrivals::new(1e-3, origin);
        let first = u32::MAX - 500;
        let mut device = Vec::new();
        for n in 0..9000_u32 {
            let waited_us = 2_000_000_u64.saturating_sub(u64::from(n) * 1000);
            let delay_us = 1000 + waited_us + (u64::from(n) * 7919) % 29_000;
            let host = HostTime::from_nanos(5_000_000_000 + u64::from(n) * 1_000_000 + delay_us * 1000);
            device.push(arrivals.next(first.wrapping_add(n), host));
        }
        let clock = arrivals.clock().expect("steady");
        for (n, d) in device.into_iter().enumerate() {
            assert!((clock.host_s(d) - (n as f64 * 1e-3 + 1e-3)).abs() < 5e-5, "{n}");
        }
        // One that slips is none either: 0.2 s in the middle.
        let mut slips = Arrivals::new(1e-3, origin);
        for n in 0..30_000_u32 {
            let slip_us = if n > 12_000 { 200_000 } else { 0 };
            let delay_us = 1000 + slip_us + (u64::from(n) * 7919) % 29_000;
            slips.next(n, HostTime::from_nanos(5_000_000_000 + u64::from(n) * 1_000_000 + delay_us * 1000));
        }
        assert_eq!(slips.clock(), None);
        // A device that starts anew is no clock.
        arrivals.next(7, HostTime::from_nanos(14_100_000_000));
        assert_eq!(arrivals.clock(), None);
    }
}
