//! `dots`: pictures that are drawn here, their dots at known places; and what is none.

use super::{names, run, utf8};
use image::{GrayImage, ImageBuffer, Luma, Rgb, RgbImage};
use serde_json::Value;
use std::path::Path;

/// Dots of 6 × 5 at random fractions of pixels.
fn centres() -> Vec<[f64; 2]> {
    (0..30)
        .map(|k| {
            let off = |step: f64| (f64::from(k) * step).fract() - 0.5;
            [30.0 + 36.0 * f64::from(k % 6) + off(0.618), 28.0 + 36.0 * f64::from(k / 6) + off(0.755)]
        })
        .collect()
}

/// Share of a pixel that the dots of a radius cover, from 16 × 16 places in it. The middle of pixel (0, 0) is (0, 0).
fn covered(x: u32, y: u32, radius_px: f64) -> f64 {
    let near = |c: &[f64; 2]| (c[0] - f64::from(x)).hypot(c[1] - f64::from(y)) < radius_px + 1.0;
    let Some(centre) = centres().into_iter().find(near) else { return 0.0 };
    let place = |k: i32| (f64::from(k) + 0.5) / 16.0 - 0.5;
    let inside = |i: i32, j: i32| {
        (f64::from(x) + place(i) - centre[0]).hypot(f64::from(y) + place(j) - centre[1]) < radius_px
    };
    let count = (0..16).flat_map(|j| (0..16).map(move |i| (i, j))).filter(|(i, j)| inside(*i, *j)).count();
    count as f64 / 256.0
}

fn picture(radius_px: f64, [dark, light]: [f64; 2]) -> GrayImage {
    GrayImage::from_fn(250, 210, |x, y| {
        Luma([(dark + (light - dark) * covered(x, y, radius_px)).round().clamp(0.0, 255.0) as u8])
    })
}

fn dots(words: &[&str]) -> (i32, String, String) {
    run(&[&["dots"], words].concat())
}

fn json(words: &[&str]) -> (i32, Value) {
    let (code, text, stderr) = dots(&[words, &["--json"]].concat());
    (code, serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}{stderr}")))
}

/// Rows of dots.csv: the picture, and its other columns.
fn table(folder: &Path) -> Vec<(String, Vec<String>)> {
    let mut reader = csv::Reader::from_path(folder.join("dots.csv")).expect("a table");
    let header = reader.headers().expect("a header").clone();
    assert_eq!(
        header.iter().take(8).collect::<Vec<_>>().join(","),
        "picture,dot,x_px,y_px,radius_px,aspect,quality,sd_px"
    );
    let row = |row: csv::StringRecord| (row[0].to_owned(), row.iter().skip(1).map(str::to_owned).collect());
    reader.records().map(|r| row(r.expect("a row"))).collect()
}

