//! Dots, what hides them, and depth.

use super::super::*;
use super::stage::*;
use crate::geometry::Vec3;

/// Centroid of a disc's pixels, each with the area that the disc covers: the chords of 400 lines a pixel, cut to its columns.
fn disc_in_pixels(centre: [f64; 2], radius: f64) -> [f64; 2] {
    let (mut sum, mut moment) = (0.0, [0.0; 2]);
    let around = |a: usize| (centre[a] - radius) as i32 - 1..(centre[a] + radius) as i32 + 2;
    for row in around(1) {
        for line in 0..400 {
            let v = f64::from(row) - 0.5 + (f64::from(line) + 0.5) / 400.0;
            let square = radius * radius - (v - centre[1]).powi(2);
            if square <= 0.0 {
                continue;
            }
            let (from, to) = (centre[0] - square.sqrt(), centre[0] + square.sqrt());
            for column in around(0) {
                let u = f64::from(column);
                let covered = (to.min(u + 0.5) - from.max(u - 0.5)).max(0.0);
                sum += covered;
                moment = [moment[0] + covered * u, moment[1] + covered * f64::from(row)];
            }
        }
    }
    moment.map(|m| m / sum)
}

/// A frontal disc: its light is πr² pixels, its centroid that of the areas covered, whatever its place within a pixel. With blur that is
/// its centre's image; without, pixels as such shift it by up to 0.006 px, in a real camera as here.
#[test]
fn a_frontal_disc_has_its_centroid_and_its_light() {
    let surface = sheet(0.003);
    for (radius_px, blur_px) in
        [(3.0, 0.0), (3.0, 0.7), (4.0, 0.0), (4.0, 0.8), (7.0, 0.0), (7.0, 0.8), (10.0, 0.6)]
    {
        // 10 px/mm at 0.5 m.
        let camera = above(5000.0, [420, 420], 0.5);
        let mut setup = plain(camera);
        setup.sensor.blur_px = blur_px;
        let radius_m = radius_px * 1e-4;
        let dots: Vec<Dot> = (0..64)
            .map(|k| {
                let (i, j, shift) = (f64::from(k / 8), f64::from(k % 8), f64::from(k) * 1.37e-5);
                let point = Vec3::new(0.006 + 0.004 * i + shift, 0.006 + 0.004 * j - 0.7 * shift, 0.001);
                dot_at(&surface, k as u32, point, radius_m)
            })
            .collect();
        let mut renderer = Renderer::new(setup, surface.clone(), &dots).expect("a renderer");
        let frame = renderer.frame(&Scene::still(surface.rest(), &[]), 0, 0.0).expect("a frame");
        let area = std::f64::consts::PI * radius_px * radius_px;
        let (mut off, mut off_light) = (0.0_f64, 0.0_f64);
        for truth in &frame.dots {
            let pixel = truth.pixel.expect("in front");
            let expected = if blur_px > 0.0 { pixel } else { disc_in_pixels(pixel, radius_px) };
            let (sum, found) = centroid(&renderer, pixel, radius_px + 5.0);
            off = off.max((found[0] - expected[0]).hypot(found[1] - expected[1]));
            off_light = off_light.max((sum / 200.0 / area - 1.0).abs());
            assert!((truth.visible - 1.0).abs() < 1e-12);
        }
        println!(
            "radius {radius_px} px, blur {blur_px} px: centroid off by {off:.1e} px, light by {off_light:.1e}"
        );
        assert!(off < 5e-4 && off_light < 1e-4);
    }
}

