//! Who is behind the port, and what its settings say: from an open port to a [`GrblStage`] that stands and has not homed.
//!
//! Boards that reset when the port is opened (DTR) introduce themselves with a banner, 0.8–3 s later. When none comes, the controller
//! did not reset: it is asked who it is, and reset by us once it has answered as Grbl, so that each connection starts from the same
//! state: nothing queued, nothing held. That it was held is not forgotten with that: the stage begins latched. A Grbl that waits for
//! a reset after a limit alarm answers nothing at all; so silence is tried with one reset before it is taken for silence. What answers
//! otherwise is named for what it says.
//!
//! Nothing checks what Grbl says of itself, and a setting that got lost would be taken for another travel. So an answer is believed when
//! nothing beside it made no sense and nothing is missing, or when it came twice alike.

use super::command;
use super::line::{Dialect, Line};
use super::link::Link;
use super::settings::{Machine, Unfit};
use super::stage::GrblStage;
use super::status::Word;
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
    let (dialect, version, found) = greet(&mut link, options)?;
    link.rename(format!("{} {version} on {}", dialect.name(), options.port));
    let mut answer =
        Answer { dialect, version, build: String::new(), options: String::new(), letters: "XYZ".to_owned() };
    let introduction = |line: &Line| matches!(line, Line::Version(_) | Line::Options(_) | Line::Axes(_));
    let whole = |lines: &[Line]| {
        lines.iter().any(|line| matches!(line, Line::Version(_)))
            && lines.iter().any(|line| matches!(line, Line::Options(_)))
            && (dialect == Dialect::Classic || lines.iter().any(|line| matches!(line, Line::Axes(_))))
    };
    for line in ask(&mut link, "$I\n", "telling its version", options.reply, introduction, whole)? {
        match line {
            Line::Version(build) => answer.build = build,
            Line::Options(text) => answer.options = text,
            Line::Axes(letters) => answer.letters = letters,
            _ => {}
        }
    }
    if !answer.version.starts_with("1.1") {
        return Err(DriverError::GrblVersion { device: link.device(), version: answer.version });
    }
    let axes = axes(options, &answer.letters).ok_or_else(|| DriverError::GrblAxes {
        device: link.device(),
        asked: options.axes,
        has: answer.letters.clone(),
    })?;
    let setting = |line: &Line| matches!(line, Line::Setting { .. });
    let whole = |lines: &[Line]| Machine::tells_all(&values(lines), &axes);
    let settings = values(&ask(&mut link, "$$\n", "telling its settings", options.reply, setting, whole)?);
    let built = |letter| answer.options.split(',').next().is_some_and(|letters| letters.contains(letter));
    let classic = answer.dialect == Dialect::Classic;
    let mut machine = Machine::from_settings(&settings, &axes, answer.dialect, classic && built('Z'))
        .map_err(|Unfit { setting, value, expected }| DriverError::GrblSetting {
            device: link.device(),
            setting,
            value,
            expected,
        })?;
    // What grblHAL can be set up to do, Grbl is built for.
    machine.parks |= classic && built('P');
    let identity = StageIdentity {
        controller: format!("{} {}", dialect.name(), answer.version),
        firmware: answer.build,
        port: options.port.clone(),
    };
    let mut stage = GrblStage::new(link, dialect, identity, axes, machine, options);
    if let Some(why) = found.and_then(|word| left_stopped(word, dialect)) {
        stage.latch(why)?;
    }
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

/// Why a stage that was found so, before it was reset, may not move until a person has said that it may: somebody has stopped it.
fn left_stopped(word: Word, dialect: Dialect) -> Option<&'static str> {
    match word {
        Word::Door { .. } | Word::Hold { .. } => {
            Some("it was stopped before this program began, and nobody has cleared it")
        }
        // After a stop grblHAL goes on calling itself so; or it moves, and nobody knows for whom.
        Word::Jog | Word::Run if dialect == Dialect::Hal => {
            Some("it was stopped on its way, or still moving, before this program began")
        }
        _ => None,
    }
}

/// Settings by number.
fn values(lines: &[Line]) -> BTreeMap<u16, f64> {
    let value = |line: &Line| match line {
        Line::Setting { number, value } => Some((*number, super::status::number(value)?)),
        _ => None,
    };
    lines.iter().filter_map(value).collect()
}

const EXPECTED: &str = "a Grbl controller";

