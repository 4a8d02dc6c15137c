//! What happened in a session: the force of the tip and where the markers went, small strain or large.

use super::condensed::SessionBody;
use super::history::Course;
use super::large::LargeCourse;
use crate::geometry::Vec3;
use nalgebra::DVector;

/// A session as it was before any instrument looked at it.
pub(super) enum Happened {
    /// The condensed phantom.
    Small { body: SessionBody, course: Course },
    /// The phantom at large strain.
    Large(LargeCourse),
}

impl Happened {
    /// Force of the tip on the phantom at a time (N).
    pub(super) fn force_at(&self, time_s: f64) -> Vec3 {
        match self {
            Self::Small { course, .. } => course.force_at(time_s),
            Self::Large(course) => course.force_at(time_s),
        }
    }

    /// Displacements of the markers at a time (m), three a marker.
    pub(super) fn moved_at(&self, time_s: f64) -> DVector<f64> {
        match self {
            Self::Small { body, course } => &body.watched * course.loads_at(time_s),
            Self::Large(course) => course.moved_at(time_s),
        }
    }
}