#[test]
fn dots_of_any_size_and_of_every_kind_of_file_are_found_where_they_are() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    std::fs::create_dir(at("trial")).expect("writable");
    picture(2.6, [20.0, 180.0]).save(at("trial/small.png")).expect("writable");
    picture(13.5, [20.0, 180.0]).save(at("trial/large, grey.png")).expect("writable");
    let grey = picture(5.0, [20.0, 180.0]);
    let deep = ImageBuffer::<Luma<u16>, _>::from_fn(250, 210, |x, y| {
        Luma([u16::from(grey.get_pixel(x, y)[0]) * 16])
    });
    deep.save(at("trial/deep.png")).expect("writable");
    let colour = RgbImage::from_fn(250, 210, |x, y| Rgb([grey.get_pixel(x, y)[0]; 3]));
    colour.save(at("trial/colour.jpg")).expect("writable");
    let (trial, out) = (at("trial"), at("out"));
    let (code, text, stderr) = dots(&[utf8(&trial), "--out", utf8(&out)]);
    // `track` has a range of radii that those of 13.5 px are not in: it could not follow them.
    assert_eq!(code, 3, "{text}{stderr}");
    assert_eq!(text.matches(": 30 dots").count(), 4, "{text}");
    assert_eq!(text.matches("`track` looks for 2.5 to 12 px radius").count(), 1, "{text}");
    assert!(text.contains("would find 0 dots; 30 are too large; here that half is 13."), "{text}");
    let expected = [
        "colour-dots.png",
        "deep-dots.png",
        "dots.csv",
        "dots.json",
        "large, grey-dots.png",
        "small-dots.png",
    ];
    assert_eq!(names(&out)[1..], expected);
    let rows = table(&out);
    assert_eq!(rows.len(), 4 * 30);
    for (name, most) in
        [("small.png", 0.02), ("large, grey.png", 0.02), ("deep.png", 0.02), ("colour.jpg", 0.1)]
    {
        let seen: Vec<[f64; 2]> = rows
            .iter()
            .filter(|(picture, _)| picture.ends_with(name))
            .map(|(_, row)| [1, 2].map(|k: usize| row[k].parse().expect("a number")))
            .collect();
        assert_eq!(seen.len(), 30, "{name}");
        let off = |c: &[f64; 2]| {
            seen.iter().map(|s| (s[0] - c[0]).hypot(s[1] - c[1])).fold(f64::INFINITY, f64::min)
        };
        let worst = centres().iter().map(off).fold(0.0, f64::max);
        println!("{name}: centres within {worst:.4} px");
        assert!(worst < most, "{name}: {worst}");
    }
    let ringed = image::open(out.join("deep-dots.png")).expect("a picture").to_rgb8();
    let green = ringed.pixels().filter(|p| p[1] > p[0] + 50 && p[1] > p[2] + 50).count();
    assert!(ringed.dimensions() == (250, 210) && green > 30 * 30, "{green}");
    // The same again replaces it, and another kind of result is not replaced.
    let (code, result) = json(&[utf8(&trial), "--out", utf8(&out)]);
    assert_eq!((code, &result["format"]), (3, &"phantom-dots/1".into()));
    assert_eq!(result["pictures"][1]["bits"], 12, "{result:#}");
    let faults = |k: usize| result["pictures"][k]["faults"].as_array().expect("a list").len();
    assert_eq!([0, 1, 2, 3].map(faults), [0, 0, 1, 0], "{result:#}");
    let (code, text, stderr) = dots(&[utf8(&trial.join("small.png"))]);
    assert_eq!((code, text.contains("`track`")), (0, false), "{text}{stderr}");
    std::fs::create_dir_all(at("thesis/chapters")).expect("writable");
    let (code, _, stderr) = dots(&[utf8(&trial), "--out", utf8(&at("thesis"))]);
    assert!(code == 1 && stderr.contains("--force"), "{stderr}");
}

#[test]
fn pictures_without_dots_say_why() {
    let place = tempfile::tempdir().expect("a folder");
    let save = |name: &str, picture: GrayImage| {
        let file = place.path().join(name);
        picture.save(&file).expect("writable");
        utf8(&file).to_owned()
    };
    let grey = save("grey.png", GrayImage::from_pixel(200, 150, Luma([90])));
    let black = save("black.png", GrayImage::from_pixel(200, 150, Luma([3])));
    let light = save("light.png", GrayImage::from_pixel(200, 150, Luma([255])));
    let inverse = save("inverse.png", picture(5.0, [200.0, 30.0]));
    let white = save("white.png", picture(5.0, [40.0, 400.0]));
    let tiny = save("tiny.png", GrayImage::from_pixel(1, 1, Luma([9])));
    let few = save(
        "few.png",
        GrayImage::from_fn(64, 64, |x, y| {
            Luma([if x.abs_diff(32).pow(2) + y.abs_diff(32).pow(2) < 40 { 200 } else { 20 }])
        }),
    );
    let good = save("good.png", picture(5.0, [20.0, 180.0]));
    for (file, words) in [
        (&grey, "no dots of"),
        (&black, "expose longer"),
        (&light, "expose less"),
        (&inverse, "30 dark dots on light"),
        (&white, "30 of 30 dots are saturated"),
        (&tiny, "no dots of"),
        (&few, "1 whole dots of"),
    ] {
        let (code, text, stderr) = dots(&[file]);
        assert!(code == 3 && text.contains(words), "{words}: {code} {text}{stderr}");
    }
    let notes = place.path().join("notes.png");
    std::fs::write(&notes, "not a picture").expect("writable");
    let (code, text, stderr) = dots(&[&good, utf8(&notes)]);
    assert!(
        code == 3 && text.contains("30 dots") && text.contains("not read") && text.contains("notes.png"),
        "{text}{stderr}"
    );
    let (code, text, stderr) = dots(&[utf8(&notes)]);
    assert!(
        code == 1 && stderr.contains("no picture could be read") && stderr.contains("notes.png"),
        "{text}{stderr}"
    );
    let (code, _, stderr) = dots(&["/no/such/folder/a.png"]);
    assert!(code == 1 && stderr.contains("/no/such/folder"), "{stderr}");
    for radii in ["5", "0.5,3", "9,4", "a,b"] {
        assert_eq!(dots(&[&good, "--radius-px", radii]).0, 2, "{radii}");
    }
    let (code, text, _) = dots(&[&good, "--radius-px", "8,12"]);
    assert!(code == 3 && text.contains("no dots of 8.0 to 12.0 px"), "{text}");
}