/// Who it is, and its state before it was reset where it had to be.
fn greet(link: &mut Link, options: &GrblOptions) -> Result<(Dialect, String, Option<Word>), DriverError> {
    if let Some((dialect, version)) = banner(link, options.banner)? {
        return Ok((dialect, version, None));
    }
    let (mut grbl, mut found) = (false, None);
    for attempt in 0..2 {
        link.send(&[command::STATUS])?;
        if attempt == 0 {
            link.send(b"$I\n")?;
        }
        let until = HostTime::now() + options.reply;
        while found.is_none()
            && HostTime::now() < until
            && let Some((_, line)) = link.next(until)?
        {
            grbl |= matches!(line, Line::Version(_));
            if let Line::Status(status) = line {
                found = Some(status.word);
            }
        }
        grbl |= found.is_some();
        // One that has told who it is can tell its state.
        if !grbl || found.is_some() {
            break;
        }
    }
    if !grbl && link.nonsense() > 0 {
        return Err(link
            .unanswered(options.banner + options.reply, "being asked who it is", EXPECTED)
            .into());
    }
    link.send(&[command::RESET])?;
    match banner(link, options.banner)? {
        Some((dialect, version)) => Ok((dialect, version, found)),
        None => {
            let waited = options.banner * 2 + options.reply;
            Err(link.unanswered(waited, "being asked who it is", EXPECTED).into())
        }
    }
}

fn banner(link: &mut Link, budget: Duration) -> Result<Option<(Dialect, String)>, DeviceError> {
    let until = HostTime::now() + budget;
    while HostTime::now() < until
        && let Some((_, line)) = link.next(until)?
    {
        if let Line::Banner { dialect, version } = line {
            link.made_sense();
            return Ok(Some((dialect, version)));
        }
    }
    Ok(None)
}

/// How often something is asked.
const ATTEMPTS: u32 = 3;

/// Sends a line that moves nothing and takes the lines of its answer, up to `ok`. `part` says whether a line is part of the answer: an
/// `ok` before any that is belongs to something asked earlier. Asks again when nothing came, when it was refused (garbled on the way?),
/// and when the answer is not to be believed: something beside it made no sense, or it is not `whole`, unless it came twice alike.
fn ask(
    link: &mut Link,
    line: &str,
    during: &'static str,
    budget: Duration,
    part: impl Fn(&Line) -> bool,
    whole: impl Fn(&[Line]) -> bool,
) -> Result<Vec<Line>, DeviceError> {
    let (mut last, mut refused, mut unanswered) = (None, false, false);
    for _ in 0..ATTEMPTS {
        let nonsense = link.nonsense();
        link.send(line.as_bytes())?;
        match answer(link, budget, &part)? {
            None => unanswered = true,
            Some(Err(code)) if refused => {
                let reason = format!("error {code}: {}", super::codes::error(code));
                return Err(DeviceError::Refused { device: link.device(), what: during, reason });
            }
            Some(Err(_)) => refused = true,
            Some(Ok(lines)) => {
                let clean = link.nonsense() == nonsense && whole(&lines);
                let twice = last.as_ref() == Some(&lines);
                if clean || twice {
                    // Asked again because it was late, it may answer once more.
                    let quiet = HostTime::now() + budget;
                    while unanswered && HostTime::now() < quiet && link.next(quiet)?.is_some() {}
                    return Ok(lines);
                }
                last = Some(lines);
            }
        }
    }
    Err(link.unanswered(budget * ATTEMPTS, during, "a whole answer, and ok"))
}

/// Lines up to `ok`, or the code of the error that came instead. `None`: neither came in time.
fn answer(
    link: &mut Link,
    budget: Duration,
    part: impl Fn(&Line) -> bool,
) -> Result<Option<Result<Vec<Line>, u8>>, DeviceError> {
    let (mut lines, until) = (Vec::new(), HostTime::now() + budget);
    while HostTime::now() < until
        && let Some((_, line)) = link.next(until)?
    {
        match line {
            Line::Ok if !lines.is_empty() => return Ok(Some(Ok(lines))),
            Line::Error(code) => return Ok(Some(Err(code))),
            line if part(&line) => lines.push(line),
            _ => {}
        }
    }
    Ok(None)
}

