//! What the emulated sensor sends, and when: requests and time in, datagrams out. No socket, no clock.
//!
//! Time is counted in ticks of the internal rate since power-up. `ft_sequence` is that count, whatever is requested; `rdt_sequence`
//! starts at 1 for each request (ATI 9620-05, chapter 10).

use super::faults::{NetFtFaultSwitch, NetFtFaults};
use super::setup::{NetFtFamily, NetFtSetup};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt;
use std::net::SocketAddr;

/// Any bit is set.
const SUMMARY: u32 = 1 << 31;
/// A threshold was crossed.
const LATCHED: u32 = 1 << 16;

/// The wrench on the sensor (N and N·m, sensor frame) so many seconds after power-up.
pub(super) type Wrench = Box<dyn FnMut(f64) -> [f64; 6] + Send>;

/// Takes the datagrams.
pub(super) type Sink<'a> = &'a mut dyn FnMut(SocketAddr, &[u8]);

/// A stream that was asked for.
#[derive(Debug)]
struct Stream {
    /// Who asked last; nobody that we know when a second client has taken over.
    client: Option<SocketAddr>,
    /// Number of the last record.
    sequence: u32,
    /// When the next record is due.
    next_tick: u64,
    /// Records that are left; none for a stream without end.
    left: Option<u32>,
    /// Records a datagram.
    size: usize,
}

/// What the gauges and the clock say.
#[derive(Debug, Clone, Copy)]
struct Reading {
    ft_sequence: u32,
    counts: [i32; 6],
}

/// The sensor.
pub(super) struct Sensor {
    setup: NetFtSetup,
    wrench: Wrench,
    faults: NetFtFaultSwitch,
    random: ChaCha8Rng,
    stream: Option<Stream>,
    /// The datagram that is being filled.
    datagram: Vec<u8>,
    /// A datagram that will go after the next one.
    held: Option<(SocketAddr, Vec<u8>)>,
    last: Option<Reading>,
    bias: [i64; 6],
    bias_asked: bool,
    latched: bool,
    status: u32,
}

