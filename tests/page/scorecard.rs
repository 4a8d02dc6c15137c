//! Does the page of a scorecard show, without a network?

use super::browser;
use super::picture::{drawn_share, pixels};
use super::synthetic;
use super::view::{SCREEN, assert_quiet, part};
use phantom_rig::report::scorecard::{Draw, Limit, Said, Scorecard, judge, scorecard_page, scorecard_text};
use serde_json::{Value, json};
use std::fs;

const IDS: [&str; 4] = ["drying", "inclusion", "camera-lag", "viscoelastic-relaxation"];

/// A draw in which every fifth verdict is wrong, every other conceals nothing, and strength grows with the number.
fn draw(i: usize) -> Draw {
    let id = IDS[i % IDS.len()];
    let concealed: Vec<&str> = if i.is_multiple_of(2) { Vec::new() } else { vec![id] };
    let named: Vec<&str> = if i.is_multiple_of(5) { vec!["tip-slip"] } else { concealed.clone() };
    let strength = (!concealed.is_empty()).then(|| 2.0 * 1.08_f64.powi(i as i32));
    let reading = |e: f64, held: f64| json!({"young_modulus_pa": {"value": e, "sd": 90.0}, "held_out_chi2_per_dof": held});
    let answer: Value = json!({"physics": concealed, "young_modulus_pa": 1e4, "strength": strength});
    let said = json!({
        "mismatch": {"detected": !named.is_empty()},
        "verdict": {"physics": named, "confidence": 0.5 + 0.008 * i as f64, "ambiguous_with": []},
        "baseline": reading(10_900.0, 7.5),
        "extended": reading(10_050.0, 1.02),
    });
    Draw {
        name: format!("draw-{i:04}"),
        answer: serde_json::from_value(answer).expect("an answer"),
        said: Said::Verdict(Box::new(serde_json::from_value(said).expect("a verdict"))),
        seconds: 4.0,
    }
}

#[test]
fn a_scorecard_shows_without_a_network() {
    let mut judged: Vec<_> = (0..60).map(|i| judge(&draw(i))).collect();
    let failed = Draw { said: Said::Failed("<b>no tip</b>".to_owned()), ..draw(61) };
    judged.push(judge(&failed));
    let card = Scorecard::of(judged, Limit { strength: 10.0, share: 0.0 });
    // Of 30 draws without effect those divisible by 10 were called; of 30 with one, those that end with 5 were misnamed.
    assert_eq!((card.false_alarms.of, card.false_alarms.all), (6, 30));
    assert_eq!((card.named_right_all.of, card.named_right_all.all), (24, 31));
    assert_eq!(card.failed.of, 1);
    let text = scorecard_text(&card);
    assert!(text.contains("6 of 30 (20.0 %)"), "{text}");

    let page = scorecard_page(&card, "seed <7>").expect("a page");
    let Some(mut browser) = browser::start(SCREEN.0, SCREEN.1) else {
        println!("skipped: no Chromium");
        return;
    };
    let folder = synthetic::kept_folder("scorecard");
    let file = folder.join("scorecard.html");
    fs::write(&file, page).expect("a file");
    browser.open(&file);
    assert_eq!(browser.evaluate("document.querySelector('.bar strong').textContent"), "seed <7>");
    assert_eq!(browser.evaluate("document.querySelectorAll('b').length"), 0);
    let widths = browser.evaluate("[document.documentElement.scrollWidth, innerWidth]");
    assert_eq!(widths, json!([SCREEN.0, SCREEN.0]), "the page is wider than the screen");
    let whole = browser.picture(true);
    fs::write(folder.join("light.png"), &whole).expect("a picture");
    let drawn = pixels(&whole);
    for id in ["reliability", "power"] {
        let part = part(&mut browser, id);
        let share = drawn_share(&drawn, part);
        assert!(share > 0.01, "plot {id} is empty: {share:.4} of {part:?} drawn");
    }
    assert_quiet(&browser);
}
