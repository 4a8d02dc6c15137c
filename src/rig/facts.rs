//! What a rig file says that a plan and a session have to know, in SI.

use super::file::{ContactWord, ControllerWord, RigKeys, ShapeWord};
use super::reading::without_simulation;
use super::{RigError, SIMULATED};
use crate::calib::set::CalibrationSet;
use crate::calib::{Registration, RegistrationFile};
use crate::device::{DepthCameraFormat, DepthCameraIdentity, Mounting, SensorMounting, StageLimits};
use crate::driver::NativeOptions;
use crate::mesh::TetMesh;
use crate::session::{CalibrationDocument, CameraDocument, HashedText, LensDocument};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A rig file, read and checked.
#[derive(Debug, Clone)]
pub struct RigFile {
    pub(super) keys: RigKeys,
    pub(super) file: PathBuf,
    text: String,
    mounting: Mounting,
    calibration: Option<CalibrationSet>,
}

const MM: f64 = 1e-3;

/// A mesh may reach this far (m) beyond the phantom's box: what rounding and a ruler leave.
const OUTSIDE_M: f64 = 1e-4;

impl RigFile {
    /// Reads and checks a rig file. Nothing is opened.
    ///
    /// # Errors
    /// [`RigError`] with file and key.
    pub fn read(file: &Path) -> Result<Self, RigError> {
        let (keys, text) = RigKeys::read(file)?;
        let mounting = keys.mounting(file)?;
        let beside = |name: &String| CalibrationSet::read(&file.parent().unwrap_or(Path::new("")).join(name));
        let calibration = keys.calibration.as_ref().map(beside).transpose();
        let calibration = calibration
            .map_err(|source| RigError::Calibration { file: file.to_owned(), source: Box::new(source) })?;
        let rig = Self { keys, file: file.to_owned(), text, mounting, calibration };
        rig.lens()?;
        rig.camera_stands()?;
        Ok(rig)
    }

    /// The calibration set that it names.
    pub fn calibration(&self) -> Option<&CalibrationSet> {
        self.calibration.as_ref()
    }

    /// What a session keeps of the calibration set.
    pub fn calibration_document(&self) -> Option<CalibrationDocument> {
        let set = self.calibration.as_ref()?;
        Some(CalibrationDocument {
            name: set.name.clone(),
            set: HashedText::new(set.text.clone()),
            force: set.force.as_ref().map(|(_, text)| HashedText::new(text.clone())),
            stage: set.stage.as_ref().map(|(_, text)| HashedText::new(text.clone())),
        })
    }

    /// The camera's lens, as its own section says, or else the calibration set.
    pub(super) fn lens(&self) -> Result<Option<(LensDocument, Option<HashedText>)>, RigError> {
        let Some(keys) = &self.keys.camera else { return Ok(None) };
        let set = self.calibration.as_ref().and_then(|set| set.lens.as_ref());
        match (keys.lens(&self.file)?, set) {
            (None, Some((lens, text))) => keys.found_lens(&self.file, lens, text.clone()).map(Some),
            (own, _) => Ok(own),
        }
    }

    /// Where the camera stands, as its own section says, or else the calibration set.
    pub(super) fn camera_stands(&self) -> Result<Option<(HashedText, Registration)>, RigError> {
        let Some(keys) = &self.keys.camera else { return Ok(None) };
        let set = self.calibration.as_ref().and_then(|set| set.registration.as_ref());
        let from_set =
            |(file, text): &(RegistrationFile, String)| (HashedText::new(text.clone()), file.registration());
        Ok(keys.registration(&self.file)?.or_else(|| set.map(from_set)))
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.keys.name
    }

    /// The text of the file without what it says of a simulated phantom: fits and reports never see that.
    pub fn public_text(&self) -> String {
        without_simulation(&self.text)
    }

    /// Whether any of its devices is simulated.
    pub fn is_simulated(&self) -> bool {
        let keys = &self.keys;
        [&keys.stage.port, &keys.force.address].into_iter().any(|name| name == SIMULATED)
    }

