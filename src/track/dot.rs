//! What is known of one dot in one picture.

use nalgebra::Matrix2;

/// A dot in a grey picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// Centre of the dot's image (px).
    pub centre_px: [f64; 2],
    /// Covariance of the centre (px²).
    pub covariance_px2: Matrix2<f64>,
    /// What light that changes across the dot may have done to its centre; none when no disc fitted.
    pub light: Option<LightShift>,
    /// Maps the unit circle to the dot's rim, seen from its centre (px); symmetric.
    pub rim_px: Matrix2<f64>,
    /// Height above the background (grey levels).
    pub contrast: f64,
    /// Grey level of the background at the dot.
    pub background: f64,
    /// Blur of the rim, the standard deviation of a Gaussian (px); none when the centre is a centroid because no disc fitted.
    pub blur_px: Option<f64>,
    /// Share of the variance around the dot that a blurred disc explains, 0 to 1; 0 for a centroid.
    pub quality: f64,
    /// Whether a fifth of it or more is white, so that its brightness is not known.
    pub saturated: bool,
    /// Whether it reaches the border of the picture: its centre is that of a part.
    pub border: bool,
    /// Whether it flows together with something else as bright.
    pub merged: bool,
}

/// How far a centre would move if the brightness of its dot were allowed to change across it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightShift {
    /// By so much (px).
    pub shift_px: [f64; 2],
    /// Covariance of that from the picture's noise (px²).
    pub covariance_px2: Matrix2<f64>,
}

impl Dot {
    /// Radius of the circle of the same area (px).
    pub fn radius_px(&self) -> f64 {
        self.rim_px.determinant().max(0.0).sqrt()
    }

    /// Half of the longest diameter (px).
    pub fn longest_px(&self) -> f64 {
        let half = 0.5 * self.rim_px.trace();
        half + (half * half - self.rim_px.determinant()).max(0.0).sqrt()
    }

    /// Shortest over longest diameter.
    pub fn aspect(&self) -> f64 {
        let longest = self.longest_px();
        if longest > 0.0 { self.rim_px.determinant().max(0.0) / (longest * longest) } else { 0.0 }
    }

    /// Whether its centre is that of a whole dot by itself.
    pub fn is_whole(&self) -> bool {
        !self.border && !self.merged
    }

    /// Distance between two centres (px).
    pub fn distance_px(&self, other: &Self) -> f64 {
        let [x, y] = [0, 1].map(|k| self.centre_px[k] - other.centre_px[k]);
        (x * x + y * y).sqrt()
    }
}
