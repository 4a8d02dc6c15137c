//! How a scene becomes a frame.
//!
//! 1. Vertices and solids are put where they are when their row is exposed (`scene`).
//! 2. Light on the vertices; triangles with glare or shadow are noted (`light`).
//! 3. Triangles, plate and solids are drawn, nearest first by 1/z at each pixel's own ray (`raster`).
//! 4. Pixels on outlines are cut up (`outline`); dots are painted with the exact share of each pixel that they cover (`paint`).
//! 5. Blur, vignetting, noise, eight bits (`sensor`), and depth with its faults (`depth`).

use super::camera::{Camera, Rays};
use super::depth::{DepthNoise, DepthSetup, measure};
use super::error::{PixelError, within};
use super::frame::{Depth, DotTruth, Frame, Grey};
use super::light::{Finish, Lighting, Shading};
use super::noise::{Normal, Use, stream};
use super::paint::{Painted, Seen};
use super::raster::{Picture, VertexLight, View};
use super::scene::{Dot, Placed, Scene};
use super::sensor::Sensor;
use super::spread::Spread;
use super::surface::{NONE, Surface};
use crate::geometry::{Triangle, Vec3};
use nalgebra::Point3;

/// When rows are exposed, and what the camera's clock makes of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shutter {
    /// Time from one row to the next (s); 0 exposes all at once.
    pub row_s: f64,
    /// By how much the reported time is late on average (s).
    pub late_s: f64,
    /// Standard deviation of that (s).
    pub jitter_s: f64,
    /// The reported time is a multiple of this (s); 0 for exact.
    pub tick_s: f64,
}

/// Everything about the camera and the light, which does not change from frame to frame.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelSetup {
    /// Camera with its lens and place.
    pub camera: Camera,
    /// Grey sensor.
    pub sensor: Sensor,
    /// Shutter and clock.
    pub shutter: Shutter,
    /// Light.
    pub lighting: Lighting,
    /// Looks of the surfaces.
    pub finish: Finish,
    /// Depth, if it is measured.
    pub depth: Option<DepthSetup>,
    /// Seed of all noise.
    pub seed: u64,
}

/// A camera in front of a phantom. Equal setups make frames equal to the last bit, whichever frames were made before.
pub struct Renderer {
    setup: PixelSetup,
    surface: Surface,
    dots: Vec<Painted>,
    rays: Rays,
    normal: Normal,
    spread: Spread,
    picture: Picture,
    /// What the depth's noise has in common in all frames.
    fixed: Vec<f32>,
    /// Grey levels before noise, where depth asks for them.
    clean: Vec<f32>,
    /// How much the gel sends back at each vertex.
    gel: Vec<f64>,
    /// What the picture shows.
    drawn: Option<Drawn>,
    /// Memory of frames that nobody needs any more.
    spare: (Vec<u8>, Vec<u16>),
}

/// A scene that has been drawn: nothing has to be drawn anew where nothing has moved.
struct Drawn {
    placed: Placed,
    plate_m: f64,
    seen: Vec<Seen>,
}

impl PixelSetup {
    /// A camera with everything else as usual.
    pub fn new(camera: Camera, seed: u64) -> Self {
        Self {
            camera,
            sensor: Sensor::default(),
            shutter: Shutter::default(),
            lighting: Lighting::default(),
            finish: Finish::default(),
            depth: Some(DepthSetup::default()),
            seed,
        }
    }

    /// Refuses figures that mean nothing.
    ///
    /// # Errors
    /// [`PixelError::BadFigure`].
    pub fn check(&self) -> Result<(), PixelError> {
        self.camera.check()?;
        self.sensor.check()?;
        self.lighting.check()?;
        self.finish.check()?;
        if let Some(depth) = &self.depth {
            depth.check()?;
        }
        let Shutter { row_s, late_s, jitter_s, tick_s } = self.shutter;
        within("the time from row to row (s)", row_s, -1.0, 1.0, "at most 1 s")?;
        within("the lateness of the camera's clock (s)", late_s, -1e3, 1e3, "at most 1000 s")?;
        within("the jitter of the camera's clock (s)", jitter_s, 0.0, 1e3, "0 or more")?;
        within("the tick of the camera's clock (s)", tick_s, 0.0, 1e3, "0 or more")
    }
}

