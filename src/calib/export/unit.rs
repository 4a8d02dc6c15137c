//! How large is a unit that an export names? Text → dimension and SI factor.
//!
//! Spellings in English, German, Russian and Chinese. Masses beside a load (kg, g, lb) are taken for their weight at 9.80665 m/s²
//! (standard gravity, 3rd CGPM 1901). Pound and inch: international yard and pound agreement of 1959.

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// m
    Length,
    /// N
    Force,
    /// Pa
    Stress,
    /// 1
    Ratio,
    /// s
    Time,
    /// °C
    Temperature,
    /// m²
    Area,
    /// m/s
    Speed,
    /// 1/s
    Rate,
}

impl Dimension {
    /// What it is, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Length => "a length",
            Self::Force => "a force",
            Self::Stress => "a stress",
            Self::Ratio => "a ratio",
            Self::Time => "a time",
            Self::Temperature => "a temperature",
            Self::Area => "an area",
            Self::Speed => "a speed",
            Self::Rate => "a rate",
        }
    }

    /// Its SI unit; degrees Celsius for temperatures.
    pub fn si(self) -> &'static str {
        match self {
            Self::Length => "m",
            Self::Force => "N",
            Self::Stress => "Pa",
            Self::Ratio => "1",
            Self::Time => "s",
            Self::Temperature => "°C",
            Self::Area => "m²",
            Self::Speed => "m/s",
            Self::Rate => "1/s",
        }
    }
}

/// A unit: SI value = (number − zero) · factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// How people write it.
    pub name: &'static str,
    /// What it measures.
    pub dimension: Dimension,
    /// SI value of one.
    pub factor: f64,
    /// The number that stands for zero in SI.
    pub zero: f64,
}

impl Unit {
    /// A number of this unit in SI.
    pub fn to_si(&self, number: f64) -> f64 {
        (number - self.zero) * self.factor
    }
}

const fn unit(name: &'static str, dimension: Dimension, factor: f64) -> Unit {
    Unit { name, dimension, factor, zero: 0.0 }
}

/// The ratio itself, as mm/mm.
pub(super) const PLAIN_RATIO: Unit = unit("mm/mm", Ratio, 1.0);
/// The second.
pub(super) const SECOND: Unit = unit("s", Time, 1.0);
/// Hundredths.
pub(super) const PER_CENT: Unit = unit("%", Ratio, 1e-2);

const INCH: f64 = 0.0254;
const POUND: f64 = 4.448_221_615_260_5;
const KILOPOND: f64 = 9.806_65;
const MINUTE: f64 = 60.0;

use Dimension::{Area, Force, Length, Rate, Ratio, Speed, Stress, Temperature, Time};

