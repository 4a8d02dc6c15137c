//! Words, lines and binary numbers from bytes, one after the other, with the place for messages.

use super::super::text::line_of;
use super::{MeshFileError, Place};
use std::str::FromStr;

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// Words separated by blanks and line ends.
    Ascii,
    /// Machine numbers, little endian.
    LittleEndian,
    /// Machine numbers, big endian.
    BigEndian,
}

/// A place in a file that moves forward.
#[derive(Debug, Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Name of the section being read, for messages.
    pub(super) section: String,
    /// How the numbers of this file are written.
    pub(super) encoding: Encoding,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, section: "the header".to_owned(), encoding: Encoding::Ascii }
    }

    /// Bytes not read yet.
    pub(super) fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// Where the cursor is.
    pub(super) fn place(&self) -> Place {
        if self.encoding == Encoding::Ascii {
            Place::Line(line_of(self.bytes, self.at))
        } else {
            Place::Byte(self.at)
        }
    }

    pub(super) fn truncated(&self, expected: &'static str) -> MeshFileError {
        MeshFileError::Truncated { at: self.place(), section: self.section.clone(), expected }
    }

    pub(super) fn unexpected(&self, found: impl Into<String>, expected: impl Into<String>) -> MeshFileError {
        MeshFileError::Unexpected {
            at: self.place(),
            section: self.section.clone(),
            found: found.into(),
            expected: expected.into(),
        }
    }

    /// Goes to the next byte that is not a blank or a line end.
    pub(super) fn skip_blanks(&mut self) {
        self.at += self.bytes[self.at..].iter().take_while(|b| b.is_ascii_whitespace()).count();
    }

    /// The next word; `None` at the end.
    pub(super) fn word(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        self.at += length;
        (length > 0).then_some(&rest[..length])
    }

    /// The next word as text.
    pub(super) fn text(&mut self, expected: &'static str) -> Result<&'a str, MeshFileError> {
        let word = self.word().ok_or_else(|| self.truncated(expected))?;
        std::str::from_utf8(word).map_err(|_| self.unexpected(String::from_utf8_lossy(word), expected))
    }

    /// The next word as a number, however the numbers of this file are written.
    pub(super) fn parsed<T: FromStr>(&mut self, expected: &'static str) -> Result<T, MeshFileError> {
        let text = self.text(expected)?;
        text.parse().map_err(|_| self.unexpected(text, expected))
    }

    /// The rest of the line without its end, and goes behind it; `None` at the end of the file.
    pub(super) fn line(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return None;
        }
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        Some(rest[..length].trim_ascii())
    }

    /// The next `N` bytes.
    pub(super) fn take<const N: usize>(&mut self, expected: &'static str) -> Result<[u8; N], MeshFileError> {
        let bytes = self.bytes[self.at..].first_chunk().ok_or_else(|| self.truncated(expected))?;
        self.at += N;
        Ok(*bytes)
    }

    /// The next `count` bytes.
    pub(super) fn slice(&mut self, count: usize, expected: &'static str) -> Result<&'a [u8], MeshFileError> {
        let bytes = self.bytes[self.at..].get(..count).ok_or_else(|| self.truncated(expected))?;
        self.at += count;
        Ok(bytes)
    }

    /// Goes behind the next occurrence of `mark`.
    pub(super) fn skip_past(&mut self, mark: &str) -> Result<(), MeshFileError> {
        let rest = &self.bytes[self.at..];
        let found = rest.windows(mark.len().max(1)).position(|w| w == mark.as_bytes());
        let Some(found) = found else {
            self.at = self.bytes.len();
            return Err(self.truncated("the end of the section"));
        };
        self.at += found + mark.len();
        Ok(())
    }

    /// Refuses a count of things, at least `bytes_each` bytes long, that the rest of the file can't hold. What
    /// passes may be allocated.
    pub(super) fn fits(&self, count: u64, bytes_each: usize) -> Result<usize, MeshFileError> {
        usize::try_from(count)
            .ok()
            .filter(|c| c.checked_mul(bytes_each.max(1)).is_some_and(|b| b <= self.remaining()))
            .ok_or_else(|| self.truncated("as many entries as the section announces"))
    }

    /// A signed 32-bit number.
    pub(super) fn int(&mut self, expected: &'static str) -> Result<i64, MeshFileError> {
        match self.encoding {
            Encoding::Ascii => self.parsed(expected),
            Encoding::LittleEndian => Ok(i32::from_le_bytes(self.take(expected)?).into()),
            Encoding::BigEndian => Ok(i32::from_be_bytes(self.take(expected)?).into()),
        }
    }

    /// An unsigned 64-bit number.
    pub(super) fn size(&mut self, expected: &'static str) -> Result<u64, MeshFileError> {
        match self.encoding {
            Encoding::Ascii => self.parsed(expected),
            Encoding::LittleEndian => Ok(u64::from_le_bytes(self.take(expected)?)),
            Encoding::BigEndian => Ok(u64::from_be_bytes(self.take(expected)?)),
        }
    }

    /// A double.
    pub(super) fn double(&mut self, expected: &'static str) -> Result<f64, MeshFileError> {
        match self.encoding {
            Encoding::Ascii => self.parsed(expected),
            Encoding::LittleEndian => Ok(f64::from_le_bytes(self.take(expected)?)),
            Encoding::BigEndian => Ok(f64::from_be_bytes(self.take(expected)?)),
        }
    }
}
