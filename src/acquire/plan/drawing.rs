//! A plan as a drawing (SVG), for paper: the plane of motion from the side, and depth over time.

use super::bench::Bench;
use super::canvas::{Anchor, Canvas, LETTER, MARK};
use super::motions::Plan;
use super::{side_view, strip};

/// Width of the drawing and its margins left and right (px).
const WIDTH: f64 = 960.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 60.0;

impl Plan {
    /// The drawing. Numbers are those of the pokes; where there is no room for all of them, some are left out.
    pub fn drawing(&self, bench: &Bench) -> String {
        let mut canvas = Canvas::default();
        let (left, right) = (LEFT, WIDTH - RIGHT);
        let mut y = 24.0;
        canvas.text([left, y], Anchor::Start, &self.name);
        y += 1.5 * LETTER;
        if !self.violations.is_empty() {
            let count = self.violations.len();
            let said = format!("Can't be run: {count} violation{}.", if count == 1 { "" } else { "s" });
            canvas.text([left, y], Anchor::Start, &said);
            y += 1.5 * LETTER;
        }
        y = side_view::draw(&mut canvas, self, bench, y, left, right);
        y = strip::draw(&mut canvas, self, bench, y, left, right);
        canvas.finish([WIDTH, y])
    }

    /// Whether the first bytes of a file, some hundreds at least, are those of a drawing that this program made.
    pub fn is_drawing(beginning: &[u8]) -> bool {
        beginning.starts_with(b"<svg ") && beginning.windows(MARK.len()).any(|part| part == MARK.as_bytes())
    }
}
