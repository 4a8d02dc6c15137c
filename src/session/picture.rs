//! Pictures of the depth camera in a session: each as a PNG without loss, grey levels in 8 bits, depths in 16.
//!
//! Why PNG: public tools show it and take it out again, and it holds 16 bits. One frame is three messages with one time: the frame itself
//! with its number, its grey picture, its depth picture.

use super::cdr::{Decoder, Encoder};
use super::message::Message;
use super::read::Messages;
use super::{Recorded, Session, SessionError, Topic};
use crate::clock::HostTime;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageFormat};
use std::iter::Peekable;

/// One frame of a depth camera, without its pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFrame {
    /// When it was grabbed.
    pub host: HostTime,
    /// Number that its source gives it; a gap is a frame that was lost.
    pub number: u32,
    /// The source's own time of it (s).
    pub device_s: Option<f64>,
}

/// One picture of a frame, as a PNG.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// When its frame was grabbed.
    pub host: HostTime,
    /// The file.
    pub png: Vec<u8>,
}

/// A frame with the pictures that are there.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedFrame {
    /// Number of the segment, from 1.
    pub segment: u32,
    /// The frame.
    pub frame: CameraFrame,
    /// Grey levels; none where it was not recorded.
    pub grey: Option<Picture>,
    /// Depths; none where it was not recorded.
    pub depth: Option<Picture>,
}

/// Pixels of a picture, row by row, and its width and height.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pixels<T> {
    /// Width and height (px).
    pub size_px: [usize; 2],
    /// Row by row.
    pub values: Vec<T>,
}

/// What the pictures' frame of reference is called in the file.
const FRAME_ID: &str = "camera";
const FORMAT: &str = "png";

impl Picture {
    /// A picture of 8-bit grey levels, row by row; none when there are not as many as the size says.
    pub fn of_grey(host: HostTime, size_px: [usize; 2], levels: &[u8]) -> Option<Self> {
        encode(host, size_px, levels, ExtendedColorType::L8)
    }

    /// A picture of 16-bit depths, row by row; none when there are not as many as the size says.
    pub fn of_depth(host: HostTime, size_px: [usize; 2], depths: &[u16]) -> Option<Self> {
        // The encoder takes them in the order of this machine.
        let bytes: Vec<u8> = depths.iter().flat_map(|d| d.to_ne_bytes()).collect();
        encode(host, size_px, &bytes, ExtendedColorType::L16)
    }

    /// Its grey levels; none when it is no 8-bit grey picture.
    pub fn grey(&self) -> Option<Pixels<u8>> {
        match self.decode()? {
            DynamicImage::ImageLuma8(picture) => Some(Pixels {
                size_px: [picture.width() as usize, picture.height() as usize],
                values: picture.into_raw(),
            }),
            _ => None,
        }
    }

    /// Its depths; none when it is no 16-bit grey picture.
    pub fn depth(&self) -> Option<Pixels<u16>> {
        match self.decode()? {
            DynamicImage::ImageLuma16(picture) => Some(Pixels {
                size_px: [picture.width() as usize, picture.height() as usize],
                values: picture.into_raw(),
            }),
            _ => None,
        }
    }

    fn decode(&self) -> Option<DynamicImage> {
        image::load_from_memory_with_format(&self.png, ImageFormat::Png).ok()
    }

    /// As `foxglove_msgs/msg/CompressedImage`.
    pub(super) fn write(&self, encoder: &mut Encoder<'_>) {
        let nanos = self.host.nanos();
        // A machine is switched off now and then in 68 years.
        encoder.u32((nanos / 1_000_000_000) as u32);
        encoder.u32((nanos % 1_000_000_000) as u32);
        encoder.string(FRAME_ID);
        encoder.bytes(&self.png);
        encoder.string(FORMAT);
    }

    pub(super) fn read(decoder: &mut Decoder<'_>) -> Option<Self> {
        let (seconds, nanos) = (decoder.u32()?, decoder.u32()?);
        let host = HostTime::from_nanos(u64::from(seconds) * 1_000_000_000 + u64::from(nanos));
        let is_ours = decoder.string()? == FRAME_ID;
        let png = decoder.bytes()?.to_vec();
        (is_ours && decoder.string()? == FORMAT).then_some(Self { host, png })
    }
}

fn encode(
    host: HostTime,
    [width, height]: [usize; 2],
    bytes: &[u8],
    kind: ExtendedColorType,
) -> Option<Picture> {
    let needed = width.checked_mul(height)?.checked_mul(usize::from(kind.bits_per_pixel() / 8))?;
    if needed != bytes.len() || bytes.is_empty() {
        return None;
    }
    let (width, height) = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
    let mut png = Vec::with_capacity(bytes.len() / 2);
    // Noise hardly shrinks, however long one tries: the quickest level keeps up with a camera beside other work.
    let encoder = PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Sub);
    encoder.write_image(bytes, width, height, kind).ok()?;
    Some(Picture { host, png })
}

impl CameraFrame {
    pub(super) fn write(&self, encoder: &mut Encoder<'_>) {
        encoder.u64(self.host.nanos());
        encoder.u32(self.number);
        encoder.bool(self.device_s.is_some());
        encoder.f64(self.device_s.unwrap_or(0.0));
    }

    pub(super) fn read(decoder: &mut Decoder<'_>) -> Option<Self> {
        let (host, number) = (HostTime::from_nanos(decoder.u64()?), decoder.u32()?);
        let (has_device, device_s) = (decoder.bool()?, decoder.f64()?);
        Some(Self { host, number, device_s: has_device.then_some(device_s) })
    }
}

impl Session {
    /// All frames of the depth camera with their pictures.
    pub fn frames(&self) -> Frames {
        Frames { messages: self.messages(&[Topic::Frame, Topic::Grey, Topic::Depth]).peekable() }
    }
}

/// The frames of a session: see [`Session::frames`].
pub struct Frames {
    messages: Peekable<Messages>,
}

impl Iterator for Frames {
    type Item = Result<RecordedFrame, SessionError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let Recorded { segment, message, .. } = match self.messages.next()? {
                Ok(recorded) => recorded,
                Err(error) => return Some(Err(error)),
            };
            // Pictures whose frame is not there have no number.
            let Message::Frame(frame) = message else { continue };
            let mut found = RecordedFrame { segment, frame, grey: None, depth: None };
            let belongs = |next: &Result<Recorded, SessionError>| {
                next.as_ref().is_ok_and(|next| {
                    next.segment == segment
                        && next.message.host() == frame.host
                        && next.message.topic() != Topic::Frame
                })
            };
            while let Some(Ok(next)) = self.messages.next_if(belongs) {
                match next.message {
                    Message::Grey(picture) => found.grey = Some(picture),
                    Message::Depth(picture) => found.depth = Some(picture),
                    _ => {}
                }
            }
            return Some(Ok(found));
        }
    }
}
