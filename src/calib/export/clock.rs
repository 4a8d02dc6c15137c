//! Does time go forward? Printed times → seconds' worth of numbers, or the line where time goes back.
//!
//! A spreadsheet that fills a column downwards may count on behind the point: 40.9 is followed by 40.10 for 41.0, and 40.99 by 40.100. As
//! decimals such times go back. They are read as counts only if that makes every step of the table the same.

use super::ExportError;
use super::error::Place;
use super::overrides::TimeStyle;

/// Fewer equal steps show nothing.
const FEWEST_STEPS: usize = 20;

/// Times of one table as they were read.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Times {
    pub(super) values: Vec<f64>,
    /// What is odd about them.
    pub(super) note: Option<String>,
}

/// One printed time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Printed {
    pub(super) text: String,
    pub(super) value: f64,
    pub(super) place: Place,
}

/// Checks the times of a table with the decimal sign `decimal`.
pub(super) fn check(
    printed: &[Printed],
    name: &str,
    decimal: char,
    wish: Option<TimeStyle>,
) -> Result<Times, ExportError> {
    let back = printed.windows(2).position(|w| w[1].value < w[0].value);
    if wish == Some(TimeStyle::Counted)
        && let Some(values) = counted(printed, decimal, back.unwrap_or(printed.len() - 1))
    {
        return Ok(Times {
            values,
            note: Some("times are counted behind the decimal sign, as asked for".to_owned()),
        });
    }
    let Some(at) = back else {
        return Ok(Times { values: printed.iter().map(|p| p.value).collect(), note: None });
    };
    let (before, after) = (&printed[at], &printed[at + 1]);
    if wish.is_none()
        && printed.len() > FEWEST_STEPS
        && let Some(values) = counted(printed, decimal, at)
        && let Some(step) = even_step(&values)
    {
        let note = format!(
            "{name}: {} after {} in line {} would go back; the digits behind the sign are counted on ({} is {}), for then all {} \
             steps of the table are {step:.6}; time = \"decimal\" refuses this",
            after.text,
            before.text,
            before.place.line,
            after.text,
            values[at + 1],
            values.len() - 1,
        );
        return Ok(Times { values, note: Some(note) });
    }
    let hint = if after.value <= printed[0].value {
        "; a second specimen? A column of specimens or a repeated row of names would tell"
    } else {
        ""
    };
    Err(ExportError::TimeBack {
        place: after.place.clone(),
        name: name.to_owned(),
        text: after.text.clone(),
        previous: before.text.clone(),
        previous_line: before.place.line,
        hint,
    })
}

/// Times whose digits behind the sign count ticks; a tick is the last digit of the times up to `until`.
fn counted(printed: &[Printed], decimal: char, until: usize) -> Option<Vec<f64>> {
    let split = |p: &Printed| {
        let (whole, count) = p.text.split_once(decimal).unwrap_or((&p.text, ""));
        let digits = |t: &str| t.len() < 10 && t.bytes().all(|b| b.is_ascii_digit());
        let counts = if count.is_empty() { Some(0) } else { count.parse::<u32>().ok() };
        (digits(whole) && digits(count)).then_some((whole.parse::<u32>().ok()?, counts?, count.len()))
    };
    let parts: Vec<(u32, u32, usize)> = printed.iter().map(split).collect::<Option<_>>()?;
    let digits = parts.get(..=until)?.iter().map(|p| p.2).max().filter(|d| *d > 0)?;
    let ticks = 10_f64.powi(digits as i32);
    Some(parts.iter().map(|(whole, count, _)| f64::from(*whole) + f64::from(*count) / ticks).collect())
}

/// The step of times that go on evenly.
fn even_step(values: &[f64]) -> Option<f64> {
    let first = values.get(1)? - values.first()?;
    let even = values.windows(2).all(|w| ((w[1] - w[0]) - first).abs() < 1e-6 * first.abs());
    (first > 0.0 && even).then_some(first)
}

#[cfg(test)]
mod tests {
    use super::super::error::Origin;
    use super::*;
    use std::path::PathBuf;
    use std::sync::Arc;

    fn times(texts: &[String]) -> Vec<Printed> {
        let origin = Arc::new(Origin { file: PathBuf::from("a.csv"), sheet: None });
        let place = |i| Place { origin: Arc::clone(&origin), line: i as u64 + 2, column: 1 };
        let value = |t: &String| t.parse().expect("a number");
        texts
            .iter()
            .enumerate()
            .map(|(i, t)| Printed { text: t.clone(), value: value(t), place: place(i) })
            .collect()
    }

    fn run(texts: &[String], wish: Option<TimeStyle>) -> Result<Times, String> {
        check(&times(texts), "Time (s)", '.', wish).map_err(|e| e.to_string())
    }

    #[test]
    fn counted_times_are_read_only_where_every_step_agrees() {
        let mut texts: Vec<String> = (1..10).map(|i| format!("0.{i}")).collect();
        texts.push("1".to_owned());
        texts.extend((1..31).map(|i| format!("1.{i}")));
        let read = run(&texts, None).expect("counted");
        assert!((read.values[39] - 4.0).abs() < 1e-9, "{:?}", read.values);
        assert!(read.note.expect("said").contains("in line 20"));
        let refused = run(&texts, Some(TimeStyle::Decimal)).expect_err("goes back");
        assert!(
            refused
                .starts_with("a.csv, line 21, column 1 (Time (s)): \"1.10\" comes after \"1.9\" in line 20"),
            "{refused}"
        );
        texts[25] = "1.17".to_owned();
        assert!(run(&texts, None).is_err());
    }

    #[test]
    fn time_that_goes_back_is_refused() {
        let texts = |list: &[&str]| list.iter().map(|t| (*t).to_owned()).collect::<Vec<_>>();
        let error = run(&texts(&["0", "0.1", "0.2", "0", "0.1"]), None).expect_err("goes back");
        assert!(error.contains("line 5, column 1") && error.contains("second specimen"), "{error}");
        let read = run(&texts(&["0", "0.1", "0.1", "0.2"]), None).expect("forward");
        assert_eq!(read.values, [0.0, 0.1, 0.1, 0.2]);
    }
}
