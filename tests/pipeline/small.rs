//! A small phantom with two pokes and three markers, and the inverse problem on it.

use phantom_rig::fem::{self, Model, Order, Spot, TipFace};
use phantom_rig::geometry::Vec3;
use phantom_rig::inverse::{Bench, Driven, Evidence, Problem};
use phantom_rig::mesh::{Block, SurfaceIndex, TetMesh, block};
use phantom_rig::observation::{
    Contact, Gravity, MarkerRow, Markers, Noise, Phantom, Poke, Recording, Stage, Tip, TipShape, Wrench,
};

const NU: f64 = 0.47;

/// A block of 60 × 50 × 20 mm, glued on the left half of its base, searched on the right half.
pub(crate) fn body() -> TetMesh {
    let mut mesh = block(&Block { size_m: [0.06, 0.05, 0.02], cells: [9, 8, 4] }).expect("a block");
    let (glued, free) =
        mesh.surface("z-").iter().partition(|t| t.iter().all(|&n| mesh.nodes[n as usize].x < 0.0201));
    mesh.surfaces.insert("fixed".to_owned(), glued);
    mesh.surfaces.insert("search".to_owned(), free);
    let top = mesh.surface("z+").to_vec();
    mesh.surfaces.insert("observed".to_owned(), top);
    mesh
}

/// Readings that no model explains: the derivative must hold wherever the residual is. The stage is exact, because
/// its noise would enter the force's whitening through the stiffness, which the Jacobian holds fixed.
pub(crate) fn recording(mesh: TetMesh, heavy: bool, tip: Tip) -> Recording {
    let rows = 40;
    let time_s: Vec<f64> = (0..rows).map(|i| f64::from(i) * 0.1).collect();
    let motion = |i: i32, size: f64| {
        let t = f64::from(i) * 0.37;
        [size * (t.sin() + 0.3), size * ((1.7 * t).cos() - 0.2), -size * (1.5 + (0.6 * t).sin())]
    };
    let seen = [[0.015, 0.012], [0.032, 0.04], [0.05, 0.02]];
    let mut markers = Markers { numbers: vec![3, 4, 9], ..Markers::default() };
    for (frame, time) in time_s.iter().enumerate() {
        markers.frame_time_s.push(*time);
        for (marker, [x, y]) in seen.into_iter().enumerate() {
            let resting = *time < 0.45;
            let [dx, dy, dz] =
                if resting { [0.0; 3] } else { motion(frame as i32 + 5 * marker as i32, 4e-4) };
            markers.rows.push(MarkerRow {
                frame: frame as u32,
                marker: marker as u32,
                position_m: [x + dx, y + dy, 0.0205 + dz],
            });
        }
    }
    let poke = |number: u32, x: f64, y: f64, start_s: f64, end_s: f64| Poke {
        number,
        site: Vec3::new(x, y, 0.02),
        direction: -Vec3::z(),
        radius_m: 0.005,
        start_s,
        end_s,
    };
    Recording {
        name: "taylor".to_owned(),
        rest_until_s: 0.45,
        phantom: Phantom {
            poisson_ratio: NU,
            density_kg_m3: 1050.0,
            modulus_range_pa: [5e3, 2e4],
            gravity: heavy
                .then_some(Gravity { acceleration_m_s2: Vec3::new(0.0, -1.0, -9.8), at_rest: false }),
        },
        tip,
        noise: Noise {
            force_n: [0.01, 0.011, 0.012],
            torque_nm: [1e-4; 3],
            marker_m: [2e-5, 2e-5, 6e-5],
            stage_m: [0.0; 3],
        },
        max_standoff_m: 0.002,
        mesh,
        pokes: vec![poke(1, 0.023, 0.03, 0.5, 2.2), poke(2, 0.044, 0.017, 2.3, 3.9)],
        stage: Some(Stage {
            time_s: time_s.clone(),
            displacement_m: (0..rows).map(|i| motion(i, 1e-3)).collect(),
        }),
        wrench: Wrench {
            force_n: (0..rows).map(|i| motion(i + 3, 0.1)).collect(),
            torque_nm: (0..rows).map(|i| motion(2 * i + 1, 3e-4)).collect(),
            time_s,
        },
        markers,
    }
}

pub(crate) fn problem<'a>(recording: &Recording, evidence: &'a Evidence) -> Problem<'a> {
    let mesh = &recording.mesh;
    let model = Model::new(mesh, Order::P2, NU, "fixed").expect("held");
    let top = model.space().surface("observed").to_vec();
    let tips = evidence
        .sites
        .iter()
        .map(|s| {
            let (face, bonded) = match (evidence.driven, recording.tip.shape) {
                (Driven::ByWrench, _) => (TipFace::Pad, true),
                (Driven::ByStage, shape) => {
                    let face = match shape {
                        TipShape::Pad => TipFace::Pad,
                        TipShape::Flat => TipFace::Flat,
                        TipShape::Sphere { radius_m } => TipFace::Sphere { radius_m },
                    };
                    (face, recording.tip.contact == Contact::Bonded)
                }
            };
            fem::Tip::new(model.space(), &top, &s.centre, s.radius_m, face, bonded, NU).expect("on the top")
        })
        .collect();
    let index = SurfaceIndex::new(mesh, mesh.surface("observed"));
    let markers: Vec<Spot> = evidence
        .rest
        .iter()
        .map(|(p, _)| Spot::marker_in(model.space(), &index, "observed", p).expect("attached").0)
        .collect();
    let weight = recording.phantom.gravity.map(|g| g.acceleration_m_s2 * recording.phantom.density_kg_m3);
    let sites: Vec<_> = evidence.sites.iter().map(|s| (s.centre, s.lift)).collect();
    let search = model.space().surface("search").to_vec();
    let bench = Bench::new(model, tips, markers, &sites, evidence.driven, weight).expect("solved");
    Problem::new(evidence, bench, search, Vec::new(), 0.02).expect("solved")
}
