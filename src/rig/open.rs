//! The devices of a rig, opened: real ones through their drivers, simulated ones through the same drivers to the simulated bench.

use super::camera_markers::CameraMarkers;
use super::depth_camera::DepthCameraKeys;
use super::file::ControllerWord;
use super::simulation::SimulationKeys;
use super::{RigError, RigFile, SIMULATED};
use crate::clock::HostTime;
use crate::device::{ForceSensor, MarkerSource, Stage};
use crate::driver::{
    GrblOptions, GrblStage, NativeOptions, NativeStage, NetFt, NetFtSettings, VideoSource, open_video,
};
use crate::mesh::TetMesh;
use crate::observation::PlannedPoke;
use crate::sim::bytes::{
    GrblDialect, GrblEmulator, GrblSetup, NativeStageEmulator, NativeStageSetup, NetFtEmulator, NetFtSetup,
};
use crate::sim::pixels::Frame;
use crate::sim::{
    FramePipe, LiveBench, LiveCamera, PixelCamera, PixelCameraSetup, SimError, TruthTable, World,
};
use crate::track::Camera;
use std::net::Ipv4Addr;
use std::sync::{Arc, OnceLock};
use std::time::Duration;
use tempfile::TempDir;

/// What is behind simulated devices, with the pokes that will be made on it.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedBench {
    /// All of it.
    pub world: World,
}

impl SimulatedBench {
    /// The same bench when it runs for the `number`th time after the first: all but its noise.
    #[must_use]
    pub fn later(self, number: u64) -> Self {
        Self { world: World { seed: self.world.seed.wrapping_add(number), ..self.world } }
    }
}

/// A rig's devices. What stands behind simulated ones lives as long as they do.
pub struct Devices {
    /// The stage.
    pub stage: Box<dyn Stage>,
    /// The force sensor.
    pub force: Box<dyn ForceSensor>,
    /// Where marker positions come from, if anything tells them.
    pub markers: Option<Box<dyn MarkerSource>>,
    simulated: Simulated,
}

/// A rig's devices, each opened or not.
pub struct EachDevice {
    /// The stage.
    pub stage: Result<Box<dyn Stage>, RigError>,
    /// The force sensor.
    pub force: Result<Box<dyn ForceSensor>, RigError>,
    /// Where marker positions come from, if anything tells them.
    pub markers: Result<Option<Box<dyn MarkerSource>>, RigError>,
    simulated: Simulated,
}

/// The far ends of simulated ports. Dropped after the devices: their fields come first.
#[derive(Default)]
struct Simulated {
    bench: Option<(World, LiveBench)>,
    failure: Arc<OnceLock<SimError>>,
    _native: Option<NativeStageEmulator>,
    _grbl: Option<GrblEmulator>,
    _net_ft: Option<NetFtEmulator>,
    _camera: Option<(LiveCamera, TempDir)>,
}

impl Simulated {
    fn bench_for(&self, device: &'static str) -> Result<LiveBench, RigError> {
        self.bench.as_ref().map(|(_, live)| live.clone()).ok_or(RigError::NoBench { device })
    }
}

impl Devices {
    /// Why the simulated bench could not go on, if so.
    pub fn simulation_failure(&self) -> Option<&SimError> {
        self.simulated.failure.get()
    }

    /// What the clock of the simulated bench shows (s) at a time.
    pub fn simulated_time_s(&self, at: HostTime) -> Option<f64> {
        self.simulated.bench.as_ref().map(|(_, live)| live.time_s(at))
    }

    /// The mesh of the simulated phantom.
    ///
    /// # Errors
    /// [`RigError`]: the phantom is not simulated.
    pub fn simulated_mesh(&self) -> Result<TetMesh, RigError> {
        let (world, _) = self.simulated.bench.as_ref().ok_or(RigError::NoSimulation)?;
        Ok(world.fit_mesh()?)
    }
}

impl RigFile {
    /// What is behind simulated devices, for `pokes`; none where the file has no simulated bench.
    ///
    /// # Errors
    /// [`RigError`]: a poke that misses the phantom, an effect with parameters that make no sense.
    pub fn simulated(&self, pokes: &[PlannedPoke]) -> Result<Option<SimulatedBench>, RigError> {
        let (ratio, _, range) = self.phantom();
        let keys = &self.keys;
        let world = |simulation: &SimulationKeys| {
            simulation.world(&keys.name, ratio, range, keys.force.rate_hz, pokes)
        };
        let world = keys.simulation.as_ref().map(world).transpose()?;
        Ok(world.map(|world| SimulatedBench { world }))
    }

    /// Opens all devices. Behind simulated ones is `bench`, after `at_rest_s` seconds in which nothing happened; to prepare it takes seconds.
    ///
    /// # Errors
    /// [`RigError`]: a device that is not there, that answers otherwise, or whose settings do not serve; two devices on one port.
    pub fn open(&self, bench: Option<SimulatedBench>, at_rest_s: f64) -> Result<Devices, RigError> {
        let EachDevice { stage, force, markers, simulated } = self.open_each(bench, at_rest_s)?;
        Ok(Devices { stage: stage?, force: force?, markers: markers?, simulated })
    }

