//! How near the centres come to the Cramér–Rao bound, on rendered dots.

use super::model::BlurredDisc;
use super::window::Window;
use super::{fit, moment};
use crate::track::GreyView;
use crate::track::tests::random::Noise;
use crate::track::tests::render::{Brush, Canvas, ellipse};
use crate::track::{DotSettings, Finder};
use nalgebra::{Matrix2, Vector2};

/// Root mean square errors per axis (px).
struct Errors {
    fitted: f64,
    centroid: f64,
    bound: f64,
    stated: f64,
    found: usize,
}

/// 126 dots on 1280 × 1024 at random sub-pixel places, on an uneven background, repeated.
fn measure(noise: f64, radius: f64, tilt_degrees: f64, blur: f64, repeats: u64) -> Errors {
    let brush = Brush::new(blur);
    let (mut fitted, mut centroid, mut bound, mut stated) = (0.0, 0.0, 0.0, 0.0);
    let (mut count, mut count_centroid) = (0.0, 0.0);
    for seed in 0..repeats {
        let mut random = Noise::seeded(seed);
        let mut canvas = Canvas::new(1280, 1024, |x, y| 28.0 + 0.012 * x + 0.006 * y);
        let mut truth = Vec::new();
        for row in 0..9 {
            for column in 0..14 {
                let centre = [
                    90.0 + 84.0 * f64::from(column) + 2.0 * random.uniform(),
                    90.0 + 105.0 * f64::from(row) + 2.0 * random.uniform(),
                ];
                let axes = [radius, radius * tilt_degrees.to_radians().cos()];
                let angle = std::f64::consts::PI * random.uniform();
                canvas.add(&ellipse(centre, axes, angle), &brush, 150.0);
                truth.push((centre, axes, angle));
            }
        }
        let pixels = canvas.expose(noise, &mut random);
        let view = GreyView::new(1280, 1024, 1280, &pixels).expect("a picture");
        let found = Finder::default().find(&view, &DotSettings::default());
        for (centre, axes, angle) in truth {
            let near =
                |d: &&crate::track::Dot| (d.centre_px[0] - centre[0]).hypot(d.centre_px[1] - centre[1]) < 2.0;
            let Some(dot) = found.dots.iter().find(near) else { continue };
            fitted += (dot.centre_px[0] - centre[0]).powi(2) + (dot.centre_px[1] - centre[1]).powi(2);
            stated += dot.covariance_px2.trace();
            count += 2.0;

            // The true dot's own model gives the bound and starts the centroid.
            let (sin, cos) = angle.sin_cos();
            let turn = Matrix2::new(cos, -sin, sin, cos);
            let squares = Vector2::new(axes[0] * axes[0], axes[1] * axes[1]) * 0.25;
            let moments = turn * Matrix2::from_diagonal(&squares) * turn.transpose();
            let total_blur = (blur * blur + 1.0 / 12.0).sqrt();
            let sigma2 = noise * noise + 1.0 / 12.0;
            let true_disc =
                BlurredDisc::from_moments(Vector2::from(centre), moments, 150.0, total_blur, dot.background)
                    .expect("an ellipse");
            let mut window = Window::default();
            window.gather(&view, &true_disc, 5.0);
            bound += fit::bound(&window, &true_disc).trace() * sigma2;
            let samples: Vec<_> = window.samples().collect();
            if let Some((c, _)) = moment::centroid(&samples, true_disc) {
                centroid += (c - Vector2::from(centre)).norm_squared();
                count_centroid += 2.0;
            }
        }
    }
    let root = |sum: f64, count: f64| (sum / count).sqrt();
    Errors {
        fitted: root(fitted, count),
        centroid: root(centroid, count_centroid),
        bound: root(bound, count),
        stated: root(stated, count),
        found: (count / 2.0) as usize,
    }
}

/// The table of the room: every dot is found, and no centre is worse than 1.5 times the bound.
#[test]
fn centres_come_near_the_cramer_rao_bound() {
    println!(
        "noise radius tilt | fitted centroid bound stated (px per axis) | fitted/bound centroid/bound found"
    );
    for noise in [0.0, 2.0, 5.0] {
        for radius in [4.0, 6.0, 9.0] {
            for tilt in [0.0, 30.0] {
                let e = measure(noise, radius, tilt, 0.9, 2);
                println!(
                    "{noise:5} {radius:6} {tilt:4} | {:.5} {:.5} {:.5} {:.5} | {:.2} {:.2} {}",
                    e.fitted,
                    e.centroid,
                    e.bound,
                    e.stated,
                    e.fitted / e.bound,
                    e.centroid / e.bound,
                    e.found
                );
                assert_eq!(e.found, 252);
                // Without noise, rounding is what is left, and it is not independent noise.
                let most = if noise == 0.0 { 0.003 } else { 1.5 * e.bound };
                assert!(e.fitted < most, "{} {}", e.fitted, e.bound);
                if noise == 2.0 && radius == 6.0 {
                    assert!(e.fitted <= 0.012);
                }
            }
        }
    }
}
