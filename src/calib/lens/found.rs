//! What a calibration found, and what it says about itself.

use super::held_out::HELD_OUT_PICTURES;
use super::normal::LensSquare;
use super::{Finding, Pose};
use crate::track::Camera;

/// How one picture fits.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureFit {
    /// Where the board was; where columns or rows are missing, up to a shift by some of them.
    pub pose: Pose,
    /// Root mean square residual of its points (px), without those that were left out.
    pub rms_px: f64,
    /// Median residual over what the points' covariances say: 1 where they are true. Outliers do not change it.
    pub spread: f64,
    /// Whether it does not fit the others: mirrored, moved, or of another camera. The camera is found without it if enough others are there.
    pub stranger: bool,
    /// Root mean square residual for a camera from the other half of the pictures, with only the pose of this one adjusted; none with
    /// fewer than six pictures, where a half alone leaves a camera open, and for a picture that was left out.
    pub held_out_rms_px: Option<f64>,
    /// Points that are farther from where they should be than five standard deviations, from 0; not looked for in strangers. See
    /// [`LensFound::left_out`].
    pub outliers: Vec<usize>,
}

/// What single points that are not where they should be would have done to the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// How many were left out, in all pictures.
    pub points: usize,
    /// The camera that they would have been part of.
    pub with_them: Camera,
    /// Largest distance in the picture between where the two cameras see a ray (px), as far as a turn does not make up for it.
    pub moved_px: f64,
}

/// A camera, how surely, and how far to be trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct LensFound {
    /// The camera.
    pub camera: Camera,
    /// Covariance of fₓ, f_y, cₓ, c_y, k₁, k₂, p₁, p₂, k₃; 0 for k₃ when it is held at 0. Larger than the points' own covariances say
    /// where the residuals are.
    pub covariance: LensSquare,
    /// Largest standard deviation in the picture of where a ray is seen (px), as far as a turn of the camera does not make up for it.
    pub lens_sd_px: f64,
    /// Root mean square residual of all points of the pictures that were used (px).
    pub rms_px: f64,
    /// χ² per degree of freedom: 1 where the stated covariances are true.
    pub chi2_per_dof: f64,
    /// Root mean square residual of held-out pictures (px); none where there are none.
    pub held_out_rms_px: Option<f64>,
    /// Each picture, in the order given.
    pub pictures: Vec<PictureFit>,
    /// Largest angle between the normals of two boards (rad): what the focal length is known from.
    pub turned_rad: f64,
    /// Largest distance of a point from the optical axis, over its depth.
    pub covered_radius: f64,
    /// The same for the farthest corner of the picture: beyond what is covered, distortion is extrapolated.
    pub corner_radius: f64,
    /// Whether the distortion folds over within the picture.
    pub folds: bool,
    /// What leaving out the pictures' outliers changed; none where there are none, and where they are more than a tenth of all points
    /// or a third of those farthest out: then the camera was found with them, as far as they count.
    pub left_out: Option<LeftOut>,
}

/// Below this share of the corners' radius distortion is extrapolated far.
const FAR: f64 = 0.85;
/// A focal length that is known no better than to this share is worth a word.
const FOCAL_SHARE: f64 = 2e-3;
/// So is a lens that is known no better than that somewhere in the picture (px).
const LENS_SD_PX: f64 = 0.2;
/// χ² per degree of freedom from which residuals are not those that the points' covariances say.
const LARGE_CHI2: f64 = 4.0;

impl LensFound {
    /// Standard deviations of fₓ, f_y, cₓ, c_y, k₁, k₂, p₁, p₂, k₃.
    pub fn deviations(&self) -> [f64; 9] {
        std::array::from_fn(|k| self.covariance[(k, k)].max(0.0).sqrt())
    }

    /// Pictures, from 0, that do not fit the others.
    pub fn strangers(&self) -> Vec<usize> {
        (0..self.pictures.len()).filter(|&k| self.pictures[k].stranger).collect()
    }

    /// What a person should know before trusting the camera; nothing where all is well.
    pub fn findings(&self) -> Vec<Finding> {
        let mut findings = Vec::new();
        let used = self.pictures.len() - self.strangers().len();
        if used < HELD_OUT_PICTURES {
            findings.push(Finding::FewPictures { found: used, needed: HELD_OUT_PICTURES });
        }
        let (focal_px, deviations) = (self.camera.focal_px, self.deviations());
        let share = |k: &usize| deviations[*k] / focal_px[*k];
        let k = if share(&1) > share(&0) { 1 } else { 0 };
        if share(&k) > FOCAL_SHARE {
            let (focal_px, sd_px, turned_rad) = (focal_px[k], deviations[k], self.turned_rad);
            findings.push(Finding::FocalLength { focal_px, sd_px, turned_rad });
        }
        if self.lens_sd_px > LENS_SD_PX {
            findings.push(Finding::Distortion { sd_px: self.lens_sd_px });
        }
        if self.covered_radius < FAR * self.corner_radius {
            let (covered_radius, corner_radius) = (self.covered_radius, self.corner_radius);
            findings.push(Finding::Coverage { covered_radius, corner_radius });
        }
        if self.folds {
            findings.push(Finding::Folds);
        }
        if self.chi2_per_dof > LARGE_CHI2 {
            findings.push(Finding::Misfit { times: self.chi2_per_dof.sqrt() });
        }
        for (picture, fit) in self.pictures.iter().enumerate() {
            if fit.stranger {
                findings.push(Finding::Stranger { picture, rms_px: fit.rms_px });
            } else if !fit.outliers.is_empty() {
                findings.push(Finding::Outliers { picture, points: fit.outliers.len() });
            }
        }
        findings
    }
}
