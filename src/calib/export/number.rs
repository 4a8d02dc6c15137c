//! Which sign separates decimals, and which thousands? Texts of a table → the style they share, with the cell that shows it.
//!
//! A lone `1,234` may be 1.234 or 1234. Another number may tell: `0,5`, `1234,5` and `1,23` have decimals after the comma, `1,234.5`
//! and `1,234,567` thousands before it. Where none does, nothing is guessed.

/// How a table writes its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NumberStyle {
    /// Sign before decimals.
    pub decimal: char,
    /// Sign between thousands, besides blanks and apostrophes, which are always taken for such.
    pub thousands: Option<char>,
}

/// What a text says of the two signs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hint {
    /// The sign separates decimals; the other one, if given, thousands.
    Decimal(char, Option<char>),
    /// The sign separates thousands.
    Thousands(char),
    /// The sign separates either.
    Either(char),
    /// No sign at all.
    Whole,
}

/// Texts that stand for a value that was not measured.
const ABSENT: [&str; 9] = ["", "nan", "n/a", "na", "#n/a", "-", "--", "---", "null"];

/// Whether the cell holds no value.
pub(super) fn is_absent(text: &str) -> bool {
    ABSENT.contains(&text.trim().to_lowercase().as_str())
}

/// What stands around the digits: sign, mantissa, exponent.
fn parts(text: &str) -> Option<(bool, &str, Option<&str>)> {
    let text = text.trim();
    let (negative, rest) = match text.strip_prefix(['-', '−', '–']) {
        Some(rest) => (true, rest.trim_start()),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (mantissa, exponent) = match rest.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (rest, None),
    };
    let digits = |t: &str| !t.is_empty() && t.len() < 5 && t.bytes().all(|b| b.is_ascii_digit());
    let sound_exponent = exponent.is_none_or(|e| digits(e.strip_prefix(['+', '-']).unwrap_or(e)));
    let allowed = |c: char| c.is_ascii_digit() || c == '.' || c == ',' || is_blank_group(c);
    let has_digit = mantissa.bytes().any(|b| b.is_ascii_digit());
    (sound_exponent && has_digit && mantissa.chars().all(allowed)).then_some((negative, mantissa, exponent))
}

/// Signs between thousands that can be nothing else.
fn is_blank_group(c: char) -> bool {
    matches!(c, ' ' | '\u{a0}' | '\u{202f}' | '\u{2009}' | '\'' | '’')
}

/// Whether digits are grouped by threes: `1`, `12`, `123` first, then `234` each.
fn grouped(text: &str, sign: impl Fn(char) -> bool) -> bool {
    let digits = |g: &str, least| (least..=3).contains(&g.len()) && g.bytes().all(|b| b.is_ascii_digit());
    let mut groups = text.split(sign);
    let first = groups.next().unwrap_or_default();
    // "00 100" is two numbers.
    let leads = digits(first, 1) && (first.len() == text.len() || !first.starts_with('0'));
    leads && groups.all(|g| digits(g, 3))
}

/// Hours, minutes and seconds, as 0:01:02,5: the seconds of the first two, and the text of the last.
fn clock(text: &str) -> Option<(f64, &str)> {
    let (hours, rest) = text.trim().split_once(':')?;
    let (minutes, seconds) = rest.split_once(':')?;
    let digits = |t: &str, most| (1..=most).contains(&t.len()) && t.bytes().all(|b| b.is_ascii_digit());
    let whole = seconds.split(['.', ',']).next().unwrap_or_default();
    let sound = digits(hours, 4) && digits(minutes, 2) && digits(whole, 2);
    let minutes =
        sound.then(|| Some(60 * hours.parse::<u32>().ok()? + minutes.parse::<u32>().ok()?)).flatten()?;
    Some((60.0 * f64::from(minutes), seconds))
}

/// Whether the text is a time of hours, minutes and seconds.
pub(super) fn is_clock(text: &str) -> bool {
    clock(text).is_some()
}

/// What the text says of the signs; none when it is not a number in any style.
pub(super) fn hint(text: &str) -> Option<Hint> {
    if let Some((_, seconds)) = clock(text) {
        let sign = seconds.chars().find(|c| !c.is_ascii_digit());
        return Some(sign.map_or(Hint::Whole, |sign| Hint::Decimal(sign, None)));
    }
    let (_, mantissa, exponent) = parts(text)?;
    let count = |sign| mantissa.matches(sign).count();
    let whole_part = |sign| mantissa.split(sign).next().unwrap_or_default();
    let sound = |t: &str| t.is_empty() || t.bytes().all(|b| b.is_ascii_digit()) || grouped(t, is_blank_group);
    let hint = match (count('.'), count(',')) {
        (0, 0) => return sound(mantissa).then_some(Hint::Whole),
        (dots, commas) if dots > 0 && commas > 0 => {
            let decimal = if mantissa.rfind('.') > mantissa.rfind(',') { '.' } else { ',' };
            let thousands = if decimal == '.' { ',' } else { '.' };
            let (whole, fraction) = mantissa.rsplit_once(decimal)?;
            let digits = fraction.bytes().all(|b| b.is_ascii_digit());
            return (digits && grouped(whole, |c| c == thousands))
                .then_some(Hint::Decimal(decimal, Some(thousands)));
        }
        (dots, _) => {
            let sign = if dots > 0 { '.' } else { ',' };
            let fraction = mantissa.rsplit(sign).next().unwrap_or_default();
            let whole = whole_part(sign);
            if mantissa.matches(sign).count() > 1 {
                return grouped(mantissa, |c| c == sign).then_some(Hint::Thousands(sign));
            }
            if !sound(whole) || !fraction.bytes().all(|b| b.is_ascii_digit()) {
                return None;
            }
            let plain_group =
                (1..=3).contains(&whole.len()) && !whole.starts_with('0') && fraction.len() == 3;
            if plain_group && exponent.is_none() { Hint::Either(sign) } else { Hint::Decimal(sign, None) }
        }
    };
    Some(hint)
}

