//! `calibrate force`, `stage`, `compare` and `set` as processes: what they write, what they refuse, and that a refusal writes nothing.

use super::bench::{Dice, ForceBench, StageBench, press, press_csv, stage_csv, weights_csv};
use super::{names, run, utf8};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn json(file: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(file).expect("written")).expect("JSON")
}

fn weights(place: &Path) -> std::path::PathBuf {
    let mut dice = Dice::new(21);
    let bench = ForceBench::new(&mut dice);
    let file = place.join("weights.csv");
    fs::write(&file, weights_csv(&bench.table(&mut dice))).expect("writable");
    file
}

fn runs(place: &Path) -> std::path::PathBuf {
    let bench = StageBench::usual();
    let file = place.join("gauge.csv");
    let targets = [1e-3, 7.3e-3, 12.1e-3, 19.8e-3, 24.6e-3, 31.7e-3];
    fs::write(&file, stage_csv(&bench.table(5, &targets, &mut Dice::new(8)))).expect("writable");
    file
}

#[test]
fn a_sensor_and_a_stage_become_a_set_that_notices_changes() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    let (table, out) = (weights(place.path()), at("force"));
    let arguments = ["calibrate", "force", utf8(&table), "--serial", "FT1", "--out", utf8(&out)];
    let (code, text, stderr) = run(&arguments);
    assert_eq!(code, 0, "{text}{stderr}");
    assert!(text.contains("48 rows tell 6 components"), "{text}");
    assert_eq!(names(&out), [".phantom-rig", "force.html", "force.json", "force.toml"]);
    let found = json(&out.join("force.json"));
    let gain = found["sensitivity"][0][0].as_f64().expect("a gain");
    assert!((gain - 1.0).abs() < 0.1 && found["sensitivity_sd"][0][0].as_f64().expect("sd") < 0.01, "{gain}");
    let page = fs::read_to_string(out.join("force.html")).expect("a page");
    assert!(page.contains("Gain and cross-talk"));
    assert!(page.contains("plotly.js v"), "the page draws by itself");
    assert!(!page.contains("<script src="), "no script is fetched");

    let (table, out) = (runs(place.path()), at("stage"));
    let block = at("block.csv");
    fs::write(&block, press_csv(&press(92e-6, 30_000.0, 0.03, &mut Dice::new(2)))).expect("writable");
    let arguments = ["calibrate", "stage", utf8(&table), "--block", utf8(&block), "--out", utf8(&out)];
    let (code, text, stderr) = run(&arguments);
    assert_eq!(code, 0, "{text}{stderr}");
    let found = json(&out.join("stage.json"));
    let scale = found["axes"][0]["scale"]["value"].as_f64().expect("a scale");
    assert!((scale - 8e-4).abs() < 3e-4, "{scale}");
    let yielding = found["compliance"]["m_per_n"].as_f64().expect("a compliance");
    assert!((yielding * 30_000.0 - 1.0).abs() < 0.05, "{yielding}");

    let (set, force, stage) = (at("bench.toml"), at("force/force.toml"), at("stage/stage.toml"));
    let make = |until: &str| {
        let arguments =
            ["calibrate", "set", "--name", "bench", "--force", utf8(&force), "--stage", utf8(&stage)];
        let more = ["--from", "2020-01-01", "--until", until, "--replace", "--out", utf8(&set)];
        run(&[&arguments[..], &more[..]].concat())
    };
    let (code, text, stderr) = make("9999-12-31");
    assert_eq!(code, 0, "{text}{stderr}");
    let kept = fs::read_to_string(&set).expect("a set");
    assert!(kept.contains("file = \"force/force.toml\"") && kept.contains("serial = \"FT1\""), "{kept}");
    let rig = at("rig.toml");
    let sim =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/sim.toml")).expect("the rig");
    let named =
        sim.replacen("name = \"simulated bench\"", "name = \"bench\"\ncalibration = \"bench.toml\"", 1);
    assert_ne!(named, sim);
    fs::write(&rig, named).expect("writable");
    let protocol = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/protocols/five-pokes.toml");
    let plan = || run(&["plan", utf8(&protocol), "--rig", utf8(&rig)]);
    let (code, text, stderr) = plan();
    assert_eq!(code, 0, "{text}{stderr}");
    assert_eq!(make("2020-02-01").0, 0);
    let (code, text, stderr) = plan();
    assert!(
        code == 3 && text.contains("bench.toml: calibration set \"bench\" held until 2020-02-01"),
        "{code} {text}{stderr}"
    );
    fs::write(&force, fs::read_to_string(&force).expect("kept").replacen("note = \"\"", "note = \"x\"", 1))
        .expect("writable");
    let (code, text, stderr) = plan();
    assert!(
        code == 1 && stderr.contains("force.toml") && stderr.contains("it was changed since"),
        "{code} {text}{stderr}"
    );
}

#[test]
fn a_wrong_weight_degrades_the_result_until_it_is_left_out() {
    let place = tempfile::tempdir().expect("a folder");
    let file = weights(place.path());
    let text = fs::read_to_string(&file).expect("a table");
    // Line 17 says 200 g; twice the weight is written down.
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    assert!(lines[16].contains(",200.000000,"), "{}", lines[16]);
    lines[16] = lines[16].replacen(",200.000000,", ",400.000000,", 1);
    fs::write(&file, lines.join("\n")).expect("writable");
    let out = place.path().join("out");
    let (code, text, stderr) = run(&["calibrate", "force", utf8(&file), "--out", utf8(&out)]);
    assert!(
        code == 3 && text.contains("line 17") && text.contains("the table says 400.0 g"),
        "{code} {text}{stderr}"
    );
    let arguments = ["calibrate", "force", utf8(&file), "--leave-out", "17", "--json", "--out", utf8(&out)];
    let (code, text, stderr) = run(&arguments);
    let left: Value = serde_json::from_str(&text).expect("JSON");
    // What was asked for is told, and is nothing doubtful.
    assert!(code == 0 && left["misfits"] == Value::Array(Vec::new()), "{code} {text}{stderr}");
    assert_eq!(left["remarks"][0], "line 17 was left out, as asked");
    assert_eq!(left["left_out"][0], 17);
}

