//! Does the page show, in a real browser, without a network?

use super::browser::{self, Browser};
use super::picture::{Part, changed_share, contrast, drawn_share, pixels};
use super::synthetic;
use phantom_rig::inverse::Fit;
use phantom_rig::observation::Recording;
use phantom_rig::report::page;
use serde_json::{Map, Value, json};
use std::fs;
use std::path::PathBuf;

/// The screen of a small laptop.
pub(crate) const SCREEN: (u32, u32) = (1366, 768);
const PLOTS: [&str; 5] = ["phantom", "force", "force-residual", "marker-residual", "chi2"];
/// Least contrast of text (W3C 2018, WCAG 2.1, success criterion 1.4.3).
const READABLE: f64 = 4.5;

/// The page of a fit, drawn in a browser, with the folder it lies in; `None` without a browser.
fn shown(folder: &str, fit: &Fit, recording: &Recording) -> Option<(Browser, PathBuf)> {
    let settings = json!({"l1_weight": 0.3, "note": "<i>plain</i>"});
    let settings: &Map<String, Value> = settings.as_object().expect("an object");
    let text = page(fit, recording, settings).expect("a page");
    let Some(mut browser) = browser::start(SCREEN.0, SCREEN.1) else {
        println!("skipped: no Chromium");
        return None;
    };
    let folder = synthetic::kept_folder(folder);
    let file = folder.join("fit.html");
    fs::write(&file, text).expect("a file");
    browser.open(&file);
    Some((browser, folder))
}

/// Neither an error in the console nor a request but for the page itself and what it carries in itself.
pub(crate) fn assert_quiet(browser: &Browser) {
    assert!(browser.complaints.is_empty(), "{:#?}", browser.complaints);
    assert!(!browser.requests.is_empty(), "not even the page was asked for");
    let own = |url: &str| {
        let itself = url.starts_with("file:///") && url.ends_with(".html");
        itself || url.starts_with("data:") || url.starts_with("blob:")
    };
    let strange: Vec<&String> = browser.requests.iter().filter(|url| !own(url)).collect();
    assert!(strange.is_empty(), "{strange:?}");
}

pub(crate) fn part(browser: &mut Browser, id: &str) -> Part {
    let rect = browser.evaluate(&format!(
        "(({{x, y, width, height}}) => [x + scrollX, y + scrollY, width, height].map(Math.floor))\
         (document.getElementById('{id}').getBoundingClientRect())"
    ));
    let at = |i: usize| rect[i].as_u64().expect("a length") as u32;
    Part { x: at(0), y: at(1), width: at(2), height: at(3) }
}

fn choose(browser: &mut Browser, id: &str, value: &str) {
    let expression = format!(
        "(s => {{ s.value = '{value}'; s.dispatchEvent(new Event('change')); }})(document.getElementById('{id}'))"
    );
    browser.evaluate(&expression);
    browser.evaluate(SETTLED);
}

/// Two frames of the screen later: the three-dimensional view has been drawn again.
const SETTLED: &str =
    "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 0))))";

#[test]
fn the_page_shows_on_a_laptop_without_a_network() {
    let recording = synthetic::recording("bench-07");
    let fit = synthetic::fit(&recording);
    let Some((mut browser, folder)) = shown("good", &fit, &recording) else { return };

    let head = browser.evaluate("document.querySelector('h1').innerText");
    assert_eq!(
        head,
        "Young’s modulus 10.482 ± 0.051 kPa; 2 restraint patches, together 124.3 ± 3.1 N/m, and 1 glued patch."
    );
    let widths = browser.evaluate("[document.documentElement.scrollWidth, innerWidth]");
    assert_eq!(widths, json!([SCREEN.0, SCREEN.0]), "the page is wider than the screen");
    let first = browser.evaluate("document.getElementById('phantom').getBoundingClientRect().bottom");
    assert!(first.as_f64().expect("a length") < f64::from(SCREEN.1), "the phantom is below the first screen");

    let whole = browser.picture(true);
    fs::write(folder.join("light.png"), &whole).expect("a picture");
    let light = pixels(&whole);
    for id in PLOTS {
        let part = part(&mut browser, id);
        let share = drawn_share(&light, part);
        assert!(share > 0.03, "plot {id} is empty: {share:.4} of {part:?} drawn");
    }

    let phantom = part(&mut browser, "phantom");
    for (control, value) in
        [("poke", "4"), ("exaggeration", "10"), ("magnification", "1"), ("camera", "below")]
    {
        let before = pixels(&browser.picture(true));
        choose(&mut browser, control, value);
        let after = browser.picture(true);
        let share = changed_share(&before, &pixels(&after), phantom);
        assert!(share > 0.002, "{control} = {value} changes {share:.5} of the view");
        fs::write(folder.join(format!("{control}.png")), after).expect("a picture");
    }
    let legend = browser.evaluate("document.getElementById('phantom-legend').innerText");
    let legend = legend.as_str().expect("text");
    assert!(
        legend.contains("Displacements drawn × 10, residuals × 1.")
            && legend.starts_with("Poke 5 at its deepest"),
        "{legend}"
    );

    fs::write(folder.join("print.pdf"), browser.print()).expect("a document");
    assert_quiet(&browser);
}

