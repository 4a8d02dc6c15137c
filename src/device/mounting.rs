//! Where a stage's axes point in the phantom frame, and how a sensor lies in it.

use super::stage::AXES;
use crate::geometry::{Mat3, Vec3};

/// A place that the stage's two axes do not reach.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "({:.2}, {:.2}, {:.2}) mm lies {:.2} mm beside the plane that the stage moves the tip in; at most {:.2} mm are taken for none",
    place_m[0] * 1e3, place_m[1] * 1e3, place_m[2] * 1e3, beside_m * 1e3, tolerance_m * 1e3
)]
pub struct UnreachableSite {
    /// The place (m, phantom frame).
    pub place_m: [f64; 3],
    /// Distance from the plane (m).
    pub beside_m: f64,
    /// What is taken for no distance (m).
    pub tolerance_m: f64,
}

/// How a stage carries the tip: its centre is at `origin + Σ position · axis`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mounting {
    origin: Vec3,
    axes: [Vec3; AXES],
    tolerance_m: f64,
}

impl Mounting {
    /// `origin_m`: centre of the tip's face in the phantom frame with the stage at zero (m). `axes`: where it goes when an axis goes
    /// up; made unit vectors. A place closer than `tolerance_m` to the plane of motion counts as reached.
    ///
    /// `None` when an axis has no length or the axes are less than 30° apart.
    pub fn new(origin_m: [f64; 3], axes: [[f64; 3]; AXES], tolerance_m: f64) -> Option<Self> {
        let [first, second] = axes.map(|a| Vec3::from(a).try_normalize(1e-9));
        let axes = [first?, second?];
        let sound = axes[0].cross(&axes[1]).norm() > 0.5 && origin_m.iter().all(|x| x.is_finite());
        sound.then_some(Self { origin: origin_m.into(), axes, tolerance_m })
    }

    /// Centre of the tip's face in the phantom frame (m).
    pub fn tip_at(&self, position_m: [f64; AXES]) -> Vec3 {
        self.origin + self.moved_by(position_m)
    }

    /// What a motion of the stage is in the phantom frame (m).
    pub fn moved_by(&self, motion_m: [f64; AXES]) -> Vec3 {
        self.axes[0] * motion_m[0] + self.axes[1] * motion_m[1]
    }

    /// The motion of the stage that comes closest to one in the phantom frame (m): least squares, for the axes need not be at right
    /// angles.
    pub fn motion_for(&self, moved_m: Vec3) -> [f64; AXES] {
        let (a, b) = (self.axes[0], self.axes[1]);
        let (ab, da, db) = (a.dot(&b), moved_m.dot(&a), moved_m.dot(&b));
        let determinant = 1.0 - ab * ab;
        [(da - ab * db) / determinant, (db - ab * da) / determinant]
    }

    /// The position of the stage that brings the tip to a place in the phantom frame (m).
    ///
    /// # Errors
    /// [`UnreachableSite`]: the place is farther from the plane of motion than the tolerance.
    pub fn position_for(&self, place_m: Vec3) -> Result<[f64; AXES], UnreachableSite> {
        let position = self.motion_for(place_m - self.origin);
        let beside_m = (self.tip_at(position) - place_m).norm();
        if beside_m <= self.tolerance_m {
            Ok(position)
        } else {
            Err(UnreachableSite { place_m: place_m.into(), beside_m, tolerance_m: self.tolerance_m })
        }
    }
}

/// How a force sensor lies in the phantom frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorMounting {
    /// Turns the sensor's axes into those of the phantom frame.
    pub to_phantom: Mat3,
    /// Centre of the tip's face from the sensor's origin, in the sensor's frame (m).
    pub tip_m: Vec3,
    /// Whether the sensor reads what the tip feels; then the phantom feels the opposite.
    pub reads_reaction: bool,
}

impl SensorMounting {
    /// Largest deviation of a rotation from orthogonality that rounding in a file explains.
    const ROUNDING: f64 = 1e-6;

