//! What a jog asks for: the words of `$J=…`, as they stand on the line.
//!
//! Source: gnea/grbl, doc/markdown/jogging.md. Errors are the published codes.

use super::setup::{CONTROLLER_AXES, LETTERS};

const MM_PER_INCH: f64 = 25.4;

/// A jog as it was asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Jog {
    /// Value of each axis word (mm).
    pub(super) axes_mm: [Option<f64>; CONTROLLER_AXES],
    pub(super) feed_mm_min: f64,
    /// `G91`: relative to where the motion before ends.
    pub(super) relative: bool,
    /// `G53`: machine coordinates.
    pub(super) machine: bool,
}

/// Reads the text after `$J=`, which has no spaces. An error is Grbl's code for it.
pub(super) fn jog(text: &str) -> Result<Jog, u8> {
    let (mut axes, mut feed) = ([None; CONTROLLER_AXES], None);
    let (mut relative, mut machine, mut inches) = (false, false, false);
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return Err(1);
        }
        let digits = rest[1..].find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c)));
        let (number, after) = rest[1..].split_at(digits.unwrap_or(rest.len() - 1));
        let value: f64 = number.parse().map_err(|_| 2)?;
        rest = after;
        match letter {
            'G' => match value {
                20.0 => inches = true,
                21.0 => inches = false,
                53.0 => machine = true,
                90.0 => relative = false,
                91.0 => relative = true,
                _ => return Err(16),
            },
            'F' if value < 0.0 => return Err(4),
            'F' => feed = Some(value),
            'N' => {}
            _ => {
                let axis = LETTERS.iter().position(|l| *l == letter).ok_or(16)?;
                if axes[axis].replace(value).is_some() {
                    return Err(25);
                }
            }
        }
    }
    let feed = feed.filter(|feed| *feed > 0.0).ok_or(22)?;
    if axes == [None; CONTROLLER_AXES] {
        return Err(26);
    }
    let scale = if inches { MM_PER_INCH } else { 1.0 };
    Ok(Jog {
        axes_mm: axes.map(|axis| axis.map(|value| value * scale)),
        feed_mm_min: feed * scale,
        relative,
        machine,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Examples of the documentation, without their spaces.
    #[test]
    fn published_jogs_are_read() {
        let first = jog("X10.0Y-1.5F100").expect("a jog");
        assert_eq!((first.axes_mm, first.feed_mm_min), ([Some(10.0), Some(-1.5), None], 100.0));
        let second = jog("G91G20X0.5F10").expect("a jog");
        assert!(second.relative && (second.axes_mm[0].expect("X") - 12.7).abs() < 1e-12);
        assert!(jog("G53Y5.0F100").expect("a jog").machine);
    }

    #[test]
    fn what_is_no_jog_has_its_published_error() {
        for (text, code) in [
            ("X10", 22),
            ("F100", 26),
            ("X1M3F100", 16),
            ("X1G2F9", 16),
            ("X--1F9", 2),
            ("10F9", 1),
            ("X1X2F9", 25),
        ] {
            assert_eq!(jog(text), Err(code), "{text}");
        }
    }
}
