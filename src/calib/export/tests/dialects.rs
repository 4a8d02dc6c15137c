//! A table written in any of many dialects reads back to the same SI numbers, or is refused as ambiguous; none is read wrongly.

use super::*;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// A column to be written: names in four languages, units with factors, SI values, decimals for the first unit.
struct Kind {
    quantity: Quantity,
    names: [&'static str; 4],
    units: &'static [(&'static str, f64)],
    most: f64,
}

const POUND: f64 = 4.448_221_615_260_5;
const INCH: f64 = 0.0254;

const KINDS: [Kind; 5] = [
    Kind {
        quantity: Quantity::Time,
        names: ["Time", "Prüfzeit", "Время", "时间"],
        units: &[("s", 1.0), ("min", 60.0), ("ms", 1e-3), ("sec", 1.0)],
        most: 900.0,
    },
    Kind {
        quantity: Quantity::Extension,
        names: ["Crosshead", "Traversenweg", "Перемещение", "位移"],
        units: &[("mm", 1e-3), ("in", INCH), ("m", 1.0), ("µm", 1e-6), ("cm", 1e-2)],
        most: 0.08,
    },
    Kind {
        quantity: Quantity::Force,
        names: ["Load", "Standardkraft", "Нагрузка", "负荷"],
        units: &[
            ("N", 1.0),
            ("kN", 1e3),
            ("mN", 1e-3),
            ("lbf", POUND),
            ("lbs", POUND),
            ("kgf", 9.80665),
            ("gf", 9.80665e-3),
        ],
        most: 40.0,
    },
    Kind {
        quantity: Quantity::Stress,
        names: ["Stress", "Spannung", "Напряжение", "应力"],
        units: &[("MPa", 1e6), ("kPa", 1e3), ("psi", POUND / (INCH * INCH)), ("Pa", 1.0)],
        most: 2.0e6,
    },
    Kind {
        quantity: Quantity::Strain,
        names: ["Strain", "Dehnung", "Относительное удлинение", "应变"],
        units: &[("%", 1e-2), ("mm/mm", 1.0)],
        most: 2.4,
    },
];

struct Written {
    text: String,
    bytes: Vec<u8>,
    /// SI values of each column, as far as its printed digits go.
    truth: Vec<(Quantity, Vec<f64>)>,
    words: String,
}

fn pick<T: Copy>(random: &mut StdRng, of: &[T]) -> T {
    of[random.random_range(0..of.len())]
}

/// A number in a style.
fn print(value: f64, decimals: usize, decimal: char, thousands: Option<char>, scientific: bool) -> String {
    if scientific {
        return format!("{value:.*e}", decimals.max(4)).replace('.', &decimal.to_string()).replace('e', "E");
    }
    let plain = format!("{value:.decimals$}");
    let (whole, fraction) = plain.split_once('.').unwrap_or((&plain, ""));
    let (sign, digits) = whole.strip_prefix('-').map_or(("", whole), |d| ("-", d));
    let mut out = String::from(sign);
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i) % 3 == 0 {
            out.extend(thousands);
        }
        out.push(c);
    }
    if !fraction.is_empty() {
        out.push(decimal);
        out.push_str(fraction);
    }
    out
}

