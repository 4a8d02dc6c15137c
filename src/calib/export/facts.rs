//! What does an export say besides its table? Lines such as `Specimen Width (mm);6`, `Speed : 450 mm/min` or `Maximum Load,"131.2",lbf`
//! → names with values, and what they say of the specimen and of the test.

use super::cells::Row;
use super::heading;
use super::number::{self, NumberStyle};
use super::overrides::SpecimenOverride;
use super::quantity::{self, Quantity, StrainSource};
use super::unit::{self, Dimension, Unit};

/// One line beside the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    /// Line of the file.
    pub line: u64,
    /// Its name, without the unit.
    pub name: String,
    /// Its value as it is written.
    pub text: String,
    /// The value, if it is a number.
    pub number: Option<f64>,
    /// The unit, if one is given and known.
    pub unit: Option<Unit>,
}

impl Fact {
    /// The value in SI, if it is a number of that dimension.
    pub fn si(&self, dimension: Dimension) -> Option<f64> {
        let unit = self.unit.filter(|u| u.dimension == dimension)?;
        Some(unit.to_si(self.number?))
    }
}

/// What is said of the specimen (SI).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Specimen {
    /// Thickness (m).
    pub thickness_m: Option<f64>,
    /// Width (m).
    pub width_m: Option<f64>,
    /// Diameter (m).
    pub diameter_m: Option<f64>,
    /// Cross-section as it is said (m²).
    pub stated_area_m2: Option<f64>,
    /// Length between marks or grips (m).
    pub gauge_length_m: Option<f64>,
    /// Speed of the crosshead (m/s).
    pub speed_m_s: Option<f64>,
}

impl Specimen {
    /// The cross-section, said or from the sizes (m²).
    pub fn area_m2(&self) -> Option<f64> {
        self.stated_area_m2.or_else(|| self.area_of_sizes_m2())
    }

    /// The cross-section that the sizes give (m²).
    pub fn area_of_sizes_m2(&self) -> Option<f64> {
        let rectangle = self.thickness_m.zip(self.width_m).map(|(t, w)| t * w);
        rectangle.or_else(|| self.diameter_m.map(|d| 0.25 * std::f64::consts::PI * d * d))
    }
}

/// How the specimen was loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loading {
    /// Pulled.
    Tension,
    /// Pressed.
    Compression,
    /// Bent.
    Flexure,
}

const LOADINGS: [(Loading, &[&str]); 3] = [
    (Loading::Flexure, &["flexur", "3ptbnd", "bending", "biege", "изгиб", "弯曲"]),
    (Loading::Compression, &["compress", "druckversuch", "stauch", "сжати", "压缩"]),
    (
        Loading::Tension,
        &[
            "tensile",
            " tension",
            "pull-to",
            "zugversuch",
            "zugspannung",
            "zugprüf",
            "растяж",
            "拉伸",
            "astm d412",
            "iso 37",
            "astm d638",
            "iso 527",
        ],
    ),
];

/// Reads the facts of some rows, whose cells `delimiter` separates.
pub(super) fn read<'a>(
    rows: impl Iterator<Item = &'a Row>,
    style: NumberStyle,
    delimiter: Option<char>,
) -> Vec<Fact> {
    rows.filter_map(|row| fact(row, style, delimiter)).collect()
}

fn fact(row: &Row, style: NumberStyle, delimiter: Option<char>) -> Option<Fact> {
    let mut filled: Vec<&str> = row.cells.iter().map(|c| c.text.as_str()).filter(|t| !t.is_empty()).collect();
    // "Speed : 4,5 mm/s" beside quoted numbers: the comma separates decimals, not fields.
    let cut =
        |text: &str| text.rsplit_once(':').is_some_and(|(_, v)| number::hint(v) == Some(number::Hint::Whole));
    let whole = filled.join(",");
    if delimiter == Some(style.decimal) && filled.len() == 2 && cut(filled[0]) {
        filled = vec![&whole];
    }
    let (name, value, unit_text) = match filled.as_slice() {
        [] => return None,
        [one] => {
            let pair = one.split_once(" : ").or_else(|| one.split_once([':', '=', '：']));
            // A line that says something without naming it: "Tensile test".
            pair.map_or((*one, "", ""), |(name, value)| (name, value.trim(), ""))
        }
        [name, value] => (name.trim_end_matches([':', '=']).trim_end(), *value, ""),
        [name, value, unit, ..] => (name.trim_end_matches([':', '=']).trim_end(), *value, *unit),
    };
    let heading = heading::read(name);
    // "450 mm/min": the unit behind the number.
    let behind = value.split_once(' ').map(|(number, unit)| (number.trim(), unit.trim()));
    let parse = |text: &str| number::value(text, style).filter(|v| v.is_finite());
    let (number, unit) = match (parse(value), behind) {
        (Some(number), _) => (Some(number), unit::parse(unit_text).or(heading.unit)),
        (None, Some((first, rest))) if unit::parse(rest).is_some() => (parse(first), unit::parse(rest)),
        _ => (None, heading.unit),
    };
    let text = if unit_text.is_empty() { value.to_owned() } else { format!("{value} {unit_text}") };
    Some(Fact { line: row.line, name: heading.name, text, number, unit })
}

