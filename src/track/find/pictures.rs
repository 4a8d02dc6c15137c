//! Dots in pictures that others took: a calibration target with its camera's parameters. Pins of an optical tactile sensor are in `pins`.
//!
//! The pictures stay where they are: `PHANTOM_RIG_DATA`, or `../shared` beside the project. Without them nothing is tested.

use crate::geometry::{Mat3, Vec3};
use crate::track::{Camera, Channels, DiscInSpace, Dot, DotSettings, Finder, GreyView, grey_from_colour};
use image::RgbImage;
use nalgebra::{Rotation3, SMatrix, SVector, Vector2};
use std::path::{Path, PathBuf};

/// Pictures of a folder of dots, by name; none where there is no data.
pub(super) fn pictures(folder: &str, begins: &str) -> Vec<PathBuf> {
    let root = std::env::var_os("PHANTOM_RIG_DATA").map(PathBuf::from).or_else(|| {
        let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().skip(1);
        above.map(|a| a.join("shared")).find(|p| p.is_dir())
    });
    let Some(folder) = root.map(|r| r.join("data/dots").join(folder)).filter(|p| p.is_dir()) else {
        println!("skipped: no data");
        return Vec::new();
    };
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("a readable folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|p| {
            let name = p.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            name.starts_with(begins) && (name.ends_with(".png") || name.ends_with(".jpeg"))
        })
        .collect();
    paths.sort();
    paths
}

/// The dots of a picture, whatever their size.
pub(super) fn dots(colour: &RgbImage) -> Vec<Dot> {
    let (width, height) = (colour.width() as usize, colour.height() as usize);
    let grey = grey_from_colour(width, height, 3 * width, colour.as_raw(), Channels::Rgb).expect("grey");
    let view = GreyView::new(width, height, width, &grey).expect("a view");
    Finder::default().find_of_any_size(&view, &DotSettings::default()).0.dots
}

/// The camera of the calibration target, from `sim_white_dot_cal_gold.xml`.
const GOLD: Camera = Camera {
    size_px: [1920, 1200],
    focal_px: [6671.8, 6667.8],
    principal_px: [871.61, 580.13],
    radial: [0.03239, -1.044, 20.433],
    tangential: [0.0, 0.0],
};

/// Turns and moves the target's frame into the camera's.
#[derive(Clone, Copy)]
struct Pose {
    turn: Mat3,
    shift_m: Vec3,
}

/// Pose of the target in the first picture, from the same file.
fn gold_pose() -> Pose {
    Pose {
        turn: Mat3::new(
            0.96379, -0.266481, 0.00981836, -0.249976, -0.915688, -0.314688, 0.092849, 0.300839, -0.949144,
        ),
        shift_m: Vec3::new(-0.018_996_5, 0.028_882_3, 0.386_554),
    }
}

/// Dots of the target: 14 × 10, 7 mm apart, the origin at column 2 and row 2 (from `sim_white_dot_input.xml`).
fn target() -> Vec<Vec3> {
    (0..140).map(|i| Vec3::new(f64::from(i % 14 - 2), f64::from(i / 14 - 2), 0.0) * 7e-3).collect()
}

impl Pose {
    fn see(&self, dot: Vec3) -> Vector2<f64> {
        let disc = DiscInSpace {
            centre_m: self.turn * dot + self.shift_m,
            normal: self.turn.column(2).into_owned(),
            radius_m: 0.95e-3,
        };
        disc.image_centre(&GOLD).expect("in front")
    }

    fn stepped(&self, step: &SVector<f64, 6>) -> Self {
        let turn = Rotation3::new(step.fixed_rows::<3>(0).into_owned()).into_inner() * self.turn;
        Self { turn, shift_m: self.shift_m + step.fixed_rows::<3>(3) }
    }

    /// Dots that are seen within `reach` px of where the pose puts them.
    fn pairs(&self, found: &[Dot], reach: f64) -> Vec<(Vec3, Vector2<f64>)> {
        let whole = found.iter().filter(|d| d.is_whole() && d.blur_px.is_some());
        let places: Vec<Vector2<f64>> = whole.map(|d| d.centre_px.into()).collect();
        let near = |t: &Vec3| places.iter().find(|p| (self.see(*t) - **p).norm() < reach).map(|p| (*t, *p));
        target().iter().filter_map(near).collect()
    }

    fn rms(&self, pairs: &[(Vec3, Vector2<f64>)]) -> f64 {
        let sum: f64 = pairs.iter().map(|(t, p)| (self.see(*t) - p).norm_squared()).sum();
        (sum / (2.0 * pairs.len() as f64)).sqrt()
    }

