//! What does a column hold, going by its name? English, German, Russian, Chinese and the usual letters of formulas.

use super::unit::Dimension;
use super::vocabulary::{
    CROSSHEAD, ELONGATION, EXTENSOMETER, EXTREMES, LETTERS, MORE, STATISTICS, TRUE, WORDS,
};
use Quantity as Q;
use std::fmt;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Time since the start.
    Time,
    /// How much longer the specimen got, or how far the crosshead went.
    Extension,
    /// Distance between grips or plates, or the whole length of the specimen.
    Gap,
    /// Force on the specimen.
    Force,
    /// Force over the first cross-section.
    Stress,
    /// Force over the present cross-section.
    TrueStress,
    /// Extension over the first length.
    Strain,
    /// ln(1 + strain).
    TrueStrain,
    /// Number of the cycle.
    Cycle,
    /// Temperature.
    Temperature,
    /// Which specimen a row belongs to.
    Specimen,
    /// Width of the specimen.
    Width,
    /// Thickness of the specimen.
    Thickness,
    /// Diameter of the specimen.
    Diameter,
    /// First cross-section.
    Area,
    /// First length between marks or grips.
    GaugeLength,
    /// Speed of the crosshead, or rate of strain.
    Speed,
    /// Anything else; kept under its name.
    Other,
}

impl Quantity {
    /// What its unit must measure; none where any will do.
    pub fn dimension(self) -> Option<Dimension> {
        Some(match self {
            Self::Time => Dimension::Time,
            Self::Extension
            | Self::Gap
            | Self::Width
            | Self::Thickness
            | Self::Diameter
            | Self::GaugeLength => Dimension::Length,
            Self::Force => Dimension::Force,
            Self::Stress | Self::TrueStress => Dimension::Stress,
            Self::Strain | Self::TrueStrain | Self::Cycle => Dimension::Ratio,
            Self::Temperature => Dimension::Temperature,
            Self::Area => Dimension::Area,
            Self::Speed | Self::Specimen | Self::Other => return None,
        })
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Time => "time",
            Self::Extension => "extension",
            Self::Gap => "gap",
            Self::Force => "force",
            Self::Stress => "stress",
            Self::TrueStress => "true stress",
            Self::Strain => "strain",
            Self::TrueStrain => "true strain",
            Self::Cycle => "cycle",
            Self::Temperature => "temperature",
            Self::Specimen => "specimen",
            Self::Width => "width",
            Self::Thickness => "thickness",
            Self::Diameter => "diameter",
            Self::Area => "cross-section",
            Self::GaugeLength => "gauge length",
            Self::Speed => "speed",
            Self::Other => "something else",
        })
    }
}

/// How a name was understood.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Meaning {
    pub(super) quantity: Quantity,
    /// A letter such as F: believed only beside a unit that fits.
    pub(super) by_letter: bool,
    /// A word that is used of millimetres and of per cent alike.
    pub(super) length_or_ratio: bool,
}

/// Where a strain or an extension was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StrainSource {
    /// By the crosshead: grips and machine give way too.
    Crosshead,
    /// On the specimen.
    Extensometer,
}

/// Whether a word is in a name; short ones only as a whole word, those with a dash in front as the end of one.
pub(super) fn has_word(name: &str, word: &str) -> bool {
    if let Some(end) = word.strip_prefix('-') {
        return name.split(|c: char| !c.is_alphanumeric()).any(|token| token.ends_with(end));
    }
    if !word.is_ascii() || word.contains([' ', '&']) || word.len() > 4 {
        return name.contains(word);
    }
    name.split(|c: char| !c.is_alphanumeric()).any(|token| token == word)
}

fn any_word(name: &str, words: &[&str]) -> bool {
    words.iter().any(|word| has_word(name, word))
}

/// A name as words are looked for in it: lower case, one blank between words.
pub(super) fn plain(name: &str) -> String {
    name.split(|c: char| c.is_whitespace() || c == '_')
        .filter(|w| !w.is_empty())
        .collect::<Vec<_>>()
        .join(" ")
        .to_lowercase()
}

