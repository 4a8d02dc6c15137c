//! Identity over whole sequences of rendered pictures: a tip that hides dots, jumps of half a spacing, dots that flow together, glare.

use super::{Linker, Lost};
use crate::track::tests::random::Noise;
use crate::track::tests::render::{Brush, Canvas, ellipse};
use crate::track::{Dot, IdentitySettings};
use crate::track::{DotSettings, Finder, GreyView};
use nalgebra::Vector2;

const SIZE: [usize; 2] = [720, 560];
/// Spacing of the dots (px) stands for 9 mm.
const SPACING: f64 = 42.0;
const MM: f64 = SPACING / 9.0;
const RADIUS: f64 = 6.0;

type Point = Vector2<f64>;

/// What the picture shows at one time.
struct Scene {
    dots: Vec<Point>,
    tip: Option<(Point, f64)>,
    glare: Option<(Point, f64)>,
}

struct Tally {
    swaps: usize,
    visible: usize,
    tracked: usize,
    /// Largest error of a certain dot's place (px): of those that show, and of those partly hidden.
    worst: [f64; 2],
    /// Dots without identity in the last frame.
    lost_at_end: usize,
}

impl Scene {
    fn render(&self, brush: &Brush, random: &mut Noise) -> Vec<u8> {
        let mut canvas = Canvas::new(SIZE[0], SIZE[1], |x, y| 30.0 + 0.03 * x + 0.02 * y);
        for dot in &self.dots {
            canvas.cover(&ellipse((*dot).into(), [RADIUS; 2], 0.0), brush, |light, share| {
                // Dots that overlap are no brighter than one.
                light.max(light * (1.0 - share) + 180.0 * share)
            });
        }
        if let Some((at, radius)) = self.tip {
            canvas.hide(&ellipse(at.into(), [radius; 2], 0.0), brush, 75.0);
        }
        if let Some((at, height)) = self.glare {
            canvas.glow(at.into(), 18.0, height);
        }
        canvas.expose(2.0, random)
    }

    /// Whether all of a dot can be seen by itself.
    fn shows(&self, i: usize) -> bool {
        let p = self.dots[i];
        let whole = (0..2).all(|k| p[k] > RADIUS + 4.0 && p[k] < SIZE[k] as f64 - RADIUS - 5.0);
        let free = self.tip.is_none_or(|(at, radius)| (p - at).norm() > radius + RADIUS + 2.0);
        let dark = self.glare.is_none_or(|(at, height)| {
            let d = ((p - at).norm() - RADIUS).max(0.0) / 18.0;
            height * (-0.5 * d * d).exp() < 40.0
        });
        let apart = (0..self.dots.len()).all(|k| k == i || (self.dots[k] - p).norm() > 2.0 * RADIUS + 4.0);
        whole && free && dark && apart
    }
}

fn grid(columns: usize, rows: usize, origin: Point, jitter: f64, random: &mut Noise) -> Vec<Point> {
    (0..columns * rows)
        .map(|i| {
            let place = Point::new((i % columns) as f64, (i / columns) as f64) * SPACING;
            origin + place + Point::new(random.uniform() - 0.5, random.uniform() - 0.5) * jitter
        })
        .collect()
}

/// A bump of displacement.
fn pushed(rest: &[Point], at: Point, width: f64, by: Point) -> Vec<Point> {
    rest.iter().map(|p| p + by * (-0.5 * ((p - at).norm() / width).powi(2)).exp()).collect()
}

/// Dots drawn together towards a place.
fn pinched(rest: &[Point], at: Point, width: f64, share: f64) -> Vec<Point> {
    rest.iter().map(|p| p + (at - p) * (share * (-0.5 * ((p - at).norm() / width).powi(2)).exp())).collect()
}

/// Finds and follows; a dot that is certain and nearer to another's true place than to its own is a swap.
fn follow(scenes: &[Scene], seed: u64) -> (Tally, Vec<Vec<Result<Point, Lost>>>) {
    let brush = Brush::new(0.9);
    let mut random = Noise::seeded(seed);
    let settings = DotSettings::default();
    let mut linker = None;
    let mut order = Vec::new();
    let mut tally = Tally { swaps: 0, visible: 0, tracked: 0, lost_at_end: 0, worst: [0.0; 2] };
    let mut history = Vec::new();
    for scene in scenes {
        let pixels = scene.render(&brush, &mut random);
        let view = GreyView::new(SIZE[0], SIZE[1], SIZE[0], &pixels).expect("a picture");
        let found = Finder::default().find(&view, &settings).dots;
        let linker = linker.get_or_insert_with(|| {
            let whole: Vec<Dot> = found.iter().copied().filter(Dot::is_whole).collect();
            order = whole.iter().map(|d| closest(&scene.dots, d.centre_px.into())).collect();
            Linker::new(&whole, IdentitySettings::default(), SIZE).expect("a reference")
        });
        let identity = linker.step(&found, 0);
        tally.lost_at_end = 0;
        let mut frame = Vec::new();
        for (known, &truth) in identity.iter().zip(&order) {
            let shows = scene.shows(truth);
            tally.visible += usize::from(shows);
            match known {
                Ok(j) => {
                    let place: Point = found[*j].centre_px.into();
                    tally.swaps += usize::from((place - scene.dots[truth]).norm() > RADIUS);
                    tally.tracked += usize::from(shows);
                    let worst = &mut tally.worst[usize::from(!shows)];
                    *worst = worst.max((place - scene.dots[truth]).norm());
                    frame.push(Ok(place));
                }
                Err(lost) => {
                    tally.lost_at_end += usize::from(shows);
                    frame.push(Err(*lost));
                }
            }
        }
        history.push(frame);
    }
    (tally, history)
}

