//! `calibrate camera`: pictures of a board that are drawn here, with a lens that is known.

use super::{names, run, utf8};
use image::GrayImage;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::path::Path;

const SIZE: [u32; 2] = [640, 480];
/// fx, fy, cx, cy, k1, k2, p1, p2.
const TRUTH: [f64; 8] = [905.0, 903.0, 327.0, 233.0, -0.11, 0.08, 6e-4, -4e-4];
const COLUMNS: usize = 9;
const ROWS: usize = 7;
const PITCH_M: f64 = 0.012;
/// Standard deviation of the optics' blur, and that of a pixel's own size (px).
const BLUR_PX: f64 = 0.65;
/// Places of the blur that a pixel is the mean of.
const PLACES: usize = 200;
/// Grey levels.
const NOISE: f64 = 1.5;

#[derive(Clone, Copy, PartialEq)]
enum Print {
    Dots {
        radius_m: f64,
    },
    /// Dots of which some are printed in the wrong place.
    WrongDots {
        radius_m: f64,
    },
    Squares,
}

/// Dots in the wrong place: column, row, and how far along both (m). A pixel sees a quarter of a millimetre.
const WRONG: [([f64; 2], [f64; 2]); 3] =
    [([0.0, 0.0], [5e-4, -3e-4]), ([8.0, 3.0], [4e-4, 0.0]), ([5.0, 6.0], [0.0, -2e-4])];

impl Print {
    /// How light the board is at a place of its own (m, from the first point), 0 to 1.
    fn light(self, [x, y]: [f64; 2]) -> f64 {
        let (column, row) = (x / PITCH_M, y / PITCH_M);
        let margin = 1.6;
        let on = |value: f64, count: usize| (-margin..count as f64 - 1.0 + margin).contains(&value);
        if !(on(column, COLUMNS) && on(row, ROWS)) {
            return 0.35;
        }
        match self {
            Self::Dots { radius_m } | Self::WrongDots { radius_m } => {
                let inside = |value: f64, count: usize| value.round().clamp(0.0, count as f64 - 1.0);
                let nearest = [inside(column, COLUMNS), inside(row, ROWS)];
                let wrong =
                    WRONG.iter().find(|(dot, _)| matches!(self, Self::WrongDots { .. }) && *dot == nearest);
                let by = wrong.map_or([0.0; 2], |(_, by)| *by);
                let off = [column - nearest[0], row - nearest[1]].map(|off| off * PITCH_M);
                if (off[0] - by[0]).hypot(off[1] - by[1]) < radius_m { 0.9 } else { 0.1 }
            }
            Self::Squares => {
                let within = |value: f64, count: usize| (-1.0..count as f64).contains(&value);
                let dark = (column.floor() + row.floor()).rem_euclid(2.0) < 0.5;
                if within(column, COLUMNS) && within(row, ROWS) && dark { 0.1 } else { 0.9 }
            }
        }
    }

    fn words(self) -> Vec<&'static str> {
        match self {
            Self::Dots { .. } | Self::WrongDots { .. } => vec!["--board", "dots", "--radius-mm", "3.5"],
            Self::Squares => vec!["--board", "checkerboard"],
        }
    }
}

/// Direction of view of a pixel: Brown's distortion taken off by fixed-point iteration.
fn ray(u: f64, v: f64) -> [f64; 2] {
    let [fx, fy, cx, cy, k1, k2, p1, p2] = TRUTH;
    let seen = [(u - cx) / fx, (v - cy) / fy];
    let mut at = seen;
    for _ in 0..10 {
        let [x, y] = at;
        let r2 = x * x + y * y;
        let radial = 1.0 + k1 * r2 + k2 * r2 * r2;
        let dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        at = [(seen[0] - dx) / radial, (seen[1] - dy) / radial];
    }
    at
}

