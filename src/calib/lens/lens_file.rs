//! A lens as a file that a rig file names: TOML that a person can read, with all digits.

use super::{Board, LensError, LensFound};
use crate::track::Camera;
use crate::units::unread_toml;
use serde::{Deserialize, Serialize};

/// What the file begins with.
const FORMAT: &str = "phantom-lens/1";

/// A lens with where it comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensFile {
    format: String,
    /// When it was made (UTC).
    pub made_utc: String,
    /// Of which board the pictures were.
    pub board: String,
    /// How many pictures there were.
    pub pictures: usize,
    /// What its maker wants to be known of it.
    pub note: String,
    /// Root mean square residual (px).
    pub rms_px: f64,
    /// Width and height of the pictures (px): the lens holds for this size only.
    pub size_px: [usize; 2],
    /// Focal lengths along columns and rows (px).
    pub focal_px: [f64; 2],
    /// Standard deviations of those (px).
    pub focal_sd_px: [f64; 2],
    /// Principal point (px), counted from the centre of the upper left pixel.
    pub principal_px: [f64; 2],
    /// Standard deviations of that (px).
    pub principal_sd_px: [f64; 2],
    /// Radial distortion k₁, k₂, k₃.
    pub radial: [f64; 3],
    /// Standard deviations of those; 0 where one was held at 0.
    pub radial_sd: [f64; 3],
    /// Tangential distortion p₁, p₂.
    pub tangential: [f64; 2],
    /// Standard deviations of those.
    pub tangential_sd: [f64; 2],
}

impl LensFile {
    /// The file of a lens. `note`: what its maker wants to be known of it.
    pub fn new(found: &LensFound, board: &Board, made_utc: String, note: String) -> Self {
        let camera = found.camera;
        let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = found.deviations();
        Self {
            format: FORMAT.to_owned(),
            made_utc,
            board: board.to_string(),
            pictures: found.pictures.len(),
            note,
            rms_px: found.rms_px,
            size_px: camera.size_px,
            focal_px: camera.focal_px,
            focal_sd_px: [fx, fy],
            principal_px: camera.principal_px,
            principal_sd_px: [cx, cy],
            radial: camera.radial,
            radial_sd: [k1, k2, k3],
            tangential: camera.tangential,
            tangential_sd: [p1, p2],
        }
    }

    /// Its text.
    ///
    /// # Errors
    /// [`LensError::File`]: a value that TOML cannot hold.
    pub fn text(&self) -> Result<String, LensError> {
        toml::to_string(self).map_err(|error| LensError::File { why: error.to_string() })
    }

    /// Reads and checks a text.
    ///
    /// # Errors
    /// [`LensError::File`]: no TOML, another format, a key missing or unknown, a camera that cannot be, a deviation that is none.
    pub fn parse(text: &str) -> Result<Self, LensError> {
        let refuse = |why: String| Err(LensError::File { why });
        let read: Self = match toml::from_str(text) {
            Ok(read) => read,
            Err(error) => return refuse(unread_toml(text, &error)),
        };
        if read.format != FORMAT {
            return refuse(format!("format is {:?}; expected {FORMAT:?}", read.format));
        }
        if let Err(error) = read.camera().check() {
            return refuse(error.to_string());
        }
        let deviations = read.focal_sd_px.iter().chain(&read.principal_sd_px);
        let deviations = deviations.chain(&read.radial_sd).chain(&read.tangential_sd).chain([&read.rms_px]);
        for deviation in deviations {
            if !(deviation.is_finite() && *deviation >= 0.0) {
                return refuse(format!("a standard deviation is {deviation}; expected 0 or more"));
            }
        }
        for (point, size) in read.principal_px.iter().zip(read.size_px) {
            if !(-0.5..=size as f64 - 0.5).contains(point) {
                return refuse(format!("principal_px holds {point}, outside a picture of {size} px"));
            }
        }
        Ok(read)
    }

    /// The camera that it describes.
    pub fn camera(&self) -> Camera {
        Camera {
            size_px: self.size_px,
            focal_px: self.focal_px,
            principal_px: self.principal_px,
            radial: self.radial,
            tangential: self.tangential,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::scene::{BOARD, TRUTH};
    use super::*;
    use nalgebra::{SMatrix, SVector};

    fn found() -> LensFound {
        let sd = SVector::<f64, 9>::from([0.2, 0.21, 0.3, 0.31, 1e-3, 2e-2, 1e-5, 2e-5, 0.0]);
        LensFound {
            camera: TRUTH,
            covariance: SMatrix::from_diagonal(&sd.component_mul(&sd)),
            lens_sd_px: 0.05,
            rms_px: 0.031,
            chi2_per_dof: 1.1,
            held_out_rms_px: Some(0.033),
            pictures: Vec::new(),
            turned_rad: 1.0,
            covered_radius: 0.4,
            corner_radius: 0.5,
            folds: false,
            left_out: None,
        }
    }

    fn file() -> LensFile {
        LensFile::new(&found(), &BOARD, "2026-01-01T00:00:00Z".to_owned(), "wide end".to_owned())
    }

    #[test]
    fn a_lens_comes_back_from_its_file() {
        let text = file().text().expect("numbers");
        let back = LensFile::parse(&text).expect("sound");
        assert_eq!((&back, back.camera()), (&file(), TRUTH));
        assert!((back.radial_sd[1] - 2e-2).abs() < 1e-15 && back.radial_sd[2] == 0.0);
        assert!(text.starts_with("format = \"phantom-lens/1\""), "{text}");
        assert!(text.contains("board = \"9 × 7 dots, pitch 12 mm, radius 3 mm\""), "{text}");
    }

    #[test]
    fn a_file_that_is_none_is_refused() {
        let text = file().text().expect("numbers");
        for (from, to, words) in [
            ("phantom-lens/1", "phantom-lens/2", "expected \"phantom-lens/1\""),
            ("note = ", "remark = ", "remark is not known; expected one of format"),
            ("rms_px = 0.031", "", "rms_px is missing"),
            ("rms_px = 0.031", "rms_px = -0.031", "expected 0 or more"),
            ("focal_px = [812.0", "focal_px = [-812.0", "focal_px is -812"),
            ("focal_px = [812.0", "focal_px = [nan", "focal_px"),
            ("tangential = [0.0008", "tangential = [inf", "a camera parameter is inf"),
            ("radial_sd = [", "radial_sd = [-", "a standard deviation is -"),
            ("size_px = [640", "size_px = [0", "size_px is 0"),
            ("size_px = [640", "size_px = [320", "outside a picture of 320 px"),
        ] {
            assert!(text.contains(from), "{from}: {text}");
            let error = LensFile::parse(&text.replacen(from, to, 1)).expect_err(words).to_string();
            assert!(error.contains(words), "{words}: {error}");
        }
    }
}