/// Units with the ways to write them. Written in lower case they fit any case, otherwise exactly.
const UNITS: &[(Unit, &[&str])] = &[
    (
        unit("mm", Length, 1e-3),
        &["mm", "мм", "毫米", "millimeter", "millimetre", "millimeters", "millimetres"],
    ),
    (unit("cm", Length, 1e-2), &["cm", "см", "厘米"]),
    (unit("µm", Length, 1e-6), &["um", "µm", "мкм", "微米", "micron", "microns", "mikron"]),
    (unit("nm", Length, 1e-9), &["nm"]),
    (unit("m", Length, 1.0), &["m", "м", "米"]),
    (unit("in", Length, INCH), &["in", "in.", "inch", "inches", "\"", "zoll", "дюйм"]),
    (unit("mil", Length, INCH * 1e-3), &["mil", "mils", "thou"]),
    (unit("ft", Length, INCH * 12.0), &["ft", "feet"]),
    (unit("kN", Force, 1e3), &["kn", "кн", "千牛"]),
    (unit("MN", Force, 1e6), &["MN", "МН"]),
    (unit("mN", Force, 1e-3), &["mN", "mn", "мН", "мн", "毫牛"]),
    (unit("µN", Force, 1e-6), &["un", "µn"]),
    (unit("cN", Force, 1e-2), &["cn", "сн"]),
    (unit("daN", Force, 1e1), &["dan", "дан"]),
    (unit("N", Force, 1.0), &["n", "н", "牛", "牛顿", "newton", "newtons"]),
    (unit("lbf", Force, POUND), &["lbf", "lb", "lbs", "lb.", "lbs.", "pound", "pounds", "pound-force"]),
    (unit("klbf", Force, POUND * 1e3), &["klbf", "kip", "kips"]),
    (unit("ozf", Force, POUND / 16.0), &["ozf", "oz"]),
    (unit("kgf", Force, KILOPOND), &["kgf", "kp", "kg", "кгс", "кг", "公斤", "千克力"]),
    (unit("gf", Force, KILOPOND * 1e-3), &["gf", "g", "гс", "гр", "克力"]),
    (
        unit("MPa", Stress, 1e6),
        &[
            "MPa",
            "mpa",
            "Mpa",
            "MPA",
            "мпа",
            "兆帕",
            "n/mm2",
            "n/mm²",
            "n/mm^2",
            "н/мм2",
            "н/мм²",
            "牛/平方毫米",
        ],
    ),
    (unit("mPa", Stress, 1e-3), &["mPa"]),
    (unit("kPa", Stress, 1e3), &["kpa", "кпа", "千帕", "kn/m2", "kn/m²", "kn/m^2"]),
    (unit("GPa", Stress, 1e9), &["gpa", "гпа", "吉帕", "kn/mm2", "kn/mm²", "kn/mm^2"]),
    (unit("Pa", Stress, 1.0), &["pa", "па", "帕", "n/m2", "n/m²", "n/m^2"]),
    (unit("N/cm²", Stress, 1e4), &["n/cm2", "n/cm²", "n/cm^2"]),
    (
        unit("psi", Stress, POUND / (INCH * INCH)),
        &["psi", "lbf/in2", "lbf/in²", "lbf/in^2", "lb/in2", "lb/in²"],
    ),
    (unit("ksi", Stress, POUND * 1e3 / (INCH * INCH)), &["ksi"]),
    (unit("kgf/mm²", Stress, KILOPOND * 1e6), &["kgf/mm2", "kgf/mm²", "kgf/mm^2", "кгс/мм2", "кгс/мм²"]),
    (unit("kgf/cm²", Stress, KILOPOND * 1e4), &["kgf/cm2", "kgf/cm²", "kgf/cm^2", "кгс/см2", "кгс/см²"]),
    (unit("bar", Stress, 1e5), &["bar", "бар"]),
    (PER_CENT, &["%", "percent", "per cent", "pct", "prozent", "процент", "％"]),
    (unit("‰", Ratio, 1e-3), &["‰"]),
    (
        PLAIN_RATIO,
        &[
            "mm/mm",
            "in/in",
            "m/m",
            "cm/cm",
            "мм/мм",
            "strain",
            "1",
            "-",
            "–",
            "m m-1",
            "毫米/毫米",
            "mm·mm⁻¹",
        ],
    ),
    (
        unit("µm/m", Ratio, 1e-6),
        &["um/m", "µm/m", "µε", "ue", "ustrain", "µstrain", "microstrain", "мкм/м", "微应变"],
    ),
    (
        SECOND,
        &["s", "s.", "sec", "sec.", "secs", "second", "seconds", "sek", "sekunden", "с", "сек", "сек.", "秒"],
    ),
    (unit("ms", Time, 1e-3), &["ms", "msec", "мс", "毫秒"]),
    (unit("µs", Time, 1e-6), &["us", "µs", "мкс", "微秒"]),
    (
        unit("min", Time, MINUTE),
        &["min", "min.", "mins", "minute", "minutes", "minuten", "мин", "мин.", "分", "分钟"],
    ),
    (unit("h", Time, 3600.0), &["h", "hr", "hrs", "hour", "hours", "std", "ч", "час", "小时"]),
    (
        unit("°C", Temperature, 1.0),
        &["°c", "c", "degc", "deg c", "deg_c", "℃", "celsius", "ºc", "°с", "摄氏度"],
    ),
    (Unit { name: "K", dimension: Temperature, factor: 1.0, zero: 273.15 }, &["k", "kelvin"]),
    (
        Unit { name: "°F", dimension: Temperature, factor: 5.0 / 9.0, zero: 32.0 },
        &["°f", "degf", "deg f", "℉"],
    ),
    (unit("mm²", Area, 1e-6), &["mm2", "mm²", "mm^2", "мм2", "мм²", "мм^2", "平方毫米", "sq mm"]),
    (unit("cm²", Area, 1e-4), &["cm2", "cm²", "cm^2", "см2", "см²", "平方厘米"]),
    (unit("m²", Area, 1.0), &["m2", "m²", "m^2", "м2", "м²"]),
    (unit("in²", Area, INCH * INCH), &["in2", "in²", "in^2", "sq in"]),
    (unit("mm/min", Speed, 1e-3 / MINUTE), &["mm/min", "mm/min.", "мм/мин", "毫米/分", "毫米/分钟"]),
    (unit("mm/s", Speed, 1e-3), &["mm/s", "mm/sec", "мм/с", "毫米/秒"]),
    (unit("m/s", Speed, 1.0), &["m/s", "м/с"]),
    (unit("cm/min", Speed, 1e-2 / MINUTE), &["cm/min"]),
    (unit("in/min", Speed, INCH / MINUTE), &["in/min", "ipm"]),
    (unit("in/s", Speed, INCH), &["in/s", "in/sec"]),
    (unit("%/min", Rate, 1e-2 / MINUTE), &["%/min"]),
    (unit("%/s", Rate, 1e-2), &["%/s", "%/sec"]),
    (unit("1/s", Rate, 1.0), &["1/s", "hz", "гц", "/s", "mm/mm/s", "s^-1"]),
    (unit("1/min", Rate, 1.0 / MINUTE), &["1/min", "mm/mm/min"]),
];

