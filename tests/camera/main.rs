//! The depth camera of the simulated bench at the process boundary: from pixels on a pipe to markers in a recording, against the truth that
//! the bench writes beside.
#![cfg(feature = "opencv")]

#[path = "../support/program.rs"]
mod program;
#[path = "../support/steady.rs"]
mod steady;

use phantom_rig::dataset::read_bundle;
use program::{run, utf8};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use steady::steady;

const PROTOCOL: &str = "format = \"phantom-protocol/1\"\nname = \"one\"\n\
    [[step]]\nkind = \"wait\"\nwait_s = 3\n[[step]]\nkind = \"poke\"\nsite_mm = [50, 75, 25]\ndepth_mm = 3\nspeed_mm_s = 4\nhold_s = 1\nrepeats = 2\npause_s = 1\n";
const LATE_MS: f64 = 90.0;

/// The bench with a camera, slower than that of `rigs/sim-camera.toml`, in `place`; its truth goes to `truth.csv` there.
fn rig(place: &Path) -> PathBuf {
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
    let mut text = fs::read_to_string(rigs.join("sim-camera.toml")).expect("the rig file that comes with it");
    for (from, to) in [
        ("silence_ms = 1000", "silence_ms = 5000"),
        ("silence_ms = 5000  ", "silence_ms = 20000  "),
        ("frozen_records = 70", "frozen_records = 7000"),
        ("rate_hz = 7000.0", "rate_hz = 1000.0"),
        ("\nrate_hz = 30.0", "\nrate_hz = 15.0"),
        ("frame_rate_hz = 30.0", "frame_rate_hz = 15.0"),
        ("# truth = ", "truth = "),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let registration = "sim-camera-registration.toml";
    fs::copy(rigs.join(registration), place.join(registration)).expect("writable");
    let file = place.join("rig.toml");
    fs::write(&file, text).expect("writable");
    file
}

/// Host time (ns), number and place (m) of every row of a table, by frame.
type Frames = BTreeMap<u32, (u64, BTreeMap<u32, [f64; 3]>)>;

/// Columns: frame, host time, dot, x.
fn frames(file: &Path, columns: [usize; 4]) -> Frames {
    let text = fs::read_to_string(file).expect("a table");
    let mut frames = Frames::new();
    for row in text.lines().skip(2) {
        let row: Vec<&str> = row.split(',').collect();
        let [frame, host, dot, x] = columns;
        let number = |column: usize| row[column].parse::<f64>().expect("a number");
        let entry = frames.entry(number(frame) as u32).or_default();
        entry.0 = row[host].parse().expect("a time");
        entry.1.insert(number(dot) as u32, [0, 1, 2].map(|axis| number(x + axis)));
    }
    frames
}

#[test]
fn markers_of_pictures_are_where_the_dots_are() {
    steady(|| {
        let place = tempfile::tempdir().expect("a folder");
        let at = |name: &str| place.path().join(name);
        let rig = rig(place.path());
        let (_, text, stderr) = run(&["doctor", "--rig", utf8(&rig)]);
        assert!(text.contains("camera at") && text.contains("131 dots"), "{text}{stderr}");
        fs::write(at("one.toml"), PROTOCOL).expect("writable");
        let (code, text, stderr) = run(&[
            "run",
            utf8(&at("one.toml")),
            "--rig",
            utf8(&rig),
            "--yes",
            "--lines",
            "--live",
            "--out",
            utf8(&at("session")),
        ]);
        assert_eq!(code, 0, "{text}{stderr}");
        assert!(text.contains("0 lost, 0 not recorded") && text.contains("frames with pictures"), "{text}");
        assert!(fs::metadata(at("session-live.png")).expect("a picture").len() > 10_000);
        let tracked = at("tracked");
        let (_, text, stderr) = run(&["track", utf8(&at("session")), "--out", utf8(&tracked), "--json"]);
        let json: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}{stderr}"));
        assert_eq!((json["dots"].as_u64(), json["markers"].as_u64()), (Some(131), Some(126)), "{json}");
        assert!(json["seen_share"].as_f64().expect("a share") > 0.85, "{json}");
        assert!(fs::metadata(tracked.join("overlay.png")).expect("a picture").len() > 10_000);

        let seen = frames(&tracked.join("markers.csv"), [2, 1, 3, 4]);
        let truth = frames(&at("truth.csv"), [0, 1, 2, 3]);
        // While nothing moves any two pictures show the same: every marker against the dot that is nearest.
        let still = &truth.values().next().expect("frames").1;
        let first = seen.values().next().expect("frames");
        let (mut squares, mut count, mut worst_mm) = ([0.0; 3], 0.0, 0.0_f64);
        let mut names = BTreeMap::new();
        for (marker, place) in &first.1 {
            let off = |dot: &[f64; 3]| [0, 1, 2].map(|a| 1e3 * (place[a] - dot[a]));
            let far = |off: [f64; 3]| off.iter().map(|d| d * d).sum::<f64>().sqrt();
            let (dot, there) =
                still.iter().min_by(|a, b| far(off(a.1)).total_cmp(&far(off(b.1)))).expect("dots");
            names.insert(*marker, *dot);
            let off = off(there);
            worst_mm = worst_mm.max(far(off));
            squares = [0, 1, 2].map(|a| squares[a] + off[a].powi(2));
            count += 1.0;
        }
        let rms_mm = squares.map(|s| f64::sqrt(s / count));
        println!("markers against dots: {rms_mm:?} mm (root mean square), {worst_mm} mm at worst");
        assert!(rms_mm[0] < 0.05 && rms_mm[1] < 0.05 && rms_mm[2] < 0.12, "{rms_mm:?}");
        assert!(worst_mm < 0.2, "{worst_mm}");

        let bundle = at("bundle");
        let arguments = ["session", "export", utf8(&at("session")), "--bundle", utf8(&bundle), "--json"]
            .map(str::to_owned);
        let (code, text, stderr) = run(&arguments.each_ref().map(String::as_str));
        assert_eq!(code, 0, "{text}{stderr}");
        let by_track = json;
        let json: Value = serde_json::from_str(&text).expect("JSON");
        // The same beats are counted whoever follows the dots.
        assert_eq!(json["missing_on_beat"], by_track["missing_on_beat"], "{json}");
        // Told where the camera stood, it is the same recording.
        let (session, told, file) = (at("session"), at("told"), at("sim-camera-registration.toml"));
        let (code, text, stderr) = run(&[
            "session",
            "export",
            utf8(&session),
            "--bundle",
            utf8(&told),
            "--registration",
            utf8(&file),
        ]);
        assert_eq!(code, 0, "{text}{stderr}");
        let read = |bundle: &Path| read_bundle(bundle).expect("a bundle").0;
        assert_eq!(read(&told), read(&bundle));
        let lag = json["camera_lags_s"][0].as_array().expect("a lag").clone();
        let [lag_ms, sd_ms] = [0, 1].map(|i| 1e3 * lag[i].as_f64().expect("a number"));
        let again = at("again");
        let (code, text, stderr) = run(&["replay", utf8(&at("session")), "--out", utf8(&again)]);
        assert!(code == 0 && text.contains("with pictures, the same one by one"), "{text}{stderr}");
        // What a picture shows while the tip moves says when it was taken.
        let late_ms = lateness_ms(&seen, &truth, &names);
        println!("pictures are {late_ms:.1} ms late; found: {lag_ms:.1} ± {sd_ms:.1} ms");
        assert!((lag_ms - late_ms).abs() < 2.0 + 3.0 * sd_ms && sd_ms < 5.0, "{lag_ms} ± {sd_ms}, {late_ms}");
        assert!(late_ms >= LATE_MS - 1.0, "{late_ms}");
    });
}

