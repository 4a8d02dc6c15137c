//! Rigid tips: Hertz, Sneddon, Boussinesq and Spence on a deep block; lift-off and held rotation on a slab that
//! overhangs, against elements that resolve the face; exact derivatives against differences.

use crate::bodies::cuboid;
use nalgebra::{DMatrix, DVector, SMatrix};
use phantom_rig::fem::{Model, Order, Pressed, Tip, TipFace};
use phantom_rig::geometry::Vec3;
use phantom_rig::mesh::{TetMesh, refine};

const RADIUS: f64 = 0.005;
const NU: f64 = 0.47;

/// A tip on a body and what the body does to it.
struct Bench {
    tip: Tip,
    compliance: DMatrix<f64>,
}

impl Bench {
    fn new(model: &Model, centre: Vec3, face: TipFace, bonded: bool) -> Self {
        let top = model.space().surface("z+");
        let tip = Tip::new(model.space(), top, &centre, RADIUS, face, bonded, model.poisson_ratio())
            .expect("on the top");
        let ports: Vec<_> = tip.ports().iter().collect();
        let compliance = tip.compliance(&model.respond(&ports).expect("solved"));
        Self { tip, compliance }
    }

    fn press(&self, displacement: Vec3) -> Pressed {
        self.tip.press(&self.compliance, &displacement).expect("pressed")
    }

    /// Force along the inward normal at a depth.
    fn at_depth(&self, depth: f64) -> f64 {
        -self.press(Vec3::new(0.0, 0.0, -depth)).force().z
    }
}

/// Two meshes of a block 400 tip radii deep, and the tip's place on its top. From there the glue takes 10⁻³ off a
/// depth; the elements are far larger than the tip.
fn deep_blocks(nu: f64) -> Vec<(Model, Vec3)> {
    [([4, 4, 2], 0.0), ([5, 4, 3], 0.11)]
        .map(|(cells, aside)| {
            let depth = 400.0 * RADIUS;
            let mesh = cuboid([2.0 * depth, 2.0 * depth, depth], cells);
            let centre = Vec3::new(depth * (1.0 + aside), depth, depth);
            (Model::new(&mesh, Order::P2, nu, "z-").expect("held"), centre)
        })
        .into()
}

/// `P = 4/3 √R δ^1.5 / (1 − ν²)` (Hertz 1882) for small depths.
#[test]
fn a_smooth_sphere_follows_hertz() {
    let sphere = 0.06_f64;
    for (model, centre) in deep_blocks(NU) {
        let bench = Bench::new(&model, centre, TipFace::Sphere { radius_m: sphere }, false);
        for depth in [2e-6_f64, 2e-5, 8e-5, 2e-4] {
            let hertz = 4.0 / 3.0 * sphere.sqrt() * depth.powf(1.5) / (1.0 - NU * NU);
            let ratio = bench.at_depth(depth) / hertz;
            println!("depth {depth:.0e}: {ratio:.5} of Hertz");
            assert!((ratio - 1.0).abs() < 5e-3, "depth {depth}: {ratio}");
            let radius = bench.press(Vec3::new(0.0, 0.0, -depth)).contact_radius_m;
            assert!((radius / (sphere * depth).sqrt() - 1.0).abs() < 0.06, "{radius}");
        }
    }
}

/// Deep contacts of a sphere, not of Hertz's paraboloid: `P (1 − ν²) = (a² + R²) atanh(a/R) − aR` at the depth
/// `a atanh(a/R)` (Sneddon 1965). A sphere that sticks is stiffer by the same factor as a flat face, nearly
/// (Spence 1968): 0.1 % at ν = 0.47.
#[test]
fn a_deep_sphere_follows_sneddon() {
    let sphere = 0.005_f64;
    for (model, centre) in deep_blocks(NU) {
        for bonded in [false, true] {
            let bench = Bench::new(&model, centre, TipFace::Sphere { radius_m: sphere }, bonded);
            for a in [0.001_f64, 0.002, 0.0035] {
                let (t, square) = (a / sphere, sphere * sphere);
                let closed = square * ((1.0 + t * t) * t.atanh() - t) / (1.0 - NU * NU);
                let ratio = bench.at_depth(a * t.atanh()) / closed;
                println!("sticks {bonded}, contact {a}: {ratio:.5} of Sneddon");
                assert!((ratio - 1.0).abs() < 5e-3, "sticks {bonded}, contact {a}: {ratio}");
            }
        }
    }
}

