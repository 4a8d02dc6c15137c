//! The 20-node serendipity hexahedron: shape functions, gradients and the 3 × 3 × 3 Gauss rule.
//!
//! The reference cell is [−1, 1]³ with nodes at its corners and at the middles of its edges. Every cell of the
//! bench is a rectangular box, so the map to it is a scaling along each axis.
//!
//! Why not 27 nodes: under a pad on a graded mesh the full triquadratic element is 1.3 times as accurate on the
//! same boxes but has twice the unknowns and takes three times as long to factor.

/// Nodes of one element.
pub(super) const NODES: usize = 20;

/// Where the nodes are, in half edges from the lowest corner: the corners, then the middles of the edges along
/// x, y and z.
pub(super) const PLACES: [[u32; 3]; NODES] = [
    [0, 0, 0],
    [2, 0, 0],
    [0, 2, 0],
    [2, 2, 0],
    [0, 0, 2],
    [2, 0, 2],
    [0, 2, 2],
    [2, 2, 2],
    [1, 0, 0],
    [1, 2, 0],
    [1, 0, 2],
    [1, 2, 2],
    [0, 1, 0],
    [2, 1, 0],
    [0, 1, 2],
    [2, 1, 2],
    [0, 0, 1],
    [2, 0, 1],
    [0, 2, 1],
    [2, 2, 1],
];

/// The factor of a shape function along one axis with its derivative: 1 − x² for a node in the middle of that
/// axis, 1 ± x for one at its ends.
fn factor(place: u32, x: f64) -> (f64, f64) {
    match place {
        0 => (1.0 - x, -1.0),
        1 => (1.0 - x * x, -2.0 * x),
        _ => (1.0 + x, 1.0),
    }
}

/// Shape functions at `local` ∈ [−1, 1]³ with their derivatives (Zienkiewicz & Taylor 2000, section 8.11).
///
/// Middle of an edge: ¼ (1 − ξ²)(1 ± η)(1 ± ζ); corner: ⅛ (1 ± ξ)(1 ± η)(1 ± ζ)(±ξ ± η ± ζ − 2).
fn shape_with_slopes(local: [f64; 3]) -> [(f64, [f64; 3]); NODES] {
    PLACES.map(|place| {
        let [(a, da), (b, db), (c, dc)] = std::array::from_fn(|i| factor(place[i], local[i]));
        let (product, slopes) = (a * b * c, [da * b * c, a * db * c, a * b * dc]);
        if place.contains(&1) {
            return (0.25 * product, slopes.map(|s| 0.25 * s));
        }
        let sign = place.map(|p| f64::from(p) - 1.0);
        let sum = sign[0] * local[0] + sign[1] * local[1] + sign[2] * local[2] - 2.0;
        (0.125 * product * sum, std::array::from_fn(|i| 0.125 * (slopes[i] * sum + product * sign[i])))
    })
}

/// Shape functions at `local` ∈ [−1, 1]³.
pub(super) fn shape(local: [f64; 3]) -> [f64; NODES] {
    shape_with_slopes(local).map(|s| s.0)
}

/// Gradients of the shape functions with respect to position (1/m), in a box with edge lengths `size` (m).
pub(super) fn gradient(local: [f64; 3], size: [f64; 3]) -> [[f64; 3]; NODES] {
    shape_with_slopes(local).map(|(_, slopes)| std::array::from_fn(|i| 2.0 * slopes[i] / size[i]))
}

/// Gauss–Legendre points on [−1, 1] with weights, exact to degree five (Abramowitz & Stegun 1964, table 25.4).
const GAUSS_3: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
    (0.0, 0.888_888_888_888_888_8),
    (0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
];

/// One Gauss point of a box.
#[derive(Debug, Clone)]
pub(super) struct GaussPoint {
    /// Volume that it stands for (m³).
    pub(super) weight: f64,
    /// Gradients of the shape functions (1/m).
    pub(super) gradient: [[f64; 3]; NODES],
    /// Shape functions.
    pub(super) shape: [f64; NODES],
}

/// The 27 Gauss points of a box with edge lengths `size` (m).
pub(super) fn gauss_points(size: [f64; 3]) -> Vec<GaussPoint> {
    let mut points = Vec::with_capacity(27);
    for (x, wx) in GAUSS_3 {
        for (y, wy) in GAUSS_3 {
            for (z, wz) in GAUSS_3 {
                let weight = wx * wy * wz * size[0] * size[1] * size[2] / 8.0;
                let at = [x, y, z];
                points.push(GaussPoint { weight, gradient: gradient(at, size), shape: shape(at) });
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: [f64; 3] = [0.31, -0.77, 0.12];
    const SIZE: [f64; 3] = [0.3, 0.2, 0.5];

    #[test]
    fn shape_functions_interpolate_and_sum_to_one() {
        for (n, place) in PLACES.into_iter().enumerate() {
            let at = place.map(|i| f64::from(i) - 1.0);
            for (m, value) in shape(at).into_iter().enumerate() {
                assert_eq!(value, if m == n { 1.0 } else { 0.0 });
            }
        }
        assert!((shape(AT).iter().sum::<f64>() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn gradients_are_the_slopes_of_the_shape_functions() {
        let step = 1e-5;
        let gradient = gradient(AT, SIZE);
        for axis in 0..3 {
            let mut moved = [AT, AT];
            moved[0][axis] += step;
            moved[1][axis] -= step;
            let [ahead, behind] = moved.map(shape);
            for n in 0..NODES {
                let slope = (ahead[n] - behind[n]) / (2.0 * step) * 2.0 / SIZE[axis];
                assert!((gradient[n][axis] - slope).abs() < 1e-8);
            }
        }
    }

    /// The volume, and the stiffness of a field at which the gradient is known: the shape function of the edge at
    /// y = z = −1, ¼ (1 − ξ²)(1 − η)(1 − ζ), has ∫ (∂ξN)² = 1/16 · 8/3 · 8/3 · 8/3.
    #[test]
    fn the_rule_is_exact_for_stiffness_terms() {
        let points = gauss_points(SIZE);
        let volume: f64 = points.iter().map(|p| p.weight).sum();
        assert!((volume / 0.03 - 1.0).abs() < 1e-14);
        let stiffness: f64 = points.iter().map(|p| p.weight * p.gradient[8][0].powi(2)).sum();
        let exact = (8.0_f64 / 3.0).powi(3) / 16.0 * (2.0 / 0.3) * (2.0 / 0.3) * 0.03 / 8.0;
        assert!((stiffness / exact - 1.0).abs() < 1e-13);
    }
}
