//! Maxwell and Betti: what a load at one place does at another is what a load there does here.

use crate::bodies::cuboid;
use phantom_rig::fem::{Model, Order, Resolution, Response, Spot, SpotKind, discretise};
use phantom_rig::geometry::Vec3;
use phantom_rig::mesh::{TetMesh, refine};

/// The slab, glued at its base, cut as a fit cuts it, with discs on the top and a side and markers on the top.
fn slab() -> (Model, Vec<Spot>, Vec<Spot>) {
    let given = cuboid([0.1, 0.08, 0.025], [10, 8, 3]);
    let resolution = Resolution::of(&given, 1).expect("sound");
    let mesh: TetMesh = discretise(&given, "z-", &[], &resolution).expect("sound");
    let seen = [Vec3::new(0.07, 0.05, 0.0262), Vec3::new(0.045, 0.055, 0.0262)];
    // A marker is a point: as a load it is only as good as the elements around it. Elsewhere edges are half as long
    // as a fit takes them, which leaves up to 0.2 % between the discs on the top and on the side.
    let mesh = refine(&mesh, |p| {
        seen.iter().map(|m| (0.5 * (p - m).norm()).max(0.001)).fold(0.5 * resolution.longest_m, f64::min)
    });
    let model = Model::new(&mesh, Order::P2, 0.47, "z-").expect("held");
    let discs = [
        (Vec3::new(0.03, 0.03, 0.025), 0.008),
        (Vec3::new(0.06, 0.04, 0.025), 0.005),
        (Vec3::new(0.0, 0.04, 0.012), 0.006),
    ]
    .map(|(centre, radius)| {
        let all: Vec<usize> = (0..model.space().faces().len()).collect();
        Spot::disc(model.space(), &all, &centre, radius).expect("on the surface")
    });
    let on_top = model.space().surface("z+");
    let rigid = Spot::rigid_disc(model.space(), on_top, &Vec3::new(0.075, 0.025, 0.025), 0.007);
    let discs = [&discs[..], &[rigid.expect("on the top")]].concat();
    let markers = seen.map(|p| Spot::marker(model.space(), &mesh, "z+", &p).expect("attached").0);
    (model, discs, markers.to_vec())
}

fn gaps(spots: &[&Spot], responses: &[Response]) -> Vec<f64> {
    let mut gaps = Vec::new();
    for a in 0..spots.len() {
        for b in 0..a {
            let (there, back) = (responses[a].at(spots[b]), responses[b].at(spots[a]).transpose());
            gaps.push((there - back).norm() / there.norm());
        }
    }
    gaps
}

/// Disc and disc, disc and marker: the two readings are computed in different ways (near field of one, smooth
/// remainder at the other), so that their difference is the discretisation's error.
#[test]
fn loads_and_readings_change_places() {
    let (model, discs, markers) = slab();
    let spots: Vec<&Spot> = discs.iter().chain(&markers).collect();
    let responses = model.respond(&spots).expect("solved");
    let gaps = gaps(&spots, &responses);
    println!("{} unknowns, reciprocity {gaps:.6?}", model.unknowns());
    assert!(gaps.iter().all(|&g| g < 1e-3), "{gaps:.6?}");
}

/// The known glue holds still under every load: where it does, the near field of a disc is taken back to the last bit.
#[test]
fn what_is_held_stays_where_it_is() {
    let model = Model::new(&cuboid([0.1, 0.08, 0.025], [5, 4, 2]), Order::P2, 0.47, "z-").expect("held");
    let disc = Spot::disc(model.space(), model.space().surface("z+"), &Vec3::new(0.04, 0.03, 0.025), 0.008)
        .expect("on the top");
    let marker =
        Spot { kind: SpotKind::Marker { foot: Vec3::zeros(), offset: Vec3::zeros() }, ..disc.clone() };
    for (spot, has_near) in [(&disc, true), (&marker, false)] {
        let response = &model.respond(&[spot]).expect("solved")[0];
        assert_eq!(response.near_at(spot).norm() > 0.0, has_near);
        for (node, p) in model.space().nodes().iter().enumerate() {
            let moved = response.at_node(node, p);
            assert_eq!(moved.norm() == 0.0, model.held()[node], "node {node} at {p}: {moved}");
        }
    }
}
