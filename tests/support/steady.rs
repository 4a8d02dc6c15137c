//! Tests in real time on machines that are not.
//!
//! What these tests look at happens in milliseconds, at the other end of a port, in threads that need a processor when it does. A machine
//! that stands still meanwhile (a virtual one whose host is busy, say) makes a sound driver time out, and the test says nothing. So a test
//! that failed is made once more, but only where the machine was measured to have been held up while it ran. It has to pass in the end: so
//! what is tested at a time is short, one case of many.

use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A thread that may run anywhere and is woken later than this was held up.
const LATE: Duration = Duration::from_millis(20);
/// So was one that may run on one processor only: a virtual one may stand still alone. Later than what other threads there take of it.
const LATE_ALONE: Duration = Duration::from_millis(100);
/// So was a machine on which a byte took longer than this from one end of a pseudo-terminal to the other: the system hands such bytes on in
/// a thread of its own, for which whoever reads them waits.
const LATE_PORT: Duration = Duration::from_millis(100);
/// So was a machine of whose processors' time its host took more than this share.
const STOLEN: f64 = 0.03;
/// So often a test is made at most.
const ATTEMPTS: u32 = 12;

/// Makes a test, again where it failed on a machine that was held up.
pub(crate) fn steady(test: impl Fn()) {
    for attempt in 1.. {
        let over = AtomicBool::new(false);
        let before = stolen();
        let (outcome, latest, alone, port) = std::thread::scope(|scope| {
            let over = &over;
            let anywhere = scope.spawn(|| lateness(None, over));
            let bound: Vec<_> =
                processors().map(|cpu| scope.spawn(move || lateness(Some(cpu), over))).collect();
            let port = scope.spawn(|| port_lateness(over));
            let outcome = catch_unwind(AssertUnwindSafe(&test));
            over.store(true, Ordering::Release);
            let alone = bound.into_iter().map(|watch| watch.join().expect("it only sleeps")).max();
            let port = port.join().expect("it only writes to itself");
            (outcome, anywhere.join().expect("it only sleeps"), alone.unwrap_or_default(), port)
        });
        let Err(failure) = outcome else { return };
        let share = stolen().zip(before).map_or(0.0, |(a, b)| (a.0 - b.0) / (a.1 - b.1).max(1.0));
        println!(
            "attempt {attempt}: held up for {latest:?}, one processor for {alone:?}, a port for {port:?}, {:.0} % of the time taken",
            100.0 * share
        );
        let sound = latest <= LATE && alone <= LATE_ALONE && port <= LATE_PORT && share <= STOLEN;
        if attempt == ATTEMPTS || sound {
            resume_unwind(failure);
        }
    }
}

/// Processors that this process may use.
fn processors() -> impl Iterator<Item = usize> {
    let may = sched_getaffinity(None).unwrap_or_else(|_| CpuSet::new());
    (0..CpuSet::MAX_CPU).filter(move |cpu| may.is_set(*cpu))
}

/// How late a sleeping thread was woken, at worst: on one processor, or on any.
fn lateness(cpu: Option<usize>, over: &AtomicBool) -> Duration {
    const NAP: Duration = Duration::from_millis(2);
    if let Some(cpu) = cpu {
        let mut here = CpuSet::new();
        here.set(cpu);
        sched_setaffinity(None, &here).expect("one of the processors that it may use");
    }
    let mut latest = Duration::ZERO;
    while !over.load(Ordering::Acquire) {
        let before = Instant::now();
        std::thread::sleep(NAP);
        latest = latest.max(before.elapsed().saturating_sub(NAP));
    }
    latest
}

/// How long a byte took through a pseudo-terminal, at worst; nothing where there are none.
fn port_lateness(over: &AtomicBool) -> Duration {
    const NAP: Duration = Duration::from_millis(5);
    let Ok((mut near, mut far)) = TTYPort::pair() else { return Duration::ZERO };
    let mut latest = Duration::ZERO;
    let mut byte = [0];
    while !over.load(Ordering::Acquire) && near.write_all(b".").is_ok() {
        let before = Instant::now();
        // A time-out is no end: the byte is still on its way.
        let mut arrived = || far.set_timeout(NAP).is_ok() && far.read(&mut byte).is_ok_and(|n| n == 1);
        while !arrived() && !over.load(Ordering::Acquire) {}
        latest = latest.max(before.elapsed());
        std::thread::sleep(NAP);
    }
    latest
}

/// Time that the machine's host took for others, and all time that has passed, of all processors (in ticks); none where nobody tells.
fn stolen() -> Option<(f64, f64)> {
    let stat = std::fs::read_to_string("/proc/stat").ok()?;
    let ticks: Vec<f64> = stat.lines().next()?.split_whitespace().skip(1).flat_map(str::parse).collect();
    Some((*ticks.get(7)?, ticks.iter().take(8).sum()))
}

#[test]
fn a_test_that_fails_for_good_fails() {
    assert!(catch_unwind(|| steady(|| panic!("on purpose"))).is_err());
}
