//! What a two-axis linear stage is: where it can go, how it is told to, what it reports, how it is stopped.

use super::{ClockComparison, DeviceError};
use crate::clock::HostTime;
use std::time::Duration;

/// Axes of a stage.
pub const AXES: usize = 2;

/// Who answers behind the port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageIdentity {
    /// Kind of controller, such as `Grbl 1.1h`.
    pub controller: String,
    /// Version or hash of the firmware, as it reports it.
    pub firmware: String,
    /// The port, as it was opened.
    pub port: String,
}

/// What the stage may be asked to do. Metres from where it homes, along each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageLimits {
    /// Lowest and highest position of each axis (m).
    pub travel_m: [[f64; 2]; AXES],
    /// Highest speed of each axis (m/s).
    pub speed_m_s: [f64; AXES],
    /// Highest acceleration of each axis (m/s²).
    pub acceleration_m_s2: [f64; AXES],
    /// Smallest step of each axis (m).
    pub step_m: [f64; AXES],
}

impl StageLimits {
    /// The first axis on which `position_m` lies outside the travel, if any.
    pub fn outside(&self, position_m: [f64; AXES]) -> Option<usize> {
        (0..AXES).find(|&axis| {
            let [low, high] = self.travel_m[axis];
            // A position that is no number lies outside.
            !(low..=high).contains(&position_m[axis])
        })
    }
}

/// How the stage comes to rest when it is stopped on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stopping {
    /// How long it goes on as before, at most, once the stop has reached the controller.
    pub delay: Duration,
    /// Deceleration along the path after that, at least (m/s²).
    pub deceleration_m_s2: f64,
}

/// A motion in a straight line from where the stage stands, with a trapezoidal profile of speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Where to (m).
    pub target_m: [f64; AXES],
    /// Speed along the line (m/s).
    pub speed_m_s: f64,
    /// Acceleration and deceleration along the line (m/s²).
    pub acceleration_m_s2: f64,
}

/// What the stage is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StageState {
    /// Standing, ready.
    Idle,
    /// On its way.
    Moving,
    /// Looking for its switches.
    Homing,
    /// Latched after something went wrong; it moves again only after [`Stage::clear`]. The code is the controller's own.
    Fault {
        /// The controller's code for the cause (`ALARM:n` of Grbl, the fault code of the own protocol).
        code: u8,
    },
}

/// Where the stage is and what it is doing, as it says itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageReport {
    /// When its bytes had arrived.
    pub host: HostTime,
    /// The controller's own time (µs, wraps at 2³²), when it tells one.
    pub tick_us: Option<u32>,
    /// Position (m).
    pub position_m: [f64; AXES],
    /// What it is doing.
    pub state: StageState,
    /// Whether its position can be trusted: it has homed, and nothing has happened since that could have lost steps.
    pub homed: bool,
}

/// A two-axis linear stage.
pub trait Stage: Send {
    /// Who answers.
    fn identity(&self) -> &StageIdentity;

    /// What it may be asked to do.
    fn limits(&self) -> &StageLimits;

    /// How it comes to rest when it is stopped; none where it cannot be known.
    fn stopping(&self) -> Option<Stopping>;

    /// Starts homing; the reports say when it is done.
    ///
    /// # Errors
    /// [`DeviceError`]: refused, silent, lost, reset, latched.
    fn home(&mut self) -> Result<(), DeviceError>;

    /// Starts a motion; the reports say when it is done. It is checked against the limits here, whatever the controller checks.
    ///
    /// # Errors
    /// [`DeviceError`]: outside the limits, not homed, busy, refused, silent, lost, reset, latched. A motion that was refused
    /// does not happen.
    fn move_to(&mut self, motion: Motion) -> Result<(), DeviceError>;

    /// Brings the stage to rest by decelerating; the reports say when it stands. Standing stages stay.
    ///
    /// # Errors
    /// [`DeviceError`]: silent, lost, reset.
    fn stop(&mut self) -> Result<(), DeviceError>;

    /// Clears a latched fault, once a person has agreed to it. Does not move anything.
    ///
    /// # Errors
    /// [`DeviceError`]: the cause persists, silent, lost, reset.
    fn clear(&mut self) -> Result<(), DeviceError>;

    /// The next report, or none when there was none until `until`. To be called again and again while a motion runs: it is what
    /// tells the controller that somebody is still there.
    ///
    /// # Errors
    /// [`DeviceError`]: silent for longer than the driver's budget, lost, reset without having been asked to.
    fn report(&mut self, until: HostTime) -> Result<Option<StageReport>, DeviceError>;

    /// Asks the controller for its clock; none where it tells no time.
    ///
    /// # Errors
    /// [`DeviceError`]: silent, lost, reset.
    fn compare_clocks(&mut self) -> Result<Option<ClockComparison>, DeviceError>;

    /// What a fault's code means, for people.
    fn meaning(&self, code: u8) -> String;

    /// What its line has suffered so far, counted, by name; nothing where nobody counts. For the record: what has to be acted on is an error.
    fn line_counts(&self) -> Vec<(&'static str, u64)> {
        Vec::new()
    }

    /// A second way to the stage, for whoever has to stop it while it is being talked to.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] when the port cannot be opened twice.
    fn stopper(&self) -> Result<Box<dyn Stopper>, DeviceError>;
}

/// Stops a stage from any thread. Nothing in it allocates, waits for a reply, or takes a lock that another thread holds while it waits.
pub trait Stopper: Send + Sync {
    /// Sends the bytes that stop the stage at once; returns when they were handed to the operating system. The stage latches: it
    /// moves again only after [`Stage::clear`].
    ///
    /// # Errors
    /// What the operating system says.
    fn stop_now(&self) -> std::io::Result<HostTime>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_outside_the_travel_is_found_by_axis() {
        let limits = StageLimits {
            travel_m: [[0.0, 0.2], [-0.03, 0.0]],
            speed_m_s: [0.05; 2],
            acceleration_m_s2: [0.5; 2],
            step_m: [1e-6; 2],
        };
        assert_eq!(limits.outside([0.2, 0.0]), None);
        assert_eq!(limits.outside([0.2001, 0.0]), Some(0));
        assert_eq!(limits.outside([0.1, -0.0301]), Some(1));
        assert_eq!(limits.outside([0.1, f64::NAN]), Some(1));
    }
}
