//! A protocol's text → a [`Protocol`], or everything that speaks against it.
//!
//! One refusal for each step at most, so that a file with several slips is mended in one go.

use super::quantity::{Allowed, Unit};
use super::refusal::{Problem, Refusal, nearest};
use super::section::{Section, Source, Variables};
use super::step;
use super::steps::{Protocol, Step, Variable, check_count};
use crate::acquire::AcquireError;
use toml::de::DeTable;
use toml::{Spanned, de::DeValue};

/// The one format that is read.
pub const FORMAT: &str = "phantom-protocol/1";

const KEYS: [&str; 6] = ["format", "name", "notes", "variables", "defaults", "step"];

/// The file as a whole, in refusals.
const WHOLE: &str = "protocol";

impl Protocol {
    /// Reads the text of a protocol file; `file` is what refusals call it. `overrides` replace the values of variables, each in the
    /// variable's unit.
    ///
    /// # Errors
    /// [`AcquireError::Protocol`] with every refusal.
    pub fn parse(file: &str, text: &str, overrides: &[(String, f64)]) -> Result<Self, AcquireError> {
        read(&Source::new(file, text), text, overrides)
            .map_err(|refusals| AcquireError::Protocol { refusals })
    }
}

fn read(source: &Source<'_>, text: &str, overrides: &[(String, f64)]) -> Result<Protocol, Vec<Refusal>> {
    let document = DeTable::parse(text).map_err(|error| {
        let offset = error.span().map_or(0, |span| span.start);
        vec![source.refuse(offset, WHOLE, Problem::NotToml { message: error.message().to_owned() })]
    })?;
    let none = Variables::new();
    let whole = Section::new(source, &none, WHOLE.to_owned(), &document);
    let header = check_format(&whole).and_then(|()| {
        whole.only(&KEYS)?;
        Ok((whole.need_text("name")?.to_owned(), whole.text("notes")?.map(str::to_owned)))
    });
    let (name, notes) = header.map_err(|refusal| vec![refusal])?;
    let variables = variables(source, &whole, overrides).map_err(|refusal| vec![refusal])?;
    let values = variables.iter().map(|v| (v.name.clone(), v.value)).collect();
    let steps = steps(source, &whole, &values)?;
    Ok(Protocol { name, notes, variables, steps })
}

/// Comes first: a file of another format has other keys.
fn check_format(whole: &Section<'_, '_>) -> Result<(), Refusal> {
    let expected = || format!("\"{FORMAT}\"");
    let value = whole.find("format").ok_or_else(|| whole.missing("format", expected()))?;
    let known = value.get_ref().as_str() == Some(FORMAT);
    if known { Ok(()) } else { Err(whole.wrong("format", value, expected())) }
}

fn variables(
    source: &Source<'_>,
    whole: &Section<'_, '_>,
    overrides: &[(String, f64)],
) -> Result<Vec<Variable>, Refusal> {
    let title = "[variables]";
    let none = Variables::new();
    let mut variables = Vec::new();
    let mut start = 0;
    if let Some(value) = whole.find("variables") {
        start = value.span().start;
        let section = Section::of_value(source, &none, title.to_owned(), value, None);
        let section = section.ok_or_else(|| whole.wrong("variables", value, "a table [variables]"))?;
        let entries = section.entries(Allowed::VARIABLE)?.into_iter();
        variables.extend(entries.map(|(name, value)| Variable { name, value, overridden: false }));
    }
    for (name, value) in overrides {
        let value = *value;
        if !Allowed::VARIABLE.holds(value) {
            let expected = Allowed::VARIABLE.words(Unit::of(name));
            let problem = Problem::WrongValue { key: name.clone(), value: value.to_string(), expected };
            return Err(source.refuse(start, title, problem));
        }
        if let Some(variable) = variables.iter_mut().find(|v| v.name == *name) {
            (variable.value, variable.overridden) = (value, true);
        } else {
            let nearest = nearest(name, variables.iter().map(|v| v.name.as_str()));
            let known = variables.iter().map(|v| v.name.clone()).collect();
            let problem = Problem::UnknownOverride { name: name.clone(), value, nearest, known };
            return Err(source.refuse(start, title, problem));
        }
    }
    Ok(variables)
}

fn steps(
    source: &Source<'_>,
    whole: &Section<'_, '_>,
    values: &Variables,
) -> Result<Vec<Step>, Vec<Refusal>> {
    let mut defaults = None;
    if let Some(value) = whole.find("defaults") {
        let section = Section::of_value(source, values, "[defaults]".to_owned(), value, None);
        let section = section.ok_or_else(|| whole.wrong("defaults", value, "a table [defaults]"));
        section.and_then(|section| step::check_defaults(&section)).map_err(|refusal| vec![refusal])?;
        defaults = value.get_ref().as_table();
    }
    let expected = "at least one [[step]]";
    let Some(list) = whole.find("step") else {
        return Err(vec![whole.missing("[[step]]", expected)]);
    };
    let Some(tables) = list.get_ref().as_array().filter(|list| !list.is_empty()) else {
        return Err(vec![whole.wrong("step", list, expected)]);
    };
    let (mut steps, mut refusals) = (Vec::new(), Vec::new());
    let mut strokes = 0;
    for (number, value) in (1..).zip(tables.iter()) {
        match one(source, values, number, value, defaults, &mut strokes) {
            Ok(Some(step)) => steps.push(step),
            Ok(None) => refusals.push(whole.wrong("step", value, "a table [[step]]")),
            Err(refusal) => refusals.push(refusal),
        }
    }
    if refusals.is_empty() { Ok(steps) } else { Err(refusals) }
}

/// A step; none when the value is no table. `strokes` counts on.
fn one<'a, 't>(
    source: &'a Source<'t>,
    values: &'a Variables,
    number: usize,
    value: &'a Spanned<DeValue<'t>>,
    defaults: Option<&'a DeTable<'t>>,
    strokes: &mut u64,
) -> Result<Option<Step>, Refusal> {
    let section = Section::of_value(source, values, format!("step {number}"), value, defaults);
    let Some(mut section) = section else { return Ok(None) };
    let kind = step::kind(&section)?;
    section.rename(format!("step {number} ({})", kind.name()));
    let task = step::task(&section, kind)?;
    *strokes = strokes.saturating_add(task.strokes());
    check_count(*strokes).map_err(|problem| section.refuse(problem))?;
    Ok(Some(Step { line: section.line(), kind, task }))
}
