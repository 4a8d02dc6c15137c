//! The whole room: pictures in, places in space out; and what it says to pictures that are none.

use super::random::Noise;
use super::render::{Brush, Canvas};
use crate::geometry::{Vec3, basis_from_axis};
use crate::track::{
    Camera, DepthView, DotSettings, GreyView, Lost, NoDepth, Settings, State, TrackError, Tracker,
};

const CAMERA: Camera = Camera {
    size_px: [1280, 1024],
    focal_px: [1400.0, 1395.0],
    principal_px: [645.0, 508.0],
    radial: [-0.12, 0.08, 0.0],
    tangential: [3e-4, -2e-4],
};
const UNIT: f64 = 1e-4;

/// A tilted, dotted plate 14 × 9 dots, 9 mm apart, dots of 1.3 mm radius.
struct Plate {
    centre_m: Vec3,
    normal: Vec3,
}

impl Plate {
    fn dots(&self) -> Vec<Vec3> {
        let basis = basis_from_axis(&self.normal);
        let (e1, e2) = (basis.column(0), basis.column(1));
        (0..126)
            .map(|i| {
                let (a, b) = (f64::from(i % 14) - 6.5, f64::from(i / 14) - 4.0);
                // Off the grid by a little, so that it is no lattice.
                let off = 0.3 * (f64::from(i) * 0.618).fract() - 0.15;
                self.centre_m + (e1 * (a + off) + e2 * (b - off)) * 9e-3
            })
            .collect()
    }

    fn grey(&self, noise: f64, random: &mut Noise) -> Vec<u8> {
        let basis = basis_from_axis(&self.normal);
        let (e1, e2) = (basis.column(0) * 1.3e-3, basis.column(1) * 1.3e-3);
        let brush = Brush::new(0.9);
        let mut canvas = Canvas::new(1280, 1024, |x, y| 28.0 + 0.012 * x + 0.006 * y);
        for dot in self.dots() {
            let rim: Vec<[f64; 2]> = (0..360)
                .map(|k| {
                    let (sin, cos) = f64::from(k).to_radians().sin_cos();
                    CAMERA.project(dot + e1 * cos + e2 * sin).expect("in front")
                })
                .collect();
            canvas.add(&rim, &brush, 150.0);
        }
        canvas.expose(noise, random)
    }

    /// Depth of every pixel, with holes, noise, and dots that read 2 mm too near.
    fn depth(&self, noise_m: f64, random: &mut Noise) -> Vec<u16> {
        let mut values = vec![0_u16; 1280 * 1024];
        let along = self.normal.dot(&self.centre_m);
        for (i, value) in values.iter_mut().enumerate() {
            let pixel = [(i % 1280) as f64, (i / 1280) as f64];
            let ray = CAMERA.undistort(pixel).expect("a ray").push(1.0);
            let z = along / self.normal.dot(&ray) + noise_m * random.normal();
            if random.uniform() > 0.1 {
                *value = (z / UNIT).round() as u16;
            }
        }
        let basis = basis_from_axis(&self.normal);
        for dot in self.dots() {
            let centre = CAMERA.project(dot).expect("in front");
            let rim = CAMERA.project(dot + basis.column(0) * 1.3e-3).expect("in front");
            let radius = (rim[0] - centre[0]).hypot(rim[1] - centre[1]);
            for y in (centre[1] - radius) as usize..=(centre[1] + radius) as usize {
                for x in (centre[0] - radius) as usize..=(centre[0] + radius) as usize {
                    if (x as f64 - centre[0]).hypot(y as f64 - centre[1]) < radius {
                        let value = &mut values[y * 1280 + x];
                        *value = value.saturating_sub(20);
                    }
                }
            }
        }
        values
    }
}

fn settings() -> Settings {
    Settings { dots: DotSettings { radius_px: [3.0, 12.0], ..DotSettings::default() }, ..Settings::default() }
}

fn grey(pixels: &[u8]) -> GreyView<'_> {
    GreyView::new(1280, 1024, 1280, pixels).expect("a picture")
}

fn depth(values: &[u16]) -> DepthView<'_> {
    DepthView::new(1280, 1024, 1280, values, UNIT).expect("a picture")
}

/// Time that this thread has run (s). The scheduler's own account of it is renewed every 4 ms only.
fn thread_s() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