/// Reads a unit, with or without brackets around it.
pub(super) fn parse(text: &str) -> Option<Unit> {
    let bare = bare(text).replace('μ', "µ");
    let lower = bare.to_lowercase();
    let exact = UNITS.iter().find(|(_, words)| words.contains(&bare.as_str()));
    let found = exact.or_else(|| UNITS.iter().find(|(_, words)| words.contains(&lower.as_str())));
    found.filter(|_| !bare.is_empty()).map(|(unit, _)| *unit)
}

/// The text without brackets and blanks around it.
pub(super) fn bare(text: &str) -> &str {
    let text = text.trim();
    let inner = [('(', ')'), ('[', ']'), ('<', '>'), ('（', '）'), ('{', '}'), ('【', '】')]
        .iter()
        .find_map(|(open, close)| text.strip_prefix(*open)?.strip_suffix(*close));
    inner.unwrap_or(text).trim()
}

/// The unit of a dimension whose factor is nearest to `factor`, if within `tolerance` of it.
pub(super) fn of_factor(dimension: Dimension, factor: f64, tolerance: f64) -> Option<Unit> {
    let off = |u: &Unit| (u.factor / factor - 1.0).abs();
    let same = UNITS.iter().map(|(unit, _)| *unit).filter(|u| u.dimension == dimension);
    same.min_by(|a, b| off(a).total_cmp(&off(b))).filter(|u| off(u) <= tolerance)
}

/// Spellings that hold letters beyond ASCII: what a wrong decoding would spoil.
pub(super) fn foreign_words() -> impl Iterator<Item = &'static str> {
    UNITS
        .iter()
        .flat_map(|(_, words)| words.iter().copied())
        .filter(|w| !w.is_ascii() && w.chars().count() > 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_means_its_unit() {
        for (unit, words) in UNITS {
            for word in *words {
                assert_eq!(parse(word), Some(*unit), "{word}");
                assert_eq!(parse(&format!("[{word}]")), Some(*unit), "{word}");
            }
        }
    }

    #[test]
    fn case_matters_only_where_it_must() {
        for (text, factor) in
            [("MPa", 1e6), ("Mpa", 1e6), ("mPa", 1e-3), ("MN", 1e6), ("mN", 1e-3), ("KN", 1e3)]
        {
            assert_eq!(parse(text).map(|u| u.factor), Some(factor), "{text}");
        }
        assert_eq!(parse("(LBF)").map(|u| u.name), Some("lbf"));
        assert_eq!(parse("counts"), None);
        assert_eq!(parse("()"), None);
    }

    /// NIST SP 811, appendix B.
    #[test]
    fn published_factors() {
        let psi = parse("psi").expect("known").factor;
        assert!((psi - 6_894.757).abs() < 1e-3, "{psi}");
        let fahrenheit = parse("°F").expect("known");
        assert!((fahrenheit.to_si(212.0) - 100.0).abs() < 1e-12);
        assert!((parse("K").expect("known").to_si(273.15)).abs() < 1e-12);
    }
}
