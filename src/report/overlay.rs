//! What the tracker saw: a picture with a ring round every dot, green where it is certain, red where it should be and is not.

use super::ReportError;
use image::{GrayImage, ImageFormat, Rgb, RgbImage};
use std::io::Cursor;

/// A dot to be marked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkedDot {
    /// Centre (px), from the centre of the upper left pixel.
    pub centre_px: [f64; 2],
    /// Radius (px).
    pub radius_px: f64,
    /// Whether it is certain.
    pub certain: bool,
}

const CERTAIN: Rgb<u8> = Rgb([60, 220, 90]);
const LOST: Rgb<u8> = Rgb([235, 60, 50]);
/// Pictures in a row.
const ROW: u32 = 3;
/// The ring leaves the dot's rim free.
const CLEAR: f64 = 1.35;

/// Grey pictures (all of one size) in rows of three, each with its dots marked, as a PNG.
///
/// # Errors
/// [`ReportError`]: no pictures, pictures of different sizes, no memory for them.
pub fn strip(pictures: &[([usize; 2], &[u8], Vec<MarkedDot>)]) -> Result<Vec<u8>, ReportError> {
    let bad = || ReportError::Picture;
    let ([width, height], ..) = pictures.first().ok_or_else(bad)?;
    let (width, height) = (*width as u32, *height as u32);
    let count = pictures.len() as u32;
    let mut all = RgbImage::new(width * count.min(ROW), height * count.div_ceil(ROW));
    for (number, (size, levels, dots)) in (0_u32..).zip(pictures) {
        let grey = GrayImage::from_raw(width, height, levels.to_vec())
            .filter(|_| *size == [width as usize, height as usize])
            .ok_or_else(bad)?;
        let corner = [number % ROW * width, number / ROW * height];
        for (x, y, level) in grey.enumerate_pixels() {
            // Darker, so that rings stand out.
            all.put_pixel(corner[0] + x, corner[1] + y, Rgb([level[0] / 4 * 3; 3]));
        }
        for dot in dots {
            ring(&mut all, corner, [width, height], dot);
        }
    }
    let mut png = Cursor::new(Vec::new());
    all.write_to(&mut png, ImageFormat::Png).map_err(|_| ReportError::Picture)?;
    Ok(png.into_inner())
}

fn ring(picture: &mut RgbImage, corner: [u32; 2], [width, height]: [u32; 2], dot: &MarkedDot) {
    let radius = dot.radius_px * CLEAR + 1.0;
    let steps = (8.0 * radius).ceil().max(16.0) as u32;
    for step in 0..steps {
        let turn = f64::from(step) / f64::from(steps) * std::f64::consts::TAU;
        let (x, y) = (dot.centre_px[0] + radius * turn.cos(), dot.centre_px[1] + radius * turn.sin());
        let (x, y) = (x.round(), y.round());
        if x >= 0.0 && y >= 0.0 && x < f64::from(width) && y < f64::from(height) {
            picture.put_pixel(
                corner[0] + x as u32,
                corner[1] + y as u32,
                if dot.certain { CERTAIN } else { LOST },
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_lie_round_dots_and_stay_in_their_picture() {
        let levels = vec![100_u8; 40 * 30];
        let dot = |x: f64, certain| MarkedDot { centre_px: [x, 15.0], radius_px: 4.0, certain };
        let pictures =
            [([40, 30], &levels[..], vec![dot(20.0, true)]), ([40, 30], &levels[..], vec![dot(1.0, false)])];
        let png = strip(&pictures).expect("two pictures");
        let all = image::load_from_memory(&png).expect("a PNG").to_rgb8();
        assert_eq!(all.dimensions(), (80, 30));
        let count = |colour: Rgb<u8>, columns: std::ops::Range<u32>| {
            all.enumerate_pixels().filter(|(x, _, p)| **p == colour && columns.contains(x)).count()
        };
        assert!(count(CERTAIN, 10..30) > 20 && count(CERTAIN, 40..80) == 0);
        assert!(count(LOST, 40..50) > 10 && count(LOST, 0..40) == 0);
        assert!(strip(&[]).is_err());
        assert!(strip(&[([40, 31], &levels[..], vec![])]).is_err());
    }
}
