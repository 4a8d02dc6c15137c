//! Figures on the search nodes, seen on the back of the block: displacements and stiffness errors.

use super::sheet::{Panel, sheet};
use super::tables::{heading, level, number, restraint_name};
use crate::inverse::experiment::{Method, Restraint, StepTwo, Study, Trial};
use std::fmt::Write as _;

/// A panel (px), its margins, and the room a node has for its arrow.
const SIZE: [f64; 2] = [300.0, 300.0];
const MARGIN: f64 = 34.0;
const ARROW: f64 = 34.0;

/// Search nodes in the plane of the back: x to the right, z up, in px of a panel.
fn positions(study: &Study) -> Vec<[f64; 2]> {
    let nodes: Vec<_> =
        study.experiment.search.iter().map(|&n| study.experiment.mesh.nodes[n as usize]).collect();
    let range = |axis: usize| {
        let along = nodes.iter().map(|p| p[axis]);
        (along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max))
    };
    let ((x0, x1), (z0, z1)) = (range(0), range(2));
    let place = |value: f64, low: f64, high: f64, size: f64| {
        MARGIN + (size - 2.0 * MARGIN) * (value - low) / (high - low)
    };
    nodes.iter().map(|p| [place(p.x, x0, x1, SIZE[0]), SIZE[1] - place(p.z, z0, z1, SIZE[1])]).collect()
}

fn caption(study: &Study, restraint: Restraint, shown: &[&Trial], what: &str) -> Vec<String> {
    let at = shown.first().map_or(String::new(), |t| {
        format!("; one draw at {} dB, seed {}", level(t.snr_db), t.seed).replace("none dB", "no noise")
    });
    let [data, model] = heading(study);
    vec![format!("{what} – {}{at}", restraint_name(restraint)), data, model]
}

/// True displacements of the search nodes (broad, grey) and found ones (red), in the plane of the back, one panel
/// a step-one variant. An arrow longer than the room between nodes is cut and ends without a head.
pub(super) fn displacements(study: &Study, restraint: Restraint, truth: &[f64], shown: &[&Trial]) -> String {
    let places = positions(study);
    let length = |u: &[f64], j: usize| u[3 * j + 1].hypot(u[3 * j + 2]);
    let greatest = (0..places.len()).map(|j| length(truth, j)).fold(f64::MIN_POSITIVE, f64::max);
    let arrow = |u: &[f64], j: usize, colour: &str, width: f64| {
        let drawn = ARROW / greatest * length(u, j);
        let cut = drawn > 1.5 * ARROW;
        let scale = ARROW / greatest * if cut { 1.5 * ARROW / drawn } else { 1.0 };
        let ([x, y], [dx, dy]) = (places[j], [scale * u[3 * j + 1], -scale * u[3 * j + 2]]);
        let mut svg = format!(
            "<line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\" \
             stroke-width=\"{width}\"/>\n",
            x + dx,
            y + dy
        );
        let size = dx.hypot(dy);
        if !cut && size > 4.0 {
            let ([ex, ey], head) = ([dx / size, dy / size], 2.0 + 1.5 * width);
            let _ = writeln!(
                svg,
                "<polygon points=\"{:.1},{:.1} {:.1},{:.1} {:.1},{:.1}\" fill=\"{colour}\"/>",
                x + dx + ex * head * 0.4,
                y + dy + ey * head * 0.4,
                x + dx - ex * head - ey * head * 0.6,
                y + dy - ey * head + ex * head * 0.6,
                x + dx - ex * head + ey * head * 0.6,
                y + dy - ey * head - ex * head * 0.6
            );
        }
        svg
    };
    let panels: Vec<Panel> = shown
        .iter()
        .filter(|t| !matches!(t.method, Method::Published { step_two: StepTwo::Direct, .. }))
        .map(|t| {
            let mut body = String::new();
            for (j, [x, y]) in places.iter().enumerate() {
                let fill = if study.experiment.restrained.contains(&j) { "#1864ab" } else { "#bbb" };
                let _ = writeln!(body, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{fill}\"/>");
                body.push_str(&arrow(truth, j, "#adb5bd", 4.0));
            }
            for j in 0..places.len() {
                body.push_str(&arrow(&t.search_m, j, "#e03131", 1.4));
            }
            Panel { title: title(t, &format!("Φ½ = {:.4} m", t.phi_half_m)), body }
        })
        .collect();
    let mut caption = caption(study, restraint, shown, "Displacements of the search nodes");
    caption.push(format!(
        "Grey: true (the longest is {greatest:.3} m). Red: found. Depth to the right, up upward. Blue nodes are \
         restrained. Arrows without a head are cut."
    ));
    sheet(&panels, SIZE, 3, &caption)
}

