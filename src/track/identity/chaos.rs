//! Identity under everything at once, without pictures: detections are made up, so that many thousand frames can be asked.

use super::Linker;
use crate::track::tests::random::Noise;
use crate::track::{Dot, IdentitySettings};
use nalgebra::Matrix2;
use nalgebra::Vector2;

const SIZE: [usize; 2] = [800, 600];
const SPACING: f64 = 42.0;

type Point = Vector2<f64>;

fn dot(at: Point, radius: f64) -> Dot {
    Dot {
        centre_px: at.into(),
        covariance_px2: Matrix2::identity() * 1e-4,
        light: None,
        rim_px: Matrix2::identity() * radius,
        contrast: 150.0,
        background: 30.0,
        blur_px: Some(0.9),
        quality: 0.99,
        saturated: false,
        border: false,
        merged: false,
    }
}

/// What may go wrong in a run.
struct Chaos {
    /// Scatter of the dots about a lattice, in spacings.
    scatter: f64,
    /// Largest local motion from frame to frame, in spacings.
    local: f64,
    /// Largest motion of all dots from frame to frame, in spacings.
    global: f64,
    /// Share of dots that are not detected.
    missed: f64,
    /// Detections that are nothing, in a frame.
    glints: usize,
    /// Whether dots lie beyond the picture on all sides.
    endless: bool,
    /// Radius of something that hides dots (px).
    hidden: f64,
}

/// Runs of twelve frames for each kind of chaos; a hundred were clean too.
const RUNS: u64 = 25;

#[derive(Default)]
struct Tally {
    swaps: usize,
    glints: usize,
    certain: usize,
    visible: usize,
}

fn run(chaos: &Chaos, seed: u64) -> Tally {
    let mut random = Noise::seeded(seed);
    let within = |random: &mut Noise, half: f64| {
        loop {
            let p = Point::new(2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0);
            if p.norm() <= 1.0 {
                return p * half;
            }
        }
    };
    let (columns, rows) = if chaos.endless { (26, 20) } else { (14, 9) };
    let origin =
        (Point::new(800.0, 600.0) - Point::new(columns as f64 - 1.0, rows as f64 - 1.0) * SPACING) / 2.0;
    let rest: Vec<Point> = (0..columns * rows)
        .map(|i| {
            let place = Point::new((i % columns) as f64, (i / columns) as f64) * SPACING;
            origin + place + within(&mut random, chaos.scatter * SPACING)
        })
        .collect();
    let inside = |p: Point| (0..2).all(|k| p[k] > 10.0 && p[k] < SIZE[k] as f64 - 10.0);
    let order: Vec<usize> = (0..rest.len()).filter(|&i| inside(rest[i])).collect();
    let reference: Vec<Dot> = order.iter().map(|&i| dot(rest[i], 6.0)).collect();
    let mut linker = Linker::new(&reference, IdentitySettings::default(), SIZE).expect("a reference");
    let mut tally = Tally::default();
    let mut at = Point::zeros();
    for _ in 0..12 {
        // Local pushes go there and back, so that each frame moves by no more than `local`; a walk of all dots adds up.
        at += within(&mut random, chaos.global * SPACING);
        let centre = Point::new(400.0, 300.0) + within(&mut random, 150.0);
        let by = within(&mut random, 0.5 * chaos.local * SPACING);
        let width = 2.0 * SPACING + 40.0 * random.uniform();
        let now: Vec<Point> =
            rest.iter().map(|p| p + at + by * (-0.5 * ((p - centre).norm() / width).powi(2)).exp()).collect();
        let mut seen: Vec<(Point, Option<usize>)> = Vec::new();
        for (i, &p) in now.iter().enumerate() {
            let shown = inside(p) && (p - centre).norm() > chaos.hidden && random.uniform() >= chaos.missed;
            if shown {
                seen.push((p + Point::new(random.normal(), random.normal()) * 0.05, Some(i)));
            }
        }
        for _ in 0..chaos.glints {
            let p = Point::new(random.uniform() * 800.0, random.uniform() * 600.0);
            if seen.iter().all(|(q, _)| (p - q).norm() > 14.0) {
                seen.push((p, None));
            }
        }
        let dots: Vec<Dot> =
            seen.iter().map(|(p, _)| dot(*p, 6.0 * (1.0 + 0.02 * random.normal()))).collect();
        for (known, &truth) in linker.step(&dots, 0).iter().zip(&order) {
            tally.visible += usize::from(seen.iter().any(|s| s.1 == Some(truth)));
            if let Ok(j) = known {
                tally.certain += 1;
                match seen[*j].1 {
                    Some(i) if i == truth => {}
                    Some(_) => tally.swaps += 1,
                    None => tally.glints += 1,
                }
            }
        }
    }
    tally
}

/// Nothing that is certain is another dot. A glint in the very place where a hidden dot must be, and of a dot's size, cannot be told from
/// it; they are counted apart.
#[test]
fn no_identity_is_swapped_whatever_happens() {
    let calm =
        Chaos { scatter: 0.0, local: 0.2, global: 0.0, missed: 0.0, glints: 0, endless: false, hidden: 0.0 };
    let runs = [
        ("local pushes", Chaos { local: 0.6, hidden: 40.0, ..calm }),
        ("pushes, misses, glints", Chaos { local: 0.6, missed: 0.05, glints: 5, hidden: 50.0, ..calm }),
        ("all dots walk", Chaos { global: 0.5, local: 0.1, missed: 0.02, glints: 2, ..calm }),
        ("walk, hidden", Chaos { global: 0.5, local: 0.1, missed: 0.05, glints: 5, hidden: 90.0, ..calm }),
        (
            "walk, push, scatter",
            Chaos { global: 0.35, local: 0.25, scatter: 0.05, missed: 0.05, glints: 5, hidden: 60.0, ..calm },
        ),
        ("half of them missed", Chaos { global: 0.3, missed: 0.5, glints: 10, ..calm }),
        ("endless walk", Chaos { global: 0.62, endless: true, ..calm }),
        (
            "endless walk, misses",
            Chaos { global: 0.62, missed: 0.1, glints: 5, endless: true, hidden: 60.0, ..calm },
        ),
        (
            "endless scattered walk",
            Chaos { global: 0.62, scatter: 0.1, endless: true, missed: 0.03, hidden: 60.0, ..calm },
        ),
    ];
    for (name, chaos) in runs {
        let mut sum = Tally::default();
        for seed in 0..RUNS {
            let tally = run(&chaos, seed);
            sum.swaps += tally.swaps;
            sum.glints += tally.glints;
            sum.certain += tally.certain;
            sum.visible += tally.visible;
        }
        println!(
            "{name}: {} swaps and {} glints among {} certain of {} visible ({:.1} %)",
            sum.swaps,
            sum.glints,
            sum.certain,
            sum.visible,
            100.0 * sum.certain as f64 / sum.visible as f64
        );
        assert_eq!(sum.swaps, 0, "{name}");
    }
}