fn closest(dots: &[Point], place: Point) -> usize {
    (0..dots.len())
        .min_by(|&a, &b| (dots[a] - place).norm().total_cmp(&(dots[b] - place).norm()))
        .expect("there are dots")
}

/// The phantom is at rest, dots scattered about a regular grid by half a millimetre.
fn phantom(seed: u64) -> Vec<Point> {
    grid(14, 9, Point::new(84.0, 108.0), 0.5 * MM, &mut Noise::seeded(seed))
}

#[test]
fn a_tip_that_passes_takes_no_identity_along() {
    for seed in 0..3 {
        let rest = phantom(seed);
        let mut scenes = vec![Scene { dots: rest.clone(), tip: None, glare: None }];
        for k in 0..40 {
            let at = Point::new(60.0 + 16.0 * f64::from(k), 250.0 + 20.0 * (0.3 * f64::from(k)).sin());
            let dots = pushed(&rest, at, 95.0, Point::new(2.5, 1.5) * MM);
            let glare = Some((at + Point::new(80.0, -60.0), 190.0));
            scenes.push(Scene { dots, tip: Some((at, 55.0)), glare });
        }
        scenes.extend((0..3).map(|_| Scene { dots: rest.clone(), tip: None, glare: None }));
        let (tally, _) = follow(&scenes, seed);
        report("passing tip and glare", &tally);
    }
}

#[test]
fn five_millimetres_from_frame_to_frame_are_followed() {
    for seed in 0..3 {
        let rest = phantom(seed + 10);
        let centre = Point::new(340.0, 270.0);
        let mut random = Noise::seeded(seed);
        let mut scenes = vec![Scene { dots: rest.clone(), tip: None, glare: None }];
        for _ in 0..12 {
            let turn = std::f64::consts::TAU * random.uniform();
            let by = Point::new(turn.cos(), turn.sin()) * 5.0 * MM;
            let at = centre + Point::new(random.uniform() - 0.5, random.uniform() - 0.5) * 200.0;
            // There in one frame, and back in one frame.
            scenes.push(Scene { dots: pushed(&rest, at, 110.0, by), tip: Some((at, 40.0)), glare: None });
            scenes.push(Scene { dots: rest.clone(), tip: None, glare: None });
        }
        let (tally, _) = follow(&scenes, seed);
        report("5 mm jumps", &tally);
    }
}

#[test]
fn dots_that_flow_together_are_lost_and_found_again() {
    for seed in 0..3 {
        let rest = phantom(seed + 20);
        let at = Point::new(84.0 + 6.5 * SPACING, 108.0 + 4.0 * SPACING);
        let scenes: Vec<Scene> = (0..=40)
            .map(|k| {
                let share = 0.85 * (std::f64::consts::PI * f64::from(k) / 40.0).sin();
                Scene { dots: pinched(&rest, at, 50.0, share), tip: None, glare: None }
            })
            .collect();
        let (tally, _) = follow(&scenes, seed);
        report("merging", &tally);
    }
}

#[test]
fn a_whole_grid_that_jumps_is_followed_by_its_border() {
    for seed in 0..3 {
        let rest = phantom(seed + 30);
        let scenes: Vec<Scene> = (0..12)
            .map(|k| {
                let shift = if k % 2 == 0 { Point::zeros() } else { Point::new(4.9, 0.8) * MM };
                Scene { dots: rest.iter().map(|p| p + shift).collect(), tip: None, glare: None }
            })
            .collect();
        let (tally, _) = follow(&scenes, seed);
        report("whole grid jumps 5 mm", &tally);
    }
}

/// Nothing in the picture tells whether all dots went half a spacing to the left or to the right.
#[test]
fn half_a_spacing_of_an_endless_grid_is_flagged() {
    for shift in [Point::new(0.5, 0.0), Point::new(0.0, -0.5), Point::new(0.5, 0.5), Point::new(0.45, 0.0)] {
        let rest = grid(22, 18, Point::new(-84.0, -84.0), 0.0, &mut Noise::seeded(0));
        let scene = |by: Point| Scene {
            dots: rest.iter().map(|p| p + by * SPACING).collect(),
            tip: None,
            glare: None,
        };
        let scenes = [scene(Point::zeros()), scene(Point::zeros()), scene(shift)];
        let (tally, history) = follow(&scenes, 1);
        println!("endless grid, shift {shift:?}: {} certain", history[2].iter().flatten().count());
        assert_eq!(tally.swaps, 0);
        assert!(history[1].iter().all(Result::is_ok));
        assert!(history[2].iter().all(|known| *known == Err(Lost::Ambiguous)));
    }
}

fn report(name: &str, tally: &Tally) {
    let share = tally.tracked as f64 / tally.visible as f64;
    println!(
        "{name}: {} swaps, {:.2} % of {} visible dots tracked, {} visible dots lost at the end; places off by up to {:.2} px, partly hidden ones {:.2} px",
        tally.swaps,
        100.0 * share,
        tally.visible,
        tally.lost_at_end,
        tally.worst[0],
        tally.worst[1]
    );
    assert_eq!(tally.swaps, 0);
    assert!(share >= 0.98, "{share}");
    assert_eq!(tally.lost_at_end, 0);
}
