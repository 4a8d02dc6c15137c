//! Figures of the deformed block, seen from behind, where the search nodes are: the true shape and what each variant
//! makes of it, at true scale.

use super::sheet::{Panel, sheet};
use super::tables::{heading, level, restraint_name};
use crate::geometry::Vec3;
use crate::inverse::experiment::{Restraint, Shape, Study};
use crate::mesh::MeshError;
use std::fmt::Write as _;

const SIZE: [f64; 2] = [215.0, 330.0];
/// From the body to the eye: behind, to the left of the front's left side, above.
const EYE: [f64; 3] = [-0.55, 0.75, 0.38];
/// Surfaces that are seen from there.
const SEEN: [&str; 3] = ["y+", "x-", "z+"];
/// px a metre.
const SCALE: f64 = 33.0;

struct Camera {
    right: Vec3,
    up: Vec3,
    eye: Vec3,
    centre: Vec3,
}

impl Camera {
    fn new(nodes: &[Vec3]) -> Self {
        let eye = Vec3::from(EYE).normalize();
        let right = Vec3::z().cross(&eye).normalize();
        let centre = nodes.iter().sum::<Vec3>() / nodes.len().max(1) as f64;
        Self { right, up: eye.cross(&right), eye, centre }
    }

    /// In px of a panel, with the distance towards the eye (m).
    fn project(&self, p: &Vec3) -> ([f64; 2], f64) {
        let q = p - self.centre;
        let x = 0.5 * SIZE[0] + SCALE * q.dot(&self.right);
        ([x, 0.5 * SIZE[1] - SCALE * q.dot(&self.up)], q.dot(&self.eye))
    }
}

/// The shapes of one restraint, the true one first.
pub(super) fn shapes(study: &Study, restraint: Restraint, all: &[Shape]) -> Result<String, MeshError> {
    let mine: Vec<&Shape> = all.iter().filter(|s| s.restraint == restraint).collect();
    let truth = mine.iter().find(|s| s.method.is_none()).map(|s| &s.displacement_m);
    let greatest = truth.map_or(1.0, |u| u.iter().map(Vec3::norm).fold(0.0, f64::max)).max(f64::MIN_POSITIVE);
    let camera = Camera::new(&study.experiment.mesh.nodes);
    let panels: Vec<Panel> = mine
        .iter()
        .map(|shape| {
            let name = shape.method.map_or("true".to_owned(), |m| m.name().replace(" + l1", ""));
            let note = if shape.converged { "" } else { " (not converged)" };
            Panel {
                title: format!("{name}{note}"),
                body: outline(study, &camera) + &block(study, &camera, shape, greatest),
            }
        })
        .collect();
    let at = study.shown(restraint).first().map_or(String::new(), |t| {
        format!("; one draw at {} dB, seed {}", level(t.snr_db), t.seed).replace("none dB", "no noise")
    });
    let [data, model] = heading(study);
    let caption = [
        format!("Deformed block – {}{at}", restraint_name(restraint)),
        data,
        model,
        format!(
            "Seen from behind, true scale. Shade: displacement, full at {greatest:.2} m. Dashed: at rest. Dots: search \
             nodes, blue where restrained. The load presses the upper right corner, on the far side, towards the eye."
        ),
    ];
    Ok(sheet(&panels, SIZE, 6, &caption))
}

/// The edges of the block at rest.
fn outline(study: &Study, camera: &Camera) -> String {
    let nodes = &study.experiment.mesh.nodes;
    let (low, high) = nodes.iter().fold((camera.centre, camera.centre), |(l, h), p| (l.inf(p), h.sup(p)));
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
        camera.project(&Vec3::new(pick(0), pick(1), pick(2))).0
    };
    let mut svg = String::new();
    for i in 0..8_usize {
        for axis in (0..3).filter(|axis| i >> axis & 1 == 0) {
            let ([x1, y1], [x2, y2]) = (corner(i), corner(i | 1 << axis));
            let _ = writeln!(
                svg,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"#868e96\" \
                 stroke-width=\"0.8\" stroke-dasharray=\"3 3\"/>"
            );
        }
    }
    svg
}

/// The surface as displaced, farthest triangles first, and the search nodes on it.
fn block(study: &Study, camera: &Camera, shape: &Shape, greatest: f64) -> String {
    let mesh = &study.experiment.mesh;
    let at = |n: u32| mesh.nodes[n as usize] + shape.displacement_m[n as usize];
    let mut triangles: Vec<(f64, [u32; 3])> = SEEN
        .iter()
        .flat_map(|name| mesh.surface(name))
        .map(|&t| (t.iter().map(|&n| camera.project(&at(n)).1).sum::<f64>(), t))
        .collect();
    triangles.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut svg = String::new();
    for (_, triangle) in triangles {
        let size =
            triangle.iter().map(|&n| shape.displacement_m[n as usize].norm()).sum::<f64>() / 3.0 / greatest;
        let part = |full: f64| (250.0 + (full - 250.0) * size.min(1.0)).round();
        let [r, g, b] = [253.0, 126.0, 20.0].map(part);
        let points: Vec<String> = triangle
            .iter()
            .map(|&n| camera.project(&at(n)).0)
            .map(|[x, y]| format!("{x:.1},{y:.1}"))
            .collect();
        let _ = writeln!(
            svg,
            "<polygon points=\"{}\" fill=\"rgb({r},{g},{b})\" stroke=\"#495057\" stroke-width=\"0.25\" \
             stroke-linejoin=\"round\"/>",
            points.join(" ")
        );
    }
    for (j, &n) in study.experiment.search.iter().enumerate() {
        let [x, y] = camera.project(&at(n)).0;
        let fill = if study.experiment.restrained.contains(&j) { "#1864ab" } else { "#868e96" };
        let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.4\" fill=\"{fill}\"/>");
    }
    svg
}