/// What a name says that its column holds.
pub(super) fn meaning(name: &str) -> Meaning {
    let name = plain(name);
    let sure = |quantity| Meaning { quantity, by_letter: false, length_or_ratio: false };
    let found = WORDS.iter().find(|(_, words)| any_word(&name, words)).map(|(quantity, _)| *quantity);
    let first = |q: Quantity| WORDS.iter().position(|(other, _)| *other == q);
    // Elongations stand below stress and strain, above times and forces.
    if any_word(&name, ELONGATION) && found.is_none_or(|q| first(q) > first(Q::Strain)) {
        return Meaning { quantity: Q::Extension, by_letter: false, length_or_ratio: true };
    }
    match found {
        Some(Q::Stress) if any_word(&name, TRUE) => sure(Q::TrueStress),
        Some(Q::Strain) if any_word(&name, TRUE) => sure(Q::TrueStrain),
        Some(Q::Extension) => Meaning { quantity: Q::Extension, by_letter: false, length_or_ratio: true },
        Some(quantity) => sure(quantity),
        None => {
            let by_letter = LETTERS.iter().find(|(_, letters)| letters.contains(&name.as_str()));
            match by_letter {
                Some((quantity, _)) => {
                    Meaning { quantity: *quantity, by_letter: true, length_or_ratio: false }
                }
                None => sure(Q::Other),
            }
        }
    }
}

/// Whether the column holds a few values of another one, as peaks and valleys do.
pub(super) fn is_extreme(name: &str) -> bool {
    any_word(&plain(name), EXTREMES)
}

/// Whether the text opens a row of statistics.
pub(super) fn is_statistic(text: &str) -> bool {
    let text = plain(text);
    STATISTICS.contains(&text.trim_end_matches(['.', ':']).trim())
}

/// Where the strain or extension was measured, going by words.
pub(super) fn strain_source(text: &str) -> Option<StrainSource> {
    let text = plain(text);
    if any_word(&text, EXTENSOMETER) {
        return Some(StrainSource::Extensometer);
    }
    any_word(&text, CROSSHEAD).then_some(StrainSource::Crosshead)
}

/// Words with letters beyond ASCII: what a wrong decoding would spoil.
pub(super) fn foreign_words() -> impl Iterator<Item = &'static str> {
    let words = WORDS.iter().flat_map(|(_, words)| words.iter());
    words.chain(ELONGATION).chain(MORE).copied().filter(|w| !w.is_ascii() && w.chars().count() > 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_four_languages() {
        for (name, quantity) in [
            ("Tensile strain (Displacement)", Q::Strain),
            ("Tensile stress", Q::Stress),
            ("Flexure load", Q::Force),
            ("S:Position", Q::Extension),
            ("Ch:Load", Q::Force),
            ("Standardkraft", Q::Force),
            ("Prüfzeit", Q::Time),
            ("Dehnung", Q::Extension),
            ("Standardweg", Q::Extension),
            ("Traversenweg", Q::Extension),
            ("Zugspannung", Q::Stress),
            ("Нагрузка", Q::Force),
            ("Перемещение траверсы", Q::Extension),
            ("Время", Q::Time),
            ("Напряжение", Q::Stress),
            ("Относительное удлинение", Q::Strain),
            ("负荷", Q::Force),
            ("位移", Q::Extension),
            ("应力", Q::Stress),
            ("应变", Q::Strain),
            ("时间", Q::Time),
            ("变形", Q::Extension),
            ("True Stress", Q::TrueStress),
            ("True strain", Q::TrueStrain),
            ("Strain rate", Q::Speed),
            ("Cycle Elapsed Time", Q::Other),
            ("Cycles", Q::Cycle),
            ("gap", Q::Gap),
            ("F", Q::Force),
            ("SD", Q::Other),
            ("Young's modulus", Q::Other),
            ("Specimen", Q::Specimen),
            ("Specimen Width", Q::Width),
            ("Specimen Length", Q::GaugeLength),
            ("phase(0 ramp 1 hold)", Q::Other),
            ("Lastwechsel", Q::Other),
        ] {
            assert_eq!(meaning(name).quantity, quantity, "{name}");
        }
        assert!(meaning("F").by_letter && meaning("Dehnung").length_or_ratio);
        assert!(is_extreme("Ch:Load_P&V") && !is_extreme("Ch:Load"));
    }

    #[test]
    fn where_a_strain_comes_from() {
        assert_eq!(strain_source("Tensile strain (Displacement)"), Some(StrainSource::Crosshead));
        assert_eq!(strain_source("Strain (Video axial)"), Some(StrainSource::Extensometer));
        assert_eq!(strain_source("Dehnung"), None);
    }
}
