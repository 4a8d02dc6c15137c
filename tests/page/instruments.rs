//! Do the pages of `calibrate` show, in a real browser: every plot drawn within its frame, no legend over it, nothing wider than the screen?

use super::bench::{Dice, ForceBench, StageBench, press, press_csv, stage_csv, weights_csv};
use super::browser;
use super::program::{run, utf8};
use super::synthetic;
use super::view::{SCREEN, assert_quiet};
use phantom_rig::report::{Curve, SpecimenTable, specimen_page};
use std::fs;
use std::path::{Path, PathBuf};

/// For every plot: traces drawn, lowest edge of the legend less the upper edge of the frame (px), marks drawn.
const PLOTS: &str = "[...document.querySelectorAll('.plot[id]')].map(plot => {
    const top = plot.getBoundingClientRect().top + plot._fullLayout._size.t;
    const legend = plot.querySelector('.legend'), bottom = legend ? legend.getBoundingClientRect().bottom : top;
    return [plot.querySelectorAll('.trace').length, bottom - top, plot.querySelectorAll('.points path, .lines path').length];
})";

/// Opens the pages one by one.
fn shown(pages: &[PathBuf]) {
    let Some(mut browser) = browser::start(SCREEN.0, SCREEN.1) else {
        println!("skipped: no Chromium");
        return;
    };
    for page in pages {
        browser.open(page);
        assert_quiet(&browser);
        let name = page.display();
        let plots = browser.evaluate(PLOTS);
        let plots = plots.as_array().expect("a list");
        assert!(!plots.is_empty(), "{name}: no plot");
        for plot in plots {
            let number = |i: usize| plot[i].as_f64().expect("a number");
            assert!(number(0) >= 1.0 && number(2) >= 1.0, "{name}: nothing drawn: {plot}");
            assert!(number(1) <= 1.0, "{name}: the legend lies over the plot: {plot}");
        }
        let over = browser.evaluate("document.documentElement.scrollWidth - innerWidth");
        assert!(over.as_f64().expect("a width") <= 0.0, "{name}: {over} px wider than the screen");
        let open = browser.evaluate("/NaN|undefined|\\{\\{/.test(document.body.innerText)");
        assert_eq!(open, false, "{name}");
        let picture = page.with_extension("png");
        fs::write(&picture, browser.picture(true)).expect("a picture");
    }
}

fn specimen(folder: &Path, decades: bool, rates: usize) -> PathBuf {
    let fall = |t: f64, k: usize| 2.0 + k as f64 + (-t / 40.0).exp();
    let times = |n: u32| (1..n).map(move |i| 1000.0 * (f64::from(i) / f64::from(n)).powi(2));
    let mut curves = Vec::new();
    for k in 0..rates {
        let dots = times(800).map(|t| (t, fall(t, k) + 0.02 * (31.0 * t).sin())).collect();
        curves.push(Curve {
            name: format!("a recording with quite a long name {k}"),
            points: dots,
            line: false,
        });
        let line = times(800).map(|t| (t, fall(t, k))).collect();
        curves.push(Curve {
            name: format!("a recording with quite a long name {k}, modelled"),
            points: line,
            line: true,
        });
    }
    let table = SpecimenTable {
        title: "Terms",
        head: vec!["time constant, s", "share"],
        rows: vec![vec!["40.0".to_owned(), "0.3".to_owned()]],
        note: "Of the force.",
    };
    let axes = ["time since the ramp began, s", "force, N"];
    let remarks = ["one specimen".to_owned()];
    let page = specimen_page(["Relaxation", "a.csv", "one term"], &remarks, &[table], axes, decades, &curves);
    let file = folder.join(format!("specimen-{decades}-{rates}.html"));
    fs::write(&file, page.expect("a page")).expect("a file");
    file
}

#[test]
fn pages_of_specimens_are_drawn() {
    let folder = synthetic::kept_folder("specimens");
    shown(&[specimen(&folder, true, 3), specimen(&folder, false, 1)]);
}

#[test]
fn pages_of_instruments_are_drawn() {
    let folder = synthetic::kept_folder("instruments");
    let kept = |name: &str, text: String| {
        let file = folder.join(name);
        fs::write(&file, text).expect("writable");
        file
    };
    let mut dice = Dice::new(21);
    let bench = ForceBench::new(&mut dice);
    let weights = kept("weights.csv", weights_csv(&bench.table(&mut dice)));
    let axis = StageBench::usual();
    let gauge =
        kept("gauge.csv", stage_csv(&axis.table(5, &[1e-3, 7.3e-3, 12.1e-3, 19.8e-3, 24.6e-3], &mut dice)));
    let block = kept("block.csv", press_csv(&press(92e-6, 30_000.0, 0.03, &mut dice)));
    let (force, stage) = (folder.join("force"), folder.join("stage"));
    for arguments in [
        vec!["calibrate", "force", utf8(&weights), "--serial", "FT1", "--force", "--out", utf8(&force)],
        vec!["calibrate", "stage", utf8(&gauge), "--block", utf8(&block), "--force", "--out", utf8(&stage)],
    ] {
        let (code, text, stderr) = run(&arguments);
        assert_eq!(code, 0, "{text}{stderr}");
    }
    shown(&[force.join("force.html"), stage.join("stage.html")]);
}
