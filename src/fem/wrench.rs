//! A force and a moment spread over a disc.
//!
//! The traction is `t(x) = a + b × (x − c)`, `c` the centroid of what the disc covers: uniform, plus a part that
//! grows linearly across the disc. Six numbers `a`, `b` carry any wrench about any point, also where the disc
//! hangs over an edge and its covered part lies off the line of the force.

use super::error::FemError;
use super::space::Space;
use super::spot::{Functional, Spot, under};
use crate::geometry::Vec3;
use nalgebra::{Matrix6, Vector6};

/// Nodal forces (`[component, weight]`) of a unit force along x, y, z and of a unit moment about the same axes
/// through `about` (m), spread over the disc of `spot`.
pub fn wrench_loads(space: &Space, spot: &Spot, about: &Vec3) -> Result<[Functional; 6], FemError> {
    let Some((disc, _)) = spot.as_disc() else { return Ok(Default::default()) };
    let mut points: Vec<(usize, [f64; 6], Vec3, f64)> = Vec::new();
    for face in under(space, &disc) {
        for p in disc.quadrature(&space.face_triangle(face)) {
            points.push((face, space.order().face_shape(p.barycentric), p.position, p.weight));
        }
    }
    let area: f64 = points.iter().map(|(.., w)| w).sum();
    let centroid: Vec3 = points.iter().map(|(_, _, x, w)| x * *w).sum::<Vec3>() / area;
    // Resultant of t = a + b × r, r = x − c, about `about`: force ∫ t, moment ∫ (x − about) × t.
    let mut resultant = Matrix6::zeros();
    for (_, _, x, w) in &points {
        let (r, arm) = (x - centroid, x - about);
        for k in 0..6 {
            let mut axis = Vec3::zeros();
            axis[k % 3] = 1.0;
            let t = if k < 3 { axis } else { axis.cross(&r) };
            let m = arm.cross(&t);
            for i in 0..3 {
                resultant[(i, k)] += w * t[i];
                resultant[(3 + i, k)] += w * m[i];
            }
        }
    }
    let inverse = resultant.try_inverse().ok_or(FemError::DiscOffSurface {
        centre_m: [disc.centre.x, disc.centre.y, disc.centre.z],
        radius_m: disc.radius,
    })?;
    Ok(std::array::from_fn(|mode| {
        let coefficients: Vector6<f64> = inverse.column(mode).into_owned();
        let (a, b) =
            (coefficients.fixed_rows::<3>(0).into_owned(), coefficients.fixed_rows::<3>(3).into_owned());
        let mut load = Functional::new();
        for (face, shape, x, w) in &points {
            let t = a + b.cross(&(x - centroid));
            for (&node, s) in space.face_nodes(*face).iter().zip(shape) {
                for i in 0..3 {
                    load.push((3 * node + i as u32, w * s * t[i]));
                }
            }
        }
        super::spot::gather(&mut load);
        load
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::element::Order;
    use crate::mesh::{Block, block};

    /// On a whole disc and on one that hangs over an edge, the nodal forces have exactly the wrench asked for.
    #[test]
    fn nodal_forces_have_the_wrench() {
        let mesh = block(&Block { size_m: [0.1, 0.03, 0.03], cells: [8, 3, 3] }).expect("block");
        for order in [Order::P1, Order::P2] {
            let space = Space::new(&mesh, order).expect("space");
            for site in [Vec3::new(0.1, 0.015, 0.03), Vec3::new(0.04, 0.014, 0.03)] {
                let on: Vec<usize> = space.surface("z+").to_vec();
                let spot = Spot::disc(&space, &on, &site, 0.005).expect("on the surface");
                let loads = wrench_loads(&space, &spot, &site).expect("loads");
                for (mode, load) in loads.iter().enumerate() {
                    let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
                    for &(c, w) in load {
                        let mut f = Vec3::zeros();
                        f[c as usize % 3] = w;
                        force += f;
                        moment += (space.nodes()[c as usize / 3] - site).cross(&f);
                    }
                    for i in 0..3 {
                        let expected = |k: usize| f64::from(u8::from(k == mode));
                        assert!((force[i] - expected(i)).abs() < 1e-9, "{order:?} {mode}: {force}");
                        assert!((moment[i] - expected(3 + i)).abs() < 1e-9, "{order:?} {mode}: {moment}");
                    }
                }
            }
        }
    }
}
