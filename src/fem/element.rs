//! Shape functions of straight-edged tetrahedra and triangles, and quadrature that is exact for them.
//!
//! Everything is written in barycentric coordinates `λ` (sum 1). First order (P1): `Nᵢ = λᵢ`. Second order
//! (P2): corners `λᵢ(2λᵢ − 1)`, edge midpoints `4 λᵢ λⱼ`. Edges of a tetrahedron come in the order of
//! [`TET_EDGES`], which is that of VTK's quadratic tetrahedron; of a triangle in that of [`TRIANGLE_EDGES`].

use crate::geometry::Vec3;

/// Polynomial order of the displacement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Linear: four nodes a cell.
    P1,
    /// Quadratic: ten nodes a cell.
    P2,
}

/// Corners at the ends of a tetrahedron's edges, in the order of the edge nodes.
pub const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// Corners at the ends of a triangle's edges, in the order of the edge nodes.
pub const TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [0, 2]];

impl Order {
    /// Nodes of a cell.
    pub fn cell_nodes(self) -> usize {
        match self {
            Self::P1 => 4,
            Self::P2 => 10,
        }
    }

    /// Nodes of a boundary face.
    pub fn face_nodes(self) -> usize {
        match self {
            Self::P1 => 3,
            Self::P2 => 6,
        }
    }

    /// Degree of quadrature that integrates the product of two displacement gradients exactly.
    pub fn stiffness_degree(self) -> usize {
        match self {
            Self::P1 => 0,
            Self::P2 => 2,
        }
    }

    /// Shape functions of a cell at barycentric `l`; the first [`Order::cell_nodes`] entries count.
    pub fn cell_shape(self, l: [f64; 4]) -> [f64; 10] {
        let mut n = [0.0; 10];
        match self {
            Self::P1 => n[..4].copy_from_slice(&l),
            Self::P2 => {
                for i in 0..4 {
                    n[i] = l[i] * (2.0 * l[i] - 1.0);
                }
                for (k, [i, j]) in TET_EDGES.into_iter().enumerate() {
                    n[4 + k] = 4.0 * l[i] * l[j];
                }
            }
        }
        n
    }

    /// Gradients of a cell's shape functions at barycentric `l` (1/m), from those of its barycentric
    /// coordinates; the first [`Order::cell_nodes`] entries count.
    pub fn cell_gradient(self, l: [f64; 4], gradient: &[Vec3; 4]) -> [Vec3; 10] {
        let mut g = [Vec3::zeros(); 10];
        match self {
            Self::P1 => g[..4].copy_from_slice(gradient),
            Self::P2 => {
                for i in 0..4 {
                    g[i] = gradient[i] * (4.0 * l[i] - 1.0);
                }
                for (k, [i, j]) in TET_EDGES.into_iter().enumerate() {
                    g[4 + k] = 4.0 * (gradient[i] * l[j] + gradient[j] * l[i]);
                }
            }
        }
        g
    }

    /// Shape functions of a face at barycentric `l`; the first [`Order::face_nodes`] entries count.
    pub fn face_shape(self, l: [f64; 3]) -> [f64; 6] {
        let mut n = [0.0; 6];
        match self {
            Self::P1 => n[..3].copy_from_slice(&l),
            Self::P2 => {
                for i in 0..3 {
                    n[i] = l[i] * (2.0 * l[i] - 1.0);
                }
                for (k, [i, j]) in TRIANGLE_EDGES.into_iter().enumerate() {
                    n[3 + k] = 4.0 * l[i] * l[j];
                }
            }
        }
        n
    }
}

/// Gradients of the four barycentric coordinates of a tetrahedron (1/m) and its volume (m³).
pub fn barycentric_gradients(corners: &[Vec3; 4]) -> ([Vec3; 4], f64) {
    let [a, b, c, d] = corners;
    let (ab, ac, ad) = (b - a, c - a, d - a);
    let six_volume = ab.cross(&ac).dot(&ad);
    let g1 = ac.cross(&ad) / six_volume;
    let g2 = ad.cross(&ab) / six_volume;
    let g3 = ab.cross(&ac) / six_volume;
    ([-(g1 + g2 + g3), g1, g2, g3], six_volume / 6.0)
}

/// Barycentric points and weights (sum 1) that integrate polynomials of `degree` exactly over a tetrahedron.
///
/// Degree 0 and 1: the centroid. Degree 2: four points (Hammer & Stroud 1956). Higher: the conical product of
/// Gauss–Legendre rules (Stroud 1971, section 2.4), whose weights are positive at any degree.
pub fn tet_quadrature(degree: usize) -> Vec<([f64; 4], f64)> {
    match degree {
        0 | 1 => vec![([0.25; 4], 1.0)],
        2 => {
            let (far, near) = ((5.0 + 3.0 * 5.0_f64.sqrt()) / 20.0, (5.0 - 5.0_f64.sqrt()) / 20.0);
            (0..4).map(|i| (std::array::from_fn(|j| if i == j { far } else { near }), 0.25)).collect()
        }
        _ => {
            let line = gauss_legendre(degree / 2 + 2);
            let mut rule = Vec::with_capacity(line.len().pow(3));
            for &(x, wx) in &line {
                for &(y, wy) in &line {
                    for &(z, wz) in &line {
                        let (b, c, d) = (x, y * (1.0 - x), z * (1.0 - x) * (1.0 - y));
                        let weight = 6.0 * wx * wy * wz * (1.0 - x) * (1.0 - x) * (1.0 - y);
                        rule.push(([1.0 - b - c - d, b, c, d], weight));
                    }
                }
            }
            rule
        }
    }
}

