//! A recording and a fit with plausible values, made without a model: a block with one Gaussian dent a poke.
//!
//! Nothing here is a result; the tests only ask whether what goes in is what is shown.

use phantom_rig::geometry::Vec3;
use phantom_rig::inverse::{
    Discretisation, Estimate, Fit, FitMethod, MarkerView, Patch, PatchKind, PokeView, Residual, Sample,
};
use phantom_rig::mesh::{Block, TetMesh, block};
use phantom_rig::observation::{
    Contact, Markers, Noise, Phantom, Poke, Recording, Stage, Tip, TipShape, Wrench,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::fs;
use std::path::{Path, PathBuf};

/// One standard deviation of the noise: force (N) along x, y, z; marker (m) along x, y, z.
const FORCE_SD: [f64; 3] = [0.006; 3];
const MARKER_SD: [f64; 3] = [5e-5, 5e-5, 1e-4];
const RADIUS_M: f64 = 0.008;
const SITES: [[f64; 3]; 7] = [
    [0.03, 0.05, 0.0035],
    [0.03, 0.05, 0.0020],
    [0.10, 0.05, 0.0035],
    [0.13, 0.05, 0.0030],
    [0.12, 0.03, 0.0030],
    [0.12, 0.07, 0.0025],
    [0.07, 0.05, 0.0035],
];

/// An empty folder inside the build folder: what a test leaves there can be looked at afterwards.
pub(crate) fn kept_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("page").join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old folder");
    }
    fs::create_dir_all(&folder).expect("a new folder");
    folder
}

/// A slab 150 × 100 × 25 mm: glued below for x < 60 mm, searched below beyond, observed on top.
fn mesh() -> TetMesh {
    let mut mesh = block(&Block { size_m: [0.15, 0.1, 0.025], cells: [25, 16, 4] }).expect("a block");
    let bottom = mesh.surfaces.remove("z-").expect("a bottom");
    let (fixed, search): (Vec<_>, Vec<_>) =
        bottom.into_iter().partition(|&t| mesh.triangle(t).0.iter().all(|p| p.x <= 0.0601));
    let observed = mesh.surfaces.remove("z+").expect("a top");
    mesh.surfaces =
        [("fixed", fixed), ("search", search), ("observed", observed)].map(|(n, s)| (n.to_owned(), s)).into();
    mesh
}

/// A recording with seven pokes on the top of the slab.
pub(crate) fn recording(name: &str) -> Recording {
    let pokes = SITES.iter().enumerate().map(|(i, site)| Poke {
        number: i as u32 + 1,
        site: Vec3::new(site[0], site[1], 0.025),
        direction: -Vec3::z(),
        radius_m: RADIUS_M,
        start_s: 1.0 + 9.0 * i as f64,
        end_s: 9.0 + 9.0 * i as f64,
    });
    Recording {
        name: name.to_owned(),
        rest_until_s: 1.0,
        phantom: Phantom {
            poisson_ratio: 0.47,
            density_kg_m3: 1050.0,
            modulus_range_pa: [5e3, 2e4],
            gravity: None,
        },
        tip: Tip { contact: Contact::Bonded, shape: TipShape::Pad },
        noise: Noise { force_n: FORCE_SD, torque_nm: [6e-5; 3], marker_m: MARKER_SD, stage_m: [1e-5; 3] },
        max_standoff_m: 0.01,
        mesh: mesh(),
        pokes: pokes.collect(),
        stage: Some(Stage::default()),
        wrench: Wrench::default(),
        markers: Markers::default(),
    }
}

/// A fit of `recording` that explains it down to the noise: one spring patch, one glued.
pub(crate) fn fit(recording: &Recording) -> Fit {
    let mut noise = Normals(ChaCha8Rng::seed_from_u64(7));
    let pokes = recording.pokes.iter().zip(SITES).map(|(p, s)| poke(recording, p, s[2], &mut noise));
    Fit {
        recording: recording.name.clone(),
        method: FitMethod::Default,
        young_modulus_pa: Estimate { value: 10_482.0, sd: 51.0 },
        young_modulus_interval90_pa: [10_398.0, 10_566.0],
        young_modulus_bound_pa: 38.0,
        young_modulus_expected_pa: [5e3, 2e4],
        settled: true,
        restraint_total_n_per_m: Estimate { value: 124.3, sd: 3.1 },
        patches: vec![
            spring([0.12, 0.03, 0.0], 0.0052, Estimate { value: 66.1, sd: 2.3 }, 2.0),
            spring([0.12, 0.07, 0.0], 0.0049, Estimate { value: 58.2, sd: 2.4 }, 2.1),
            Patch {
                kind: PatchKind::Glued { stiffness_lower_bound_n_per_m: 2100.0 },
                ..spring([0.08, 0.05, 0.0], 0.005, Estimate { value: 0.0, sd: 0.0 }, 0.0)
            },
        ],
        correlation: vec![vec![1.0, -0.41, -0.37], vec![-0.41, 1.0, 0.18], vec![-0.37, 0.18, 1.0]],
        residual: Residual {
            marker_rms_m: 7.1e-5,
            force_rms_n: 0.00602,
            chi2_per_dof: 1.004,
            chi2_per_dof_expected: 1.0,
            chi2_per_dof_limit: 1.019,
            rest_noise_over_stated: [1.01, 0.98],
        },
        discretisation: Discretisation {
            element: "P2".to_owned(),
            given_nodes: recording.mesh.nodes.len(),
            given_tets: recording.mesh.tets.len(),
            degrees_of_freedom: 43_000,
            modulus_error: 0.003,
        },
        remarks: vec![
            "Poisson's ratio is taken as 0.47; the pokes say little about it.".to_owned(),
            "The patch at (80, 50, 0) mm is too stiff to be told from glue: only a lower bound is given."
                .to_owned(),
        ],
        pokes: pokes.collect(),
    }
}