/// `2a/(1 − ν²)` along the normal (Boussinesq 1885), also when the face may lift off; bonded faces are stiffer by
/// `(1 − ν) ln(3 − 4ν)/(1 − 2ν)` (Spence 1968), and slide by `4a/((2 − ν)(1 + ν))` (Mindlin 1949).
#[test]
fn a_flat_face_follows_boussinesq_and_spence() {
    for nu in [0.3_f64, NU] {
        let spence = (1.0 - nu) * (3.0 - 4.0 * nu).ln() / (1.0 - 2.0 * nu);
        for (model, centre) in deep_blocks(nu) {
            let [smooth, bonded] = [false, true].map(|b| Bench::new(&model, centre, TipFace::Flat, b));
            let closed = 2.0 * RADIUS / (1.0 - nu * nu);
            let ratio = [smooth.at_depth(1.0) / closed, bonded.at_depth(1.0) / closed];
            println!(
                "ν {nu}: smooth {:.5}, bonded {:.5} of Boussinesq; Spence {spence:.5}",
                ratio[0], ratio[1]
            );
            assert!((ratio[0] - 1.0).abs() < 5e-3 && (ratio[1] / spence - 1.0).abs() < 5e-3);
            let slid = bonded.press(Vec3::x()).force().x;
            let mindlin = 4.0 * RADIUS / ((2.0 - nu) * (1.0 + nu));
            println!("ν {nu}: bonded {:.5} of Mindlin", slid / mindlin);
            // Poisson's coupling to the tilt, which is held, stiffens a slide by (1 − 2ν)² in proportion.
            let coupled = 1.0 + 0.1 * (1.0 - 2.0 * nu).powi(2);
            assert!(slid / mindlin > 0.997 && slid / mindlin < coupled + 5e-3, "{}", slid / mindlin);
            assert_eq!(smooth.press(Vec3::new(0.3, 0.2, -1.0)).force().x, 0.0);
        }
    }
}

/// Tips that may lift off neither pull nor leave a force behind; a bonded sphere drawn back pulls.
#[test]
fn tips_let_go() {
    let (model, centre) = deep_blocks(NU).remove(0);
    for face in [TipFace::Pad, TipFace::Flat, TipFace::Sphere { radius_m: 0.008 }] {
        let bench = Bench::new(&model, centre, face, false);
        assert_eq!(bench.press(Vec3::zeros()).force(), Vec3::zeros());
        assert_eq!(bench.press(Vec3::new(1e-4, 0.0, 1e-4)).force(), Vec3::zeros());
        let [light, heavy] = [1e-9, 1e-3].map(|d| bench.at_depth(d));
        assert!(light > 0.0 && heavy > 1e5 * light);
    }
    let sphere = Bench::new(&model, centre, TipFace::Sphere { radius_m: 0.008 }, true);
    let pressed = sphere.press(Vec3::new(0.0, 0.0, -1e-3));
    let back: Vec<f64> = [0.0, 5e-4, 1e-3]
        .map(|by| pressed.held_and_moved(&Vec3::new(0.0, 0.0, by)).iter().skip(2).step_by(3).sum())
        .into();
    assert!(back[0] < back[1] && back[1] < back[2] && back[2] > 0.0, "{back:?}");
}

const SLAB: [f64; 3] = [0.1, 0.06, 0.02];
const GLUED: f64 = 0.04;

/// A slab glued on the left 40 mm of its base, cut to edges of `finest` (m) around a tip at `centre`.
fn overhanging(centre: &Vec3, finest: f64) -> TetMesh {
    let mut mesh = refine(&cuboid(SLAB, [14, 8, 4]), |p| {
        let r = p - centre;
        let beyond = (r.x.hypot(r.y) - RADIUS).max(0.0).hypot(r.z);
        let glue_end = (p.x - GLUED).hypot(p.z);
        (finest + 0.5 * beyond).min(0.002 + 0.5 * glue_end)
    });
    let glue = mesh
        .surface("z-")
        .iter()
        .copied()
        .filter(|t| t.iter().all(|&n| mesh.nodes[n as usize].x < GLUED + 1e-4))
        .collect();
    mesh.surfaces.insert("fixed".to_owned(), glue);
    mesh
}

/// Nodes near the rim are moved onto it, so that a face of nodes has the tip's radius.
fn snapped(mut mesh: TetMesh, centre: &Vec3, reach: f64) -> TetMesh {
    for p in &mut mesh.nodes {
        let (x, y) = (p.x - centre.x, p.y - centre.y);
        let rho = x.hypot(y);
        if (p.z - centre.z).abs() < 1e-9 && (rho - RADIUS).abs() < reach {
            p.x = centre.x + x * RADIUS / rho;
            p.y = centre.y + y * RADIUS / rho;
        }
    }
    mesh
}

