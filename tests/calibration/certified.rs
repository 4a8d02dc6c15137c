//! Regressions beside the certified sets of NIST (Statistical Reference Datasets, itl.nist.gov/div898/strd).
//!
//! Digits: −log10 |estimate − certified| / |certified|, the least over a set's parameters, at most 11 (what the certificates carry); for linear
//! sets at most 15. The sets are read from `data/strd`, by what its files are called; a set without a file is left out.

use super::certified_models::{MODELS, Set};
use super::shared::folder;
use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;
use phantom_rig::calib::regression::{
    LinearFit, Model, Options, derivatives, fit, fit_linear, fit_polynomial,
};

/// One file.
struct Certificate {
    level: String,
    starts: [Vec<f64>; 2],
    certified: Vec<f64>,
    sd: Vec<f64>,
    rows: Vec<Vec<f64>>,
}

fn read(text: &str) -> Certificate {
    let level = ["Lower", "Average", "Higher"].iter().find(|l| text.contains(&format!("{l} Level")));
    let numbers =
        |line: &str| -> Vec<f64> { line.split_whitespace().filter_map(|w| w.parse().ok()).collect() };
    let mut certificate = Certificate {
        level: level.map_or("?", |l| l).to_owned(),
        starts: [Vec::new(), Vec::new()],
        certified: Vec::new(),
        sd: Vec::new(),
        rows: Vec::new(),
    };
    let parameter = |line: &str| {
        let line = line.trim_start();
        line.starts_with('b') && line[1..].starts_with(|c: char| c.is_ascii_digit()) && line.contains('=')
    };
    for line in text.lines().filter(|l| parameter(l)) {
        let n = numbers(line.split_once('=').expect("an equals sign").1);
        if let [one, two, value, sd] = n[..] {
            certificate.starts[0].push(one);
            certificate.starts[1].push(two);
            certificate.certified.push(value);
            certificate.sd.push(sd);
        }
    }
    let data = text.lines().enumerate().filter(|(_, l)| l.starts_with("Data:")).last().expect("data").0;
    certificate.rows = text.lines().skip(data + 1).map(numbers).filter(|n| n.len() >= 2).collect();
    certificate
}

struct Certified<'a> {
    set: &'a Set,
    rows: &'a [Vec<f64>],
}

impl Certified<'_> {
    fn left(&self, parameters: &[Dual64]) -> Vec<Dual64> {
        let measured = |row: &[f64]| if self.set.logarithm { row[0].ln() } else { row[0] };
        self.rows.iter().map(|r| -(self.set.model)(parameters, &r[1..]) + measured(r)).collect()
    }
}

impl Model for Certified<'_> {
    fn residuals(&self, parameters: &[f64]) -> Option<DVector<f64>> {
        let plain: Vec<Dual64> = parameters.iter().map(|p| Dual64::from(*p)).collect();
        let values = self.left(&plain).into_iter().map(|d| d.re);
        Some(DVector::from_iterator(self.rows.len(), values))
    }

    fn jacobian(&self, parameters: &[f64]) -> Option<DMatrix<f64>> {
        Some(derivatives(parameters, |p| self.left(p)))
    }
}

fn digits(found: &[f64], certified: &[f64], most: f64) -> f64 {
    let each = found.iter().zip(certified).map(|(f, c)| {
        let error = if *c == 0.0 { f.abs() } else { ((f - c) / c).abs() };
        if error == 0.0 { most } else { (-error.log10()).min(most) }
    });
    each.fold(most, |a, b| if b.is_nan() { 0.0 } else { a.min(b) })
}

#[test]
fn nonlinear_sets() {
    let Some(folder) = folder("strd") else { return };
    let mut short = Vec::new();
    println!("{:<10} {:<8} {:>7} {:>7} {:>7} {:>7}", "set", "level", "start 1", "start 2", "sd", "steps");
    let mut seen = 0;
    for set in MODELS {
        let Ok(text) = std::fs::read_to_string(folder.join(format!("{}.dat", set.name))) else { continue };
        seen += 1;
        let certificate = read(&text);
        let model = Certified { set, rows: &certificate.rows };
        let mut line = format!("{:<10} {:<8}", set.name, certificate.level);
        let mut last = (0.0, 0);
        for start in &certificate.starts {
            let found = fit(&model, start, &Options::default()).expect("sound");
            let right = digits(&found.parameters, &certificate.certified, 11.0);
            line += &format!(" {right:>7.1}");
            last = (digits(&found.sd, &certificate.sd, 11.0), found.steps);
            let needed = if certificate.level == "Higher" { 6.0 } else { 8.0 };
            if right < needed || !found.termination.is_answer() {
                short.push(format!(
                    "{} from {start:?}: {right:.1} digits, {}",
                    set.name,
                    found.termination.words()
                ));
            }
        }
        println!("{line} {:>7.1} {:>7}", last.0, last.1);
    }
    assert!(seen > 0 && short.is_empty(), "{seen} sets; {}", short.join("\n"));
}

/// Wampler's sets have whole numbers for answers and are solved to the last digit; Filip's powers up to ten need more than a double holds.
#[test]
fn linear_sets() {
    let Some(folder) = folder("strd") else { return };
    let text = std::fs::read_to_string(folder.join("linear.json")).expect("readable");
    let sets: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let list = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect()
    };
    println!("{:<10} {:>7} {:>7}", "set", "values", "sd");
    let mut short = Vec::new();
    for (name, set) in sets.as_object().expect("sets") {
        let rows: Vec<Vec<f64>> = set["predictors"].as_array().expect("rows").iter().map(list).collect();
        let y = list(&set["response"]);
        let model = set["model"].as_str().expect("a model");
        let found: LinearFit = match model.strip_prefix("polynomial degree ") {
            Some(degree) => {
                let xs: Vec<f64> = rows.iter().map(|r| r[0]).collect();
                fit_polynomial(&xs, &y, degree.parse().expect("a degree")).expect("sound")
            }
            None => {
                let rows: Vec<Vec<f64>> = rows.iter().map(|r| [&[1.0], r.as_slice()].concat()).collect();
                fit_linear(&rows, &y).expect("sound")
            }
        };
        let values = digits(&found.coefficients, &list(&set["certified_beta"]), 15.0);
        // Deviations of exact sets are zero but for rounding, of the size of the largest values.
        let certified = list(&set["certified_sd"]);
        let sd = if certified.iter().all(|s| *s == 0.0) {
            found.sd.iter().fold(15.0, |m: f64, s| m.min(-s.max(1e-15).log10()))
        } else {
            digits(&found.sd, &certified, 15.0)
        };
        println!("{name:<10} {values:>7.1} {sd:>7.1}");
        if values < 9.0 || sd < 9.0 {
            short.push(format!("{name}: {values:.1} and {sd:.1} digits"));
        }
    }
    assert!(short.is_empty(), "{}", short.join("\n"));
}
