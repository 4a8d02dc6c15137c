//! Which dots are neighbours: the Delaunay triangulation of the reference dots (Bowyer 1981, Watson 1981).
//!
//! Every insertion looks at every triangle, which is quick enough for a thousand dots, once. Four dots of a regular grid lie on one circle;
//! a shift of each by a millionth of the extent, the same every time, decides between the two diagonals.

use nalgebra::Vector2;

type Point = Vector2<f64>;

/// Triangles of a set of points, all with the same orientation (positive area).
#[derive(Debug, Clone)]
pub(super) struct Triangulation {
    pub(super) triangles: Vec<[usize; 3]>,
    pub(super) neighbours: Vec<Vec<usize>>,
}

impl Triangulation {
    /// Triangulates points that are all different.
    pub(super) fn of(points: &[Point]) -> Self {
        let count = points.len();
        let (shifted, mut triangles) = frame(points);
        for i in 0..count {
            let mut rim: Vec<[usize; 2]> = Vec::new();
            triangles.retain(|t| {
                let inside = in_circle(t.map(|k| shifted[k]), shifted[i]);
                if inside {
                    rim.extend([[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
                }
                !inside
            });
            // Edges that two of the removed triangles share lie inside the cavity.
            for &[a, b] in &rim {
                if !rim.contains(&[b, a]) {
                    triangles.push([a, b, i]);
                }
            }
        }
        triangles.retain(|t| t.iter().all(|&k| k < count));
        let mut neighbours = vec![Vec::new(); count];
        for t in &triangles {
            for k in 0..3 {
                neighbours[t[k]].push(t[(k + 1) % 3]);
                neighbours[t[k]].push(t[(k + 2) % 3]);
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        Self { triangles, neighbours }
    }
}

/// Points in a unit square, slightly shifted, and the corners of a triangle around them all.
fn frame(points: &[Point]) -> (Vec<Point>, Vec<[usize; 3]>) {
    let low = points.iter().fold(Point::repeat(f64::MAX), |a, p| a.inf(p));
    let high = points.iter().fold(Point::repeat(f64::MIN), |a, p| a.sup(p));
    let extent = (high - low).amax().max(f64::MIN_POSITIVE);
    let mut shifted: Vec<Point> = points
        .iter()
        .enumerate()
        .map(|(i, p)| {
            // Weyl's sequence: spread evenly, never periodic.
            let t = i as f64;
            let jitter = Point::new((t * 0.618_033_988_75).fract(), (t * 0.754_877_666_25).fract());
            (p - low) / extent + jitter * 1e-6
        })
        .collect();
    let count = points.len();
    shifted.extend([Point::new(-50.0, -50.0), Point::new(100.0, -50.0), Point::new(-50.0, 100.0)]);
    (shifted, vec![[count, count + 1, count + 2]])
}

/// Twice the signed area.
pub(super) fn orientation(a: Point, b: Point, c: Point) -> f64 {
    (b - a).perp(&(c - a))
}

fn in_circle([a, b, c]: [Point; 3], p: Point) -> bool {
    let (a, b, c) = (a - p, b - p, c - p);
    let (aa, bb, cc) = (a.norm_squared(), b.norm_squared(), c.norm_squared());
    aa * b.perp(&c) - bb * a.perp(&c) + cc * a.perp(&b) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::tests::random::Noise;

    /// The defining property, and Euler's formula: 2n − 2 − h triangles for n points with h on the hull.
    #[test]
    fn no_circle_holds_another_point() {
        let mut random = Noise::seeded(5);
        let points: Vec<Point> =
            (0..200).map(|_| Point::new(random.uniform(), random.uniform()) * 900.0).collect();
        let mesh = Triangulation::of(&points);
        for t in &mesh.triangles {
            let corners = t.map(|k| points[k]);
            assert!(orientation(corners[0], corners[1], corners[2]) > 0.0);
            for (k, &p) in points.iter().enumerate() {
                assert!(t.contains(&k) || !in_circle(corners, p) || in_circle_by_rounding(corners, p));
            }
        }
        let mut edges: Vec<[usize; 2]> =
            mesh.triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]).collect();
        edges.sort_unstable();
        let hull = edges.iter().filter(|&&[a, b]| edges.binary_search(&[b, a]).is_err()).count();
        assert_eq!(mesh.triangles.len(), 2 * 200 - 2 - hull);
    }

    /// The shift that decides between diagonals moves points by up to 1e-3 px here.
    fn in_circle_by_rounding(corners: [Point; 3], p: Point) -> bool {
        (0..8).any(|k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
            !in_circle(corners, p + Point::new(cos, sin) * 0.01)
        })
    }

    #[test]
    fn a_regular_grid_has_two_triangles_a_cell() {
        let points: Vec<Point> =
            (0..126).map(|i| Point::new(f64::from(i % 14), f64::from(i / 14)) * 80.0).collect();
        let mesh = Triangulation::of(&points);
        let cells = mesh.triangles.iter().filter(|t| {
            let area = orientation(points[t[0]], points[t[1]], points[t[2]]);
            (area - 6400.0).abs() < 1e-6
        });
        assert_eq!(cells.count(), 2 * 13 * 8);
        assert!(mesh.neighbours[20].len() >= 4);
    }
}
