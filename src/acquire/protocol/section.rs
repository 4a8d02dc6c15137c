//! What does a table of a protocol file hold under a key: checked values, or a refusal that says where and why.

use super::quantity::{Allowed, Unit};
use super::refusal::{Problem, Refusal, nearest};
use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

/// A protocol's text and where its lines begin.
pub(super) struct Source<'t> {
    file: &'t str,
    text: &'t str,
    lines: Vec<usize>,
}

impl<'t> Source<'t> {
    /// `file` is only told, not opened.
    pub(super) fn new(file: &'t str, text: &'t str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Self { file, text, lines: std::iter::once(0).chain(ends.map(|(i, _)| i + 1)).collect() }
    }

    /// Line, from 1, of a byte of the text.
    pub(super) fn line(&self, offset: usize) -> usize {
        self.lines.partition_point(|start| *start <= offset)
    }

    /// A refusal of what stands at `offset`.
    pub(super) fn refuse(&self, offset: usize, section: &str, problem: Problem) -> Refusal {
        let line = self.line(offset);
        let before = self.text.get(self.lines[line - 1]..offset).unwrap_or_default();
        let (file, section) = (self.file.to_owned(), section.to_owned());
        Refusal { file, line, column: before.chars().count() + 1, section, problem: Box::new(problem) }
    }

    /// What the text says there, shortened.
    fn excerpt(&self, span: Range<usize>) -> String {
        const LONGEST: usize = 40;
        let said = self.text.get(span).unwrap_or_default().lines().next().unwrap_or_default();
        let short: String = said.chars().take(LONGEST).collect();
        if short.len() < said.len() { short + "…" } else { short }
    }
}

/// Values of `[variables]` by name.
pub(super) type Variables = BTreeMap<String, f64>;

type Value<'t> = Spanned<DeValue<'t>>;

/// A table of the file, and the table that speaks where it is silent.
pub(super) struct Section<'a, 't> {
    source: &'a Source<'t>,
    variables: &'a Variables,
    /// What it is called in refusals.
    title: String,
    /// Byte where it begins.
    start: usize,
    table: &'a DeTable<'t>,
    defaults: Option<&'a DeTable<'t>>,
}

impl<'a, 't> Section<'a, 't> {
    pub(super) fn new(
        source: &'a Source<'t>,
        variables: &'a Variables,
        title: String,
        table: &'a Spanned<DeTable<'t>>,
    ) -> Self {
        Self { source, variables, title, start: table.span().start, table: table.get_ref(), defaults: None }
    }

    /// One of a list of tables; `None` when it is none.
    pub(super) fn of_value(
        source: &'a Source<'t>,
        variables: &'a Variables,
        title: String,
        value: &'a Value<'t>,
        defaults: Option<&'a DeTable<'t>>,
    ) -> Option<Self> {
        let table = value.get_ref().as_table()?;
        Some(Self { source, variables, title, start: value.span().start, table, defaults })
    }

    /// Line where it begins.
    pub(super) fn line(&self) -> usize {
        self.source.line(self.start)
    }

    /// Says what it is in refusals.
    pub(super) fn rename(&mut self, title: String) {
        self.title = title;
    }

