//! Numbered image files in place of a camera: which there are, when each was taken, and one after the other through OpenCV.
//!
//! OpenCV's backend for image files reads on from the file that it is opened with until a number is missing or a file is none; it is then
//! opened anew where the files go on. Its own times and rates are made up, so that those of a table are taken.

use super::super::DriverError;
use super::ImageFiles;
use super::backend::Backend;
use super::capture::{Capture, Opened};
use super::feed::{Feed, Grab, Stamp};
use super::times::{self, Taken};
use crate::clock::HostTime;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How the files of one stream are called.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Names {
    folder: PathBuf,
    prefix: String,
    /// Digits, at least; shorter numbers have zeros in front.
    digits: usize,
    suffix: String,
}

impl Names {
    fn new(pattern: &Path) -> Result<Self, DriverError> {
        let refused = |problem| DriverError::VideoPattern { pattern: pattern.into(), problem };
        let text = pattern.to_str().ok_or_else(|| refused("is no UTF-8"))?;
        let (folder, name) = text.rsplit_once('/').unwrap_or((".", text));
        let (prefix, rest) = name.split_once('%').ok_or_else(|| refused("has no number, such as %05d"))?;
        let (digits, suffix) = rest.split_once('d').ok_or_else(|| refused("has no number, such as %05d"))?;
        let digits =
            match digits.strip_prefix('0').unwrap_or(digits) {
                "" if digits.is_empty() => 1,
                count => count.parse().ok().filter(|count| (1..=9).contains(count)).ok_or_else(|| {
                    refused("has a number of no or more than nine digits; %05d is one of five")
                })?,
            };
        if folder.contains('%') || suffix.contains('%') {
            return Err(refused("has more than one %"));
        }
        let numeric = |c: char| c.is_ascii_digit();
        if prefix.contains(numeric) || suffix.starts_with(numeric) {
            return Err(refused("has other digits before the number or beside it: OpenCV would take those"));
        }
        let folder = if folder.is_empty() { "/" } else { folder };
        Ok(Self { folder: folder.into(), prefix: prefix.into(), digits, suffix: suffix.into() })
    }

    fn name(&self, number: u32) -> String {
        format!("{}{number:0width$}{}", self.prefix, self.suffix, width = self.digits)
    }

    fn path(&self, number: u32) -> PathBuf {
        self.folder.join(self.name(number))
    }

    /// The numbers of the files that there are, rising.
    fn numbers(&self) -> std::io::Result<Vec<u32>> {
        let mut numbers = Vec::new();
        for entry in std::fs::read_dir(&self.folder)? {
            let name = entry?.file_name();
            let number = name
                .to_str()
                .and_then(|name| name.strip_prefix(&self.prefix)?.strip_suffix(&self.suffix)?.parse().ok());
            numbers.extend(number.filter(|&number: &u32| name.to_str() == Some(&self.name(number))));
        }
        numbers.sort_unstable();
        Ok(numbers)
    }
}

/// The image files of one stream, with their times.
pub(super) struct Recording {
    names: Names,
    backend: Backend,
    /// Files that are there.
    taken: Vec<Taken>,
    /// First and last number by the table of times.
    span: [u32; 2],
    /// Which comes next.
    at: usize,
    capture: Option<Capture>,
    /// What the capture reads next.
    next: u32,
    lost: u64,
    origin: HostTime,
    /// What of the table's time is at the origin (s).
    zero_s: f64,
}

