//! Which pixels tell where a dot is: those inside its rim and a margin around it, without what belongs to others.

use super::model::BlurredDisc;
use crate::track::GreyView;
use nalgebra::Vector2;
use wide::f32x8;

/// A pixel and its grey level.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) at: Vector2<f64>,
    pub(super) value: f64,
}

/// Eight pixels, in single precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Eight {
    /// Places, from the window's origin (px).
    pub(super) x: f32x8,
    pub(super) y: f32x8,
    pub(super) value: f32x8,
    /// 1, or 0 for a place that no pixel fills.
    pub(super) there: f32x8,
}

/// The pixels that tell where one dot is. Memory to reuse.
#[derive(Default)]
pub(super) struct Window {
    /// Where the dot was looked for: places are told from there (px).
    pub(super) origin: Vector2<f64>,
    about_rim: Packed,
    /// Those that only the height and the background matter to.
    others: Packed,
}

/// Pixels by eights.
#[derive(Default)]
struct Packed {
    eights: Vec<Eight>,
    count: usize,
    /// The next eight: x, y and grey levels.
    open: [[f32; LANES]; 3],
}

/// Pixels this far outside the rim and above half the dot's height belong to another dot or to a glare (px).
const OWN: f32 = 2.0;

/// Pixels farther than this from the rim are certainly not on its blur (px); those nearer come first.
const RIM: f32 = 3.3;

/// Pixels that are worked on at a time.
const LANES: usize = 8;

