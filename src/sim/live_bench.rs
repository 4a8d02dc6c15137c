//! The simulated bench between its emulated devices: the stage tells where it is, the sensor and the camera ask what that does.

use super::SimError;
use super::skin::{Skin, SkinCut};
use super::stage_path::{StagePath, StageTeller};
use super::world::{Glimpse, Live, Phantom, World};
use crate::clock::HostTime;
use crate::device::{DeviceError, MarkerFrame, MarkerPosition, MarkerSource, Mounting, SensorMounting};
use crate::mesh::TetMesh;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The phantom with the stage in front of it.
#[derive(Clone)]
pub struct LiveBench {
    live: Arc<Mutex<Live>>,
    stage: StagePath,
    mounting: Mounting,
    sensor: SensorMounting,
    frame_rate_hz: f64,
    /// The world as it began.
    world: Arc<World>,
    /// When it began, and its own time then (s).
    begins: HostTime,
    begins_s: f64,
}

impl LiveBench {
    /// Prepares the phantom of a world and puts the stage in front of it, at zero; nothing has happened to it for `at_rest_s` seconds when
    /// this is called, nor while it is prepared. Takes seconds.
    ///
    /// # Errors
    /// [`SimError`] as for [`World::record`].
    pub fn new(
        world: World,
        mounting: Mounting,
        sensor: SensorMounting,
        at_rest_s: f64,
    ) -> Result<Self, SimError> {
        Self::prepared(world, mounting, sensor, at_rest_s, None)
    }

    /// The same with a skin that a camera can look at: see [`LiveBench::glimpse`]. Takes seconds more.
    ///
    /// # Errors
    /// [`SimError`] as for [`LiveBench::new`], and a cut that means nothing.
    pub fn seen(
        world: World,
        mounting: Mounting,
        sensor: SensorMounting,
        at_rest_s: f64,
        cut: &SkinCut,
    ) -> Result<Self, SimError> {
        Self::prepared(world, mounting, sensor, at_rest_s, Some(cut))
    }

    fn prepared(
        world: World,
        mounting: Mounting,
        sensor: SensorMounting,
        at_rest_s: f64,
        cut: Option<&SkinCut>,
    ) -> Result<Self, SimError> {
        let called = HostTime::now();
        let phantom = match cut {
            Some(cut) => Phantom::prepare_seen(&world.phantom, cut)?,
            None => Phantom::prepare(&world.phantom)?,
        };
        let shared = Arc::new(world.clone());
        let frame_rate_hz = world.instruments.frame_rate_hz;
        let begins_s = at_rest_s + HostTime::now().since(called).as_secs_f64();
        let live = Arc::new(Mutex::new(Live::new(world, &phantom, begins_s)?));
        let (stage, begins) = (StagePath::default(), HostTime::now());
        Ok(Self { live, stage, mounting, sensor, frame_rate_hz, world: shared, begins, begins_s })
    }

    /// When it began to go on in time.
    pub fn begins(&self) -> HostTime {
        self.begins
    }

    /// The world's own time (s).
    pub fn time_s(&self, at: HostTime) -> f64 {
        self.begins_s + at.seconds_after(self.begins)
    }

    /// When the world's own time was that (s).
    pub fn host(&self, time_s: f64) -> HostTime {
        self.begins + Duration::from_secs_f64((time_s - self.begins_s).max(0.0))
    }

    /// For the emulated stage, to tell where it is.
    pub fn stage(&self) -> StageTeller {
        self.stage.teller()
    }

    /// What the sensor feels so many seconds after the [beginning](Self::begins), in its own frame: N and N·m. Times must not go back.
    /// Waits until the stage has told where it was.
    ///
    /// # Errors
    /// [`SimError`]: equations without a solution.
    pub fn wrench(&self, time_s: f64) -> Result<[f64; 6], SimError> {
        let time_s = self.begins_s + time_s;
        let mut live = self.lock();
        live.advance(time_s, |at_s| self.mounting.tip_at(self.stage.at(self.host(at_s))).into())?;
        Ok(self.sensor.sensed(live.wrench(time_s)))
    }

    /// Where the markers are, as a camera with a tracker would tell.
    pub fn markers(&self) -> SimulatedMarkers {
        let period = Duration::from_secs_f64(1.0 / self.frame_rate_hz);
        SimulatedMarkers {
            bench: self.clone(),
            period,
            next: HostTime::now() + period,
            number: 0,
            last_s: 0.0,
        }
    }

    /// The world as it began.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// What a camera can look at; none on a bench that was prepared without.
    pub fn skin(&self) -> Option<Arc<Skin>> {
        self.lock().skin().cloned()
    }

    /// Whether the bench has come to a time: it goes on as far as the sensor has asked.
    pub fn has_come_to(&self, at: HostTime) -> bool {
        self.lock().time_s() >= self.time_s(at)
    }

    /// What a camera has in front of it at a time of the last 50 ms, exactly, or as late as the bench has come, less the camera's lag. With
    /// velocities if `moving`. None on a bench that was prepared without a skin.
    pub fn glimpse(&self, at: HostTime, moving: bool) -> Option<Glimpse> {
        self.lock().glimpse(self.time_s(at), moving)
    }

    fn lock(&self) -> MutexGuard<'_, Live> {
        // A bench that gave up in the middle of a step has told so already; its state is still one.
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Marker positions of the simulated phantom, without a camera in between.
pub struct SimulatedMarkers {
    bench: LiveBench,
    period: Duration,
    next: HostTime,
    number: u32,
    /// The bench's time at the last frame (s).
    last_s: f64,
}

impl MarkerSource for SimulatedMarkers {
    fn rate_hz(&self) -> f64 {
        self.bench.frame_rate_hz
    }

    fn frame(&mut self, until: HostTime) -> Result<Option<MarkerFrame>, DeviceError> {
        std::thread::sleep(self.next.min(until).remaining());
        if until < self.next {
            return Ok(None);
        }
        let (now, number) = (HostTime::now(), self.number);
        // A frame that nobody fetched in time is lost, and its number with it.
        while self.next <= now {
            self.next = self.next + self.period;
            self.number += 1;
        }
        let mut live = self.bench.lock();
        // The bench has come as far as the sensor has asked: what is seen is of that time. Where it has not gone on, there is nothing new.
        let at_s = live.time_s();
        if at_s <= self.last_s {
            return Ok(None);
        }
        self.last_s = at_s;
        let seen = live.markers();
        let markers =
            seen.into_iter().map(|(marker, position_m)| MarkerPosition { marker, position_m }).collect();
        Ok(Some(MarkerFrame { host: self.bench.host(at_s), number, markers }))
    }
}

impl World {
    /// The mesh that comes with its recordings.
    ///
    /// # Errors
    /// [`SimError::BadBlock`].
    pub fn fit_mesh(&self) -> Result<TetMesh, SimError> {
        super::fit_mesh::fit_mesh(&self.phantom.slab, self.fit_cell_m, self.phantom.seed)
    }
}