/// The number that a text is in a style, seconds for hours, minutes and seconds; infinite where it is too large. None where it is not
/// a number of that style.
pub(super) fn value(text: &str, style: NumberStyle) -> Option<f64> {
    if let Some((minutes, seconds)) = clock(text) {
        return Some(minutes + value(seconds, NumberStyle { thousands: None, ..style })?);
    }
    let (negative, mantissa, exponent) = parts(text)?;
    let (whole, fraction) = match mantissa.split_once(style.decimal) {
        Some((whole, fraction)) => (whole, fraction),
        None => (mantissa, ""),
    };
    let separates = |c: char| is_blank_group(c) || Some(c) == style.thousands;
    let bare = whole.bytes().all(|b| b.is_ascii_digit());
    if !fraction.bytes().all(|b| b.is_ascii_digit()) || !(bare || grouped(whole, separates)) {
        return None;
    }
    let mut digits = String::with_capacity(text.len() + 2);
    digits.extend(negative.then_some('-'));
    digits.extend(whole.chars().filter(char::is_ascii_digit));
    digits.push('.');
    digits.push_str(fraction);
    if let Some(exponent) = exponent {
        digits.push('e');
        digits.push_str(exponent);
    }
    digits.parse().ok()
}

/// Both values of a text whose sign separates either.
pub(super) fn both_values(text: &str, sign: char) -> (f64, f64) {
    let other = if sign == '.' { ',' } else { '.' };
    let with = |decimal, thousands| value(text, NumberStyle { decimal, thousands }).unwrap_or(f64::NAN);
    (with(sign, None), with(other, Some(sign)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_text_says_of_the_signs() {
        for (text, said) in [
            ("0,5", Some(Hint::Decimal(',', None))),
            ("-12.3456", Some(Hint::Decimal('.', None))),
            ("1234,567", Some(Hint::Decimal(',', None))),
            ("0.123", Some(Hint::Decimal('.', None))),
            ("1.234", Some(Hint::Either('.'))),
            ("12,345", Some(Hint::Either(','))),
            ("1.234E-02", Some(Hint::Decimal('.', None))),
            ("1.234,5", Some(Hint::Decimal(',', Some('.')))),
            ("1,234,567.8", Some(Hint::Decimal('.', Some(',')))),
            ("1.234.567", Some(Hint::Thousands('.'))),
            ("1 234,5", Some(Hint::Decimal(',', None))),
            ("1'234.5", Some(Hint::Decimal('.', None))),
            ("17", Some(Hint::Whole)),
            ("−3", Some(Hint::Whole)),
            ("12.03.2024", None),
            ("12:30", None),
            ("1,2,3", None),
            ("0.1,", None),
            ("12 N", None),
            ("1e", None),
            ("", None),
            (".", None),
            ("5 2", None),
            ("00 100", None),
        ] {
            assert_eq!(hint(text), said, "{text:?}");
        }
    }

    #[test]
    fn texts_are_numbers_in_their_style_only() {
        let german = NumberStyle { decimal: ',', thousands: Some('.') };
        let plain = NumberStyle { decimal: '.', thousands: None };
        for (text, style, number) in [
            ("1.234,5", german, Some(1234.5)),
            ("1.23,5", german, None),
            ("−0,5", german, Some(-0.5)),
            ("1.5", german, None),
            ("1.5e-3", plain, Some(1.5e-3)),
            ("1,5", plain, None),
            ("1\u{a0}234.5", plain, Some(1234.5)),
            (".5", plain, Some(0.5)),
            ("5.", plain, Some(5.0)),
            ("+7", plain, Some(7.0)),
        ] {
            assert_eq!(value(text, style), number, "{text:?}");
        }
        assert_eq!(value("1:02:03,5", german), Some(3723.5));
        assert_eq!((hint("0:00:01.5"), is_clock("12:30")), (Some(Hint::Decimal('.', None)), false));
        assert_eq!(both_values("1,234", ','), (1.234, 1234.0));
        assert_eq!(value("1e999", plain), Some(f64::INFINITY));
    }
}
