//! What is in a picture of the page: enough to tell a drawing from an empty box.

/// A part of a picture, in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part {
    pub(crate) x: u32,
    pub(crate) y: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// Pixels of a PNG.
pub(crate) fn pixels(png: &[u8]) -> image::RgbImage {
    image::load_from_memory_with_format(png, image::ImageFormat::Png).expect("a PNG").to_rgb8()
}

/// Share of the part's pixels that are not of its commonest colour.
pub(crate) fn drawn_share(picture: &image::RgbImage, part: Part) -> f64 {
    let mut count = std::collections::HashMap::<[u8; 3], usize>::new();
    for pixel in
        image::imageops::crop_imm(picture, part.x, part.y, part.width, part.height).to_image().pixels()
    {
        *count.entry(pixel.0).or_default() += 1;
    }
    let total: usize = count.values().sum();
    1.0 - count.values().copied().max().unwrap_or(0) as f64 / total.max(1) as f64
}

/// Share of the part's pixels that differ between two pictures.
pub(crate) fn changed_share(a: &image::RgbImage, b: &image::RgbImage, part: Part) -> f64 {
    let cut = |p| image::imageops::crop_imm(p, part.x, part.y, part.width, part.height).to_image();
    let (a, b) = (cut(a), cut(b));
    let changed = a.pixels().zip(b.pixels()).filter(|(p, q)| p != q).count();
    changed as f64 / f64::from(part.width * part.height).max(1.0)
}

/// Contrast of two sRGB colours, 1 to 21 (W3C 2018, WCAG 2.1, "contrast ratio" and "relative luminance").
pub(crate) fn contrast(a: [f64; 3], b: [f64; 3]) -> f64 {
    let luminance = |colour: [f64; 3]| {
        let linear = colour.map(|c| {
            let c = c / 255.0;
            if c <= 0.03928 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    };
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

#[test]
fn black_on_white_is_21_to_1() {
    assert!((contrast([0.0; 3], [255.0; 3]) - 21.0).abs() < 1e-9);
}
