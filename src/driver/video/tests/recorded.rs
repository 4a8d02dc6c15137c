//! Image files with known values, written for a test.

use crate::clock::HostTime;
use crate::device::{DepthCamera, DepthFrame, DeviceError, with_causes};
use crate::driver::{DriverError, ImageFiles, Pace, VideoOptions, VideoSource, open_video};
use image::{GrayImage, ImageBuffer, Luma, RgbImage};
use std::path::PathBuf;
use std::time::Duration;

pub(super) const WIDTH: usize = 33;
pub(super) const HEIGHT: usize = 21;
pub(super) const RATE_HZ: f64 = 30.0;

/// When a frame was taken (s): 100 s and its number of intervals.
pub(super) fn time_s(number: u32) -> f64 {
    100.0 + f64::from(number) / RATE_HZ
}

/// Grey level of a frame's pixel.
pub(super) fn level(number: u32, pixel: usize) -> u8 {
    ((7 * number as usize + pixel) % 251) as u8
}

/// Distance at a frame's pixel: both bytes count.
pub(super) fn distance(number: u32, pixel: usize) -> u16 {
    ((13 * number as usize + 301 * pixel) % 65_521) as u16
}

/// A folder with image files of both streams and a table of their times.
pub(super) struct Recorded {
    pub(super) folder: tempfile::TempDir,
}

impl Recorded {
    /// Frames of these numbers, all sound.
    pub(super) fn new(numbers: impl IntoIterator<Item = u32> + Clone) -> Self {
        let recorded = Self { folder: tempfile::tempdir().expect("a folder") };
        for number in numbers.clone() {
            recorded.grey(number, [WIDTH, HEIGHT]);
            recorded.depth(number, [WIDTH, HEIGHT]);
        }
        recorded.times(numbers.into_iter().map(|number| (number, time_s(number))));
        recorded
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(super) fn grey_path(&self, number: u32) -> PathBuf {
        self.path(&format!("grey_{number:04}.png"))
    }

    pub(super) fn depth_path(&self, number: u32) -> PathBuf {
        self.path(&format!("depth_{number:04}.png"))
    }

    pub(super) fn grey(&self, number: u32, [width, height]: [usize; 2]) {
        let pixels = (0..width * height).map(|pixel| level(number, pixel)).collect();
        let picture = GrayImage::from_raw(width as u32, height as u32, pixels).expect("as many pixels");
        picture.save(self.grey_path(number)).expect("written");
    }

    pub(super) fn depth(&self, number: u32, [width, height]: [usize; 2]) {
        let values = (0..width * height).map(|pixel| distance(number, pixel)).collect();
        let picture: ImageBuffer<Luma<u16>, Vec<u16>> =
            ImageBuffer::from_raw(width as u32, height as u32, values).expect("as many values");
        picture.save(self.depth_path(number)).expect("written");
    }

    /// A colour picture in the place of any other.
    pub(super) fn colour(path: PathBuf, rgb: [u8; 3]) {
        let picture = RgbImage::from_pixel(WIDTH as u32, HEIGHT as u32, image::Rgb(rgb));
        picture.save(path).expect("written");
    }

    pub(super) fn times(&self, rows: impl IntoIterator<Item = (u32, f64)>) {
        let rows: String = rows.into_iter().map(|(number, time)| format!("{number},{time}\n")).collect();
        self.table(&format!("frame,time_s\n{rows}"));
    }

    pub(super) fn table(&self, text: &str) {
        std::fs::write(self.path("times.csv"), text).expect("written");
    }

    pub(super) fn options(&self, pace: Pace) -> VideoOptions {
        let files = |pattern| ImageFiles { pattern: self.path(pattern), times: self.path("times.csv") };
        let source =
            VideoSource::Files { grey: files("grey_%04d.png"), depth: files("depth_%04d.png"), pace };
        VideoOptions::new(source, [WIDTH, HEIGHT], RATE_HZ)
    }

    pub(super) fn open(&self) -> Result<Box<dyn DepthCamera>, DriverError> {
        open_video(&self.options(Pace::AsFetched))
    }

    pub(super) fn refusal(&self) -> String {
        with_causes(&self.open().err().expect("refused"))
    }

    /// Its frames to the end, and how that came.
    pub(super) fn play(camera: &mut dyn DepthCamera) -> (Vec<DepthFrame>, DeviceError) {
        let mut frames = Vec::new();
        loop {
            match camera.frame(HostTime::now() + Duration::from_secs(20)) {
                Ok(frame) => frames.push(frame.expect("a frame or an end within 20 s")),
                Err(end) => return (frames, end),
            }
        }
    }

    /// The numbers of its frames, whose values are as written.
    pub(super) fn sound_numbers(frames: &[DepthFrame]) -> Vec<u32> {
        for DepthFrame { number, grey, depth, device_s, .. } in frames {
            assert_eq!(*device_s, Some(time_s(*number)));
            assert_eq!([grey.width, grey.height, depth.width, depth.height], [WIDTH, HEIGHT, WIDTH, HEIGHT]);
            assert!(grey.pixels.iter().enumerate().all(|(pixel, &value)| value == level(*number, pixel)));
            assert!(depth.values.iter().enumerate().all(|(pixel, &value)| value == distance(*number, pixel)));
            assert_eq!([grey.pixels.len(), depth.values.len()], [WIDTH * HEIGHT; 2]);
        }
        frames.iter().map(|frame| frame.number).collect()
    }
}
