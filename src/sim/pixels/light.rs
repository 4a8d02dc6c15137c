//! How much light a place sends to the camera: uneven ambient light, lamps with soft shadows, and the mirror image of a lamp in a wet skin.
//!
//! Units: irradiance 1 makes a perfectly white matt surface send radiance 1. Everything in the phantom frame (m).

use super::error::{PixelError, within};
use super::solid::Solid;
use crate::geometry::Vec3;
use nalgebra::Vector3;

pub(super) type Single = Vector3<f32>;

/// A small lamp that shines evenly in all directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lamp {
    /// Where it is (m).
    pub position_m: Vec3,
    /// Irradiance times the square of the distance (m²): 0.25 gives 1 at 0.5 m.
    pub strength_m2: f64,
    /// Radius of what shines (m): shadows have soft edges because of it.
    pub radius_m: f64,
}

/// What lights the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Lighting {
    /// Ambient irradiance at the origin of the phantom frame.
    pub ambient: f64,
    /// How it changes (1/m).
    pub ambient_slope_per_m: Vec3,
    /// One or two lamps.
    pub lamps: Vec<Lamp>,
}

/// What the surfaces are like.
#[derive(Debug, Clone, PartialEq)]
pub struct Finish {
    /// Share of the light that the dyed gel sends back.
    pub gel_reflectance: f64,
    /// How much that varies over the gel, as a share of it.
    pub gel_mottle: f64,
    /// Share that a dot sends back.
    pub dot_reflectance: f64,
    /// Share that what the phantom stands on sends back.
    pub plate_reflectance: f64,
    /// Share that a wet skin mirrors at normal incidence; water 0.02, 0 for a dry one.
    pub wet_reflectance: f64,
    /// Root-mean-square slope of the skin's small facets (Beckmann's m): 0.01 mirrors, 0.2 is satin.
    pub wet_roughness: f64,
    /// Slope of the ripples that can be seen, largest.
    pub ripple_slope: f64,
    /// Their wavelength (m).
    pub ripple_m: f64,
}

impl Default for Lighting {
    /// A ring of ambient light, brighter to the right, and one lamp on the left.
    fn default() -> Self {
        Self {
            ambient: 0.55,
            ambient_slope_per_m: Vec3::new(1.2, -0.5, 0.0),
            lamps: vec![Lamp {
                position_m: Vec3::new(-0.25, 0.30, 0.55),
                strength_m2: 0.16,
                radius_m: 0.012,
            }],
        }
    }
}

impl Default for Finish {
    /// Dyed black, wet, with white dots, on a dark plate.
    fn default() -> Self {
        Self {
            gel_reflectance: 0.05,
            gel_mottle: 0.15,
            dot_reflectance: 0.85,
            plate_reflectance: 0.10,
            wet_reflectance: 0.025,
            wet_roughness: 0.03,
            ripple_slope: 0.015,
            ripple_m: 0.007,
        }
    }
}

impl Lighting {
    pub(super) fn check(&self) -> Result<(), PixelError> {
        within("the ambient irradiance", self.ambient, 0.0, 1e6, "0 or more")?;
        for lamp in &self.lamps {
            within("a lamp's strength (m²)", lamp.strength_m2, 0.0, 1e6, "0 or more")?;
            within("a lamp's radius (m)", lamp.radius_m, 0.0, 1.0, "0 to 1 m")?;
        }
        Ok(())
    }
}

impl Finish {
    /// How much the gel sends back at a place of the resting surface (m).
    pub(super) fn gel(&self, rest: &Vec3) -> f64 {
        let wave = |x: f64, y: f64, phase: f64| ((x * rest.x + y * rest.y + 90.0 * rest.z) + phase).sin();
        let mottle = wave(210.0, 95.0, 0.4) + wave(-130.0, 260.0, 1.3) + wave(480.0, -390.0, 2.2);
        self.gel_reflectance * (1.0 + self.gel_mottle * mottle / 3.0)
    }

    pub(super) fn check(&self) -> Result<(), PixelError> {
        for (what, share) in [
            ("the gel's reflectance", self.gel_reflectance),
            ("the gel's mottle", self.gel_mottle),
            ("the dots' reflectance", self.dot_reflectance),
            ("the plate's reflectance", self.plate_reflectance),
            ("the wet skin's reflectance", self.wet_reflectance),
        ] {
            within(what, share, 0.0, 1.0, "0 to 1")?;
        }
        within("the wet skin's roughness", self.wet_roughness, 1e-3, 1.0, "0.001 to 1")?;
        within("the ripples' slope", self.ripple_slope, 0.0, 0.5, "0 to 0.5")?;
        within("the ripples' wavelength (m)", self.ripple_m, 1e-4, 1.0, "0.1 mm to 1 m")
    }
}

/// Light on one place: what a matt surface there gets, and what the wet skin mirrors.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lit {
    pub(super) irradiance: f32,
    pub(super) glare: f32,
}

