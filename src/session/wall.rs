//! What the wall clock says, as text: UTC by RFC 3339, to the microsecond.

use std::time::{SystemTime, UNIX_EPOCH};

const DAY_S: u64 = 86_400;

/// `2026-11-22T15:57:03.250000Z`. Before 1970 it says 1970.
pub fn utc_text(time: SystemTime) -> String {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    let (year, month, day) = civil(since.as_secs() / DAY_S);
    let second = since.as_secs() % DAY_S;
    format!(
        "{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}.{:06}Z",
        second / 3600,
        second / 60 % 60,
        second % 60,
        since.subsec_micros()
    )
}

/// Seconds since 1970 of a time that [`utc_text`] wrote; none where it is not one.
pub fn utc_seconds(text: &str) -> Option<f64> {
    let (date, time) = text.strip_suffix('Z')?.split_once('T')?;
    let [year, month, day] = numbers(date.split('-'))?;
    let (clock, fraction) = time.split_once('.')?;
    let [hour, minute, second] = numbers(clock.split(':'))?;
    let micros: u32 = fraction.parse().ok().filter(|_| fraction.len() == 6)?;
    // The date is found among the days: there is one way to count them.
    let near = year.checked_sub(1970)? * 365;
    let days = (near..near + year).find(|&d| civil(d) == (year, month, day))?;
    let whole = days * DAY_S + hour * 3600 + minute * 60 + second;
    Some(whole as f64 + f64::from(micros) * 1e-6)
}

fn numbers<'a, const N: usize>(parts: impl Iterator<Item = &'a str>) -> Option<[u64; N]> {
    let values: Option<Vec<u64>> = parts.map(|part| part.parse().ok()).collect();
    values?.try_into().ok()
}

/// Identity of the machine's run since it was started, on which monotonic clocks count; empty where the system tells none.
pub fn boot() -> String {
    let text = std::fs::read_to_string("/proc/sys/kernel/random/boot_id");
    text.map(|id| id.trim().to_owned()).unwrap_or_default()
}

/// Year, month and day of the Gregorian calendar, so many days after 1970-01-01.
fn civil(mut days: u64) -> (u64, u64, u64) {
    let is_leap =
        |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let mut year = 1970;
    while days >= 365 + u64::from(is_leap(year)) {
        days -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(is_leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while days >= lengths[month] {
        days -= lengths[month];
        month += 1;
    }
    (year, month as u64 + 1, days + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// By `date -u -d @seconds`.
    #[test]
    fn known_instants() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00.000000Z"),
            (951_827_696, "2000-02-29T12:34:56.000000Z"),
            (1_735_689_599, "2024-12-31T23:59:59.000000Z"),
            (4_107_542_400, "2100-03-01T00:00:00.000000Z"),
        ] {
            assert_eq!(utc_text(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
        for micros in [0_u64, 951_827_696_250_000, 1_735_689_599_999_999, 4_107_542_400_000_001] {
            let text = utc_text(UNIX_EPOCH + Duration::from_micros(micros));
            let seconds = utc_seconds(&text).expect("a time");
            assert!((seconds - micros as f64 * 1e-6).abs() < 1e-6, "{text}: {seconds}");
        }
        for wrong in ["", "2000-02-30T00:00:00.000000Z", "2000-02-29 12:34:56Z", "2000-02-29T12:34:56.25Z"] {
            assert_eq!(utc_seconds(wrong), None, "{wrong}");
        }
        assert_eq!(&utc_text(UNIX_EPOCH + Duration::from_micros(1_000_250))[17..], "01.000250Z");
    }
}
