//! The way from a recording to a fit, on recordings of the method's own model: what must come out without noise.

use super::bench::PhantomBench;
use super::measure::measurements;
use super::sprung::sprung;
use super::{Variant, fit_recording};
use crate::fem::Order;
use crate::geometry::Vec3;
use crate::inverse::{Drive, Driven, Evidence, MarkerView, PatchKind};
use crate::mesh::{Block, block};
use crate::observation::{
    Contact, MarkerRow, Markers, Noise, Phantom, Poke, Recording, Stage, Tip, TipShape, Wrench,
};

const E: f64 = 11_000.0;
const PULL_N_PER_M: f64 = 40.0;

/// Two pokes that ramp up and hold; markers stand on the mesh, nothing has moved yet.
fn still() -> Recording {
    let mut mesh = block(&Block { size_m: [0.08, 0.06, 0.02], cells: [8, 6, 2] }).expect("a block");
    let bottom = mesh.surfaces.remove("z-").expect("a bottom");
    let (fixed, search) = bottom.into_iter().partition(|&t| mesh.triangle(t).0.iter().all(|p| p.x < 0.041));
    let top = mesh.surfaces.remove("z+").expect("a top");
    let rest: Vec<Vec3> =
        mesh.nodes.iter().filter(|p| p.z > 0.0199 && p.x > 0.005 && p.y > 0.005).copied().collect();
    mesh.surfaces =
        [("fixed".to_owned(), fixed), ("search".to_owned(), search), ("observed".to_owned(), top)].into();
    let poke = |number, x, start_s| Poke {
        number,
        site: Vec3::new(x, 0.03, 0.02),
        direction: -Vec3::z(),
        radius_m: 0.008,
        start_s,
        end_s: start_s + 2.0,
    };
    let time: Vec<f64> = (0..70).map(|i| 0.1 * f64::from(i)).collect();
    let rows = (0..time.len()).flat_map(|frame| {
        rest.iter().enumerate().map(move |(marker, p)| MarkerRow {
            frame: frame as u32,
            marker: marker as u32,
            position_m: (*p).into(),
        })
    });
    Recording {
        name: "own".to_owned(),
        rest_until_s: 1.0,
        phantom: Phantom {
            poisson_ratio: 0.45,
            density_kg_m3: 1000.0,
            modulus_range_pa: [5e3, 2e4],
            gravity: None,
        },
        tip: Tip { contact: Contact::Bonded, shape: TipShape::Pad },
        noise: Noise { force_n: [1e-6; 3], torque_nm: [1e-8; 3], marker_m: [1e-9; 3], stage_m: [1e-9; 3] },
        max_standoff_m: 0.01,
        pokes: vec![poke(1, 0.06, 1.05), poke(2, 0.05, 4.05)],
        stage: None,
        wrench: Wrench { force_n: vec![[0.0; 3]; 70], torque_nm: vec![[0.0; 3]; 70], time_s: time.clone() },
        markers: Markers {
            numbers: (0..rest.len() as u32).collect(),
            rows: rows.collect(),
            frame_time_s: time,
        },
        mesh,
    }
}