    /// How the stage carries the tip.
    pub fn mounting(&self) -> Mounting {
        self.mounting
    }

    /// Where the tip is with the stage at zero (m), and where it goes when an axis goes up.
    pub fn axes(&self) -> ([f64; 3], [[f64; 3]; 2]) {
        (self.keys.stage.origin_mm.map(|x| x * MM), self.keys.stage.directions)
    }

    /// How far beside the plane of motion a place may lie (m).
    pub fn beside_m(&self) -> f64 {
        self.keys.stage.beside_mm * MM
    }

    /// How the sensor lies.
    pub fn sensor(&self) -> SensorMounting {
        self.keys.sensor()
    }

    /// What the stage may be asked to do. The stage itself may allow less: that is looked at when it is opened.
    pub fn limits(&self) -> StageLimits {
        let stage = &self.keys.stage;
        StageLimits {
            travel_m: stage.travel_mm.map(|t| t.map(|x| x * MM)),
            speed_m_s: stage.most_speed_mm_s.map(|x| x * MM),
            acceleration_m_s2: stage.most_acceleration_mm_s2.map(|x| x * MM),
            step_m: [1e-6; 2],
        }
    }

    /// Speeds of travel and approach (m/s), acceleration of motions and deceleration of stops (m/s²).
    pub fn speeds(&self) -> [f64; 4] {
        let stage = &self.keys.stage;
        [
            stage.travel_speed_mm_s,
            stage.approach_speed_mm_s,
            stage.acceleration_mm_s2,
            stage.stop_deceleration_mm_s2,
        ]
        .map(|x| x * MM)
    }

    /// Clearance above the phantom, run-up of a poke, and how far off its surface a site may lie (m).
    pub fn heights_m(&self) -> [f64; 3] {
        let stage = &self.keys.stage;
        [stage.clearance_mm, stage.run_up_mm, stage.surface_tolerance_mm].map(|x| x * MM)
    }

    /// Rest between two contacts, at least (s).
    pub fn rest_s(&self) -> f64 {
        self.keys.stage.rest_s
    }

    /// What passes between a force and its datagram, and between a stop on its way and the motors (s).
    pub fn latencies_s(&self) -> [f64; 2] {
        [self.keys.force.latency_ms, self.keys.stage.latency_ms].map(|x| x * MM)
    }

    /// Force (N) and torque (N·m) at which the stage is stopped, along the sensor's axes.
    pub fn force_limits(&self) -> ([f64; 3], f64) {
        (self.keys.force.limit_n, self.keys.force.limit_nm)
    }

    /// What the sensor measures (N, N·m).
    pub fn force_range(&self) -> [f64; 6] {
        let force = &self.keys.force;
        std::array::from_fn(|i| if i < 3 { force.range_n[i] } else { force.range_nm[i - 3] })
    }

    /// Records of the sensor a second.
    pub fn force_rate_hz(&self) -> f64 {
        self.keys.force.rate_hz
    }

    /// Reports of the stage a second while it moves.
    pub fn stage_rate_hz(&self) -> f64 {
        match self.keys.stage.controller {
            ControllerWord::Native => NativeOptions::new("").reports.as_secs_f64().recip(),
            ControllerWord::Grbl => self.grbl_rate_hz(),
        }
    }

    /// Status reports that Grbl is asked for a second while the stage moves.
    pub(super) fn grbl_rate_hz(&self) -> f64 {
        self.keys.stage.reports_hz.unwrap_or(10.0)
    }

    /// The sensor's longest silence, most records lost in a row, most records with its clock standing.
    pub fn patience(&self) -> (Duration, u32, u32) {
        let force = &self.keys.force;
        (Duration::from_millis(force.silence_ms), force.gap_records, force.frozen_records)
    }