/// What the facts say of the specimen; `wish` has the last word.
pub(super) fn specimen(facts: &[Fact], wish: &SpecimenOverride) -> Specimen {
    let find = |quantity: Quantity, dimension| {
        let named = facts.iter().filter(|f| quantity::meaning(&f.name).quantity == quantity);
        named.filter_map(|f| f.si(dimension)).find(|v| *v > 0.0)
    };
    let mm = |wish: Option<f64>| wish.map(|v| v * 1e-3);
    let length = |quantity, asked| mm(asked).or_else(|| find(quantity, Dimension::Length));
    Specimen {
        thickness_m: length(Quantity::Thickness, wish.thickness_mm),
        width_m: length(Quantity::Width, wish.width_mm),
        diameter_m: length(Quantity::Diameter, wish.diameter_mm),
        stated_area_m2: wish.area_mm2.map(|a| a * 1e-6).or_else(|| find(Quantity::Area, Dimension::Area)),
        gauge_length_m: length(Quantity::GaugeLength, wish.gauge_length_mm),
        speed_m_s: find(Quantity::Speed, Dimension::Speed),
    }
}

/// How the specimen was loaded, and where strain was measured, going by all the words beside the numbers.
pub(super) fn loading(facts: &[Fact], names: &[String]) -> Option<Loading> {
    let words = words(facts, names);
    let mut found = LOADINGS.iter().filter(|(_, w)| w.iter().any(|w| words.contains(w))).map(|(l, _)| *l);
    let first = found.next()?;
    // Words for two kinds say nothing.
    found.next().is_none().then_some(first)
}

/// Where the strain was measured, if the lines beside the table say so.
pub(super) fn strain_source(facts: &[Fact]) -> Option<StrainSource> {
    let strain = |f: &&Fact| {
        quantity::plain(&f.name).contains("strain") || quantity::plain(&f.name).contains("dehnung")
    };
    facts.iter().filter(strain).find_map(|f| quantity::strain_source(&f.text))
}

fn words(facts: &[Fact], names: &[String]) -> String {
    let parts = facts.iter().flat_map(|f| [f.name.as_str(), f.text.as_str()]);
    let all = quantity::plain(&parts.chain(names.iter().map(String::as_str)).collect::<Vec<_>>().join(" "));
    // A blank in front, so that "extension" is no "tension".
    format!(" {all}")
}

/// Stated greatest forces (N) with their facts: a table must hold them.
pub(super) fn greatest_forces(facts: &[Fact]) -> impl Iterator<Item = (&Fact, f64)> {
    const GREATEST: [&str; 8] = ["maximum", "max", "peak", "höchst", "maximal", "fmax", "макс", "最大"];
    facts.iter().filter_map(|fact| {
        let last = quantity::plain(fact.name.rsplit(" : ").next().unwrap_or_default());
        let greatest = GREATEST.iter().any(|w| quantity::has_word(&last, w));
        let about = last.contains(" at ") || last.contains(" bei ") || last.contains(" при ");
        let force = quantity::meaning(&last).quantity == Quantity::Force || last.contains("fmax");
        let limit = ["limit", "cell", "end", "range", "messdose"].iter().any(|w| last.contains(w));
        (greatest && force && !about && !limit).then(|| Some((fact, fact.si(Dimension::Force)?))).flatten()
    })
}

#[cfg(test)]
mod tests {
    use super::super::cells;
    use super::*;
    use std::path::Path;

    fn facts(text: &str) -> Vec<Fact> {
        let grid = cells::split(Path::new("a.csv"), text, Some(';')).expect("split");
        read(grid.rows.iter(), NumberStyle { decimal: '.', thousands: None }, grid.delimiter)
    }

    #[test]
    fn lines_of_every_form() {
        let facts = facts(
            "Specimen Thickness (mm);3;;\nSpecimen Cross-section (cm^2);0.18\nWidth : 6 mm\nSpeed;450;mm/min\n\
             Gauge length = 33 mm\nType of test;Pull-to-failure\nStrain calculation;from the crosshead\nalone\n",
        );
        assert_eq!(facts.len(), 8);
        let specimen = specimen(&facts, &SpecimenOverride::default());
        let close = |a: Option<f64>, b: f64| (a.expect("said") - b).abs() < 1e-12;
        assert!(close(specimen.thickness_m, 3e-3) && close(specimen.width_m, 6e-3));
        assert!(close(specimen.stated_area_m2, 18e-6) && close(specimen.area_of_sizes_m2(), 18e-6));
        assert!(close(specimen.gauge_length_m, 33e-3) && close(specimen.speed_m_s, 7.5e-3));
        assert_eq!(loading(&facts, &[]), Some(Loading::Tension));
        assert_eq!(strain_source(&facts), Some(StrainSource::Crosshead));
    }

    #[test]
    fn the_greatest_force_is_told_from_what_is_at_it() {
        let facts = facts(
            "Maximum Load : Flexure extension at Maximum Load;1.5;in\nMaximum Load : Maximum Load;131.2;lbf\n",
        );
        let greatest: Vec<f64> = greatest_forces(&facts).map(|(_, n)| n).collect();
        assert_eq!(greatest.len(), 1);
        assert!((greatest[0] - 583.6).abs() < 0.1, "{greatest:?}");
        assert_eq!(loading(&facts, &[]), Some(Loading::Flexure));
    }
}
