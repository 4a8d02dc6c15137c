//! Frames in a folder, as a capture from files reads them: numbered PNG pictures and the times beside them.
//!
//! `grey-000000.png` (8 bit, one channel or three), `depth-000000.png` (16 bit, one channel; counts as in [`super::Depth`]) and
//! `frames.csv` with the columns `frame,t_s`: the time that the camera reports. The truth goes nowhere near them.

use super::error::PixelError;
use super::frame::Frame;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::fs::{File, create_dir_all};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Channels of the grey pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Channels {
    /// One.
    #[default]
    One,
    /// Three equal ones, as from a colour camera.
    Three,
}

/// Writes frames into a folder.
#[derive(Debug)]
pub struct FrameFolder {
    folder: PathBuf,
    channels: Channels,
    times: BufWriter<File>,
}

impl FrameFolder {
    /// Begins a folder; one that exists may be empty or not, files of equal names are replaced.
    ///
    /// # Errors
    /// [`PixelError::Write`].
    pub fn create(folder: impl Into<PathBuf>, channels: Channels) -> Result<Self, PixelError> {
        let folder = folder.into();
        create_dir_all(&folder).map_err(|source| PixelError::Write { path: folder.clone(), source })?;
        let path = folder.join("frames.csv");
        let failed = |source| PixelError::Write { path: path.clone(), source };
        let mut times = BufWriter::new(File::create(&path).map_err(failed)?);
        writeln!(times, "frame,t_s").map_err(failed)?;
        Ok(Self { folder, channels, times })
    }

    /// Adds a frame under its number.
    ///
    /// # Errors
    /// [`PixelError::Write`], [`PixelError::Encode`].
    pub fn add(&mut self, frame: &Frame) -> Result<(), PixelError> {
        let number = frame.number;
        let size = [frame.grey.width as u32, frame.grey.height as u32];
        let path = self.folder.join(format!("grey-{number:06}.png"));
        match self.channels {
            Channels::One => encode(&path, &frame.grey.levels, size, ExtendedColorType::L8)?,
            Channels::Three => {
                let levels: Vec<u8> = frame.grey.levels.iter().flat_map(|&level| [level; 3]).collect();
                encode(&path, &levels, size, ExtendedColorType::Rgb8)?;
            }
        }
        if let Some(depth) = &frame.depth {
            let path = self.folder.join(format!("depth-{number:06}.png"));
            let bytes: Vec<u8> = depth.counts.iter().flat_map(|count| count.to_ne_bytes()).collect();
            encode(&path, &bytes, size, ExtendedColorType::L16)?;
        }
        let path = self.folder.join("frames.csv");
        writeln!(self.times, "{number},{:.6}", frame.reported_s)
            .map_err(|source| PixelError::Write { path, source })
    }

    /// Ends the folder: the times are on their way to the disk.
    ///
    /// # Errors
    /// [`PixelError::Write`].
    pub fn finish(mut self) -> Result<(), PixelError> {
        let path = self.folder.join("frames.csv");
        self.times.flush().map_err(|source| PixelError::Write { path, source })
    }
}

fn encode(
    path: &Path,
    bytes: &[u8],
    [width, height]: [u32; 2],
    colour: ExtendedColorType,
) -> Result<(), PixelError> {
    let failed = |source| PixelError::Write { path: path.to_owned(), source };
    let mut file = BufWriter::new(File::create(path).map_err(failed)?);
    PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Sub)
        .write_image(bytes, width, height, colour)
        .map_err(|source| PixelError::Encode { path: path.to_owned(), source })?;
    file.flush().map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::super::frame::{Depth, Grey};
    use super::*;

    #[test]
    fn what_is_written_is_read_back() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let (width, height) = (20, 9);
        let frame = Frame {
            number: 3,
            time_s: 1.0,
            reported_s: 1.012_345_6,
            grey: Grey { width, height, levels: (0..180).collect() },
            depth: Some(Depth { width, height, unit_m: 1e-4, counts: (0..180).map(|i| i * 361).collect() }),
            dots: Vec::new(),
        };
        for (channels, equal) in [(Channels::One, 1), (Channels::Three, 3)] {
            let mut writer = FrameFolder::create(folder.path(), channels)?;
            writer.add(&frame)?;
            writer.finish()?;
            let grey = image::open(folder.path().join("grey-000003.png"))?;
            assert_eq!(usize::from(grey.color().channel_count()), equal);
            assert_eq!(grey.into_luma8().into_raw(), frame.grey.levels);
            let depth = image::open(folder.path().join("depth-000003.png"))?;
            assert_eq!(depth.color(), image::ColorType::L16);
            assert_eq!(Some(depth.into_luma16().into_raw()), frame.depth.as_ref().map(|d| d.counts.clone()));
            let times = std::fs::read_to_string(folder.path().join("frames.csv"))?;
            assert_eq!(times, "frame,t_s\n3,1.012346\n");
        }
        Ok(())
    }
}
