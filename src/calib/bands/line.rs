//! Force of a band against its extension: nothing while it is slack, then a line that may bend.
//!
//! F = tare + k (x − x₀)₊, and with a knee + k₂ (x − x₁)₊ (another band comes to bear, or rubber softens), or with a curve + q (x − x₀)₊² + c (x − x₀)₊³.
//! The tare is told where rows lie in the slack; elsewhere it is the force that the machine calls zero, and x₀ takes it up.

use crate::calib::regression::{Model, Options, Regression, Termination, derivatives, fit};
use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;

/// Places tried for slack and knee.
const PLACES: usize = 40;
/// Rows of the slack that tell a tare.
const SLACK_ROWS: usize = 5;

/// How the line bends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bend {
    /// Straight.
    None,
    /// At a knee.
    Knee,
    /// All along, to the third power.
    Curve,
}

impl Bend {
    /// All, from few parameters to many.
    pub const ALL: [Self; 3] = [Self::None, Self::Knee, Self::Curve];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::None => "straight beyond the slack",
            Self::Knee => "two slopes with a knee",
            Self::Curve => "a curve beyond the slack",
        }
    }
}

/// A fitted line.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// How it bends.
    pub bend: Bend,
    /// x₀: where the band begins to pull (m).
    pub slack_m: f64,
    /// Its standard deviation (m).
    pub slack_sd_m: f64,
    /// Where a knee is (m).
    pub knee_m: Option<f64>,
    /// Slope right behind the slack (N/m).
    pub slope_n_per_m: f64,
    /// Its standard deviation (N/m).
    pub slope_sd_n_per_m: f64,
    /// Force of the slack band (N); zero where no row tells it.
    pub tare_n: f64,
    /// Root mean square of what is left (N).
    pub left_n: f64,
    /// Whether the search came to a minimum. One that is stuck at a corner between two rows has no derivative there to tell.
    pub is_minimum: bool,
    /// x₀, k, and k₂ and x₁, or q and c; the tare last where it is told.
    parameters: Vec<f64>,
    has_tare: bool,
    covariance: DMatrix<f64>,
}

struct Fitted<'a> {
    bend: Bend,
    tare: bool,
    points: &'a [(f64, f64)],
}

fn beyond(x: Dual64) -> Dual64 {
    if x.re > 0.0 { x } else { Dual64::from(0.0) }
}

fn force(bend: Bend, tare: bool, p: &[Dual64], x: f64) -> Dual64 {
    let over = beyond(-p[0] + x);
    let mut sum = p[1] * over;
    match bend {
        Bend::None => {}
        Bend::Knee => sum += p[2] * beyond(-p[3] + x),
        Bend::Curve => sum += p[2] * over * over + p[3] * over * over * over,
    }
    if tare { sum + p[p.len() - 1] } else { sum }
}

impl Fitted<'_> {
    fn left(&self, p: &[Dual64]) -> Vec<Dual64> {
        self.points.iter().map(|(x, f)| -force(self.bend, self.tare, p, *x) + *f).collect()
    }
}

impl Model for Fitted<'_> {
    fn residuals(&self, parameters: &[f64]) -> Option<DVector<f64>> {
        let plain: Vec<Dual64> = parameters.iter().map(|p| Dual64::from(*p)).collect();
        Some(DVector::from_vec(self.left(&plain).into_iter().map(|d| d.re).collect()))
    }

    fn jacobian(&self, parameters: &[f64]) -> Option<DMatrix<f64>> {
        Some(derivatives(parameters, |p| self.left(p)))
    }
}

/// Least squares in plain doubles, for starts: coefficients and Σ residual²; none where columns depend on each other.
fn quick(rows: &[Vec<f64>], values: &[f64]) -> Option<(Vec<f64>, f64)> {
    let p = rows.first()?.len();
    let design = DMatrix::from_fn(rows.len(), p, |i, j| rows[i][j]);
    let scale: Vec<f64> = design.column_iter().map(|c| c.norm()).collect();
    if scale.contains(&0.0) {
        return None;
    }
    let scaled = DMatrix::from_fn(rows.len(), p, |i, j| design[(i, j)] / scale[j]);
    let mut right = DVector::from_column_slice(values);
    let qr = scaled.qr();
    qr.q_tr_mul(&mut right);
    let solved = qr.r().solve_upper_triangular(&right.rows(0, p).into_owned())?;
    let squares = right.rows_range(p..).norm_squared();
    Some((solved.iter().zip(&scale).map(|(b, s)| b / s).collect(), squares))
}

