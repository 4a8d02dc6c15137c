//! `strain-stiffening` as a function of its parameter: curves solved at a few values of it, and a polynomial between.

use super::super::error::DiagnoseError;
use super::curve::{Curve, Curves};
use super::lab::Lab;
use crate::fem::material::Law;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Which energy stiffens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StiffeningLaw {
    /// W = μ/(2b) (exp(b (Ī₁ − 3)) − 1) + κ/2 (J − 1)².
    Fung,
    /// W = μ/2 ((Ī₁ − 3) + c₂ (Ī₁ − 3)²) + κ/2 (J − 1)².
    Yeoh,
}

impl StiffeningLaw {
    /// As the physics catalogue calls it.
    pub fn id(self) -> &'static str {
        match self {
            Self::Fung => "fung",
            Self::Yeoh => "yeoh",
        }
    }

    /// Whose law it is.
    pub fn whose(self) -> &'static str {
        match self {
            Self::Fung => "Fung’s",
            Self::Yeoh => "Yeoh’s",
        }
    }

    /// The law with this `stiffening` (b or c₂).
    pub fn law(self, stiffening: f64) -> Law {
        match self {
            Self::Fung => Law::Fung { stiffening },
            Self::Yeoh => Law::Yeoh { stiffening },
        }
    }
}

/// Values of the parameter at which the body is solved; neighbours in ln(1 + b) are about as far apart.
const KNOTS: [f64; 5] = [0.0, 1.0, 3.0, 8.0, 20.0];

/// Neighbouring knots that are joined by one polynomial in ln(1 + b).
const TOGETHER: usize = 3;

/// Curves of one law by its parameter. Knots are solved when first asked for, and kept.
pub struct Stiffening {
    law: StiffeningLaw,
    zero: Arc<Zero>,
    /// From the second knot on.
    above: [OnceLock<Arc<Curves>>; KNOTS.len() - 1],
    rough: OnceLock<Arc<Curves>>,
}

/// Curves at the first knot, where all laws are one.
#[derive(Default)]
struct Zero {
    full: OnceLock<Arc<Curves>>,
    rough: OnceLock<Arc<Curves>>,
}

/// The parameter at which rough curves are solved besides 0.
const ROUGH_KNOT: f64 = 2.0;

/// Curves at one value of the parameter.
#[derive(Debug, Clone)]
pub struct Stiffened {
    /// What is added.
    pub curves: Curves,
    /// Its derivative by the parameter.
    pub by_stiffening: Curves,
}

impl Stiffening {
    /// For each of `laws`; solves nothing yet.
    pub fn of<const N: usize>(laws: [StiffeningLaw; N]) -> [Self; N] {
        let zero = Arc::new(Zero::default());
        laws.map(|law| Self {
            law,
            zero: Arc::clone(&zero),
            above: Default::default(),
            rough: OnceLock::new(),
        })
    }

    /// Curves of a lab, always the same one, and their derivative at `stiffening` (0 or more; at 0 they are those of
    /// `finite-strain`). The first call solves three knots, later ones at most as many as they go beyond.
    ///
    /// # Errors
    /// As [`Lab::curves`].
    pub fn at(&self, lab: &Lab, stiffening: f64) -> Result<Stiffened, DiagnoseError> {
        let stiffening = stiffening.max(0.0);
        let below = (KNOTS.partition_point(|&k| k <= stiffening) - 1).min(KNOTS.len() - 2);
        let first = below.saturating_sub(1);
        let mut stiffened = self.between(lab, first, stiffening)?;
        // A softer knot that cannot be pressed as deep as its stiffer neighbours must not end their curves.
        let around = self.knots(lab, below..below + 2)?;
        let reached = |poke: usize| around[0].pokes[poke].holds_to_m.min(around[1].pokes[poke].holds_to_m);
        let short = |c: &Curves| -> Vec<usize> {
            (0..c.pokes.len()).filter(|&poke| c.pokes[poke].holds_to_m < reached(poke)).collect()
        };
        let short = short(&stiffened.curves);
        if !short.is_empty() && below > first && below + TOGETHER <= KNOTS.len() {
            let without = self.between(lab, below, stiffening)?;
            for poke in short {
                stiffened.curves.pokes[poke] = without.curves.pokes[poke].clone();
                stiffened.by_stiffening.pokes[poke] = without.by_stiffening.pokes[poke].clone();
            }
        }
        Ok(stiffened)
    }

