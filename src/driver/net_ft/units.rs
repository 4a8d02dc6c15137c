//! What the sensor's units are worth: names and codes of its configuration page → newtons and newton-metres, exactly.
//!
//! The pound is 0.45359237 kg and the inch 0.0254 m (international agreement of 1959), standard gravity is 9.80665 m/s² (3rd CGPM,
//! 1901), all by definition; NIST SP 811, appendix B.8 lists the products. Codes and names: ATI 9620-05 and 9610-05, tables of
//! `cfgfu` and `cfgtu`; spellings differ from one firmware to the next.

/// A pound-force (N): 0.45359237 × 9.80665.
const POUND_FORCE_N: f64 = 4.448_221_615_260_5;
/// A kilogram-force (N).
const KILOGRAM_FORCE_N: f64 = 9.806_65;
/// An inch (m).
const INCH_M: f64 = 0.0254;
/// A foot (m).
const FOOT_M: f64 = 0.3048;

/// A unit that the sensor counts in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    /// Its code on the page.
    pub(super) code: u8,
    /// What it is worth (N or N·m).
    pub(super) si: f64,
    /// Its names, without the marks between their parts and in lower case; the first is how to say it.
    names: &'static [&'static str],
}

/// Units of force.
pub(super) const FORCE: [Unit; 6] = [
    Unit { code: 1, si: POUND_FORCE_N, names: &["lbf", "lb", "lbs"] },
    Unit { code: 2, si: 1.0, names: &["n", "newton", "newtons"] },
    Unit { code: 3, si: POUND_FORCE_N * 1e3, names: &["klbf", "klb", "klbs"] },
    Unit { code: 4, si: 1e3, names: &["kn"] },
    Unit { code: 5, si: KILOGRAM_FORCE_N, names: &["kgf", "kg"] },
    Unit { code: 6, si: KILOGRAM_FORCE_N * 1e-3, names: &["gf", "g"] },
];

/// Units of torque.
pub(super) const TORQUE: [Unit; 6] = [
    Unit { code: 1, si: POUND_FORCE_N * INCH_M, names: &["lbfin", "lbin", "lbsin", "inlbf", "inlb"] },
    Unit { code: 2, si: POUND_FORCE_N * FOOT_M, names: &["lbfft", "lbft", "lbsft", "ftlbf", "ftlb"] },
    Unit { code: 3, si: 1.0, names: &["nm"] },
    Unit { code: 4, si: 1e-3, names: &["nmm"] },
    Unit { code: 5, si: KILOGRAM_FORCE_N * 1e-2, names: &["kgfcm", "kgcm"] },
    Unit { code: 6, si: 1e3, names: &["knm"] },
];

/// The unit of that name. Case, spaces and the marks between a name's parts do not count.
pub(super) fn named(units: &[Unit], name: &str) -> Option<Unit> {
    // A dot that came in another encoding than it claims is a replacement character.
    let marks =
        |c: &char| !matches!(c, '-' | '.' | '*' | '_' | '·' | '⋅' | '∙' | '\u{fffd}') && !c.is_whitespace();
    let plain: String = name.chars().filter(marks).flat_map(char::to_lowercase).collect();
    units.iter().find(|unit| unit.names.contains(&plain.as_str())).copied()
}

/// The unit of that code.
pub(super) fn coded(units: &[Unit], code: &str) -> Option<Unit> {
    let code: u8 = code.parse().ok()?;
    units.iter().find(|unit| unit.code == code).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NIST SP 811 (2008), appendix B.8: pound-force, pound-force inch, pound-force foot, kilogram-force, kip; products of the
    /// definitions in full.
    #[test]
    fn units_are_worth_what_is_published() {
        for (name, newtons) in [
            ("lbf", 4.448_221_615_260_5),
            ("N", 1.0),
            ("klbf", 4_448.221_615_260_5),
            ("kN", 1e3),
            ("kgf", 9.806_65),
            ("gf", 9.806_65e-3),
        ] {
            let unit = named(&FORCE, name).expect("a unit of force");
            assert!((unit.si / newtons - 1.0).abs() < 1e-15, "{name}: {}", unit.si);
        }
        for (name, newton_metres) in [
            ("lbf-in", 0.112_984_829_027_616_7),
            ("lbf-ft", 1.355_817_948_331_400_4),
            ("N-m", 1.0),
            ("N-mm", 1e-3),
            ("kgf-cm", 9.806_65e-2),
            ("kN-m", 1e3),
        ] {
            let unit = named(&TORQUE, name).expect("a unit of torque");
            assert!((unit.si / newton_metres - 1.0).abs() < 1e-15, "{name}: {}", unit.si);
        }
    }

    #[test]
    fn codes_follow_the_published_table() {
        for (codes, names, units) in [
            ("123456", ["lbf", "N", "klbf", "kN", "kgf", "gf"], &FORCE),
            ("123456", ["lbf-in", "lbf-ft", "Nm", "Nmm", "kgf-cm", "kNm"], &TORQUE),
        ] {
            for (code, name) in codes.chars().zip(names) {
                assert_eq!(coded(units, &code.to_string()), named(units, name));
            }
            assert_eq!([coded(units, "0"), coded(units, "7"), coded(units, "N")], [None; 3]);
        }
    }

    #[test]
    fn every_spelling_in_use_is_known() {
        for (spellings, code) in [
            (&["lbf-in", "lbf-in.", "Lb-in", "lbs-in", "LBF·IN", "in-lbf"][..], 1),
            (&["lbf-ft", "lb-ft", "ft-lb"], 2),
            (&["Nm", "N-m", "N m", "N·m", "N*m", "N.m", "N\u{fffd}m", "NM"], 3),
            (&["Nmm", "N-mm", "N·mm"], 4),
            (&["kg-cm", "kgf-cm", "Kg cm"], 5),
            (&["kNm", "kN-m", "KN·m"], 6),
        ] {
            for spelling in spellings {
                assert_eq!(named(&TORQUE, spelling).map(|u| u.code), Some(code), "{spelling}");
            }
        }
        for (spelling, code) in
            [("lb", 1), ("LBF", 1), (" N ", 2), ("Newton", 2), ("klb", 3), ("KN", 4), ("Kg", 5), ("g", 6)]
        {
            assert_eq!(named(&FORCE, spelling).map(|u| u.code), Some(code), "{spelling}");
        }
    }

    #[test]
    fn what_is_no_unit_is_none() {
        for name in ["", "-", "mN", "oz", "N/m", "Nm", "2"] {
            assert_eq!(named(&FORCE, name), None, "{name}");
        }
        for name in ["", "N", "N/m", "mN-m", "N-m-m-m", "3"] {
            assert_eq!(named(&TORQUE, name), None, "{name}");
        }
    }
}
