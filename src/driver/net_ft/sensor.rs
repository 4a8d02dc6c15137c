//! How records come from a Net F/T: one socket, requests that nobody acknowledges, and a stream that may end without a word.

use super::super::DriverError;
use super::configuration::NetFtConfiguration;
use super::http;
use super::interference::{NetFtInterference, NetFtSilence};
use super::page::refused;
use super::rdt::{self, Command, MOST_RECORDS};
use super::settings::NetFtSettings;
use super::socket::{SensorSocket, resolve};
use crate::clock::HostTime;
use crate::device::{
    ClockComparison, DeviceError, ForceFormat, ForceIdentity, ForceRecord, ForceSensor, Losses, SequenceStep,
    SequenceTracker,
};
use std::io;
use std::net::SocketAddrV4;
use std::time::Duration;

/// How long a request and its answer may be on their way: an Axia takes up to 28 ms (ATI 9610-05), a network adds to that.
const LATENCY: Duration = Duration::from_millis(100);

/// How often a request is repeated before it counts as unheard.
const ATTEMPTS: u32 = 10;

/// A time that has passed: do not wait.
const AT_ONCE: HostTime = HostTime::from_nanos(0);

/// An ATI Net F/T: a Net Box or an Ethernet Axia.
///
/// Asking for the stream takes it away from whoever had it. A program that loses it to another sees silence, never an error; why,
/// [`NetFt::why_silent`] tells.
#[derive(Debug)]
pub struct NetFt {
    socket: SensorSocket,
    http_port: u16,
    configuration: NetFtConfiguration,
    identity: ForceIdentity,
    format: ForceFormat,
    start: Command,
    records_a_datagram: usize,
    tracker: SequenceTracker,
    /// Of this stream; of foreign datagrams, how many had come before it.
    interference: NetFtInterference,
    streaming: bool,
    /// Records that arrived while the stream was being started.
    first: Vec<ForceRecord>,
    /// How its clock compares, by the first of them.
    clock: Option<ClockComparison>,
}

impl NetFt {
    /// Reads the sensor's configuration and opens a socket for its stream, which [`ForceSensor::start`] asks for.
    ///
    /// # Errors
    /// [`DriverError`]: no such address, no answer within two seconds, or a configuration that readings cannot be built upon.
    pub fn open(settings: &NetFtSettings) -> Result<Self, DriverError> {
        let socket_error = |source| DriverError::ForceSocket { address: settings.address.clone(), source };
        let host = resolve(&settings.address).map_err(socket_error)?;
        let configuration = NetFtConfiguration::parse(&http::fetch_page(host, settings.http_port)?)?;
        if let Some(expected) = settings.expected_rate_hz
            && (configuration.rate_hz - expected).abs() > 0.5
        {
            return Err(refused(
                "comrdtrate",
                Some(&configuration.rate_hz.to_string()),
                format!("{expected} records/s; set it on the sensor's page Communications"),
            ));
        }
        let sensor = SocketAddrV4::new(host, settings.rdt_port);
        let format = configuration.format();
        Ok(Self {
            socket: SensorSocket::open(sensor).map_err(socket_error)?,
            http_port: settings.http_port,
            identity: ForceIdentity {
                product: configuration.product_name.clone(),
                calibration: configuration.calibration.clone(),
                configuration: configuration.name.clone(),
                address: sensor.to_string(),
            },
            start: if settings.buffered { Command::Buffered } else { Command::Realtime },
            records_a_datagram: if settings.buffered {
                configuration.records_a_datagram.unwrap_or(MOST_RECORDS)
            } else {
                1
            },
            tracker: SequenceTracker::new(format.ticks_a_record()),
            configuration,
            format,
            interference: NetFtInterference::default(),
            streaming: false,
            first: Vec::with_capacity(MOST_RECORDS),
            clock: None,
        })
    }

    /// What the sensor said of itself when it was opened.
    pub fn configuration(&self) -> &NetFtConfiguration {
        &self.configuration
    }

