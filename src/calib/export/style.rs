//! Which decimal sign does a whole table have? All its numbers → the style that fits every one, or a refusal that names the cells.

use super::ExportError;
use super::cells::Grid;
use super::layout::Layout;
use super::number::{self, Hint, NumberStyle};
use super::overrides::Override;

/// A cell that shows something: row, column, both from 0.
type At = (usize, usize);

/// The first cell that shows each use of a sign.
#[derive(Default)]
struct Shown {
    decimal: [Option<At>; 2],
    thousands: [Option<At>; 2],
    either: [Option<At>; 2],
    numbers: usize,
}

const SIGNS: [char; 2] = ['.', ','];

fn index(sign: char) -> usize {
    usize::from(sign == ',')
}

/// Finds the style of a sheet's data, with what shows it. Columns in `skip` hold labels.
pub(super) fn infer(
    grid: &Grid,
    layout: &Layout,
    skip: &[bool],
    wish: &Override,
) -> Result<(NumberStyle, String), ExportError> {
    let text = |at: At| grid.rows[at.0].cells[at.1].text.clone();
    let line = |at: At| grid.rows[at.0].line;
    let place = |at: At| grid.place(at.0, at.1);
    let example = |at: At| format!("{:?} in line {}, column {}", text(at), line(at), at.1 + 1);
    let shown = survey(grid, layout, skip);
    if let Some(decimal) = wish.decimal.or(wish.thousands.map(other)) {
        let thousands =
            wish.thousands.or_else(|| shown.thousands[index(other(decimal))].map(|_| other(decimal)));
        return Ok((NumberStyle { decimal, thousands }, "as asked for".to_owned()));
    }
    if let (Some(a), Some(b)) = (shown.decimal[0], shown.decimal[1]) {
        let (first, second) = if a < b { (a, b) } else { (b, a) };
        return Err(ExportError::DecimalMixed {
            place: place(second),
            text: text(second),
            other: text(first),
            other_line: line(first),
            other_column: first.1 + 1,
        });
    }
    // A sign that separates thousands leaves the other one for decimals.
    for sign in SIGNS {
        let (own, opposite) = (index(sign), index(other(sign)));
        if let Some(at) = shown.decimal[own].or(shown.thousands[opposite]) {
            if let Some(against) = shown.thousands[own] {
                let (other, text) = (text(at), text(against));
                let (other_line, other_column) = (line(at), at.1 + 1);
                return Err(ExportError::DecimalMixed {
                    place: place(against),
                    text,
                    other,
                    other_line,
                    other_column,
                });
            }
            let grouped = shown.thousands[opposite].or(shown.either[opposite]);
            let style = NumberStyle { decimal: sign, thousands: grouped.map(|_| other(sign)) };
            return Ok((style, example(at)));
        }
    }
    for sign in SIGNS {
        let Some(at) = shown.either[index(sign)] else { continue };
        // Fields that commas separate cannot have decimals after commas unless they are quoted.
        if sign == '.' && grid.delimiter == Some(',') && !grid.quotes {
            return Ok((
                NumberStyle { decimal: '.', thousands: None },
                "commas separate the fields".to_owned(),
            ));
        }
        let (with_decimals, with_thousands) = number::both_values(&text(at), sign);
        return Err(ExportError::DecimalAmbiguous {
            place: place(at),
            text: text(at),
            with_decimals,
            with_thousands,
        });
    }
    let why =
        if shown.numbers > 0 { "no number has decimals" } else { "the workbook holds numbers, not text" };
    Ok((NumberStyle { decimal: '.', thousands: None }, why.to_owned()))
}

fn other(sign: char) -> char {
    if sign == '.' { ',' } else { '.' }
}

fn survey(grid: &Grid, layout: &Layout, skip: &[bool]) -> Shown {
    let mut shown = Shown::default();
    for &row in layout.blocks.iter().flat_map(|b| &b.data) {
        for (column, cell) in grid.rows[row].cells.iter().enumerate().take(layout.width) {
            if cell.number.is_some() || skip.get(column).copied().unwrap_or(false) {
                continue;
            }
            let Some(hint) = number::hint(&cell.text) else { continue };
            shown.numbers += 1;
            let at = (row, column);
            match hint {
                Hint::Decimal(sign, thousands) => {
                    shown.decimal[index(sign)].get_or_insert(at);
                    if let Some(sign) = thousands {
                        shown.thousands[index(sign)].get_or_insert(at);
                    }
                }
                Hint::Thousands(sign) => drop(shown.thousands[index(sign)].get_or_insert(at)),
                Hint::Either(sign) => drop(shown.either[index(sign)].get_or_insert(at)),
                Hint::Whole => {}
            }
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::super::{cells, layout};
    use super::*;
    use std::path::Path;

    fn style(text: &str, wish: &str) -> Result<NumberStyle, String> {
        let file = Path::new("a.csv");
        let wish = Override::parse(file, wish).expect("sound");
        let grid = cells::split(file, text, None).map_err(|e| e.to_string())?;
        let layout = layout::find(&grid, &wish).map_err(|e| e.to_string())?;
        infer(&grid, &layout, &[], &wish).map(|s| s.0).map_err(|e| e.to_string())
    }

    const COMMA: NumberStyle = NumberStyle { decimal: ',', thousands: None };
    const DOT: NumberStyle = NumberStyle { decimal: '.', thousands: None };

    #[test]
    fn one_number_tells_for_all() {
        for (text, expected) in [
            ("a;b\n1,234;2,345\n0,5;3,456\n", COMMA),
            ("a;b\n1.234;2.345\n0.5;3.456\n", DOT),
            ("a;b\n1.234,5;2\n1.234;7\n", NumberStyle { decimal: ',', thousands: Some('.') }),
            ("a;b\n1,234,567;2\n1,234;7\n", NumberStyle { decimal: '.', thousands: Some(',') }),
            ("a;b\n1;2\n3;4\n", DOT),
            ("a,b\n1.234,2.345\n1.500,3.456\n", DOT),
            ("a,b\n\"1.234\",\"2,5\"\n\"3\",\"4\"\n", NumberStyle { decimal: ',', thousands: Some('.') }),
            ("a\tb\n\"1,25\"\t\"2\"\n\"3\"\t\"4\"\n", COMMA),
        ] {
            assert_eq!(style(text, ""), Ok(expected), "{text:?}");
        }
    }

    #[test]
    fn what_no_number_tells_is_asked() {
        let text = "a;b\n1,234;2,345\n1,500;3,456\n";
        let error = style(text, "").expect_err("ambiguous");
        assert!(error.starts_with("a.csv, line 2, column 1: \"1,234\" may be 1.234 or 1234"), "{error}");
        assert!(error.contains("decimal = "), "{error}");
        assert_eq!(style(text, "decimal = ','"), Ok(COMMA));
        assert_eq!(style(text, "decimal = '.'\nthousands = ','").map(|s| s.thousands), Ok(Some(',')));
        assert!(style("a,b\n\"1.234\",\"2\"\n\"3\",\"4\"\n", "").is_err(), "quoted commas would be possible");
        let error = style("a;b\n0,5;2\n3;0.5\n", "").expect_err("mixed");
        assert!(
            error.starts_with(
                "a.csv, line 3, column 2: \"0.5\" has another decimal sign than \"0,5\" in line 2"
            ),
            "{error}"
        );
    }
}
