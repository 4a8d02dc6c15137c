//! Whole frames: repeatability, times, projection, refusals, speed.

use super::super::*;
use super::stage::*;
use crate::geometry::Vec3;

/// A slab of 150 mm with 126 dots, pressed in, with the tip in front: everything switched on.
fn everything(size: [usize; 2]) -> (PixelSetup, Surface, Vec<Dot>, Vec<Vec3>, [Solid; 2]) {
    let surface = Surface::block([0.15, 0.10, 0.03], 0.0025).expect("a block");
    let focal_px = 2.55 * size[0] as f64;
    let lens = Lens {
        radial: [-0.09, 0.12, 0.0],
        tangential: [4e-4, -3e-4],
        ..Lens::undistorted(focal_px, size[0], size[1])
    };
    let (eye, target) = (Vec3::new(0.075, -0.07, 0.49), Vec3::new(0.075, 0.048, 0.02));
    let camera = Camera::looking_at(lens, size, eye, target, Vec3::y());
    let dots = (0..126).map(|number| {
        let (i, j) = (f64::from(number % 14), f64::from(number / 14));
        let shake = |k: u32| 0.4 * ((f64::from(number * k) * 0.618).fract() - 0.5);
        let point = Vec3::new((i + 0.5 + shake(3)) * 0.15 / 14.0, (j + 0.5 + shake(7)) * 0.10 / 9.0, 0.03);
        Dot { raggedness: 0.02, ..dot_at(&surface, number, point, 0.0013) }
    });
    let dots = dots.collect();
    let site = Vec3::new(0.088, 0.045, 0.03);
    let moved = surface.rest().iter().map(|p| {
        let r = (p - site).xy().norm();
        // Boussinesq's flat punch: w = w₀ · 2/π · asin(a/r) outside its radius.
        let sink = if r < 0.006 { 1.0 } else { std::f64::consts::FRAC_2_PI * (0.006 / r).asin() };
        p - Vec3::z() * 0.004 * sink * (p.z / 0.03).powi(2)
    });
    let moved = moved.collect();
    let axis = Vec3::new(0.12, 0.25, 1.0).normalize();
    let tip = Solid::pad_on_rod(site - Vec3::z() * 0.004, axis, [0.006, 0.004], [0.0035, 0.25]);
    (PixelSetup::new(camera, 5), surface, dots, moved, tip)
}

/// The same setup makes the same frames, whichever were made before; another seed, or another number, other noise only.
#[test]
fn frames_repeat_by_seed_and_number() {
    let (setup, surface, dots, moved, tip) = everything([320, 240]);
    let make = |setup: &PixelSetup, numbers: &[u32]| {
        let mut renderer = Renderer::new(setup.clone(), surface.clone(), &dots).expect("a renderer");
        let scene = Scene::still(&moved, &tip);
        let frames = numbers.iter().map(|&n| renderer.frame(&scene, n, 0.1).expect("a frame"));
        frames.collect::<Vec<Frame>>()
    };
    let (once, again) = (make(&setup, &[3, 4]), make(&setup, &[4]));
    assert_eq!(once[1], again[0]);
    assert_ne!(once[0].grey, once[1].grey);
    let other = make(&PixelSetup { seed: 6, ..setup.clone() }, &[4]);
    assert!(other[0].grey != again[0].grey && other[0].depth != again[0].depth);
    assert_eq!(other[0].dots, again[0].dots);
}

/// Rows that are exposed one after the other show a moving sheet sheared: each dot is where it is at its own time.
#[test]
fn a_rolling_shutter_shows_each_row_at_its_time() {
    let surface = sheet(0.004);
    let mut setup = plain(above(5000.0, [420, 420], 0.5));
    setup.sensor.blur_px = 0.7;
    setup.shutter = Shutter { row_s: 2e-5, late_s: 0.01, jitter_s: 0.0, tick_s: 1e-3 };
    let velocity = Vec3::new(0.1, 0.0, 0.0);
    let velocities = vec![velocity; surface.rest().len()];
    let dots: Vec<Dot> = (0..3)
        .map(|k| dot_at(&surface, k, Vec3::new(0.02, 0.008 + 0.01 * f64::from(k), 0.001), 7e-4))
        .collect();
    let mut renderer = Renderer::new(setup, surface.clone(), &dots).expect("a renderer");
    let scene = Scene { velocities: Some(&velocities), ..Scene::still(surface.rest(), &[]) };
    let frame = renderer.frame(&scene, 0, 7.0).expect("a frame");
    assert!((frame.reported_s - 7.01).abs() < 1e-12);
    for (dot, truth) in dots.iter().zip(&frame.dots) {
        let pixel = truth.pixel.expect("in front");
        let rest = surface.at(&dot.place, surface.rest());
        let expected = rest + velocity * (truth.time_s - 7.0);
        assert!((truth.time_s - 7.0 - 2e-5 * pixel[1]).abs() < 1e-12);
        assert!((truth.position_m - expected).norm() < 1e-9);
        // Within the dot the rows shear it evenly: the centroid stays its centre.
        let (_, found) = centroid(&renderer, pixel, 12.0);
        assert!((found[0] - pixel[0]).hypot(found[1] - pixel[1]) < 0.002);
    }
}