impl Renderer {
    /// Puts a camera in front of a surface with dots. Takes about as long as ten frames.
    ///
    /// # Errors
    /// [`PixelError`]: a figure that means nothing, a lens that folds over, a dot off the surface.
    pub fn new(setup: PixelSetup, surface: Surface, dots: &[Dot]) -> Result<Self, PixelError> {
        setup.check()?;
        let triangles = surface.triangles().len();
        for dot in dots {
            if dot.place.triangle as usize >= triangles {
                let triangle = dot.place.triangle;
                return Err(PixelError::NoSuchTriangle { dot: dot.number, triangle, triangles });
            }
            within("a dot's radius (m)", dot.radius_m, 1e-6, 1.0, "1 µm to 1 m")?;
            within("a dot's raggedness", dot.raggedness, 0.0, 0.3, "0 to 0.3")?;
        }
        let dots = dots.iter().map(|&dot| Painted::new(dot, &surface)).collect();
        let rays = Rays::of(&setup.camera)?;
        let (mut normal, spread) = (Normal::new(), Spread::new(setup.sensor.blur_px));
        let asks = |depth: &DepthSetup| depth.noise_m > 0.0 && depth.fixed_share > 0.0;
        let fixed = if setup.depth.as_ref().is_some_and(asks) { rays.x.len() } else { 0 };
        let mut fixed = vec![0.0; fixed];
        normal.fill(&mut stream(setup.seed, 0, Use::FixedDepth), &mut fixed);
        let gel = surface.rest().iter().map(|rest| setup.finish.gel(rest)).collect();
        let (picture, clean, drawn) = (Picture::default(), Vec::new(), None);
        Ok(Self {
            setup,
            surface,
            dots,
            rays,
            normal,
            spread,
            picture,
            fixed,
            clean,
            gel,
            drawn,
            spare: Default::default(),
        })
    }

    /// What it was made from.
    pub fn setup(&self) -> &PixelSetup {
        &self.setup
    }

    /// The surface at rest.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Takes frame `number` of a scene, its first row at `time_s`.
    ///
    /// # Errors
    /// [`PixelError`]: another number of vertices than the surface has, too many solids.
    pub fn frame(&mut self, scene: &Scene, number: u32, time_s: f64) -> Result<Frame, PixelError> {
        scene.check(&self.surface)?;
        let camera = self.setup.camera;
        let (before, known) = match self.drawn.take() {
            Some(Drawn { placed, plate_m, seen }) => (Some(placed), Some((plate_m, seen))),
            None => (None, None),
        };
        let row_s = self.setup.shutter.row_s;
        let (placed, stayed) = Placed::new(scene, &self.surface, &camera, row_s, before);
        let seen = match known {
            Some((plate_m, seen)) if stayed && plate_m == scene.plate_m => seen,
            _ => self.draw(scene, &placed),
        };
        let drawn = Drawn { placed, plate_m: scene.plate_m, seen };
        let dots = self.truth(&drawn.placed, &drawn.seen, time_s);
        self.drawn = Some(drawn);
        let (width, height) = (camera.width, camera.height);
        let grey = Grey { width, height, levels: self.develop(number) };
        let depth = self.setup.depth.map(|depth| self.measure(&depth, number));
        Ok(Frame { number, time_s, reported_s: self.reported(number, time_s), grey, depth, dots })
    }

    /// Takes a frame that nobody needs any more: the next is made of its memory.
    pub fn take_back(&mut self, frame: Frame) {
        self.spare = (frame.grey.levels, frame.depth.map_or_else(Vec::new, |depth| depth.counts));
    }

    /// Draws the scene as the lens shows it, and tells how much of each dot is seen.
    fn draw(&mut self, scene: &Scene, placed: &Placed) -> Vec<Seen> {
        let (setup, camera) = (&self.setup, &self.setup.camera);
        let shading = Shading::new(&setup.lighting, &setup.finish, &placed.solids, camera.eye());
        let shadow = setup.depth.filter(|depth| depth.shadow);
        let projector =
            shadow.map(|depth| camera.pose.inverse_transform_point(&Point3::from(depth.projector_m)).coords);
        let glare_grey = setup.depth.and_then(|depth| depth.glare_grey).unwrap_or(f64::INFINITY);
        let view = View {
            camera,
            rays: &self.rays,
            surface: &self.surface,
            placed,
            shading: &shading,
            light: &VertexLight::new(&self.surface, placed, &shading, &self.gel, projector),
            projector,
            plate_m: scene.plate_m,
            glare_from: (glare_grey / setup.sensor.grey_per_radiance.max(1e-9)) as f32,
        };
        let picture = &mut self.picture;
        picture.clear(camera.width, camera.height);
        view.draw_surface(picture);
        view.draw_plate(picture);
        view.draw_solids(picture);
        view.smooth_outlines(picture);
        self.dots.iter().map(|dot| view.paint(dot, &self.spread, picture)).collect()
    }