/// Stiffness (three displacements, three rotations) of a rigid face bonded to the nodes within the tip's radius.
fn face_of_nodes(model: &Model, centre: &Vec3) -> SMatrix<f64, 6, 6> {
    let nodes: Vec<(usize, Vec3)> = model
        .space()
        .nodes()
        .iter()
        .map(|p| p - centre)
        .enumerate()
        .filter(|(_, r)| r.z.abs() < 1e-9 && r.x.hypot(r.y) < RADIUS * (1.0 + 1e-9))
        .collect();
    let components: Vec<usize> = nodes.iter().flat_map(|(n, _)| (0..3).map(move |i| 3 * n + i)).collect();
    let loads: Vec<_> = components.iter().map(|&c| vec![(c as u32, 1.0)]).collect();
    let mut compliance = DMatrix::zeros(loads.len(), loads.len());
    for (block, chunk) in loads.chunks(64).enumerate() {
        for (k, nodal) in model.respond_to(chunk).expect("solved").iter().enumerate() {
            let column = DVector::from_iterator(components.len(), components.iter().map(|&c| nodal[c]));
            compliance.set_column(64 * block + k, &column);
        }
    }
    let motions = DMatrix::from_fn(components.len(), 6, |row, m| {
        let mut axis = Vec3::zeros();
        axis[m % 3] = 1.0;
        let moved = if m < 3 { axis } else { axis.cross(&nodes[row / 3].1) };
        moved[row % 3]
    });
    let forces = compliance.cholesky().expect("positive definite").solve(&motions);
    SMatrix::from_iterator((motions.transpose() * forces).iter().copied())
}

/// On the part that hangs over, holding the face's rotation changes its stiffness by a lot. A face of nodes on
/// elements of a third of the radius says the same but for its rim, which elements resolve badly: by how much they
/// overstate a face on the half-space, they overstate this one.
#[test]
fn a_held_face_on_an_overhang_is_as_stiff_as_a_face_of_nodes() {
    let finest = RADIUS / 3.0;
    let [glued, hanging] = [0.025, 0.075].map(|x| {
        let centre = Vec3::new(x, 0.03, SLAB[2]);
        let mesh = snapped(overhanging(&centre, finest), &centre, 0.12 * finest);
        let model = Model::new(&mesh, Order::P2, NU, "fixed").expect("held");
        println!("{} unknowns", model.unknowns());
        let nodes = face_of_nodes(&model, &centre);
        // The tip's own mesh knows nothing of it.
        let coarse = Model::new(&overhanging(&centre, 2.0 * finest), Order::P2, NU, "fixed").expect("held");
        let bench = Bench::new(&coarse, centre, TipFace::Flat, true);
        let tip = bench.press(Vec3::zeros()).by_displacement;
        let own = SMatrix::<f64, 3, 3>::from_fn(|i, j| (0..7).map(|k| tip[(3 * k + i, j)]).sum());
        let held: SMatrix<f64, 3, 3> = nodes.fixed_view::<3, 3>(0, 0).into_owned();
        let turning =
            nodes.fixed_view::<3, 3>(0, 3) * nodes.fixed_view::<3, 3>(3, 3).try_inverse().expect("stiff");
        let free = held - turning * nodes.fixed_view::<3, 3>(3, 0);
        println!("x {x}: tip {own}face of nodes {held}free to turn {free}");
        (own, held, free)
    });
    for i in [0, 2] {
        let gap = [&glued, &hanging].map(|(own, held, _)| held[(i, i)] / own[(i, i)]);
        let turning = hanging.1[(i, i)] / hanging.2[(i, i)];
        println!("axis {i}: nodes over tip {gap:?}, held over free {turning}");
        assert!(gap.iter().all(|g| *g > 0.995 && *g < 1.04), "axis {i}: {gap:?}");
        assert!((gap[1] / gap[0] - 1.0).abs() < 3e-3, "axis {i}: {gap:?}");
    }
    let turning = hanging.1[(2, 2)] / hanging.2[(2, 2)];
    assert!(turning > 1.05, "the overhang does not matter: {turning}");
}