impl Line {
    /// Fits points in order of extension; none where no start comes to an answer.
    pub fn fit(bend: Bend, points: &[(f64, f64)]) -> Option<Self> {
        let (low, high) = (points.first()?.0, points.last()?.0);
        let place = |i: usize| low + (high - low) * i as f64 / PLACES as f64;
        // Starts by brute force, since corners have no derivative: linear fits with the places fixed.
        let mut best: Option<(Vec<f64>, bool, f64)> = None;
        for i in 0..PLACES * 3 / 4 {
            let slack = place(i);
            let tare = points.iter().filter(|(x, _)| *x < slack).count() >= SLACK_ROWS;
            let knees: Vec<f64> =
                if bend == Bend::Knee { (i + 3..PLACES - 2).map(place).collect() } else { vec![high] };
            for knee in knees {
                let row = |x: f64| {
                    let over = (x - slack).max(0.0);
                    let mut row = vec![over];
                    match bend {
                        Bend::None => {}
                        Bend::Knee => row.push((x - knee).max(0.0)),
                        Bend::Curve => row.extend([over * over, over * over * over]),
                    }
                    row.extend(tare.then_some(1.0));
                    row
                };
                let rows: Vec<Vec<f64>> = points.iter().map(|(x, _)| row(*x)).collect();
                let forces: Vec<f64> = points.iter().map(|(_, f)| *f).collect();
                let Some((coefficients, squares)) = quick(&rows, &forces) else { continue };
                if best.as_ref().is_none_or(|(_, _, least)| squares < *least) {
                    let mut p = vec![slack];
                    p.extend(&coefficients);
                    if bend == Bend::Knee {
                        p.insert(3, knee);
                    }
                    best = Some((p, tare, squares));
                }
            }
        }
        let (start, tare, _) = best?;
        let options = Options { radius: 0.1, ..Options::default() };
        let mut tare = tare;
        let mut found: Regression = fit(&Fitted { bend, tare, points }, &start, &options).ok()?;
        // A tare without rows in the slack is no tare: slack and tare could be exchanged.
        if tare && points.iter().filter(|(x, _)| *x < found.parameters[0]).count() < SLACK_ROWS {
            tare = false;
            let start = &found.parameters[..found.parameters.len() - 1];
            found = fit(&Fitted { bend, tare, points }, start, &options).ok()?;
        }
        // A search that is stuck at a corner is judged by held-out rows, like the rest; one without an end is no line.
        let usable = found.termination.is_answer() || found.termination == Termination::Stagnated;
        let p = found.parameters;
        (p[1] > 0.0 && usable).then(|| Self {
            bend,
            slack_m: p[0],
            slack_sd_m: found.sd[0],
            knee_m: (bend == Bend::Knee).then(|| p[3]),
            slope_n_per_m: p[1],
            slope_sd_n_per_m: found.sd[1],
            tare_n: if tare { p[p.len() - 1] } else { 0.0 },
            left_n: (found.squares / points.len() as f64).sqrt(),
            is_minimum: found.termination.is_answer(),
            has_tare: tare,
            parameters: p,
            covariance: found.covariance,
        })
    }

    /// Force at an extension (N).
    pub fn force(&self, extension_m: f64) -> f64 {
        let p: Vec<Dual64> = self.parameters.iter().map(|v| Dual64::from(*v)).collect();
        force(self.bend, self.has_tare, &p, extension_m).re
    }

    /// Slope at an extension (N/m).
    pub fn slope(&self, extension_m: f64) -> f64 {
        let p = &self.parameters;
        let over = extension_m - p[0];
        if over <= 0.0 {
            return 0.0;
        }
        match self.bend {
            Bend::None => p[1],
            Bend::Knee => p[1] + if extension_m > p[3] { p[2] } else { 0.0 },
            Bend::Curve => p[1] + 2.0 * p[2] * over + 3.0 * p[3] * over * over,
        }
    }

    /// Standard deviation of [`Line::slope`] there, from the fit (N/m): g C gᵀ with g its derivatives by the parameters. Not a number where
    /// the rows leave it open.
    pub fn slope_sd(&self, extension_m: f64) -> f64 {
        let p = &self.parameters;
        let over = extension_m - p[0];
        let mut by = DVector::zeros(p.len());
        if over > 0.0 {
            by[1] = 1.0;
            match self.bend {
                Bend::None => {}
                Bend::Knee => by[2] = f64::from(u8::from(extension_m > p[3])),
                Bend::Curve => {
                    by[0] = -2.0 * p[2] - 6.0 * p[3] * over;
                    by[2] = 2.0 * over;
                    by[3] = 3.0 * over * over;
                }
            }
        }
        by.dot(&(&self.covariance * &by)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curve that bends: the slope at a place, and what noise makes of it over 200 draws, against what is stated.
    #[test]
    fn the_slope_scatters_as_stated() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, Normal};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let noise = Normal::new(0.0, 0.01).expect("a deviation");
        let (at, slope) = (0.02, 300.0 + 2.0 * 4e3 * 0.017);
        let squares: Vec<f64> = (0..200)
            .map(|_| {
                let row = |k: i32| {
                    let x = 1e-4 * f64::from(k);
                    let over = (x - 0.003).max(0.0);
                    (x, 300.0 * over + 4e3 * over * over + noise.sample(&mut rng))
                };
                let points: Vec<(f64, f64)> = (0..300).map(row).collect();
                let line = Line::fit(Bend::Curve, &points).expect("a line");
                ((line.slope(at) - slope) / line.slope_sd(at)).powi(2)
            })
            .collect();
        // A mean of 200 squares of normal numbers is 1 ± 0.1.
        let mean = squares.iter().sum::<f64>() / 200.0;
        assert!((0.7..1.3).contains(&mean), "{mean}");
    }
}
