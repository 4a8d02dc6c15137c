//! The camera itself: a glimpse of the phantom → a frame with its truth.

use crate::geometry::Vec3;
use crate::sim::LiveBench;
use crate::sim::pixels::{Dot, Frame, PixelError, PixelSetup, Renderer, Scene, Solid, Surface};
use crate::sim::skin::{Skin, SkinCut};
use crate::sim::world::{Effect, Foreign, Glimpse, Past, Rig, SeenTip, World};

/// Thickness of the tip's pad, radius of its rod and length of that (m).
const PAD_M: f64 = 0.004;
const ROD_M: [f64; 2] = [0.0035, 0.25];

/// Everything about the camera, its light and what is painted on the phantom.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelCameraSetup {
    /// Camera, light, sensor, depth with their faults, and the seed of the noise.
    pub pixels: PixelSetup,
    /// Frames a second.
    pub rate_hz: f64,
    /// Radius of the dots on the resting surface (m).
    pub dot_radius_m: f64,
    /// How much their edges waver: see [`Dot::raggedness`].
    pub dot_raggedness: f64,
    /// Dots on small plates beside the phantom, facing up: their places in the phantom frame (m).
    pub fiducials_m: Vec<[f64; 3]>,
    /// How finely the surface is cut.
    pub cut: SkinCut,
}

/// A camera in front of a simulated phantom.
pub struct PixelCamera {
    renderer: Renderer,
    rate_hz: f64,
    /// Vertices of the skin; those behind them belong to plates, which stand.
    moving: usize,
    /// All vertices when they were last looked at (m).
    positions: Vec<Vec3>,
}

impl PixelCameraSetup {
    /// Dots as on the bench's phantoms, everything else as usual.
    pub fn new(pixels: PixelSetup, rate_hz: f64) -> Self {
        Self {
            pixels,
            rate_hz,
            dot_radius_m: 0.0013,
            dot_raggedness: 0.02,
            fiducials_m: Vec::new(),
            cut: SkinCut::default(),
        }
    }
}

impl PixelCamera {
    /// A camera above a bench that was prepared with a skin ([`LiveBench::seen`]).
    ///
    /// # Errors
    /// [`PixelError`]: no skin, a figure that means nothing, a world in which the marker camera has faults that pictures do not have.
    pub fn above(setup: &PixelCameraSetup, bench: &LiveBench) -> Result<Self, PixelError> {
        let skin = bench.skin().ok_or(PixelError::NoSkin)?;
        Self::new(setup, bench.world(), &skin)
    }

    /// A camera above the phantom of a session that has happened on one prepared with a skin
    /// ([`Phantom::prepare_seen`](crate::sim::Phantom::prepare_seen)).
    ///
    /// # Errors
    /// As for [`PixelCamera::above`].
    pub fn of_past(setup: &PixelCameraSetup, past: &Past) -> Result<Self, PixelError> {
        let skin = past.phantom().skin().ok_or(PixelError::NoSkin)?;
        Self::new(setup, past.world(), skin)
    }

    fn new(setup: &PixelCameraSetup, world: &World, skin: &Skin) -> Result<Self, PixelError> {
        for effect in &world.effects {
            // These say how the camera that tells marker positions is wrong. Pictures have a pose and a lens instead.
            let effect = match effect {
                Effect::Rig(rig @ (Rig::CameraMisalignment { .. } | Rig::CameraScale { .. })) => {
                    rig.physics()
                }
                Effect::Foreign(Foreign::LensDistortion { .. }) => "lens distortion",
                _ => continue,
            };
            return Err(PixelError::NotInPictures { effect });
        }
        if !(setup.rate_hz > 0.0 && setup.rate_hz <= 1e4) {
            let expected = "more than 0, at most 10,000";
            return Err(PixelError::BadFigure {
                what: "the frame rate (Hz)",
                value: setup.rate_hz,
                expected,
            });
        }
        let mut pixels = setup.pixels.clone();
        // What is seen is the past; the stamp says that it is now.
        pixels.shutter.late_s += world.camera_lag_s();
        let mut rest: Vec<Vec3> = skin.points_m.iter().map(|&p| Vec3::from(p)).collect();
        let mut triangles = skin.triangles.clone();
        let moving = rest.len();
        for place in &setup.fiducials_m {
            plate(Vec3::from(*place), PLATE * setup.dot_radius_m, &mut rest, &mut triangles);
        }
        let positions = rest.clone();
        let surface = Surface::new(rest, triangles)?;
        let mut dots = Vec::new();
        let sites = world.phantom.markers().into_iter().chain(setup.fiducials_m.iter().copied());
        for (number, site) in (1..).zip(sites) {
            let place = surface.attach(&Vec3::from(site)).ok_or(PixelError::NoSkin)?;
            let (radius_m, raggedness) = (setup.dot_radius_m, setup.dot_raggedness);
            dots.push(Dot { number, place, radius_m, raggedness });
        }
        let renderer = Renderer::new(pixels, surface, &dots)?;
        Ok(Self { renderer, rate_hz: setup.rate_hz, moving, positions })
    }

