//! Which part of a heading is the name and which the unit? `Load (lbs)`, `gap_mm`, `Weg in mm`, `Нагрузка, кН`, `位移/mm`, `Load N`.

use super::quantity;
use super::unit::{self, Dimension, Unit};

/// A heading taken apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heading {
    /// The name without the unit.
    pub(super) name: String,
    /// The unit, if the heading has one that is known.
    pub(super) unit: Option<Unit>,
    /// The unit as it is written.
    pub(super) unit_text: String,
}

const BRACKETS: [(char, char); 4] = [('(', ')'), ('[', ']'), ('（', '）'), ('<', '>')];

/// Takes a heading apart. What is not known as a unit stays part of the name.
pub(super) fn read(heading: &str) -> Heading {
    let heading = heading.trim();
    let whole = || Heading { name: heading.to_owned(), unit: None, unit_text: String::new() };
    bracketed(heading).or_else(|| trailing(heading)).unwrap_or_else(whole)
}

/// The last brackets that hold a unit, or nothing.
fn bracketed(heading: &str) -> Option<Heading> {
    let mut groups: Vec<(usize, usize, &str)> = Vec::new();
    for (open, close) in BRACKETS {
        for (start, _) in heading.match_indices(open) {
            let inner = &heading[start + open.len_utf8()..];
            if let Some(length) = inner.find(close) {
                groups.push((start, start + open.len_utf8() + length + close.len_utf8(), &inner[..length]));
            }
        }
    }
    groups.sort_by_key(|g| g.0);
    groups.into_iter().rev().find_map(|(start, end, inner)| {
        let name = [&heading[..start], &heading[end..]].map(str::trim).join(" ").trim().to_owned();
        let unit = unit::parse(inner).filter(|u| believable(*u, inner, &name));
        let kept = unit.is_some() || inner.trim().is_empty();
        (kept && !name.is_empty()).then(|| Heading { name, unit, unit_text: inner.trim().to_owned() })
    })
}

/// A bare 1 or dash is a unit only beside a ratio: otherwise it counts channels.
fn believable(unit: Unit, text: &str, name: &str) -> bool {
    let ratio = quantity::meaning(name).quantity.dimension() == Some(Dimension::Ratio);
    text.chars().any(char::is_alphabetic) || unit.dimension != Dimension::Ratio || text.contains('%') || ratio
}

/// A unit behind the last separator. Why not any text: `Load_P` is no force in ponds, so that a unit of one letter must fit the name.
fn trailing(heading: &str) -> Option<Heading> {
    let separators = [" in ", ",", "/", "_", " "];
    // The longest unit that is one: "mm/mm" rather than "mm".
    let found = separators.iter().flat_map(|separator| {
        heading.match_indices(separator).filter_map(move |(at, _)| {
            let (name, text) = (heading[..at].trim(), heading[at + separator.len()..].trim());
            let unit = unit::parse(text).filter(|u| believable(*u, text, name))?;
            let meaning = quantity::meaning(name);
            let wanted = meaning.quantity.dimension();
            let fits = wanted == Some(unit.dimension)
                || meaning.length_or_ratio && unit.dimension == Dimension::Ratio;
            let long = text.chars().count() > 1 && *separator != " ";
            let clear = long || !matches!(*separator, "_" | " ");
            let open = wanted.is_none() && clear;
            let named = name.chars().any(char::is_alphabetic);
            (named && (fits || open || long && !meaning.by_letter)).then(|| {
                let name = name.trim_end_matches([',', ':', '/', '_']).trim().to_owned();
                (at, Heading { name, unit: Some(unit), unit_text: text.to_owned() })
            })
        })
    });
    found.min_by_key(|(at, _)| *at).map(|(_, heading)| heading)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_come_apart() {
        for (heading, name, unit) in [
            ("Load (lbs)", "Load", Some("lbf")),
            ("Ch:Strain (lbs)", "Ch:Strain", Some("lbf")),
            ("Cycles ()", "Cycles", None),
            ("gap_mm", "gap", Some("mm")),
            ("t_s", "t", Some("s")),
            ("temp_C", "temp", Some("°C")),
            ("phase(0 ramp 1 hold 2 unload)", "phase(0 ramp 1 hold 2 unload)", None),
            ("Tensile strain (Displacement) (%)", "Tensile strain (Displacement)", Some("%")),
            ("Tensile strain (Displacement)", "Tensile strain (Displacement)", None),
            ("Standardkraft [N]", "Standardkraft", Some("N")),
            ("Weg in mm", "Weg", Some("mm")),
            ("Нагрузка, кН", "Нагрузка", Some("kN")),
            ("位移/mm", "位移", Some("mm")),
            ("负荷（N）", "负荷", Some("N")),
            ("Strain mm/mm", "Strain", Some("mm/mm")),
            ("Strain/mm/mm", "Strain", Some("mm/mm")),
            ("Load N", "Load", Some("N")),
            ("Load (1)", "Load (1)", None),
            ("Strain (1)", "Strain", Some("mm/mm")),
            ("Strain 1", "Strain", Some("mm/mm")),
            ("Load 1", "Load 1", None),
            ("Load_P", "Load_P", None),
            ("Fz, N", "Fz", Some("N")),
            ("strain_lbs", "strain", Some("lbf")),
            ("True Stress (MPa)", "True Stress", Some("MPa")),
            ("Elongation %", "Elongation", Some("%")),
            ("Position (\")", "Position", Some("in")),
            ("Time", "Time", None),
            ("mm", "mm", None),
            ("", "", None),
        ] {
            let read = read(heading);
            assert_eq!((read.name.as_str(), read.unit.map(|u| u.name)), (name, unit), "{heading:?}");
        }
    }
}