/// The same, but with a force that relaxes while the model's does not: up to 30 times the noise.
pub(crate) fn unexplained(recording: &Recording) -> Fit {
    let mut fit = fit(recording);
    fit.residual.chi2_per_dof = 16.8;
    for poke in &mut fit.pokes {
        poke.chi2_per_value = 4.0 * f64::from(poke.number);
        let start_s = poke.samples[0].time_s;
        for sample in &mut poke.samples {
            let relaxed = 0.3 * (1.0 - (-(sample.time_s - start_s) / 2.0).exp());
            sample.measured_n[2] -= relaxed * sample.modelled_n[2];
        }
    }
    fit
}

struct Normals(ChaCha8Rng);

impl Normals {
    fn draw(&mut self, sd: [f64; 3]) -> [f64; 3] {
        sd.map(|s| {
            let z: f64 = StandardNormal.sample(&mut self.0);
            s * z
        })
    }
}

fn spring(centroid: [f64; 3], radius_m: f64, stiffness_n_per_m: Estimate, bound: f64) -> Patch {
    Patch {
        kind: PatchKind::Springs { stiffness_n_per_m },
        centroid_m: Vec3::from(centroid),
        centroid_sd_m: Vec3::new(4e-4, 5e-4, 0.0),
        radius_m,
        radius_estimated: true,
        stiffness_bound_n_per_m: Some(bound),
    }
}

/// Displacement `(m)` at `at` of a dent of `depth` (m) under `site`: Gaussian across, linear to the base.
fn dent(at: &Vec3, site: &Vec3, depth: f64) -> Vec3 {
    let across = ((at.x - site.x).powi(2) + (at.y - site.y).powi(2)).sqrt();
    let share = at.z / site.z * (-0.5 * (across / 0.011).powi(2)).exp();
    let radial = Vec3::new(at.x - site.x, at.y - site.y, 0.0) / 0.011;
    depth * share * (0.25 * radial - Vec3::z())
}

fn poke(recording: &Recording, poke: &Poke, depth: f64, noise: &mut Normals) -> PokeView {
    let duration = poke.end_s - poke.start_s;
    let samples = (0..400).map(|i| {
        let time_s = poke.start_s + duration * f64::from(i) / 399.0;
        let phase = (time_s - poke.start_s) / duration;
        let depth_m = depth * (phase / 0.3).min((1.0 - phase) / 0.3).clamp(0.0, 1.0);
        let modelled_n = [0.02 * phase, -0.01 * phase, -190.0 * depth_m];
        let error = noise.draw(FORCE_SD);
        let measured_n = [0, 1, 2].map(|c| modelled_n[c] + error[c]);
        Sample { time_s, depth_m, measured_n, modelled_n }
    });
    let samples = samples.collect();
    let markers = (0..176).map(|i| {
        let rest_m = Vec3::new(0.005 + 0.0093 * f64::from(i % 16), 0.005 + 0.009 * f64::from(i / 16), 0.025);
        let modelled_m = dent(&rest_m, &poke.site, depth);
        let measured_m = modelled_m + Vec3::from(noise.draw(MARKER_SD));
        MarkerView { number: i + 1, rest_m, measured_m, modelled_m }
    });
    PokeView {
        number: poke.number,
        site_m: poke.site,
        direction: poke.direction,
        radius_m: poke.radius_m,
        deepest_s: poke.start_s + 0.5 * duration,
        node_displacement_m: recording.mesh.nodes.iter().map(|n| dent(n, &poke.site, depth)).collect(),
        markers: markers.collect(),
        samples,
        chi2_per_value: 0.97 + 0.01 * f64::from(poke.number),
    }
}
