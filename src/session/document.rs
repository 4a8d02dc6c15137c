//! What is said about a session as a whole: the document that it begins with, its events, and the document that it ends with.
//!
//! Plain data that the runner fills in. SI units; every time is of the host's monotonic clock but `started_utc`.

use super::SessionError;
use crate::clock::HostTime;
use crate::device::{
    AXES, DepthCameraFormat, DepthCameraIdentity, ForceFormat, ForceIdentity, Losses, StageIdentity,
    StageLimits,
};
use crate::digest::sha256_hex;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The format that this program reads and writes.
pub const FORMAT: &str = "phantom-session/1";

/// What a session begins with: everything that its records mean nothing without.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StartDocument {
    /// [`FORMAT`].
    pub format: String,
    /// Name of the session.
    pub name: String,
    /// Number of this file within the session, from 1; filled in by the writer.
    pub segment: u32,
    /// The poke that this segment begins with; not 0 when an interrupted session goes on.
    pub first_poke: u32,
    /// Wall clock at the start, as [`utc_text`](super::utc_text) writes it: the only wall-clock time of the session.
    pub started_utc: String,
    /// The host's monotonic clock at the same instant (ns).
    pub started_host_ns: u64,
    /// Identity of the machine's run since it was started: monotonic clocks compare where it is the same. Empty where the system tells none.
    #[serde(default)]
    pub boot: String,
    /// Name and version of the program.
    pub program: String,
    /// Seeds of everything random, by what they are for. What a simulated bench draws from is concealed.
    pub seeds: BTreeMap<String, u64>,
    /// The rig file.
    pub rig: HashedText,
    /// The protocol.
    pub protocol: HashedText,
    /// Values that variables of the protocol were given from outside.
    #[serde(default)]
    pub variables: BTreeMap<String, f64>,
    /// The stage, where there is one.
    pub stage: Option<StageDocument>,
    /// The force sensor, where there is one.
    pub force: Option<ForceDocument>,
    /// The source of marker positions, where there is one.
    pub markers: Option<MarkersDocument>,
    /// The depth camera, where there is one.
    #[serde(default)]
    pub camera: Option<CameraDocument>,
    /// The calibration of the instruments, where the rig file names one.
    #[serde(default)]
    pub calibration: Option<CalibrationDocument>,
    /// How stage and sensor lie in the phantom frame, where it is known.
    pub mounting: Option<MountingDocument>,
    /// The tip.
    pub tip: TipDocument,
    /// The phantom.
    pub phantom: PhantomDocument,
}

/// A text with its hash, so that a change of it is noticed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct HashedText {
    /// The text.
    pub text: String,
    /// SHA-256 of its UTF-8 bytes, in hexadecimal digits.
    pub sha256: String,
}

impl HashedText {
    /// The text with its hash.
    pub fn new(text: impl Into<String>) -> Self {
        let text = text.into();
        let sha256 = sha256_hex(text.as_bytes());
        Self { text, sha256 }
    }

    /// Whether the hash is that of the text.
    pub fn is_intact(&self) -> bool {
        self.sha256 == sha256_hex(self.text.as_bytes())
    }
}

/// Which stage it was, and what it could be asked to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageDocument {
    /// Kind of controller.
    pub controller: String,
    /// Version or hash of the firmware.
    pub firmware: String,
    /// The port, as it was opened.
    pub port: String,
    /// Lowest and highest position of each axis (m).
    pub travel_m: [[f64; 2]; AXES],
    /// Highest speed of each axis (m/s).
    pub speed_m_s: [f64; AXES],
    /// Highest acceleration of each axis (m/s²).
    pub acceleration_m_s2: [f64; AXES],
    /// Smallest step of each axis (m).
    pub step_m: [f64; AXES],
}

impl StageDocument {
    /// What a stage says of itself.
    pub fn new(identity: &StageIdentity, limits: &StageLimits) -> Self {
        Self {
            controller: identity.controller.clone(),
            firmware: identity.firmware.clone(),
            port: identity.port.clone(),
            travel_m: limits.travel_m,
            speed_m_s: limits.speed_m_s,
            acceleration_m_s2: limits.acceleration_m_s2,
            step_m: limits.step_m,
        }
    }

    /// Who answered.
    pub fn identity(&self) -> StageIdentity {
        StageIdentity {
            controller: self.controller.clone(),
            firmware: self.firmware.clone(),
            port: self.port.clone(),
        }
    }

