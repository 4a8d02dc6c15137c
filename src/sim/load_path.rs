//! Force and watched points as functions of the depth of one poke.
//!
//! The phantom is elastic and the stage moves along a line, so the depth alone says the state. It is known with
//! its slope at a few depths; between them a cubic Hermite polynomial passes through both.

/// Force of the tip on the phantom and displacements of the watched points.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    /// N, or N/m for a slope.
    pub(super) force: [f64; 3],
    /// m, or m/m for a slope.
    pub(super) watched: Vec<[f64; 3]>,
}

impl State {
    /// All values times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            force: self.force.map(|f| f * factor),
            watched: self.watched.iter().map(|u| u.map(|x| x * factor)).collect(),
        }
    }

    /// The difference of two.
    pub(super) fn less(&self, other: &Self) -> Self {
        Self {
            force: std::array::from_fn(|i| self.force[i] - other.force[i]),
            watched: (self.watched.iter().zip(&other.watched))
                .map(|(a, b)| std::array::from_fn(|i| a[i] - b[i]))
                .collect(),
        }
    }
}

/// One computed state.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Knot {
    pub(super) depth_m: f64,
    pub(super) state: State,
    /// Derivative with respect to the depth.
    pub(super) slope: State,
}

/// States at ascending depths, the first at rest.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadPath {
    knots: Vec<Knot>,
}

impl LoadPath {
    /// At least two knots, ascending.
    pub(super) fn new(knots: Vec<Knot>) -> Self {
        debug_assert!(knots.len() > 1 && knots.windows(2).all(|w| w[0].depth_m < w[1].depth_m));
        Self { knots }
    }

    /// The computed states.
    pub(super) fn knots(&self) -> &[Knot] {
        &self.knots
    }

    /// This path and a straight one of the given slope, added up.
    pub(super) fn plus(mut self, slope: &State) -> Self {
        for knot in &mut self.knots {
            knot.state = knot.state.less(&slope.scaled(-knot.depth_m));
            knot.slope = knot.slope.less(&slope.scaled(-1.0));
        }
        self
    }

    /// The weights of value and slope at both ends of the stretch that holds `depth_m`.
    fn weights(&self, depth_m: f64) -> ([&Knot; 2], [f64; 4]) {
        let after = self.knots.partition_point(|k| k.depth_m < depth_m).clamp(1, self.knots.len() - 1);
        let (a, b) = (&self.knots[after - 1], &self.knots[after]);
        let step = b.depth_m - a.depth_m;
        let s = (depth_m - a.depth_m) / step;
        let rest = 1.0 - s;
        let values = [rest * rest * (1.0 + 2.0 * s), s * s * (3.0 - 2.0 * s)];
        ([a, b], [values[0], values[1], step * s * rest * rest, -step * s * s * rest])
    }

    /// Force (N) at a depth.
    pub(super) fn force(&self, depth_m: f64) -> [f64; 3] {
        let ([a, b], w) = self.weights(depth_m);
        std::array::from_fn(|i| {
            w[0] * a.state.force[i]
                + w[1] * b.state.force[i]
                + w[2] * a.slope.force[i]
                + w[3] * b.slope.force[i]
        })
    }

    /// Displacement (m) of one watched point at a depth.
    pub(super) fn watched(&self, depth_m: f64, point: usize) -> [f64; 3] {
        let ([a, b], w) = self.weights(depth_m);
        let [pa, pb] = [a, b].map(|k| k.state.watched[point]);
        let [ma, mb] = [a, b].map(|k| k.slope.watched[point]);
        std::array::from_fn(|i| w[0] * pa[i] + w[1] * pb[i] + w[2] * ma[i] + w[3] * mb[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_met_exactly() {
        let value = |d: f64| 2.0 * d - 3.0 * d * d + 0.5 * d * d * d;
        let slope = |d: f64| 2.0 - 6.0 * d + 1.5 * d * d;
        let state = |v: f64| State { force: [v, -v, 0.0], watched: vec![[0.0, v, 2.0 * v]] };
        let knots =
            [0.0, 1.0, 1.7].map(|d| Knot { depth_m: d, state: state(value(d)), slope: state(slope(d)) });
        let path = LoadPath::new(knots.into());
        for d in [0.0, 0.2, 0.99, 1.0, 1.3, 1.7] {
            assert!((path.force(d)[1] + value(d)).abs() < 1e-13);
            assert!((path.watched(d, 0)[2] - 2.0 * value(d)).abs() < 1e-13);
        }
    }
}