/// A board whose middle lies at `middle_m` of the camera frame, turned about x, y and then z.
fn picture(print: Print, turn: [f64; 3], middle_m: [f64; 3], random: &mut ChaCha8Rng) -> GrayImage {
    let ([sa, ca], [sb, cb], [sc, cc]) =
        ([turn[0].sin(), turn[0].cos()], [turn[1].sin(), turn[1].cos()], [turn[2].sin(), turn[2].cos()]);
    // Columns of Rz · Ry · Rx: where the board's axes point.
    let x = [cc * cb, sc * cb, -sb];
    let y = [cc * sb * sa - sc * ca, sc * sb * sa + cc * ca, cb * sa];
    let normal = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let half = [0.5 * (COLUMNS - 1) as f64 * PITCH_M, 0.5 * (ROWS - 1) as f64 * PITCH_M];
    // Equal shares of the blur, along a spiral of the golden angle.
    let blur: Vec<[f64; 2]> = (0..PLACES)
        .map(|k| {
            let share = (k as f64 + 0.5) / PLACES as f64;
            let (radius, turn) =
                (BLUR_PX * (-2.0 * (1.0 - share).ln()).sqrt(), 2.399_963_229_728_653 * k as f64);
            [radius * turn.cos(), radius * turn.sin()]
        })
        .collect();
    GrayImage::from_fn(SIZE[0], SIZE[1], |column, row| {
        let mut light = 0.0;
        // Around a pixel the lens is even.
        let [u, v] = [f64::from(column), f64::from(row)];
        let corners = [ray(u, v), ray(u + 0.5, v), ray(u, v + 0.5)];
        let near = |du: f64, dv: f64| {
            let [at, right, below] = corners;
            [0, 1].map(|i| at[i] + 2.0 * (du * (right[i] - at[i]) + dv * (below[i] - at[i])))
        };
        for [du, dv] in &blur {
            let [a, b] = near(*du, *dv);
            let direction = [a, b, 1.0];
            let depth = dot(normal, middle_m) / dot(normal, direction);
            let from_middle = [0, 1, 2].map(|i| direction[i] * depth - middle_m[i]);
            light += print.light([dot(x, from_middle) + half[0], dot(y, from_middle) + half[1]]);
        }
        // A sum of twelve even draws is nearly normal.
        let noise: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let level = 20.0 + 200.0 * light / PLACES as f64 + NOISE * noise;
        image::Luma([level.round().clamp(0.0, 255.0) as u8])
    })
}

/// Twelve pictures: tilted each in another direction, and towards the corners.
fn board(print: Print, folder: &Path) {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for k in 0..12_u32 {
        let angle = f64::from(k) * 0.61;
        let tilt = 0.35 + 0.02 * f64::from(k);
        let side = |one: bool| if one { 1.0 } else { -1.0 };
        let off = [0.03 * side(k & 1 == 0), 0.022 * side(k & 2 == 0)];
        let turn = [tilt * angle.cos(), tilt * angle.sin(), 0.3 * (1.7 * angle).sin()];
        let at = [off[0], off[1], 0.235 + 0.004 * f64::from(k % 4)];
        let drawn = picture(print, turn, at, &mut random);
        drawn.save(folder.join(format!("board-{k:02}.png"))).expect("writable");
    }
}