    /// Frames a second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// What it was made from; the world's own lag has been added to that of the shutter.
    pub fn setup(&self) -> &PixelSetup {
        self.renderer.setup()
    }

    /// Whether a glimpse should come with velocities: rows are exposed one after the other.
    pub fn sees_motion(&self) -> bool {
        self.setup().shutter.row_s != 0.0
    }

    /// Takes frame `number` of what there is to see. Its true time is that of the glimpse, on the world's own clock.
    ///
    /// # Errors
    /// [`PixelError::VertexCount`]: a glimpse of another skin.
    pub fn frame(&mut self, glimpse: &Glimpse, number: u32) -> Result<Frame, PixelError> {
        let rest = self.renderer.surface().rest();
        if glimpse.moved_m.len() != self.moving {
            let (given, wanted) = (glimpse.moved_m.len(), self.moving);
            return Err(PixelError::VertexCount { what: "displacements", given, wanted });
        }
        for (position, (rest, moved)) in self.positions.iter_mut().zip(rest.iter().zip(&glimpse.moved_m)) {
            *position = rest + moved;
        }
        let solids = glimpse.tip.as_ref().map(solids);
        let solids = solids.as_ref().map_or(&[][..], |solids| &solids[..]);
        let mut speeds = glimpse.speed_m_s.clone();
        if let Some(speeds) = &mut speeds {
            speeds.resize(rest.len(), Vec3::zeros());
        }
        let scene = Scene {
            velocities: speeds.as_deref(),
            solids_velocity: glimpse.tip.map_or(Vec3::zeros(), |tip| tip.velocity_m_s),
            ..Scene::still(&self.positions, solids)
        };
        self.renderer.frame(&scene, number, glimpse.time_s)
    }

    /// Takes a frame that nobody needs any more: the next is made of its memory.
    pub fn take_back(&mut self, frame: Frame) {
        self.renderer.take_back(frame);
    }

    /// All frames of a session that has happened, from its beginning to its end at the camera's rate, each with its truth.
    pub fn film<'a>(
        &'a mut self,
        past: &'a Past<'a>,
    ) -> impl Iterator<Item = Result<Frame, PixelError>> + 'a {
        let (rate_hz, moving) = (self.rate_hz, self.sees_motion());
        let count = (past.end_s() * rate_hz + 1e-6).floor() as u32 + 1;
        (0..count).map(move |number| {
            let glimpse = past.glimpse(f64::from(number) / rate_hz, moving).ok_or(PixelError::NoSkin)?;
            self.frame(&glimpse, number)
        })
    }
}

/// Half the edge of a fiducial's plate, over the radius of its dot: the depth around the dot is measured on it.
const PLATE: f64 = 4.0;

/// Adds a square plate that faces up.
fn plate(centre: Vec3, half: f64, vertices: &mut Vec<Vec3>, triangles: &mut Vec<[u32; 3]>) {
    let first = vertices.len() as u32;
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    vertices.extend(corners.map(|[x, y]| centre + Vec3::new(x * half, y * half, 0.0)));
    triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

/// The tip as solids.
fn solids(tip: &SeenTip) -> [Solid; 2] {
    let rod_m = [ROD_M[0].min(tip.radius_m), ROD_M[1]];
    Solid::pad_on_rod(tip.face_m, tip.outward, [tip.radius_m, PAD_M], rod_m)
}
