//! What does a plan have to know of the bench: where things are, how they may move, what may press on what, and what is recorded.

use crate::acquire::live::LiveForce;
use crate::acquire::run::QUICK_LOOK;
use crate::device::{AXES, Mounting, SensorMounting, StageLimits};
use crate::geometry::Vec3;

/// The bench as a plan sees it. Lengths in metres, places in the phantom frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// What the stage may be asked to do.
    pub limits: StageLimits,
    /// Where its axes point; the second one leads straight into the phantom, or straight out of it.
    pub mounting: Mounting,
    /// Radius of the tip's face (m).
    pub tip_radius_m: f64,
    /// Where the phantom is.
    pub phantom: PhantomBox,
    /// How far a site may lie from the phantom's surface, and what keeps clear of it by less is taken to touch it (m).
    pub surface_tolerance_m: f64,
    /// Height above the surface at which the tip moves aside and rests (m).
    pub clearance_m: f64,
    /// Height above the surface at which the approach ends and the poke's own speed begins (m).
    pub run_up_m: f64,
    /// Speed of moves from place to place (m/s).
    pub travel_speed_m_s: f64,
    /// Speed from the clearance down to the run-up (m/s).
    pub approach_speed_m_s: f64,
    /// Acceleration and deceleration of every motion (m/s²).
    pub acceleration_m_s2: f64,
    /// Deceleration when the stage is stopped on the way (m/s²).
    pub stop_deceleration_m_s2: f64,
    /// What passes between a force and the start of the stop.
    pub latency: Latency,
    /// What the sensor may feel and what it can measure.
    pub load: LoadLimits,
    /// Least and greatest stiffness that the tip may meet (N/m); [`pad_stiffness_n_per_m`](super::pad_stiffness_n_per_m) estimates it.
    pub stiffness_n_per_m: [f64; 2],
    /// The least time between the end of one contact and the start of the next (s).
    pub least_rest_s: f64,
    /// What is recorded all the time.
    pub streams: Vec<Stream>,
}

/// A box along the axes of the phantom frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhantomBox {
    /// Lowest corner (m).
    pub low_m: [f64; 3],
    /// Highest corner (m).
    pub high_m: [f64; 3],
}

/// Parts of the time between a force and the start of the stop (s), each the longest that is counted on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Latency {
    /// From the force to the datagram.
    pub sensor_s: f64,
    /// From the datagram to the stop on its way.
    pub host_s: f64,
    /// From there to the motors.
    pub serial_s: f64,
}

impl Latency {
    /// All of it (s).
    pub fn total_s(&self) -> f64 {
        self.sensor_s + self.host_s + self.serial_s
    }
}

/// What the force sensor may feel, and what it can measure, in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadLimits {
    /// How the sensor lies.
    pub sensor: SensorMounting,
    /// Force along each axis at which the stage is stopped (N).
    pub force_n: [f64; 3],
    /// Torque about each axis at which the stage is stopped (N·m).
    pub torque_nm: f64,
    /// Largest force (N) and torque (N·m) of the sensor's calibration.
    pub range: [f64; 6],
}

impl LoadLimits {
    /// Limits of all channels (N, N·m).
    pub(super) fn limits(&self) -> [f64; 6] {
        std::array::from_fn(|i| if i < 3 { self.force_n[i] } else { self.torque_nm })
    }

    /// What each channel feels of 1 N at the tip's centre along `direction` of the phantom frame, without sign (1, m).
    pub(super) fn share(&self, direction: Vec3) -> [f64; 6] {
        let force = self.sensor.to_phantom.transpose() * direction;
        let torque = self.sensor.tip_m.cross(&force);
        std::array::from_fn(|i| if i < 3 { force[i] } else { torque[i - 3] }.abs())
    }
}

/// Something that is recorded at a steady rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stream {
    /// What it is.
    pub name: &'static str,
    /// How often (1/s).
    pub rate_hz: f64,
    /// How much each time, as it is stored (bytes).
    pub bytes: f64,
}

/// The face of the phantom that the tip looks at, and lines through the phantom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Face {
    /// Axis of its normal.
    pub(super) axis: usize,
    /// Unit vector into the phantom.
    pub(super) inward: Vec3,
    /// Where it lies along the axis (m).
    at_m: f64,
}

/// Share of what an axis may go: a motion sets out from where the steps of the stage are, so that its axes share it a little otherwise than
/// planned.
const SHARE: f64 = 0.99;
/// No way at all (m).
const NO_WAY_M: f64 = 1e-9;

