//! The part of a triangle that a disc covers, as quadrature points.
//!
//! Tips and restraint patches are discs whose rims do not follow mesh edges. What they carry is integrated
//! over the exact intersection of disc and triangle, so that moving the mesh under a disc changes neither the
//! load's size nor its place.

use super::{Triangle, Vec3, basis_from_axis};

/// A flat disc in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Centre (m).
    pub centre: Vec3,
    /// Unit normal; on a body's surface, outward.
    pub normal: Vec3,
    /// Radius (m).
    pub radius: f64,
}

/// One quadrature point of a disc on a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscPoint {
    /// Weights of the triangle's corners, sum 1.
    pub barycentric: [f64; 3],
    /// The point on the triangle (m).
    pub position: Vec3,
    /// Area that it stands for, measured in the plane of the disc (m²).
    pub weight: f64,
}

/// Gauss–Legendre points on [0, 1] with weights (Abramowitz & Stegun 1964, table 25.4, n = 4 and n = 6).
const GAUSS_4: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];
const GAUSS_6: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_6, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576_1, 0.085_662_246_189_585_17),
];

impl Disc {
    /// Area (m²).
    pub fn area(&self) -> f64 {
        std::f64::consts::PI * self.radius * self.radius
    }

    /// Quadrature over the part of `triangle` that lies inside the disc, seen along the disc's normal.
    ///
    /// All weights are positive. Polynomials up to degree six are exact over straight-edged parts; where the
    /// rim cuts through, the rule is spectral in the angle and exact to rounding for practical purposes (see
    /// the tests). Triangles seen edge-on or from behind give nothing.
    pub fn quadrature(&self, triangle: &Triangle) -> Vec<DiscPoint> {
        let basis = basis_from_axis(&self.normal);
        let (e1, e2) = (basis.column(0), basis.column(1));
        let flat = triangle.0.map(|p| {
            let d = p - self.centre;
            [d.dot(&e1), d.dot(&e2)]
        });
        let twice_area = cross(sub(flat[1], flat[0]), sub(flat[2], flat[0]));
        if twice_area <= 1e-3 * 2.0 * triangle.area() {
            return Vec::new();
        }
        let boundary = clip(&flat, self.radius);
        let Some(hub) = hub(&boundary) else {
            return Vec::new();
        };
        let mut points = Vec::new();
        for piece in &boundary {
            piece.fan(hub, self.radius, |p, weight| {
                // A straight piece through the hub sweeps nothing.
                if weight <= 1e-15 * self.area() {
                    return;
                }
                let v = cross(sub(p, flat[0]), sub(flat[2], flat[0])) / twice_area;
                let w = cross(sub(flat[1], flat[0]), sub(p, flat[0])) / twice_area;
                let barycentric = [1.0 - v - w, v, w];
                points.push(DiscPoint { barycentric, position: triangle.at(barycentric), weight });
            });
        }
        points
    }
}

type Point2 = [f64; 2];

fn sub(a: Point2, b: Point2) -> Point2 {
    [a[0] - b[0], a[1] - b[1]]
}

fn cross(a: Point2, b: Point2) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// A piece of the boundary of the region common to triangle and circle (circle centred at the origin).
enum Piece {
    /// A straight piece from one point to another.
    Segment(Point2, Point2),
    /// An arc of the circle between two angles, anticlockwise.
    Arc(f64, f64),
}

impl Piece {
    /// Quadrature over the sector between `hub` and this piece.
    fn fan(&self, hub: Point2, radius: f64, mut emit: impl FnMut(Point2, f64)) {
        let mut sweep = |at: Point2, tangent: Point2, weight: f64| {
            let arm = sub(at, hub);
            let swept = cross(arm, tangent);
            for (s, ws) in GAUSS_4 {
                emit([hub[0] + s * arm[0], hub[1] + s * arm[1]], weight * ws * s * swept);
            }
        };
        match *self {
            Piece::Segment(p, q) => {
                for (t, wt) in GAUSS_4 {
                    let along = sub(q, p);
                    sweep([p[0] + t * along[0], p[1] + t * along[1]], along, wt);
                }
            }
            Piece::Arc(from, to) => {
                let parts = ((to - from) / std::f64::consts::FRAC_PI_4).ceil().max(1.0);
                let step = (to - from) / parts;
                for part in 0..parts as usize {
                    for (t, wt) in GAUSS_6 {
                        let (sin, cos) = (from + (part as f64 + t) * step).sin_cos();
                        sweep([radius * cos, radius * sin], [-radius * sin, radius * cos], wt * step);
                    }
                }
            }
        }
    }
}