#[test]
fn a_lens_is_found_from_pictures_of_dots_and_of_squares() {
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
    for print in [Print::Dots { radius_m: 3.5e-3 }, Print::Squares] {
        let place = tempfile::tempdir().expect("a folder");
        let at = |name: &str| place.path().join(name);
        std::fs::create_dir(at("board")).expect("writable");
        board(print, &at("board"));
        // One that shows no board is left out by name.
        GrayImage::from_pixel(SIZE[0], SIZE[1], image::Luma([90]))
            .save(at("board/empty.png"))
            .expect("writable");
        let (folder, out, strip) = (at("board"), at("lens.toml"), at("strip.png"));
        let mut words = vec!["calibrate", "camera", utf8(&folder), "--columns", "9", "--rows", "7"];
        words.extend(["--pitch-mm", "12", "--out", utf8(&out), "--overlay", utf8(&strip), "--json"]);
        words.extend(print.words());
        let (code, text, stderr) = run(&words);
        assert_eq!(code, 0, "{text}{stderr}");
        let json: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(json["pictures"].as_array().map(Vec::len), Some(12), "{json:#}");
        assert!(json["left_out"][0]["name"].as_str().expect("a name").ends_with("empty.png"), "{json:#}");
        let list = |key: &str| -> Vec<f64> {
            json[key].as_array().expect("numbers").iter().map(|x| x.as_f64().expect("a number")).collect()
        };
        let found = [list("focal_px"), list("principal_px"), list("radial"), list("tangential")];
        let found = [0, 0, 1, 1, 2, 2, 3, 3].iter().enumerate().map(|(k, &list)| found[list][k % 2]);
        let deviations = list("deviations");
        let off: Vec<f64> =
            found.zip(TRUTH).zip(&deviations).map(|((found, truth), sd)| (found - truth) / sd).collect();
        println!("off by {off:.2?} standard deviations of {deviations:.5?}");
        assert!(off.iter().all(|off| off.abs() < 4.0), "{off:?}");
        assert!(deviations[0] < 0.6 && deviations[2] < 0.6, "{deviations:?}");
        assert!(std::fs::metadata(&strip).expect("a picture").len() > 10_000);
        // A rig file may name it, in place of the lens's numbers, where pictures have its size.
        std::fs::copy(rigs.join("sim-camera-registration.toml"), at("sim-camera-registration.toml"))
            .expect("writable");
        let known = std::fs::read_to_string(rigs.join("sim-camera.toml")).expect("readable");
        let plan = |name: &str, rig: &str| {
            std::fs::write(at(name), rig).expect("writable");
            run(&["plan", utf8(&rigs.join("protocols/look.toml")), "--rig", utf8(&at(name))])
        };
        // The first of each is that of the camera as it was calibrated.
        let both = known.replacen("\nfocal_px", "\nlens = \"lens.toml\"\nfocal_px", 1);
        let (code, text, stderr) = plan("both.toml", &both);
        assert!(code == 1 && stderr.contains("not both"), "{code} {text}{stderr}");
        let named = ["focal_px", "radial", "tangential"]
            .iter()
            .fold(both, |rig, key| rig.replacen(&format!("\n{key}"), &format!("\n# {key}"), 1));
        let (code, text, stderr) = plan("named.toml", &named);
        assert_eq!(code, 0, "{text}{stderr}");
        let small = named.replace("size_px = [640, 480]", "size_px = [320, 240]");
        let (code, text, stderr) = plan("small.toml", &small);
        assert!(code == 1 && stderr.contains("640 × 480 pixels"), "{code} {text}{stderr}");
    }
}

/// Three dots of 63 that the printer put elsewhere, in every picture.
#[test]
fn wrong_dots_of_a_board_are_left_out() {
    let place = tempfile::tempdir().expect("a folder");
    board(Print::WrongDots { radius_m: 3.5e-3 }, place.path());
    let out = place.path().join("lens.toml");
    let words =
        ["calibrate", "camera", utf8(place.path()), "--columns", "9", "--rows", "7", "--pitch-mm", "12"];
    let dots = ["--board", "dots", "--radius-mm", "3.5", "--out", utf8(&out)];
    let words = [&words[..], &dots].concat();
    let (code, text, stderr) = run(&words);
    assert!(code == 3 && text.contains("found without"), "{text}{stderr}");
    // Paths in a rig file count from its own folder, wherever that is.
    let next = "Next: in a rig file beside it, under [camera]: lens = \"lens.toml\"";
    assert!(text.contains(next), "{text}");
    println!("{text}");
    let (_, text, stderr) = run(&[&words[..], &["--force", "--json"]].concat());
    let json: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}{stderr}"));
    let number = |value: &Value| value.as_f64().expect("a number");
    let wrong = json["points_left_out"]["points"].as_u64().expect("a count");
    // Three in each of twelve pictures, less those that the border of the picture cuts.
    assert!((24..=36).contains(&wrong), "{json:#}");
    let deviation = |k: usize| number(&json["deviations"][k]);
    let with_them = &json["points_left_out"]["with_them"];
    for (k, key) in ["focal_px", "focal_px", "principal_px", "principal_px"].into_iter().enumerate() {
        let off = number(&json[key][k % 2]) - TRUTH[k];
        println!(
            "{key}: off by {off:+.3} px, {:+.3} with wrong dots; deviation {:.3}",
            number(&with_them[key][k % 2]) - TRUTH[k],
            deviation(k)
        );
        assert!(off.abs() < 4.0 * deviation(k), "{key} {k}: {off}");
    }
    assert!(number(&json["rms_px"]) < 0.1 && number(&json["points_left_out"]["moved_px"]) > 0.0, "{json:#}");
}

