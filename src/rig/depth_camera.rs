//! What a rig file says of its depth camera: where pictures come from, what they are worth, where the camera stands.

use super::{RigError, RigFile};
use crate::calib::lens::LensFile;
use crate::calib::{Registration, RegistrationFile};
use crate::driver::{ImageFiles, Pace, V4l2Stream, VideoOptions, VideoSource};
use crate::session::{HashedText, LensDocument};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// `[camera]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DepthCameraKeys {
    pub(super) source: SourceWord,
    /// Device, pipeline or name pattern of the grey pictures, and of the depth pictures.
    grey: Option<String>,
    depth: Option<String>,
    /// When image files were taken.
    grey_times: Option<String>,
    depth_times: Option<String>,
    /// Four letters of the pixel formats to ask a device for.
    grey_format: Option<String>,
    depth_format: Option<String>,
    /// Which of several cameras of a kind.
    index: Option<u32>,
    pub(super) size_px: [usize; 2],
    pub(super) rate_hz: f64,
    pub(super) depth_unit_mm: f64,
    /// No picture for so long: the camera counts as lost, and the run stops.
    silence_ms: Option<u64>,
    /// A file of `calibrate camera`, in place of the four below.
    lens: Option<String>,
    focal_px: Option<[f64; 2]>,
    principal_px: Option<[f64; 2]>,
    radial: Option<[f64; 3]>,
    tangential: Option<[f64; 2]>,
    registration: Option<String>,
    #[serde(default)]
    pub(super) fiducials_mm: Vec<[f64; 3]>,
    #[serde(default = "ruler")]
    pub(super) fiducial_sd_mm: f64,
}

/// Places that were measured with a ruler are known to so much (mm).
fn ruler() -> f64 {
    0.1
}

#[derive(Debug, Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum SourceWord {
    Simulated,
    V4l2,
    Gstreamer,
    Stacked,
    Openni2,
    Obsensor,
    Files,
}

impl DepthCameraKeys {
    /// Whether the simulated bench has it.
    pub(super) fn is_simulated(&self) -> bool {
        self.source == SourceWord::Simulated
    }

