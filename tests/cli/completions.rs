//! Completion scripts name the subcommands.

use super::run;

#[test]
fn every_shell_gets_a_script_that_knows_the_subcommands() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let (code, stdout, _) = run(&["completions", shell]);
        assert_eq!(code, 0);
        assert!(stdout.contains("check") && stdout.contains("block"), "{shell}");
        assert_eq!(run(&["completions", shell, "--quiet"]), (0, stdout, String::new()), "{shell}");
    }
    assert_eq!(run(&["completions", "abacus"]).0, 2);
}
