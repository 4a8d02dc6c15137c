//! A small sound bundle made in memory, to be spoilt in one place by each test.

use phantom_rig::geometry::Vec3;
use phantom_rig::mesh::{Block, TetMesh, block};
use phantom_rig::observation::{
    Contact, MarkerRow, Markers, Noise, Phantom, Poke, Recording, Stage, Tip, TipShape, Wrench,
};

/// A block of 60 × 40 × 20 mm, glued below on the left, free below on the right, observed above.
pub(crate) fn slab() -> TetMesh {
    let mut mesh = block(&Block { size_m: [0.06, 0.04, 0.02], cells: [4, 2, 2] }).expect("a proper block");
    let bottom = mesh.surface("z-").to_vec();
    let left = |f: &[u32; 3]| f.iter().all(|&n| mesh.nodes[n as usize].x < 0.0301);
    let (fixed, search) = bottom.into_iter().partition(left);
    let observed = mesh.surface("z+").to_vec();
    mesh.surfaces = [("fixed", fixed), ("search", search), ("observed", observed)]
        .map(|(name, faces)| (name.to_owned(), faces))
        .into();
    mesh
}

/// Two pokes, three markers, 20 frames a second; marker 7 is occluded every fifth frame.
pub(crate) fn recording() -> Recording {
    let poke = |number, x, start_s, end_s| Poke {
        number,
        site: Vec3::new(x, 0.02, 0.02),
        direction: -Vec3::z(),
        radius_m: 0.004,
        start_s,
        end_s,
    };
    let pokes = vec![poke(1, 0.015, 1.0, 2.0), poke(2, 0.045, 2.5, 3.5)];
    let time_s: Vec<f64> = (0..80).map(|i| 0.05 * f64::from(i)).collect();
    let depth = |t: f64| {
        pokes.iter().filter(|p| t >= p.start_s && t <= p.end_s).map(|p| 0.002 * (t - p.start_s)).sum::<f64>()
    };
    // Alternating in sign with an amplitude of one sigma: a noise of exactly the stated size.
    let ripple = |i: usize, sigma: f64| if i.is_multiple_of(2) { sigma } else { -sigma };
    let noise =
        Noise { force_n: [0.006; 3], torque_nm: [6e-5; 3], marker_m: [5e-5, 5e-5, 1e-4], stage_m: [1e-5; 3] };
    let rows = |scale: f64, sigma: [f64; 3]| -> Vec<[f64; 3]> {
        let row = |(i, &t): (usize, &f64)| {
            [ripple(i, sigma[0]), ripple(i, sigma[1]), ripple(i, sigma[2]) - scale * depth(t)]
        };
        time_s.iter().enumerate().map(row).collect()
    };
    let homes = [[0.01, 0.01, 0.0201], [0.03, 0.02, 0.0199], [0.05, 0.03, 0.0203]];
    let mut marker_rows = Vec::new();
    for (frame, u) in rows(0.3, noise.marker_m).into_iter().enumerate() {
        for (marker, home) in homes.iter().enumerate() {
            if marker != 1 || frame % 5 != 0 {
                let position_m = std::array::from_fn(|a| home[a] + u[a]);
                marker_rows.push(MarkerRow { frame: frame as u32, marker: marker as u32, position_m });
            }
        }
    }
    Recording {
        name: "small".to_owned(),
        rest_until_s: 1.0,
        phantom: Phantom {
            poisson_ratio: 0.47,
            density_kg_m3: 1050.0,
            modulus_range_pa: [5e3, 2e4],
            gravity: None,
        },
        tip: Tip { contact: Contact::Bonded, shape: TipShape::Pad },
        noise,
        max_standoff_m: 0.01,
        mesh: slab(),
        stage: Some(Stage { displacement_m: rows(1.0, noise.stage_m), time_s: time_s.clone() }),
        wrench: Wrench {
            force_n: rows(200.0, noise.force_n),
            torque_nm: rows(0.0, noise.torque_nm),
            time_s: time_s.clone(),
        },
        markers: Markers { numbers: vec![3, 7, 12], frame_time_s: time_s, rows: marker_rows },
        pokes,
    }
}
