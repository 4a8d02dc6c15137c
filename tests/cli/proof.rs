//! `conceal` and `prove`: two draws from sealed answers to a scorecard, and every way in which a proof must fail.

use super::{names, run, utf8};
use phantom_rig::dataset::read_bundle;
use phantom_rig::geometry::Vec3;
use phantom_rig::observation::{Poke, Recording};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Copies a proof with its sealed answers and its key.
fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).expect("a folder");
        for entry in fs::read_dir(from).expect("readable") {
            let entry = entry.expect("readable");
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        fs::copy(from, to).expect("a copy");
    }
}

fn conceal(out: &Path, count: &str) -> (i32, Value, String) {
    let arguments =
        ["conceal", "--seed", "11", "--count", count, "--phantoms", "1", "--json", "--out", utf8(out)];
    let (code, stdout, stderr) = run(&arguments);
    (code, serde_json::from_str(&stdout).expect("JSON"), stderr)
}

/// Every file below a folder.
fn files(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("readable") {
        let path = entry.expect("readable").path();
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

fn edit(file: &Path, change: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = fs::read(file).expect("readable");
    change(&mut bytes);
    fs::write(file, bytes).expect("writable");
}

#[test]
fn a_proof_holds_as_made_and_fails_when_tampered_with() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let proof = place.path().join("proof");

    let (code, said, stderr) = conceal(&proof, "1");
    assert_eq!((code, &said["new"]), (0, &Value::from(1)), "{stderr}");
    let first = fs::read_to_string(proof.join("hashes.csv")).expect("hashes");
    let (code, said, stderr) = conceal(&proof, "2");
    assert_eq!((code, &said["new"], &said["draws"]), (0, &Value::from(1), &Value::from(2)), "{stderr}");
    let both = fs::read_to_string(proof.join("hashes.csv")).expect("hashes");
    assert!(both.starts_with(&first) && both.lines().count() == 3, "{both}");
    assert_eq!(conceal(&proof, "2").1["new"], 0);
    assert_eq!(names(place.path()), ["proof", "proof.key", "proof.sealed"]);
    // Nothing of the answer in the open, nor under the seal.
    for file in files(place.path()) {
        let bytes = fs::read(&file).expect("readable");
        for word in ["salt", "passed_over", "\"physics\""] {
            let found = bytes.windows(word.len()).any(|w| w == word.as_bytes());
            assert!(!found, "{word} is in {}", file.display());
        }
    }
    let other = ["conceal", "--seed", "12", "--count", "2", "--phantoms", "1", "--out", utf8(&proof)];
    let (code, _, stderr) = run(&other);
    assert!(code == 1 && stderr.contains("another seed"), "{code}: {stderr}");

    // Without the key the verdicts are made and closed, and the answers stay where they are.
    let nowhere = place.path().join("no-key");
    let (code, _, stderr) = run(&["prove", utf8(&proof), "--quick", "--key", utf8(&nowhere)]);
    assert!(code == 1 && stderr.contains("the answers stay sealed"), "{code}: {stderr}");
    assert!(proof.join("verdicts.csv").is_file() && !proof.join("scorecard.json").exists());
    let verdicts: Vec<Vec<u8>> =
        files(&proof.join("verdicts")).iter().map(|f| fs::read(f).expect("readable")).collect();
    assert_eq!(verdicts.len(), 2);
    let closed = place.path().join("closed");
    for what in ["", ".key", ".sealed"] {
        let named = |base: &Path| Path::new(&format!("{}{what}", base.display())).to_owned();
        copy(&named(&proof), &named(&closed));
    }

    // No answer is opened where the verdicts of another folder cannot be closed.
    let (code, _, stderr) = run(&["prove", utf8(&proof), utf8(&nowhere), "--quick"]);
    assert!(code == 1 && stderr.contains("holds no concealed draws"), "{code}: {stderr}");
    assert!(!proof.join("scorecard.json").exists());
    let (code, _, stderr) = run(&["prove", utf8(&proof)]);
    assert!(code == 1 && stderr.contains("was made with --quick"), "{code}: {stderr}");
    let (code, stdout, stderr) = run(&["prove", utf8(&proof), "--quick", "--json"]);
    assert!(matches!(code, 0 | 3), "{code}: {stderr}");
    let card: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!((&card["format"], &card["draws"]), (&Value::from("phantom-scorecard/1"), &Value::from(2)));
    assert_eq!(card["quick"], true);
    assert!(card["mean_seconds"].as_f64().is_some_and(|s| s > 0.0));
    for draw in card["judged"].as_array().expect("draws") {
        assert_eq!(draw["error"], Value::Null, "{draw}");
        assert!(draw["modulus_error"][0].as_f64().is_some_and(|e| e.abs() < 0.5), "{draw}");
    }
    assert!(proof.join("scorecard.html").is_file());
    let table = fs::read_to_string(proof.join("scorecard.csv")).expect("a row a draw");
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let draws: Vec<&str> = rows.iter().map(|row| row[0]).collect();
    assert_eq!(draws, ["draw", "draw-0001", "draw-0002"]);
    let confidence = rows[0].iter().position(|name| *name == "confidence").expect("a column");
    assert_eq!(rows[1][confidence].parse().ok(), card["judged"][0]["confidence"].as_f64());
    let after: Vec<Vec<u8>> =
        files(&proof.join("verdicts")).iter().map(|f| fs::read(f).expect("readable")).collect();
    assert_eq!(after, verdicts, "closed verdicts are not made again");

    // Two folders count together, and each for itself as before.
    let all = place.path().join("all");
    let both = ["prove", utf8(&proof), utf8(&closed), "--quick", "--json", "--out", utf8(&all)];
    let (code, stdout, stderr) = run(&both);
    assert!(matches!(code, 0 | 3), "{code}: {stderr}");
    let together: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(together["draws"], 4);
    let named = |folder: &Path| [1, 2].map(|draw| format!("{}/draw-000{draw}", folder.display()));
    let judged = together["judged"].as_array().expect("draws").iter();
    assert!(judged.map(|draw| &draw["name"]).eq(&[named(&proof), named(&closed)].concat()));
    let seconds = |card: &Value| card["mean_seconds"].as_f64().expect("a number");
    // The same sum, added up otherwise.
    assert!((seconds(&together) / seconds(&card) - 1.0).abs() < 1e-12);
    assert!(all.join("scorecard.html").is_file() && closed.join("scorecard.json").is_file());
    for (arguments, words) in [
        (vec![utf8(&proof), utf8(&proof)], "is given twice"),
        (vec![utf8(&proof), utf8(&closed), "--key", utf8(&nowhere)], "--key is for one folder"),
        (vec![utf8(&proof), "--out", utf8(&all)], "--out is for several folders"),
    ] {
        let (code, _, stderr) = run(&[vec!["prove", "--quick"], arguments].concat());
        assert!(code == 2 && stderr.contains(words), "{code}: {stderr}");
    }
    fs::remove_file(closed.join("scorecard.json")).expect("removed");

    type Tamper = fn(&Path);
    let beside = |folder: &Path, what: &str| Path::new(&format!("{}{what}", folder.display())).to_owned();
    let tampered: [(&str, &str, Tamper); 6] = [
        ("the verdict of draw-0001 is missing", "", |f| {
            fs::remove_file(f.join("verdicts/draw-0001.json")).expect("removed");
        }),
        ("the verdict of draw-0002 was changed", "", |f| {
            edit(&f.join("verdicts/draw-0002.json"), |b| b.extend(b" \n"));
        }),
        ("draw-0001 is not the one whose hash was published", "", |f| {
            edit(&f.join("hashes.csv"), |b| {
                let digit = &mut b["draw,sha256\ndraw-0001,".len()];
                *digit = if *digit == b'0' { b'1' } else { b'0' };
            });
        }),
        ("draw-0002 has no hash", "", |f| {
            edit(&f.join("hashes.csv"), |b| b.truncate("draw,sha256\ndraw-0001,".len() + 65));
        }),
        ("draw-0001 is not the one that its answer belongs to", "", |f| {
            edit(&f.join("recordings/draw-0001/force.csv"), |b| b.extend(b"\n"));
        }),
        ("the answer of draw-0001 does not open", ".sealed", |f| {
            edit(&f.join("draw-0001.sealed"), |b| b[40] ^= 1);
        }),
    ];
    for (i, (words, where_, tamper)) in tampered.into_iter().enumerate() {
        let own = place.path().join(format!("tampered-{i}"));
        for what in ["", ".key", ".sealed"] {
            copy(&beside(&closed, what), &beside(&own, what));
        }
        tamper(&beside(&own, where_));
        let (code, stdout, stderr) = run(&["prove", utf8(&own), "--quick"]);
        assert_eq!((code, stdout.as_str()), (1, ""), "{words}: {stderr}");
        assert!(stderr.contains(words), "{words:?} is not in {stderr}");
        assert!(!own.join("scorecard.json").exists(), "{words}");
    }
}

#[test]
fn a_folder_without_draws_proves_nothing() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let (code, _, stderr) = run(&["prove", utf8(place.path())]);
    assert!(code == 1 && stderr.contains("holds no concealed draws"), "{code}: {stderr}");
    fs::write(place.path().join("thesis.tex"), "years").expect("writable");
    let (code, _, stderr) = run(&["conceal", "--seed", "1", "--count", "1", "--out", utf8(place.path())]);
    assert!(code == 1 && stderr.contains("is not empty"), "{code}: {stderr}");
    assert_eq!(names(place.path()), ["thesis.tex"]);
    for arguments in [&["--count", "0"][..], &["--count", "1", "--phantoms", "0"]] {
        let (code, _, _) = run(&[&["conceal", "--seed", "1", "--out", "x"][..], arguments].concat());
        assert_eq!(code, 2, "{arguments:?}");
    }
}

