//! Instruments with known faults, made up without any code of the program: what a bench would have written into its tables.

/// Normal numbers: SplitMix64 (Steele, Lea and Flood 2014) through the polar method of Marsaglia.
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678)
    }

    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        loop {
            let (u, v) = (2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0);
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                return u * (-2.0 * s.ln() / s).sqrt();
            }
        }
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A force sensor and the weights that hang on it. SI.
pub(crate) struct ForceBench {
    pub(crate) sensitivity: [[f64; 6]; 6],
    pub(crate) bias: [f64; 6],
    pub(crate) drift_per_s: [f64; 6],
    pub(crate) noise: [f64; 6],
    pub(crate) mass_share: f64,
    pub(crate) scale_share: f64,
    pub(crate) direction_rad: f64,
    pub(crate) lever_m: f64,
}

/// What stands in one row of a table of weights.
#[derive(Clone, Copy)]
pub(crate) struct WeightRow {
    pub(crate) time_s: f64,
    pub(crate) mass_kg: f64,
    pub(crate) direction: [f64; 3],
    pub(crate) lever_m: [f64; 3],
    pub(crate) reading: [f64; 6],
}

impl ForceBench {
    /// Gains, cross-talk and a turn of some per cent; half a gram of noise.
    pub(crate) fn new(dice: &mut Dice) -> Self {
        let mut sensitivity = [[0.0; 6]; 6];
        for (i, row) in sensitivity.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                // A moment in N·m answers to a force in N with metres, and the other way round.
                let size = match (i < 3, j < 3) {
                    (true, false) => 0.2,
                    (false, true) => 2e-4,
                    _ => 0.02,
                };
                *value = f64::from(u8::from(i == j)) + size * dice.normal();
            }
        }
        Self {
            sensitivity,
            bias: [0.3, -0.2, 1.5, 0.01, -0.02, 0.005],
            drift_per_s: [2e-5, 0.0, -4e-5, 1e-7, 0.0, 0.0],
            noise: [5e-3, 5e-3, 5e-3, 1e-4, 1e-4, 1e-4],
            mass_share: 5e-4,
            scale_share: 1e-3,
            direction_rad: 2e-3,
            lever_m: 1e-4,
        }
    }

    /// Three weights at twelve places, and nothing between them.
    pub(crate) fn table(&self, dice: &mut Dice) -> Vec<WeightRow> {
        let d = 0.6_f64;
        let places = [
            ([0.0, 0.0, -1.0], [0.0, 0.0, 0.0]),
            ([0.0, 0.0, -1.0], [0.05, 0.0, 0.0]),
            ([0.0, 0.0, -1.0], [0.0, 0.05, 0.0]),
            ([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
            ([1.0, 0.0, 0.0], [0.0, 0.0, 0.04]),
            ([1.0, 0.0, 0.0], [0.0, 0.05, 0.0]),
            ([-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
            ([0.0, 1.0, 0.0], [0.0, 0.0, 0.04]),
            ([0.0, 1.0, 0.0], [0.05, 0.0, 0.0]),
            ([0.0, -1.0, 0.0], [0.0, 0.0, 0.0]),
            ([d, 0.0, -0.8], [0.0, 0.05, 0.0]),
            ([0.0, d, -0.8], [0.05, 0.0, 0.0]),
        ];
        let masses = [0.05, 0.1, 0.2];
        let scale = 1.0 + self.scale_share * dice.normal();
        let true_masses = masses.map(|m| m * (1.0 + self.mass_share * dice.normal()));
        let mut rows = Vec::new();
        for (direction, lever) in places {
            let turn = [0; 3].map(|_| self.direction_rad * dice.normal());
            let aside = cross(turn, direction);
            let pull: [f64; 3] = std::array::from_fn(|k| direction[k] + aside[k]);
            let point: [f64; 3] = std::array::from_fn(|k| lever[k] + self.lever_m * dice.normal());
            for (mass, true_mass) in [(0.0, 0.0)].into_iter().chain(masses.into_iter().zip(true_masses)) {
                // Weights of 8000 kg/m³ in air of 1.2 kg/m³.
                let newtons = scale * true_mass * 9.80665 * (1.0 - 0.00015);
                let force = pull.map(|p| p * newtons);
                let moment = cross(point, force);
                let wrench = [force[0], force[1], force[2], moment[0], moment[1], moment[2]];
                let time_s = 20.0 * rows.len() as f64;
                let reading = std::array::from_fn(|c| {
                    let answer: f64 = (0..6).map(|k| self.sensitivity[c][k] * wrench[k]).sum();
                    self.bias[c] + self.drift_per_s[c] * time_s + answer + self.noise[c] * dice.normal()
                });
                rows.push(WeightRow { time_s, mass_kg: mass, direction, lever_m: lever, reading });
            }
        }
        rows
    }
}

/// The table as a person would keep it.
pub(crate) fn weights_csv(rows: &[WeightRow]) -> String {
    let mut text =
        "time_s,mass_g,dir_x,dir_y,dir_z,lever_x_mm,lever_y_mm,lever_z_mm,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm\n"
            .to_owned();
    for row in rows {
        let lever = row.lever_m.map(|x| x * 1e3);
        let cells = [row.time_s, row.mass_kg * 1e3]
            .into_iter()
            .chain(row.direction)
            .chain(lever)
            .chain(row.reading)
            .map(|x| format!("{x:.6}"));
        text += &(cells.collect::<Vec<_>>().join(",") + "\n");
    }
    text
}

/// An axis with a wrong scale, a screw error, backlash and scatter. SI.
pub(crate) struct StageBench {
    pub(crate) scale: f64,
    pub(crate) screw_m: f64,
    pub(crate) pitch_m: f64,
    pub(crate) backlash_m: f64,
    pub(crate) backlash_varies_m: f64,
    pub(crate) scatter_m: f64,
}

impl StageBench {
    /// A usable one: 0.8 mm/m too long, with 15 µm of backlash.
    pub(crate) fn usual() -> Self {
        Self {
            scale: 8e-4,
            screw_m: 2e-6,
            pitch_m: 2e-3,
            backlash_m: 15e-6,
            backlash_varies_m: 1e-6,
            scatter_m: 1e-6,
        }
    }

    /// Rows of target, reading, whether it came from below, and run.
    pub(crate) fn table(&self, runs: u32, targets: &[f64], dice: &mut Dice) -> Vec<(f64, f64, bool, u32)> {
        let phase = 6.0 * dice.unit();
        let middle: Vec<f64> = targets
            .iter()
            .map(|t| {
                t * (1.0 + self.scale)
                    + self.screw_m * (t / self.pitch_m * std::f64::consts::TAU + phase).sin()
            })
            .collect();
        let half: Vec<f64> = targets
            .iter()
            .map(|_| 0.5 * (self.backlash_m + self.backlash_varies_m * dice.normal()))
            .collect();
        let mut rows = Vec::new();
        for run in 1..=runs {
            for up in [true, false] {
                let mut order: Vec<usize> = (0..targets.len()).collect();
                if !up {
                    order.reverse();
                }
                for i in order {
                    // It stays behind: short of the target from below, beyond it from above.
                    let reading =
                        middle[i] + if up { -half[i] } else { half[i] } + self.scatter_m * dice.normal();
                    rows.push((targets[i], reading, up, run));
                }
            }
        }
        rows
    }
}

/// The table as a person would keep it.
pub(crate) fn stage_csv(rows: &[(f64, f64, bool, u32)]) -> String {
    let mut text = "run,direction,target_mm,reading_mm\n".to_owned();
    for (target, reading, up, run) in rows {
        let direction = if *up { "up" } else { "down" };
        text += &format!("{run},{direction},{:.4},{:.5}\n", target * 1e3, reading * 1e3);
    }
    text
}

/// Position and force of a press on a block: nothing until contact, then a straight line.
pub(crate) fn press(contact_m: f64, slope_n_per_m: f64, noise_n: f64, dice: &mut Dice) -> Vec<(f64, f64)> {
    (0..60)
        .map(|k| {
            let z = 5e-6 * f64::from(k);
            let force = if z > contact_m { slope_n_per_m * (z - contact_m) } else { 0.0 };
            (z, 0.02 + force + noise_n * dice.normal())
        })
        .collect()
}

/// The table as a person would keep it.
pub(crate) fn press_csv(rows: &[(f64, f64)]) -> String {
    let mut text = "position_mm,force_n\n".to_owned();
    for (z, force) in rows {
        text += &format!("{:.6},{force:.6}\n", z * 1e3);
    }
    text
}
