//! What a rig file says of the simulated camera → the setup of a camera that takes pictures of the simulated phantom.
//!
//! Like the rest of `[simulation]` this is the truth, which tracking and fits never see.

use super::open::SimulatedBench;
use super::{RigError, RigFile};
use crate::geometry::Vec3;
use crate::sim::pixels::{Camera, DepthSetup, Lamp, Lens, PixelSetup};
use crate::sim::{PixelCameraSetup, SkinCut};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// `[simulation.camera]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraKeys {
    // Picture and lens.
    size_px: [usize; 2],
    focal_px: [f64; 2],
    centre_px: Option<[f64; 2]>,
    #[serde(default)]
    radial: [f64; 3],
    #[serde(default)]
    tangential: [f64; 2],
    // Where it stands, in the phantom frame.
    eye_mm: [f64; 3],
    target_mm: [f64; 3],
    up: [f64; 3],
    // Where the truth is written.
    truth: Option<String>,
    // What is painted on the phantom, and how finely its surface is cut.
    dot_radius_mm: f64,
    #[serde(default)]
    fiducials_mm: Vec<[f64; 3]>,
    dot_raggedness: Option<f64>,
    surface_mm: Option<f64>,
    surface_at_tips_mm: Option<f64>,
    // Grey sensor.
    grey_per_radiance: Option<f64>,
    black_grey: Option<f64>,
    blur_px: Option<f64>,
    falloff: Option<f64>,
    read_noise_grey: Option<f64>,
    shot_noise_grey: Option<f64>,
    // Shutter and clock.
    row_us: Option<f64>,
    late_ms: Option<f64>,
    jitter_ms: Option<f64>,
    tick_ms: Option<f64>,
    // Light and looks.
    ambient: Option<f64>,
    ambient_slope_per_m: Option<[f64; 3]>,
    lamps: Option<Vec<LampKeys>>,
    gel_reflectance: Option<f64>,
    gel_mottle: Option<f64>,
    dot_reflectance: Option<f64>,
    plate_reflectance: Option<f64>,
    wet_reflectance: Option<f64>,
    wet_roughness: Option<f64>,
    ripple_slope: Option<f64>,
    ripple_mm: Option<f64>,
    // Depth.
    depth: Option<bool>,
    depth_unit_mm: Option<f64>,
    projector_mm: Option<[f64; 3]>,
    depth_shadow: Option<bool>,
    depth_reference_mm: Option<f64>,
    depth_noise_mm: Option<f64>,
    depth_fixed_share: Option<f64>,
    depth_step_mm: Option<f64>,
    depth_glare_grey: Option<f64>,
    depth_dark_grey: Option<f64>,
    depth_saturated_share: Option<f64>,
    depth_jump_mm: Option<f64>,
    depth_edge_bias_mm: Option<f64>,
    depth_edge_pull_mm: Option<f64>,
}

/// One lamp.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct LampKeys {
    position_mm: [f64; 3],
    strength_m2: f64,
    radius_mm: f64,
}

const MM: f64 = 1e-3;
/// A direction upwards that makes a smaller angle with the line of sight than this sine shows nothing of what is up.
const UP: f64 = 0.02;

/// Takes a key's place in SI, if it is there.
fn set<T: Copy>(target: &mut T, key: Option<T>) {
    *target = key.unwrap_or(*target);
}

/// The same for a figure in a unit of which SI has `unit`.
fn scaled(target: &mut f64, key: Option<f64>, unit: f64) {
    *target = key.map_or(*target, |value| value * unit);
}

impl CameraKeys {
    /// The camera, `rate_hz` frames a second, with a seed for its noise.
    pub(super) fn setup(&self, file: &Path, rate_hz: f64, seed: u64) -> Result<PixelCameraSetup, RigError> {
        let mut pixels = PixelSetup::new(self.camera(file)?, seed);
        self.grey(&mut pixels);
        self.light(&mut pixels);
        pixels.depth = self.depth.unwrap_or(true).then(|| self.depth_setup());
        pixels.check().map_err(|source| RigError::Camera { file: file.to_owned(), source })?;
        let mut setup = PixelCameraSetup::new(pixels, rate_hz);
        setup.dot_radius_m = self.dot_radius_mm * MM;
        setup.fiducials_m = self.fiducials_mm.iter().map(|place| place.map(|x| x * MM)).collect();
        set(&mut setup.dot_raggedness, self.dot_raggedness);
        let SkinCut { cell_m, rim_cell_m, .. } = &mut setup.cut;
        scaled(cell_m, self.surface_mm, MM);
        scaled(rim_cell_m, self.surface_at_tips_mm, MM);
        Ok(setup)
    }