    /// Whether `to_phantom` is a rotation: orthogonal and right-handed.
    pub fn is_rotation(&self) -> bool {
        let product = self.to_phantom * self.to_phantom.transpose();
        (product - Mat3::identity()).amax() < Self::ROUNDING && self.to_phantom.determinant() > 0.0
    }

    /// Force (N) and moment about the centre of the tip (N·m) that the tip exerts on the phantom, in the phantom frame, from a
    /// wrench about the sensor's origin in its own frame.
    pub fn on_phantom(&self, wrench: [f64; 6]) -> (Vec3, Vec3) {
        let force = Vec3::new(wrench[0], wrench[1], wrench[2]);
        let torque = Vec3::new(wrench[3], wrench[4], wrench[5]) - self.tip_m.cross(&force);
        (self.to_phantom * force * self.sign(), self.to_phantom * torque * self.sign())
    }

    /// What the sensor reads while the tip exerts a force (N) on the phantom and a moment about its centre (N·m), in the phantom frame:
    /// the way back.
    pub fn sensed(&self, wrench: [f64; 6]) -> [f64; 6] {
        let back = self.to_phantom.transpose() * self.sign();
        let force = back * Vec3::new(wrench[0], wrench[1], wrench[2]);
        let torque = back * Vec3::new(wrench[3], wrench[4], wrench[5]) + self.tip_m.cross(&force);
        [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    }

    fn sign(&self) -> f64 {
        if self.reads_reaction { -1.0 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Axes 60° apart, so that position and projection differ.
    #[test]
    fn positions_and_places_are_inverse_also_for_skew_axes() {
        let half = 0.5_f64;
        let mounting =
            Mounting::new([0.01, 0.05, 0.03], [[2.0, 0.0, 0.0], [half, 0.0, -0.75_f64.sqrt()]], 1e-4)
                .expect("two axes");
        let position = [0.04, 0.007];
        let back = mounting.position_for(mounting.tip_at(position)).expect("in the plane");
        assert!((back[0] - position[0]).abs() < 1e-15 && (back[1] - position[1]).abs() < 1e-15);
    }

    #[test]
    fn a_place_beside_the_plane_is_not_reached() {
        let mounting =
            Mounting::new([0.0, 0.05, 0.03], [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 1e-4).expect("two axes");
        let missed = mounting.position_for(Vec3::new(0.02, 0.053, 0.025)).expect_err("3 mm beside");
        assert!((missed.beside_m - 0.003).abs() < 1e-15);
        assert!(missed.to_string().contains("lies 3.00 mm beside"), "{missed}");
        assert_eq!(Mounting::new([0.0; 3], [[1.0, 0.0, 0.0], [0.9, 0.1, 0.0]], 1e-4), None);
    }

    /// A force at the tip, 40 mm below the sensor's origin, makes a moment there and none about the tip.
    #[test]
    fn the_moment_is_taken_about_the_tip() {
        let turned = Mat3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let mounting =
            SensorMounting { to_phantom: turned, tip_m: Vec3::new(0.0, 0.0, 0.04), reads_reaction: true };
        assert!(mounting.is_rotation());
        let force = Vec3::new(0.3, 0.0, -1.0);
        let torque = mounting.tip_m.cross(&force);
        let (f, m) = mounting.on_phantom([force.x, force.y, force.z, torque.x, torque.y, torque.z]);
        assert!((f - Vec3::new(0.0, -0.3, 1.0)).norm() < 1e-15);
        assert!(m.norm() < 1e-15);
        let back = mounting.sensed([f.x, f.y, f.z, m.x, m.y, m.z]);
        let felt = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        assert!(back.iter().zip(felt).all(|(a, b)| (a - b).abs() < 1e-15), "{back:?}");
        assert!(!SensorMounting { to_phantom: -turned, ..mounting }.is_rotation());
    }
}
