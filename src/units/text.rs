//! SI values as text for people: a value in the unit a bench engineer would say it in.

/// `2 pokes`, `1 poke`.
pub fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// A modulus or a pressure: `10.5 kPa`, `263.8 kPa`, `1.20 MPa`.
pub fn pascals(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude >= 1e6 {
        format!("{:.2} MPa", value * 1e-6)
    } else if magnitude >= 1e3 {
        format!("{:.2} kPa", value * 1e-3)
    } else {
        format!("{value:.1} Pa")
    }
}

/// A length in millimetres, to the micrometre: `12.345 mm`.
pub fn millimetres(value_m: f64) -> String {
    format!("{:.3} mm", value_m * 1e3)
}

/// A stiffness: `124.3 N/m`.
pub fn newtons_per_metre(value: f64) -> String {
    format!("{value:.1} N/m")
}

/// Three digits that count; a power of ten only where zeros would hide them: `0.168`, `30000`, `1.00e-5`.
pub fn three_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&digits) {
        return format!("{value:.2e}");
    }
    format!("{value:.*}", (2.0 - digits).max(0.0) as usize)
}

/// A value with its standard deviation in one unit, both rounded to the second digit of the deviation:
/// `with_sd(10123.4, 57.2, 1e-3, "kPa")` is `10.123 ± 0.057 kPa`.
pub fn with_sd(value: f64, sd: f64, scale: f64, unit: &str) -> String {
    let (value, sd) = (value * scale, sd * scale);
    if !(sd.is_finite() && sd > 0.0) {
        return format!("{value:.4} {unit}");
    }
    let decimals = (1.0 - sd.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$} ± {sd:.decimals$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deviation_sets_the_digits() {
        assert_eq!(with_sd(10_123.4, 57.2, 1e-3, "kPa"), "10.123 ± 0.057 kPa");
        assert_eq!(with_sd(121.94, 4.0, 1.0, "N/m"), "121.9 ± 4.0 N/m");
        assert_eq!(with_sd(121.94, 0.0, 1.0, "N/m"), "121.9400 N/m");
        assert_eq!(with_sd(5_000.0, 230.0, 1.0, "N/m"), "5000 ± 230 N/m");
    }

    #[test]
    fn a_number_keeps_three_digits() {
        let all = [0.0, 1234.5, -0.012_345, 1.0, 1e-4, 1e-9, 999_999.0, 1e6].map(three_digits);
        assert_eq!(all, ["0", "1234", "-0.0123", "1.00", "0.000100", "1.00e-9", "999999", "1.00e6"]);
    }

    #[test]
    fn a_modulus_is_said_in_its_own_size() {
        assert_eq!(pascals(10_500.0), "10.50 kPa");
        assert_eq!(pascals(1.2e6), "1.20 MPa");
        assert_eq!(pascals(12.0), "12.0 Pa");
        assert_eq!(millimetres(0.012345), "12.345 mm");
        assert_eq!(newtons_per_metre(124.3), "124.3 N/m");
    }
}
