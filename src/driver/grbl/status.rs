//! What a status report of Grbl says: `<Jog|MPos:-3.000,0.000,-1.250|FS:300,0|WCO:0.000,0.000,0.000>`.
//!
//! Bytes → meaning. State and position are in every report, anything else in some; fields that nobody here needs are skipped, but
//! one that is no `Name:values` makes the whole report nonsense. Positions are in the controller's unit (mm, since reports in
//! inches are refused), in the order of its axes.
//!
//! Source: gnea/grbl, doc/markdown/interface.md, «Real-time Status Reports»; grblHAL adds fields and sub-states.

/// The word that a report opens with, with its sub-state where one matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Word {
    Idle,
    Run,
    Jog,
    Home,
    /// Feed hold; whether it has come to rest.
    Hold {
        at_rest: bool,
    },
    /// Safety door; whether it has come to rest.
    Door {
        at_rest: bool,
    },
    /// Alarm, with its code where the controller tells.
    Alarm(Option<u8>),
    /// Check, Sleep, Tool: states that this driver never asks for.
    Other,
}

/// Which of the two positions a report gives.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Position {
    /// Machine coordinates.
    Machine(Vec<f64>),
    /// Work coordinates: machine minus offset.
    Work(Vec<f64>),
}

/// One report.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Status {
    pub(super) word: Word,
    pub(super) position: Position,
    /// Work coordinate offset, now and then.
    pub(super) offset: Option<Vec<f64>>,
    /// Whether all axes have homed; grblHAL, now and then.
    pub(super) homed: Option<bool>,
}

impl Status {
    /// From the text between the chevrons; `None` when it is no report.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let mut fields = text.split('|');
        let word = word(fields.next()?)?;
        let (mut position, mut offset, mut homed) = (None, None, None);
        for field in fields {
            let (name, values) = field.split_once(':')?;
            match name {
                "MPos" if position.is_none() => position = Some(Position::Machine(numbers(values)?)),
                "WPos" if position.is_none() => position = Some(Position::Work(numbers(values)?)),
                "MPos" | "WPos" => return None,
                "WCO" => offset = Some(numbers(values)?),
                "H" => homed = Some(values.split(',').next()? == "1"),
                _ if !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric()) => {}
                _ => return None,
            }
        }
        Some(Self { word, position: position?, offset, homed })
    }

    /// Machine coordinates, by an offset told earlier where this report has none. `None` while it is not known.
    pub(super) fn machine(&self, known_offset: Option<&[f64]>) -> Option<Vec<f64>> {
        match &self.position {
            Position::Machine(position) => Some(position.clone()),
            Position::Work(position) => {
                let offset = self.offset.as_deref().or(known_offset)?;
                (offset.len() == position.len())
                    .then(|| position.iter().zip(offset).map(|(p, o)| p + o).collect())
            }
        }
    }
}

fn word(text: &str) -> Option<Word> {
    let (word, sub) = match text.split_once(':') {
        Some((word, sub)) => (word, Some(sub.parse::<u8>().ok()?)),
        None => (text, None),
    };
    Some(match word {
        "Idle" => Word::Idle,
        "Run" => Word::Run,
        "Jog" => Word::Jog,
        "Home" => Word::Home,
        // Hold:1 is still decelerating; Door:2 retracts and Door:3 resumes.
        "Hold" => Word::Hold { at_rest: sub == Some(0) },
        "Door" => Word::Door { at_rest: matches!(sub, Some(0 | 1)) },
        "Alarm" => Word::Alarm(sub),
        "Check" | "Sleep" | "Tool" => Word::Other,
        _ => return None,
    })
}

/// Numbers separated by commas.
pub(super) fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(number).collect()
}

/// A number as Grbl prints it: sign, digits, point, digits. No exponents, no infinities.
pub(super) fn number(text: &str) -> Option<f64> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let plain = digits.starts_with(|c: char| c.is_ascii_digit())
        && digits.bytes().all(|b| b.is_ascii_digit() || b == b'.')
        && digits.len() <= 16;
    if plain { text.parse().ok() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Status {
        Status::parse(text).unwrap_or_else(|| panic!("{text} is a report"))
    }

    /// Examples of the documentation, and reports as Grbl 1.1h and grblHAL 1.1f give them.
    #[test]
    fn published_reports_are_read() {
        let idle = parse("Idle|MPos:0.000,-10.000,5.000|FS:0.0,0");
        assert_eq!(idle.word, Word::Idle);
        assert_eq!(idle.machine(None), Some(vec![0.0, -10.0, 5.0]));
        let jog = parse("Jog|MPos:-0.060,0.000,0.000|FS:18,0|Pn:PXYZRHS");
        assert_eq!(jog.word, Word::Jog);
        let hal = parse("Idle|MPos:0.000,0.000,0.000|Bf:100,1023|FS:0,0|Ov:100,100,100|A:|TLR:0|H:1,7");
        assert_eq!(hal.homed, Some(true));
        assert_eq!(parse("Alarm:11|MPos:0.000,0.000,0.000|H:0").homed, Some(false));
        assert_eq!(parse("Alarm:1|MPos:0.000,0.000,0.000").word, Word::Alarm(Some(1)));
        assert_eq!(parse("Hold:0|MPos:0.000,0.000,0.000").word, Word::Hold { at_rest: true });
        assert_eq!(parse("Hold:1|MPos:0.000,0.000,0.000").word, Word::Hold { at_rest: false });
        assert_eq!(parse("Door:2|MPos:0.000,0.000,0.000").word, Word::Door { at_rest: false });
    }

    /// MPos = WPos + WCO, with the offset of this report or the last one told.
    #[test]
    fn machine_position_follows_from_work_position_and_offset() {
        let with = parse("Idle|WPos:-2.500,0.000,11.000|FS:0,0|WCO:0.000,1.551,5.664");
        assert_eq!(with.machine(None), Some(vec![-2.5, 1.551, 16.664]));
        let without = parse("Idle|WPos:1.000,2.000,3.000|FS:0,0");
        assert_eq!(without.machine(None), None);
        assert_eq!(without.machine(with.offset.as_deref()), Some(vec![1.0, 3.551, 8.664]));
        assert_eq!(without.machine(Some(&[1.0])), None);
    }

    #[test]
    fn what_is_no_report_is_refused() {
        for text in [
            "",
            "Idle",
            "Idle|FS:0,0",
            "Idle|MPos:0.000,,0.000|FS:0,0",
            "Idle|MPos:0.0a0,0.000,0.000|FS:0,0",
            "Idle|MPos:0.000,0.000,0.000|FS0,0",
            "Idle|MPos:nan,0.000,0.000",
            "Idle|MPos:1e3,0.000,0.000",
            "Idle|MPos:0.000,0.000,0.000MPos:0.000,0.000,0.000",
            "Idle|MPos:0.000,0.000,0.000|MPos:0.000,0.000,0.000",
            "Idlo|MPos:0.000,0.000,0.000",
            "Hold:x|MPos:0.000,0.000,0.000",
            "Idle|MPos:1.2.3,0.000,0.000",
        ] {
            assert_eq!(Status::parse(text), None, "{text}");
        }
    }
}
