//! How far along its path a motion is: speed goes up and down in straight lines.
//!
//! Any consistent unit of length; seconds. A trapezoid of length L, top speed v and acceleration a lasts L/v + v/a when L ≥ v²/a, else
//! (a triangle) 2 √(L/a).

/// A stretch of constant acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Phase {
    duration: f64,
    speed: f64,
    acceleration: f64,
}

impl Phase {
    fn length(&self) -> f64 {
        self.at(self.duration).0
    }

    /// Distance and speed after `t`.
    fn at(&self, t: f64) -> (f64, f64) {
        ((self.speed + 0.5 * self.acceleration * t) * t, self.speed + self.acceleration * t)
    }

    /// When `distance` is reached; within the phase.
    fn when(&self, distance: f64) -> f64 {
        let (v, a) = (self.speed, self.acceleration);
        let root = (v * v + 2.0 * a * distance).max(0.0).sqrt();
        // The form without cancellation; at rest and at distance 0 it is 0/0.
        if v + root > 0.0 { (2.0 * distance / (v + root)).min(self.duration) } else { 0.0 }
    }
}

/// A motion along a straight path, ending at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Profile {
    phases: [Phase; 3],
}

impl Profile {
    /// From rest to rest.
    pub(super) fn trapezoid(length: f64, top: f64, acceleration: f64) -> Self {
        let peak = top.min((length * acceleration).sqrt());
        let ramp = peak / acceleration;
        let cruise = ((length - peak * ramp) / peak).max(0.0);
        Self {
            phases: [
                Phase { duration: ramp, speed: 0.0, acceleration },
                Phase { duration: cruise, speed: peak, acceleration: 0.0 },
                Phase { duration: ramp, speed: peak, acceleration: -acceleration },
            ],
        }
    }

    /// From a speed to rest.
    pub(super) fn braking(speed: f64, acceleration: f64) -> Self {
        let rest = Phase { duration: 0.0, speed: 0.0, acceleration: 0.0 };
        let brake = Phase { duration: speed / acceleration, speed, acceleration: -acceleration };
        Self { phases: [brake, rest, rest] }
    }

    pub(super) fn duration(&self) -> f64 {
        self.phases.iter().map(|phase| phase.duration).sum()
    }

    pub(super) fn length(&self) -> f64 {
        self.phases.iter().map(Phase::length).sum()
    }

    /// Distance and speed after `t`.
    pub(super) fn at(&self, mut t: f64) -> (f64, f64) {
        let mut done = 0.0;
        for phase in &self.phases {
            if t < phase.duration {
                let (distance, speed) = phase.at(t.max(0.0));
                return (done + distance, speed);
            }
            t -= phase.duration;
            done += phase.length();
        }
        (done, 0.0)
    }

    /// When `distance` is reached.
    pub(super) fn when(&self, mut distance: f64) -> f64 {
        let mut t = 0.0;
        for phase in &self.phases {
            let length = phase.length();
            if distance < length {
                return t + phase.when(distance.max(0.0));
            }
            distance -= length;
            t += phase.duration;
        }
        t
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn duration_and_length_are_those_of_a_trapezoid_and_a_triangle() {
        let long = Profile::trapezoid(10.0, 5.0, 20.0);
        assert!((long.duration() - (10.0 / 5.0 + 5.0 / 20.0)).abs() < 1e-12);
        let short = Profile::trapezoid(0.2, 5.0, 20.0);
        assert!((short.duration() - 2.0 * (0.2_f64 / 20.0).sqrt()).abs() < 1e-12);
        for (profile, length) in [(long, 10.0), (short, 0.2)] {
            assert!((profile.length() - length).abs() < 1e-12);
            let (middle, peak) = profile.at(0.5 * profile.duration());
            assert!((middle - 0.5 * length).abs() < 1e-12 && peak > 0.0);
            assert_eq!(profile.at(2.0 * profile.duration()).1, 0.0);
        }
    }

    #[test]
    fn when_is_the_inverse_of_at() {
        for profile in [Profile::trapezoid(10.0, 5.0, 20.0), Profile::braking(3.0, 4.0)] {
            for k in 1..40 {
                let distance = profile.length() * f64::from(k) / 40.0;
                assert!((profile.at(profile.when(distance)).0 - distance).abs() < 1e-9);
            }
        }
        // v²/2a.
        assert!((Profile::braking(3.0, 4.0).length() - 9.0 / 8.0).abs() < 1e-12);
    }
}
