//! A plan as a table for people: one line a step, what it takes, what is recorded, and what speaks against it.

use super::motions::{Plan, PlanStep};
use crate::acquire::protocol::{Action, Profile, Stroke, Target};
use crate::units::counted;

const HEAD: [&str; 12] = [
    "no.",
    "poke",
    "step",
    "what",
    "x, y, z (mm)",
    "depth (mm)",
    "in, out (mm/s)",
    "hold (s)",
    "force (N)",
    "stop (mm)",
    "starts (s)",
    "takes (s)",
];

/// Columns that hold words: aligned to the left.
const WORDS: [usize; 2] = [2, 3];

impl Plan {
    /// The table. Forces are the least and the greatest that are expected; `stop` is how far the stage goes on when it is stopped.
    pub fn table(&self) -> String {
        let mut text = format!(
            "{}: {}, {}, {}\n",
            self.name,
            counted(self.steps.len(), "step", "steps"),
            counted(self.pokes(), "poke", "pokes"),
            duration(self.duration_s)
        );
        text += &self.recorded();
        text.push('\n');
        let mut rows: Vec<Row> = vec![Row { cells: HEAD.map(str::to_owned).to_vec(), remark: None }];
        rows.extend(self.steps.iter().map(row));
        text += &aligned(&rows);
        if !self.violations.is_empty() {
            text += &format!(
                "\nIt can't be run: {}\n",
                counted(self.violations.len(), "violation", "violations")
            );
            for violation in &self.violations {
                text += &format!("  {violation}\n");
            }
        }
        text
    }

    fn recorded(&self) -> String {
        let streams: Vec<String> =
            self.streams.iter().map(|stream| format!("{} {}/s", stream.name, stream.rate_hz)).collect();
        if streams.is_empty() {
            return String::new();
        }
        format!("recorded all the time: {}; about {:.1} MB\n", streams.join(", "), self.data_bytes() * 1e-6)
    }
}

struct Row {
    cells: Vec<String>,
    /// Takes the place of the figures.
    remark: Option<String>,
}

fn row(step: &PlanStep) -> Row {
    let planned = &step.step;
    let mut cells = vec![
        planned.number.to_string(),
        planned.poke.map(|poke| poke.to_string()).unwrap_or_default(),
        planned.id.to_string(),
        planned.kind.name().to_owned(),
    ];
    let mut remark = None;
    match &planned.action {
        Action::Stroke { site_m, stroke } => {
            cells.push(site_m.map(|c| format!("{:.2}", c * 1e3)).join(" "));
            cells.extend(figures(stroke));
            match &step.contact {
                Some(contact) => {
                    cells.push(format!("{:.2} to {:.2}", contact.force_n[0], contact.force_n[1]));
                    cells.push(format!("{:.3}", contact.overshoot_m * 1e3));
                }
                None => cells.extend([String::new(), String::new()]),
            }
        }
        Action::Wait { .. } => cells.extend(std::iter::repeat_n(String::new(), 6)),
        Action::Mark { text } | Action::Ask { text } => {
            cells.extend(std::iter::repeat_n(String::new(), 6));
            // A table has one line a step.
            remark = Some(format!("\"{}\"", text.split_whitespace().collect::<Vec<_>>().join(" ")));
        }
    }
    cells.push(format!("{:.1}", step.start_s));
    cells.push(format!("{:.1}", step.duration_s));
    Row { cells, remark }
}

/// Depth, speeds, hold.
fn figures(stroke: &Stroke) -> [String; 3] {
    let (depth, hold) = match stroke.profile {
        Profile::Press { target: Target::Depth { depth_m }, hold_s } => {
            (format!("{:.2}", depth_m * 1e3), format!("{hold_s:.1}"))
        }
        Profile::Press { target: Target::Force { force_n, depth_limit_m }, hold_s } => {
            (format!("to {force_n} N, at most {:.2}", depth_limit_m * 1e3), format!("{hold_s:.1}"))
        }
        Profile::Cycles { offset_m, amplitude_m, count } => {
            (format!("{count} × {:.2} ± {:.2}", offset_m * 1e3, amplitude_m * 1e3), String::new())
        }
    };
    [depth, format!("{:.2} {:.2}", stroke.speed_m_s * 1e3, stroke.retreat_speed_m_s * 1e3), hold]
}

fn aligned(rows: &[Row]) -> String {
    let width = |column: usize| rows.iter().map(|row| row.cells[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..HEAD.len()).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let padded = |column: usize| {
            let (cell, width) = (&row.cells[column], widths[column]);
            if WORDS.contains(&column) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        };
        let line = match &row.remark {
            None => (0..HEAD.len()).map(padded).collect::<Vec<_>>().join("  "),
            Some(remark) => {
                let first: Vec<String> = (0..4).map(padded).chain([remark.clone()]).collect();
                first.join("  ")
            }
        };
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// Hours, minutes and seconds.
fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    let (hours, minutes, rest) = (whole / 3600, whole / 60 % 60, whole % 60);
    match (hours, minutes) {
        (0, 0) => format!("{seconds:.1} s"),
        (0, _) => format!("{minutes} min {rest} s"),
        _ => format!("{hours} h {minutes} min {rest} s"),
    }
}
