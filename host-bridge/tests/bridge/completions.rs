//! The completions, asked for by the shells themselves where they are installed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The completions for `shell`, in a file.
fn script(shell: &str) -> PathBuf {
    let output = Command::new(env!("CARGO_BIN_EXE_host-bridge"))
        .args(["completions", shell])
        .output()
        .expect("the program can be started");
    assert!(output.status.success(), "{output:?}");
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("completions.{shell}"));
    fs::write(&path, output.stdout).expect("the tests' folder can be written");
    path
}

/// What `shell` makes of `program`; none if it is not installed.
fn run(shell: &str, program: &str) -> Option<String> {
    let Output { status, stdout, .. } = Command::new(shell).args(["-c", program]).output().ok()?;
    assert!(status.success(), "{shell}: {program}");
    Some(String::from_utf8_lossy(&stdout).into_owned())
}

/// What is offered behind some words, and one that must not be missing.
const OFFERS: [(&str, &str); 4] = [
    ("host-bridge fl", "flash"),
    ("host-bridge flash ", "sensor"),
    ("host-bridge flash sensor --dr", "--dry-run"),
    ("host-bridge completions f", "fish"),
];

#[test]
fn bash_completes_commands_boards_and_options() {
    let script = script("bash");
    for (typed, wanted) in OFFERS {
        let offered = run(
            "bash",
            &format!(
                "source '{}'; words='{typed}'; COMP_WORDS=($words); \
                 [[ $words == *' ' ]] && COMP_WORDS+=(''); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); \
                 complete=$(complete -p host-bridge); [[ $complete =~ -F\\ ([^ ]+) ]]; \
                 compopt() {{ :; }}; \
                 ${{BASH_REMATCH[1]}} host-bridge \"${{COMP_WORDS[COMP_CWORD]}}\" \
                 \"${{COMP_WORDS[COMP_CWORD-1]}}\"; echo \"${{COMPREPLY[*]}}\"",
                script.display()
            ),
        );
        if let Some(offered) = offered {
            assert!(
                offered.split_whitespace().any(|word| word == wanted),
                "{typed}: {offered}"
            );
        }
    }
}

#[test]
fn fish_completes_commands_boards_and_options() {
    let script = script("fish");
    for (typed, wanted) in OFFERS {
        let program = format!("source '{}'; complete -C '{typed}'", script.display());
        if let Some(offered) = run("fish", &program) {
            assert!(
                offered.lines().any(|line| line.starts_with(wanted)),
                "{typed}: {offered}"
            );
        }
    }
}

#[test]
fn zsh_takes_the_completions_as_they_are() {
    let script = script("zsh");
    // Anything that zsh can't read would end it.
    run("zsh", &format!("zsh -n '{}'", script.display()));
}
