//! In which encoding is a text? Bytes → text, with what shows it.
//!
//! A mark at the beginning or zero bytes between digits show UTF-16, sound sequences UTF-8. What remains is one of the code pages that
//! testing machines write in western Europe, Russia and China: the one that makes known words of headings, and no mixture of scripts
//! within a word. Digits, signs and separators are the same in all of them: a wrong page can spoil a name, never a number.

use super::ExportError;
use super::{quantity, unit};
use encoding_rs::{Encoding, GB18030, UTF_16BE, UTF_16LE, WINDOWS_1251, WINDOWS_1252};
use std::path::Path;

/// A decoded text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Decoded {
    pub(super) text: String,
    pub(super) encoding: &'static str,
    pub(super) why: String,
}

/// How far a text is looked into for known words (bytes).
const SAMPLE: usize = 1 << 16;
/// Share of zero bytes at one parity that only UTF-16 has.
const UTF_16_ZEROS: f64 = 0.3;

/// Decodes a file, by `wish` if that names an encoding.
pub(super) fn decode(file: &Path, bytes: &[u8], wish: Option<&str>) -> Result<Decoded, ExportError> {
    if let Some(label) = wish {
        let encoding = Encoding::for_label(label.as_bytes()).ok_or_else(|| ExportError::Override {
            file: file.to_owned(),
            reason: format!(
                "encoding = {label:?} is not known; some are utf-8, utf-16le, windows-1252, windows-1251, gbk"
            ),
            nearest: None,
        })?;
        return text(file, bytes, encoding, "as asked for".to_owned());
    }
    if let Some((encoding, _)) = Encoding::for_bom(bytes) {
        return text(file, bytes, encoding, "its byte order mark".to_owned());
    }
    if let Some(encoding) = utf_16(bytes) {
        return text(file, bytes, encoding, "every other byte is zero".to_owned());
    }
    if bytes.is_ascii() {
        return text(file, bytes, encoding_rs::UTF_8, "nothing but ASCII".to_owned());
    }
    // A text cut off within a character is still UTF-8.
    if std::str::from_utf8(bytes).err().is_none_or(|e| e.error_len().is_none()) {
        return text(file, bytes, encoding_rs::UTF_8, "every sequence is sound".to_owned());
    }
    let sample = &bytes[..bytes.len().min(SAMPLE)];
    let rated = [WINDOWS_1252, WINDOWS_1251, GB18030].map(|page| (page, Likeness::of(page, sample)));
    let mut best = rated[0];
    for candidate in &rated[1..] {
        if candidate.1.score() > best.1.score() {
            best = *candidate;
        }
    }
    let (page, likeness) = best;
    let why = if likeness.words > 0 {
        format!("{} known words, {} words of mixed script", likeness.words, likeness.mixed)
    } else {
        "not UTF-8, and no known word in any code page; only names depend on it (key encoding)".to_owned()
    };
    text(file, bytes, page, why)
}

/// How much a decoding looks like headings.
#[derive(Debug, Clone, Copy)]
struct Likeness {
    words: usize,
    mixed: usize,
    broken: bool,
}

impl Likeness {
    fn of(page: &'static Encoding, sample: &[u8]) -> Self {
        let (text, broken) = page.decode_without_bom_handling(sample);
        let lower = text.to_lowercase();
        let known =
            quantity::foreign_words().chain(unit::foreign_words()).filter(|w| lower.contains(w)).count();
        Self { words: known, mixed: mixed_words(&text), broken }
    }

    /// A known word outweighs a few odd ones, a broken sequence anything: a sample may end in one, so it counts for little.
    fn score(self) -> i64 {
        10 * self.words as i64 - self.mixed as i64 - i64::from(self.broken)
    }
}

/// Words that mix scripts, or that pile up accented letters as no European language does.
fn mixed_words(text: &str) -> usize {
    let words = text.split(|c: char| !c.is_alphabetic()).filter(|w| !w.is_ascii() && w.chars().count() > 1);
    words.filter(|w| is_mixed(w)).count() + text.chars().filter(|c| ('\u{80}'..'\u{a0}').contains(c)).count()
}

