//! Who is behind the port, and what its settings say: from an open port to a [`GrblStage`] that stands and has not homed.
//!
//! Boards that reset when the port is opened (DTR) introduce themselves with a banner, 0.8–3 s later. When none comes, the controller
//! did not reset: it is asked who it is, and reset by us once it has answered as Grbl, so that each connection starts from the same
//! state: nothing queued, nothing held. A Grbl that waits for a reset after a limit alarm answers nothing at all; so silence is tried
//! with one reset before it is taken for silence. What answers otherwise is named for what it says.

use super::command;
use super::line::{Dialect, Line};
use super::link::Link;
use super::settings::{Machine, Unfit};
use super::stage::GrblStage;
use crate::clock::HostTime;
use crate::device::{AXES, DeviceError, StageIdentity};
use crate::driver::DriverError;
use crate::driver::port::{self, BytePort};
use std::collections::BTreeMap;
use std::time::Duration;

/// How to reach a Grbl stage and how to talk to it.
#[derive(Debug, Clone, PartialEq)]
pub struct GrblOptions {
    /// Path of the serial port.
    pub port: String,
    /// Baud; Grbl has 115 200.
    pub baud: u32,
    /// Which of Grbl's axes are the stage's, in the stage's order: two different letters.
    pub axes: [char; AXES],
    /// Status reports a second while standing.
    pub idle_rate_hz: f64,
    /// Status reports a second while moving. Grbl on an 8-bit board should not be asked more often than 5 to 10 times a second
    /// (its manual); grblHAL stands 50.
    pub moving_rate_hz: f64,
    /// How long a board that resets on opening takes to introduce itself.
    pub banner: Duration,
    /// How long an answer may take.
    pub reply: Duration,
    /// How long status reports may fail to come before the stage counts as silent.
    pub silence: Duration,
}

impl GrblOptions {
    /// Usual values for a controller at `port`, moving along X and Z.
    pub fn new(port: impl Into<String>) -> Self {
        Self {
            port: port.into(),
            baud: 115_200,
            axes: ['X', 'Z'],
            idle_rate_hz: 5.0,
            moving_rate_hz: 10.0,
            banner: Duration::from_millis(3000),
            reply: Duration::from_millis(1000),
            silence: Duration::from_millis(1000),
        }
    }
}

/// Which of the controller's axes are the stage's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Axes {
    pub(super) letters: [char; AXES],
    /// Places in reports and settings.
    pub(super) index: [usize; AXES],
    /// Axes of the controller.
    pub(super) count: usize,
}

/// What the controller says about itself.
#[derive(Debug)]
struct Answer {
    dialect: Dialect,
    version: String,
    build: String,
    options: String,
    letters: String,
}

/// Opens the port and makes a stage of what is behind it.
pub(super) fn connect(options: &GrblOptions) -> Result<GrblStage, DriverError> {
    connect_through(port::open(&options.port, options.baud)?, options)
}

/// As [`connect`], with a port that is open.
pub(super) fn connect_through(
    port: Box<dyn BytePort>,
    options: &GrblOptions,
) -> Result<GrblStage, DriverError> {
    let mut link = Link::new(port, format!("the controller on {}", options.port));
    let (dialect, version) = greet(&mut link, options)?;
    link.rename(format!("{} {version} on {}", dialect.name(), options.port));
    let mut answer =
        Answer { dialect, version, build: String::new(), options: String::new(), letters: "XYZ".to_owned() };
    ask(&mut link, "$I\n", "telling its version", options.reply, |line| {
        match line {
            Line::Version(build) => answer.build = build,
            Line::Options(text) => answer.options = text,
            Line::Axes(letters) => answer.letters = letters,
            _ => return false,
        }
        true
    })?;
    if !answer.version.starts_with("1.1") {
        return Err(DriverError::GrblVersion { device: link.device(), version: answer.version });
    }
    let axes = axes(options, &answer.letters).ok_or_else(|| DriverError::GrblAxes {
        device: link.device(),
        asked: options.axes,
        has: answer.letters.clone(),
    })?;
    let mut settings = BTreeMap::new();
    ask(&mut link, "$$\n", "telling its settings", options.reply, |line| {
        let Line::Setting { number, value } = line else { return false };
        if let Some(value) = super::status::number(&value) {
            settings.insert(number, value);
        }
        true
    })?;
    let built = |letter| answer.options.split(',').next().is_some_and(|letters| letters.contains(letter));
    let classic = answer.dialect == Dialect::Classic;
    let mut machine = Machine::from_settings(&settings, &axes, classic && built('Z')).map_err(
        |Unfit { setting, value, expected }| DriverError::GrblSetting {
            device: link.device(),
            setting,
            value,
            expected,
        },
    )?;
    // What grblHAL can be set up to do, Grbl is built for.
    machine.parks |= classic && built('P');
    let identity = StageIdentity {
        controller: format!("{} {}", dialect.name(), answer.version),
        firmware: answer.build,
        port: options.port.clone(),
    };
    let mut stage = GrblStage::new(link, dialect, identity, axes, machine, options);
    // An alarm that silences it has a position to be reported with.
    stage.position()?;
    Ok(stage)
}

impl Dialect {
    fn name(self) -> &'static str {
        match self {
            Self::Classic => "Grbl",
            Self::Hal => "grblHAL",
        }
    }
}

const EXPECTED: &str = "a Grbl controller";

