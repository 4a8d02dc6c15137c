//! What numbers may a key hold: unit, range, and the words that say so.
//!
//! The unit of a key, and of a variable, is what its name ends with: `depth_mm`, `speed_mm_s`, `hold_s`, `until_force_n`. A name
//! without such an end is a plain number.

/// Unit of a number in a protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    Plain,
    Millimetre,
    MillimetrePerSecond,
    Second,
    Newton,
}

impl Unit {
    /// The unit that a name ends with.
    pub(super) fn of(name: &str) -> Self {
        let ends = [
            ("_mm_s", Self::MillimetrePerSecond),
            ("_mm", Self::Millimetre),
            ("_s", Self::Second),
            ("_n", Self::Newton),
        ];
        ends.into_iter().find(|(end, _)| name.ends_with(end)).map_or(Self::Plain, |(_, unit)| unit)
    }

    /// What it is called.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Plain => "no unit",
            Self::Millimetre => "mm",
            Self::MillimetrePerSecond => "mm/s",
            Self::Second => "s",
            Self::Newton => "N",
        }
    }

    /// A value in this unit as SI.
    pub(super) fn si(self, value: f64) -> f64 {
        match self {
            Self::Millimetre | Self::MillimetrePerSecond => value * 1e-3,
            Self::Plain | Self::Second | Self::Newton => value,
        }
    }
}

/// Numbers that a key may hold, in the key's unit, both ends included. The ranges are wide: what the bench can do is for the plan to
/// say; these keep slips of the decimal point from becoming hours or kilometres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Allowed {
    pub(super) least: f64,
    pub(super) most: f64,
    pub(super) whole: bool,
}

impl Allowed {
    pub(super) const PLACE_MM: Self = Self::from_to(-10_000.0, 10_000.0);
    pub(super) const DEPTH_MM: Self = Self::from_to(0.001, 1000.0);
    pub(super) const SPEED_MM_S: Self = Self::from_to(0.001, 1000.0);
    pub(super) const TIME_S: Self = Self::from_to(0.0, 86_400.0);
    pub(super) const FORCE_N: Self = Self::from_to(0.001, 10_000.0);
    pub(super) const COMPONENT: Self = Self::from_to(-1000.0, 1000.0);
    pub(super) const RADIUS_MM: Self = Self::from_to(0.01, 1000.0);
    pub(super) const COUNT: Self = Self { least: 1.0, most: super::MOST_STROKES as f64, whole: true };
    pub(super) const SEED: Self = Self { least: 0.0, most: 4_294_967_295.0, whole: true };
    pub(super) const VARIABLE: Self = Self::from_to(-1e12, 1e12);

    const fn from_to(least: f64, most: f64) -> Self {
        Self { least, most, whole: false }
    }

    /// Whether `value` may be held.
    pub(super) fn holds(self, value: f64) -> bool {
        (self.least..=self.most).contains(&value) && (!self.whole || value.fract() == 0.0)
    }

    /// What is expected, in words.
    pub(super) fn words(self, unit: Unit) -> String {
        let what = if self.whole { "a whole number" } else { "a number" };
        let of = if unit == Unit::Plain { String::new() } else { format!(" of {}", unit.name()) };
        format!("{what}{of} from {} to {}", self.least, self.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_ends_in_its_unit() {
        for (name, unit, si) in [
            ("speed_mm_s", Unit::MillimetrePerSecond, 2e-3),
            ("deep_mm", Unit::Millimetre, 2e-3),
            ("hold_s", Unit::Second, 2.0),
            ("until_force_n", Unit::Newton, 2.0),
            ("repeats", Unit::Plain, 2.0),
            ("summ", Unit::Plain, 2.0),
        ] {
            assert_eq!(Unit::of(name), unit, "{name}");
            assert_eq!(unit.si(2.0), si, "{name}");
        }
    }

    #[test]
    fn ranges_include_their_ends_and_refuse_what_is_no_number() {
        assert!(Allowed::DEPTH_MM.holds(0.001) && Allowed::DEPTH_MM.holds(1000.0));
        assert!(!Allowed::DEPTH_MM.holds(0.0) && !Allowed::DEPTH_MM.holds(f64::NAN));
        assert!(!Allowed::TIME_S.holds(f64::INFINITY) && !Allowed::COUNT.holds(2.5));
        assert_eq!(Allowed::SPEED_MM_S.words(Unit::of("speed_mm_s")), "a number of mm/s from 0.001 to 1000");
    }
}