#[test]
fn text_is_readable_in_a_dark_and_in_a_light_room() {
    let recording = synthetic::recording("bench-07");
    let Some((mut browser, folder)) = shown("rooms", &synthetic::unexplained(&recording), &recording) else {
        return;
    };
    let colours = "(() => {
        const numbers = c => c.match(/[\\d.]+/g).map(Number);
        const behind = e => {
            for (; e; e = e.parentElement) {
                const c = numbers(getComputedStyle(e).backgroundColor);
                if (c.length === 3 || c[3] === 1) return c.slice(0, 3);
            }
            return [255, 255, 255];
        };
        return ['h1', 'h2', '.headline p', '.sign', '.note', '.legend', '.remarks li', 'td', 'thead th', 'button', 'select', '.quiet']
            .map(s => [s, document.querySelector(s)])
            .map(([s, e]) => [s, numbers(getComputedStyle(e).color).slice(0, 3), behind(e)]);
    })()";
    let mut papers = Vec::new();
    for room in ["light", "dark"] {
        let features = json!({"features": [{"name": "prefers-color-scheme", "value": room}]});
        browser.ask("Emulation.setEmulatedMedia", features);
        browser.evaluate(SETTLED);
        let found = browser.evaluate(colours);
        for entry in found.as_array().expect("a list") {
            let colour = |i: usize| [0, 1, 2].map(|c| entry[i][c].as_f64().expect("a channel"));
            let ratio = contrast(colour(1), colour(2));
            assert!(ratio >= READABLE, "{} in a {room} room: contrast {ratio:.2}", entry[0]);
        }
        papers.push(found[1][2].clone());
        fs::write(folder.join(format!("{room}.png")), browser.picture(true)).expect("a picture");
    }
    assert_ne!(papers[0], papers[1], "the page does not follow the room");
    assert_quiet(&browser);
}

#[test]
fn text_from_a_recording_is_shown_and_never_run() {
    let name =
        "<script>document.title='run'</script><img src=x onerror=\"document.title='run'\">&amp;{{series}}";
    let recording = synthetic::recording(name);
    let mut fit = synthetic::unexplained(&recording);
    fit.remarks.push("</ul><script>document.title='run'</script>".to_owned());
    let Some((mut browser, _)) = shown("strange", &fit, &recording) else { return };
    assert_eq!(browser.evaluate("document.title"), format!("{name} – fit"));
    assert_eq!(browser.evaluate("document.querySelector('.bar strong').textContent"), name);
    assert_eq!(browser.evaluate("document.querySelectorAll('img').length"), 0);
    assert_eq!(
        browser.evaluate("document.querySelector('.remarks li:last-child').textContent"),
        fit.remarks[2]
    );
    let verdict = browser.evaluate("document.querySelector('.headline p').textContent");
    assert!(verdict.as_str().expect("text").contains("4.10 × the noise"), "{verdict}");
    assert_quiet(&browser);
}

/// Nothing found, nothing recorded of the stage, a poke without markers, figures that could not be determined.
#[test]
fn a_meagre_fit_still_makes_a_page() {
    let mut recording = synthetic::recording("meagre");
    recording.stage = None;
    let mut fit = synthetic::fit(&recording);
    fit.patches.clear();
    fit.remarks.clear();
    fit.correlation = vec![vec![1.0]];
    fit.residual.chi2_per_dof = f64::NAN;
    fit.young_modulus_pa.sd = f64::INFINITY;
    fit.pokes[1].markers.clear();
    fit.pokes[1].samples.clear();
    fit.pokes[1].chi2_per_value = f64::NAN;
    let Some((mut browser, _)) = shown("meagre", &fit, &recording) else { return };
    let head = browser.evaluate("document.querySelector('h1').innerText");
    assert_eq!(head, "Young’s modulus 10.4820 kPa, deviation not determined; no restraint found.");
    let force = browser.evaluate("document.querySelector('h2 ~ #force').parentElement.innerText");
    assert!(force.as_str().expect("text").starts_with("Force against time, by poke"), "{force}");
    assert_quiet(&browser);

    fit.pokes.clear();
    let Some((browser, _)) = shown("empty", &fit, &recording) else { return };
    assert_quiet(&browser);
}
