//! The plane of motion seen from the side: the phantom, where it is poked, how deep, and in which order.

use super::bench::Bench;
use super::canvas::{Anchor, Canvas, LETTER, Labels, Pen, Scale, width};
use super::motions::Plan;
use crate::acquire::protocol::Action;
use crate::device::AXES;
use crate::geometry::Vec3;

/// Free space around what is drawn (m).
const MARGIN_M: f64 = 5e-3;

/// Half of the bar at a depth, in radii of the tip.
const BAR: f64 = 0.3;

/// Rows of numbers above the pokes; what needs more is left out.
const MOST_ROWS: usize = 6;

/// Coordinates of the drawing: to the right and up, in the phantom frame.
struct View {
    right: Vec3,
    up: Vec3,
    /// px for a metre.
    scale: f64,
    /// Lowest coordinates drawn (m) and where they are (px).
    low_m: [f64; 2],
    at_px: [f64; 2],
}

impl View {
    fn flat(&self, place: Vec3) -> [f64; 2] {
        [place.dot(&self.right), place.dot(&self.up)]
    }

    fn px(&self, place: Vec3) -> [f64; 2] {
        let [u, v] = self.flat(place);
        [self.at_px[0] + (u - self.low_m[0]) * self.scale, self.at_px[1] - (v - self.low_m[1]) * self.scale]
    }
}

/// Pokes along one line.
struct Spot {
    site: Vec3,
    direction: Vec3,
    air: bool,
    depths_m: Vec<f64>,
    /// Numbers of the pokes, ascending.
    pokes: Vec<u32>,
}

/// Draws it below `top` (px) between `left` and `right`; returns where it ends.
pub(super) fn draw(canvas: &mut Canvas, plan: &Plan, bench: &Bench, top: f64, left: f64, right: f64) -> f64 {
    let spots = spots(plan, bench);
    let mut first = [0.0; AXES];
    first[0] = 1.0;
    let up = -bench.tip_axis();
    let along = bench.mounting.moved_by(first);
    let across = (along - up * along.dot(&up)).normalize();
    let mut view = View { right: across, up, scale: 1.0, low_m: [0.0; 2], at_px: [0.0; 2] };
    let (low, high) = extent(&view, &spots, bench);
    view.scale = (right - left) / (high[0] - low[0]);
    view.low_m = low;

    let normal = across.cross(&up);
    let normal = normal * normal[normal.iamax()].signum();
    let at_mm = normal.dot(&bench.mounting.tip_at([0.0; AXES])) * 1e3;
    let caption = format!(
        "The plane {} = {at_mm:.1} mm. Above: numbers of the pokes. Below: largest depth (mm). Bars mark depths, they are narrower than the tip.",
        name(normal)
    );
    canvas.text([left, top], Anchor::Start, &caption);
    let top = top + LETTER;

    let labels: Vec<String> = spots.iter().map(Spot::label).collect();
    let above = |spot: &Spot| spot.site - spot.direction * bench.clearance_m;
    // Labels stand in as many rows as keep them apart.
    let mut rows: Vec<f64> = Vec::new();
    let mut row_of = vec![None; spots.len()];
    let mut order: Vec<usize> = (0..spots.len()).collect();
    order.sort_by(|a, b| view.flat(spots[*a].site)[0].total_cmp(&view.flat(spots[*b].site)[0]));
    for &i in &order {
        let x = (view.flat(above(&spots[i]))[0] - low[0]) * view.scale;
        let half = 0.5 * width(&labels[i]) + 3.0;
        let row = rows.iter().position(|end| *end <= x - half).unwrap_or(rows.len());
        if row == MOST_ROWS {
            continue;
        }
        if row == rows.len() {
            rows.push(f64::MIN);
        }
        (rows[row], row_of[i]) = (x + half, Some(row));
    }
    let head = top + LETTER * 1.3 * rows.len().max(1) as f64 + 6.0;
    let bottom = head + (high[1] - low[1]) * view.scale;
    view.at_px = [left, bottom];

    block(canvas, &view, bench);
    for ((spot, label), row) in spots.iter().zip(&labels).zip(row_of) {
        if let Some(row) = row {
            let label_y = head - 6.0 - LETTER * 1.3 * row as f64;
            let [x, y] = view.px(above(spot));
            if row > 0 {
                canvas.line([x, label_y + 3.0], [x, y], Pen::Faint);
            }
            canvas.text([x, label_y], Anchor::Middle, label);
        }
        one(canvas, &view, bench, spot);
    }
    let mut depths = Labels::new();
    for i in order {
        let [x, y] = view.px(spots[i].site + spots[i].direction * spots[i].deepest_m());
        let depth = format!("{:.1}", spots[i].deepest_m() * 1e3);
        depths.put(canvas, [x, y + LETTER + 4.0], Anchor::Middle, &depth);
    }
    axes(canvas, &view, &high, left, right, head, bottom);
    bottom + 2.0 * LETTER + 14.0
}