    /// What it could be asked to do.
    pub fn limits(&self) -> StageLimits {
        StageLimits {
            travel_m: self.travel_m,
            speed_m_s: self.speed_m_s,
            acceleration_m_s2: self.acceleration_m_s2,
            step_m: self.step_m,
        }
    }
}

/// Which force sensor it was, and what its counts are worth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ForceDocument {
    /// Product name.
    pub product: String,
    /// Serial number of the calibration in use.
    pub calibration: String,
    /// Name of the configuration in use.
    pub configuration: String,
    /// Address of its stream.
    pub address: String,
    /// Counts for 1 N.
    pub counts_per_newton: f64,
    /// Counts for 1 N·m.
    pub counts_per_newton_metre: f64,
    /// Records a second.
    pub rate_hz: f64,
    /// Rate of the sensor's own clock (1/s).
    pub tick_hz: f64,
    /// Largest wrench that the sensor is calibrated for (N and N·m), where it tells.
    pub range: Option<[f64; 6]>,
    /// Status bits on which nobody should have gone on.
    pub stop_mask: u32,
}

impl ForceDocument {
    /// What a sensor says of itself.
    pub fn new(identity: &ForceIdentity, format: &ForceFormat) -> Self {
        Self {
            product: identity.product.clone(),
            calibration: identity.calibration.clone(),
            configuration: identity.configuration.clone(),
            address: identity.address.clone(),
            counts_per_newton: format.counts_per_newton,
            counts_per_newton_metre: format.counts_per_newton_metre,
            rate_hz: format.rate_hz,
            tick_hz: format.tick_hz,
            range: format.range,
            stop_mask: format.stop_mask,
        }
    }

    /// Which one answered.
    pub fn identity(&self) -> ForceIdentity {
        ForceIdentity {
            product: self.product.clone(),
            calibration: self.calibration.clone(),
            configuration: self.configuration.clone(),
            address: self.address.clone(),
        }
    }

    /// What its records mean.
    pub fn format(&self) -> ForceFormat {
        ForceFormat {
            counts_per_newton: self.counts_per_newton,
            counts_per_newton_metre: self.counts_per_newton_metre,
            rate_hz: self.rate_hz,
            tick_hz: self.tick_hz,
            range: self.range,
            stop_mask: self.stop_mask,
        }
    }
}

/// Where the marker positions came from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkersDocument {
    /// Camera and tracker, or what else it was.
    pub source: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// Markers on the phantom; 0 where nobody knows beforehand.
    pub markers: u32,
}

/// The depth camera, and how its frame lies in the phantom frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraDocument {
    /// Which part of the capture library drives it.
    pub backend: String,
    /// The device, pipeline or files.
    pub source: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// Width and height of its pictures (px).
    pub size_px: [usize; 2],
    /// One unit of depth (m).
    pub metres_per_unit: f64,
    /// Its lens, where it is known.
    pub lens: Option<LensDocument>,
    /// The calibration file that it was read from; none where the rig file has the numbers.
    #[serde(default)]
    pub lens_file: Option<HashedText>,
    /// Points of the bench that it sees, in the phantom frame (m).
    #[serde(default)]
    pub fiducials_m: Vec<[f64; 3]>,
    /// Standard deviation of each of their coordinates (m).
    #[serde(default)]
    pub fiducial_sd_m: f64,
    /// The file that says where it stands, where that is known.
    pub registration: Option<HashedText>,
}

impl CameraDocument {
    /// Which camera it was, and what its pictures are worth.
    pub fn device(&self) -> (DepthCameraIdentity, DepthCameraFormat) {
        let identity = DepthCameraIdentity {
            backend: self.backend.clone(),
            source: self.source.clone(),
            description: String::new(),
        };
        let format = DepthCameraFormat {
            width: self.size_px[0],
            height: self.size_px[1],
            rate_hz: self.rate_hz,
            metres_per_unit: self.metres_per_unit,
        };
        (identity, format)
    }
}

/// Which calibration set was used, with the files of it that readings are put right by. Readings themselves are recorded as they came.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CalibrationDocument {
    /// Name of the set.
    pub name: String,
    /// The set.
    pub set: HashedText,
    /// The force sensor's calibration.
    pub force: Option<HashedText>,
    /// The stage's.
    pub stage: Option<HashedText>,
}

/// A pinhole with the distortion of Brown and Conrady, as OpenCV orders it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LensDocument {
    /// Focal lengths (px).
    pub focal_px: [f64; 2],
    /// Principal point from the centre of the first pixel (px).
    pub principal_px: [f64; 2],
    /// Radial distortion k₁, k₂, k₃.
    pub radial: [f64; 3],
    /// Tangential distortion p₁, p₂.
    pub tangential: [f64; 2],
}

