//! How noisy each channel was while nothing touched the phantom: standard deviations measured over the rest
//! interval, beside what the operator states. SI units.

use crate::observation::Recording;

/// Noise of one channel along x, y and z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelNoise {
    /// What the operator states (1 sigma).
    pub stated: [f64; 3],
    /// Sample standard deviation about the mean at rest; for markers about each marker's own mean, pooled.
    pub measured: [f64; 3],
    /// Degrees of freedom behind it: rows less means taken out.
    pub degrees_of_freedom: usize,
}

/// Noise of all channels at rest; `None` for a channel with fewer than two rows there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestNoise {
    /// Force (N).
    pub force: Option<ChannelNoise>,
    /// Torque (N·m).
    pub torque: Option<ChannelNoise>,
    /// Marker position (m).
    pub marker: Option<ChannelNoise>,
    /// Stage displacement (m); `None` also without a stage.
    pub stage: Option<ChannelNoise>,
}

impl RestNoise {
    /// The channels that could be measured, with their names.
    pub fn channels(&self) -> impl Iterator<Item = (&'static str, ChannelNoise)> {
        [("force", self.force), ("torque", self.torque), ("marker", self.marker), ("stage", self.stage)]
            .into_iter()
            .filter_map(|(name, noise)| noise.map(|n| (name, n)))
    }
}

impl ChannelNoise {
    /// Measured over stated, along x, y and z.
    pub fn ratio(&self) -> [f64; 3] {
        std::array::from_fn(|i| self.measured[i] / self.stated[i])
    }
}

/// Measures the noise of every channel over the rows before [`Recording::rest_until_s`].
pub fn rest_noise(recording: &Recording) -> RestNoise {
    let noise = &recording.noise;
    let until = |time_s: &[f64]| time_s.partition_point(|&t| t < recording.rest_until_s);
    let wrench = &recording.wrench;
    let rows = until(&wrench.time_s);
    RestNoise {
        force: one_mean(&wrench.force_n[..rows], noise.force_n),
        torque: one_mean(&wrench.torque_nm[..rows], noise.torque_nm),
        marker: marker_noise(recording),
        stage: recording
            .stage
            .as_ref()
            .and_then(|s| one_mean(&s.displacement_m[..until(&s.time_s)], noise.stage_m)),
    }
}

fn one_mean(rows: &[[f64; 3]], stated: [f64; 3]) -> Option<ChannelNoise> {
    let degrees_of_freedom = rows.len().checked_sub(1).filter(|&d| d > 0)?;
    let measured = std::array::from_fn(|i| {
        let mean = rows.iter().map(|r| r[i]).sum::<f64>() / rows.len() as f64;
        (rows.iter().map(|r| (r[i] - mean).powi(2)).sum::<f64>() / degrees_of_freedom as f64).sqrt()
    });
    Some(ChannelNoise { stated, measured, degrees_of_freedom })
}

fn marker_noise(recording: &Recording) -> Option<ChannelNoise> {
    let rest = recording.rest_positions();
    let markers = &recording.markers;
    let mut squares = [0.0; 3];
    let mut rows = 0_usize;
    for row in &markers.rows {
        if markers.frame_time_s[row.frame as usize] >= recording.rest_until_s {
            break;
        }
        let mean = rest[row.marker as usize].0;
        for i in 0..3 {
            squares[i] += (row.position_m[i] - mean[i]).powi(2);
        }
        rows += 1;
    }
    let means = rest.iter().filter(|(_, count)| *count > 0).count();
    let degrees_of_freedom = rows.checked_sub(means).filter(|&d| d > 0)?;
    Some(ChannelNoise {
        stated: recording.noise.marker_m,
        measured: squares.map(|s| (s / degrees_of_freedom as f64).sqrt()),
        degrees_of_freedom,
    })
}
