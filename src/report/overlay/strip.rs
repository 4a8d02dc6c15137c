//! Pictures in rows of three, large enough for the numbers of their dots, under what each shows and over what the marks mean.

use super::letters::{extent, write, write_with_halo};
use super::mark::{Mark, MarkedDot};
use super::numbers::{Beside, placed};
use crate::report::ReportError;
use image::{GrayImage, ImageFormat, Rgb, RgbImage};
use std::io::Cursor;

/// A grey picture and what is to be drawn upon it.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkedPicture<'a> {
    /// Width and height (px).
    pub size_px: [usize; 2],
    /// Its levels, row by row.
    pub levels: &'a [u8],
    /// Its dots.
    pub dots: Vec<MarkedDot>,
    /// What stands above it; may be empty.
    pub caption: String,
}

const TEXT: Rgb<u8> = Rgb([235; 3]);
/// Pictures in a row.
const ROW: u32 = 3;
/// A picture with numbers is drawn at least so wide (px), but no more times as large than that.
const WIDE: u32 = 1000;
const LARGEST: u32 = 4;
/// A picture that is drawn so wide (px) has numbers of single pixels; one twice as wide of twice as large ones.
const PLAIN: u32 = 640;
/// A text has this much room at least, however small the picture (px).
const LEAST_TEXT: u32 = 360;