/// The bench goes on with a session: what was recorded before is recorded again, at known and at new places.
#[test]
fn a_bench_goes_on_with_a_session() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let proof = place.path().join("proof");
    assert_eq!(conceal(&proof, "1").0, 0);
    let read = |bundle: &Path| read_bundle(bundle).expect("a bundle").0;
    let before = read(&proof.join("recordings/draw-0001"));
    let table = place.path().join("pokes.csv");
    let write = |pokes: &[(Vec3, Vec3)]| {
        let mut text =
            "poke,site_x_m,site_y_m,site_z_m,dir_x,dir_y,dir_z,radius_m,depth_m,rate_m_s,hold_s\n".to_owned();
        for (site, d) in pokes {
            text +=
                &format!("9,{},{},{},{},{},{},0.008,0.002,0.002,1\n", site.x, site.y, site.z, d.x, d.y, d.z);
        }
        fs::write(&table, text).expect("written");
    };
    let longer = place.path().join("longer");
    let bench =
        |draw: &str| run(&["bench", utf8(&proof), draw, "--pokes", utf8(&table), "--out", utf8(&longer)]);

    let known = before.pokes.iter().find(|p| p.direction.z < -0.9).expect("a poke on top");
    let new = Vec3::new(known.site.x + 1e-3, known.site.y - 1e-3, known.site.z);
    write(&[(known.site, -Vec3::z()), (new, Vec3::new(0.0, 0.6, -0.8))]);
    let (code, _, stderr) = bench("draw-0001");
    assert_eq!(code, 0, "{stderr}");
    let after = read(&longer);
    assert_eq!(after.pokes[..7], before.pokes[..]);
    assert_eq!((after.pokes.len(), after.pokes[8].site, after.mesh == before.mesh), (9, new, true));
    let rows = before.wrench.time_s.len();
    assert_eq!(after.wrench.force_n[..rows], before.wrench.force_n[..]);
    // At the last instant of the one the tip hides markers of the next poke.
    let last = before.markers.frame_time_s.len() as u32 - 1;
    let until =
        |r: &Recording| r.markers.rows.iter().take_while(|row| row.frame < last).copied().collect::<Vec<_>>();
    assert!(until(&before).len() > 1000);
    assert_eq!(until(&after), until(&before));
    let pressed = |poke: &Poke| {
        let held = after.wrench.time_s.iter().zip(&after.wrench.force_n);
        held.filter(|(t, _)| (poke.start_s..poke.end_s).contains(t)).map(|(_, f)| -f[2]).fold(0.0, f64::max)
    };
    for poke in &after.pokes[7..] {
        assert!(pressed(poke) > 0.3 * pressed(known), "poke {} is felt", poke.number);
    }

    write(&[(Vec3::new(0.0, 0.0, 1.0), -Vec3::z())]);
    let (code, _, stderr) = bench("draw-0001");
    assert!(code == 1 && stderr.contains("enters no side"), "{code}: {stderr}");
    write(&[(known.site, -Vec3::z())]);
    let deep = fs::read_to_string(&table).expect("a table").replace(",0.002,0.002,1", ",2,0.002,1");
    fs::write(&table, deep).expect("written");
    let (code, _, stderr) = bench("draw-0001");
    assert!(code == 1 && stderr.contains("2 m deep"), "{code}: {stderr}");
    let (code, _, stderr) = bench("draw-0002");
    assert!(code == 1 && stderr.contains("draw-0002"), "{code}: {stderr}");
    assert_eq!(read(&longer), after, "what was there is still there");
}