    /// Least squares over the six numbers of a pose.
    fn fitted(mut self, pairs: &[(Vec3, Vector2<f64>)]) -> Self {
        for _ in 0..20 {
            let (mut normal, mut right) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
            for (t, p) in pairs {
                let here = self.see(*t);
                let jacobian = SMatrix::<f64, 2, 6>::from_columns(&std::array::from_fn::<_, 6, _>(|k| {
                    let mut step = SVector::zeros();
                    step[k] = 1e-7;
                    (self.stepped(&step).see(*t) - here) * 1e7
                }));
                normal += jacobian.transpose() * jacobian;
                right += jacobian.transpose() * (p - here);
            }
            self = self.stepped(&normal.cholesky().expect("enough dots").solve(&right));
        }
        self
    }
}

/// Dots with their places on a target of 7 mm, counted from one in the middle along its rows and columns: which corner of the target is
/// which does not matter to a fit.
fn lattice(found: &[Dot]) -> Vec<(Vec3, Vector2<f64>)> {
    let whole = found.iter().filter(|d| d.is_whole() && d.blur_px.is_some());
    let places: Vec<Vector2<f64>> = whole.map(|d| d.centre_px.into()).collect();
    let nearest = |p: Vector2<f64>| {
        (0..places.len())
            .min_by(|&a, &b| (places[a] - p).norm().total_cmp(&(places[b] - p).norm()))
            .expect("dots")
    };
    let first = nearest(Vector2::new(960.0, 600.0));
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by(|&a, &b| (places[a] - places[first]).norm().total_cmp(&(places[b] - places[first]).norm()));
    let along = places[order[1]] - places[first];
    let across = Vector2::new(-along.y, along.x);
    let mut index: Vec<Option<[i32; 2]>> = vec![None; places.len()];
    index[first] = Some([0, 0]);
    let mut queue = std::collections::VecDeque::from([(first, along, across)]);
    while let Some((at, along, across)) = queue.pop_front() {
        let [i, j] = index[at].expect("only what has an index is in the queue");
        for (di, dj) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let step = along * f64::from(di) + across * f64::from(dj);
            let to = nearest(places[at] + step);
            if index[to].is_none() && (places[to] - places[at] - step).norm() < 0.25 * step.norm() {
                index[to] = Some([i + di, j + dj]);
                let real = (places[to] - places[at]) * f64::from(di + dj);
                queue.push_back(if dj == 0 { (to, real, across) } else { (to, along, real) });
            }
        }
    }
    let indexed = index.iter().zip(&places).filter_map(|(index, p)| Some(((*index)?, *p)));
    indexed.map(|([i, j], p)| (Vec3::new(f64::from(i), f64::from(j), 0.0) * 7e-3, p)).collect()
}

/// A pose that faces the camera.
fn facing(pairs: &[(Vec3, Vector2<f64>)]) -> Pose {
    let of = |t: Vec3| pairs.iter().find(|p| (p.0 - t).norm() < 1e-6).map(|p| p.1);
    let origin = of(Vec3::zeros()).expect("the dot in the middle");
    let next = of(Vec3::new(7e-3, 0.0, 0.0)).expect("its neighbour") - origin;
    let turn = Rotation3::from_euler_angles(0.0, 0.0, next.y.atan2(next.x)).into_inner();
    let depth_m = GOLD.focal_px[0] * 7e-3 / next.norm();
    Pose { turn, shift_m: GOLD.back_project(origin.into(), depth_m).expect("a ray") }
}

/// The three dots that have a hole, and as many again that are scratched.
const ODD: usize = 6;

/// The first picture against the pose of its file, and all against the pose that fits them best. The file's pose came out of somebody's
/// calibration and is no better known than a tenth of a pixel; its lens is what is tested against.
#[test]
fn dots_of_a_calibration_target_are_where_its_camera_sees_them() {
    for (number, path) in pictures("dice", "white_dot").iter().enumerate() {
        let found = dots(&image::open(path).expect("a picture").to_rgb8());
        if number == 0 {
            let pose = gold_pose();
            let pairs = pose.pairs(&found, 15.0);
            let mean = pairs.iter().map(|(t, p)| p - pose.see(*t)).sum::<Vector2<f64>>() / pairs.len() as f64;
            println!(
                "{}: {} dots, {:.4} px from the pose of the file, in the mean by ({:.4}, {:.4})",
                path.display(),
                pairs.len(),
                pose.rms(&pairs),
                mean.x,
                mean.y
            );
            assert!(pose.rms(&pairs) < 0.12);
        }
        let mut pairs = lattice(&found);
        let pose = facing(&pairs).fitted(&pairs);
        let all = pose.rms(&pairs);
        pairs.sort_by(|a, b| (pose.see(a.0) - a.1).norm().total_cmp(&(pose.see(b.0) - b.1).norm()));
        let most = (pose.see(pairs[pairs.len() - 1].0) - pairs[pairs.len() - 1].1).norm();
        let count = pairs.len();
        pairs.truncate(count - ODD);
        let sound = pose.fitted(&pairs).rms(&pairs);
        println!(
            "{}: {count} dots, {all:.4} px RMS per axis from the pose that fits, most {most:.3}; without {ODD} odd ones {sound:.4}",
            path.display()
        );
        assert!(count > 110 && all < 0.02);
    }
}
