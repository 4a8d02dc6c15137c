//! What a bench session consists of: the phantom with everything concealed in it, the pokes and the instruments.

use super::hex_mesh::Slab;
use super::supports::Restraint;
use crate::observation::Noise;

/// Everything that determines a simulated recording; two equal draws make recordings equal to the last bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// Name of the recording.
    pub name: String,
    /// Seed of the noise, the marker sites and the fit's mesh.
    pub seed: u64,
    /// The block and its known glue.
    pub slab: Slab,
    /// Poisson's ratio, also the one stated to the operator.
    pub poisson_ratio: f64,
    /// Young's modulus (Pa); concealed.
    pub young_modulus_pa: f64,
    /// Range stated to the operator (Pa).
    pub modulus_range_pa: [f64; 2],
    /// What else holds the underside; concealed.
    pub restraints: Vec<Restraint>,
    /// Pokes in order.
    pub pokes: Vec<PokePlan>,
    /// Small or finite strain; concealed.
    pub kinematics: Kinematics,
    /// The instruments.
    pub instruments: Instruments,
    /// Edge of the boxes from which the fit's tetrahedra are cut (m).
    pub fit_cell_m: f64,
}

/// How the phantom's deformation is described.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kinematics {
    /// Linear elasticity.
    SmallStrain,
    /// Compressible neo-Hookean solid, total Lagrangian.
    FiniteStrain,
}

/// One poke: approach at a constant rate, hold, retreat at the same rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PokePlan {
    /// Tip centre on the undeformed surface (m).
    pub site_m: [f64; 3],
    /// Unit vector into the phantom, along which the stage moves.
    pub direction: [f64; 3],
    /// Radius of the tip (m).
    pub radius_m: f64,
    /// Largest displacement of the stage (m).
    pub depth_m: f64,
    /// Speed of the stage (m/s).
    pub rate_m_s: f64,
    /// How long the largest displacement is held, at least (s).
    pub hold_s: f64,
}

/// What watches the phantom, and how well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instruments {
    /// Rows of stage and force sensor a second (Hz).
    pub sensor_rate_hz: f64,
    /// Frames of the camera a second (Hz).
    pub frame_rate_hz: f64,
    /// White noise; stated to the operator.
    pub noise: Noise,
    /// Error that wanders slowly; not stated to the operator.
    pub wander: Option<Wander>,
    /// Share of marker rows that are lost.
    pub lost_share: f64,
    /// Mean distance between markers (m).
    pub marker_spacing_m: f64,
    /// Rest before the first poke and pause after every poke (s).
    pub pause_s: f64,
}

/// A slowly correlated error: an Ornstein–Uhlenbeck process a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wander {
    /// Standard deviation of each force component (N).
    pub force_n: f64,
    /// Standard deviation of each marker coordinate, all markers together (m).
    pub marker_m: f64,
    /// Time in which the correlation falls to 1/e (s).
    pub time_s: f64,
}

impl Default for Instruments {
    /// A six-axis force sensor at 50 Hz and a depth camera at 10 Hz, with the noise of the bundle format's
    /// example.
    fn default() -> Self {
        Self {
            sensor_rate_hz: 50.0,
            frame_rate_hz: 10.0,
            noise: Noise {
                force_n: [6e-3; 3],
                torque_nm: [6e-5; 3],
                marker_m: [5e-5, 5e-5, 1e-4],
                stage_m: [1e-5; 3],
            },
            wander: None,
            lost_share: 0.01,
            marker_spacing_m: 0.011,
            pause_s: 1.0,
        }
    }
}
