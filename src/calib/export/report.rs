//! What a person is told of an export: the dialect, each specimen's columns with their units and ranges, and what was noticed.

use super::read::Export;
use super::table::{Column, Table, UnitRead, UnitSource};
use std::fmt;

pub(super) fn write(f: &mut fmt::Formatter<'_>, export: &Export) -> fmt::Result {
    let source = &export.source;
    writeln!(f, "{}: {} bytes, SHA-256 {}", source.file.display(), source.bytes.len(), source.sha256)?;
    for dialect in &export.dialects {
        write!(f, "{dialect}")?;
    }
    for table in &export.tables {
        write_table(f, table)?;
    }
    Ok(())
}

fn write_table(f: &mut fmt::Formatter<'_>, table: &Table) -> fmt::Result {
    let label = if table.label.is_empty() { String::new() } else { format!(" {:?}", table.label) };
    write!(f, "  specimen{label}: {} rows", table.lines.len())?;
    if let Some(loading) = table.loading {
        write!(f, ", {}", format!("{loading:?}").to_lowercase())?;
    }
    writeln!(f)?;
    let width = table.columns.iter().map(|c| c.heading.chars().count()).max().unwrap_or(0);
    for column in &table.columns {
        writeln!(f, "    {:<width$}  {}", column.heading, said(column))?;
    }
    let mut findings: Vec<_> = table.findings.iter().collect();
    findings.sort_by_key(|finding| finding.weight == super::finding::Weight::Note);
    for finding in findings {
        writeln!(f, "    {finding}")?;
    }
    Ok(())
}

/// Seven digits that count; a power of ten only where zeros would hide them.
fn figure(value: f64) -> String {
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    if rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

fn said(column: &Column) -> String {
    if column.printed.is_empty() {
        return format!("{}, no numbers", column.quantity);
    }
    let mut text = column.quantity.to_string();
    if column.extreme {
        text.push_str(" (extremes)");
    }
    if let Some(source) = column.source {
        text.push_str(&format!(" by {}", format!("{source:?}").to_lowercase()));
    }
    let range = |values: &[f64], unit: &str| {
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        format!("{} to {} {unit}", figure(least), figure(most))
    };
    match (&column.unit, column.si()) {
        (UnitRead::Known(unit, source), Some(si)) => {
            let from = match source {
                UnitSource::Stated => "",
                UnitSource::Asked => " as asked for",
                UnitSource::Shown(_) => " by the numbers",
            };
            format!("{text}, {}{from}: {}", unit.name, range(&si, unit.dimension.si()))
        }
        (UnitRead::Contradicted(unit, _), _) => {
            format!("{text}, {:?} is contradicted: {} as printed", unit.name, range(&column.printed, ""))
        }
        (UnitRead::Open(why), _) | (UnitRead::Known(_, UnitSource::Shown(why)), None) => {
            format!("{text}, {why}: {} as printed", range(&column.printed, ""))
        }
        (UnitRead::Known(unit, _), None) => format!("{text}, {}", unit.name),
    }
}

#[cfg(test)]
mod tests {
    use super::figure;

    #[test]
    fn numbers_are_written_as_people_do() {
        let cases = [
            (0.2, "0.2"),
            (75.2, "75.2"),
            (0.0, "0"),
            (-1.0 / 3.0, "-0.3333333"),
            (1.5e-5, "1.5e-5"),
            (2e9, "2e9"),
        ];
        for (value, text) in cases {
            assert_eq!(figure(value), text);
        }
    }
}
