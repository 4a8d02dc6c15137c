//! A sheet of equal panels as SVG, each drawn inside its own frame.

use std::fmt::Write as _;

/// One panel: title and content, in px from its own top left corner.
pub(super) struct Panel {
    /// What stands above it.
    pub(super) title: String,
    /// SVG elements.
    pub(super) body: String,
}

const TITLE: f64 = 22.0;
const GAP: f64 = 14.0;
const LINE: f64 = 17.0;

/// Panels of `size` (px), `columns` in a row, under `caption` (lines). Content is cut at its panel's frame.
pub(super) fn sheet(panels: &[Panel], size: [f64; 2], columns: usize, caption: &[String]) -> String {
    let columns = panels.len().clamp(1, columns);
    let rows = panels.len().div_ceil(columns);
    let head = 14.0 + LINE * caption.len() as f64;
    let step = [size[0] + GAP, size[1] + TITLE + GAP];
    let (width, height) = (columns as f64 * step[0] + GAP, rows as f64 * step[1] + head);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (i, line) in caption.iter().enumerate() {
        let _ = writeln!(
            svg,
            "<text x=\"{GAP}\" y=\"{:.0}\" font-size=\"{}\">{line}</text>",
            20.0 + LINE * i as f64,
            if i == 0 { 14 } else { 12 }
        );
    }
    for (i, Panel { title, body }) in panels.iter().enumerate() {
        let (x, y) = (GAP + (i % columns) as f64 * step[0], head + (i / columns) as f64 * step[1]);
        let [w, h] = size;
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{title}</text>\n\
             <svg x=\"{x:.1}\" y=\"{:.1}\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             overflow=\"hidden\">\n{body}\
             <rect x=\"0.5\" y=\"0.5\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#ccc\"/></svg>",
            x + 0.5 * w,
            y + TITLE - 7.0,
            y + TITLE,
            w - 1.0,
            h - 1.0
        );
    }
    svg + "</svg>\n"
}