    /// What the driver is to open; none for a simulated camera, whose pipe is made when it is started.
    pub(super) fn video(&self, rig: &RigFile) -> Result<Option<VideoOptions>, RigError> {
        let need = |key: &'static str, value: &Option<String>| {
            value.clone().ok_or_else(|| RigError::Value {
                file: rig.file.clone(),
                key,
                found: "missing".to_owned(),
                expected: "a device, pipeline or name pattern, as the camera's source wants it",
            })
        };
        let four = |key: &'static str, value: &Option<String>| match value.as_deref().map(letters) {
            None => Ok(None),
            Some(Some(letters)) => Ok(Some(letters)),
            Some(None) => Err(RigError::Value {
                file: rig.file.clone(),
                key,
                found: value.clone().unwrap_or_default(),
                expected: "four letters, such as \"Y16 \"",
            }),
        };
        let beside = |name: String| -> PathBuf { rig.file.parent().unwrap_or(Path::new("")).join(name) };
        let source = match self.source {
            SourceWord::Simulated => return Ok(None),
            SourceWord::V4l2 => VideoSource::V4l2 {
                grey: V4l2Stream {
                    device: need("camera.grey", &self.grey)?.into(),
                    four_cc: four("camera.grey_format", &self.grey_format)?,
                },
                depth: V4l2Stream {
                    device: need("camera.depth", &self.depth)?.into(),
                    four_cc: four("camera.depth_format", &self.depth_format)?,
                },
            },
            SourceWord::Gstreamer => VideoSource::GStreamer {
                grey: need("camera.grey", &self.grey)?,
                depth: need("camera.depth", &self.depth)?,
            },
            SourceWord::Stacked => VideoSource::Stacked { pipeline: need("camera.grey", &self.grey)? },
            SourceWord::Openni2 => VideoSource::OpenNi2 { index: self.index.unwrap_or(0) },
            SourceWord::Obsensor => VideoSource::Obsensor { index: self.index.unwrap_or(0) },
            SourceWord::Files => VideoSource::Files {
                grey: ImageFiles {
                    pattern: beside(need("camera.grey", &self.grey)?),
                    times: beside(need("camera.grey_times", &self.grey_times)?),
                },
                depth: ImageFiles {
                    pattern: beside(need("camera.depth", &self.depth)?),
                    times: beside(need("camera.depth_times", &self.depth_times)?),
                },
                pace: Pace::AsTaken,
            },
        };
        Ok(Some(self.options(source)))
    }

    /// Everything else that the driver has to know of a source.
    pub(super) fn options(&self, source: VideoSource) -> VideoOptions {
        let mut options = VideoOptions::new(source, self.size_px, self.rate_hz);
        options.metres_per_unit = self.depth_unit_mm * 1e-3;
        options.silence = self.silence_ms.map_or(options.silence, Duration::from_millis);
        options
    }

    /// The lens, where one is known: as a calibration file says, whose text comes with it, or as the rig file itself does.
    pub(super) fn lens(&self, rig: &Path) -> Result<Option<(LensDocument, Option<HashedText>)>, RigError> {
        match &self.lens {
            Some(name) => Ok(Some(self.calibrated_lens(rig, name)?)),
            None => Ok(self.written_lens(rig)?.map(|lens| (lens, None))),
        }
    }

    fn calibrated_lens(
        &self,
        rig: &Path,
        name: &str,
    ) -> Result<(LensDocument, Option<HashedText>), RigError> {
        let refuse = |found: String, expected: &'static str| {
            Err(RigError::Value { file: rig.to_owned(), key: "camera.lens", found, expected })
        };
        let numbers = [
            ("focal_px", self.focal_px.is_some()),
            ("principal_px", self.principal_px.is_some()),
            ("radial", self.radial.is_some()),
            ("tangential", self.tangential.is_some()),
        ];
        if let Some((key, _)) = numbers.into_iter().find(|(_, given)| *given) {
            return refuse(format!("{name:?} beside {key}"), "a calibration file or numbers, not both");
        }
        let (file, text) = text_beside(rig, name)?;
        let lens = LensFile::parse(&text).map_err(|source| RigError::Lens { file, source })?;
        self.found_lens(rig, &lens, text)
    }

    /// A calibrated lens, if it is one for this camera's pictures.
    pub(super) fn found_lens(
        &self,
        rig: &Path,
        lens: &LensFile,
        text: String,
    ) -> Result<(LensDocument, Option<HashedText>), RigError> {
        if lens.size_px != self.size_px {
            let [width, height] = lens.size_px;
            return Err(RigError::Value {
                file: rig.to_owned(),
                key: "camera.lens",
                found: format!("a lens for pictures of {width} × {height} pixels"),
                expected: "one that was found with pictures of size_px",
            });
        }
        let document = LensDocument {
            focal_px: lens.focal_px,
            principal_px: lens.principal_px,
            radial: lens.radial,
            tangential: lens.tangential,
        };
        Ok((document, Some(HashedText::new(text))))
    }

    fn written_lens(&self, rig: &Path) -> Result<Option<LensDocument>, RigError> {
        let Some(focal_px) = self.focal_px else { return Ok(None) };
        // Without a word the optical axis goes through the middle.
        let middle = self.size_px.map(|s| 0.5 * (s as f64 - 1.0));
        let lens = LensDocument {
            focal_px,
            principal_px: self.principal_px.unwrap_or(middle),
            radial: self.radial.unwrap_or_default(),
            tangential: self.tangential.unwrap_or_default(),
        };
        let numbers =
            lens.focal_px.iter().chain(&lens.principal_px).chain(&lens.radial).chain(&lens.tangential);
        if numbers.into_iter().all(|n| n.is_finite()) && lens.focal_px.iter().all(|f| *f > 0.0) {
            return Ok(Some(lens));
        }
        Err(RigError::Value {
            file: rig.to_owned(),
            key: "camera.focal_px",
            found: format!("{focal_px:?}"),
            expected: "positive numbers, and a finite principal point and distortion beside them",
        })
    }

    /// The registration that the file names: its text and what it says.
    pub(super) fn registration(&self, rig: &Path) -> Result<Option<(HashedText, Registration)>, RigError> {
        let Some(name) = &self.registration else { return Ok(None) };
        let (file, text) = text_beside(rig, name)?;
        let parsed =
            RegistrationFile::parse(&text).map_err(|source| RigError::Registration { file, source })?;
        Ok(Some((HashedText::new(text), parsed.registration())))
    }
}

/// A file that lies beside the rig file, with its text.
fn text_beside(rig: &Path, name: &str) -> Result<(PathBuf, String), RigError> {
    let file = rig.parent().unwrap_or(Path::new("")).join(name);
    let text =
        std::fs::read_to_string(&file).map_err(|source| RigError::Read { file: file.clone(), source })?;
    Ok((file, text))
}

fn letters(text: &str) -> Option<[char; 4]> {
    text.chars().collect::<Vec<_>>().try_into().ok()
}
