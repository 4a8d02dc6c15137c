//! Which host time belongs to a device's own count: a straight line under all arrivals.
//!
//! Bytes arrive late, never early, and how late varies. So of all lines t_host = a + b t_device that no arrival lies below, the one
//! closest to the arrivals in the mean is the device's clock plus its smallest delay. It is an edge of the lower convex hull: the one
//! under the mean of the device times (the linear programme of Moon, Skelly & Towsley 1999, eq. 4, solved on the hull).

/// How a device's clock runs against the host's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceClock {
    /// A device time in the middle (s) and its host time (s).
    middle: [f64; 2],
    /// Host seconds in one second of the device.
    rate: f64,
}

impl DeviceClock {
    /// From pairs of device time and host time of arrival (s), device times ascending. `None` with fewer than two different device
    /// times.
    pub fn from_arrivals(pairs: &[[f64; 2]]) -> Option<Self> {
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for &p in pairs {
            if let Some(last) = hull.last_mut().filter(|last| last[0] == p[0]) {
                last[1] = last[1].min(p[1]);
                continue;
            }
            while let [.., a, b] = hull[..] {
                // b stays only if it lies below the line from a to p.
                let above = (b[1] - a[1]) * (p[0] - a[0]) >= (p[1] - a[1]) * (b[0] - a[0]);
                if !above {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        let mean = pairs.iter().map(|p| p[0]).sum::<f64>() / pairs.len() as f64;
        let after = hull.partition_point(|p| p[0] < mean).clamp(1, hull.len().max(2) - 1);
        let (a, b) = (hull.get(after - 1)?, hull.get(after)?);
        Some(Self { middle: *a, rate: (b[1] - a[1]) / (b[0] - a[0]) })
    }

    /// Host time (s) of a device time (s).
    pub fn host_s(&self, device_s: f64) -> f64 {
        self.middle[1] + self.rate * (device_s - self.middle[0])
    }

    /// Host seconds in one second of the device.
    pub fn rate(&self) -> f64 {
        self.rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clock 40 ppm slow behind delays of 1 ms and more that only sometimes are as short.
    #[test]
    fn late_arrivals_do_not_move_the_line() {
        let (rate, offset) = (1.0 + 4e-5, 17.0);
        let pairs: Vec<[f64; 2]> = (0..2000)
            .map(|n| {
                let device = f64::from(n) * 0.01;
                let delay = 1e-3 + if n % 7 == 0 { 0.0 } else { 2e-4 * f64::from(n % 50) };
                [device, offset + rate * device + delay]
            })
            .collect();
        let clock = DeviceClock::from_arrivals(&pairs).expect("a line");
        assert!((clock.rate() - rate).abs() < 1e-9, "{}", clock.rate());
        assert!((clock.host_s(10.0) - (offset + rate * 10.0 + 1e-3)).abs() < 1e-9);
        assert!(pairs.iter().all(|p| clock.host_s(p[0]) <= p[1] + 1e-9));
    }

    #[test]
    fn one_time_is_no_clock() {
        assert_eq!(DeviceClock::from_arrivals(&[]), None);
        assert_eq!(DeviceClock::from_arrivals(&[[1.0, 2.0], [1.0, 3.0]]), None);
        let two = DeviceClock::from_arrivals(&[[1.0, 2.0], [1.0, 1.5], [3.0, 4.0]]).expect("a line");
        assert_eq!((two.host_s(1.0), two.host_s(3.0)), (1.5, 4.0));
    }
}