impl Sensor {
    pub(super) fn new(setup: NetFtSetup, wrench: Wrench, faults: NetFtFaultSwitch) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(setup.seed),
            setup,
            wrench,
            faults,
            stream: None,
            datagram: Vec::new(),
            held: None,
            last: None,
            bias: [0; 6],
            bias_asked: false,
            latched: false,
            status: 0,
        }
    }

    pub(super) fn setup(&self) -> &NetFtSetup {
        &self.setup
    }

    pub(super) fn faults(&self) -> NetFtFaults {
        self.faults.now()
    }

    /// The status word of the last record.
    pub(super) fn status(&self) -> u32 {
        self.status
    }

    /// The tick at which the next record is due.
    pub(super) fn due(&self) -> Option<u64> {
        self.stream.as_ref().map(|stream| stream.next_tick)
    }

    /// Hears a request at `tick`. What is no request is ignored.
    pub(super) fn hear(&mut self, request: &[u8], from: SocketAddr, tick: u64) {
        let &[0x12, 0x34, c, d, e, f, g, h] = request else { return };
        let count = u32::from_be_bytes([e, f, g, h]);
        match (u16::from_be_bytes([c, d]), self.setup.family) {
            (0x0000, _) => {
                let unheard = self.lost(|faults| &mut faults.lose_stops);
                self.stream = self.stream.take().filter(|_| unheard);
            }
            (0x0001, NetFtFamily::Axia) | (0x0002, _) => self.begin(from, tick, count, 1),
            (0x0003, _) => self.begin(from, tick, count, self.setup.records_a_datagram),
            (0x0041, _) => self.latched = false,
            (0x0042, _) => self.bias_asked = true,
            _ => {}
        }
    }

    /// Whether this request is among those that will be lost.
    fn lost(&self, count: impl Fn(&mut NetFtFaults) -> &mut u32) -> bool {
        let mut lost = false;
        self.faults.change(|faults| {
            let left = count(faults);
            lost = *left > 0;
            *left = left.saturating_sub(1);
        });
        lost
    }

    fn begin(&mut self, client: SocketAddr, tick: u64, count: u32, size: usize) {
        if self.lost(|faults| &mut faults.lose_starts) {
            return;
        }
        let left = (count > 0).then_some(count);
        self.datagram.clear();
        self.held = None;
        self.stream = Some(Stream { client: Some(client), sequence: 0, next_tick: tick + 1, left, size });
    }

    /// Sends what is due at `tick`, at most `most` records, and says whether there is more.
    pub(super) fn send_due(&mut self, tick: u64, most: usize, send: Sink<'_>) -> bool {
        let faults = self.faults.now();
        if self.faults.taken_over()
            && let Some(stream) = &mut self.stream
        {
            (stream.client, stream.sequence) = (None, 0);
        }
        for _ in 0..most {
            let Some(stream) = self.stream.as_mut().filter(|stream| stream.next_tick <= tick) else {
                return false;
            };
            let at = stream.next_tick;
            stream.next_tick += self.setup.ticks_a_record();
            stream.sequence = stream.sequence.wrapping_add(1);
            stream.left = stream.left.map(|left| left - 1);
            let (client, sequence, size, ended) =
                (stream.client, stream.sequence, stream.size, stream.left == Some(0));
            // The world goes on though the gauges freeze.
            let felt = self.read(at, &faults);
            let reading = self.last.filter(|_| faults.frozen).unwrap_or(felt);
            self.last = Some(reading);
            append(&mut self.datagram, sequence, self.status, reading);
            if ended {
                self.stream = None;
            }
            if ended || self.datagram.len() >= size * RECORD_BYTES {
                if let Some(client) = client.filter(|_| !faults.stalled) {
                    self.dispatch(client, &faults, send);
                }
                self.datagram.clear();
            }
        }
        self.due().is_some_and(|due| due <= tick)
    }

    /// Reads the gauges at a tick, and the status that follows.
    fn read(&mut self, tick: u64, faults: &NetFtFaults) -> Reading {
        let wrench = (self.wrench)(tick as f64 / self.setup.tick_hz);
        let mut saturated = faults.saturated;
        let raw: [i64; 6] = std::array::from_fn(|i| {
            let range = self.setup.range[i];
            saturated |= wrench[i].abs() > range;
            let held =
                if faults.saturated { range.copysign(wrench[i]) } else { wrench[i].clamp(-range, range) };
            (held * self.counts_per_si(i)).round() as i64
        });
        if std::mem::take(&mut self.bias_asked) {
            self.bias = raw;
        }
        let counts: [i32; 6] = std::array::from_fn(|i| {
            (raw[i] - self.bias[i]).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
        });
        let force =
            (0..3).map(|i| (f64::from(counts[i]) / self.counts_per_si(i)).powi(2)).sum::<f64>().sqrt();
        self.latched |= self.setup.threshold_n.is_some_and(|threshold| force > threshold);
        let saturation = match self.setup.family {
            NetFtFamily::NetBox => 1 << 17,
            NetFtFamily::Axia => 1 << 30 | 1 << 27,
        };
        let bits = faults.status_bits
            | if saturated { saturation } else { 0 }
            | if self.latched { LATCHED } else { 0 };
        self.status = if bits == 0 { 0 } else { bits | SUMMARY };
        let first = u64::from(self.setup.first_tick) + u64::from(faults.clock_ahead);
        Reading { ft_sequence: (first + tick) as u32, counts }
    }

    fn counts_per_si(&self, component: usize) -> f64 {
        if component < 3 {
            self.setup.counts_per_force / self.setup.force_unit.si
        } else {
            self.setup.counts_per_torque / self.setup.torque_unit.si
        }
    }

    /// Sends the datagram on its way through the network, such as that is.
    fn dispatch(&mut self, client: SocketAddr, faults: &NetFtFaults, send: Sink<'_>) {
        let mut happens = |share: f64| self.random.random_bool(share.clamp(0.0, 1.0));
        // Every draw is made whatever comes of it, so that one fault does not shift another's.
        let [drop, double, hold] =
            [faults.drop_share, faults.duplicate_share, faults.reorder_share].map(&mut happens);
        if drop {
            return;
        }
        if hold && self.held.is_none() {
            self.held = Some((client, self.datagram.clone()));
            return;
        }
        send(client, &self.datagram);
        if double {
            send(client, &self.datagram);
        }
        if let Some((client, late)) = self.held.take() {
            send(client, &late);
        }
    }
}

impl fmt::Debug for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sensor")
            .field("setup", &self.setup)
            .field("stream", &self.stream)
            .finish_non_exhaustive()
    }
}

/// Bytes of a record.
const RECORD_BYTES: usize = 36;

fn append(datagram: &mut Vec<u8>, sequence: u32, status: u32, reading: Reading) {
    for word in [sequence, reading.ft_sequence, status] {
        datagram.extend(word.to_be_bytes());
    }
    for count in reading.counts {
        datagram.extend(count.to_be_bytes());
    }
}

#[cfg(test)]
mod tests;
