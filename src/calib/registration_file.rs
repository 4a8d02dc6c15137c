//! A registration as a file that a rig file names: TOML that a person can read, with all digits.

use super::{CalibError, Registration};
use crate::geometry::{Mat3, Vec3};
use crate::units::unread_toml;
use nalgebra::Matrix6;
use serde::{Deserialize, Serialize};

/// What the file begins with.
const FORMAT: &str = "phantom-registration/1";
/// How far rows of a rotation may be from orthonormal.
const ORTHONORMAL: f64 = 1e-6;

/// A registration with where it comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegistrationFile {
    format: String,
    /// When it was made (UTC).
    pub made_utc: String,
    /// The session that it was made from.
    pub session: String,
    /// Points used.
    pub points: usize,
    /// Root mean square distance that is left between the points (mm).
    pub rms_mm: f64,
    /// χ² per degree of freedom: 1 where the stated covariances are true.
    pub chi2_per_dof: f64,
    /// Length in the phantom frame over length seen, less one, that the points would rather have.
    pub scale_error: f64,
    /// Standard deviation of that.
    pub scale_error_sd: f64,
    /// Rows of the rotation from camera axes to phantom axes.
    pub rotation: [[f64; 3]; 3],
    /// The camera's centre of projection in the phantom frame (m).
    pub translation_m: [f64; 3],
    /// About which point of the phantom frame the turn of `covariance` goes (m).
    pub centre_m: [f64; 3],
    /// Covariance of a small turn about the phantom axes (rad), then a shift (m).
    pub covariance: [[f64; 6]; 6],
}

impl RegistrationFile {
    /// The file of a registration.
    pub fn new(found: &Registration, made_utc: String, session: String) -> Self {
        Self {
            format: FORMAT.to_owned(),
            made_utc,
            session,
            points: found.points,
            rms_mm: found.rms_m * 1e3,
            chi2_per_dof: found.chi2_per_dof,
            scale_error: found.scale_error,
            scale_error_sd: found.scale_error_sd,
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| found.rotation[(i, j)])),
            translation_m: found.translation_m.into(),
            centre_m: found.centre_m.into(),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| found.covariance[(i, j)])),
        }
    }

    /// Its text.
    ///
    /// # Errors
    /// [`CalibError::File`]: a value that is not finite.
    pub fn text(&self) -> Result<String, CalibError> {
        toml::to_string(self).map_err(|error| CalibError::File { why: error.to_string() })
    }

    /// Reads and checks a text.
    ///
    /// # Errors
    /// [`CalibError::File`]: no TOML, another format, a key missing or unknown, rows that are no rotation, a covariance that is none.
    pub fn parse(text: &str) -> Result<Self, CalibError> {
        let refuse = |why: String| Err(CalibError::File { why });
        let read: Self = match toml::from_str(text) {
            Ok(read) => read,
            Err(error) => return refuse(unread_toml(text, &error)),
        };
        if read.format != FORMAT {
            return refuse(format!("format is {:?}; expected {FORMAT:?}", read.format));
        }
        let found = read.registration();
        let turned = found.rotation * found.rotation.transpose();
        let is_rotation =
            (turned - Mat3::identity()).norm() < ORTHONORMAL && found.rotation.determinant() > 0.0;
        if !is_rotation {
            return refuse("rotation holds no right-handed unit vectors at right angles".to_owned());
        }
        if found.translation_m.iter().chain(&found.centre_m).any(|x| !x.is_finite()) {
            return refuse("a place is not finite".to_owned());
        }
        let symmetric =
            (found.covariance - found.covariance.transpose()).norm() <= 1e-9 * found.covariance.norm();
        if !symmetric || found.covariance.cholesky().is_none() {
            return refuse("covariance is not symmetric and positive".to_owned());
        }
        Ok(read)
    }

    /// What the file says.
    pub fn registration(&self) -> Registration {
        Registration {
            rotation: Mat3::from_fn(|i, j| self.rotation[i][j]),
            translation_m: Vec3::from(self.translation_m),
            centre_m: Vec3::from(self.centre_m),
            covariance: Matrix6::from_fn(|i, j| self.covariance[i][j]),
            rms_m: self.rms_mm * 1e-3,
            chi2_per_dof: self.chi2_per_dof,
            scale_error: self.scale_error,
            scale_error_sd: self.scale_error_sd,
            points: self.points,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn registration() -> Registration {
        Registration {
            rotation: Rotation3::from_euler_angles(3.0, 0.1, -0.7).into_inner(),
            translation_m: Vec3::new(0.05, 0.07, 0.4),
            centre_m: Vec3::new(0.05, 0.07, 0.02),
            covariance: Matrix6::identity() * 1e-9,
            rms_m: 4e-5,
            chi2_per_dof: 1.2,
            scale_error: 1e-4,
            scale_error_sd: 2e-4,
            points: 6,
        }
    }

    #[test]
    fn a_registration_comes_back_from_its_file() {
        let file =
            RegistrationFile::new(&registration(), "2026-01-01T00:00:00Z".to_owned(), "monday".to_owned());
        let text = file.text().expect("finite");
        let back = RegistrationFile::parse(&text).expect("sound");
        assert_eq!(back, file);
        assert!((back.registration().rotation - registration().rotation).norm() < 1e-15);
    }

    #[test]
    fn a_file_that_is_none_is_refused() {
        let text =
            RegistrationFile::new(&registration(), String::new(), String::new()).text().expect("finite");
        let points = "points = 6";
        for (from, to, words) in [
            ("phantom-registration/1", "phantom-registration/9", "expected \"phantom-registration/1\""),
            (points, "point = 6", "point is not known; expected one of format"),
            (points, "", "points is missing"),
            ("rotation = [[", "rotation = [[1", "right-handed"),
            ("covariance = [[", "covariance = [[-", "positive"),
        ] {
            assert!(text.contains(from), "{from}: {text}");
            let error = RegistrationFile::parse(&text.replacen(from, to, 1)).expect_err(words).to_string();
            assert!(error.contains(words), "{words}: {error}");
        }
    }
}