/// Near the slab's free end the face, held level while the slab bends away, touches with one side only; it is then
/// softer than a bonded face, and turning the slab around turns the contact around.
#[test]
fn a_face_lifts_off_where_the_slab_bends_away() {
    let centre = Vec3::new(0.09, 0.03, SLAB[2]);
    let model = Model::new(&overhanging(&centre, 0.006), Order::P2, NU, "fixed").expect("held");
    let [smooth, bonded] = [false, true].map(|b| Bench::new(&model, centre, TipFace::Flat, b));
    let [pressed, stuck] = [&smooth, &bonded].map(|b| b.press(Vec3::new(0.0, 0.0, -1e-3)));
    let share = (pressed.contact_radius_m / RADIUS).powi(2);
    println!(
        "{:.3} of the face touches; smooth over bonded {:.4}",
        share,
        pressed.force().z / stuck.force().z
    );
    assert!(share > 0.1 && share < 0.9, "{share}");
    assert!(pressed.force().z / stuck.force().z < 0.98);
    // Ports 1 and 4 lie along ± the first tangent: the side that touches is the one towards the glue.
    let along: f64 = smooth
        .tip
        .ports()
        .iter()
        .zip(pressed.forces.iter().skip(2).step_by(3))
        .map(|(port, f)| (port.as_disc().expect("a disc").0.centre.x - centre.x) * -f)
        .sum();
    println!("arm {:.2} mm", 1e3 * along / -pressed.force().z);
    assert!(along.abs() > 0.2 * RADIUS * -pressed.force().z);
    // Proportional to the depth.
    let twice = smooth.press(Vec3::new(0.0, 0.0, -2e-3)).force().z;
    assert!((twice / pressed.force().z - 2.0).abs() < 1e-9);
}

/// Over an edge nothing is said of a rigid tip's contact, but of a bonded flat one, which is left free to turn.
#[test]
fn a_rigid_tip_over_an_edge_is_refused() {
    let model =
        Model::new(&overhanging(&Vec3::new(0.05, 0.03, 0.02), 0.006), Order::P2, NU, "fixed").expect("held");
    let tip = |face, bonded| {
        let on = model.space().surface("z+");
        Tip::new(model.space(), on, &Vec3::new(0.1, 0.03, 0.02), RADIUS, face, bonded, NU)
    };
    let sphere = TipFace::Sphere { radius_m: 0.008 };
    for (face, bonded) in [(TipFace::Flat, false), (sphere, false), (sphere, true)] {
        let refused = tip(face, bonded).expect_err("not flat");
        assert!(refused.to_string().contains("(0.1000, 0.0300, 0.0200) m"), "{refused}");
    }
    assert_eq!(tip(TipFace::Flat, true).expect("free to turn").ports().len(), 1);
    assert_eq!(tip(TipFace::Pad, false).expect("a pad").ports().len(), 1);
}

/// `press(C + h dC, d + h dd)` against the first order, at two sizes: what is left falls with the square.
#[test]
fn derivatives_are_exact() {
    let centre = Vec3::new(0.06, 0.03, SLAB[2]);
    let model = Model::new(&overhanging(&centre, 0.006), Order::P2, NU, "fixed").expect("held");
    let depth = Vec3::new(0.0, 0.0, -1e-3);
    for face in [TipFace::Pad, TipFace::Flat, TipFace::Sphere { radius_m: 0.008 }] {
        for bonded in [false, true] {
            let Bench { tip, compliance } = Bench::new(&model, centre, face, bonded);
            let n = compliance.nrows();
            let some = DMatrix::from_fn(n, n, |i, j| ((3 * i + 5 * j + i * j) as f64).sin());
            let change = (&some + some.transpose()) * (0.02 * compliance.norm() / some.norm());
            let on = if bonded { Vec3::new(0.0, 0.0, -1e-4) } else { Vec3::new(2e-5, -3e-5, -1e-4) };
            let radius = tip.resolved_radius(&compliance, &(depth + on)).expect("found");
            let at = |h: f64| {
                let moved = if matches!(face, TipFace::Sphere { .. }) { depth } else { depth + on * h };
                tip.press_within(&(&compliance + &change * h), &moved, radius).expect("pressed")
            };
            let here = at(0.0);
            let mut slope = here.change(&change);
            if !matches!(face, TipFace::Sphere { .. }) {
                slope += &here.by_displacement * on;
            }
            let left = [0.1, 0.05].map(|h| (at(h).forces - &here.forces - &slope * h).norm());
            println!("{face:?}, bonded {bonded}: {left:?} of {:.3e}", slope.norm());
            assert!(left[0] < 0.02 * slope.norm(), "{face:?}, bonded {bonded}");
            assert!(left[1] < 0.3 * left[0] + 1e-12 * slope.norm(), "{face:?}, bonded {bonded}: {left:?}");
            // Along the normal, the displacement alone: the contact of a sphere changes, its force smoothly.
            let forces =
                |d: f64| tip.press(&compliance, &Vec3::new(0.0, 0.0, -d)).expect("pressed").force().z;
            let difference = (forces(1.02e-3) - forces(0.98e-3)) / 4e-5;
            let own = -(0..n / 3).map(|k| here.by_displacement[(3 * k + 2, 2)]).sum::<f64>();
            assert!((own / difference - 1.0).abs() < 0.02, "{face:?}, bonded {bonded}: {own} {difference}");
        }
    }
}
