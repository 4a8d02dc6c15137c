//! The simulated bench between its emulated devices: the stage tells where it is, the sensor and the camera ask what that does.

use super::SimError;
use super::world::{Live, Phantom, World};
use crate::clock::HostTime;
use crate::device::{AXES, DeviceError, MarkerFrame, MarkerPosition, MarkerSource, Mounting, SensorMounting};
use crate::mesh::TetMesh;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The phantom with the stage in front of it.
#[derive(Clone)]
pub struct LiveBench {
    live: Arc<Mutex<Live>>,
    /// Position of the stage (m), as bits.
    position: Arc<[AtomicU64; AXES]>,
    mounting: Mounting,
    sensor: SensorMounting,
    frame_rate_hz: f64,
    /// Time of the bench when the sensor's clock begins (s).
    begins_s: f64,
}

impl LiveBench {
    /// Prepares the phantom of a world and puts the stage in front of it, at zero; nothing has happened to it for `at_rest_s` seconds.
    /// Takes seconds.
    ///
    /// # Errors
    /// [`SimError`] as for [`World::record`].
    pub fn new(
        world: World,
        mounting: Mounting,
        sensor: SensorMounting,
        at_rest_s: f64,
    ) -> Result<Self, SimError> {
        let phantom = Phantom::prepare(&world.phantom)?;
        let frame_rate_hz = world.instruments.frame_rate_hz;
        let live = Arc::new(Mutex::new(Live::new(world, &phantom, at_rest_s)?));
        Ok(Self { live, position: Arc::default(), mounting, sensor, frame_rate_hz, begins_s: at_rest_s })
    }

    /// Takes the stage to a position (m).
    pub fn stage_at(&self, position_m: [f64; AXES]) {
        for (cell, value) in self.position.iter().zip(position_m) {
            cell.store(value.to_bits(), Ordering::Relaxed);
        }
    }

    /// What the sensor feels at a time (s since the sensor was switched on), in its own frame: N and N·m. Times must not go back.
    ///
    /// # Errors
    /// [`SimError`]: equations without a solution.
    pub fn wrench(&self, time_s: f64) -> Result<[f64; 6], SimError> {
        let position =
            std::array::from_fn(|axis| f64::from_bits(self.position[axis].load(Ordering::Relaxed)));
        let mut live = self.lock();
        let time_s = self.begins_s + time_s;
        live.advance(time_s, self.mounting.tip_at(position).into())?;
        Ok(self.sensor.sensed(live.wrench(time_s)))
    }

    /// Where the markers are, as a camera with a tracker would tell.
    pub fn markers(&self) -> SimulatedMarkers {
        let period = Duration::from_secs_f64(1.0 / self.frame_rate_hz);
        SimulatedMarkers { bench: self.clone(), period, next: HostTime::now() + period, number: 0 }
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
        let host = HostTime::now();
        let seen = self.bench.lock().markers();
        let markers =
            seen.into_iter().map(|(marker, position_m)| MarkerPosition { marker, position_m }).collect();
        let frame = MarkerFrame { host, number: self.number, markers };
        // A frame that nobody fetched in time is lost, and its number with it.
        while self.next <= host {
            self.next = self.next + self.period;
            self.number += 1;
        }
        Ok(Some(frame))
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
