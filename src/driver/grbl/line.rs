//! What a line of Grbl says, and where lines begin and end in a stream of bytes.
//!
//! Bytes → [`Line`]. Each kind of line can be told without knowing what was asked (gnea/grbl, doc/markdown/interface.md); what fits
//! none of them, an incomplete or a corrupted line, is `None` and for the caller to count. Nothing here panics on any input.

use super::status::{Status, numbers};

/// Longest line that Grbl sends is under 200 bytes; grblHAL's help texts, which nobody here asks for, are longer.
const LONGEST: usize = 512;

/// Which of the two speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dialect {
    /// gnea/grbl and its clones.
    Classic,
    /// grblHAL.
    Hal,
}

/// One line.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Line {
    /// The command was taken.
    Ok,
    /// The command was refused.
    Error(u8),
    /// Something stopped the machine.
    Alarm(u8),
    /// The controller has started anew.
    Banner {
        dialect: Dialect,
        version: String,
    },
    Status(Status),
    /// `$number=value`.
    Setting {
        number: u16,
        value: String,
    },
    /// `[VER:version:…]`.
    Version(String),
    /// `[OPT:letters,…]`: options that it was built with.
    Options(String),
    /// `[AXS:count:letters]`.
    Axes(String),
    /// `[FIRMWARE:name]`.
    Firmware(String),
    /// Another of its lines, which nobody here needs.
    Other,
}

impl Line {
    /// From a line without its end; `None` when it makes no sense.
    pub(super) fn parse(line: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(line).ok()?.trim_end_matches('\r');
        if !text.bytes().all(|b| (b' '..=b'~').contains(&b)) {
            return None;
        }
        if text.is_empty() {
            return Some(Self::Other);
        }
        if text == "ok" {
            return Some(Self::Ok);
        }
        if let Some(code) = text.strip_prefix("error:") {
            return code.parse().ok().map(Self::Error);
        }
        if let Some(code) = text.strip_prefix("ALARM:") {
            return code.parse().ok().map(Self::Alarm);
        }
        if let Some(inner) = text.strip_prefix('<') {
            return Status::parse(inner.strip_suffix('>')?).map(Self::Status);
        }
        if let Some(inner) = text.strip_prefix('[') {
            return bracketed(inner.strip_suffix(']')?);
        }
        if let Some(inner) = text.strip_prefix('$') {
            return setting(inner);
        }
        if text.starts_with('>') {
            // A stored start-up line and how it went.
            return (text.ends_with(":ok") || text.contains(":error:")).then_some(Self::Other);
        }
        banner(text)
    }
}

fn banner(text: &str) -> Option<Line> {
    let (name, rest) = text.split_once(' ')?;
    let dialect = match name {
        "Grbl" => Dialect::Classic,
        "GrblHAL" => Dialect::Hal,
        _ => return None,
    };
    let (version, hint) = rest.split_once(' ')?;
    let whole =
        version.starts_with(|c: char| c.is_ascii_digit()) && hint.starts_with('[') && hint.ends_with(']');
    whole.then(|| Line::Banner { dialect, version: version.to_owned() })
}

fn setting(inner: &str) -> Option<Line> {
    let (name, value) = inner.split_once('=')?;
    if name.starts_with('N') {
        return Some(Line::Other);
    }
    name.parse().ok().map(|number| Line::Setting { number, value: value.to_owned() })
}

fn bracketed(inner: &str) -> Option<Line> {
    let (name, rest) = inner.split_once(':')?;
    Some(match name {
        "VER" => Line::Version(rest.split(':').next()?.to_owned()),
        "OPT" => Line::Options(rest.to_owned()),
        "AXS" => {
            let (count, letters) = rest.split_once(':')?;
            if count.parse() != Ok(letters.len()) {
                return None;
            }
            Line::Axes(letters.to_owned())
        }
        "FIRMWARE" => Line::Firmware(rest.to_owned()),
        "PRB" => {
            let (position, success) = rest.rsplit_once(':')?;
            numbers(position)?;
            if !matches!(success, "0" | "1") {
                return None;
            }
            Line::Other
        }
        _ if name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b' ') => Line::Other,
        _ => return None,
    })
}

