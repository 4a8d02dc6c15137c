//! From something that may be a dot to its centre: a blurred disc where one fits, the centroid of its light elsewhere.

use super::model::BlurredDisc;
use super::window::Window;
use super::{fit, moment};
use crate::track::{GreyView, LightShift};
use nalgebra::{Matrix2, Vector2};

/// What is known of a dot before its centre is.
#[derive(Debug, Clone, Copy)]
pub(in crate::track) struct Rough {
    /// Centre of area on the half-way level (px).
    pub(in crate::track) centre: Vector2<f64>,
    /// Second central moments of that area (px²).
    pub(in crate::track) moments: Matrix2<f64>,
    /// Grey level around it.
    pub(in crate::track) base: f64,
    /// Grey level of its upper part.
    pub(in crate::track) top: f64,
    /// How far beyond the rim its own background reaches (px).
    pub(in crate::track) margin: f64,
}

/// A dot with its centre.
#[derive(Debug, Clone, Copy)]
pub(in crate::track) struct Fine {
    pub(in crate::track) centre: Vector2<f64>,
    pub(in crate::track) covariance: Matrix2<f64>,
    pub(in crate::track) light: Option<LightShift>,
    /// Maps the unit circle to the rim, from the centre (px).
    pub(in crate::track) rim: Matrix2<f64>,
    pub(in crate::track) height: f64,
    pub(in crate::track) base: f64,
    /// Blur of the edge (px); none when no disc fitted.
    pub(in crate::track) blur: Option<f64>,
    pub(in crate::track) explained: f64,
    pub(in crate::track) white: f64,
}

/// Blur that a fit starts from (px).
const START_BLUR: f64 = 0.9;

/// How far beyond the rim a centroid looks (px).
const MOMENT_MARGIN: f64 = 5.0;

/// Finds centres one after another, reusing memory.
#[derive(Default)]
pub(in crate::track) struct Refiner {
    window: Window,
}

impl Refiner {
    /// The centre, in a picture with noise of standard deviation `noise`; none when there is nothing to be centred on.
    pub(in crate::track) fn refine(
        &mut self,
        view: &GreyView<'_>,
        rough: &Rough,
        noise: f64,
    ) -> Option<Fine> {
        let start = BlurredDisc::from_moments(
            rough.centre,
            rough.moments,
            rough.top - rough.base,
            START_BLUR,
            rough.base,
        )?;
        self.window.gather(view, &start, rough.margin);
        if let Some(fitted) = fit::fit(&self.window, start) {
            let disc = fitted.disc;
            return Some(Fine {
                centre: disc.centre(),
                covariance: fitted.unit_covariance * fitted.residual.max(noise * noise),
                light: Some(LightShift {
                    shift_px: fitted.light.0.into(),
                    covariance_px2: fitted.light.1 * (noise * noise),
                }),
                rim: disc.to_circle().try_inverse()?,
                height: disc.height(),
                base: disc.base(),
                blur: Some(disc.blur()),
                explained: fitted.explained,
                white: fitted.white,
            });
        }
        // The centroid needs a ring of background.
        self.window.gather(view, &start, MOMENT_MARGIN);
        let samples: Vec<_> = self.window.samples().collect();
        let (centre, unit_covariance) = moment::centroid(&samples, start)?;
        Some(Fine {
            centre,
            covariance: unit_covariance * (noise * noise),
            light: None,
            rim: start.to_circle().try_inverse()?,
            height: start.height(),
            base: start.base(),
            blur: None,
            explained: 0.0,
            white: 0.0,
        })
    }
}
