//! How large the dots of a picture are, where nobody has said.
//!
//! Dots are looked for in one range of radii after another, each three times as wide as its smallest and beginning in the middle of the one
//! before, so that any dots up to twice as large as one another lie in one of them. Taken is the range that holds most rim: the number
//! of dots alike times their radius. Glints and grains of a picture are smaller than its dots, lamps are fewer.

use super::{Finder, Found};
use crate::track::{Dot, DotSettings, GreyView};

/// Smallest radius that is looked for (px): a dot of 7 pixels.
const SMALLEST: f64 = 1.5;
/// Largest radius over the smallest, in one range.
const WIDE: f64 = 3.0;
/// The smallest radius of a range over that of the one before.
const STEP: f64 = 1.5;
/// Largest radius that is looked for (px), and over the shorter side of the picture: a few dots must fit.
const LARGEST: [f64; 2] = [200.0, 0.15];
/// Radii of dots alike, over their median. Perspective makes dots as different as that, and tilt shorter.
const ALIKE: [f64; 2] = [0.5, 2.0];

impl Finder {
    /// All dots of a picture, of whatever size they are, and the radii that they were looked for between (px). Everything but the radii
    /// is as in `settings`. Where there are none, the radii are all that were tried.
    pub fn find_of_any_size(&mut self, view: &GreyView<'_>, settings: &DotSettings) -> (Found, [f64; 2]) {
        let [width, height] = view.size();
        let largest = LARGEST[0].min(LARGEST[1] * width.min(height) as f64).max(WIDE * SMALLEST);
        let mut best: Option<(f64, f64)> = None;
        let mut least = SMALLEST;
        while least < largest {
            let radius_px = [least, (WIDE * least).min(LARGEST[0])];
            let dots = self.find(view, &DotSettings { radius_px, ..*settings }).dots;
            if let Some((rim, radius)) = rim(&dots)
                && best.is_none_or(|(most, _)| rim > most)
            {
                best = Some((rim, radius));
            }
            least *= STEP;
        }
        let radius_px = match best {
            Some((_, radius)) => [(ALIKE[0] * radius).max(SMALLEST), (ALIKE[1] * radius).min(LARGEST[0])],
            None => [SMALLEST, largest],
        };
        (self.find(view, &DotSettings { radius_px, ..*settings }), radius_px)
    }
}

/// Number of dots alike times their median radius, and that radius (px).
fn rim(dots: &[Dot]) -> Option<(f64, f64)> {
    let mut radii: Vec<f64> = dots.iter().filter(|d| d.is_whole()).map(Dot::radius_px).collect();
    let middle = radii.len() / 2;
    if radii.is_empty() {
        return None;
    }
    let median = *radii.select_nth_unstable_by(middle, f64::total_cmp).1;
    let alike = radii.iter().filter(|r| (ALIKE[0] * median..=ALIKE[1] * median).contains(*r)).count();
    Some((alike as f64 * median, median))
}