fn greet(link: &mut Link, options: &GrblOptions) -> Result<(Dialect, String), DriverError> {
    if let Some(banner) = banner(link, options.banner)? {
        return Ok(banner);
    }
    link.send(&[command::STATUS])?;
    link.send(b"$I\n")?;
    let until = HostTime::now() + options.reply;
    let mut grbl = false;
    while !grbl && let Some((_, line)) = link.next(until)? {
        grbl = matches!(line, Line::Status(_) | Line::Version(_));
    }
    if !grbl && link.nonsense() > 0 {
        return Err(link
            .unanswered(options.banner + options.reply, "being asked who it is", EXPECTED)
            .into());
    }
    link.send(&[command::RESET])?;
    match banner(link, options.banner)? {
        Some(banner) => Ok(banner),
        None => {
            let waited = options.banner * 2 + options.reply;
            Err(link.unanswered(waited, "being asked who it is", EXPECTED).into())
        }
    }
}

fn banner(link: &mut Link, budget: Duration) -> Result<Option<(Dialect, String)>, DeviceError> {
    let until = HostTime::now() + budget;
    while let Some((_, line)) = link.next(until)? {
        if let Line::Banner { dialect, version } = line {
            link.made_sense();
            return Ok(Some((dialect, version)));
        }
    }
    Ok(None)
}

/// Sends a line that moves nothing and takes what it brings until `ok`; asks twice, since a line may get lost. `take` says whether a
/// line is part of the answer: an `ok` before any that is belongs to something asked earlier.
fn ask(
    link: &mut Link,
    line: &str,
    during: &'static str,
    budget: Duration,
    mut take: impl FnMut(Line) -> bool,
) -> Result<(), DeviceError> {
    let mut answered = false;
    for attempt in 0..2 {
        link.send(line.as_bytes())?;
        let until = HostTime::now() + budget;
        while let Some((_, line)) = link.next(until)? {
            match line {
                Line::Ok if answered => {
                    // Asked twice, it may answer once more.
                    let quiet = HostTime::now() + budget;
                    while attempt > 0 && link.next(quiet)?.is_some() {}
                    return Ok(());
                }
                Line::Error(code) => {
                    let reason = format!("error {code}: {}", super::codes::error(code));
                    return Err(DeviceError::Refused { device: link.device(), what: during, reason });
                }
                other => answered |= take(other),
            }
        }
    }
    Err(link.unanswered(budget * 2, during, "ok or error"))
}

fn axes(options: &GrblOptions, letters: &str) -> Option<Axes> {
    let [first, second] = options.axes.map(|letter| letters.find(letter));
    let index = [first?, second?];
    (index[0] != index[1]).then_some(Axes { letters: options.axes, index, count: letters.len() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Stage;
    use std::collections::VecDeque;
    use std::io;

    /// Says something each time that it is told something.
    struct Script {
        says: VecDeque<u8>,
        replies: VecDeque<(&'static str, &'static str)>,
    }

    impl Script {
        fn new(first: &str, replies: &[(&'static str, &'static str)]) -> Box<Self> {
            Box::new(Self { says: first.bytes().collect(), replies: replies.iter().copied().collect() })
        }
    }

    impl BytePort for Script {
        fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
            if self.says.is_empty() {
                std::thread::sleep(wait);
            }
            let count = buffer.len().min(self.says.len());
            self.says.drain(..count).zip(buffer).for_each(|(byte, place)| *place = byte);
            Ok(count)
        }

        fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
            let (told, says) = self.replies.pop_front().unwrap_or(("", ""));
            assert!(told.is_empty() || told.as_bytes() == bytes, "{told:?}, not {bytes:?}");
            self.says.extend(says.bytes());
            Ok(())
        }

        fn second(&self) -> io::Result<Box<dyn BytePort>> {
            Err(io::ErrorKind::Unsupported.into())
        }
    }

    const BANNER: &str = "\r\nGrbl 1.1h ['$' for help]\r\n";
    const BUILD: &str = "[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n";
    const SETTINGS: &str = "$13=0\r\n$100=250.000\r\n$102=250.000\r\n$110=500.000\r\n$112=500.000\r\n$120=10.000\r\n\
        $122=10.000\r\n$130=200.000\r\n$132=50.000\r\nok\r\n";
    const IDLE: &str = "<Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>\r\n";

    fn options() -> GrblOptions {
        let short = Duration::from_millis(30);
        GrblOptions { banner: short, reply: short, ..GrblOptions::new("a script") }
    }

    /// Seen on a slow Grbl: asked twice, it answers twice, and the second answer is not one to what is asked next.
    #[test]
    fn a_late_answer_is_not_taken_for_the_next_one() {
        let twice = "[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n";
        let script = Script::new(BANNER, &[("$I\n", ""), ("$I\n", twice), ("$$\n", SETTINGS), ("?", IDLE)]);
        let stage = connect_through(script, &options()).expect("a stage");
        assert_eq!(stage.identity().firmware, "1.1h.20190830");
        assert_eq!(stage.limits().travel_m, [[-0.2, 0.0], [-0.05, 0.0]]);
    }

    #[test]
    fn one_that_did_not_reset_is_asked_and_then_reset() {
        let script = Script::new(
            "",
            &[
                ("?", IDLE),
                ("$I\n", BUILD),
                ("\x18", BANNER),
                ("$I\n", BUILD),
                ("$$\n", SETTINGS),
                ("?", IDLE),
            ],
        );
        connect_through(script, &options()).expect("a stage");
    }

    #[test]
    fn another_version_is_refused() {
        let script = Script::new("\r\nGrbl 0.9j ['$' for help]\r\n", &[("$I\n", BUILD)]);
        let error = connect_through(script, &options()).err().expect("too old");
        assert!(matches!(error, DriverError::GrblVersion { .. }), "{error}");
    }
}
