//! One way in one direction: is it a plain spring, or does it bend, begin late, or begin beside zero?
//!
//! y = zero + a g₁(u) + b g₂(u) (+ c g₃(u)), u what is left of x behind the slack. Straight: g = u, u², u³. Neo-Hookean: g₁ = λ − λ⁻²,
//! g₂ = g₁ (I₁ − 3), λ = (1 + x)/(1 + slack). Slack, zero and bend may each be in the model: every combination is fitted to the way without
//! one block, and predicts the block. What several combinations predict alike is not told apart. Linear least squares, the slack by search.

use super::held_out::rms;
use nalgebra::{DMatrix, DVector};

/// Blocks at most, and rows that one must have.
const BLOCKS: usize = 20;
const BLOCK_ROWS: usize = 3;
/// Rows of a way at least.
pub(super) const LEAST_ROWS: usize = 16;
/// Rows that are used: more are thinned.
const ROWS: usize = 400;
/// Places tried for the slack, and share of the way that may be slack.
const PLACES: usize = 24;
const SLACK_TO: f64 = 0.5;
/// Rows in the slack that tell a zero from it.
const SLACK_ROWS: usize = 5;
/// A combination that predicts so much worse than the best one is out.
const WORSE: f64 = 1.25;

/// Force of the plain spring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Base {
    /// Straight, from wherever the file begins: a force there is no fault.
    Straight,
    /// Straight, from zero.
    StraightFromZero,
    /// Neo-Hookean, from zero strain.
    NeoHookean,
}

/// What may be in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Slack,
    Zero,
    Bend,
}

/// A combination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shape {
    pub(super) slack: bool,
    pub(super) zero: bool,
    pub(super) bend: bool,
}

impl Shape {
    pub(super) fn has(self, part: Part) -> bool {
        match part {
            Part::Slack => self.slack,
            Part::Zero => self.zero,
            Part::Bend => self.bend,
        }
    }

    pub(super) fn without(self, part: Part) -> Self {
        match part {
            Part::Slack => Self { slack: false, ..self },
            Part::Zero => Self { zero: false, ..self },
            Part::Bend => Self { bend: false, ..self },
        }
    }

    fn parts(self) -> usize {
        usize::from(self.slack) + usize::from(self.zero) + usize::from(self.bend)
    }
}

/// A fitted combination.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Curve {
    base: Base,
    shape: Shape,
    origin: f64,
    span: f64,
    /// Where the spring begins to pull.
    pub(super) slack: f64,
    coefficients: Vec<f64>,
}

impl Curve {
    fn row(base: Base, shape: Shape, origin: f64, span: f64, slack: f64, x: f64) -> Vec<f64> {
        let mut row = if base == Base::NeoHookean {
            let stretch = ((1.0 + x) / (1.0 + slack)).max(1.0);
            let plain = stretch - stretch.powi(-2);
            let invariant = stretch.powi(2) + 2.0 / stretch - 3.0;
            if shape.bend { vec![plain, plain * invariant] } else { vec![plain] }
        } else {
            let begin = if shape.slack { slack } else { origin };
            let over = (x - begin).max(0.0) / span;
            if shape.bend { vec![over, over * over, over * over * over] } else { vec![over] }
        };
        row.extend((shape.zero || base == Base::Straight).then_some(1.0));
        row
    }

    /// Fits points in order of x; none where the rows leave a part open.
    pub(super) fn fit(base: Base, shape: Shape, points: &[(f64, f64)]) -> Option<Self> {
        let (first, last) = (points.first()?.0, points.last()?.0);
        let origin = if base == Base::Straight { first } else { 0.0 };
        let span = last - origin;
        let at = |slack: f64| {
            let rows: Vec<Vec<f64>> =
                points.iter().map(|(x, _)| Self::row(base, shape, origin, span, slack, *x)).collect();
            let (coefficients, squares) = solve(&rows, points)?;
            Some((Self { base, shape, origin, span, slack, coefficients }, squares))
        };
        if !shape.slack {
            return at(0.0).map(|(curve, _)| curve);
        }
        let place = |k: f64| origin + SLACK_TO * span * k / PLACES as f64;
        let (mut middle, mut found) = (0..=PLACES)
            .filter_map(|k| Some((k as f64, at(place(k as f64))?)))
            .min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
        let mut width = 0.5;
        while width > 1e-4 {
            for k in [middle - width, middle + width] {
                if (0.0..=PLACES as f64).contains(&k)
                    && let Some(other) = at(place(k))
                    && other.1 < found.1
                {
                    (middle, found) = (k, other);
                }
            }
            width *= 0.5;
        }
        let in_slack = points.iter().filter(|(x, _)| *x < found.0.slack).count();
        // Without rows in the slack, slack and zero could be exchanged.
        let open = (shape.zero || base == Base::Straight) && in_slack < SLACK_ROWS;
        (!open).then_some(found.0)
    }

