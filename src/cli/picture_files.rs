//! Pictures that a person has: which files of a folder are some, and their grey levels.

use crate::session::Pixels;
use crate::track::{Channels, grey_from_colour};
use anyhow::{Context as _, bail};
use image::{ColorType, DynamicImage};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// What counts as a picture in a folder.
const ENDINGS: [&str; 3] = ["png", "jpg", "jpeg"];

/// The pictures of a folder, by name.
///
/// # Errors
/// The folder cannot be read, or has none.
pub(super) fn in_folder(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let name = || folder.display().to_string();
    let is_picture = |file: &PathBuf| {
        let ending = file.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str()))
    };
    let entries = fs::read_dir(folder).with_context(name)?;
    let mut files: Vec<PathBuf> =
        entries.map(|entry| entry.map(|e| e.path())).collect::<Result<_, _>>().with_context(name)?;
    files.retain(is_picture);
    files.sort();
    if files.is_empty() {
        bail!("{}: no session, and no pictures ({})", folder.display(), ENDINGS.join(", "));
    }
    Ok(files)
}

/// A picture as the tracker takes it.
pub(super) struct GreyPicture {
    pub(super) pixels: Pixels<u8>,
    /// Bits of a grey level that the file uses, of the 8 or 16 that it has.
    pub(super) bits: u32,
}

/// The grey levels of a picture file: colours by their luma, 16 bits reduced to 8.
///
/// Cameras of 10, 12 or 14 bits write those into the lower ones of 16: white is then the largest number of as many bits as the picture uses.
pub(super) fn grey_picture(file: &Path) -> anyhow::Result<GreyPicture> {
    let name = || file.display().to_string();
    // What a file is it says itself, whatever it is called.
    let reader = image::ImageReader::open(file).and_then(|r| r.with_guessed_format()).with_context(name)?;
    let read = reader.decode().with_context(name)?;
    let [width, height] = [read.width() as usize, read.height() as usize];
    let has_colour = read.color().has_color();
    let (values, bits) = match read.color() {
        ColorType::L8 | ColorType::La8 => (read.into_luma8().into_raw(), 8),
        ColorType::L16 | ColorType::La16 => reduced(&read.into_luma16().into_raw()),
        ColorType::Rgb16 | ColorType::Rgba16 => reduced(&read.into_rgb16().into_raw()),
        _ => (DynamicImage::into_rgb8(read).into_raw(), 8),
    };
    let values = match has_colour {
        true => grey_from_colour(width, height, 3 * width, &values, Channels::Rgb).with_context(name)?,
        false => values,
    };
    Ok(GreyPicture { pixels: Pixels { size_px: [width, height], values }, bits })
}

/// 8 of the bits that are used, rounded; how many are.
fn reduced(values: &[u16]) -> (Vec<u8>, u32) {
    let largest = values.iter().copied().max().unwrap_or(0);
    let bits = (u16::BITS - largest.leading_zeros()).max(8);
    let white = (1_u32 << bits) - 1;
    // No value is above white, so that it fits.
    (values.iter().map(|&v| ((u32::from(v) * 255 + white / 2) / white) as u8).collect(), bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, Luma, Rgb};

    #[test]
    fn a_grey_level_is_the_same_in_every_kind_of_file() {
        let place = tempfile::tempdir().expect("a folder");
        let levels: Vec<u8> = (0..=255).collect();
        let check = |name: &str, picture: DynamicImage, bits: u32| {
            let file = place.path().join(name);
            picture.save_with_format(&file, image::ImageFormat::Png).expect("writable");
            let read = grey_picture(&file).expect(name);
            assert_eq!((read.pixels.size_px, read.bits), ([16, 16], bits), "{name}");
            assert_eq!(read.pixels.values, levels, "{name}");
        };
        let wide =
            |scale: f64| -> Vec<u16> { levels.iter().map(|&l| (f64::from(l) * scale) as u16).collect() };
        let grey = ImageBuffer::<Luma<u8>, _>::from_raw(16, 16, levels.clone()).expect("256");
        check("grey.png", grey.into(), 8);
        for (bits, scale) in [(16, 257.0), (12, 4095.0 / 255.0), (10, 1023.0 / 255.0)] {
            let deep = ImageBuffer::<Luma<u16>, _>::from_raw(16, 16, wide(scale)).expect("256");
            check("deep.png", deep.into(), bits);
            let of_each: Vec<u16> = wide(scale).into_iter().flat_map(|v| [v; 3]).collect();
            let colour = ImageBuffer::<Rgb<u16>, _>::from_raw(16, 16, of_each).expect("256");
            check("colour.png", colour.into(), bits);
        }
        let colour: Vec<u8> = levels.iter().flat_map(|&v| [v; 3]).collect();
        let colour = ImageBuffer::<Rgb<u8>, _>::from_raw(16, 16, colour).expect("256");
        check("colour-with-a-wrong-name.jpg", colour.into(), 8);
    }

    #[test]
    fn what_is_no_picture_is_named() {
        let place = tempfile::tempdir().expect("a folder");
        let file = place.path().join("notes.png");
        fs::write(&file, "not a picture").expect("writable");
        let error = grey_picture(&file).err().expect("no picture");
        assert!(format!("{error:#}").contains("notes.png"), "{error:#}");
        assert!(in_folder(&place.path().join("nowhere")).is_err());
        assert_eq!(in_folder(place.path()).expect("one"), [file]);
    }
}
