//! What is typed wrongly costs exit code 2 and says what would be right.

use super::run;

#[test]
fn nothing_typed_shows_the_help() {
    let (code, _, stderr) = run(&[]);
    assert_eq!(code, 2);
    assert!(stderr.contains("Usage: phantom-rig"), "{stderr}");
}

#[test]
fn help_and_version_are_good() {
    for arguments in [&["--help"][..], &["check", "--help"], &["mesh", "block", "--help"], &["--version"]] {
        let (code, stdout, stderr) = run(arguments);
        assert_eq!((code, stderr.as_str()), (0, ""), "{arguments:?}");
        assert!(stdout.contains("phantom-rig"), "{arguments:?}: {stdout}");
    }
    for arguments in [
        &["check", "--help"][..],
        &["mesh", "block", "--help"],
        &["completions", "--help"],
        &["diagnose", "--help"],
        &["predict", "--help"],
        &["conceal", "--help"],
        &["prove", "--help"],
        &["mesh", "--help"],
        &["experiment", "--help"],
        &["session", "info", "--help"],
        &["session", "export", "--help"],
    ] {
        assert!(run(arguments).1.contains("Examples:"), "{arguments:?}");
    }
}

#[test]
fn unknown_words_are_usage_errors() {
    for arguments in [&["chekc"][..], &["check"], &["check", "a", "b"], &["--josn", "check", "a"]] {
        let (code, stdout, stderr) = run(arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(stderr.starts_with("error:"), "{stderr}");
    }
}

/// A negative number is a value, which the command itself refuses, or takes.
#[test]
fn negative_numbers_are_values() {
    for (arguments, words) in [
        (
            &["calibrate", "registration", "s", "--out", "o", "--tolerance-mm", "-1"][..],
            "expected more than 0",
        ),
        (
            &["calibrate", "force", "w.csv", "--out", "o", "--gravity", "-9.8"],
            "--gravity -9.8: expected more than 0",
        ),
        (&["calibrate", "stage", "r.csv", "--out", "o", "--tip-um-per-n", "-1"], "are 0 or more"),
        (&["calibrate", "tensile", "t.csv", "--out", "o", "--strain", "-0.1,-0.2"], "the first is less than"),
    ] {
        let (code, _, stderr) = run(arguments);
        assert!(code == 2 && stderr.contains(words), "{arguments:?}: {stderr}");
    }
    let below = ["calibrate", "tensile", "no-such.csv", "--out", "o", "--strain", "-0.1,0.5"];
    let (code, _, stderr) = run(&below);
    assert!(code == 1 && stderr.contains("no-such.csv"), "{stderr}");
}

/// All that is missing is told at once.
#[test]
fn an_export_needs_a_session_and_a_place() {
    let (code, _, stderr) = run(&["session", "export"]);
    let told = ["<SESSION>", "--bundle <BUNDLE>", "--csv <DIR>"].iter().all(|word| stderr.contains(word));
    assert!(code == 2 && told, "{stderr}");
}