/// Every dot is where it is, within its own covariance: normalised squared errors have the mean 3.
#[test]
fn dots_on_a_tilted_plate_are_where_they_are() {
    for (tilt, noise_m) in [(0.0, 1e-4), (0.5, 1e-4), (0.5, 5e-4)] {
        let mut random = Noise::seeded(4);
        let normal = Vec3::new(f64::sin(tilt) * 0.8, f64::sin(tilt) * 0.6, -f64::cos(tilt));
        let plate = Plate { centre_m: Vec3::new(0.002, -0.003, 0.3), normal };
        let (pixels, values) = (plate.grey(2.0, &mut random), plate.depth(noise_m, &mut random));
        let reference = Tracker::reference_dots(&grey(&pixels), &settings()).expect("settings");
        assert_eq!(reference.len(), 126);
        let mut tracker = Tracker::new(CAMERA, settings(), &reference).expect("a tracker");
        let frame = tracker.step(&grey(&pixels), Some(&depth(&values)), 0.0).expect("a frame");
        assert_eq!(frame.certain(), 126);
        let (mut across, mut along, mut normalised, mut turned, mut shifted) =
            (0.0, 0.0, 0.0, 0.0_f64, 0.0_f64);
        for state in &frame.dots {
            let State::Certain { place: Ok(place), .. } = state else { panic!("{state:?}") };
            let truth = plate
                .dots()
                .into_iter()
                .min_by(|a, b| (a - place.position_m).norm().total_cmp(&(b - place.position_m).norm()))
                .expect("dots");
            let error = place.position_m - truth;
            let ray = truth.normalize();
            along += error.dot(&ray).powi(2);
            across += (error - ray * error.dot(&ray)).norm_squared() / 2.0;
            let inverse = place.covariance_m2.try_inverse().expect("a covariance");
            normalised += (error.transpose() * inverse * error)[0];
            turned = turned.max(place.surface.normal.angle(&normal));
            shifted = shifted.max(place.corrected_px[0].hypot(place.corrected_px[1]));
        }
        println!(
            "tilt {tilt} depth noise {:.1} mm: {:.1} µm across, {:.1} µm along the ray, normalised {:.2} of 3, normals within {:.1}°, corrections up to {shifted:.3} px",
            noise_m * 1e3,
            (across / 126.0).sqrt() * 1e6,
            (along / 126.0).sqrt() * 1e6,
            normalised / 126.0,
            turned.to_degrees()
        );
        assert!((2.0..5.0).contains(&(normalised / 126.0)));
    }
}

/// The figure of the room: a frame of 1280 × 1024 on one core.
#[test]
fn a_frame_takes_little_time() {
    let mut random = Noise::seeded(4);
    let plate = Plate { centre_m: Vec3::new(0.002, -0.003, 0.3), normal: Vec3::new(0.2, 0.1, -1.0) };
    let (pixels, values) = (plate.grey(2.0, &mut random), plate.depth(1e-4, &mut random));
    let reference = Tracker::reference_dots(&grey(&pixels), &settings()).expect("settings");
    let mut tracker = Tracker::new(CAMERA, settings(), &reference).expect("a tracker");
    let mut last = thread_s();
    let mut taken: Vec<f64> = Vec::new();
    for k in 0..40 {
        let frame = tracker.step(&grey(&pixels), Some(&depth(&values)), f64::from(k)).expect("a frame");
        assert_eq!(frame.certain(), 126);
        let now = thread_s();
        taken.push(now - last);
        last = now;
    }
    taken.sort_by(f64::total_cmp);
    println!("a frame: {:.2} ms least, {:.2} ms median of processor time", taken[0] * 1e3, taken[20] * 1e3);
}