/// The boundary, anticlockwise, of what an anticlockwise triangle and the circle have in common.
fn clip(triangle: &[Point2; 3], radius: f64) -> Vec<Piece> {
    let mut kept: Vec<(Point2, Point2)> = Vec::with_capacity(3);
    for i in 0..3 {
        let (p, q) = (triangle[i], triangle[(i + 1) % 3]);
        let d = sub(q, p);
        let (a, half_b) = (d[0] * d[0] + d[1] * d[1], p[0] * d[0] + p[1] * d[1]);
        let discriminant = half_b * half_b - a * (p[0] * p[0] + p[1] * p[1] - radius * radius);
        if discriminant <= 0.0 {
            continue;
        }
        let root = discriminant.sqrt();
        let (t0, t1) = (((-half_b - root) / a).max(0.0), ((-half_b + root) / a).min(1.0));
        if t1 > t0 {
            let at = |t: f64| {
                if t == 1.0 { q } else { [p[0] + t * d[0], p[1] + t * d[1]] }
            };
            kept.push((at(t0), at(t1)));
        }
    }
    if kept.is_empty() {
        let inside = (0..3).all(|i| cross(triangle[i], triangle[(i + 1) % 3]) >= 0.0);
        return if inside { vec![Piece::Arc(0.0, std::f64::consts::TAU)] } else { Vec::new() };
    }
    let mut boundary = Vec::with_capacity(6);
    for i in 0..kept.len() {
        let (p, q) = kept[i];
        boundary.push(Piece::Segment(p, q));
        let next = kept[(i + 1) % kept.len()].0;
        let gap = sub(next, q);
        if gap[0].hypot(gap[1]) > 1e-12 * radius {
            let (from, mut to) = (q[1].atan2(q[0]), next[1].atan2(next[0]));
            while to <= from {
                to += std::f64::consts::TAU;
            }
            boundary.push(Piece::Arc(from, to));
        }
    }
    boundary
}

/// A point inside the (convex) region: the mean of points along its boundary.
fn hub(boundary: &[Piece]) -> Option<Point2> {
    if let [Piece::Arc(..)] = boundary {
        return Some([0.0, 0.0]);
    }
    let ends: Vec<Point2> = boundary
        .iter()
        .flat_map(|piece| match *piece {
            Piece::Segment(p, q) => vec![p, q],
            Piece::Arc(..) => Vec::new(),
        })
        .collect();
    if ends.is_empty() {
        return None;
    }
    let n = ends.len() as f64;
    Some([ends.iter().map(|p| p[0]).sum::<f64>() / n, ends.iter().map(|p| p[1]).sum::<f64>() / n])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of side 2 cut into `n × n` cells of two triangles each, shifted by `shift`.
    fn tiles(n: usize, shift: f64) -> Vec<Triangle> {
        let h = 2.0 / n as f64;
        let at = |i: usize, j: usize| {
            Vec3::new(-1.0 + shift + h * i as f64, -1.0 + 0.7 * shift + h * j as f64, 0.0)
        };
        let mut out = Vec::new();
        for i in 0..n {
            for j in 0..n {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                out.push(Triangle([a, b, c]));
                out.push(Triangle([a, c, d]));
            }
        }
        out
    }

    /// Moments of the unit-density disc: area πa², second moment πa⁴/4, fourth moment ∫x⁴ = πa⁶/8.
    #[test]
    fn moments_of_the_disc_do_not_depend_on_the_tiles() {
        let a = 0.43;
        let disc = Disc { centre: Vec3::new(0.05, -0.03, 0.0), normal: Vec3::z(), radius: a };
        for n in [1, 2, 3, 7, 16] {
            for shift in [0.0, 0.037, 0.11] {
                let (mut m0, mut m1, mut m2, mut m4) = (0.0, 0.0, 0.0, 0.0);
                for t in tiles(n, shift) {
                    for p in disc.quadrature(&t) {
                        assert!(p.weight > 0.0 && p.barycentric.iter().all(|&b| b > -1e-9));
                        let x = p.position.x - disc.centre.x;
                        m0 += p.weight;
                        m1 += p.weight * x;
                        m2 += p.weight * x * x;
                        m4 += p.weight * x.powi(4);
                    }
                }
                let pi = std::f64::consts::PI;
                assert!((m0 / (pi * a * a) - 1.0).abs() < 1e-9, "area, n = {n}: {m0}");
                assert!(m1.abs() < 1e-10);
                assert!((m2 / (pi * a.powi(4) / 4.0) - 1.0).abs() < 1e-9);
                assert!((m4 / (pi * a.powi(6) / 8.0) - 1.0).abs() < 1e-9);
            }
        }
    }

    /// A disc wholly inside one triangle is covered by it, and one beside a triangle is not.
    #[test]
    fn a_disc_inside_one_triangle_is_whole() {
        let triangle = Triangle([Vec3::zeros(), Vec3::x(), Vec3::y()]);
        let covered = |x: f64, y: f64| {
            let disc = Disc { centre: Vec3::new(x, y, 0.0), normal: Vec3::z(), radius: 0.1 };
            disc.quadrature(&triangle).iter().map(|p| p.weight).sum::<f64>() / disc.area()
        };
        assert!((covered(0.3, 0.3) - 1.0).abs() < 1e-12);
        assert_eq!([covered(0.7, 0.7), covered(-0.2, 0.3), covered(0.4, -0.15)], [0.0; 3]);
    }

    #[test]
    fn a_triangle_seen_from_behind_gives_nothing() {
        let disc = Disc { centre: Vec3::zeros(), normal: -Vec3::z(), radius: 1.0 };
        assert!(disc.quadrature(&Triangle([Vec3::zeros(), Vec3::x(), Vec3::y()])).is_empty());
    }
}