    fn develop(&mut self, number: u32) -> Vec<u8> {
        let (setup, picture) = (&self.setup, &self.picture);
        let width = picture.width;
        let mut levels = std::mem::take(&mut self.spare.0);
        levels.resize(width * picture.height, 0);
        let keep = setup.depth.is_some();
        self.clean.resize(if keep { levels.len() } else { 0 }, 0.0);
        let clean = &mut self.clean;
        setup.sensor.develop(
            picture,
            &self.spread,
            setup.camera.lens.centre_px,
            (&mut self.normal, &mut stream(setup.seed, number, Use::Sensor)),
            &mut levels,
            |row, light| {
                if keep {
                    clean[row * width..(row + 1) * width].copy_from_slice(light);
                }
            },
        );
        levels
    }

    fn measure(&mut self, depth: &DepthSetup, number: u32) -> Depth {
        let seed = self.setup.seed;
        let noise = DepthNoise {
            normal: &mut self.normal,
            fresh: stream(seed, number, Use::Depth),
            fixed: &self.fixed,
            holes: stream(seed, number, Use::Holes),
        };
        let (width, height, unit_m) = (self.picture.width, self.picture.height, depth.unit_m);
        let mut counts = std::mem::take(&mut self.spare.1);
        counts.resize(width * height, 0);
        measure(depth, &self.picture, &self.clean, noise, &mut counts);
        Depth { width, height, unit_m, counts }
    }

    fn reported(&self, number: u32, time_s: f64) -> f64 {
        let Shutter { late_s, jitter_s, tick_s, .. } = self.setup.shutter;
        let error = self.normal.one(&mut stream(self.setup.seed, number, Use::Time));
        let told = time_s + late_s + jitter_s * error;
        if tick_s > 0.0 { (told / tick_s).round() * tick_s } else { told }
    }

    fn truth(&self, placed: &Placed, seen: &[Seen], time_s: f64) -> Vec<DotTruth> {
        let truth = |(painted, seen): (&Painted, &Seen)| {
            let place = &painted.dot.place;
            let position_m = self.surface.at(place, &placed.positions);
            let normal =
                Triangle(self.surface.corners(place.triangle, &placed.normals)).at(place.barycentric);
            let pixel = self.setup.camera.project(&position_m);
            let row = pixel.map_or(0.0, |p| p[1]);
            DotTruth {
                number: painted.dot.number,
                position_m,
                normal: normal.normalize(),
                pixel,
                visible: self.visible(seen, placed, pixel, &position_m),
                time_s: time_s + self.setup.shutter.row_s * row,
            }
        };
        self.dots.iter().zip(seen).map(truth).collect()
    }

    /// Share of a dot that is seen.
    ///
    /// What the picture shows of it without the solids is the whole dot, unless its middle lies outside the picture or behind a fold of
    /// the surface itself, or a good part of it is missing; then the whole is what it would be on a flat surface.
    fn visible(&self, seen: &Seen, placed: &Placed, pixel: Option<[f64; 2]>, position_m: &Vec3) -> f64 {
        let Some(pixel) = pixel else { return 0.0 };
        let picture = &self.picture;
        let [column, row] = pixel.map(f64::round);
        let inside =
            (0.0..picture.width as f64).contains(&column) && (0.0..picture.height as f64).contains(&row);
        let folded = inside && {
            let at = row as usize * picture.width + column as usize;
            let triangle = picture.triangle[at];
            let ray = [f64::from(self.rays.x[at]), f64::from(self.rays.y[at])];
            // Another part of the surface, nearer than the dot by more than a millimetre.
            triangle != NONE && {
                let nearness: f64 = placed.weights(triangle, ray).iter().sum();
                nearness > 1.0 / (self.setup.camera.seen(position_m).z - 1e-3)
            }
        };
        let whole = if !inside || folded || seen.whole < 0.8 * seen.flat { seen.flat } else { seen.whole };
        if whole > 0.0 { (seen.visible / whole).clamp(0.0, 1.0) } else { 0.0 }
    }
}

#[cfg(test)]
impl Renderer {
    /// Grey levels of the last frame before noise and rounding.
    pub(super) fn light(&self) -> &[f32] {
        &self.clean
    }
}