/// Cuts a stream of bytes into lines.
#[derive(Debug, Default)]
pub(super) struct Lines {
    partial: Vec<u8>,
    /// The line under way is longer than any that makes sense; its bytes are dropped until its end.
    overlong: bool,
}

impl Lines {
    /// Takes bytes and hands each line that they complete to `take`, without its end; an overlong one as `None`.
    pub(super) fn feed(&mut self, bytes: &[u8], mut take: impl FnMut(Option<&[u8]>)) {
        for &byte in bytes {
            if byte == b'\n' {
                take((!self.overlong).then_some(self.partial.as_slice()));
                self.partial.clear();
                self.overlong = false;
            } else if self.partial.len() < LONGEST {
                self.partial.push(byte);
            } else {
                self.overlong = true;
            }
        }
    }

    /// What has come of a line that is not complete.
    pub(super) fn partial(&self) -> &[u8] {
        &self.partial
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn text(line: &str) -> Option<Line> {
        Line::parse(line.as_bytes())
    }

    /// Lines of the published interface and of both controllers.
    #[test]
    fn published_lines_are_read() {
        let classic = |v: &str| Line::Banner { dialect: Dialect::Classic, version: v.to_owned() };
        let hal = |v: &str| Line::Banner { dialect: Dialect::Hal, version: v.to_owned() };
        let named = str::to_owned;
        for (line, expected) in [
            ("ok", Line::Ok),
            ("ok\r", Line::Ok),
            ("error:15", Line::Error(15)),
            ("ALARM:3", Line::Alarm(3)),
            ("Grbl 1.1h ['$' for help]", classic("1.1h")),
            ("GrblHAL 1.1f ['$' or '$HELP' for help]", hal("1.1f")),
            ("$110=500.000", Line::Setting { number: 110, value: named("500.000") }),
            ("$N0=G54", Line::Other),
            ("[VER:v1.1f.20170131:Some string]", Line::Version(named("v1.1f.20170131"))),
            ("[VER:1.1h.20190830:]", Line::Version(named("1.1h.20190830"))),
            ("[OPT:VL,16,128]", Line::Options(named("VL,16,128"))),
            ("[AXS:3:XYZ]", Line::Axes(named("XYZ"))),
            ("[FIRMWARE:grblHAL]", Line::Firmware(named("grblHAL"))),
            ("[NEWOPT:ENUMS,RT+,TC,SED]", Line::Other),
            ("[DRIVER VERSION:260324]", Line::Other),
            ("[MSG:'$H'|'$X' to unlock]", Line::Other),
            ("[PRB:1.000,-2.500,0.000:1]", Line::Other),
            (">G54G20:ok", Line::Other),
            ("", Line::Other),
        ] {
            assert_eq!(text(line), Some(expected), "{line}");
        }
        assert!(matches!(text("<Idle|MPos:0.000,0.000,0.000|FS:0,0>"), Some(Line::Status(_))));
    }

    #[test]
    fn incomplete_and_corrupted_lines_make_no_sense() {
        for line in [
            "o",
            "okok",
            "error:",
            "error:999",
            "ALARM:-1",
            "Grbl",
            "Grbl 1.1h",
            "Grbl 1.1h ['$' for he",
            "Marlin 2.1.2 [start]",
            "<Idle|MPos:0.000,0.000,0.000|FS:0,0",
            "Idle|MPos:0.000,0.000,0.000|FS:0,0>",
            "[MSG:Reset to continue",
            "[AXS:4:XYZ]",
            "[PRB:1.000,-2.500,0.000]",
            "[PRB:1.000,-2.500,0.000:7]",
            "$110500",
            "$x=1",
            "-1250, 0, 0, 0.000000",
            ">G54",
            "\u{fffd}",
        ] {
            assert_eq!(text(line), None, "{line}");
        }
        assert_eq!(Line::parse(b"ok\xff"), None);
        assert_eq!(Line::parse(b"o\x07k"), None);
    }

    #[test]
    fn lines_are_cut_at_their_ends_however_the_bytes_come() {
        let stream = b"\r\nGrbl 1.1h ['$' for help]\r\nok\r\nerr";
        for chunk in 1..stream.len() {
            let (mut lines, mut got) = (Lines::default(), Vec::new());
            for bytes in stream.chunks(chunk) {
                lines.feed(bytes, |line| got.push(line.and_then(Line::parse)));
            }
            assert_eq!(got.len(), 3);
            assert_eq!(got[2], Some(Line::Ok), "in pieces of {chunk}");
            assert_eq!(lines.partial(), b"err");
        }
    }

    #[test]
    fn a_stream_without_ends_is_bounded_and_recovers() {
        let (mut lines, mut got) = (Lines::default(), Vec::new());
        lines.feed(&[b'x'; 100_000], |line| got.push(line.is_some()));
        assert!(got.is_empty() && lines.partial().len() <= LONGEST);
        lines.feed(b"\nok\n", |line| got.push(line.is_some()));
        assert_eq!(got, [false, true]);
    }

    /// What is read back from a report is what was printed, whatever the numbers.
    #[test]
    fn printed_positions_are_read_back() {
        proptest!(|(x in -9999.0..9999.0_f64, z in -9999.0..9999.0_f64)| {
            let line = format!("<Jog|MPos:{x:.3},0.000,{z:.3}|FS:300,0>");
            let Some(Line::Status(status)) = text(&line) else { panic!("{line} is a report") };
            let position = status.machine(None).expect("machine coordinates");
            prop_assert!((position[0] - x).abs() <= 0.000_500_1 && (position[2] - z).abs() <= 0.000_500_1);
        });
    }

    /// Random bytes, and real lines with bytes changed, cut and joined. `FUZZ_INPUTS` says how many.
    #[test]
    fn no_input_panics() {
        use rand::{RngExt, SeedableRng};
        let seeds: [&[u8]; 9] = [
            b"<Jog|MPos:-0.060,0.000,0.000|Bf:99,1023|FS:18,0|WCO:0.000,1.551,5.664|H:1,7>\r\n",
            b"Grbl 1.1h ['$' for help]\r\n",
            b"GrblHAL 1.1f ['$' or '$HELP' for help]\r\n",
            b"[AXS:3:XYZ]\r\n",
            b"[PRB:1.000,-2.500,0.000:1]\r\n",
            b"$110=500.000\r\n",
            b"ALARM:3\r\n",
            b"error:15\r\n",
            b"ok\r\n",
        ];
        let inputs = std::env::var("FUZZ_INPUTS").ok().and_then(|n| n.parse().ok()).unwrap_or(20_000_u64);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(11);
        let (mut lines, mut read, mut nonsense) = (Lines::default(), 0_u64, 0_u64);
        for _ in 0..inputs {
            let mut bytes = seeds[rng.random_range(0..seeds.len())].to_vec();
            for _ in 0..rng.random_range(0..4) {
                let at = rng.random_range(0..bytes.len());
                match rng.random_range(0..4) {
                    0 => bytes[at] = rng.random(),
                    1 => bytes.truncate(at.max(1)),
                    2 => bytes.insert(at, rng.random_range(b' '..=b'~')),
                    _ => bytes.extend_from_within(at..),
                }
            }
            lines.feed(&bytes, |line| match line.and_then(Line::parse) {
                Some(_) => read += 1,
                None => nonsense += 1,
            });
        }
        assert!(read > inputs / 10 && nonsense > inputs / 10, "{read} read, {nonsense} nonsense");
    }
}