fn write(random: &mut StdRng) -> Written {
    let delimiter = pick(random, &[',', ';', '\t', '|', ' ']);
    let decimal = pick(random, &['.', ',']);
    let language = random.random_range(0..4_usize);
    let quoted = random.random_bool(0.3) && delimiter != ' ';
    let bare_comma = delimiter == ',' && !quoted;
    let decimal = if bare_comma { '.' } else { decimal };
    let thousands = match random.random_range(0..4) {
        0 if !bare_comma || decimal == ',' => Some(if decimal == '.' { ',' } else { '.' }),
        1 if delimiter != ' ' => Some(pick(random, &['\u{a0}', ' ', '\''])),
        _ => None,
    };
    let thousands = thousands.filter(|t| !(bare_comma && *t == ','));
    let (scientific, decimals) = (random.random_bool(0.15), random.random_range(0..7_usize));
    let end = pick(random, &["\n", "\r\n"]);
    let units_row = random.random_bool(0.5);
    let form = random.random_range(0..6_usize);
    let negative = random.random_bool(0.2);
    let rows = random.random_range(3..40_usize);
    let mut kinds: Vec<&Kind> = KINDS.iter().collect();
    while kinds.len() > 2 && random.random_bool(0.4) {
        kinds.remove(random.random_range(0..kinds.len()));
    }
    for i in (1..kinds.len()).rev() {
        kinds.swap(i, random.random_range(0..=i));
    }
    let quote = |text: &str| if quoted { format!("\"{text}\"") } else { text.to_owned() };
    let separator = delimiter.to_string();
    let (mut headings, mut units, mut cells, mut truth) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for kind in &kinds {
        let (unit, factor) = pick(random, kind.units);
        let name = kind.names[language];
        let name = if delimiter == ' ' { name.replace(' ', "") } else { name.to_owned() };
        let heading = match form {
            _ if units_row => name.clone(),
            0 => format!("{name}[{unit}]"),
            1 if delimiter != ' ' => format!("{name} in {unit}"),
            2 if delimiter != ',' && delimiter != ' ' => format!("{name}, {unit}"),
            3 => format!("{name}_{unit}"),
            4 => format!("{name}/{unit}"),
            _ => format!("{name}({unit})"),
        };
        headings.push(quote(&heading));
        units.push(quote(&if form % 2 == 0 { format!("({unit})") } else { unit.to_owned() }));
        let forces = matches!(kind.quantity, Quantity::Force | Quantity::Stress);
        let sign = if forces && negative { -1.0 } else { 1.0 };
        let printed: Vec<String> = (0..rows)
            .map(|i| {
                let share = (i as f64 + 1.0) / rows as f64;
                print(sign * share * kind.most / factor, decimals, decimal, thousands, scientific)
            })
            .collect();
        let number = |t: &String| {
            let digits: String = t.chars().filter(|c| Some(*c) != thousands).collect();
            digits.replace(decimal, ".").parse::<f64>().expect("as printed") * factor
        };
        truth.push((kind.quantity, printed.iter().map(number).collect::<Vec<_>>()));
        cells.push(printed);
    }
    // A pull that is written negative is turned wherever a length shows it.
    let changes = |(q, v): &(Quantity, Vec<f64>)| {
        matches!(q, Quantity::Extension | Quantity::Strain) && v.iter().any(|x| *x != v[0])
    };
    let stretched = truth.iter().any(changes);
    for (quantity, values) in &mut truth {
        let force =
            matches!(quantity, Quantity::Force | Quantity::Stress) && values.iter().any(|x| *x != values[0]);
        if stretched && force && negative {
            values.iter_mut().for_each(|v| *v = -*v);
        }
    }
    let mut lines: Vec<String> = Vec::new();
    if random.random_bool(0.5) {
        lines.push(
            ["Specimen properties", "Prüfprotokoll", "Протокол испытаний", "试验报告"][language].to_owned(),
        );
        lines.push(
            ["Gauge length : 33.333 mm", "Versuch: Zug", "Образец : 3", "材料 : 硅胶"][language]
                .replace("33.333", &print(33.333, 4, decimal, None, false)),
        );
        if delimiter != ' ' {
            lines.push(
                ["Machine", "Prüfmaschine", "Машина", "试验机"].map(quote)[language].clone()
                    + &separator
                    + "A 1",
            );
        }
        if random.random_bool(0.5) {
            lines.push(String::new());
        }
    }
    let trailing = if delimiter != ' ' && random.random_bool(0.2) { separator.as_str() } else { "" };
    lines.push(headings.join(&separator) + trailing);
    if units_row {
        lines.push(units.join(&separator) + trailing);
    }
    for row in 0..rows {
        let row: Vec<String> = cells.iter().map(|c| quote(&c[row])).collect();
        lines.push(row.join(&separator) + trailing);
        if random.random_bool(0.02) {
            lines.push(String::new());
        }
    }
    let text = lines.join(end) + if random.random_bool(0.8) { end } else { "" };
    let (bytes, encoding) = encode(random, &text, language);
    let words = format!(
        "{encoding}, delimiter {delimiter:?}, decimal {decimal:?}, thousands {thousands:?}, {decimals} decimals"
    );
    Written { text, bytes, truth, words }
}