impl Window {
    /// Takes the pixels within `margin` px of the dot's rim.
    pub(super) fn gather(&mut self, view: &GreyView<'_>, dot: &BlurredDisc, margin: f64) {
        self.origin = dot.centre();
        self.about_rim.clear();
        self.others.clear();
        let [width, height] = view.size();
        let Some(to_plane) = dot.to_circle().try_inverse() else { return };
        // Half-width of the ellipse {A⁻¹e : |e| = 1} along an axis is the length of that row of A⁻¹.
        let reach = [to_plane.row(0).norm() + margin, to_plane.row(1).norm() + margin];
        let from = |c: f64, r: f64| (c - r).ceil().max(0.0) as usize;
        let to = |c: f64, r: f64, most: usize| ((c + r).floor().max(-1.0) + 1.0).min(most as f64) as usize;
        let (x0, x1) = (from(self.origin.x, reach[0]), to(self.origin.x, reach[0], width));
        let near = dot.near(self.origin);
        let half = f32x8::splat((dot.base() + 0.5 * dot.height()) as f32);
        let outermost = f32x8::splat(-margin as f32);
        let ramp = f32x8::from([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        for y in from(self.origin.y, reach[1])..to(self.origin.y, reach[1], height) {
            let y_here = (y as f64 - self.origin.y) as f32;
            for start in (x0..x1).step_by(LANES) {
                let (levels, there) = eight_levels(view.row(y), start);
                let x = f32x8::splat((start as f64 - self.origin.x) as f32) + ramp;
                let value = f32x8::from(levels.map(f32::from));
                let distance = near.distance(x, f32x8::splat(y_here));
                let foreign = distance.simd_lt(f32x8::splat(-OWN)) & value.simd_gt(half);
                let own = there & distance.simd_ge(outermost).to_bitmask() & !foreign.to_bitmask();
                let about_rim = distance.abs().simd_lt(f32x8::splat(RIM)).to_bitmask();
                let (x, value) = (x.to_array(), value.to_array());
                let parts = [(&mut self.about_rim, own & about_rim), (&mut self.others, own & !about_rim)];
                for (part, mut lanes) in parts {
                    while lanes != 0 {
                        let i = lanes.trailing_zeros() as usize;
                        part.push([x[i], y_here, value[i]]);
                        lanes &= lanes - 1;
                    }
                }
            }
        }
        self.about_rim.close();
        self.others.close();
    }

    /// Number of pixels.
    pub(super) fn count(&self) -> usize {
        self.about_rim.count + self.others.count
    }

    /// All pixels.
    pub(super) fn eights(&self) -> impl Iterator<Item = &Eight> {
        self.about_rim.eights.iter().chain(&self.others.eights)
    }

    /// The pixels one by one.
    pub(super) fn samples(&self) -> impl Iterator<Item = Sample> {
        self.eights().flat_map(move |eight| {
            let [x, y, value, there] = [eight.x, eight.y, eight.value, eight.there].map(|l| l.to_array());
            (0..LANES).filter(move |&i| there[i] > 0.0).map(move |i| Sample {
                at: self.origin + Vector2::new(f64::from(x[i]), f64::from(y[i])),
                value: f64::from(value[i]),
            })
        })
    }
}

/// Eight grey levels of a row, and a bit for each that there is.
fn eight_levels(row: &[u8], start: usize) -> ([u8; LANES], u32) {
    if let Some(Ok(levels)) = row.get(start..start + LANES).map(<[u8; LANES]>::try_from) {
        return (levels, u32::from(u8::MAX));
    }
    let mut levels = [0; LANES];
    let left = &row[start..];
    levels.iter_mut().zip(left).for_each(|(level, &there)| *level = there);
    (levels, (1 << left.len()) - 1)
}

impl Packed {
    fn clear(&mut self) {
        self.eights.clear();
        self.count = 0;
    }

    #[inline(always)]
    fn push(&mut self, pixel: [f32; 3]) {
        let lane = self.count % LANES;
        self.open.iter_mut().zip(pixel).for_each(|(lanes, number)| lanes[lane] = number);
        self.count += 1;
        if lane + 1 == LANES {
            self.take(f32x8::ONE);
        }
    }

    /// After the last pixel.
    fn close(&mut self) {
        let filled = self.count % LANES;
        if filled > 0 {
            self.take(std::array::from_fn(|i| f32::from(u8::from(i < filled))).into());
        }
    }

    fn take(&mut self, there: f32x8) {
        let [x, y, value] = self.open.map(f32x8::from);
        self.eights.push(Eight { x, y, value, there });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    /// Every pixel within the margin is taken once with its own level, but for what belongs to others; in the middle and at each border.
    #[test]
    fn a_window_holds_the_pixels_about_a_dot() {
        const SIZE: [usize; 2] = [43, 37];
        const MARGIN: f64 = 4.0;
        let pixels: Vec<u8> =
            (0..SIZE[0] * SIZE[1]).map(|i| if i % 11 == 0 { 200 } else { (i % 97) as u8 }).collect();
        let view = GreyView::new(SIZE[0], SIZE[1], SIZE[0], &pixels).expect("a picture");
        let mut window = Window::default();
        for centre in [[21.3, 17.8], [1.2, 17.1], [41.7, 20.4], [20.2, 0.6], [40.9, 35.3]] {
            let moments = Matrix2::new(9.0, 1.5, 1.5, 5.0);
            let dot = BlurredDisc::from_moments(Vector2::from(centre), moments, 150.0, 0.9, 30.0);
            let dot = dot.expect("an ellipse");
            window.gather(&view, &dot, MARGIN);
            let mut found: Vec<Sample> = window.samples().collect();
            assert_eq!(found.len(), window.count());
            let mut certain = 0;
            for (i, &level) in pixels.iter().enumerate() {
                let at = Vector2::new((i % SIZE[0]) as f64, (i / SIZE[0]) as f64);
                let distance = dot.distance(at);
                // The window reckons in single precision.
                if (distance + MARGIN).abs() < 1e-3 || (distance + f64::from(OWN)).abs() < 1e-3 {
                    continue;
                }
                let own = distance > -MARGIN && (distance > -f64::from(OWN) || level <= 105);
                let known = found.iter().position(|s| (s.at - at).norm() < 1e-3);
                assert_eq!(known.is_some(), own, "{at} {distance}");
                if let Some(known) = known {
                    assert_eq!(found.swap_remove(known).value, f64::from(level));
                    certain += 1;
                }
            }
            assert!(certain > 60 && found.len() < 4, "{certain} {}", found.len());
        }
    }
}
