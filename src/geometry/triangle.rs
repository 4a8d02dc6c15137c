//! A triangle in space: its area, its normal, and its point nearest to another point.

use super::Vec3;

/// Three corners (m), anticlockwise seen from outside the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle(pub [Vec3; 3]);

/// A point of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrianglePoint {
    /// Weights of the three corners: non-negative, sum 1.
    pub barycentric: [f64; 3],
    /// The point (m).
    pub position: Vec3,
}

impl Triangle {
    /// Half the cross product of two edges: outward, its length the area (m²).
    pub fn area_vector(&self) -> Vec3 {
        let [a, b, c] = self.0;
        0.5 * (b - a).cross(&(c - a))
    }

    /// Area (m²).
    pub fn area(&self) -> f64 {
        self.area_vector().norm()
    }

    /// Unit outward normal; NaN for a triangle without area.
    pub fn normal(&self) -> Vec3 {
        self.area_vector().normalize()
    }

    /// The point with the given barycentric weights.
    pub fn at(&self, barycentric: [f64; 3]) -> Vec3 {
        self.0[0] * barycentric[0] + self.0[1] * barycentric[1] + self.0[2] * barycentric[2]
    }

    /// The point of the triangle nearest to `p`, by the Voronoi regions of its corners, edges and face
    /// (Ericson 2005, Real-Time Collision Detection, section 5.1.5).
    pub fn nearest(&self, p: &Vec3) -> TrianglePoint {
        let [a, b, c] = self.0;
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
        let bp = p - b;
        let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
        let cp = p - c;
        let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
        let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
        let barycentric = if d1 <= 0.0 && d2 <= 0.0 {
            [1.0, 0.0, 0.0]
        } else if d3 >= 0.0 && d4 <= d3 {
            [0.0, 1.0, 0.0]
        } else if d6 >= 0.0 && d5 <= d6 {
            [0.0, 0.0, 1.0]
        } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            let v = d1 / (d1 - d3);
            [1.0 - v, v, 0.0]
        } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            let w = d2 / (d2 - d6);
            [1.0 - w, 0.0, w]
        } else if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            [0.0, 1.0 - w, w]
        } else {
            let sum = va + vb + vc;
            [va / sum, vb / sum, vc / sum]
        };
        TrianglePoint { barycentric, position: self.at(barycentric) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn right_triangle() -> Triangle {
        Triangle([Vec3::zeros(), Vec3::x(), Vec3::y()])
    }

    #[test]
    fn nearest_point_in_every_region() {
        let t = right_triangle();
        for (p, expected) in [
            ((0.2, 0.3, 5.0), (0.2, 0.3, 0.0)),
            ((-1.0, -1.0, 0.0), (0.0, 0.0, 0.0)),
            ((3.0, -1.0, 0.0), (1.0, 0.0, 0.0)),
            ((-1.0, 3.0, 1.0), (0.0, 1.0, 0.0)),
            ((0.5, -2.0, 0.0), (0.5, 0.0, 0.0)),
            ((-2.0, 0.5, 0.0), (0.0, 0.5, 0.0)),
            ((1.0, 1.0, 0.0), (0.5, 0.5, 0.0)),
        ] {
            let found = t.nearest(&Vec3::new(p.0, p.1, p.2)).position;
            assert!((found - Vec3::new(expected.0, expected.1, expected.2)).norm() < 1e-14, "{p:?}");
        }
    }

    #[test]
    fn area_and_outward_normal() {
        assert_eq!(right_triangle().area(), 0.5);
        assert_eq!(right_triangle().normal(), Vec3::z());
    }
}