    /// The polynomial through the knots from `first` on.
    fn between(&self, lab: &Lab, first: usize, stiffening: f64) -> Result<Stiffened, DiagnoseError> {
        let first = first.min(KNOTS.len() - TOGETHER);
        let knots = first..first + TOGETHER;
        let curves = self.knots(lab, knots.clone())?;
        let t: Vec<f64> = KNOTS[knots].iter().map(|b| b.ln_1p()).collect();
        let (value, slope) = lagrange(&t, stiffening.ln_1p());
        let mix = |weights: &[f64]| Curves {
            pokes: (0..curves[0].pokes.len())
                .map(|poke| {
                    let parts: Vec<(f64, &Curve)> =
                        weights.iter().zip(&curves).map(|(w, c)| (*w, &c.pokes[poke])).collect();
                    Curve::mixed(&parts)
                })
                .collect(),
        };
        let slope: Vec<f64> = slope.iter().map(|s| s / (1.0 + stiffening)).collect();
        Ok(Stiffened { curves: mix(&value), by_stiffening: mix(&slope) })
    }

    /// As [`Stiffening::at`], roughly: along the line through 0 and 2, from two depths. Where the body has no equilibrium at 0
    /// as deep as at 2, the curve at 0 is taken as nothing.
    ///
    /// # Errors
    /// As [`Lab::curves`].
    pub fn roughly(&self, lab: &Lab, stiffening: f64) -> Result<Stiffened, DiagnoseError> {
        let laws = [(&self.zero.rough, KNOTS[0]), (&self.rough, ROUGH_KNOT)];
        let laws = laws.map(|(known, stiffening)| (known, self.law.law(stiffening)));
        let curves = filled(&laws, |laws| lab.rough_curves(laws))?;
        let (soft, stiff) = (&curves[0], &curves[1]);
        let share = stiffening.max(0.0) / ROUGH_KNOT;
        let mix = |of_soft: f64, of_stiff: f64| Curves {
            pokes: soft
                .pokes
                .iter()
                .zip(&stiff.pokes)
                .map(|(soft, stiff)| {
                    if soft.holds_to_m < stiff.holds_to_m {
                        Curve::mixed(&[(of_stiff, stiff)])
                    } else {
                        Curve::mixed(&[(of_soft, soft), (of_stiff, stiff)])
                    }
                })
                .collect(),
        };
        Ok(Stiffened {
            curves: mix(1.0 - share, share),
            by_stiffening: mix(-1.0 / ROUGH_KNOT, 1.0 / ROUGH_KNOT),
        })
    }

    /// The rough curves at 0.
    ///
    /// # Errors
    /// As [`Lab::curves`].
    pub fn roughly_zero(&self, lab: &Lab) -> Result<Arc<Curves>, DiagnoseError> {
        let all = filled(&[(&self.zero.rough, self.law.law(KNOTS[0]))], |laws| lab.rough_curves(laws))?;
        Ok(Arc::clone(&all[0]))
    }

    /// The curves at 0: those of `finite-strain`. Solves one knot.
    ///
    /// # Errors
    /// As [`Lab::curves`].
    pub fn at_zero(&self, lab: &Lab) -> Result<Arc<Curves>, DiagnoseError> {
        Ok(Arc::clone(&self.knots(lab, 0..1)?[0]))
    }

    fn knots(&self, lab: &Lab, knots: Range<usize>) -> Result<Vec<Arc<Curves>>, DiagnoseError> {
        let known = |knot: usize| match knot.checked_sub(1) {
            Some(above) => &self.above[above],
            None => &self.zero.full,
        };
        let knots: Vec<_> = knots.map(|knot| (known(knot), self.law.law(KNOTS[knot]))).collect();
        filled(&knots, |laws| lab.curves(laws))
    }
}

/// What is known of some laws, what is missing solved together. Solved outside the cells: a thread that helps with other work meanwhile must
/// not wait for itself.
fn filled(
    laws: &[(&OnceLock<Arc<Curves>>, Law)],
    solve: impl Fn(&[Law]) -> Result<Vec<Curves>, DiagnoseError>,
) -> Result<Vec<Arc<Curves>>, DiagnoseError> {
    let missing: Vec<_> = laws.iter().filter(|(known, _)| known.get().is_none()).collect();
    let asked: Vec<Law> = missing.iter().map(|(_, law)| *law).collect();
    for ((known, _), curves) in missing.into_iter().zip(solve(&asked)?) {
        known.get_or_init(|| Arc::new(curves));
    }
    Ok(laws.iter().filter_map(|(known, _)| known.get().cloned()).collect())
}

/// Weights of the polynomial through values at `knots`: of its value and of its derivative at `at`.
fn lagrange(knots: &[f64], at: f64) -> (Vec<f64>, Vec<f64>) {
    let others = |i: usize| (0..knots.len()).filter(move |&j| j != i);
    let scale = |i: usize| others(i).map(|j| knots[i] - knots[j]).product::<f64>();
    let value = |i: usize| others(i).map(|j| at - knots[j]).product::<f64>() / scale(i);
    let slope = |i: usize| {
        let without = |k: usize| others(i).filter(|&j| j != k).map(|j| at - knots[j]).product::<f64>();
        others(i).map(without).sum::<f64>() / scale(i)
    };
    (0..knots.len()).map(|i| (value(i), slope(i))).unzip()
}