    /// As [`RigFile::open`], but goes on where a device cannot be opened.
    ///
    /// # Errors
    /// [`RigError`]: the simulated bench cannot be prepared.
    pub fn open_each(&self, bench: Option<SimulatedBench>, at_rest_s: f64) -> Result<EachDevice, RigError> {
        let seen = self.keys.camera.as_ref().is_some_and(DepthCameraKeys::is_simulated);
        let prepare = |bench: SimulatedBench| {
            let eye = if seen { self.simulated_camera(&bench)? } else { None };
            let (world, mounting, sensor) = (bench.world.clone(), self.mounting(), self.sensor());
            let live = match &eye {
                Some(eye) => LiveBench::seen(world, mounting, sensor, at_rest_s, &eye.cut)?,
                None => LiveBench::new(world, mounting, sensor, at_rest_s)?,
            };
            Ok::<_, RigError>((bench.world, live, eye))
        };
        let (bench, eye) = match bench.map(prepare).transpose()? {
            Some((world, live, eye)) => (Some((world, live)), eye),
            None => (None, None),
        };
        let mut simulated = Simulated { bench, ..Simulated::default() };
        let (stage, force) = (self.open_stage(&mut simulated), self.open_force(&mut simulated));
        let markers = match &self.keys.markers {
            Some(source) if source.source == SIMULATED => simulated
                .bench_for("markers")
                .map(|bench| Some(Box::new(bench.markers()) as Box<dyn MarkerSource>)),
            Some(_) => self.open_camera(&mut simulated, eye.as_ref()).map(Some),
            None => Ok(None),
        };
        Ok(EachDevice { stage, force, markers, simulated })
    }

    fn open_stage(&self, simulated: &mut Simulated) -> Result<Box<dyn Stage>, RigError> {
        let stage = &self.keys.stage;
        let port = |simulated: Option<&str>| simulated.map_or_else(|| stage.port.clone(), str::to_owned);
        let is_simulated = stage.port == SIMULATED;
        Ok(match stage.controller {
            ControllerWord::Native => {
                if is_simulated {
                    let path = simulated.bench_for("stage")?.stage();
                    let emulator = NativeStageEmulator::start(self.native_setup(), move |time, at| {
                        path.tell(time, at);
                    });
                    simulated._native =
                        Some(emulator.map_err(|source| RigError::NoPort { device: "stage", source })?);
                }
                let port = port(simulated._native.as_ref().map(NativeStageEmulator::port));
                let options = NativeOptions { baud: stage.baud, ..NativeOptions::new(port) };
                let lease = stage.lease_ms.map_or(options.lease, Duration::from_millis);
                // Whoever lets the stage move for so long without a word waits as long for one.
                let patience = options.patience.max(lease);
                Box::new(NativeStage::connect(&NativeOptions { lease, patience, ..options })?)
            }
            ControllerWord::Grbl => {
                if is_simulated {
                    let path = simulated.bench_for("stage")?.stage();
                    let emulator =
                        GrblEmulator::start(self.grbl_setup(), move |time, at| path.tell(time, at));
                    simulated._grbl =
                        Some(emulator.map_err(|source| RigError::NoPort { device: "stage", source })?);
                }
                let port = port(simulated._grbl.as_ref().map(GrblEmulator::port));
                let axes = stage.axes.unwrap_or(['X', 'Z']);
                let reports = self.grbl_rate_hz();
                let options =
                    GrblOptions { baud: stage.baud, axes, moving_rate_hz: reports, ..GrblOptions::new(port) };
                Box::new(GrblStage::connect(&options)?)
            }
        })
    }

    fn open_force(&self, simulated: &mut Simulated) -> Result<Box<dyn ForceSensor>, RigError> {
        let keys = &self.keys;
        let settings = if keys.force.address == SIMULATED {
            let bench = simulated.bench_for("force sensor")?;
            let (begins, failure) = (bench.begins(), Arc::clone(&simulated.failure));
            let wrench = move |time_s: f64| {
                bench.wrench(time_s).unwrap_or_else(|error| {
                    // The first stays. More than any sensor reads: it says itself that it is not to be trusted, and the run stops.
                    let _ = failure.set(error);
                    [f64::INFINITY; 6]
                })
            };
            let setup = NetFtSetup {
                rate_hz: keys.force.rate_hz,
                range: self.force_range(),
                ..NetFtSetup::default()
            };
            let emulator = NetFtEmulator::start(setup, begins, wrench)
                .map_err(|source| RigError::NoPort { device: "force sensor", source })?;
            let settings = NetFtSettings {
                http_port: emulator.http_port(),
                rdt_port: emulator.rdt_port(),
                ..NetFtSettings::at(Ipv4Addr::LOCALHOST.to_string())
            };
            simulated._net_ft = Some(emulator);
            settings
        } else {
            NetFtSettings::at(keys.force.address.clone())
        };
        let force = NetFt::open(&NetFtSettings {
            expected_rate_hz: Some(keys.force.rate_hz),
            buffered: keys.force.buffered.unwrap_or(false),
            ..settings
        })?;
        // As long as a datagram takes to fill, nothing comes.
        let silence_s = 1e-3 * keys.force.silence_ms as f64;
        if 2.0 * force.datagram_s() > silence_s {
            return Err(RigError::Value {
                file: self.file.clone(),
                key: "force.silence_ms",
                found: keys.force.silence_ms.to_string(),
                expected: "at least twice the time that the sensor takes to fill a datagram (rate_hz, buffered)",
            });
        }
        Ok(Box::new(force))
    }