/// How stage and sensor lie in the phantom frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MountingDocument {
    /// Centre of the tip's face with the stage at zero (m).
    pub origin_m: [f64; 3],
    /// Where the tip goes when an axis goes up (unit vectors).
    pub axes: [[f64; 3]; AXES],
    /// A place this close to the plane of motion counts as reached (m).
    pub tolerance_m: f64,
    /// Turns the sensor's axes into those of the phantom frame, by rows.
    pub sensor_to_phantom: [[f64; 3]; 3],
    /// Centre of the tip's face from the sensor's origin, in the sensor's frame (m).
    pub sensor_to_tip_m: [f64; 3],
    /// Whether the sensor reads what the tip feels.
    pub reads_reaction: bool,
}

/// The tip, in the words of a recording bundle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TipDocument {
    /// `bonded` or `unilateral`.
    pub contact: String,
    /// `pad`, `flat` or `sphere`.
    pub shape: String,
    /// Radius of the face (m).
    pub radius_m: f64,
    /// Radius of curvature of a sphere (m).
    pub sphere_radius_m: Option<f64>,
}

/// The phantom, in the words of a recording bundle: what the operator states, not what was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhantomDocument {
    /// What it is, in words.
    pub description: String,
    /// File of its mesh, as the rig file names it.
    pub mesh: Option<String>,
    /// SHA-256 of that file's bytes, in hexadecimal digits.
    pub mesh_sha256: Option<String>,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Density (kg/m³).
    pub density_kg_m3: f64,
    /// Range in which Young's modulus is expected (Pa).
    pub modulus_range_pa: [f64; 2],
}

/// Something that happened: a poke began, a person agreed, a limit was touched.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// When, on the host's monotonic clock (ns).
    pub host_ns: u64,
    /// What, in one word.
    pub name: String,
    /// During which poke, if any.
    pub poke: Option<u32>,
    /// What else there is to say.
    pub detail: serde_json::Map<String, serde_json::Value>,
}

impl Event {
    /// An event without details.
    pub fn new(host: HostTime, name: impl Into<String>) -> Self {
        Self { host_ns: host.nanos(), name: name.into(), poke: None, detail: serde_json::Map::new() }
    }
}

/// How a session ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "outcome", rename_all = "lowercase")]
pub enum Outcome {
    /// The protocol was run to its end.
    Success,
    /// Somebody or something stopped it on purpose.
    Abort {
        /// Who or what, and why.
        cause: String,
    },
    /// It could not go on.
    Fail {
        /// Why.
        cause: String,
    },
}

/// What a session ends with. Counts are those of the segment that it closes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StopDocument {
    /// How it ended.
    #[serde(flatten)]
    pub outcome: Outcome,
    /// When, on the host's monotonic clock (ns).
    pub stopped_host_ns: u64,
    /// Messages of each topic in the file, without this one.
    pub messages: BTreeMap<String, u64>,
    /// Force records in the file.
    pub force_records: u64,
    /// Records of each topic that were handed over but not written.
    pub dropped: BTreeMap<String, u64>,
    /// What became of the force records on their way to the host.
    pub sensor: SensorLosses,
}

/// [`Losses`] of the force sensor, as its driver counted them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SensorLosses {
    /// Records that arrived in order.
    pub received: u64,
    /// Records that never came.
    pub lost: u64,
    /// Records that came twice.
    pub duplicated: u64,
    /// Records that came after a later one.
    pub reordered: u64,
    /// Datagrams that are no records.
    pub malformed: u64,
}

impl From<Losses> for SensorLosses {
    fn from(losses: Losses) -> Self {
        let Losses { received, lost, duplicated, reordered, malformed } = losses;
        Self { received, lost, duplicated, reordered, malformed }
    }
}

/// The JSON text of a document, once it is sure that it reads the same again.
pub(super) fn to_json<T>(what: &'static str, document: &T) -> Result<Vec<u8>, SessionError>
where
    T: Serialize + for<'a> Deserialize<'a> + PartialEq,
{
    let unwritable = |message: String| SessionError::Unwritable { what, message };
    let text = serde_json::to_vec(document).map_err(|e| unwritable(e.to_string()))?;
    let again: T = serde_json::from_slice(&text).map_err(|e| unwritable(e.to_string()))?;
    if again == *document {
        Ok(text)
    } else {
        Err(unwritable("a value would not read as it was written".to_owned()))
    }
}