/// A stretched, tilted, bent and distorted dot against brute force: 40 × 40 rays a pixel, each met with every triangle and asked for its
/// distance from the dot's centre on the resting surface.
#[test]
fn a_bent_dot_is_that_of_brute_force() {
    let surface = sheet(0.0013);
    let moved: Vec<Vec3> = surface
        .rest()
        .iter()
        .map(|p| {
            let d = Vec3::new(p.x - 0.018, p.y - 0.022, 0.0);
            let dip = (-d.norm_squared() / (2.0 * 0.005_f64.powi(2))).exp();
            p - Vec3::z() * 0.003 * dip + d * 0.25 * dip
        })
        .collect();
    let lens =
        Lens { radial: [-0.2, 0.1, 0.0], tangential: [1e-3, -2e-3], ..Lens::undistorted(2600.0, 200, 180) };
    let camera = Camera::looking_at(
        lens,
        [200, 180],
        Vec3::new(0.15, -0.1, 0.5),
        Vec3::new(0.02, 0.02, 0.0),
        Vec3::y(),
    );
    let points = [(0.018, 0.022), (0.0215, 0.0245), (0.013, 0.017), (0.03, 0.01)];
    let dots: Vec<Dot> = (0..)
        .zip(points)
        .map(|(number, (x, y))| dot_at(&surface, number, Vec3::new(x, y, 0.001), 0.0012))
        .collect();
    let mut renderer = Renderer::new(plain(camera), surface.clone(), &dots).expect("a renderer");
    let frame = renderer.frame(&Scene::still(&moved, &[]), 0, 0.0).expect("a frame");
    let seen: Vec<[Vec3; 3]> =
        surface.triangles().iter().map(|t| t.map(|v| camera.seen(&moved[v as usize]))).collect();
    for (dot, truth) in dots.iter().zip(&frame.dots) {
        let place = surface.at(&dot.place, &moved);
        assert!((truth.position_m - place).norm() < 1e-15);
        let pixel = truth.pixel.expect("in front");
        let near: Vec<usize> = (0..seen.len())
            .filter(|&t| {
                (surface.at(&Attachment { triangle: t as u32, barycentric: [1.0 / 3.0; 3] }, surface.rest())
                    - surface.at(&dot.place, surface.rest()))
                .norm()
                    < 0.003
            })
            .collect();
        let centre = surface.at(&dot.place, surface.rest());
        let (mut sum, mut moment) = (0.0, [0.0; 2]);
        let n = 24;
        for row in pixel[1] as i32 - 9..pixel[1] as i32 + 10 {
            for column in pixel[0] as i32 - 9..pixel[0] as i32 + 10 {
                let mut inside = 0;
                for k in 0..n * n {
                    let off = |k: i32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
                    let at = [f64::from(column) + off(k % n), f64::from(row) + off(k / n)];
                    let ray = lens.ray(at).expect("a ray");
                    let ray = Vec3::new(ray[0], ray[1], 1.0);
                    for &t in &near {
                        let m = nalgebra::Matrix3::from_columns(&seen[t]);
                        let Some(b) = m.try_inverse().map(|m| m * ray) else { continue };
                        if b.min() >= 0.0 {
                            let b = b / b.sum();
                            let rest = surface.at(
                                &Attachment { triangle: t as u32, barycentric: b.into() },
                                surface.rest(),
                            );
                            inside += i32::from((rest - centre).norm() < dot.radius_m);
                            break;
                        }
                    }
                }
                let light = f64::from(inside) / f64::from(n * n);
                sum += light;
                moment = [moment[0] + light * f64::from(column), moment[1] + light * f64::from(row)];
            }
        }
        let expected = moment.map(|m| m / sum);
        let (light, found) = centroid(&renderer, pixel, 9.0);
        let off = (found[0] - expected[0]).hypot(found[1] - expected[1]);
        let from_centre = (expected[0] - pixel[0]).hypot(expected[1] - pixel[1]);
        println!(
            "dot {}: {sum:.2} px², centroid off brute force by {off:.2e} px, light by {:.2e}; centroid off centre by {from_centre:.3} px",
            dot.number,
            light / 200.0 / sum - 1.0
        );
        assert!(off < 0.002, "{off} px");
        assert!((light / 200.0 / sum - 1.0).abs() < 2e-3);
    }
}

