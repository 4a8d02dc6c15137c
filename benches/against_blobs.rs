//! How fast and how exactly dots are found by this program and by OpenCV's `SimpleBlobDetector`, in the same pictures.
//!
//! Run by benches/compare-blobs.sh. 1280 × 1024, 126 dots of 6 px radius at random fractions of pixels, the rim blurred by 0.8 px, noise of
//! 2 grey levels. Prints milliseconds a picture (the best of twenty, on one thread) and the distance of centres from the truth.
//!
//! Ours also says how sure each centre is and measures its rim. The detector's steps of thresholds are OpenCV's default (10), a finer one,
//! and a coarser one.

use opencv::core::{KeyPoint, Mat, Ptr, Vector};
use opencv::features2d::{SimpleBlobDetector, SimpleBlobDetector_Params};
use opencv::prelude::*;
use phantom_rig::track::{DotSettings, Finder, GreyView};
use random::Noise;
use render::{Brush, Canvas, ellipse};
use std::time::Instant;

#[path = "../src/track/tests/random.rs"]
mod random;
#[expect(dead_code, reason = "other tests draw more")]
#[path = "../src/track/tests/render.rs"]
mod render;

const SIZE: [usize; 2] = [1280, 1024];
const GRID: [usize; 2] = [14, 9];
const RADIUS_PX: f64 = 6.0;
const NOISE: f64 = 2.0;
const PICTURES: u64 = 5;
const REPEATS: usize = 20;

struct Picture {
    pixels: Vec<u8>,
    centres: Vec<[f64; 2]>,
}

fn picture(seed: u64) -> Picture {
    let mut random = Noise::seeded(seed);
    let mut canvas = Canvas::new(SIZE[0], SIZE[1], |_, _| 30.0);
    let brush = Brush::new(0.8);
    let mut centres = Vec::new();
    for row in 0..GRID[1] {
        for column in 0..GRID[0] {
            let at =
                |cell: usize, cells: usize, extent: usize| (cell as f64 + 0.5) * extent as f64 / cells as f64;
            let shift = [random.uniform() - 0.5, random.uniform() - 0.5].map(|s| 20.0 * s);
            let centre = [at(column, GRID[0], SIZE[0]) + shift[0], at(row, GRID[1], SIZE[1]) + shift[1]];
            canvas.add(&ellipse(centre, [RADIUS_PX; 2], 0.0), &brush, 170.0);
            centres.push(centre);
        }
    }
    Picture { pixels: canvas.expose(NOISE, &mut random), centres }
}

/// What a finder makes of all pictures: best time a picture (ms), root mean square and largest distance of centres (px), dots missed and
/// dots that are none.
fn measure(
    pictures: &[Picture],
    mut find: impl FnMut(&[u8]) -> Vec<[f64; 2]>,
) -> (f64, [f64; 2], [usize; 2]) {
    let (mut best, mut squares, mut largest) = (f64::INFINITY, 0.0, 0.0_f64);
    let (mut found, mut missed, mut strangers) = (0_usize, 0, 0);
    for picture in pictures {
        let mut dots = Vec::new();
        for _ in 0..REPEATS {
            let begun = Instant::now();
            dots = find(&picture.pixels);
            best = best.min(1e3 * begun.elapsed().as_secs_f64());
        }
        let mut matched = 0;
        for centre in &picture.centres {
            let distance = |dot: &[f64; 2]| (dot[0] - centre[0]).hypot(dot[1] - centre[1]);
            let nearest = dots.iter().map(distance).fold(f64::INFINITY, f64::min);
            if nearest < RADIUS_PX {
                matched += 1;
                squares += nearest * nearest;
                largest = largest.max(nearest);
            } else {
                missed += 1;
            }
        }
        found += matched;
        strangers += dots.len().saturating_sub(matched);
    }
    (best, [(squares / found as f64).sqrt(), largest], [missed, strangers])
}

fn detector(step: f32) -> opencv::Result<Ptr<SimpleBlobDetector>> {
    let mut parameters = SimpleBlobDetector_Params::default()?;
    parameters.threshold_step = step;
    parameters.min_threshold = 50.0;
    parameters.max_threshold = 220.0;
    parameters.filter_by_color = true;
    parameters.blob_color = 255;
    parameters.min_area = 40.0;
    parameters.max_area = 400.0;
    SimpleBlobDetector::create(parameters)
}

fn main() -> opencv::Result<()> {
    opencv::core::set_num_threads(1)?;
    let pictures: Vec<Picture> = (1..=PICTURES).map(picture).collect();
    let print = |name: &str, (ms, [rms, largest], [missed, strangers]): (f64, [f64; 2], [usize; 2])| {
        println!(
            "{name:32} {ms:8.2} ms {rms:9.4} px rms {largest:8.3} px at worst, {missed} missed, {strangers} others"
        );
    };
    let mut finder = Finder::default();
    let settings = DotSettings::default();
    let ours = measure(&pictures, |pixels| {
        let view = GreyView::new(SIZE[0], SIZE[1], SIZE[0], pixels).expect("as many pixels");
        finder.find(&view, &settings).dots.iter().map(|dot| dot.centre_px).collect()
    });
    print("track::Finder", ours);
    for step in [5.0, 10.0, 40.0] {
        let mut detector = detector(step)?;
        let theirs = measure(&pictures, |pixels| {
            let rows = Mat::from_slice(pixels).expect("a picture");
            let mat = rows.reshape(1, SIZE[1] as i32).expect("as many rows");
            let mut found = Vector::<KeyPoint>::new();
            detector.detect(&mat, &mut found, &opencv::core::no_array()).expect("detects");
            found.iter().map(|point| [f64::from(point.pt().x), f64::from(point.pt().y)]).collect()
        });
        print(&format!("SimpleBlobDetector, step {step}"), theirs);
        println!(
            "{:32} {:8.1} times as fast, {:.1} times as exact",
            "  ours",
            theirs.0 / ours.0,
            theirs.1[0] / ours.1[0]
        );
    }
    Ok(())
}