    /// How long a datagram takes to fill (s).
    pub fn datagram_s(&self) -> f64 {
        self.records_a_datagram as f64 / self.format.rate_hz
    }

    /// What came in between since the stream was last started.
    pub fn interference(&self) -> NetFtInterference {
        NetFtInterference { foreign: self.socket.foreign() - self.interference.foreign, ..self.interference }
    }

    /// Finds out why no records come. Takes up to two seconds: to be asked when everything stands.
    pub fn why_silent(&self) -> NetFtSilence {
        match http::fetch_page(*self.socket.sensor().ip(), self.http_port) {
            Ok(page) => {
                let configuration = NetFtConfiguration::parse(&page).ok();
                NetFtSilence::StreamElsewhere { status: configuration.and_then(|c| c.status) }
            }
            Err(error) => NetFtSilence::SensorGone(error),
        }
    }

    /// How long an answer to a request may take: on its way, and until a datagram is full.
    fn patience(&self) -> Duration {
        LATENCY + Duration::from_secs_f64(1.5 * self.datagram_s())
    }

    fn send(&self, command: Command) -> Result<(), DeviceError> {
        self.socket.send(command).map_err(|source| lost(&self.identity, source))
    }

    /// Throws away what arrives until `until`.
    fn discard(&mut self, until: HostTime) -> Result<(), DeviceError> {
        while self.next_is_stale(until)? {}
        Ok(())
    }

    /// Throws away what has arrived, and says whether more comes.
    fn still_comes(&mut self) -> Result<bool, DeviceError> {
        self.discard(AT_ONCE)?;
        self.next_is_stale(HostTime::now() + self.patience())
    }

    /// Throws away the next datagram, if one comes until `until`.
    fn next_is_stale(&mut self, until: HostTime) -> Result<bool, DeviceError> {
        let any = self.socket.next(until).map_err(|source| lost(&self.identity, source))?.is_some();
        self.interference.stale += u64::from(any);
        Ok(any)
    }

    /// Keeps the records of the datagram that arrived last before `until`; ends at the first one when `at_first`.
    fn keep_latest(&mut self, until: HostTime, at_first: bool) -> Result<(), DeviceError> {
        while let Some((datagram, host)) =
            self.socket.next(until).map_err(|source| lost(&self.identity, source))?
        {
            if let Some(records) = rdt::records(datagram, host) {
                self.first.clear();
                self.first.extend(records);
                if at_first {
                    break;
                }
            }
        }
        Ok(())
    }
}

impl ForceSensor for NetFt {
    fn identity(&self) -> &ForceIdentity {
        &self.identity
    }

    fn format(&self) -> &ForceFormat {
        &self.format
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        if self.streaming {
            self.stop()?;
        }
        self.discard(AT_ONCE)?;
        self.first.clear();
        self.clock = None;
        self.tracker = SequenceTracker::new(self.format.ticks_a_record());
        self.interference =
            NetFtInterference { foreign: self.socket.foreign(), ..NetFtInterference::default() };
        let begun = HostTime::now();
        for attempt in 0..ATTEMPTS {
            let sent = HostTime::now();
            self.send(self.start)?;
            self.streaming = true;
            let until = HostTime::now() + self.patience();
            self.keep_latest(until, true)?;
            if !self.first.is_empty() {
                // An answer to each request may still be on its way, and each begins the stream anew.
                if attempt > 0 {
                    self.keep_latest(until, false)?;
                }
                // Where several requests went out, nobody knows which was answered: the first is surely before the record.
                let sent = if attempt == 0 { sent } else { begun };
                self.clock = self.first.first().map(|record| ClockComparison {
                    sent,
                    received: record.host,
                    ticks: record.ft_sequence,
                    tick_hz: self.format.tick_hz,
                });
                return Ok(());
            }
        }
        // Should a request still arrive, its stream is not wanted any more.
        self.send(Command::Stop)?;
        self.streaming = false;
        let waited = HostTime::now().since(begun);
        let during = match self.why_silent() {
            NetFtSilence::StreamElsewhere { .. } => {
                "being asked for its stream, though its web page answers (a firewall, or another client that keeps asking?)"
            }
            NetFtSilence::SensorGone(_) => {
                "being asked for its stream, and its web page does not answer either"
            }
        };
        Err(DeviceError::Silent { device: device(&self.identity), waited, during })
    }