#[test]
fn a_fit_is_compared_with_its_reference() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    let fit = r#"{"format": "phantom-fit/1", "young_modulus_pa": {"value": 10120.0, "sd": 60.0},
        "restraint": {"total_n_per_m": {"value": 121.9, "sd": 4.0}}}"#;
    fs::write(at("fit.json"), fit).expect("writable");
    let value = |name: &str, key: &str, value: f64, sd: f64| {
        let text = format!(
            "format = \"phantom-reference/1\"\nname = \"{name}\"\n{key} = {{ value = {value:?}, sd = {sd:?} }}\ndate = \"2026-11-02\"\n\
             source = \"made up\"\nspecimen = \"\"\nmachine = \"\"\nmethod = \"none\"\n"
        );
        fs::write(at(&format!("{name}.toml")), text).expect("writable");
        at(&format!("{name}.toml"))
    };
    let gel = value("gel", "young_modulus_pa", 10_250.0, 100.0);
    let (left, right) =
        (value("left", "stiffness_n_per_m", 60.0, 2.0), value("right", "stiffness_n_per_m", 70.0, 3.0));
    let (fit, out) = (at("fit.json"), at("out"));
    let arguments =
        ["calibrate", "compare", utf8(&fit), "--reference", utf8(&gel), utf8(&left), utf8(&right)];
    let (code, text, stderr) = run(&[&arguments[..], &["--out", utf8(&out)]].concat());
    assert!(
        code == 0 && text.contains("left + right") && text.contains("agree at 95 %"),
        "{code} {text}{stderr}"
    );
    let said = json(&out.join("comparison.json"));
    // 121.9 against 130, 4 against √(4 + 9).
    let z = said["comparisons"][1]["z"].as_f64().expect("z");
    assert!((z + 8.1 / 29_f64.sqrt()).abs() < 1e-9, "{z}");
    assert!(names(&out).contains(&"comparison.html".to_owned()));
    let far = value("far", "young_modulus_pa", 11_000.0, 100.0);
    let (code, text, _) = run(&["calibrate", "compare", utf8(&fit), "--reference", utf8(&far), "--json"]);
    assert!(
        code == 3 && serde_json::from_str::<Value>(&text).expect("JSON")["agree"] == false,
        "{code} {text}"
    );
    let slack = value("slack", "slack_m", 1e-3, 1e-4);
    assert_eq!(run(&["calibrate", "compare", utf8(&fit), "--reference", utf8(&slack)]).0, 2);
}

#[test]
fn bad_tables_are_refused_where_they_go_wrong_and_nothing_is_written() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    let weights = fs::read_to_string(weights(place.path())).expect("a table");
    let runs = fs::read_to_string(runs(place.path())).expect("a table");
    let line = |text: &str, number: usize, change: &dyn Fn(&str) -> String| {
        let changed = text.lines().enumerate();
        changed
            .map(|(k, l)| if k + 1 == number { change(l) } else { l.to_owned() } + "\n")
            .collect::<String>()
    };
    let first =
        |text: &str, count: usize| text.lines().take(count).map(|l| format!("{l}\n")).collect::<String>();
    let cases = [
        ("force", "empty", String::new(), "the file is empty"),
        ("force", "one", first(&weights, 2), "1 row below the headings"),
        (
            "force",
            "text",
            line(&weights, 5, &|l| l.replacen("200.000000", "200 g", 1)),
            "line 5, column 2 (mass_g): \"200 g\"",
        ),
        (
            "force",
            "mixed",
            line(&weights, 1, &|l| l.replacen("dir_x", "mass_kg", 1)),
            "column 3: mass_kg beside mass_g: mixed units",
        ),
        (
            "force",
            "back",
            line(&weights, 6, &|l| l.replacen("80.000000", "10.000000", 1)),
            "line 6, column 1 (time_s): 10.000000 after 60.000000",
        ),
        ("force", "few", first(&weights, 17), "say nothing of"),
        ("force", "nan", line(&weights, 5, &|l| l.replacen("200.000000", "nan", 1)), "line 5, column 2"),
        ("stage", "empty", String::new(), "the file is empty"),
        ("stage", "one", first(&runs, 2), "1 row below the headings"),
        (
            "stage",
            "text",
            line(&runs, 3, &|l| l.replacen("up", "left", 1)),
            "line 3, column 2 (direction): \"left\"",
        ),
        ("stage", "short", first(&runs, 40), "is missing"),
        (
            "stage",
            "twice",
            runs.clone() + runs.lines().nth(4).expect("a row") + "\n",
            "twice, on lines 5 and",
        ),
    ];
    for (what, name, text, words) in &cases {
        let (file, out) = (at(&format!("{what}-{name}.csv")), at("out"));
        fs::write(&file, text).expect("writable");
        let (code, text, stderr) = run(&["calibrate", what, utf8(&file), "--out", utf8(&out)]);
        assert!(
            code == 1 && stderr.contains(words) && stderr.contains(name),
            "{what} {name}: {code} {text}{stderr}"
        );
    }
    assert!(names(place.path()).iter().all(|name| name.ends_with(".csv")), "{:?}", names(place.path()));
}
