//! Which day is it? Asked where a calibration is made or may have expired.

use crate::calib::{Day, NoDay};
use crate::session::utc_text;
use std::time::SystemTime;

/// Today (UTC).
pub(super) fn today() -> Result<Day, NoDay> {
    Day::of_time(&utc_text(SystemTime::now()))
}
