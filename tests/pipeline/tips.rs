//! Recordings of rigid tips and of tips that lift off, fitted. They are made with the very model of the quick fit,
//! which a measurement never is: what is asked here is whether a recording's way through evidence, search and outcome
//! is right, not how well a tip is modelled (see the verification tests).

use phantom_rig::fem::{self, Model, Order, Resolution, Space, Spot, TET_EDGES, TipFace, discretise};
use phantom_rig::geometry::Vec3;
use phantom_rig::inverse::{Fit, InverseError, Settings, fit};
use phantom_rig::mesh::{Block, SurfaceIndex, TetMesh, block};
use phantom_rig::observation::{
    Contact, Gravity, MarkerRow, Markers, Noise, Phantom, Poke, Recording, Stage, Tip, TipShape, Wrench,
};

const NU: f64 = 0.47;
const MODULUS: f64 = 9.3e3;
const SIZE: [f64; 3] = [0.08, 0.05, 0.02];
const DEPTH: f64 = 2e-3;

const SITES: [[f64; 2]; 3] = [[0.016, 0.025], [0.037, 0.018], [0.06, 0.03]];

/// A slab glued on the left half of its base, free on the right half.
fn slab() -> TetMesh {
    let mut mesh = block(&Block { size_m: SIZE, cells: [13, 8, 3] }).expect("a block");
    let (glued, free) =
        mesh.surface("z-").iter().partition(|t| t.iter().all(|&n| mesh.nodes[n as usize].x < 0.0431));
    mesh.surfaces.insert("fixed".to_owned(), glued);
    mesh.surfaces.insert("search".to_owned(), free);
    let top = mesh.surface("z+").to_vec();
    mesh.surfaces.insert("observed".to_owned(), top);
    mesh
}

/// The discretisation of a quick fit.
fn cut(mesh: &TetMesh) -> TetMesh {
    let space = Space::new(mesh, Order::P1).expect("sound");
    let discs = SITES.map(|[x, y]| {
        Spot::disc(&space, space.surface("z+"), &Vec3::new(x, y, SIZE[2]), 0.005).expect("on the top")
    });
    discretise(mesh, "fixed", &discs.each_ref(), &Resolution::AS_GIVEN).expect("sound")
}

/// Noise with no pattern, of unit variance, from a counter (splitmix64, twelve uniform numbers summed).
struct Scatter(u64);

impl Scatter {
    fn next(&mut self) -> f64 {
        (0..12)
            .map(|_| {
                self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
                let mut z = self.0;
                z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
                ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
            })
            .sum::<f64>()
            - 6.0
    }

    fn about(&mut self, value: Vec3, sd: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| value[i] + sd[i] * self.next())
    }
}

/// Three pokes, in and out again with a little slide, lifting off at the end.
fn recording(tip: Tip) -> Recording {
    let (face, bonded) = match tip.shape {
        TipShape::Pad => (TipFace::Pad, tip.contact == Contact::Bonded),
        TipShape::Flat => (TipFace::Flat, tip.contact == Contact::Bonded),
        TipShape::Sphere { radius_m } => (TipFace::Sphere { radius_m }, tip.contact == Contact::Bonded),
    };
    let sticks = bonded && matches!(face, TipFace::Sphere { .. });
    let mesh = cut(&slab());
    let model = Model::new(&mesh, Order::P2, NU, "fixed").expect("held");
    let index = SurfaceIndex::new(&mesh, mesh.surface("observed"));
    let rest: Vec<Vec3> = (0..12)
        .map(|i| Vec3::new(0.008 + 0.016 * f64::from(i % 5), 0.009 + 0.016 * f64::from(i / 5), SIZE[2]))
        .collect();
    let markers: Vec<Spot> = rest
        .iter()
        .map(|p| Spot::marker_in(model.space(), &index, "observed", p).expect("attached").0)
        .collect();
    let noise =
        Noise { force_n: [2e-3; 3], torque_nm: [1e-5; 3], marker_m: [2e-5, 2e-5, 4e-5], stage_m: [2e-6; 3] };
    let mut scatter = Scatter(7);
    let mut pokes = Vec::new();
    let (mut stage, mut wrench) = (
        Stage { time_s: vec![], displacement_m: vec![] },
        Wrench { time_s: vec![], force_n: vec![], torque_nm: vec![] },
    );
    let mut seen = Markers { numbers: (0..12).collect(), ..Markers::default() };
    let mut time = 0.0;
    let mut row = |time: f64, moved: Vec3, force: Vec3, at: &[Vec3]| {
        let frame = seen.frame_time_s.len() as u32;
        stage.time_s.push(time);
        stage.displacement_m.push(scatter.about(moved, noise.stage_m));
        wrench.time_s.push(time);
        wrench.force_n.push(scatter.about(force, noise.force_n));
        wrench.torque_nm.push([0.0; 3]);
        seen.frame_time_s.push(time);
        for (marker, (rest, u)) in rest.iter().zip(at).enumerate() {
            let position_m = scatter.about(rest + u, noise.marker_m);
            seen.rows.push(MarkerRow { frame, marker: marker as u32, position_m });
        }
    };
    let still = vec![Vec3::zeros(); rest.len()];
    for i in 0..60 {
        row(0.05 * f64::from(i), Vec3::zeros(), Vec3::zeros(), &still);
    }
    time += 3.0;
    for (number, [x, y]) in SITES.into_iter().enumerate() {
        let site = Vec3::new(x, y, SIZE[2]);
        let on = model.space().surface("observed");
        let tip = fem::Tip::new(model.space(), on, &site, 0.005, face, bonded, NU).expect("on the top");
        let responses = model.respond(&tip.ports().iter().collect::<Vec<_>>()).expect("solved");
        let compliance = tip.compliance(&responses);
        let start_s = time + 0.05;
        let deepest = tip.press(&compliance, &Vec3::new(0.0, 0.0, -DEPTH)).expect("pressed");
        for i in 0..80 {
            let phase = f64::from(i) / 78.0 * std::f64::consts::PI;
            let mut moved = Vec3::new(0.1 * phase.sin(), -0.05 * (2.0 * phase).sin(), -phase.sin()) * DEPTH;
            let forces = if sticks && i <= 39 {
                // Straight in, so that the way is known; aside only on the way back.
                moved = Vec3::new(0.0, 0.0, moved.z);
                tip.press(&compliance, &moved).expect("pressed").forces
            } else if sticks {
                deepest.held_and_moved(&(moved + Vec3::new(0.0, 0.0, DEPTH)))
            } else {
                tip.press(&compliance, &moved).expect("pressed").forces
            };
            let force: Vec3 = forces.as_slice().chunks_exact(3).map(Vec3::from_column_slice).sum();
            let at: Vec<Vec3> = markers
                .iter()
                .map(|m| {
                    let parts = responses.iter().zip(forces.as_slice().chunks_exact(3));
                    parts.map(|(r, f)| r.at(m) * Vec3::new(f[0], f[1], f[2])).sum()
                })
                .collect();
            time += 0.05;
            row(time, moved, force * MODULUS, &at);
        }
        let direction = -Vec3::z();
        pokes.push(Poke { number: number as u32, site, direction, radius_m: 0.005, start_s, end_s: time });
        time += 0.05;
        row(time, Vec3::zeros(), Vec3::zeros(), &still);
    }
    Recording {
        name: "tips".to_owned(),
        rest_until_s: 2.9,
        phantom: Phantom {
            poisson_ratio: NU,
            density_kg_m3: 1050.0,
            modulus_range_pa: [5e3, 2e4],
            gravity: None,
        },
        tip,
        noise,
        max_standoff_m: 0.002,
        mesh: slab(),
        pokes,
        stage: Some(stage),
        wrench,
        markers: seen,
    }
}