/// Waves in the film of water: direction times 2π (the wavelength is another's figure), phase, share of the slope.
const RIPPLES: [([f32; 2], f32, f32); 4] = [
    ([6.10, 1.50], 0.3, 0.40),
    ([-2.70, 7.20], 1.9, 0.30),
    ([9.80, -6.30], 4.1, 0.20),
    ([4.40, 12.6], 5.2, 0.10),
];

/// Everything that lights one frame.
pub(super) struct Shading<'a> {
    lighting: &'a Lighting,
    finish: &'a Finish,
    solids: &'a [Solid],
    eye: Single,
    /// The following once more in single precision: at the origin, and its slope.
    ambient: (f32, Single),
    bright: Vec<Bright>,
    /// 1/m² of Beckmann's distribution.
    sharpness: f32,
    /// F/4m².
    mirrored: f32,
    /// Squared cosine between normal and mirroring direction below which nothing is mirrored.
    least_cosine_squared: f32,
}

/// A lamp in single precision.
struct Bright {
    position: Single,
    strength: f32,
}

impl<'a> Shading<'a> {
    pub(super) fn new(lighting: &'a Lighting, finish: &'a Finish, solids: &'a [Solid], eye: Vec3) -> Self {
        let single = |v: Vec3| v.map(|x| x as f32);
        let bright =
            |lamp: &Lamp| Bright { position: single(lamp.position_m), strength: lamp.strength_m2 as f32 };
        let sharpness = finish.wet_roughness.powi(-2);
        Self {
            lighting,
            finish,
            solids,
            eye: single(eye),
            ambient: (lighting.ambient as f32, single(lighting.ambient_slope_per_m)),
            bright: lighting.lamps.iter().map(bright).collect(),
            sharpness: sharpness as f32,
            mirrored: (0.25 * finish.wet_reflectance * sharpness) as f32,
            least_cosine_squared: mirror_reach(finish).cos().powi(2) as f32,
        }
    }

    /// Light on a matt surface, lamps' shadows included when `shaded`.
    pub(super) fn irradiance(&self, place: &Vec3, normal: &Vec3, shaded: bool) -> f64 {
        let ambient = self.lighting.ambient + self.lighting.ambient_slope_per_m.dot(place);
        let lamps = self.lighting.lamps.iter().map(|lamp| {
            let way = lamp.position_m - place;
            let square = way.norm_squared();
            let cosine = (normal.dot(&way) / square.sqrt()).max(0.0);
            let free = if shaded { self.free(place, lamp) } else { 1.0 };
            free * lamp.strength_m2 * cosine / square
        });
        ambient.max(0.0) + lamps.sum::<f64>()
    }

    /// Share of a lamp that is not hidden by the solids.
    fn free(&self, place: &Vec3, lamp: &Lamp) -> f64 {
        let soft = 0.5 * lamp.radius_m + 1e-9;
        let share = |solid: &Solid| smooth(0.5 + 0.5 * solid.clearance(place, &lamp.position_m) / soft);
        self.solids.iter().map(share).fold(1.0, f64::min)
    }

    /// How far (m) a place is from all lamps' shadows, at least.
    pub(super) fn shadow_distance(&self, place: &Vec3) -> f64 {
        let apart = |lamp: &Lamp| {
            let clear = self.solids.iter().map(|solid| solid.clearance(place, &lamp.position_m));
            clear.fold(f64::INFINITY, f64::min) - 0.5 * lamp.radius_m
        };
        self.lighting.lamps.iter().map(apart).fold(f64::INFINITY, f64::min)
    }

    /// By how much (rad) at least the normal of a place misses the nearest direction that mirrors a lamp to the camera; less than 0 where
    /// glare may be seen.
    pub(super) fn short_of_glare(&self, place: &Vec3, normal: &Vec3) -> f64 {
        if self.finish.wet_reflectance == 0.0 {
            return f64::INFINITY;
        }
        let view = (self.eye.map(f64::from) - place).normalize();
        let reach = mirror_reach(self.finish);
        let short = |lamp: &Lamp| {
            let half = ((lamp.position_m - place).normalize() + view).normalize();
            // An angle is no less than its chord on the unit circle.
            (2.0 * (1.0 - half.dot(normal)).max(0.0)).sqrt() - reach
        };
        self.lighting.lamps.iter().map(short).fold(f64::INFINITY, f64::min)
    }