    fn open_camera(
        &self,
        simulated: &mut Simulated,
        eye: Option<&PixelCameraSetup>,
    ) -> Result<Box<dyn MarkerSource>, RigError> {
        let Some(keys) = &self.keys.camera else { return Err(RigError::NoBench { device: "camera" }) };
        let options = match keys.video(self)? {
            Some(options) => options,
            None => {
                let bench = simulated.bench_for("camera")?;
                let eye = eye.ok_or(RigError::NoBench { device: "camera" })?;
                let place =
                    tempfile::tempdir().map_err(|source| RigError::NoPort { device: "camera", source })?;
                let path = place.path().join("camera");
                let pipe = FramePipe::create(&path, keys.size_px)?;
                let camera = PixelCamera::above(eye, &bench)?;
                let truth =
                    self.keys.simulation.as_ref().and_then(|s| s.camera()).and_then(|c| c.truth(self));
                let mut truth = truth.map(|path| TruthTable::create(path, bench.clone())).transpose()?;
                let add = move |frame: &Frame| truth.as_mut().map_or(Ok(()), |table| table.add(frame));
                simulated._camera = Some((LiveCamera::start(camera, bench, pipe, add), place));
                keys.options(VideoSource::stacked_pipe(&path, keys.size_px, keys.rate_hz))
            }
        };
        let lens = self.lens()?.map(|(lens, _)| Camera {
            size_px: keys.size_px,
            focal_px: lens.focal_px,
            principal_px: lens.principal_px,
            radial: lens.radial,
            tangential: lens.tangential,
        });
        let registration = self.camera_stands()?.map(|(_, registration)| registration);
        let eye = lens.zip(registration);
        Ok(Box::new(CameraMarkers::new(open_video(&options)?, eye)))
    }

    /// The emulated stage that does what the rig file says, with own firmware.
    fn native_setup(&self) -> NativeStageSetup {
        let limits = self.limits();
        let micrometres = |m: f64| (m * 1e6).round() as i32;
        let mut setup = NativeStageSetup::default();
        for axis in 0..2 {
            let ([low, high], own) = (limits.travel_m[axis], &mut setup.firmware.axes[axis]);
            own.travel_low_um = micrometres(low);
            own.travel_high_um = micrometres(high);
            own.max_speed_um_s = micrometres(limits.speed_m_s[axis]).unsigned_abs();
            own.max_acceleration_um_s2 = micrometres(limits.acceleration_m_s2[axis]).unsigned_abs();
            let hardest = own.max_acceleration_um_s2;
            setup.firmware.emergency_um_s2 = setup.firmware.emergency_um_s2.min(hardest);
            let fastest = own.max_speed_um_s;
            setup.firmware.unhomed_speed_um_s = setup.firmware.unhomed_speed_um_s.min(fastest);
            let homing = &mut setup.firmware.homing;
            homing.acceleration_um_s2 = homing.acceleration_um_s2.min(hardest);
            homing.fast_um_s = homing.fast_um_s.min(fastest);
            homing.slow_um_s = homing.slow_um_s.min(homing.fast_um_s);
            setup.switches_m[axis] = [0.0, high + 1e-3];
            setup.ends_m[axis] = [-2e-3, high + 3e-3];
            setup.start_m[axis] = 0.25 * (low + high);
        }
        setup
    }

    /// The emulated stage that does what the rig file says, with Grbl.
    fn grbl_setup(&self) -> GrblSetup {
        let limits = self.limits();
        let mut setup = GrblSetup::bench(GrblDialect::Hal);
        for (axis, number) in (0..2).zip([0_u16, 2]) {
            // It homes to its upper end, pulls off by a millimetre, and counts down from there.
            let [low, _] = limits.travel_m[axis];
            setup.settings.insert(110 + number, limits.speed_m_s[axis] * 60e3);
            setup.settings.insert(120 + number, limits.acceleration_m_s2[axis] * 1e3);
            setup.settings.insert(130 + number, -low * 1e3);
        }
        setup
    }
}