    /// The file that takes down where the dots truly are, if one is to.
    pub(super) fn truth(&self, rig: &RigFile) -> Option<PathBuf> {
        self.truth.as_ref().map(|name| rig.file.parent().unwrap_or(Path::new("")).join(name))
    }

    fn camera(&self, file: &Path) -> Result<Camera, RigError> {
        let metres = |mm: [f64; 3]| Vec3::from(mm) * MM;
        let (eye, target, up) = (metres(self.eye_mm), metres(self.target_mm), Vec3::from(self.up));
        let aside = (target - eye).normalize().cross(&up.normalize()).norm();
        // Also where there is no direction at all, and no number.
        if !(UP..=2.0).contains(&aside) {
            return Err(RigError::Value {
                file: file.to_owned(),
                key: "simulation.camera.up",
                found: format!("{:?}", self.up),
                expected: "a direction other than that from eye_mm to target_mm, which are two places",
            });
        }
        let [width, height] = self.size_px;
        let middle = Lens::undistorted(1.0, width, height).centre_px;
        let lens = Lens {
            focal_px: self.focal_px,
            centre_px: self.centre_px.unwrap_or(middle),
            radial: self.radial,
            tangential: self.tangential,
        };
        Ok(Camera::looking_at(lens, self.size_px, eye, target, up))
    }

    fn grey(&self, pixels: &mut PixelSetup) {
        let (sensor, shutter) = (&mut pixels.sensor, &mut pixels.shutter);
        set(&mut sensor.grey_per_radiance, self.grey_per_radiance);
        set(&mut sensor.black_grey, self.black_grey);
        set(&mut sensor.blur_px, self.blur_px);
        set(&mut sensor.falloff, self.falloff);
        set(&mut sensor.read_grey, self.read_noise_grey);
        set(&mut sensor.shot_grey, self.shot_noise_grey);
        scaled(&mut shutter.row_s, self.row_us, 1e-6);
        scaled(&mut shutter.late_s, self.late_ms, 1e-3);
        scaled(&mut shutter.jitter_s, self.jitter_ms, 1e-3);
        scaled(&mut shutter.tick_s, self.tick_ms, 1e-3);
    }

    fn light(&self, pixels: &mut PixelSetup) {
        let (lighting, finish) = (&mut pixels.lighting, &mut pixels.finish);
        set(&mut lighting.ambient, self.ambient);
        set(&mut lighting.ambient_slope_per_m, self.ambient_slope_per_m.map(Vec3::from));
        if let Some(lamps) = &self.lamps {
            let lamp = |keys: &LampKeys| Lamp {
                position_m: Vec3::from(keys.position_mm) * MM,
                strength_m2: keys.strength_m2,
                radius_m: keys.radius_mm * MM,
            };
            lighting.lamps = lamps.iter().map(lamp).collect();
        }
        set(&mut finish.gel_reflectance, self.gel_reflectance);
        set(&mut finish.gel_mottle, self.gel_mottle);
        set(&mut finish.dot_reflectance, self.dot_reflectance);
        set(&mut finish.plate_reflectance, self.plate_reflectance);
        set(&mut finish.wet_reflectance, self.wet_reflectance);
        set(&mut finish.wet_roughness, self.wet_roughness);
        set(&mut finish.ripple_slope, self.ripple_slope);
        scaled(&mut finish.ripple_m, self.ripple_mm, MM);
    }

