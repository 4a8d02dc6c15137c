//! A day of the Gregorian calendar as people write it in files: `2026-11-24`.
//!
//! Days of this form sort like the days that they name.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A day, checked: year 1 to 9999, month and day that exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Day {
    year: u16,
    month: u8,
    day: u8,
}

/// A text that names no day.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is no day; expected year-month-day, such as 2026-11-24")]
pub struct NoDay {
    /// The text.
    pub text: String,
}

impl Day {
    /// Reads `2026-11-24`. Of a longer text, such as a time by RFC 3339, take [`Day::of_time`].
    ///
    /// # Errors
    /// [`NoDay`]: another form, or a day that does not exist.
    pub fn parse(text: &str) -> Result<Self, NoDay> {
        let no_day = || NoDay { text: text.to_owned() };
        let digits = |part: &str, count: usize| -> Option<u16> {
            let plain = part.len() == count && part.bytes().all(|b| b.is_ascii_digit());
            part.parse().ok().filter(|_| plain)
        };
        let parts: Vec<&str> = text.split('-').collect();
        let [year, month, day] = parts.as_slice() else { return Err(no_day()) };
        let (Some(year), Some(month), Some(day)) = (digits(year, 4), digits(month, 2), digits(day, 2)) else {
            return Err(no_day());
        };
        let is_leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
        let length = match month {
            4 | 6 | 9 | 11 => 30,
            2 => 28 + u16::from(is_leap),
            1..=12 => 31,
            _ => 0,
        };
        if year == 0 || !(1..=length).contains(&day) {
            return Err(no_day());
        }
        // Both are below 32.
        Ok(Self { year, month: month as u8, day: day as u8 })
    }

    /// The day of a time by RFC 3339, `2026-11-24T07:00:00Z`.
    ///
    /// # Errors
    /// [`NoDay`]: it begins with none.
    pub fn of_time(text: &str) -> Result<Self, NoDay> {
        Self::parse(text.split_once('T').map_or(text, |(day, _)| day))
    }
}

impl fmt::Display for Day {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04}-{:02}-{:02}", self.year, self.month, self.day)
    }
}

impl From<Day> for String {
    fn from(day: Day) -> Self {
        day.to_string()
    }
}

impl TryFrom<String> for Day {
    type Error = NoDay;

    fn try_from(text: String) -> Result<Self, NoDay> {
        Self::parse(&text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_read_and_sorted_and_what_is_none_is_refused() {
        for text in ["2026-11-24", "2000-02-29", "2024-02-29", "0001-01-01", "9999-12-31"] {
            assert_eq!(Day::parse(text).map(|day| day.to_string()).as_deref(), Ok(text));
        }
        let wrong = [
            "",
            "24.11.2026",
            "2026-13-01",
            "2026-02-29",
            "1900-02-29",
            "2026-1-1",
            "2026-11-24T07",
            "+026-11-24",
        ];
        for text in wrong {
            let error = Day::parse(text).expect_err(text);
            assert!(error.to_string().contains("expected year-month-day"), "{error}");
        }
        let day = |text| Day::parse(text).expect("a day");
        assert!(day("2025-12-31") < day("2026-01-01") && day("2026-01-31") < day("2026-02-01"));
        assert_eq!(Day::of_time("2026-11-24T07:00:00Z"), Day::parse("2026-11-24"));
    }
}