fn is_mixed(word: &str) -> bool {
    let latin = |c: char| c.is_ascii_alphabetic() || ('\u{c0}'..'\u{250}').contains(&c);
    let (western, other) = (word.chars().any(latin), word.chars().any(|c| !latin(c)));
    let accents = word.chars().filter(|c| ('\u{c0}'..'\u{250}').contains(c)).count();
    western && other || accents >= 3 && 2 * accents > word.chars().count()
}

/// UTF-16 without a mark: one byte of each ASCII character is zero.
fn utf_16(bytes: &[u8]) -> Option<&'static Encoding> {
    let sample = &bytes[..bytes.len().min(SAMPLE) & !1];
    let zeros = |parity: usize| sample.iter().skip(parity).step_by(2).filter(|b| **b == 0).count() as f64;
    let pairs = (sample.len() / 2).max(1) as f64;
    match (zeros(0) / pairs, zeros(1) / pairs) {
        (even, odd) if odd > UTF_16_ZEROS && even < 0.1 * odd => Some(UTF_16LE),
        (even, odd) if even > UTF_16_ZEROS && odd < 0.1 * even => Some(UTF_16BE),
        _ => None,
    }
}

fn text(file: &Path, bytes: &[u8], encoding: &'static Encoding, why: String) -> Result<Decoded, ExportError> {
    let (text, _) = encoding.decode_with_bom_removal(bytes);
    if let Some(at) = text.find(|c: char| c < ' ' && !"\t\n\r\u{c}\u{1a}".contains(c)) {
        // The same character is found again in the bytes; in UTF-16 it is one of two.
        let value = text[at..].bytes().next().unwrap_or_default();
        let byte = bytes.iter().position(|b| *b == value).unwrap_or(at);
        return Err(ExportError::NotText { file: file.to_owned(), byte, value });
    }
    Ok(Decoded { text: text.into_owned(), encoding: encoding.name(), why })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Decoded {
        decode(Path::new("a.csv"), bytes, None).expect("a text")
    }

    fn utf_16(text: &str, little: bool) -> Vec<u8> {
        text.encode_utf16().flat_map(|u| if little { u.to_le_bytes() } else { u.to_be_bytes() }).collect()
    }

    const GERMAN: &str = "Prüfzeit;Standardkraft;Längenänderung\ns;N;µm\n0,1;2,5;3\n";
    const RUSSIAN: &str = "Время, с;Нагрузка, кН;Перемещение, мм\n0,1;2,5;3\n";
    const CHINESE: &str = "时间(s),负荷(N),位移(mm)\n0.1,2.5,3\n";

    #[test]
    fn each_encoding_is_known_by_its_words() {
        for (text, page, name) in [
            (GERMAN, WINDOWS_1252, "windows-1252"),
            (RUSSIAN, WINDOWS_1251, "windows-1251"),
            (CHINESE, encoding_rs::GBK, "gb18030"),
        ] {
            let bytes = page.encode(text).0;
            let decoded = read(&bytes);
            assert_eq!((decoded.text.as_str(), decoded.encoding), (text, name), "{}", decoded.why);
            assert_eq!(read(text.as_bytes()).encoding, "UTF-8");
            for little in [true, false] {
                let name = if little { "UTF-16LE" } else { "UTF-16BE" };
                let bare = utf_16(text, little);
                assert_eq!((read(&bare).text.as_str(), read(&bare).encoding), (text, name));
                let marked = utf_16(&format!("\u{feff}{text}"), little);
                assert_eq!((read(&marked).text.as_str(), read(&marked).encoding), (text, name));
            }
        }
        assert_eq!(read("\u{feff}a,b".as_bytes()).text, "a,b");
    }

    #[test]
    fn a_wish_is_followed_and_an_unknown_one_refused() {
        let bytes = WINDOWS_1251.encode(RUSSIAN).0;
        let decoded = decode(Path::new("a.csv"), &bytes, Some("cp1251")).expect("known");
        assert_eq!(decoded.text, RUSSIAN);
        let words = decode(Path::new("a.csv"), &bytes, Some("klingon")).expect_err("unknown").to_string();
        assert!(words.contains("klingon") && words.contains("a.csv"), "{words}");
    }

    #[test]
    fn binary_files_are_refused() {
        let error = decode(Path::new("a.zs2"), b"\x1f\x8b\x08\x00\x00abc\x01", None).expect_err("binary");
        assert!(error.to_string().contains("0x1f"), "{error}");
    }
}
