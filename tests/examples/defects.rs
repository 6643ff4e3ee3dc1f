//! Makes deliberate defects in the firmware, one at a time, and looks which kinds of faults name them:
//! `cargo run --example defects [PART_OF_A_NAME …]`, once `./test` has built `hil-sim` and the two ELFs. The defects
//! are in `tests/defects.toml`.
//!
//! The sources are copied to a folder for temporary files, outside of this one's settings of the linker, and built
//! there; nothing else is touched. A kind names a defect if the
//! campaign finds it not as the table of kinds has it, with the defect and not without. Prints a table as Markdown;
//! exit status 1 if a defect was named by nobody.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// How many times each kind is tried: with every motion and mode.
const INSTANTS: &str = "4";

struct Defect {
    name: String,
    file: PathBuf,
    /// What stands in the file once, and what is put there.
    from: String,
    to: String,
    kinds: Vec<String>,
}

fn main() -> ExitCode {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let is_wanted =
        |defect: &Defect| wanted.is_empty() || wanted.iter().any(|part| defect.name.contains(part));
    let defects: Vec<Defect> = defects(&root).into_iter().filter(is_wanted).collect();
    let folder = std::env::temp_dir().join("ridgelink-defects");
    let tree = folder.join("tree");
    copy(&root, &tree);
    println!("| defect | tried | named by | in its words |\n| --- | --- | --- | --- |");
    let mut unnamed = 0;
    for defect in &defects {
        let named = named(&root, &folder, defect);
        unnamed += usize::from(named.is_empty());
        let by: Vec<&str> = named.keys().map(String::as_str).collect();
        println!(
            "| {} | {} | {} | {} |",
            defect.name,
            defect.kinds.join(", "),
            if by.is_empty() {
                "–".to_owned()
            } else {
                by.join(", ")
            },
            named.values().next().map_or("–", String::as_str)
        );
    }
    println!(
        "\n{} of {} defects named.",
        defects.len() - unnamed,
        defects.len()
    );
    ExitCode::from(u8::from(unnamed > 0))
}

fn defects(root: &Path) -> Vec<Defect> {
    let text = fs::read_to_string(root.join("tests/defects.toml")).expect("the table is there");
    let table: toml::Table = text.parse().expect("it is TOML");
    let rows = table["defect"].as_array().expect("a list of defects");
    rows.iter()
        .map(|row| {
            let text = |key: &str| row[key].as_str().expect("a text").to_owned();
            let kinds = row["kinds"].as_array().expect("a list of kinds");
            Defect {
                name: text("name"),
                file: text("file").into(),
                from: text("from"),
                to: text("to"),
                kinds: kinds
                    .iter()
                    .map(|kind| kind.as_str().expect("a text").to_owned())
                    .collect(),
            }
        })
        .collect()
}

/// Copies all that git knows of.
fn copy(root: &Path, tree: &Path) {
    let listed = Command::new("git")
        .args(["ls-files", "-z"])
        .current_dir(root)
        .output();
    let listed = String::from_utf8(listed.expect("git is there").stdout).expect("names are UTF-8");
    for name in listed.split_terminator('\0') {
        let (from, to) = (root.join(name), tree.join(name));
        fs::create_dir_all(to.parent().expect("a file is in a folder")).expect("it can be made");
        // What has not changed keeps its time, and is not built again.
        let text = fs::read(&from).expect("it can be read");
        if fs::read(&to).ok().as_ref() != Some(&text) {
            fs::write(&to, text).expect("it can be written");
        }
    }
}

/// The kinds that name a defect, each with what it says of it.
fn named(root: &Path, folder: &Path, defect: &Defect) -> BTreeMap<String, String> {
    let path = folder.join("tree").join(&defect.file);
    let sound = fs::read_to_string(&path).expect("the file is there");
    assert_eq!(
        sound.matches(&defect.from).count(),
        1,
        "{}: {:?} has to stand once in {}",
        defect.name,
        defect.from,
        defect.file.display()
    );
    fs::write(&path, sound.replacen(&defect.from, &defect.to, 1)).expect("it can be written");
    let built = build(folder);
    fs::write(&path, sound).expect("it can be written");
    assert!(built, "{}: does not build", defect.name);
    let elves = folder.join("target/thumbv7em-none-eabihf/release");
    let trials = folder.join("trials.csv");
    let ran = Command::new(root.join("target/debug/hil-sim"))
        .args([
            "campaign",
            "--instants",
            INSTANTS,
            "--kinds",
            &defect.kinds.join(","),
        ])
        .arg("--csv")
        .arg(&trials)
        .arg("--display-elf")
        .arg(elves.join("firmware-display"))
        .arg("--sensor-elf")
        .arg(elves.join("firmware-sensor"))
        .stdout(Stdio::null())
        .stderr(Stdio::inherit())
        .status()
        .expect("hil-sim is built");
    assert!(
        ran.code().is_some_and(|code| code < 2),
        "{}: {ran}",
        defect.name
    );
    let text = fs::read_to_string(&trials).expect("the campaign has written it");
    let mut named = BTreeMap::new();
    for row in text.lines().skip(1) {
        let kind = row.split(',').next().unwrap_or_default().to_owned();
        // The last column, in quotation marks.
        let row = row.strip_suffix('"').unwrap_or(row);
        let words = row.rsplit(",\"").next().unwrap_or_default();
        if !words.is_empty() {
            named.entry(kind).or_insert_with(|| words.to_owned());
        }
    }
    named
}

/// Builds the two ELFs of the copy as `./test` does.
fn build(folder: &Path) -> bool {
    Command::new("bash")
        .args(["-c", ". .ci/toolchain.sh && build_firmwares"])
        .current_dir(folder.join("tree"))
        .env("CARGO_TARGET_DIR", folder.join("target"))
        .stderr(Stdio::null())
        .status()
        .expect("bash is there")
        .success()
}