/// A step in depth, holes and a picture of nothing: gaps with reasons, identity untouched.
#[test]
fn depth_that_does_not_support_a_dot_is_a_gap() {
    let mut random = Noise::seeded(5);
    let plate = Plate { centre_m: Vec3::new(0.0, 0.0, 0.3), normal: Vec3::new(0.0, 0.0, -1.0) };
    let (pixels, mut values) = (plate.grey(2.0, &mut random), plate.depth(1e-4, &mut random));
    let reference = Tracker::reference_dots(&grey(&pixels), &settings()).expect("settings");
    let mut tracker = Tracker::new(CAMERA, settings(), &reference).expect("a tracker");
    let [step, hole, leaning] = [40, 60, 100].map(|i: usize| reference[i].centre_px);
    for y in 0..1024 {
        for x in 0..1280 {
            let from = |p: [f64; 2]| (x as f64 - p[0]).hypot(y as f64 - p[1]);
            let value = &mut values[y * 1280 + x];
            if from(step) < 30.0 && x as f64 > step[0] + 1.0 {
                *value += 200;
            }
            if from(leaning) < 30.0 {
                *value = (f64::from(*value) + 20.0 * (x as f64 - leaning[0])) as u16;
            }
            if from(hole) < 30.0 && random.uniform() < 0.8 {
                *value = 0;
            }
        }
    }
    let frame = tracker.step(&grey(&pixels), Some(&depth(&values)), 0.0).expect("a frame");
    let place = |i: usize| match &frame.dots[i] {
        State::Certain { place, .. } => *place,
        State::Lost(lost) => panic!("{lost:?}"),
    };
    assert!(
        matches!(place(40), Err(NoDepth::Jump { .. } | NoDepth::OneSided { .. } | NoDepth::Rough { .. })),
        "{:?}",
        place(40)
    );
    assert!(matches!(place(60), Err(NoDepth::Holes { valid }) if valid < 0.3), "{:?}", place(60));
    // A round dot on a plane that is seen from the side.
    assert!(matches!(place(100), Err(NoDepth::Leaning { facing, .. }) if facing < 0.5), "{:?}", place(100));
    assert!(place(80).is_ok());
    let nothing = vec![0; 1280 * 1024];
    let frame = tracker.step(&grey(&pixels), Some(&depth(&nothing)), 1.0).expect("a frame");
    assert_eq!(frame.certain(), 126);
    assert!(frame.dots.iter().all(|d| matches!(d, State::Certain { place: Err(NoDepth::Holes { .. }), .. })));
    let frame = tracker.step(&grey(&pixels), None, 2.0).expect("a frame");
    assert!(frame.dots.iter().all(|d| matches!(d, State::Certain { place: Err(NoDepth::NoPicture), .. })));
}

#[test]
fn pictures_that_are_none_are_refused_or_gaps() {
    let mut random = Noise::seeded(6);
    let plate = Plate { centre_m: Vec3::new(0.0, 0.0, 0.3), normal: Vec3::new(0.0, 0.0, -1.0) };
    let pixels = plate.grey(2.0, &mut random);
    let reference = Tracker::reference_dots(&grey(&pixels), &settings()).expect("settings");
    let mut tracker = Tracker::new(CAMERA, settings(), &reference).expect("a tracker");

    let few = Tracker::new(CAMERA, settings(), &reference[..5]).err();
    assert_eq!(few, Some(TrackError::TooFewDots { found: 5, least: 6 }));
    let twice = [&reference[..], &reference[..1]].concat();
    assert!(matches!(Tracker::new(CAMERA, settings(), &twice).err(), Some(TrackError::Coincident { .. })));
    let mut odd = settings();
    odd.identity.most_motion = 2.0;
    assert!(matches!(Tracker::new(CAMERA, odd, &reference).err(), Some(TrackError::Setting { .. })));

    let small = GreyView::new(640, 480, 640, &pixels).expect("a picture");
    assert!(matches!(tracker.step(&small, None, 0.0), Err(TrackError::Size { picture: "grey", .. })));
    let eight = vec![17_u16; 1280 * 1024];
    assert_eq!(
        tracker.step(&grey(&pixels), Some(&depth(&eight)), 0.0),
        Err(TrackError::EightBitDepth { largest: 17 })
    );

    assert_eq!(tracker.step(&grey(&pixels), None, 0.0).expect("a frame").certain(), 126);
    assert!(matches!(tracker.step(&grey(&pixels), None, 0.0), Err(TrackError::Time { .. })));
    assert!(matches!(tracker.step(&grey(&pixels), None, f64::NAN), Err(TrackError::Time { .. })));
    // Nothing, everything white, noise: no dot is invented, and afterwards all are found again.
    let noise: Vec<u8> = (0..1280 * 1024).map(|_| (random.uniform() * 255.0) as u8).collect();
    let frames = [vec![0; 1280 * 1024], vec![255; 1280 * 1024], noise];
    for (k, empty) in frames.iter().enumerate() {
        let frame = tracker.step(&grey(empty), None, 1.0 + k as f64).expect("a frame");
        assert_eq!(frame.certain(), 0);
        assert!(frame.dots.iter().all(|d| matches!(d, State::Lost(_))));
    }
    let back = tracker.step(&grey(&pixels), None, 4.0).expect("a frame");
    println!("{} dots are back after three frames of nothing", back.certain());
    assert!(back.dots.iter().all(|d| !matches!(d, State::Lost(Lost::Doubtful))));
    for (state, dot) in back.dots.iter().zip(&reference) {
        if let State::Certain { dot: seen, .. } = state {
            assert!(seen.distance_px(dot) < 1.0);
        }
    }
}