/// The median time between exposure and stamp of frames in which markers move: each belongs to the exposure that shows the same.
fn lateness_ms(seen: &Frames, truth: &Frames, names: &BTreeMap<u32, u32>) -> f64 {
    let mut late: Vec<f64> = Vec::new();
    for (host, markers) in seen.values() {
        let before = |exposed: u64| *host > exposed && *host < exposed + 500_000_000;
        let likely: Vec<_> = truth.values().filter(|frame| before(frame.0)).collect();
        let [Some(oldest), Some(youngest)] = [likely.first(), likely.last()] else { continue };
        let moved = |dot: &u32| (youngest.1[dot][2] - oldest.1[dot][2]).abs();
        // Only where each of them shows something else.
        if names.values().map(moved).fold(0.0, f64::max) < 5e-4 {
            continue;
        }
        let differs = |frame: &&(u64, BTreeMap<u32, [f64; 3]>)| {
            let known = markers.iter().filter_map(|(marker, place)| {
                let there = frame.1.get(names.get(marker)?)?;
                Some((0..3).map(|a| (place[a] - there[a]).powi(2)).sum::<f64>())
            });
            known.sum::<f64>()
        };
        let same = likely.iter().min_by(|a, b| differs(a).total_cmp(&differs(b))).expect("not empty");
        late.push(1e-6 * (host - same.0) as f64);
    }
    assert!(late.len() > 5, "{} frames while markers move", late.len());
    late.sort_by(f64::total_cmp);
    late[late.len() / 2]
}