    /// What it says at a place.
    pub(super) fn at(&self, x: f64) -> f64 {
        let row = Self::row(self.base, self.shape, self.origin, self.span, self.slack, x);
        row.iter().zip(&self.coefficients).map(|(a, b)| a * b).sum()
    }

    /// Its value where nothing pulls yet.
    pub(super) fn zero(&self) -> f64 {
        let has = self.shape.zero || self.base == Base::Straight;
        if has { self.coefficients.last().copied().unwrap_or(0.0) } else { 0.0 }
    }

    /// Slope at the end over the slope at the beginning, both over those of the plain spring.
    pub(super) fn steepens(&self) -> f64 {
        let plain =
            Self { shape: self.shape.without(Part::Bend), coefficients: vec![1.0, 0.0], ..self.clone() };
        let begin = if self.shape.slack { self.slack } else { self.origin };
        let end = self.origin + self.span;
        let part = 0.2 * (end - begin);
        let ratio = |c: &Self| (c.at(end) - c.at(end - part)) / (c.at(begin + part) - c.at(begin));
        ratio(self) / ratio(&plain)
    }
}

/// A combination with what it missed in blocks that its fit did not see.
pub(super) type Scored = (Shape, f64);

/// What was tried, and which combinations are left as readings: the fewest parts among those that predict about as well as the best.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Readings {
    pub(super) tried: Vec<Scored>,
    pub(super) left: Vec<Scored>,
}

impl Readings {
    /// The least that is missed by combinations that have none of these parts.
    pub(super) fn without(&self, parts: &[Part]) -> f64 {
        let lacking = self.tried.iter().filter(|(shape, _)| parts.iter().all(|p| !shape.has(*p)));
        lacking.map(|(_, missed)| *missed).fold(f64::INFINITY, f64::min)
    }
}

/// Tries all combinations on points in order of x; none where there are too few.
pub(super) fn read(base: Base, points: &[(f64, f64)]) -> Option<Readings> {
    let step = points.len().div_ceil(ROWS).max(1);
    let points: Vec<(f64, f64)> = points.iter().copied().step_by(step).collect();
    if points.len() < LEAST_ROWS {
        return None;
    }
    let mut tried = Vec::new();
    for bits in 0..8 {
        let shape = Shape { slack: bits & 1 > 0, zero: bits & 2 > 0, bend: bits & 4 > 0 };
        // A force at the beginning is in such a base anyway.
        if (base == Base::Straight && shape.zero != shape.slack) || Curve::fit(base, shape, &points).is_none()
        {
            continue;
        }
        tried.extend(missed(base, shape, &points).map(|m| (shape, m)));
    }
    let best = tried.iter().map(|(_, m)| *m).fold(f64::INFINITY, f64::min);
    let close = |(_, m): &&Scored| *m <= WORSE * best;
    let fewest = tried.iter().filter(close).map(|(s, _)| s.parts()).min()?;
    let mut left: Vec<Scored> =
        tried.iter().filter(close).filter(|(s, _)| s.parts() == fewest).copied().collect();
    left.sort_by(|a, b| a.1.total_cmp(&b.1));
    Some(Readings { tried, left })
}