fn encode(random: &mut StdRng, text: &str, language: usize) -> (Vec<u8>, &'static str) {
    let wide = |text: &str, little: bool| -> Vec<u8> {
        text.encode_utf16().flat_map(|u| if little { u.to_le_bytes() } else { u.to_be_bytes() }).collect()
    };
    let page =
        [encoding_rs::WINDOWS_1252, encoding_rs::WINDOWS_1252, encoding_rs::WINDOWS_1251, encoding_rs::GBK]
            [language];
    match random.random_range(0..8) {
        0 => (format!("\u{feff}{text}").into_bytes(), "UTF-8 with a mark"),
        1 => (wide(&format!("\u{feff}{text}"), true), "UTF-16LE with a mark"),
        2 => (wide(&format!("\u{feff}{text}"), false), "UTF-16BE with a mark"),
        3 => (wide(text, true), "UTF-16LE"),
        4 => (wide(text, false), "UTF-16BE"),
        5 | 6 if !page.encode(text).2 => (page.encode(text).0.into_owned(), page.name()),
        _ => (text.as_bytes().to_vec(), "UTF-8"),
    }
}

enum Outcome {
    Read,
    Ambiguous,
    Wrong(String),
}

fn outcome(written: &Written) -> Outcome {
    let export = match read_bytes(Path::new("a.csv"), written.bytes.clone(), &Override::default()) {
        Ok(export) => export,
        Err(ExportError::DecimalAmbiguous { .. }) => return Outcome::Ambiguous,
        Err(error) => return Outcome::Wrong(error.to_string()),
    };
    let [table] = export.tables.as_slice() else { return Outcome::Wrong("several tables".to_owned()) };
    for (quantity, truth) in &written.truth {
        let found = match table.series(&[*quantity]) {
            Ok(series) => series.values,
            Err(error) => return Outcome::Wrong(error.to_string()),
        };
        let close = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-12 * b.abs();
        if found[0].len() != truth.len() || !found[0].iter().zip(truth).all(close) {
            return Outcome::Wrong(format!("{quantity}: {:?} for {truth:?}", found[0]));
        }
    }
    Outcome::Read
}

#[test]
fn a_table_in_any_dialect_is_read_or_refused_as_ambiguous() {
    let cases = std::env::var("EXPORT_DIALECTS").ok().map_or(2_000, |n| n.parse().expect("a number"));
    let mut random = StdRng::seed_from_u64(7);
    let (mut read, mut ambiguous, mut wrong) = (0_u64, 0_u64, 0_u64);
    for case in 0..cases {
        let written = write(&mut random);
        match outcome(&written) {
            Outcome::Read => read += 1,
            Outcome::Ambiguous => ambiguous += 1,
            Outcome::Wrong(why) => {
                wrong += 1;
                if wrong < 6 {
                    let head: String = written.text.chars().take(400).collect();
                    println!("case {case}: {}\n{why:.600}\n{head}\n", written.words);
                }
            }
        }
    }
    println!("{cases} dialects: {read} read, {ambiguous} refused as ambiguous, {wrong} wrong");
    assert_eq!(wrong, 0);
    assert!(10 * read > 8 * cases, "most can be told");
}