impl Recording {
    /// Finds the files and reads their times. No picture is read.
    ///
    /// # Errors
    /// [`DriverError`]: a pattern that OpenCV would misread, no file, a file without a time, anything wrong with the table.
    pub(super) fn new(files: &ImageFiles, backend: Backend) -> Result<Self, DriverError> {
        let names = Names::new(&files.pattern)?;
        let rows = times::read(&files.times)?;
        let there = names
            .numbers()
            .map_err(|source| DriverError::VideoFolder { folder: names.folder.clone(), source })?;
        let row = |number: &u32| rows.binary_search_by_key(number, |row| row.frame);
        if let Some(untimed) = there.iter().find(|number| row(number).is_err()) {
            let (file, times) = (names.path(*untimed), files.times.clone());
            return Err(DriverError::VideoUntimed { file, times });
        }
        let taken: Vec<Taken> = there.iter().filter_map(|number| Some(rows[row(number).ok()?])).collect();
        let (Some(first), Some(last), Some(zero)) = (rows.first(), rows.last(), taken.first()) else {
            return Err(DriverError::VideoNoFiles { pattern: files.pattern.clone() });
        };
        Ok(Self {
            span: [first.frame, last.frame],
            zero_s: zero.time_s,
            names,
            backend,
            taken,
            at: 0,
            capture: None,
            next: 0,
            lost: 0,
            origin: HostTime::from_nanos(0),
        })
    }

    /// When its first picture was taken, by the table (s).
    pub(super) fn first_s(&self) -> f64 {
        self.taken[0].time_s
    }

    /// Has the clock begin at this time of the table (s).
    pub(super) fn set_zero(&mut self, zero_s: f64) {
        self.zero_s = zero_s;
    }

    /// Begins anew: the clock's zero is at `origin`.
    pub(super) fn rewind(&mut self, origin: HostTime) {
        (self.at, self.capture, self.lost, self.origin) = (0, None, 0, origin);
    }

    /// The capture, with that file's picture grabbed.
    fn grabbed(&mut self, number: u32) -> Option<Capture> {
        let reading = self.capture.take().filter(|_| self.next == number);
        let opened = reading
            .or_else(|| Capture::open(self.backend, &Opened::Path(&self.names.path(number)), &[]).ok());
        opened.and_then(|mut capture| capture.grab().unwrap_or(false).then_some(capture))
    }
}

impl Feed for Recording {
    fn grab(&mut self) -> Grab {
        let expected = self.at.checked_sub(1).map_or(self.span[0], |before| self.taken[before].frame + 1);
        let Some(&Taken { frame, time_s }) = self.taken.get(self.at) else {
            self.lost += u64::from((self.span[1] + 1).saturating_sub(expected));
            return Grab::Over;
        };
        self.lost += u64::from(frame - expected);
        self.at += 1;
        self.capture = self.grabbed(frame);
        self.next = frame + 1;
        if self.capture.is_none() {
            return Grab::Unreadable(self.names.path(frame).display().to_string());
        }
        let since = Duration::from_secs_f64((time_s - self.zero_s).clamp(0.0, 1e9));
        Grab::Picture(Stamp { host: self.origin + since, number: frame, device_s: Some(time_s), time_s })
    }

    fn capture(&mut self) -> Option<&mut Capture> {
        self.capture.as_mut()
    }

    fn take_lost(&mut self) -> u64 {
        std::mem::take(&mut self.lost)
    }

    fn description(&self) -> String {
        format!("{} image files over {:.1} s", self.taken.len(), {
            self.taken[self.taken.len() - 1].time_s - self.taken[0].time_s
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_that_would_be_misread_are_refused() {
        let names = Names::new(Path::new("/data/2026/grey_%05d.png")).expect("a pattern");
        assert_eq!(names.path(42), Path::new("/data/2026/grey_00042.png"));
        assert_eq!(Names::new(Path::new("f%d.png")).expect("a pattern").path(7), Path::new("./f7.png"));
        assert_eq!(Names::new(Path::new("/%3d.tif")).expect("a pattern").path(7), Path::new("/007.tif"));
        for bad in [
            "grey.png",
            "cam2_%05d.png",
            "g_%05d2.png",
            "g_%05d_%d.png",
            "a%b/g_%05d.png",
            "g_%05x.png",
            "g_%15d",
        ] {
            let error = Names::new(Path::new(bad)).expect_err(bad);
            assert!(matches!(error, DriverError::VideoPattern { .. }), "{bad}: {error}");
        }
    }
}
