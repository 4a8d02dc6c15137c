//! A disc pressed and pushed on a deep block: Boussinesq's and Cerruti's half-space through the elements.

use crate::bodies::cuboid;
use phantom_rig::fem::{Model, Order, Spot, disc_self_compliance};
use phantom_rig::geometry::{Mat3, Vec3};
use phantom_rig::mesh::refine;

const RADIUS: f64 = 0.005;
const NU: f64 = 0.47;

/// A block twice as wide as deep, held at its base, cut to edges of `finest` radii at the disc.
fn deep(depth: f64, finest: f64) -> (Model, Spot) {
    let (model, centre) = block_with_disc(depth, finest);
    let spot = Spot::disc(model.space(), model.space().surface("z+"), &centre, RADIUS).expect("on the top");
    (model, spot)
}

/// The block and the disc's centre.
fn block_with_disc(depth: f64, finest: f64) -> (Model, Vec3) {
    let size = [2.0 * depth, 2.0 * depth, depth];
    let centre = Vec3::new(depth, depth, depth);
    let mesh = refine(&cuboid(size, [4, 4, 2]), |p| {
        let r = p - centre;
        let beyond = (r.x.hypot(r.y) - RADIUS).max(0.0).hypot(r.z);
        (finest * RADIUS).max(0.5 * beyond)
    });
    let model = Model::new(&mesh, Order::P2, NU, "z-").expect("held");
    (model, centre)
}

/// Mean displacement of the disc under its own load, with the half-space's near field.
fn with_near_field(model: &Model, spot: &Spot) -> Mat3 {
    model.respond(&[spot]).expect("solved")[0].at(spot)
}

/// The same by elements alone.
fn by_elements(model: &Model, spot: &Spot) -> Mat3 {
    let nodal = model.respond_to(&spot.weights).expect("solved");
    Mat3::from_columns(&[0, 1, 2].map(|j: usize| spot.of(&nodal[j])))
}

/// A body of depth D answers `C(D) = C∞ − c/D + O(a²/D³)`, because from afar the disc is a point: two depths give
/// the half-space's `16 (1 − ν²) / (3 π² a E)` along the normal (Love 1929) and `16 (1 + ν)(1 − ν/2) / (3 π² a E)`
/// along the surface, by elements that know nothing of a half-space.
#[test]
fn elements_alone_reach_the_half_space() {
    let [tangential, normal] = disc_self_compliance(RADIUS, NU);
    let [shallow, deeper] = [12.0, 24.0].map(|radii| {
        let (model, spot) = deep(radii * RADIUS, 0.3);
        let (elements, near) = (by_elements(&model, &spot), with_near_field(&model, &spot));
        let gap = (elements - near).norm() / near.norm();
        println!("depth {radii} radii: {} unknowns, elements against near field {gap:.1e}", model.unknowns());
        assert!(gap < 3e-3, "elements alone and near field differ by {gap:.1e}");
        elements
    });
    let limit = deeper * 2.0 - shallow;
    for (axis, closed) in [(0, tangential), (1, tangential), (2, normal)] {
        let ratio = limit[(axis, axis)] / closed;
        println!(
            "axis {axis}: {ratio:.5} of the closed form ({:.5} at 24 radii)",
            deeper[(axis, axis)] / closed
        );
        assert!((ratio - 1.0).abs() < 5e-3, "axis {axis}: {ratio}");
    }
}

/// What the near field leaves to the elements is the reflection from afar: it halves when the depth doubles, and
/// elements ten times as large as the disc carry it.
#[test]
fn the_remainder_of_the_near_field_is_smooth() {
    let [tangential, normal] = disc_self_compliance(RADIUS, NU);
    let closed = Mat3::from_diagonal(&Vec3::new(tangential, tangential, normal));
    let remainder = |depth: f64, finest: f64| {
        let (model, spot) = deep(depth, finest);
        with_near_field(&model, &spot) - closed
    };
    let (shallow, deeper) = (remainder(20.0 * RADIUS, 10.0), remainder(40.0 * RADIUS, 20.0));
    let fine = remainder(20.0 * RADIUS, 2.0);
    for axis in 0..3 {
        let ratio = deeper[(axis, axis)] / shallow[(axis, axis)];
        println!("axis {axis}: remainder halves: {ratio:.4}");
        assert!((ratio - 0.5).abs() < 0.01, "axis {axis}: {ratio}");
        let error = (shallow - fine)[(axis, axis)] / closed[(axis, axis)];
        assert!(error.abs() < 2e-3, "axis {axis}: coarse elements leave {error:.1e}");
    }
}

/// A rigid punch sinks by `(1 − ν²) / 2aE` under a unit force (Sneddon 1946) and slides by `(2 − ν)(1 + ν) / 4aE`
/// (Mindlin 1949). By reciprocity that is also what it reads where a uniform load acts on its disc, which elements
/// alone carry well: the weights are held to the closed form by a displacement that knows nothing of it. The near
/// field of the rigid disc, read by the uniform one, must say the same.
#[test]
fn a_rigid_punch_reads_the_closed_form() {
    let closed = {
        let (tangential, normal) =
            ((2.0 - NU) * (1.0 + NU) / (4.0 * RADIUS), (1.0 - NU * NU) / (2.0 * RADIUS));
        Mat3::from_diagonal(&Vec3::new(tangential, tangential, normal))
    };
    let [shallow, deeper] = [12.0, 24.0].map(|radii| {
        let (model, centre) = block_with_disc(radii * RADIUS, 0.2);
        let top = model.space().surface("z+");
        let uniform = Spot::disc(model.space(), top, &centre, RADIUS).expect("on the top");
        let rigid = Spot::rigid_disc(model.space(), top, &centre, RADIUS).expect("on the top");
        let nodal = model.respond_to(&uniform.weights).expect("solved");
        let elements = Mat3::from_columns(&[0, 1, 2].map(|j: usize| rigid.of(&nodal[j])));
        let [own] = &model.respond(&[&rigid]).expect("solved")[..] else { panic!("one response") };
        let near = own.at(&uniform);
        let gap = (elements - near).norm() / near.norm();
        println!("depth {radii} radii: elements against near field {gap:.1e}");
        assert!(gap < 5e-3, "elements alone and near field differ by {gap:.1e}");
        // The face moves as one, so that its mean is the same however it is weighed.
        let alike = (own.at(&rigid) - near).norm() / near.norm();
        assert!(alike < 1e-3, "the rigid face does not move as one: {alike:.1e}");
        elements
    });
    let limit = deeper * 2.0 - shallow;
    for axis in 0..3 {
        let ratio = limit[(axis, axis)] / closed[(axis, axis)];
        println!("axis {axis}: {ratio:.5} of the closed form");
        assert!((ratio - 1.0).abs() < 5e-3, "axis {axis}: {ratio}");
    }
}