    fn stop(&mut self) -> Result<(), DeviceError> {
        for attempt in 0..=ATTEMPTS {
            // A stream that no longer comes here has ended, or is somebody else's.
            if !self.still_comes()? {
                self.streaming = false;
                self.first.clear();
                return Ok(());
            }
            if attempt < ATTEMPTS {
                self.send(Command::Stop)?;
                // What was on its way when the request arrived.
                self.discard(HostTime::now() + self.patience())?;
            }
        }
        Err(DeviceError::Refused {
            device: device(&self.identity),
            what: "end its stream",
            reason: format!("records still arrive after {ATTEMPTS} requests"),
        })
    }

    fn clock_at_start(&self) -> Option<ClockComparison> {
        self.clock
    }

    fn bias(&mut self) -> Result<(), DeviceError> {
        self.send(Command::Bias)
    }

    fn clear_latch(&mut self) -> Result<(), DeviceError> {
        self.send(Command::ResetLatch)
    }

    fn receive(&mut self, until: HostTime, records: &mut Vec<ForceRecord>) -> Result<(), DeviceError> {
        if !self.streaming {
            self.discard(until)?;
            return Ok(());
        }
        records.reserve(64);
        let before = records.len();
        for record in self.first.drain(..) {
            note(&mut self.tracker, &mut self.interference, &record);
            records.push(record);
        }
        while records.capacity() - records.len() >= MOST_RECORDS {
            let until = if records.len() > before { AT_ONCE } else { until };
            let next = self.socket.next(until).map_err(|source| lost(&self.identity, source))?;
            let Some((datagram, host)) = next else { break };
            let Some(arrived) = rdt::records(datagram, host) else {
                self.tracker.malformed();
                if host >= until {
                    break;
                }
                continue;
            };
            for record in arrived {
                note(&mut self.tracker, &mut self.interference, &record);
                records.push(record);
            }
        }
        Ok(())
    }

    fn losses(&self) -> Losses {
        self.tracker.losses()
    }

    fn line_counts(&self) -> Vec<(&'static str, u64)> {
        let NetFtInterference { foreign, stale, restarted, frozen } = self.interference();
        vec![
            ("datagrams_foreign", foreign),
            ("datagrams_stale", stale),
            ("streams_restarted", restarted),
            ("records_frozen", frozen),
        ]
    }

    fn why_silent(&self) -> Option<String> {
        Some(self.why_silent().to_string())
    }

    fn explain(&self, status: u32) -> Vec<&'static str> {
        self.configuration.product.explain(status)
    }
}

impl Drop for NetFt {
    /// A sensor that is left to itself streams on. A stream that no longer comes here may be somebody else's, and is left alone.
    fn drop(&mut self) {
        let until = HostTime::now() + self.patience();
        if self.streaming && self.socket.next(until).is_ok_and(|datagram| datagram.is_some()) {
            // Nobody is left to be told of a failure.
            let _ = self.send(Command::Stop);
        }
    }
}

fn note(tracker: &mut SequenceTracker, interference: &mut NetFtInterference, record: &ForceRecord) {
    match tracker.observe(record) {
        SequenceStep::Restarted => interference.restarted += 1,
        SequenceStep::Frozen => interference.frozen += 1,
        _ => {}
    }
}

fn device(identity: &ForceIdentity) -> String {
    format!("force sensor at {}", identity.address)
}

fn lost(identity: &ForceIdentity, source: io::Error) -> DeviceError {
    DeviceError::Lost { device: device(identity), source }
}
