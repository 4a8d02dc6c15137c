//! How long does a motion take, and when is it where? A straight line from rest to rest with equal acceleration and deceleration.
//!
//! With length `L`, speed `v` and acceleration `a`: if `L ≥ v²/a` the speed is reached and `T = L/v + v/a`; otherwise the profile is a
//! triangle, `T = 2 √(L/a)`, with the highest speed `√(L a)`.

/// A motion of some length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trapezoid {
    length_m: f64,
    peak_m_s: f64,
    acceleration_m_s2: f64,
}

impl Trapezoid {
    /// `length_m` is not negative, speed and acceleration are positive.
    pub fn new(length_m: f64, speed_m_s: f64, acceleration_m_s2: f64) -> Self {
        let peak_m_s = speed_m_s.min((length_m * acceleration_m_s2).sqrt());
        Self { length_m, peak_m_s, acceleration_m_s2 }
    }

    /// Time from rest to rest (s).
    pub fn duration_s(&self) -> f64 {
        if self.length_m <= 0.0 {
            return 0.0;
        }
        self.length_m / self.peak_m_s + self.peak_m_s / self.acceleration_m_s2
    }

    /// The highest speed on the way (m/s).
    pub fn peak_m_s(&self) -> f64 {
        self.peak_m_s
    }

    /// When so much of the way is done (s); not before the start and not after the end.
    pub fn time_at(&self, distance_m: f64) -> f64 {
        if distance_m > 0.5 * self.length_m {
            return self.duration_s() - self.early(self.length_m - distance_m);
        }
        self.early(distance_m)
    }

    /// [`Trapezoid::time_at`] in the first half of the way.
    fn early(&self, distance_m: f64) -> f64 {
        let distance_m = distance_m.max(0.0);
        let ramp_m = 0.5 * self.peak_m_s * self.peak_m_s / self.acceleration_m_s2;
        if distance_m <= ramp_m {
            (2.0 * distance_m / self.acceleration_m_s2).sqrt()
        } else {
            self.peak_m_s / self.acceleration_m_s2 + (distance_m - ramp_m) / self.peak_m_s
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance after `t`, by summing the speed over small steps.
    fn summed(motion: &Trapezoid, t: f64) -> f64 {
        let steps = 200_000;
        let step = t / f64::from(steps);
        let speed = |t: f64| {
            let ramps = motion.acceleration_m_s2 * t.min(motion.duration_s() - t);
            ramps.clamp(0.0, motion.peak_m_s)
        };
        (0..steps).map(|i| speed((f64::from(i) + 0.5) * step) * step).sum()
    }

    #[test]
    fn a_long_motion_is_a_trapezoid_and_a_short_one_a_triangle() {
        // 20 mm at 4 mm/s and 10 mm/s²: 5 s, and 0.4 s for the ramps.
        let long = Trapezoid::new(0.02, 0.004, 0.01);
        assert!((long.duration_s() - 5.4).abs() < 1e-12);
        assert_eq!(long.peak_m_s(), 0.004);
        // 0.4 mm never reaches 4 mm/s: 2 √(0.4/10) = 0.4 s, 2 mm/s.
        let short = Trapezoid::new(4e-4, 0.004, 0.01);
        assert!((short.duration_s() - 0.4).abs() < 1e-12);
        assert!((short.peak_m_s() - 0.002).abs() < 1e-15);
        // On the border both forms agree.
        let border = Trapezoid::new(1.6e-3, 0.004, 0.01);
        assert!((border.duration_s() - 0.8).abs() < 1e-12);
        assert_eq!(Trapezoid::new(0.0, 0.004, 0.01).duration_s(), 0.0);
    }

    #[test]
    fn times_on_the_way_are_those_of_the_summed_speed() {
        for motion in [Trapezoid::new(0.02, 0.004, 0.01), Trapezoid::new(4e-4, 0.004, 0.01)] {
            for share in [0.01, 0.2, 0.5, 0.7, 0.99, 1.0] {
                let distance = share * motion.length_m;
                let reached = summed(&motion, motion.time_at(distance));
                assert!((reached - distance).abs() < 1e-6 * motion.length_m, "{share}: {reached} {distance}");
            }
        }
    }
}