fn axes(options: &GrblOptions, letters: &str) -> Option<Axes> {
    let [first, second] = options.axes.map(|letter| letters.find(letter));
    let index = [first?, second?];
    (index[0] != index[1]).then_some(Axes { letters: options.axes, index, count: letters.len() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Motion, Stage, StageState};
    use std::collections::VecDeque;
    use std::io;
    use std::sync::{Arc, Mutex};

    /// Says something each time that it is told something.
    struct Script {
        says: VecDeque<u8>,
        replies: VecDeque<(&'static str, &'static str)>,
        /// What it says without end when it has said all that.
        chatter: &'static str,
        /// Told a jog, it fails once.
        fails: bool,
        told: Arc<Mutex<Vec<u8>>>,
    }

    impl Script {
        fn new(first: &str, replies: &[(&'static str, &'static str)]) -> Box<Self> {
            let (says, replies) = (first.bytes().collect(), replies.iter().copied().collect());
            Box::new(Self { says, replies, chatter: "", fails: false, told: Arc::default() })
        }
    }

    impl BytePort for Script {
        fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
            let jog = self.told.lock().expect("no panic").windows(2).any(|told| told == b"$J");
            if jog && std::mem::take(&mut self.fails) {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            if self.says.is_empty() && self.replies.is_empty() {
                self.says.extend(self.chatter.bytes());
            }
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
            self.told.lock().expect("no panic").extend(bytes);
            Ok(())
        }

        fn second(&self) -> io::Result<Box<dyn BytePort>> {
            Err(io::ErrorKind::Unsupported.into())
        }
    }

    const BANNER: &str = "\r\nGrbl 1.1h ['$' for help]\r\n";
    const BUILD: &str = "[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n";
    const SETTINGS: &str = "$1=255\r\n$13=0\r\n$21=0\r\n$22=1\r\n$23=0\r\n$27=1.000\r\n$100=250.000\r\n$102=250.000\r\n$110=500.000\r\n$112=500.000\r\n$120=10.000\r\n\
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

    /// A line of it that was damaged or got lost, and an error in place of it.
    #[test]
    fn an_answer_that_is_not_whole_is_asked_for_again() {
        let whole = [("$I\n", BUILD), ("$$\n", SETTINGS)];
        let damaged = SETTINGS.replace("$130=200.000", "$13\u{1}=200.000").leak();
        let lost = SETTINGS.replace("$27=1.000\r\n", "").leak();
        for (wrong, place) in [
            (("$I\n", "[VER:1.1h.20190830:]\r\nok\r\n"), 0),
            (("$I\n", "[OPT:V,15,128]\r\nok\r\n"), 0),
            (("$I\n", "error:1\r\n"), 0),
            (("$$\n", &*damaged), 1),
            (("$$\n", &*lost), 1),
        ] {
            let mut replies = whole.to_vec();
            replies.insert(place, wrong);
            replies.push(("?", IDLE));
            let stage = connect_through(Script::new(BANNER, &replies), &options()).expect("a stage");
            assert_eq!(stage.identity().firmware, "1.1h.20190830", "{wrong:?}");
            assert_eq!(stage.limits().travel_m, [[-0.2, 0.0], [-0.05, 0.0]], "{wrong:?}");
        }
        let refused = Script::new(BANNER, &[("$I\n", "error:1\r\n"), ("$I\n", "error:1\r\n")]);
        let error = connect_through(refused, &options()).err().expect("refused twice");
        assert!(matches!(error, DriverError::Device(DeviceError::Refused { .. })), "{error}");
        let without = Script::new(BANNER, &[("$I\n", BUILD), ("$$\n", lost), ("$$\n", lost)]);
        let error = connect_through(without, &options()).err().expect("no pull-off");
        assert!(matches!(error, DriverError::GrblSetting { setting: 27, value: None, .. }), "{error}");
    }

    /// A build with a line of its own that nobody understands is one all the same.
    #[test]
    fn what_came_twice_alike_is_believed() {
        let own = "{own}\r\n[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n";
        let replies = [("$I\n", own), ("$I\n", own), ("$$\n", SETTINGS), ("?", IDLE)];
        connect_through(Script::new(BANNER, &replies), &options()).expect("a stage");
    }

    /// A controller whose connection was lost while it was stopped.
    #[test]
    fn a_stop_outlives_the_program_that_made_it() {
        for (dialect, status, latched) in [
            (Dialect::Classic, "<Door:0|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>\r\n", true),
            (Dialect::Classic, "<Hold:0|MPos:0.000,0.000,0.000|FS:0,0>\r\n", true),
            (Dialect::Classic, IDLE, false),
            (Dialect::Classic, "<Alarm|MPos:0.000,0.000,0.000|FS:0,0>\r\n", false),
            (Dialect::Hal, "<Jog|MPos:0.000,0.000,0.000|FS:0,0>\r\n", true),
        ] {
            let (banner, build) = match dialect {
                Dialect::Classic => (BANNER, BUILD),
                Dialect::Hal => (
                    "\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n",
                    "[VER:1.1f.20260817:]\r\n[OPT:VNMSL,100,1024,3,0]\r\n[AXS:3:XYZ]\r\nok\r\n",
                ),
            };
            // Suspended, it reads no line.
            let mut replies =
                vec![("?", status), ("$I\n", ""), ("\x18", banner), ("$I\n", build), ("$$\n", SETTINGS)];
            if latched {
                // The door byte.
                replies.push(("", ""));
            }
            // Where it stands; cleared; and its reports from then on.
            replies.extend([("", IDLE), ("\x18", banner), ("", IDLE), ("", IDLE)]);
            let script = Script::new("", &replies);
            let told = script.told.clone();
            let mut stage = connect_through(script, &options()).expect("a stage");
            let motion = Motion { target_m: [0.0; AXES], speed_m_s: 0.001, acceleration_m_s2: 0.001 };
            let refused = stage.move_to(motion);
            let stopped = matches!(refused, Err(DeviceError::Fault { code: 0, .. }));
            assert_eq!(stopped, latched, "{status}: {refused:?}");
            assert_eq!(told.lock().expect("no panic").contains(&command::SAFETY_DOOR), latched);
            if latched {
                stage.clear().expect("cleared");
                let report = stage.report(HostTime::now() + Duration::from_secs(5)).expect("no failure");
                assert_eq!(report.expect("a report").state, StageState::Idle);
            }
        }
    }

    /// What is believed of it may be wrong: the byte does nothing to one that stands.
    #[test]
    fn a_stage_that_stands_is_stopped_all_the_same() {
        let script = Script::new(BANNER, &[("$I\n", BUILD), ("$$\n", SETTINGS), ("?", IDLE)]);
        let told = script.told.clone();
        let mut stage = connect_through(script, &options()).expect("a stage");
        stage.stop().expect("a stop");
        assert_eq!(told.lock().expect("no panic").last(), Some(&command::JOG_CANCEL));
    }

    /// Whether the jog that was sent over a port that failed runs, nobody knows.
    #[test]
    fn a_motion_over_a_port_that_failed_counts_as_one() {
        let at = "<Idle|MPos:-1.000,0.000,-1.000|FS:0,0>\r\n";
        let home = "<Home|MPos:0.000,0.000,0.000|FS:0,0>\r\nok\r\n";
        let mut script = Script::new(
            BANNER,
            &[("$I\n", BUILD), ("$$\n", SETTINGS), ("?", IDLE), ("$H\n", ""), ("?", home), ("?", at)],
        );
        script.fails = true;
        let mut stage = connect_through(script, &options()).expect("a stage");
        stage.home().expect("homing starts");
        while !stage.report(HostTime::now() + Duration::from_secs(5)).expect("reports").expect("one").homed {}
        let motion = Motion { target_m: [-0.01; AXES], speed_m_s: 0.001, acceleration_m_s2: 0.001 };
        let error = stage.move_to(motion).expect_err("the port failed");
        assert!(matches!(error, DeviceError::Lost { .. }), "{error}");
        let refused = stage.move_to(motion).expect_err("it may be moving");
        assert!(refused.to_string().contains("it is moving"), "{refused}");
    }

    #[test]
    fn lines_without_end_that_are_no_reports_hold_up_nobody() {
        let mut script = Script::new(BANNER, &[("$I\n", BUILD), ("$$\n", SETTINGS), ("?", IDLE)]);
        script.chatter = "[MSG:Pgm End]\r\n";
        let options = GrblOptions { silence: Duration::from_millis(300), ..options() };
        let mut stage = connect_through(script, &options).expect("a stage");
        let began = HostTime::now();
        let none = stage.report(began + Duration::from_millis(20)).expect("not silent for long");
        assert_eq!(none, None);
        let error = stage.report(began + Duration::from_secs(600)).expect_err("no report came");
        assert!(matches!(error, DeviceError::Silent { .. }), "{error}");
        assert!(HostTime::now().since(began) < Duration::from_secs(60));
        let mut noisy = Script::new("", &[]);
        noisy.chatter = "\r\n";
        let error = connect_through(noisy, &options).err().expect("nobody's banner");
        assert!(matches!(error, DriverError::Device(_)), "{error}");
    }

    #[test]
    fn another_version_is_refused() {
        let script = Script::new("\r\nGrbl 0.9j ['$' for help]\r\n", &[("$I\n", BUILD)]);
        let error = connect_through(script, &options()).err().expect("too old");
        assert!(matches!(error, DriverError::GrblVersion { .. }), "{error}");
    }
}
