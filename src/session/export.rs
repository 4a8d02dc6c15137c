//! A session as tables: CSV with the units in a row under the header, the same bytes every time.
//!
//! Force in SI units in the sensor's frame, with the counts beside it; stage, markers and events as they were recorded. Times are those
//! of the host's monotonic clock (ns), of which the start document knows the wall-clock time at one instant.

use super::document::Event;
use super::message::Message;
use super::read::Session;
use super::{SessionError, Topic};
use crate::device::{ForceFormat, ForceRecord, MarkerFrame, StageReport, StageState};
use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

/// Header and units.
type Columns<'a> = &'a [(&'a str, &'a str)];

const FORCE: Columns<'static> = &[
    ("segment", "1"),
    ("host_time", "ns"),
    ("rdt_sequence", "1"),
    ("ft_sequence", "1"),
    ("status", "1"),
    ("fx", "N"),
    ("fy", "N"),
    ("fz", "N"),
    ("tx", "N m"),
    ("ty", "N m"),
    ("tz", "N m"),
    ("fx_counts", "1"),
    ("fy_counts", "1"),
    ("fz_counts", "1"),
    ("tx_counts", "1"),
    ("ty_counts", "1"),
    ("tz_counts", "1"),
];

const STAGE: Columns<'static> = &[
    ("segment", "1"),
    ("host_time", "ns"),
    ("controller_time", "us"),
    ("position_1", "m"),
    ("position_2", "m"),
    ("state", "-"),
    ("fault_code", "1"),
    ("homed", "-"),
];

const MARKERS: Columns<'static> = &[
    ("segment", "1"),
    ("host_time", "ns"),
    ("frame", "1"),
    ("marker", "1"),
    ("x", "m"),
    ("y", "m"),
    ("z", "m"),
];

const EVENTS: Columns<'static> =
    &[("segment", "1"), ("host_time", "ns"), ("event", "-"), ("poke", "1"), ("detail", "JSON")];

impl Session {
    /// Writes `force.csv`, `stage.csv`, `markers.csv` and `events.csv` into `folder`, each if there is anything to write. A session
    /// without a force format has counts only, so that its force columns in N and N·m stay empty.
    ///
    /// # Errors
    /// [`SessionError`]: a file exists already, the session is damaged (recover it first), the operating system refuses.
    pub fn export_csv(&self, folder: &Path) -> Result<Vec<PathBuf>, SessionError> {
        let format = self.start().force.as_ref().map(|force| force.format());
        let tables = [
            (Topic::Force, "force.csv", FORCE),
            (Topic::Stage, "stage.csv", STAGE),
            (Topic::Markers, "markers.csv", MARKERS),
            (Topic::Event, "events.csv", EVENTS),
        ];
        let mut written = Vec::new();
        for (topic, name, columns) in tables {
            let mut messages = self.messages(&[topic]).peekable();
            if messages.peek().is_none() {
                continue;
            }
            let mut table = Table::create(folder.join(name), columns)?;
            for recorded in messages {
                let recorded = recorded?;
                let segment = recorded.segment.to_string();
                match recorded.message {
                    Message::Force(batch) => batch
                        .records()
                        .iter()
                        .try_for_each(|record| table.row(&segment, force_row(record, format.as_ref())))?,
                    Message::Stage(report) => table.row(&segment, stage_row(&report))?,
                    Message::Markers(frame) => {
                        marker_rows(&frame).try_for_each(|row| table.row(&segment, row))?;
                    }
                    Message::Event(event) => table.row(&segment, event_row(&event))?,
                    _ => {}
                }
            }
            written.push(table.finish()?);
        }
        Ok(written)
    }
}

struct Table {
    path: PathBuf,
    csv: csv::Writer<File>,
}

impl Table {
    fn create(path: PathBuf, columns: Columns<'_>) -> Result<Self, SessionError> {
        let file = OpenOptions::new().write(true).create_new(true).open(&path);
        let file = file.map_err(|error| match error.kind() {
            std::io::ErrorKind::AlreadyExists => SessionError::Exists { path: path.clone() },
            _ => SessionError::write(&path)(error),
        })?;
        let mut table = Self { path, csv: csv::Writer::from_writer(file) };
        table.record(columns.iter().map(|(header, _)| *header))?;
        table.record(columns.iter().map(|(_, unit)| *unit))?;
        Ok(table)
    }

    fn row(&mut self, segment: &str, cells: impl IntoIterator<Item = String>) -> Result<(), SessionError> {
        self.record(std::iter::once(segment.to_owned()).chain(cells))
    }

    fn record<T: AsRef<[u8]>>(&mut self, cells: impl IntoIterator<Item = T>) -> Result<(), SessionError> {
        self.csv.write_record(cells).map_err(|error| SessionError::write(&self.path)(error.into()))
    }

    fn finish(mut self) -> Result<PathBuf, SessionError> {
        self.csv.flush().map_err(SessionError::write(&self.path))?;
        Ok(self.path)
    }
}

fn force_row(record: &ForceRecord, format: Option<&ForceFormat>) -> Vec<String> {
    let numbers = [record.rdt_sequence, record.ft_sequence, record.status];
    let wrench = format.map(|format| format.wrench(record.counts));
    std::iter::once(record.host.nanos().to_string())
        .chain(numbers.iter().map(u32::to_string))
        .chain((0..6).map(|i| wrench.map_or(String::new(), |w| w[i].to_string())))
        .chain(record.counts.iter().map(i32::to_string))
        .collect()
}

fn stage_row(report: &StageReport) -> Vec<String> {
    let (state, fault) = match report.state {
        StageState::Idle => ("idle", None),
        StageState::Moving => ("moving", None),
        StageState::Homing => ("homing", None),
        StageState::Fault { code } => ("fault", Some(code)),
    };
    vec![
        report.host.nanos().to_string(),
        report.tick_us.map_or(String::new(), |t| t.to_string()),
        report.position_m[0].to_string(),
        report.position_m[1].to_string(),
        state.to_owned(),
        fault.map_or(String::new(), |c| c.to_string()),
        report.homed.to_string(),
    ]
}

fn marker_rows(frame: &MarkerFrame) -> impl Iterator<Item = Vec<String>> {
    frame.markers.iter().map(|marker| {
        let numbers = [frame.host.nanos().to_string(), frame.number.to_string(), marker.marker.to_string()];
        numbers.into_iter().chain(marker.position_m.iter().map(f64::to_string)).collect()
    })
}

fn event_row(event: &Event) -> Vec<String> {
    vec![
        event.host_ns.to_string(),
        event.name.clone(),
        event.poke.map_or(String::new(), |p| p.to_string()),
        serde_json::Value::Object(event.detail.clone()).to_string(),
    ]
}