/// Root mean square of inner blocks predicted from the rest, and of every other row of the first one, where a slack may lie: a way is never
/// extrapolated.
fn missed(base: Base, shape: Shape, points: &[(f64, f64)]) -> Option<f64> {
    let blocks = (points.len() / BLOCK_ROWS).min(BLOCKS);
    let mut left = Vec::new();
    for block in 0..blocks - 1 {
        let inside = |i: usize| i * blocks / points.len() == block && (block > 0 || i % 2 == 1);
        let seen: Vec<(f64, f64)> = (0..points.len()).filter(|i| !inside(*i)).map(|i| points[i]).collect();
        let curve = Curve::fit(base, shape, &seen)?;
        let unseen = (0..points.len()).filter(|i| inside(*i)).map(|i| points[i]);
        left.extend(unseen.map(|(x, y)| y - curve.at(x)));
    }
    Some(rms(&left))
}

/// Least squares by normal equations of scaled columns: coefficients and Σ residual²; none where columns depend on each other.
pub(super) fn solve(rows: &[Vec<f64>], points: &[(f64, f64)]) -> Option<(Vec<f64>, f64)> {
    let count = rows.first()?.len();
    let mut scale = vec![0.0; count];
    for row in rows {
        scale.iter_mut().zip(row).for_each(|(s, v)| *s += v * v);
    }
    let scale: Vec<f64> = scale.into_iter().map(f64::sqrt).collect();
    if scale.contains(&0.0) {
        return None;
    }
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut right = DVector::<f64>::zeros(count);
    for (row, (_, y)) in rows.iter().zip(points) {
        for i in 0..count {
            right[i] += row[i] / scale[i] * y;
            for j in 0..count {
                normal[(i, j)] += row[i] / scale[i] * row[j] / scale[j];
            }
        }
    }
    let solved = normal.cholesky()?.solve(&right);
    let coefficients: Vec<f64> = solved.iter().zip(&scale).map(|(b, s)| b / s).collect();
    let said = |row: &Vec<f64>| -> f64 { row.iter().zip(&coefficients).map(|(a, b)| a * b).sum() };
    let squares = rows.iter().zip(points).map(|(row, (_, y))| (y - said(row)).powi(2)).sum();
    Some((coefficients, squares))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(force: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        (0..200).map(|k| f64::from(k) / 199.0).map(|x| (x, force(x) + 1e-3 * (571.0 * x).sin())).collect()
    }

    fn left(base: Base, force: impl Fn(f64) -> f64) -> Vec<[bool; 3]> {
        let readings = read(base, &points(force)).expect("enough");
        readings.left.iter().map(|(s, _)| [s.slack, s.zero, s.bend]).collect()
    }

    /// Slack with rows in it is told from a zero; a straight line beside zero that has none may be either.
    #[test]
    fn readings_are_told_apart_where_the_rows_can() {
        let base = Base::StraightFromZero;
        assert_eq!(left(base, |x| x), [[false; 3]]);
        assert_eq!(left(base, |x| (x - 0.2).max(0.0)), [[true, false, false]]);
        assert_eq!(left(base, |x| 0.1 + x), [[false, true, false]]);
        assert_eq!(left(base, |x| 0.1 + (x - 0.2).max(0.0)), [[true, true, false]]);
        assert_eq!(left(base, |x| x + x * x), [[false, false, true]]);
        assert_eq!(left(Base::Straight, |x| 0.3 + x), [[false; 3]]);
        let late: Vec<(f64, f64)> = points(|x| x - 0.1).into_iter().filter(|(x, _)| *x > 0.15).collect();
        let readings = read(base, &late).expect("enough");
        assert_eq!(readings.left.len(), 2, "{readings:?}");
        let curve = Curve::fit(base, readings.left[0].0.without(Part::Bend), &late).expect("a fit");
        assert!((curve.at(0.5) - 0.4).abs() < 1e-3);
    }

    #[test]
    fn a_curve_steepens_or_flattens() {
        let shape = Shape { slack: false, zero: false, bend: true };
        let of = |force: fn(f64) -> f64| {
            Curve::fit(Base::StraightFromZero, shape, &points(force)).expect("a fit").steepens()
        };
        assert!(of(|x| x + x * x) > 1.5 && of(|x| x - 0.3 * x * x) < 0.8);
    }
}