impl Bench {
    /// Straight in: along the second axis, towards the phantom from where the tip is with the stage at zero.
    pub fn tip_axis(&self) -> Vec3 {
        let mut up = [0.0; AXES];
        up[AXES - 1] = 1.0;
        let along = self.mounting.moved_by(up);
        let middle = (Vec3::from(self.phantom.low_m) + Vec3::from(self.phantom.high_m)) * 0.5;
        let ahead = (middle - self.mounting.tip_at([0.0; AXES])).dot(&along);
        if ahead < 0.0 { -along } else { along }
    }

    /// Height of a place above the face that the tip looks at (m), negative inside.
    pub(in crate::acquire) fn height_m(&self, place: Vec3) -> f64 {
        let face = self.face();
        (face.at_m - place[face.axis]) * face.inward[face.axis]
    }

    /// How much lower the tip gets for each metre that the stage goes along a direction of its own.
    pub(in crate::acquire) fn descends(&self, along: [f64; AXES]) -> f64 {
        self.mounting.moved_by(along).dot(&self.face().inward)
    }

    /// A speed in the phantom frame on a way of the stage (m), or as much of it as each axis may go: for ways on which the speed is nobody's
    /// wish.
    pub(in crate::acquire) fn allowed_m_s(&self, way_m: [f64; AXES], most_m_s: f64) -> f64 {
        let length_m = self.mounting.moved_by(way_m).norm();
        let axes = self.limits.speed_m_s.into_iter().zip(way_m).filter(|(_, way)| way.abs() > NO_WAY_M);
        axes.map(|(limit, way)| SHARE * limit * length_m / way.abs()).fold(most_m_s, f64::min)
    }

    /// The face that the tip looks at.
    pub(super) fn face(&self) -> Face {
        let tip = self.tip_axis();
        let axis = tip.iamax();
        let mut inward = Vec3::zeros();
        inward[axis] = tip[axis].signum();
        let side = if tip[axis] > 0.0 { self.phantom.low_m } else { self.phantom.high_m };
        Face { axis, inward, at_m: side[axis] }
    }

    /// Half of the tip's face's extent along each axis (m).
    pub(super) fn tip_extent(&self) -> Vec3 {
        let normal = self.tip_axis();
        normal.map(|n| self.tip_radius_m * (1.0 - n * n).max(0.0).sqrt())
    }

    /// Whether the tip, its face's extent taken for a box, comes closer to the phantom than the tolerance on a straight line.
    pub(super) fn ploughs(&self, from: Vec3, to: Vec3) -> bool {
        // The tip's box against the phantom's is the tip's centre against one that is larger by both.
        let grown = self.tip_extent().add_scalar(self.surface_tolerance_m);
        let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
        for axis in 0..3 {
            let low = self.phantom.low_m[axis] - grown[axis];
            let high = self.phantom.high_m[axis] + grown[axis];
            let way = to[axis] - from[axis];
            if way == 0.0 {
                if from[axis] <= low || from[axis] >= high {
                    return false;
                }
                continue;
            }
            let (a, b) = ((low - from[axis]) / way, (high - from[axis]) / way);
            enters = enters.max(a.min(b));
            leaves = leaves.min(a.max(b));
        }
        enters < leaves
    }

    /// How far a line from `site` along `direction` goes until it leaves the phantom (m).
    pub(super) fn thickness_m(&self, site: Vec3, direction: Vec3) -> f64 {
        let out = |axis: usize| {
            let side = if direction[axis] > 0.0 { self.phantom.high_m } else { self.phantom.low_m };
            if direction[axis] == 0.0 { f64::INFINITY } else { (side[axis] - site[axis]) / direction[axis] }
        };
        (0..3).map(out).fold(f64::INFINITY, f64::min)
    }

    /// Distance that the stage still goes when it is to be stopped at this speed (m): `v t + v² / 2a`.
    pub(super) fn overshoot_m(&self, speed_m_s: f64) -> f64 {
        speed_m_s * self.latency.total_s() + speed_m_s * speed_m_s / (2.0 * self.stop_deceleration_m_s2)
    }

    /// Distance that the stage still goes when a press has reached the force that ends it (m): the force is a mean over some time, is looked at
    /// now and then, and the stage comes to rest as after any motion.
    pub(super) fn past_force_m(&self, speed_m_s: f64) -> f64 {
        let known_s = self.latency.total_s() + LiveForce::MEAN.as_secs_f64() + QUICK_LOOK.as_secs_f64();
        speed_m_s * known_s + speed_m_s * speed_m_s / (2.0 * self.acceleration_m_s2)
    }
}
