//! One recording: a phantom, its pokes and what the instruments reported.

use crate::geometry::Vec3;
use crate::mesh::TetMesh;

/// A whole recording, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Name of the recording.
    pub name: String,
    /// Nothing touches the phantom before this time (s); markers seen until then define the rest positions.
    pub rest_until_s: f64,
    /// What the operator knows of the phantom.
    pub phantom: Phantom,
    /// The tip.
    pub tip: Tip,
    /// Instrument noise as the operator states it.
    pub noise: Noise,
    /// A marker farther than this (m) from the observed surface is refused.
    pub max_standoff_m: f64,
    /// The reference configuration.
    pub mesh: TetMesh,
    /// Pokes in order of time.
    pub pokes: Vec<Poke>,
    /// Tip displacement; absent when the wrench drives the model.
    pub stage: Option<Stage>,
    /// Wrench that the tip exerts on the phantom.
    pub wrench: Wrench,
    /// Marker positions.
    pub markers: Markers,
}

/// What the operator knows of the phantom before the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Phantom {
    /// Poisson's ratio, assumed.
    pub poisson_ratio: f64,
    /// Density (kg/m³).
    pub density_kg_m3: f64,
    /// Range in which the operator expects Young's modulus (Pa).
    pub modulus_range_pa: [f64; 2],
    /// Weight, when it acts in the model.
    pub gravity: Option<Gravity>,
}

/// Weight of the phantom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gravity {
    /// Acceleration (m/s²).
    pub acceleration_m_s2: Vec3,
    /// Whether the rest positions already carry the sag; otherwise the weight acts only inside poke intervals.
    pub at_rest: bool,
}

/// The tip that touches the phantom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tip {
    /// What holds it to the surface.
    pub contact: Contact,
    /// Its face.
    pub shape: TipShape,
}

/// What holds the tip to the surface while it is in contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// The surface sticks to the tip.
    Bonded,
    /// The tip may lift off and slide.
    Unilateral,
}

/// The face of the tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TipShape {
    /// Soft-faced disc: uniform traction over the disc, the stage moves the mean displacement of the disc.
    Pad,
    /// Rigid flat face.
    Flat,
    /// Rigid sphere.
    Sphere {
        /// Radius of the sphere (m).
        radius_m: f64,
    },
}

/// One standard deviation of each channel's white noise, along x, y and z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Force (N).
    pub force_n: [f64; 3],
    /// Torque (N·m).
    pub torque_nm: [f64; 3],
    /// Marker position (m).
    pub marker_m: [f64; 3],
    /// Stage position (m).
    pub stage_m: [f64; 3],
}

/// One poke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poke {
    /// Number by which the recording names it.
    pub number: u32,
    /// Tip centre on the undeformed surface (m).
    pub site: Vec3,
    /// Unit vector into the phantom.
    pub direction: Vec3,
    /// Radius of the tip (m).
    pub radius_m: f64,
    /// First instant of contact (s).
    pub start_s: f64,
    /// Last instant of contact (s).
    pub end_s: f64,
}

/// A poke to be made: the stage goes on at a constant rate, stays, and comes back at the same rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedPoke {
    /// Tip centre on the undeformed surface (m).
    pub site: Vec3,
    /// Unit vector into the phantom.
    pub direction: Vec3,
    /// Radius of the tip (m).
    pub radius_m: f64,
    /// Largest displacement of the stage (m).
    pub depth_m: f64,
    /// Speed of the stage (m/s).
    pub rate_m_s: f64,
    /// How long the largest displacement is held (s).
    pub hold_s: f64,
}

impl PlannedPoke {
    /// Time from the first to the last instant of contact (s).
    pub fn contact_s(&self) -> f64 {
        2.0 * self.depth_m / self.rate_m_s + self.hold_s
    }
}

/// Displacement of the tip from the site of the poke in progress, as the stage reports it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stage {
    /// Time of each row (s), ascending.
    pub time_s: Vec<f64>,
    /// Displacement (m).
    pub displacement_m: Vec<[f64; 3]>,
}

/// Wrench that the tip exerts on the phantom, moments about the current tip centre.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Wrench {
    /// Time of each row (s), ascending.
    pub time_s: Vec<f64>,
    /// Force (N).
    pub force_n: Vec<[f64; 3]>,
    /// Torque (N·m).
    pub torque_nm: Vec<[f64; 3]>,
}

/// Marker positions, frame by frame. A marker that was not seen has no row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Markers {
    /// Numbers by which the recording names its markers, ascending; rows refer to them by index.
    pub numbers: Vec<u32>,
    /// Time of each frame (s), strictly ascending.
    pub frame_time_s: Vec<f64>,
    /// Rows ordered by frame, in each frame as recorded.
    pub rows: Vec<MarkerRow>,
}

/// One marker seen in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkerRow {
    /// Index into [`Markers::frame_time_s`].
    pub frame: u32,
    /// Index into [`Markers::numbers`].
    pub marker: u32,
    /// Position (m).
    pub position_m: [f64; 3],
}

impl Recording {
    /// The usual pause between two pokes: their median (s); 0 with fewer than two.
    pub fn pause_s(&self) -> f64 {
        let mut pauses: Vec<f64> = self.pokes.windows(2).map(|p| p[1].start_s - p[0].end_s).collect();
        pauses.sort_by(f64::total_cmp);
        pauses.get(pauses.len() / 2).copied().unwrap_or(0.0)
    }

    /// Mean position of every marker over the rows before [`Recording::rest_until_s`], with the number of rows
    /// it was taken from. A marker without such a row has the count zero and no meaningful mean.
    pub fn rest_positions(&self) -> Vec<(Vec3, usize)> {
        let mut sum = vec![(Vec3::zeros(), 0_usize); self.markers.numbers.len()];
        for row in &self.markers.rows {
            if self.markers.frame_time_s[row.frame as usize] < self.rest_until_s {
                let entry = &mut sum[row.marker as usize];
                entry.0 += Vec3::from(row.position_m);
                entry.1 += 1;
            }
        }
        for (mean, count) in &mut sum {
            *mean /= (*count).max(1) as f64;
        }
        sum
    }
}