/// Lowest and highest coordinates to be drawn (m).
fn extent(view: &View, spots: &[Spot], bench: &Bench) -> ([f64; 2], [f64; 2]) {
    let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
    let mut include = |place: Vec3| {
        let flat = view.flat(place);
        for i in 0..2 {
            (low[i], high[i]) = (low[i].min(flat[i]), high[i].max(flat[i]));
        }
    };
    corners(bench).for_each(&mut include);
    for spot in spots {
        for depth in [-bench.clearance_m, spot.deepest_m()] {
            let centre = spot.site + spot.direction * depth;
            include(centre + view.right * bench.tip_radius_m);
            include(centre - view.right * bench.tip_radius_m);
        }
    }
    (low.map(|m| m - MARGIN_M), [high[0] + MARGIN_M, high[1]])
}

fn corners(bench: &Bench) -> impl Iterator<Item = Vec3> {
    let (low, high) = (bench.phantom.low_m, bench.phantom.high_m);
    (0..8).map(move |i| Vec3::from_fn(|axis, _| if i >> axis & 1 == 0 { low[axis] } else { high[axis] }))
}

fn block(canvas: &mut Canvas, view: &View, bench: &Bench) {
    let px: Vec<[f64; 2]> = corners(bench).map(|corner| view.px(corner)).collect();
    let low = |i: usize| px.iter().map(|p| p[i]).fold(f64::MAX, f64::min);
    let high = |i: usize| px.iter().map(|p| p[i]).fold(f64::MIN, f64::max);
    canvas.block([low(0), low(1)], [high(0) - low(0), high(1) - low(1)]);
    canvas.text([low(0) + 6.0, high(1) - 6.0], Anchor::Start, "phantom");
    // The tip's width once, in a corner: at every site it would cover its neighbours.
    let tip_px = 2.0 * bench.tip_radius_m * view.scale;
    canvas.line([high(0) - 6.0 - tip_px, high(1) - 8.0], [high(0) - 6.0, high(1) - 8.0], Pen::Thick);
    canvas.text([high(0) - 12.0 - tip_px, high(1) - 6.0], Anchor::End, "width of the tip");
}

/// The way in, and each depth.
fn one(canvas: &mut Canvas, view: &View, bench: &Bench, spot: &Spot) {
    let at = |depth_m: f64| spot.site + spot.direction * depth_m;
    let pen = if spot.air { Pen::Dashed } else { Pen::Thin };
    canvas.line(view.px(at(-bench.clearance_m)), view.px(spot.site), Pen::Dashed);
    canvas.line(view.px(spot.site), view.px(at(spot.deepest_m())), pen);
    let half = view.right * (BAR * bench.tip_radius_m);
    for &depth in &spot.depths_m {
        let pen = if depth == spot.deepest_m() && !spot.air { Pen::Thick } else { Pen::Thin };
        canvas.line(view.px(at(depth) - half), view.px(at(depth) + half), pen);
    }
}

