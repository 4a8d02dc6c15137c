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

/// Pixels one after another, and behind the last one anything.
#[derive(Default)]
struct Packed {
    x: Vec<f32>,
    y: Vec<f32>,
    value: Vec<f32>,
    count: usize,
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
        self.about_rim.count = 0;
        self.others.count = 0;
        let [width, height] = view.size();
        let Some(to_plane) = dot.to_circle().try_inverse() else { return };
        // Half-width of the ellipse {A⁻¹e : |e| = 1} along an axis is the length of that row of A⁻¹.
        let reach = [to_plane.row(0).norm() + margin, to_plane.row(1).norm() + margin];
        let pixels = |c: f64, r: f64, most: usize| {
            let to = ((c + r).floor().max(-1.0) + 1.0).min(most as f64) as usize;
            ((c - r).ceil().max(0.0) as usize).min(to)..to
        };
        let columns = pixels(self.origin.x, reach[0], width);
        let rows = pixels(self.origin.y, reach[1], height);
        // The last eight of a row may reach beyond.
        let most = (columns.len() + LANES) * rows.len();
        self.about_rim.make_room(most);
        self.others.make_room(most);
        let near = dot.near(self.origin);
        let half = f32x8::splat((dot.base() + 0.5 * dot.height()) as f32);
        let outermost = f32x8::splat(-margin as f32);
        let ramp = f32x8::from([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        for y in rows {
            let y_here = (y as f64 - self.origin.y) as f32;
            for start in columns.clone().step_by(LANES) {
                let (levels, there) = eight_levels(view.row(y), start);
                let x = f32x8::splat((start as f64 - self.origin.x) as f32) + ramp;
                let value = f32x8::from(levels);
                let distance = near.distance(x, f32x8::splat(y_here));
                let dark = value.simd_le(half) | distance.simd_ge(f32x8::splat(-OWN));
                let own = (distance.simd_ge(outermost) & dark).to_bitmask() & there;
                let about_rim = distance.abs().simd_lt(f32x8::splat(RIM)).to_bitmask();
                let pixels = [x.to_array(), [y_here; LANES], levels];
                self.about_rim.push(&pixels, own & about_rim);
                self.others.push(&pixels, own & !about_rim);
            }
        }
    }

    /// Number of pixels.
    pub(super) fn count(&self) -> usize {
        self.about_rim.count + self.others.count
    }

    /// All pixels.
    pub(super) fn eights(&self) -> impl Iterator<Item = Eight> {
        self.about_rim.eights().chain(self.others.eights())
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
fn eight_levels(row: &[u8], start: usize) -> ([f32; LANES], u32) {
    let mut levels = [0.0; LANES];
    let left = &row[start..row.len().min(start + LANES)];
    levels.iter_mut().zip(left).for_each(|(level, &there)| *level = f32::from(there));
    (levels, (1 << left.len()) - 1)
}

impl Packed {
    /// For this many pixels, and for seven that are written and not taken.
    fn make_room(&mut self, pixels: usize) {
        for numbers in [&mut self.x, &mut self.y, &mut self.value] {
            numbers.resize(numbers.len().max(pixels + LANES), 0.0);
        }
    }

    /// Takes those of eight pixels that have a bit in `lanes`.
    #[inline(always)]
    fn push(&mut self, [x, y, value]: &[[f32; LANES]; 3], lanes: u32) {
        let room = self.count..self.count + LANES;
        let (to_x, to_y) = (&mut self.x[room.clone()], &mut self.y[room.clone()]);
        let to_value = &mut self.value[room];
        let mut next = 0;
        // Every pixel is written, and stays if the next one is written behind it: no branch that is hard to foresee.
        for i in 0..LANES {
            (to_x[next], to_y[next], to_value[next]) = (x[i], y[i], value[i]);
            next = (next + (lanes >> i & 1) as usize) % LANES;
        }
        self.count += lanes.count_ones() as usize;
    }

    fn eights(&self) -> impl Iterator<Item = Eight> {
        let [x, y, value] = [&self.x, &self.y, &self.value].map(|numbers| numbers.as_chunks().0.iter());
        let starts = (0..self.count).step_by(LANES);
        x.zip(y).zip(value).zip(starts).map(|(((x, y), value), start)| {
            let is_there = |i: usize| f32::from(u8::from(start + i < self.count));
            let all = start + LANES <= self.count;
            let there = if all { f32x8::ONE } else { f32x8::from(std::array::from_fn(is_there)) };
            Eight { x: f32x8::from(*x), y: f32x8::from(*y), value: f32x8::from(*value), there }
        })
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