    fn depth_setup(&self) -> DepthSetup {
        let mut depth = DepthSetup::default();
        scaled(&mut depth.unit_m, self.depth_unit_mm, MM);
        set(&mut depth.projector_m, self.projector_mm.map(|mm| Vec3::from(mm) * MM));
        set(&mut depth.shadow, self.depth_shadow);
        scaled(&mut depth.reference_m, self.depth_reference_mm, MM);
        scaled(&mut depth.noise_m, self.depth_noise_mm, MM);
        set(&mut depth.fixed_share, self.depth_fixed_share);
        scaled(&mut depth.step_m, self.depth_step_mm, MM);
        // 0 means never: the default would be another.
        let limit = |key: Option<f64>, usual: Option<f64>| match key {
            Some(0.0) => None,
            Some(value) => Some(value),
            None => usual,
        };
        depth.glare_grey = limit(self.depth_glare_grey, depth.glare_grey);
        depth.dark_grey = limit(self.depth_dark_grey, depth.dark_grey);
        depth.jump_m = limit(self.depth_jump_mm.map(|mm| mm * MM), depth.jump_m);
        set(&mut depth.saturated_share, self.depth_saturated_share);
        scaled(&mut depth.edge_bias_m, self.depth_edge_bias_mm, MM);
        scaled(&mut depth.edge_pull_m, self.depth_edge_pull_mm, MM);
        depth
    }
}

impl RigFile {
    /// The simulated camera above a simulated bench, which gives it its seed; none where the file has no section `[simulation.camera]`.
    /// It takes pictures of a bench that was prepared with a skin of its cut ([`LiveBench::seen`](crate::sim::LiveBench::seen)).
    ///
    /// # Errors
    /// [`RigError`]: a figure that means nothing.
    pub fn simulated_camera(&self, bench: &SimulatedBench) -> Result<Option<PixelCameraSetup>, RigError> {
        let keys = self.keys.simulation.as_ref().and_then(|s| s.camera());
        let rate_hz = bench.world.instruments.frame_rate_hz;
        keys.map(|keys| keys.setup(&self.file, rate_hz, bench.world.seed)).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEAST: &str = "size_px = [640, 480]\nfocal_px = [1620.0, 1620.0]\neye_mm = [190, 75, 480]\n\
                         target_mm = [50, 75, 20]\nup = [-1, 0, 0]\ndot_radius_mm = 1.3\n";

    fn setup(text: &str) -> Result<PixelCameraSetup, RigError> {
        let keys: CameraKeys = toml::from_str(text).expect("known keys");
        keys.setup(Path::new("rig.toml"), 30.0, 7)
    }

    #[test]
    fn what_is_left_out_is_as_usual() -> Result<(), RigError> {
        let camera = setup(LEAST)?.pixels.camera;
        let middle = camera.project(&Vec3::new(0.05, 0.075, 0.02)).expect("in front");
        assert!((middle[0] - 319.5).hypot(middle[1] - 239.5) < 1e-9);
        let usual = PixelCameraSetup::new(PixelSetup::new(camera, 7), 30.0);
        assert_eq!(setup(LEAST)?, PixelCameraSetup { dot_radius_m: 1.3 * MM, ..usual });
        Ok(())
    }

    #[test]
    fn keys_are_in_the_units_of_their_names() -> Result<(), RigError> {
        let more = "row_us = 20\nlate_ms = 12\ndepth_noise_mm = 0.2\ndepth_jump_mm = 0\nsurface_mm = 5\n\
                    lamps = [{ position_mm = [0, 100, 500], strength_m2 = 0.2, radius_mm = 10 }]\n";
        let setup = setup(&format!("{LEAST}{more}"))?;
        let (pixels, depth) = (&setup.pixels, setup.pixels.depth.expect("depth"));
        assert_eq!((pixels.shutter.row_s, pixels.shutter.late_s), (20.0 * 1e-6, 12.0 * 1e-3));
        assert_eq!((depth.noise_m, depth.jump_m, setup.cut.cell_m), (0.2 * MM, None, 5.0 * MM));
        let lamp = &pixels.lighting.lamps[0];
        assert!((lamp.position_m - Vec3::new(0.0, 0.1, 0.5)).norm() < 1e-15 && lamp.radius_m == 10.0 * MM);
        Ok(())
    }

    #[test]
    fn what_means_nothing_is_refused() {
        let along = LEAST.replace("up = [-1, 0, 0]", "up = [140, 0, 460]");
        assert!(matches!(setup(&along), Err(RigError::Value { key: "simulation.camera.up", .. })));
        assert!(matches!(setup(&format!("{LEAST}blur_px = -1\n")), Err(RigError::Camera { .. })));
        assert!(toml::from_str::<CameraKeys>(&format!("{LEAST}colour = 3\n")).is_err());
    }
}