#[test]
fn what_shows_no_board_writes_no_lens() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    std::fs::create_dir(at("empty")).expect("writable");
    std::fs::create_dir(at("grey")).expect("writable");
    GrayImage::from_pixel(SIZE[0], SIZE[1], image::Luma([90])).save(at("grey/a.png")).expect("writable");
    std::fs::write(at("grey/b.png"), "no picture").expect("writable");
    let (out, grey) = (at("lens.toml"), at("grey/a.png"));
    let refused = |source: &str, more: &[&str], exit: i32, words: &str| {
        let mut all =
            vec!["calibrate", "camera", source, "--columns", "9", "--rows", "7", "--pitch-mm", "12"];
        all.extend(["--out", utf8(&out)]);
        all.extend(more);
        let (code, text, stderr) = run(&all);
        assert!(code == exit && stderr.contains(words), "{words}: {code} {text}{stderr}");
    };
    let squares = ["--board", "checkerboard"];
    refused(utf8(&grey), &squares, 1, "no picture shows the board");
    refused(utf8(&at("empty")), &squares, 1, "no pictures");
    refused(utf8(&at("grey/b.png")), &squares, 1, "b.png");
    refused(utf8(&at("nowhere.png")), &squares, 1, "nowhere.png");
    refused(utf8(&grey), &["--board", "dots"], 2, "--radius-mm");
    refused(utf8(&grey), &["--board", "dots", "--radius-mm", "7"], 2, "less than half");
    let large = "--radius-mm 7: expected more than 0 and less than half of the pitch, --pitch-mm 12";
    refused(utf8(&grey), &["--board", "dots", "--radius-mm", "7"], 2, large);
    refused(utf8(&grey), &["--board", "checkerboard", "--radius-mm", "2"], 2, "--board dots");
    assert_eq!(names(place.path()), ["empty", "grey"]);
}

/// Squares where dots are asked for: said once for all pictures, with the option to try.
#[test]
fn the_other_kind_of_board_is_thought_of() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("board");
    std::fs::create_dir(&folder).expect("writable");
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for (name, turn) in [("a", 0.3), ("b", -0.3), ("c", 0.1)] {
        let file = folder.join(format!("{name}.png"));
        picture(Print::Squares, [turn, 0.2, 0.0], [0.0, 0.0, 0.2], &mut random).save(file).expect("writable");
    }
    let out = place.path().join("lens.toml");
    let mut words = vec!["calibrate", "camera", utf8(&folder), "--columns", "9", "--rows", "7"];
    words.extend(["--pitch-mm", "12", "--out", utf8(&out), "--board", "dots", "--radius-mm", "3.5"]);
    let (code, text, stderr) = run(&words);
    assert!(code == 1 && stderr.contains("--board checkerboard"), "{code} {text}{stderr}");
    assert_eq!(stderr.matches("left out").count(), 1, "{stderr}");
    assert!(stderr.contains("left out: 3 pictures, ") && stderr.contains("of 63 dots"), "{stderr}");
}