    /// Radius (m), shape and contact of the tip, in the words of a recording bundle.
    pub fn tip(&self) -> (f64, &'static str, &'static str) {
        let tip = &self.keys.tip;
        let shape = match tip.shape {
            ShapeWord::Pad => "pad",
            ShapeWord::Flat => "flat",
        };
        let contact = match tip.contact {
            ContactWord::Bonded => "bonded",
            ContactWord::Unilateral => "unilateral",
        };
        (tip.radius_mm * MM, shape, contact)
    }

    /// Lowest and highest corner of the phantom (m, phantom frame).
    pub fn phantom_box(&self) -> [[f64; 3]; 2] {
        [self.keys.phantom.low_mm, self.keys.phantom.high_mm].map(|corner| corner.map(|x| x * MM))
    }

    /// That the phantom's box holds a mesh.
    ///
    /// # Errors
    /// [`RigError::BeyondTheBox`] where the mesh reaches beyond by more than rounding leaves.
    pub fn holds(&self, mesh: &TetMesh) -> Result<(), RigError> {
        let [low, high] = self.phantom_box();
        for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let beyond = |at: &f64| (low[i] - at).max(at - high[i]);
            let along = mesh.nodes.iter().map(|node| node[i]);
            let farthest = along.max_by(|a, b| beyond(a).total_cmp(&beyond(b)));
            if let Some(reaches_m) = farthest.filter(|at| beyond(at) > OUTSIDE_M) {
                return Err(RigError::BeyondTheBox {
                    file: self.file.clone(),
                    axis,
                    reaches_m,
                    box_m: [low[i], high[i]],
                });
            }
        }
        Ok(())
    }

    /// Poisson's ratio, density (kg/m³) and the range in which Young's modulus is expected (Pa).
    pub fn phantom(&self) -> (f64, f64, [f64; 2]) {
        let phantom = &self.keys.phantom;
        (phantom.poisson_ratio, phantom.density_kg_m3, phantom.modulus_range_kpa.map(|x| x * 1e3))
    }

    /// What a session keeps of the depth camera, which calls itself so; none where there is none.
    ///
    /// # Errors
    /// [`RigError`]: a lens or a registration that is none.
    pub fn camera(
        &self,
        identity: &DepthCameraIdentity,
        format: &DepthCameraFormat,
    ) -> Result<Option<CameraDocument>, RigError> {
        let Some(keys) = &self.keys.camera else { return Ok(None) };
        let (lens, lens_file) = self.lens()?.unzip();
        Ok(Some(CameraDocument {
            backend: identity.backend.clone(),
            source: identity.source.clone(),
            rate_hz: format.rate_hz,
            size_px: [format.width, format.height],
            metres_per_unit: format.metres_per_unit,
            lens,
            lens_file: lens_file.flatten(),
            fiducials_m: keys.fiducials_mm.iter().map(|p| p.map(|x| x * MM)).collect(),
            fiducial_sd_m: keys.fiducial_sd_mm * MM,
            registration: self.camera_stands()?.map(|(text, _)| text),
        }))
    }

    /// Pixels of a picture and frames a second of the depth camera; none where there is none.
    pub fn pictures(&self) -> Option<(usize, f64)> {
        let keys = self.keys.camera.as_ref()?;
        Some((keys.size_px[0] * keys.size_px[1], keys.rate_hz))
    }

    /// Whether anything says where markers are, or makes pictures of them.
    pub fn records_markers(&self) -> bool {
        self.keys.markers.is_some()
    }

    /// Whether the depth camera's lens and place are known; none where there is no camera. Without both there are pictures, but no markers.
    ///
    /// # Errors
    /// [`RigError`]: a lens or a registration that is none.
    pub fn camera_is_known(&self) -> Result<Option<[bool; 2]>, RigError> {
        if self.keys.camera.is_none() {
            return Ok(None);
        }
        Ok(Some([self.lens()?.is_some(), self.camera_stands()?.is_some()]))
    }

    /// The mesh file; none for that of the simulated phantom.
    pub fn mesh(&self) -> Option<PathBuf> {
        self.keys.mesh(&self.file)
    }
}