    /// Refuses keys that are not among `known`.
    pub(super) fn only(&self, known: &[&'static str]) -> Result<(), Refusal> {
        let strange = self.table.iter().filter(|(key, _)| !known.contains(&key.get_ref().as_ref()));
        let Some((key, value)) = strange.min_by_key(|(key, _)| key.span().start) else { return Ok(()) };
        let problem = Problem::UnknownKey {
            key: key.get_ref().to_string(),
            value: self.source.excerpt(value.span()),
            nearest: nearest(key.get_ref(), known.iter().copied()),
            known: known.to_vec(),
        };
        Err(self.source.refuse(key.span().start, &self.title, problem))
    }

    /// Whether the table itself says something under `key`.
    pub(super) fn says(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// What stands under `key`, here or among the defaults.
    pub(super) fn find(&self, key: &str) -> Option<&'a Value<'t>> {
        self.table.get(key).or_else(|| self.defaults?.get(key))
    }

    /// Refuses that `key` is absent.
    pub(super) fn missing(&self, key: &'static str, expected: impl Into<String>) -> Refusal {
        self.source.refuse(self.start, &self.title, Problem::MissingKey { key, expected: expected.into() })
    }

    /// Refuses the value of `key`.
    pub(super) fn wrong(&self, key: &str, value: &Value<'t>, expected: impl Into<String>) -> Refusal {
        let said = self.source.excerpt(value.span());
        let problem = Problem::WrongValue { key: key.to_owned(), value: said, expected: expected.into() };
        self.source.refuse(value.span().start, &self.title, problem)
    }

    /// Refuses that `key` stands beside `other`.
    pub(super) fn exclusive(&self, key: &'static str, other: &'static str) -> Refusal {
        let span = self.find(key).map_or(self.start..self.start, Spanned::span);
        let problem = Problem::Exclusive { key, value: self.source.excerpt(span.clone()), other };
        self.source.refuse(span.start, &self.title, problem)
    }

    /// Refuses the section as it stands.
    pub(super) fn refuse(&self, problem: Problem) -> Refusal {
        self.source.refuse(self.start, &self.title, problem)
    }

    /// A text that says something.
    pub(super) fn text(&self, key: &'static str) -> Result<Option<&'a str>, Refusal> {
        let Some(value) = self.find(key) else { return Ok(None) };
        let text = value.get_ref().as_str().filter(|text| !text.trim().is_empty());
        text.map(Some).ok_or_else(|| self.wrong(key, value, "a text in quotation marks"))
    }

    /// A text that has to be there.
    pub(super) fn need_text(&self, key: &'static str) -> Result<&'a str, Refusal> {
        self.text(key)?.ok_or_else(|| self.missing(key, "a text in quotation marks"))
    }

    /// A number, in SI.
    pub(super) fn number(&self, key: &'static str, allowed: Allowed) -> Result<Option<f64>, Refusal> {
        self.find(key).map(|value| self.number_in(key, value, allowed)).transpose()
    }

    /// A number that has to be there, in SI.
    pub(super) fn need(&self, key: &'static str, allowed: Allowed) -> Result<f64, Refusal> {
        self.number(key, allowed)?.ok_or_else(|| self.missing(key, allowed.words(Unit::of(key))))
    }

    /// A whole number of things.
    pub(super) fn count(&self, key: &'static str) -> Result<Option<u32>, Refusal> {
        // The range of a count fits.
        Ok(self.number(key, Allowed::COUNT)?.map(|count| count as u32))
    }

    /// Three numbers, in SI.
    pub(super) fn vector(&self, key: &'static str, allowed: Allowed) -> Result<Option<[f64; 3]>, Refusal> {
        self.find(key).map(|value| self.vector_in(key, value, allowed)).transpose()
    }

    /// A place that has to be there (m).
    pub(super) fn place(&self, key: &'static str) -> Result<[f64; 3], Refusal> {
        let place = self.vector(key, Allowed::PLACE_MM)?;
        place.ok_or_else(|| self.missing(key, "three numbers [x, y, z] of mm in the phantom frame"))
    }

    /// As many numbers as there are, in SI.
    pub(super) fn numbers(&self, key: &'static str, allowed: Allowed) -> Result<Option<Vec<f64>>, Refusal> {
        let Some(value) = self.find(key) else { return Ok(None) };
        let array = value.get_ref().as_array().filter(|array| !array.is_empty());
        let Some(array) = array else {
            return Err(self.wrong(key, value, "a list [a, b, …] of numbers"));
        };
        array.iter().map(|item| self.number_in(key, item, allowed)).collect::<Result<_, _>>().map(Some)
    }

    /// A unit vector; one that is nearly so is made one.
    pub(super) fn unit_vector(&self, key: &'static str) -> Result<Option<[f64; 3]>, Refusal> {
        self.find(key).map(|value| self.unit_vector_in(key, value)).transpose()
    }

    /// Unit vectors, one or two.
    pub(super) fn unit_vectors(&self, key: &'static str) -> Result<Option<Vec<[f64; 3]>>, Refusal> {
        let Some(value) = self.find(key) else { return Ok(None) };
        let array = value.get_ref().as_array().filter(|array| (1..=2).contains(&array.len()));
        let Some(array) = array else {
            return Err(self.wrong(key, value, "one or two directions [[x, y, z], [x, y, z]]"));
        };
        array.iter().map(|item| self.unit_vector_in(key, item)).collect::<Result<_, _>>().map(Some)
    }

    fn unit_vector_in(&self, key: &str, value: &Value<'t>) -> Result<[f64; 3], Refusal> {
        let raw = self.vector_in(key, value, Allowed::COMPONENT)?;
        normalised(raw).map_err(|expected| self.wrong(key, value, expected))
    }

    fn vector_in(&self, key: &str, value: &Value<'t>, allowed: Allowed) -> Result<[f64; 3], Refusal> {
        let array = value.get_ref().as_array().filter(|array| array.len() == 3);
        let array = array.ok_or_else(|| self.wrong(key, value, "three numbers [x, y, z]"))?;
        let mut vector = [0.0; 3];
        for (component, item) in vector.iter_mut().zip(array.iter()) {
            *component = self.number_in(key, item, allowed)?;
        }
        Ok(vector)
    }

    /// Every key with its number, in the unit that the key names.
    pub(super) fn entries(&self, allowed: Allowed) -> Result<Vec<(String, f64)>, Refusal> {
        let entry = |(key, value): (&Spanned<DeString<'t>>, &Value<'t>)| {
            let key = key.get_ref().to_string();
            let number = literal(value.get_ref()).filter(|number| allowed.holds(*number));
            let wrong = || self.wrong(&key, value, allowed.words(Unit::of(&key)));
            number.ok_or_else(wrong).map(|number| (key, number))
        };
        self.table.iter().map(entry).collect()
    }

    /// A number or the variable that stands for one; the key says the unit.
    fn number_in(&self, key: &str, value: &Value<'t>, allowed: Allowed) -> Result<f64, Refusal> {
        let unit = Unit::of(key);
        let number = match value.get_ref().as_str().and_then(|text| text.strip_prefix('$')) {
            Some(name) => Some(self.variable(key, value, name, unit)?),
            None => literal(value.get_ref()),
        };
        if let Some(number) = number.filter(|number| allowed.holds(*number)) {
            return Ok(unit.si(number));
        }
        if let Some((name, number)) = value.get_ref().as_str().zip(number) {
            let (key, name, expected) = (key.to_owned(), name.to_owned(), allowed.words(unit));
            let problem = Problem::VariableOutside { key, name, number, expected };
            return Err(self.source.refuse(value.span().start, &self.title, problem));
        }
        Err(self.wrong(key, value, format!("{}, or \"$variable\"", allowed.words(unit))))
    }

    fn variable(&self, key: &str, value: &Value<'t>, name: &str, unit: Unit) -> Result<f64, Refusal> {
        let (key, name) = (key.to_owned(), name.to_owned());
        let refuse = |problem| Err(self.source.refuse(value.span().start, &self.title, problem));
        let Some(number) = self.variables.get(&name) else {
            let nearest = nearest(&name, self.variables.keys().map(String::as_str));
            let nearest = nearest.map(|n| format!("${n}"));
            let known = self.variables.keys().cloned().collect();
            return refuse(Problem::NoVariable { key, name, nearest, known });
        };
        let own = Unit::of(&name);
        if own != unit {
            return refuse(Problem::WrongUnit { key, name, unit: own.name(), expected: unit.name() });
        }
        Ok(*number)
    }
}

/// The number that the file writes.
fn literal(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(whole) => i64::from_str_radix(whole.as_str(), whole.radix()).ok().map(|n| n as f64),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}

/// How far from 1 the length of a direction may be.
const NEARLY: f64 = 0.01;

/// A vector that is nearly a unit vector as one; otherwise what was expected.
pub(super) fn normalised(raw: [f64; 3]) -> Result<[f64; 3], String> {
    let length = raw.iter().map(|c| c * c).sum::<f64>().sqrt();
    if (length - 1.0).abs() <= NEARLY {
        Ok(raw.map(|c| c / length))
    } else {
        Err(format!("a unit vector [x, y, z], of length 1 to within 1 %; this one's is {length:.3}"))
    }
}
