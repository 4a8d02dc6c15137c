//! Lines, boxes and texts as SVG, in px; and axes with round numbers.

use std::fmt::Write as _;

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Pen {
    Thin,
    Thick,
    Dashed,
    Faint,
}

impl Pen {
    fn style(self) -> &'static str {
        match self {
            Self::Thin => "stroke=\"black\" stroke-width=\"1\"",
            Self::Thick => "stroke=\"black\" stroke-width=\"2.5\"",
            Self::Dashed => "stroke=\"black\" stroke-width=\"1\" stroke-dasharray=\"4 3\"",
            Self::Faint => "stroke=\"#bbb\" stroke-width=\"1\"",
        }
    }
}

/// Where a text stands from its point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Size of letters, and their mean width (px).
pub(super) const LETTER: f64 = 12.0;
const LETTER_WIDTH: f64 = 6.6;

/// Width of a text (px). An estimate.
pub(super) fn width(text: &str) -> f64 {
    LETTER_WIDTH * text.chars().count() as f64
}

/// What every drawing says of itself, near its beginning: by that it is known again.
pub(super) const MARK: &str = "<desc>a plan of phantom-rig</desc>";

/// What has been drawn so far.
#[derive(Debug, Default)]
pub(super) struct Canvas {
    body: String,
}

impl Canvas {
    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], pen: Pen) {
        let ([x1, y1], [x2, y2]) = (from, to);
        let style = pen.style();
        let _ = writeln!(
            self.body,
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>"
        );
    }

    pub(super) fn curve(&mut self, points: &[[f64; 2]], pen: Pen) {
        let points: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ =
            writeln!(self.body, "<polyline points=\"{}\" fill=\"none\" {}/>", points.join(" "), pen.style());
    }

    pub(super) fn block(&mut self, corner: [f64; 2], size: [f64; 2]) {
        let ([x, y], [w, h]) = (corner, size);
        let style = Pen::Thin.style();
        let _ = writeln!(
            self.body,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"#eee\" {style}/>"
        );
    }

    pub(super) fn text(&mut self, at: [f64; 2], anchor: Anchor, text: &str) {
        let [x, y] = at;
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>",
            escaped(text)
        );
    }

    /// The whole drawing.
    pub(super) fn finish(self, size: [f64; 2]) -> String {
        let [w, h] = size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w:.0}\" height=\"{h:.0}\" viewBox=\"0 0 {w:.0} {h:.0}\" \
             font-family=\"sans-serif\" font-size=\"{LETTER}\">\n{MARK}\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{}</svg>\n",
            self.body
        )
    }
}

/// Text as XML, without characters that XML does not have.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            c if c.is_control() || c == '\u{fffe}' || c == '\u{ffff}' => safe.push(' '),
            c => safe.push(c),
        }
    }
    safe
}

/// Texts in a row from left to right; one that would cover the one before is left out.
#[derive(Debug)]
pub(super) struct Labels {
    end: f64,
}

impl Labels {
    pub(super) fn new() -> Self {
        Self { end: f64::MIN }
    }

    pub(super) fn put(&mut self, canvas: &mut Canvas, at: [f64; 2], anchor: Anchor, text: &str) {
        let start = match anchor {
            Anchor::Start => at[0],
            Anchor::Middle => at[0] - 0.5 * width(text),
            Anchor::End => at[0] - width(text),
        };
        if start >= self.end {
            canvas.text(at, anchor, text);
            self.end = start + width(text) + 4.0;
        }
    }
}

/// A scale from values to px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Values at the two ends.
    pub(super) values: [f64; 2],
    /// Where they are (px).
    pub(super) px: [f64; 2],
}

impl Scale {
    pub(super) fn at(&self, value: f64) -> f64 {
        let share = (value - self.values[0]) / (self.values[1] - self.values[0]);
        self.px[0] + share * (self.px[1] - self.px[0])
    }

    /// Round values inside the scale, at least `apart` px from one another, with their texts.
    pub(super) fn ticks(&self, apart: f64) -> Vec<(f64, String)> {
        let [low, high] = [self.values[0].min(self.values[1]), self.values[0].max(self.values[1])];
        let room = (self.px[1] - self.px[0]).abs();
        let least = (high - low) * apart / room;
        if !(least.is_finite() && least > 0.0) {
            return Vec::new();
        }
        let decade = 10.0_f64.powf(least.log10().floor());
        let step =
            [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter().find(|s| *s >= least).unwrap_or(least);
        let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        (first..=last)
            .map(|i| i as f64 * step)
            .map(|value| (value, format!("{value:.decimals$}").replace('-', "−")))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_keep_their_distance() {
        let scale = Scale { values: [0.0, 97.0], px: [100.0, 580.0] };
        let ticks = scale.ticks(40.0);
        let texts: Vec<&str> = ticks.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(texts, ["0", "10", "20", "30", "40", "50", "60", "70", "80", "90"]);
        assert!((scale.at(48.5) - 340.0).abs() < 1e-9);
        let down = Scale { values: [-0.3, 0.5], px: [0.0, 100.0] };
        let texts: Vec<String> = down.ticks(30.0).into_iter().map(|(_, text)| text).collect();
        assert_eq!(texts, ["0.0", "0.5"]);
        assert!(Scale { values: [1.0, 1.0], px: [0.0, 1.0] }.ticks(10.0).is_empty());
    }

    #[test]
    fn texts_cannot_break_the_drawing() {
        assert_eq!(escaped("a<b & \u{1}c>"), "a&lt;b &amp;  c&gt;");
    }
}