fn axes(canvas: &mut Canvas, view: &View, high: &[f64; 2], left: f64, right: f64, top: f64, bottom: f64) {
    let mm = |m: f64| m * 1e3;
    let across = Scale { values: [mm(view.low_m[0]), mm(high[0])], px: [left, right] };
    canvas.line([left, bottom], [right, bottom], Pen::Thin);
    for (value, text) in across.ticks(45.0) {
        let x = across.at(value);
        canvas.line([x, bottom], [x, bottom + 4.0], Pen::Thin);
        canvas.text([x, bottom + 4.0 + LETTER], Anchor::Middle, &text);
    }
    canvas.text([right, bottom + 6.0 + 2.0 * LETTER], Anchor::End, &format!("{} (mm)", name(view.right)));
    let upwards = Scale { values: [mm(view.low_m[1]), mm(high[1])], px: [bottom, top] };
    canvas.line([left, bottom], [left, top], Pen::Thin);
    for (value, text) in upwards.ticks(30.0) {
        let y = upwards.at(value);
        canvas.line([left - 4.0, y], [left, y], Pen::Thin);
        canvas.text([left - 7.0, y + 4.0], Anchor::End, &text);
    }
    canvas.text([left - 7.0, top - 12.0], Anchor::End, &format!("{} (mm)", name(view.up)));
}

/// What a direction of the phantom frame is called.
fn name(direction: Vec3) -> String {
    let axis = direction.iamax();
    if (direction[axis].abs() - 1.0).abs() > 1e-6 {
        return format!("({:.2}, {:.2}, {:.2}) · r", direction.x, direction.y, direction.z);
    }
    let sign = if direction[axis] < 0.0 { "−" } else { "" };
    format!("{sign}{}", ["x", "y", "z"][axis])
}

fn spots(plan: &Plan, bench: &Bench) -> Vec<Spot> {
    let mut spots: Vec<Spot> = Vec::new();
    for step in &plan.steps {
        let Action::Stroke { site_m, stroke } = &step.step.action else { continue };
        let (site, depth_m) = (Vec3::from(*site_m), stroke.deepest_m());
        let direction = stroke.direction.map_or_else(|| bench.tip_axis(), Vec3::from);
        let same = |s: &&mut Spot| s.site == site && s.direction == direction && s.air == stroke.air;
        let spot = match spots.iter_mut().find(same) {
            Some(spot) => spot,
            None => {
                let air = stroke.air;
                spots.push(Spot { site, direction, air, depths_m: Vec::new(), pokes: Vec::new() });
                let Some(last) = spots.last_mut() else { continue };
                last
            }
        };
        if !spot.depths_m.contains(&depth_m) {
            spot.depths_m.push(depth_m);
        }
        spot.pokes.extend(step.step.poke);
    }
    spots
}

impl Spot {
    fn deepest_m(&self) -> f64 {
        self.depths_m.iter().copied().fold(0.0, f64::max)
    }

    /// Its pokes' numbers, runs of them as `3–7`; many of them shortened.
    fn label(&self) -> String {
        const MOST: usize = 4;
        if self.air {
            return "air".to_owned();
        }
        let mut runs: Vec<[u32; 2]> = Vec::new();
        for &poke in &self.pokes {
            match runs.last_mut() {
                Some(run) if run[1] + 1 == poke => run[1] = poke,
                _ => runs.push([poke, poke]),
            }
        }
        let text =
            |&[from, to]: &[u32; 2]| if from == to { from.to_string() } else { format!("{from}–{to}") };
        let shown: Vec<String> = runs.iter().take(MOST).map(text).collect();
        let more = if runs.len() > MOST { ", …" } else { "" };
        shown.join(", ") + more
    }
}