/// Reported times scatter as they should: over 4000 frames the standard deviation is known to 1.1 %.
#[test]
fn reported_times_jitter() {
    let surface = sheet(0.02);
    let mut setup = plain(above(50.0, [16, 16], 0.5));
    setup.shutter = Shutter { jitter_s: 1e-3, ..Shutter::default() };
    let mut renderer = Renderer::new(setup, surface.clone(), &[]).expect("a renderer");
    let scene = Scene::still(surface.rest(), &[]);
    let square: f64 = (0..4000)
        .map(|n| renderer.frame(&scene, n, 2.0).expect("a frame").reported_s - 2.0)
        .map(|e| e * e)
        .sum();
    assert!(((square / 4000.0).sqrt() / 1e-3 - 1.0).abs() < 0.05);
}

/// What is projected is what the pinhole's formula says, written out here once more, for a point and a pose picked at random.
#[test]
fn dots_are_projected_as_by_hand() {
    let (setup, surface, dots, moved, tip) = everything([320, 240]);
    let mut renderer = Renderer::new(setup.clone(), surface, &dots).expect("a renderer");
    let frame = renderer.frame(&Scene::still(&moved, &tip), 0, 0.0).expect("a frame");
    let (eye, target) = (Vec3::new(0.075, -0.07, 0.49), Vec3::new(0.075, 0.048, 0.02));
    let forward = (target - eye).normalize();
    let right = Vec3::x();
    let (mut hidden, mut part) = (0, 0);
    for truth in &frame.dots {
        let off = truth.position_m - eye;
        let z = off.dot(&forward);
        let (x, y) = (off.dot(&right) / z, off.dot(&forward.cross(&right)) / z);
        let r2 = x * x + y * y;
        let gain = 1.0 - 0.09 * r2 + 0.12 * r2 * r2;
        let u = 816.0 * (x * gain + 2.0 * 4e-4 * x * y - 3e-4 * (r2 + 2.0 * x * x)) + 159.5;
        let v = 816.0 * (y * gain + 4e-4 * (r2 + 2.0 * y * y) - 2.0 * 3e-4 * x * y) + 119.5;
        let pixel = truth.pixel.expect("in front");
        assert!((pixel[0] - u).hypot(pixel[1] - v) < 1e-9);
        hidden += i32::from(truth.visible == 0.0);
        part += i32::from(truth.visible > 0.0 && truth.visible < 0.99);
    }
    println!("{hidden} dots hidden, {part} in part");
    assert!(hidden >= 2 && hidden + part < 16);
}

#[test]
fn what_means_nothing_is_refused() {
    let (setup, surface, dots, moved, tip) = everything([320, 240]);
    let refused = |change: fn(&mut PixelSetup)| {
        let mut setup = setup.clone();
        change(&mut setup);
        Renderer::new(setup, surface.clone(), &dots).is_err()
    };
    assert!(refused(|s| s.sensor.blur_px = -1.0) && refused(|s| s.finish.gel_reflectance = f64::NAN));
    assert!(refused(|s| s.camera.lens.radial = [-30.0, 0.0, 0.0]) && refused(|s| s.shutter.jitter_s = -1.0));
    let stray = Dot { place: Attachment { triangle: 1 << 20, ..dots[0].place }, ..dots[0] };
    assert!(Renderer::new(setup.clone(), surface.clone(), &[stray]).is_err());
    let mut renderer = Renderer::new(setup, surface, &dots).expect("a renderer");
    assert!(renderer.frame(&Scene::still(&moved[1..], &tip), 0, 0.0).is_err());
}

/// How long frames take. Told, not judged: it depends on who else is at the machine.
#[test]
fn frames_take_some_milliseconds() {
    for size in [[640, 480], [1280, 1024]] {
        for depth in [false, true] {
            let (mut setup, surface, dots, moved, tip) = everything(size);
            setup.depth = setup.depth.filter(|_| depth);
            let mut renderer = Renderer::new(setup, surface, &dots).expect("a renderer");
            let scene = Scene::still(&moved, &tip);
            let took = (0..10).map(|n| {
                let start = std::time::Instant::now();
                renderer.frame(&scene, n, 0.0).expect("a frame");
                start.elapsed().as_secs_f64() * 1e3
            });
            let best = took.fold(f64::INFINITY, f64::min);
            println!("{} × {}, depth {depth}: {best:.1} ms at best", size[0], size[1]);
        }
    }
}