fn title(trial: &Trial, figure: &str) -> String {
    let name = trial.method.name().replace(" + l1", "");
    format!("{name}: {figure}{}", if trial.converged { "" } else { " (not converged)" })
}

/// Error of the stiffness on every search node, one panel a method; broad rings mark the restrained nodes.
pub(super) fn stiffness(study: &Study, restraint: Restraint, shown: &[&Trial]) -> String {
    let places = positions(study);
    let truth = study.experiment.stiffness(restraint);
    let greatest = truth.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let panels: Vec<Panel> = shown
        .iter()
        .map(|t| {
            let mut body = String::new();
            for (j, [x, y]) in places.iter().enumerate() {
                let error = t.stiffness_n_per_m[j] - truth[j];
                // Blue for too soft, red for too stiff, full colour at the greatest true spring.
                let depth = (error.abs() / greatest).min(1.0);
                let part = |full: f64| (255.0 + (full - 255.0) * depth).round();
                let full = if error > 0.0 { [224.0, 49.0, 49.0] } else { [24.0, 100.0, 171.0] };
                let [r, g, b] = full.map(part);
                let (ring, width) = if truth[j] > 0.0 { ("#212529", 2.5) } else { ("#ced4da", 1.0) };
                let ink = if depth > 0.6 { "white" } else { "#212529" };
                let _ = writeln!(
                    body,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"16\" fill=\"rgb({r},{g},{b})\" stroke=\"{ring}\" \
                     stroke-width=\"{width}\"/>\
                     <text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"10\" text-anchor=\"middle\" fill=\"{ink}\">{}</text>",
                    y + 3.5,
                    short(error)
                );
            }
            let figure = format!("ϒ = {} N/m", number(t.upsilon_n_per_m));
            Panel { title: format!("{}: {figure}", t.method.name()), body }
        })
        .collect();
    let mut caption = caption(study, restraint, shown, "Stiffness error ΔK (N/m) on the search nodes");
    caption.push(format!(
        "Red: too stiff, blue: too soft, full colour from {greatest:.0} N/m on; k thousand, M million. Broad rings: \
         restrained nodes. Seen on the back."
    ));
    sheet(&panels, SIZE, 3, &caption)
}

/// An error in at most four characters and a sign; nothing where there is none.
fn short(value: f64) -> String {
    match value.abs() {
        size if size < 0.05 => String::new(),
        size if size < 9.95 => format!("{value:.1}"),
        size if size < 999.5 => format!("{value:.0}"),
        size if size < 9.95e3 => format!("{:.1}k", value * 1e-3),
        size if size < 999.5e3 => format!("{:.0}k", value * 1e-3),
        size if size.is_finite() => format!("{:.0}M", value * 1e-6),
        _ => "held".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn errors_fit_into_their_node() {
        let written = [0.0, 0.44, -12.3, 999.4, -999.6, 94_500.0, 2e6, f64::INFINITY].map(short);
        assert_eq!(written, ["", "0.4", "-12", "999", "-1.0k", "94k", "2M", "held"]);
    }
}