/// Barycentric points and weights (sum 1) that integrate polynomials of `degree` exactly over a triangle: to degree 2 and 4
/// the symmetric rules of 3 and 6 points (Strang and Fix 1973; Dunavant 1985), beyond conical products of Gauss–Legendre rules.
pub fn triangle_quadrature(degree: usize) -> Vec<([f64; 3], f64)> {
    // Three points with two equal coordinates `a` each, and their weight.
    let threes = |orbits: &[(f64, f64)]| {
        let three = |&(a, w): &(f64, f64)| {
            let b = 1.0 - 2.0 * a;
            [([b, a, a], w), ([a, b, a], w), ([a, a, b], w)]
        };
        orbits.iter().flat_map(three).collect()
    };
    match degree {
        0..=2 => return threes(&[(1.0 / 6.0, 1.0 / 3.0)]),
        3..=4 => {
            return threes(&[
                (0.445_948_490_915_964_9, 0.223_381_589_678_011_47),
                (0.091_576_213_509_770_74, 0.109_951_743_655_321_88),
            ]);
        }
        _ => {}
    }
    let line = gauss_legendre((degree + 3) / 2);
    let mut rule = Vec::with_capacity(line.len().pow(2));
    for &(x, wx) in &line {
        for &(y, wy) in &line {
            let (b, c) = (x, y * (1.0 - x));
            rule.push(([1.0 - b - c, b, c], 2.0 * wx * wy * (1.0 - x)));
        }
    }
    rule
}

/// Gauss–Legendre points and weights on [0, 1], exact to degree `2n − 1`: Newton on the Legendre polynomial
/// from Chebyshev starts.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let mut rule = Vec::with_capacity(n);
    for i in 0..n {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut before, mut now) = (1.0, x);
            for k in 2..=n {
                let k = k as f64;
                (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
            }
            slope = n as f64 * (x * now - before) / (x * x - 1.0);
            let step = now / slope;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        rule.push((0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope)));
    }
    rule
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: usize) -> f64 {
        (1..=n).map(|k| k as f64).product()
    }

    /// `∫ λ₀ᵃ λ₁ᵇ λ₂ᶜ λ₃ᵈ = 6 a! b! c! d! / (a+b+c+d+3)!` over a tetrahedron of volume 1.
    #[test]
    fn quadrature_is_exact_to_its_degree() {
        for degree in 0..8 {
            for (a, b, c) in
                (0..=degree).flat_map(|a| (0..=degree).map(move |b| (a, b))).flat_map(|(a, b)| {
                    (0..=degree).map(move |c| (a, b, c)).filter(move |&(a, b, c)| a + b + c <= degree)
                })
            {
                let sum: f64 = tet_quadrature(degree)
                    .iter()
                    .map(|(l, w)| w * l[0].powi(a as i32) * l[1].powi(b as i32) * l[3].powi(c as i32))
                    .sum();
                let exact = 6.0 * factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 3);
                assert!((sum - exact).abs() < 1e-13, "degree {degree}: {a} {b} {c}: {sum} {exact}");
                let sum: f64 = triangle_quadrature(degree)
                    .iter()
                    .map(|(l, w)| w * l[0].powi(a as i32) * l[1].powi(b as i32) * l[2].powi(c as i32))
                    .sum();
                let exact = 2.0 * factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 2);
                assert!((sum - exact).abs() < 1e-13, "triangle, degree {degree}");
            }
        }
    }

    #[test]
    fn shape_functions_are_one_at_their_own_node_and_sum_to_one() {
        let mut nodes: Vec<[f64; 4]> =
            (0..4).map(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)))).collect();
        for [i, j] in TET_EDGES {
            nodes.push(std::array::from_fn(|k| 0.5 * (nodes[i][k] + nodes[j][k])));
        }
        for (i, l) in nodes.iter().enumerate() {
            for (j, n) in Order::P2.cell_shape(*l).iter().enumerate() {
                assert_eq!(*n, f64::from(u8::from(i == j)));
            }
        }
        let l = [0.1, 0.2, 0.3, 0.4];
        for order in [Order::P1, Order::P2] {
            assert!((order.cell_shape(l)[..order.cell_nodes()].iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!((order.face_shape([0.2, 0.5, 0.3]).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn gradients_are_the_derivatives_of_the_shape_functions() {
        let corners = [
            Vec3::new(0.1, 0.0, 0.0),
            Vec3::new(1.2, 0.1, -0.1),
            Vec3::new(0.2, 0.9, 0.1),
            Vec3::new(0.0, 0.3, 1.1),
        ];
        let (gradient, volume) = barycentric_gradients(&corners);
        assert!(volume > 0.0);
        let barycentric = |p: Vec3| -> [f64; 4] {
            std::array::from_fn(|i| gradient[i].dot(&(p - corners[0])) + if i == 0 { 1.0 } else { 0.0 })
        };
        let p = Vec3::new(0.3, 0.35, 0.2);
        let analytic = Order::P2.cell_gradient(barycentric(p), &gradient);
        let h = 1e-6;
        for axis in 0..3 {
            let mut step = Vec3::zeros();
            step[axis] = h;
            let (plus, minus) =
                (Order::P2.cell_shape(barycentric(p + step)), Order::P2.cell_shape(barycentric(p - step)));
            for n in 0..10 {
                assert!(((plus[n] - minus[n]) / (2.0 * h) - analytic[n][axis]).abs() < 1e-9);
            }
        }
    }
}