    /// Light on one place of the wet skin, pixel by pixel.
    ///
    /// Glare: E_lamp · F · D · π / (4 n·v) with Beckmann's D (Cook and Torrance 1982, eq. 9), whose exponential is
    /// replaced by the compact (1 − t/8)⁸, t = tan²/m²: places where nothing is mirrored are known beforehand.
    pub(super) fn lit(&self, place: &Single, normal: &Single, shaded: bool) -> Lit {
        let ambient = self.ambient.0 + self.ambient.1.dot(place);
        let mut lit = Lit { irradiance: ambient.max(0.0), glare: 0.0 };
        let view = self.eye - place;
        let view = view * (1.0 / view.norm_squared().sqrt());
        let mut rippled = None;
        for (lamp, bright) in self.lighting.lamps.iter().zip(&self.bright) {
            let way = bright.position - place;
            let nearness = 1.0 / way.norm_squared().sqrt();
            let way = way * nearness;
            let free = if shaded { self.free(&place.map(f64::from), lamp) as f32 } else { 1.0 };
            let strength = free * bright.strength * nearness * nearness;
            lit.irradiance += strength * normal.dot(&way).max(0.0);
            let half = way + view;
            let square = half.norm_squared();
            let plain = half.dot(normal);
            // Ripples do not turn the normal far enough to mirror anything.
            if plain <= 0.0 || plain * plain < self.least_cosine_squared * square {
                continue;
            }
            let cosine = half.dot(rippled.get_or_insert_with(|| self.rippled(place, normal))).max(1e-6);
            let square_cosine = cosine * cosine;
            let t = (square - square_cosine) * self.sharpness / square_cosine;
            let lobe = (1.0 - t * (1.0 / LOBE_POWER)).max(0.0);
            let lobe = (lobe * lobe) * (lobe * lobe);
            let lobe = lobe * lobe;
            lit.glare += strength * self.mirrored * lobe / view.dot(normal).max(0.2);
        }
        lit
    }

    /// The normal with the ripples of the film of water (of unit length to second order in their slope).
    fn rippled(&self, place: &Single, normal: &Single) -> Single {
        let (slope, length) = (self.finish.ripple_slope as f32, self.finish.ripple_m as f32);
        if slope == 0.0 {
            return *normal;
        }
        let mut tilt = Single::zeros();
        for ([kx, ky], phase, share) in RIPPLES {
            let wave = share * slope * sine((kx * place.x + ky * place.y) / length + phase);
            let size = (kx * kx + ky * ky).sqrt();
            tilt.x += wave * kx / size;
            tilt.y += wave * ky / size;
        }
        normal + tilt
    }

    pub(super) fn finish(&self) -> &Finish {
        self.finish
    }
}

/// Largest angle (rad) between the skin's normal and a direction that mirrors a lamp to the camera.
fn mirror_reach(finish: &Finish) -> f64 {
    let facets = (f64::from(LOBE_POWER).sqrt() * finish.wet_roughness).atan();
    (facets + 1.2 * finish.ripple_slope).min(1.5)
}

/// Power of the lobe.
const LOBE_POWER: f32 = 8.0;

/// A step from 0 to 1 over 0 … 1 with level ends.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// A sine to 0.1 %, without a call: a parabola and its correction over one period.
fn sine(x: f32) -> f32 {
    let turns = x * std::f32::consts::FRAC_1_PI * 0.5;
    // Adding and taking away 1.5 · 2²³ rounds to whole numbers.
    let turns = turns - ((turns + 12_582_912.0) - 12_582_912.0);
    let parabola = 8.0 * turns - 16.0 * turns * turns.abs();
    parabola * (0.775 + 0.225 * parabola.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sine_is_one() {
        for i in -1000..1000 {
            let x = 0.02 * i as f32;
            assert!((sine(x) - x.sin()).abs() < 2e-3, "{x}");
        }
    }

    /// A lamp right above at a distance d: strength/d², at an angle times its cosine; nothing behind an opaque ball.
    #[test]
    fn a_lamp_obeys_the_inverse_square() {
        let lamp = Lamp { position_m: Vec3::new(0.0, 0.0, 0.5), strength_m2: 0.25, radius_m: 0.01 };
        let lighting = Lighting { ambient: 0.1, ambient_slope_per_m: Vec3::zeros(), lamps: vec![lamp] };
        let finish = Finish { wet_reflectance: 0.0, ..Finish::default() };
        let shape = super::super::solid::Shape::Ball { centre_m: Vec3::new(0.0, 0.0, 0.3), radius_m: 0.02 };
        let ball = [Solid { shape, reflectance: 0.5 }];
        let shading = Shading::new(&lighting, &finish, &ball, Vec3::new(0.0, 0.0, 1.0));
        let open = |place: Vec3| shading.irradiance(&place, &Vec3::z(), false);
        assert!((open(Vec3::zeros()) - 1.1).abs() < 1e-12);
        assert!((open(Vec3::new(0.5, 0.0, 0.0)) - 0.1 - 0.25 / 0.5 * 0.5_f64.sqrt()).abs() < 1e-12);
        assert!((shading.irradiance(&Vec3::zeros(), &Vec3::z(), true) - 0.1).abs() < 1e-12);
        assert!(shading.shadow_distance(&Vec3::zeros()) < 0.0);
        assert!(shading.shadow_distance(&Vec3::new(0.2, 0.0, 0.0)) > 0.001);
        // Pixel by pixel it is the same.
        let place = Single::new(0.3, 0.1, 0.0);
        let lit = shading.lit(&place, &Single::z(), true);
        assert!((f64::from(lit.irradiance) - open(place.map(f64::from))).abs() < 1e-5 && lit.glare == 0.0);
    }
}