/// Depth of the top and of the plate, with distortion and tilt, at every pixel against the plane's equation.
#[test]
fn depth_without_faults_is_exact() {
    let surface = Surface::block([0.1, 0.15, 0.03], 0.005).expect("a block");
    let lens =
        Lens { radial: [-0.15, 0.05, 0.01], tangential: [1e-3, 5e-4], ..Lens::undistorted(1500.0, 640, 480) };
    let camera = Camera::looking_at(
        lens,
        [640, 480],
        Vec3::new(0.2, 0.0, 0.5),
        Vec3::new(0.05, 0.075, 0.03),
        Vec3::x(),
    );
    let mut setup = plain(camera);
    setup.depth = Some(DepthSetup { unit_m: 2e-5, ..DepthSetup::exact() });
    let mut renderer = Renderer::new(setup, surface.clone(), &[]).expect("a renderer");
    let frame = renderer.frame(&Scene::still(surface.rest(), &[]), 0, 0.0).expect("a frame");
    let depth = frame.depth.expect("depth");
    let (mut top, mut plate) = (0, 0);
    for row in 0..480 {
        for column in 0..640 {
            let ray = lens.ray([column as f64, row as f64]).expect("a ray");
            let along = camera.pose.rotation.inverse() * Vec3::new(ray[0], ray[1], 1.0);
            let at = |height: f64| {
                let z = (height - camera.eye().z) / along.z;
                (z, camera.eye() + along * z)
            };
            let count = f64::from(depth.counts[row * 640 + column]);
            let (z, place) = at(0.03);
            let inside = |margin: f64| {
                (-margin..0.1 + margin).contains(&place.x) && (-margin..0.15 + margin).contains(&place.y)
            };
            if inside(-0.001) {
                assert!((count * 2e-5 - z).abs() < 1.02e-5, "({column}, {row}): {count} for {z} m");
                top += 1;
            } else if !inside(0.03) {
                let (z, _) = at(0.0);
                assert!((count * 2e-5 - z).abs() < 1.02e-5, "({column}, {row}): {count} for {z} m");
                plate += 1;
            }
        }
    }
    assert!(top > 100_000 && plate > 20_000, "{top} {plate}");
}

/// A wide post right above, its edge across a dot: what remains is a segment of the disc.
#[test]
fn a_half_hidden_dot_shows_its_segment() {
    let surface = sheet(0.002);
    let camera = above(5000.0, [420, 420], 0.5);
    let radius_m = 7e-4;
    for share in [-0.9, -0.4, 0.0, 0.3, 0.8] {
        // The ball's outline for the eye: a cone; a post of 1 m radius at the dots' own height has a straight edge over the dot.
        let edge = 0.02 + share * radius_m;
        let shape = Shape::Cylinder {
            face_m: Vec3::new(edge - 1.0, 0.02, 0.0012),
            axis: Vec3::z(),
            radius_m: 1.0,
            length_m: 1e-6,
        };
        let post = [Solid { shape, reflectance: 0.0 }];
        let dots = [dot_at(&surface, 7, Vec3::new(0.02, 0.02, 0.001), radius_m)];
        let mut renderer = Renderer::new(plain(camera), surface.clone(), &dots).expect("a renderer");
        let frame = renderer.frame(&Scene::still(surface.rest(), &post), 0, 0.0).expect("a frame");
        // Seen from 0.5 m above the dots the edge, 0.201 mm nearer, is shifted outwards by 0.04 % of its distance from the axis.
        let t = share * 0.5 / (0.5 - 0.000_201);
        let hidden = 1.0 - (f64::acos(t) - t * (1.0_f64 - t * t).sqrt()) / std::f64::consts::PI;
        let visible = frame.dots[0].visible;
        let (light, _) = centroid(&renderer, [209.5, 209.5], 15.0);
        let whole = std::f64::consts::PI * 49.0 * 200.0;
        println!(
            "edge at {share} r: visible {visible:.4}, expected {:.4}, light {:.4}",
            1.0 - hidden,
            light / whole
        );
        assert!((visible - (1.0 - hidden)).abs() < 0.004);
        assert!((light / whole - visible).abs() < 0.002);
        assert_eq!(frame.dots[0].pixel.map(|p| p.map(f64::round)), Some([210.0, 209.0]));
    }
}