/// The same, poked with up to 0.4 N on a body with two springs; the springs' places.
fn poked() -> (Recording, [Vec3; 2]) {
    let mut recording = still();
    for (i, force) in recording.wrench.force_n.iter_mut().enumerate() {
        let t = 0.1 * i as f64;
        if let Some(poke) = recording.pokes.iter().find(|p| t >= p.start_s && t <= p.end_s) {
            *force = [0.02 * (t - poke.start_s), 0.0, -0.2 * (t - poke.start_s)];
        }
    }
    let evidence = Evidence::new(&recording, Some(Driven::ByWrench)).expect("evidence");
    let bench = PhantomBench::new(&recording, &evidence, Order::P1).expect("a bench");
    let at = |x: f64, y: f64| {
        let p = Vec3::new(x, y, 0.0);
        bench
            .nodes
            .iter()
            .position(|&n| (recording.mesh.nodes[n as usize] - p).norm() < 1e-9)
            .expect("a node")
    };
    let on = [at(0.07, 0.01), at(0.07, 0.05)];
    let places = on.map(|j| recording.mesh.nodes[bench.nodes[j] as usize]);
    let mut springs = vec![0.0; bench.nodes.len()];
    on.iter().for_each(|&j| springs[j] = PULL_N_PER_M);
    let body = sprung(&bench.loaded, E, &springs).expect("a body");
    let sites: Vec<_> = evidence.sites.iter().map(|s| s.pokes.clone()).collect();
    for row in &mut recording.markers.rows {
        let t = recording.markers.frame_time_s[row.frame as usize];
        let poke = recording.pokes.iter().position(|p| t >= p.start_s && t <= p.end_s);
        let Some(site) = poke.and_then(|p| sites.iter().position(|s| s.contains(&p))) else { continue };
        let mut drive = Drive::zeros();
        drive.fixed_rows_mut::<3>(0).copy_from_slice(&recording.wrench.force_n[row.frame as usize]);
        let moved = &body.observed * bench.share(site, &drive);
        for axis in 0..3 {
            row.position_m[axis] += moved[3 * row.marker as usize + axis];
        }
    }
    (recording, places)
}

#[test]
fn the_instant_of_largest_load_is_the_last_of_the_ramp() {
    let (mut recording, _) = poked();
    let evidence = Evidence::new(&recording, Some(Driven::ByWrench)).expect("evidence");
    let times: Vec<f64> = measurements(&recording, &evidence).iter().map(|m| m.time_s).collect();
    assert_eq!(times.len(), 2);
    assert!((times[0] - 3.0).abs() < 1e-9 && (times[1] - 6.0).abs() < 1e-9, "{times:?}");
    // A stage that is deepest earlier decides.
    let time_s = recording.wrench.time_s.clone();
    let displacement_m =
        time_s.iter().map(|t| [0.0, 0.0, -1e-3 * (2.0 - (t - 2.0).abs()).max(0.0)]).collect();
    recording.stage = Some(Stage { time_s, displacement_m });
    let evidence = Evidence::new(&recording, Some(Driven::ByWrench)).expect("evidence");
    assert!((measurements(&recording, &evidence)[0].time_s - 2.0).abs() < 1e-9);
}

#[test]
fn without_noise_modulus_and_springs_come_back() {
    let (recording, on) = poked();
    for variant in [Variant::Published, Variant::Direct] {
        let fit = fit_recording(&recording, variant, Order::P1, &|| ()).expect("a fit");
        assert!(
            (fit.young_modulus_pa.value / E - 1.0).abs() < 1e-3,
            "{variant:?}: {:?}",
            fit.young_modulus_pa
        );
        let total = fit.restraint_total_n_per_m.value;
        assert!((total / (2.0 * PULL_N_PER_M) - 1.0).abs() < 0.05, "{variant:?}: {total} N/m");
        let patches: f64 = fit
            .patches
            .iter()
            .map(|p| match p.kind {
                PatchKind::Springs { stiffness_n_per_m } => stiffness_n_per_m.value,
                PatchKind::Glued { .. } => 0.0,
            })
            .sum();
        assert!((patches / total - 1.0).abs() < 0.05, "{variant:?}: {patches} N/m in patches");
        for place in on {
            assert!(fit.patches.iter().any(|p| (p.centroid_m - place).norm() < 0.005), "{:?}", fit.patches);
        }
        assert!(fit.young_modulus_pa.sd.is_nan() && fit.remarks[0].contains("states no deviation"));
        let largest = |of: fn(&MarkerView) -> Vec3| {
            fit.pokes.iter().flat_map(|p| &p.markers).map(|m| of(m).norm()).fold(0.0, f64::max)
        };
        assert!(largest(|m| m.measured_m - m.modelled_m) < 0.01 * largest(|m| m.measured_m));
    }
}
