//! The models of NIST's nonlinear sets, as their files write them; b from 1 in the files, from 0 here.

use num_dual::{Dual64, DualNum};
use std::f64::consts::PI;

/// One set.
pub(crate) struct Set {
    /// Name of its file, without the ending.
    pub(crate) name: &'static str,
    /// The response is the logarithm of the first column.
    pub(crate) logarithm: bool,
    /// Parameters and predictors → response.
    pub(crate) model: fn(&[Dual64], &[f64]) -> Dual64,
}

const fn set(name: &'static str, model: fn(&[Dual64], &[f64]) -> Dual64) -> Set {
    Set { name, logarithm: false, model }
}

/// All 27 of the collection.
pub(crate) const MODELS: &[Set] = &[
    set("Bennett5", |b, x| b[0] * ((b[1] + x[0]).ln() / -b[2]).exp()),
    set("BoxBOD", |b, x| b[0] * (-(-b[1] * x[0]).exp() + 1.0)),
    set("Chwirut1", chwirut),
    set("Chwirut2", chwirut),
    set("DanWood", |b, x| b[0] * (b[1] * x[0].ln()).exp()),
    set("ENSO", enso),
    set("Eckerle4", |b, x| b[0] / b[1] * (square((-b[2] + x[0]) / b[1]) * -0.5).exp()),
    set("Gauss1", gauss),
    set("Gauss2", gauss),
    set("Gauss3", gauss),
    set("Hahn1", cubic_over_cubic),
    set("Kirby2", |b, x| {
        let x = x[0];
        (b[0] + b[1] * x + b[2] * x * x) / (b[3] * x + b[4] * x * x + 1.0)
    }),
    set("Lanczos1", lanczos),
    set("Lanczos2", lanczos),
    set("Lanczos3", lanczos),
    set("MGH09", |b, x| {
        let x = x[0];
        b[0] * (b[1] * x + x * x) / (b[2] * x + b[3] + x * x)
    }),
    set("MGH10", |b, x| b[0] * (b[1] / (b[2] + x[0])).exp()),
    set("MGH17", |b, x| b[0] + b[1] * (-b[3] * x[0]).exp() + b[2] * (-b[4] * x[0]).exp()),
    set("Misra1a", |b, x| b[0] * (-(-b[1] * x[0]).exp() + 1.0)),
    set("Misra1b", |b, x| {
        let half = b[1] * x[0] * 0.5 + 1.0;
        b[0] * (-(half * half).recip() + 1.0)
    }),
    set("Misra1c", |b, x| b[0] * (-(b[1] * x[0] * 2.0 + 1.0).sqrt().recip() + 1.0)),
    set("Misra1d", |b, x| b[0] * b[1] * x[0] / (b[1] * x[0] + 1.0)),
    Set { name: "Nelson", logarithm: true, model: |b, x| b[0] - b[1] * x[0] * (-b[2] * x[1]).exp() },
    set("Rat42", |b, x| b[0] / ((b[1] - b[2] * x[0]).exp() + 1.0)),
    set("Rat43", |b, x| b[0] * (-((b[1] - b[2] * x[0]).exp() + 1.0).ln() / b[3]).exp()),
    set("Roszman1", |b, x| b[0] - b[1] * x[0] - (b[2] / (-b[3] + x[0])).atan() / PI),
    set("Thurber", cubic_over_cubic),
];

fn square(d: Dual64) -> Dual64 {
    d * d
}

fn chwirut(b: &[Dual64], x: &[f64]) -> Dual64 {
    (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])
}

fn cubic_over_cubic(b: &[Dual64], x: &[f64]) -> Dual64 {
    let x = x[0];
    (b[0] + b[1] * x + b[2] * x * x + b[3] * x * x * x) / (b[4] * x + b[5] * x * x + b[6] * x * x * x + 1.0)
}

fn gauss(b: &[Dual64], x: &[f64]) -> Dual64 {
    let x = x[0];
    let peak =
        |height: Dual64, centre: Dual64, width: Dual64| height * (-square((-centre + x) / width)).exp();
    b[0] * (-b[1] * x).exp() + peak(b[2], b[3], b[4]) + peak(b[5], b[6], b[7])
}

fn lanczos(b: &[Dual64], x: &[f64]) -> Dual64 {
    (0..3).map(|k| b[2 * k] * (-b[2 * k + 1] * x[0]).exp()).sum()
}

fn enso(b: &[Dual64], x: &[f64]) -> Dual64 {
    let turn = |period: Dual64| period.recip() * (2.0 * PI * x[0]);
    let wave = |period: Dual64, c: Dual64, s: Dual64| c * turn(period).cos() + s * turn(period).sin();
    let year = 2.0 * PI * x[0] / 12.0;
    b[0] + b[1] * year.cos() + b[2] * year.sin() + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8])
}
