//! Depth over time: every poke as the plan expects it.

use super::bench::Bench;
use super::canvas::{Anchor, Canvas, LETTER, Labels, Pen, Scale};
use super::motions::{Leg, Plan};
use crate::acquire::protocol::{Action, Kind};

/// Plans longer than this are drawn in minutes (s).
const LONG_S: f64 = 600.0;

const HEIGHT: f64 = 150.0;

/// Draws it below `top` (px) between `left` and `right`; returns where it ends.
pub(super) fn draw(canvas: &mut Canvas, plan: &Plan, bench: &Bench, top: f64, left: f64, right: f64) -> f64 {
    let (unit, unit_s) = if plan.duration_s > LONG_S { ("min", 60.0) } else { ("s", 1.0) };
    let deepest_m = plan.steps.iter().flat_map(|step| step.contact).map(|c| c.depth_m).fold(1e-3, f64::max);
    let upper = top + 3.0 * LETTER + 8.0;
    let lower = upper + HEIGHT;
    let time = Scale { values: [0.0, plan.duration_s.max(1.0) / unit_s], px: [left, right] };
    let depth = Scale { values: [-bench.clearance_m * 1e3, deepest_m * 1.08e3], px: [upper, lower] };

    canvas.line([left, depth.at(0.0)], [right, depth.at(0.0)], Pen::Faint);
    canvas.text([right + 4.0, depth.at(0.0) + 4.0], Anchor::Start, "surface");
    let (numbers_y, remarks_y) = (upper - 6.0, upper - 8.0 - LETTER);
    let (mut numbers, mut remarks) = (Labels::new(), Labels::new());
    let mut at = [left, depth.at(-bench.clearance_m * 1e3)];
    let clear_y = at[1];
    for step in &plan.steps {
        let mut points = vec![at];
        for leg in &step.legs {
            let x = |s: f64| time.at(s / unit_s);
            match leg.depth_m {
                Some([from, to]) => {
                    points.push([x(leg.start_s), depth.at(from * 1e3)]);
                    points.push([x(leg.end_s()), depth.at(to * 1e3)]);
                }
                None => points.push([x(leg.end_s()), clear_y]),
            }
        }
        at = points.last().copied().unwrap_or(at);
        let air = step.step.kind == Kind::Air;
        canvas.curve(&points, if air { Pen::Dashed } else { Pen::Thin });
        let near = |leg: &&Leg| leg.depth_m.is_some();
        let start_s = step.legs.iter().find(near).map_or(step.start_s, |leg| leg.start_s);
        let end_s = step.legs.iter().rfind(near).map_or(step.start_s, Leg::end_s);
        let middle_s = 0.5 * (start_s + end_s);
        match &step.step.action {
            Action::Stroke { .. } => {
                let label = step.step.poke.map_or("air".to_owned(), |poke| poke.to_string());
                numbers.put(canvas, [time.at(middle_s / unit_s), numbers_y], Anchor::Middle, &label);
            }
            Action::Ask { .. } | Action::Mark { .. } => {
                let x = time.at(step.start_s / unit_s);
                canvas.line([x, remarks_y + 3.0], [x, lower], Pen::Dashed);
                remarks.put(canvas, [x, remarks_y], Anchor::Start, step.step.kind.name());
            }
            Action::Wait { .. } => {}
        }
    }

    canvas.line([left, upper], [left, lower], Pen::Thin);
    canvas.line([left, lower], [right, lower], Pen::Thin);
    for (value, text) in depth.ticks(25.0) {
        let y = depth.at(value);
        canvas.line([left - 4.0, y], [left, y], Pen::Thin);
        canvas.text([left - 7.0, y + 4.0], Anchor::End, &text);
    }
    for (value, text) in time.ticks(50.0) {
        let x = time.at(value);
        canvas.line([x, lower], [x, lower + 4.0], Pen::Thin);
        canvas.text([x, lower + 4.0 + LETTER], Anchor::Middle, &text);
    }
    canvas.text([left - 7.0, remarks_y], Anchor::End, "depth (mm)");
    canvas.text([right, lower + 6.0 + 2.0 * LETTER], Anchor::End, &format!("time ({unit})"));
    lower + 2.0 * LETTER + 16.0
}