fn fitted(recording: &Recording) -> Result<Fit, InverseError> {
    fit(recording, &Settings { quick: true, ..Settings::default() }, &mut |_| {})
}

/// Whether the body's displacements are a quadratic field: one value a node of second-order elements, the middle of an edge off the
/// mean of its ends by less than the ends are apart (more than a third of it under the tip).
fn moves_as_second_order(recording: &Recording, found: &Fit) {
    let space = Space::new(&recording.mesh, Order::P2).expect("sound");
    for poke in &found.pokes {
        let u = &poke.node_displacement_m;
        assert_eq!(u.len(), space.nodes().len());
        let (mut bent, mut apart) = (0.0, 0.0);
        for cell in space.cells() {
            for (k, [i, j]) in TET_EDGES.into_iter().enumerate() {
                let [a, b, middle] = [cell[i], cell[j], cell[4 + k]].map(|n| u[n as usize]);
                bent += (middle - 0.5 * (a + b)).norm_squared();
                apart += (a - b).norm_squared();
            }
        }
        assert!(bent > 0.0 && bent < apart, "poke {}: {bent:e} of {apart:e}", poke.number);
    }
}

/// The modulus is right, no restraint is invented, and what is left is noise.
#[test]
fn every_tip_is_fitted() {
    for (shape, contact) in [
        (TipShape::Flat, Contact::Bonded),
        (TipShape::Pad, Contact::Unilateral),
        (TipShape::Flat, Contact::Unilateral),
        (TipShape::Sphere { radius_m: 0.006 }, Contact::Unilateral),
        (TipShape::Sphere { radius_m: 0.006 }, Contact::Bonded),
    ] {
        let recording = recording(Tip { shape, contact });
        let fit = fitted(&recording).expect("a fit");
        moves_as_second_order(&recording, &fit);
        let (modulus, left) = (fit.young_modulus_pa, fit.residual);
        println!("{shape:?}, {contact:?}: {modulus:?}, {left:?}, {} patches", fit.patches.len());
        // The noise alone leaves about one in a thousand.
        assert!((modulus.value / MODULUS - 1.0).abs() < 3e-3, "{shape:?}, {contact:?}: {modulus:?}");
        assert!(fit.patches.is_empty(), "{shape:?}, {contact:?}: {:?}", fit.patches);
        assert!(left.chi2_per_dof < left.chi2_per_dof_limit, "{shape:?}, {contact:?}: {left:?}");
        let deepest: Vec<f64> =
            fit.pokes.iter().map(|p| p.samples.iter().map(|s| s.depth_m).fold(0.0, f64::max)).collect();
        assert!(
            deepest.iter().all(|d| (d / DEPTH - 1.0).abs() < 0.02),
            "{shape:?}, {contact:?}: {deepest:?}"
        );
    }
}

/// What is not modelled is refused by name.
#[test]
fn a_tip_that_meets_a_sagging_surface_is_refused() {
    let (shape, contact) = (TipShape::Flat, Contact::Unilateral);
    let mut heavy = recording(Tip { shape, contact });
    heavy.phantom.gravity = Some(Gravity { acceleration_m_s2: Vec3::new(0.0, 0.0, -9.81), at_rest: false });
    let refused = fitted(&heavy).expect_err("the surface sags away");
    assert!(matches!(refused, InverseError::MetUnderWeight { shape: TipShape::Flat, .. }), "{refused}");
}
