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