/// Grey pictures (all of one size) in rows of three, each with its dots marked, as a PNG. Where no dot has a number and there is nothing to be
/// written, each keeps its size. `legend`: what the marks that may occur mean.
///
/// # Errors
/// [`ReportError`]: no pictures, pictures of different sizes, no memory for them.
pub fn strip(pictures: &[MarkedPicture<'_>], legend: &[(Mark, &str)]) -> Result<Vec<u8>, ReportError> {
    let first = pictures.first().filter(|p| !p.size_px.contains(&0)).ok_or(ReportError::Picture)?;
    let layout = Layout::of(first.size_px.map(|s| s as u32), pictures, legend);
    let mut sheet = RgbImage::new(layout.sheet[0], layout.sheet[1]);
    let mut crowded = 0;
    for (number, picture) in (0..).zip(pictures) {
        let corner = [number % ROW * layout.panel[0], number / ROW * layout.panel[1]];
        crowded += panel(&mut sheet, corner, &layout, picture)?;
    }
    explained(&mut sheet, &layout, legend, crowded);
    let mut png = Cursor::new(Vec::new());
    sheet.write_to(&mut png, ImageFormat::Png).map_err(|_| ReportError::Picture)?;
    Ok(png.into_inner())
}

/// How large everything is (px).
struct Layout {
    /// A picture as it is.
    picture: [u32; 2],
    /// Times as large as that it is drawn.
    scale: u32,
    /// Pixels of a number's pixel.
    digits: u32,
    /// Pixels of a text's pixel: larger, to be read where the whole sheet is on a screen.
    text: u32,
    /// Room for texts of a picture.
    wide: u32,
    /// What is above a picture.
    head: u32,
    /// A picture with its head and what keeps it from the next.
    panel: [u32; 2],
    /// Everything.
    sheet: [u32; 2],
    /// Dots of all pictures: no more numbers are without room.
    dots: usize,
}

impl Layout {
    fn of(picture: [u32; 2], pictures: &[MarkedPicture<'_>], legend: &[(Mark, &str)]) -> Self {
        let scale = scale(picture[0], pictures);
        let drawn = picture.map(|s| s * scale);
        let digits = ((drawn[0] + PLAIN / 2) / PLAIN).max(1);
        let text = digits + digits.div_ceil(2);
        let is_written = !legend.is_empty() || pictures.iter().any(|p| !p.caption.is_empty());
        let widest =
            legend.iter().map(|(_, words)| 2 * margin(text) + sample(text) + extent(words, text)[0]).max();
        let wide = if is_written { drawn[0].max(LEAST_TEXT).max(widest.unwrap_or(0)) } else { drawn[0] };
        let lines = pictures.iter().map(|p| lines(&p.caption, wide, text).len()).max();
        let head = match lines.unwrap_or(0) as u32 {
            0 => 0,
            lines => lines * line(text) + 2 * margin(text),
        };
        let apart = if is_written { margin(text) } else { 0 };
        let panel = [wide + apart, head + drawn[1] + apart];
        let count = pictures.len() as u32;
        let across = panel[0] * count.min(ROW) - apart;
        let sheet = [across, panel[1] * count.div_ceil(ROW) - apart];
        let dots = pictures.iter().map(|p| p.dots.len()).sum();
        let mut all = Self { picture, scale, digits, text, wide, head, panel, sheet, dots };
        all.sheet[1] += match all.explanations(legend, dots).last() {
            // What lies at the bottom ends with it.
            Some((_, [_, y], _)) => y + line(text) + margin(text),
            None => 0,
        };
        all
    }

    /// What the marks mean: each with the place of its mark and its text, from the upper left corner of the legend.
    fn explanations(&self, legend: &[(Mark, &str)], crowded: usize) -> Vec<(Option<Mark>, [u32; 2], String)> {
        if legend.is_empty() {
            return Vec::new();
        }
        let mut items: Vec<(Option<Mark>, String)> =
            legend.iter().map(|(mark, text)| (Some(*mark), (*text).to_owned())).collect();
        if crowded > 0 {
            items.push((None, format!("numbers without room: {crowded}")));
        }
        let (mut at, mut placed) = ([margin(self.text), margin(self.text)], Vec::new());
        for (mark, text) in items {
            let wide = sample(self.text) + extent(&text, self.text)[0] + 3 * margin(self.text);
            if at[0] > margin(self.text) && at[0] + wide > self.sheet[0] {
                at = [margin(self.text), at[1] + line(self.text)];
            }
            placed.push((mark, at, text));
            at[0] += wide;
        }
        placed
    }
}

/// Times as large a picture `width` px wide is drawn: so that numbers fit between dots.
fn scale(width: u32, pictures: &[MarkedPicture<'_>]) -> u32 {
    let has_numbers = pictures.iter().flat_map(|p| &p.dots).any(|dot| dot.number.is_some());
    if has_numbers { WIDE.div_ceil(width).clamp(1, LARGEST) } else { 1 }
}

/// What keeps a text from what is beside it, by the size of its pixels.
fn margin(text: u32) -> u32 {
    4 * text
}

/// From one line to the next.
fn line(text: u32) -> u32 {
    extent("", text)[1] + margin(text)
}

/// Room for a mark before a text.
fn sample(text: u32) -> u32 {
    14 * text
}

/// Draws a picture with what is above it and upon it; how many numbers found no room.
fn panel(
    sheet: &mut RgbImage,
    corner: [u32; 2],
    layout: &Layout,
    picture: &MarkedPicture<'_>,
) -> Result<usize, ReportError> {
    let Layout { picture: [width, height], scale, text, wide, head, .. } = *layout;
    let grey = GrayImage::from_raw(width, height, picture.levels.to_vec())
        .filter(|_| picture.size_px == [width as usize, height as usize])
        .ok_or(ReportError::Picture)?;
    for (number, said) in (0..).zip(lines(&picture.caption, wide, text)) {
        let at = [corner[0] + margin(text), corner[1] + margin(text) + number * line(text)];
        write(sheet, at.map(i64::from), text, &said, TEXT);
    }
    let corner = [corner[0], corner[1] + head];
    let size = [width * scale, height * scale];
    for y in 0..size[1] {
        for x in 0..size[0] {
            // Darker, so that marks stand out.
            let level = grey.get_pixel(x / scale, y / scale)[0] / 4 * 3;
            sheet.put_pixel(corner[0] + x, corner[1] + y, Rgb([level; 3]));
        }
    }
    for dot in &picture.dots {
        let (centre, radius) = dot.ring(scale);
        dot.mark.draw(sheet, [corner, size], centre, radius, f64::from(scale));
    }
    Ok(numbered(sheet, [corner, size], layout, &picture.dots))
}

/// Writes the numbers of dots beside them; how many found no room.
fn numbered(
    sheet: &mut RgbImage,
    [corner, size]: [[u32; 2]; 2],
    layout: &Layout,
    dots: &[MarkedDot],
) -> usize {
    let words: Vec<Option<String>> = dots.iter().map(|dot| Some(dot.number?.to_string())).collect();
    let beside: Vec<Beside> = (dots.iter().zip(&words))
        .map(|(dot, word)| {
            let (centre, radius) = dot.ring(layout.scale);
            Beside { centre, radius, size: word.as_ref().map(|word| extent(word, layout.digits)) }
        })
        .collect();
    let mut crowded = 0;
    for ((dot, word), place) in dots.iter().zip(words).zip(placed(&beside, size, f64::from(layout.digits))) {
        match (word, place) {
            (Some(word), Some(place)) => {
                let at = [0, 1].map(|a| i64::from(corner[a]) + place[a]);
                write_with_halo(sheet, at, layout.digits, &word, dot.mark.colour());
            }
            (Some(_), None) => crowded += 1,
            (None, _) => {}
        }
    }
    crowded
}

/// Says at the bottom what the marks mean.
fn explained(sheet: &mut RgbImage, layout: &Layout, legend: &[(Mark, &str)], crowded: usize) {
    let text = layout.text;
    let all = layout.explanations(legend, layout.dots);
    let Some((_, [_, last], _)) = all.last() else { return };
    let top = layout.sheet[1] - (last + line(text) + margin(text));
    let whole = [[0, 0], layout.sheet];
    for (mark, [x, y], said) in layout.explanations(legend, crowded) {
        let y = top + y;
        if let Some(mark) = mark {
            let middle = [x + sample(text) / 2, y + extent("", text)[1] / 2].map(f64::from);
            mark.draw(sheet, whole, middle, 3.5 * f64::from(text), 0.6 * f64::from(text));
        }
        write(sheet, [i64::from(x + sample(text)), i64::from(y)], text, &said, TEXT);
    }
}

/// A text in lines that leave a margin on both sides of `wide` px, broken between words where they can be.
fn lines(text: &str, wide: u32, size: u32) -> Vec<String> {
    let room = wide.saturating_sub(2 * margin(size));
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if extent(&format!("{line} {word}"), size)[0] <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dot(x: f64, mark: Mark, number: Option<u32>) -> MarkedDot {
        MarkedDot { number, centre_px: [x, 15.0], radius_px: 4.0, mark }
    }

    fn drawn(pictures: &[MarkedPicture<'_>], legend: &[(Mark, &str)]) -> RgbImage {
        let png = strip(pictures, legend).expect("pictures");
        image::load_from_memory(&png).expect("a PNG").to_rgb8()
    }

    fn count(
        sheet: &RgbImage,
        mark: Mark,
        columns: std::ops::Range<u32>,
        rows: std::ops::Range<u32>,
    ) -> usize {
        let inside = |x: u32, y: u32| columns.contains(&x) && rows.contains(&y);
        sheet.enumerate_pixels().filter(|(x, y, p)| **p == mark.colour() && inside(*x, *y)).count()
    }

    #[test]
    fn rings_lie_round_dots_and_stay_in_their_picture() {
        let levels = vec![100_u8; 40 * 30];
        let picture =
            |dots| MarkedPicture { size_px: [40, 30], levels: &levels, dots, caption: String::new() };
        let pictures =
            [picture(vec![dot(20.0, Mark::Certain, None)]), picture(vec![dot(1.0, Mark::Lost, None)])];
        let all = drawn(&pictures, &[]);
        assert_eq!(all.dimensions(), (80, 30), "nothing but pictures");
        assert!(
            count(&all, Mark::Certain, 10..30, 0..30) > 20 && count(&all, Mark::Certain, 40..80, 0..30) == 0
        );
        assert!(count(&all, Mark::Lost, 40..60, 0..30) > 10 && count(&all, Mark::Lost, 0..40, 0..30) == 0);
        assert!(strip(&[], &[]).is_err());
        let short =
            MarkedPicture { size_px: [40, 31], levels: &levels, dots: vec![], caption: String::new() };
        assert!(strip(&[short], &[]).is_err());
    }

    /// A picture of 40 × 30 px is drawn four times as large; above it there are words, beside its dot a number, below it the legend.
    #[test]
    fn captions_numbers_and_legend_are_there_and_cover_nothing() {
        let levels = vec![200_u8; 40 * 30];
        let picture = |caption: &str, number| MarkedPicture {
            size_px: [40, 30],
            levels: &levels,
            dots: vec![dot(10.0, Mark::Certain, number)],
            caption: caption.to_owned(),
        };
        let legend = [(Mark::Certain, "certain"), (Mark::New, "none of those at rest")];
        let caption =
            "frame 12 at 0.400 s, 1 of 1 dots certain and more words than there is room for in one line";
        let with = drawn(&[picture(caption, Some(37))], &legend);
        let without = drawn(&[picture(caption, None)], &legend);
        let (width, height) = with.dimensions();
        assert_eq!(width, LEAST_TEXT);
        // Two or three lines, the picture, one or two lines.
        let grey = Rgb([150; 3]);
        let rows: Vec<u32> = (0..height).filter(|y| *with.get_pixel(0, *y) == grey).collect();
        assert_eq!(rows.len(), 120);
        let (top, bottom) = (rows[0], rows[119] + 1);
        assert!(top >= 24 && height - bottom >= 12, "{top} {bottom} {height}");
        let text = |from: u32, to: u32| {
            with.enumerate_pixels().filter(|(_, y, p)| **p == TEXT && (from..to).contains(y)).count()
        };
        assert!(text(0, top) > 300 && text(top, bottom) == 0 && text(bottom, height) > 100);
        assert!(count(&with, Mark::New, 0..width, bottom..height) > 10, "a sample of each mark");
        // The number is as green as its ring, and lies beside it.
        let ring = count(&with, Mark::Certain, 0..70, top..bottom);
        let number = count(&with, Mark::Certain, 70..width, top..bottom);
        assert!(ring > 100 && number > 15, "{ring} {number}");
        // Without numbers there is no need to be larger.
        assert_eq!((0..without.height()).filter(|y| *without.get_pixel(0, *y) == grey).count(), 30);
    }

    /// However small a picture is, nothing that is written is cut off at the right or below.
    #[test]
    fn a_legend_is_whole_beside_a_small_picture() {
        let levels = vec![200_u8; 40 * 30];
        let crowd: Vec<MarkedDot> =
            (0..30).map(|n| MarkedDot { radius_px: 1e3, ..dot(20.0, Mark::Certain, Some(n)) }).collect();
        let picture =
            |size_px, dots| MarkedPicture { size_px, levels: &levels, dots, caption: String::new() };
        let words = "a mark that means what can be said in no fewer words than these, and in no shorter ones, as it seems";
        let legend = [(Mark::Certain, "short"), (Mark::New, words)];
        for dots in [vec![], crowd] {
            let is_crowded = !dots.is_empty();
            let sheet = drawn(&[picture([40, 30], dots)], &legend);
            let [width, height] = [sheet.width(), sheet.height()];
            let text = || sheet.enumerate_pixels().filter(|(.., p)| **p == TEXT);
            let (right, low) = (text().map(|(x, ..)| x).max(), text().map(|(_, y, _)| y).max());
            assert!(
                right < Some(width - 1) && low < Some(height - 1),
                "{right:?} {low:?} of {width} × {height}"
            );
            // The long words stand in a line of their own, whole: the last is where it ends.
            assert!(right > Some(extent(words, 1)[0]), "{right:?}");
            let rows: std::collections::BTreeSet<u32> = text().map(|(_, y, _)| y / line(2)).collect();
            assert!(rows.len() >= if is_crowded { 3 } else { 2 }, "{rows:?}");
        }
        assert!(strip(&[picture([0, 30], vec![])], &legend).is_err());
    }

    #[test]
    fn lines_are_broken_between_words() {
        assert_eq!(lines("one two three", 7 * 6 + 8, 1), ["one two", "three"]);
        assert_eq!(lines("one two three", 7 * 6 + 6, 1), ["one", "two", "three"]);
        assert_eq!(lines("", 100, 1), [""; 0]);
        assert_eq!(lines("incomprehensibilities", 10, 2), ["incomprehensibilities"]);
    }
}
