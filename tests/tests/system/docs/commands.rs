//! The command lines of a page, held against what the programs say of themselves.

use super::*;

/// Programs whose command lines are checked.
const PROGRAMS: [&str; 2] = ["hil-sim", "host-bridge"];

/// What a program takes, by its own help.
#[derive(Clone, Debug, Default, PartialEq)]
struct Help {
    commands: BTreeSet<String>,
    options: BTreeSet<String>,
}

/// The words of each command of a shell's line, its comment left out.
fn commands(line: &str) -> Vec<Vec<String>> {
    let mut commands = vec![Vec::new()];
    let mut word = String::new();
    let mut quote = None;
    // Closed by a space, so that the last word ends as the others do.
    for c in line.chars().chain([' ']) {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), c) => word.push(c),
            (None, '\'' | '"') => quote = Some(c),
            (None, '#') if word.is_empty() => break,
            (None, c) if c.is_whitespace() || "|&;()".contains(c) => {
                if !word.is_empty()
                    && let Some(words) = commands.last_mut()
                {
                    words.push(std::mem::take(&mut word));
                }
                if !c.is_whitespace() {
                    commands.push(Vec::new());
                }
            }
            (None, c) => word.push(c),
        }
    }
    commands
}

/// The program and its arguments, if a command is one of [`PROGRAMS`].
fn program(words: &[String]) -> Option<(&'static str, &[String])> {
    let words = match words.iter().position(|word| !is_assignment(word)) {
        Some(first) => &words[first..],
        None => return None,
    };
    let (first, rest) = words.split_first()?;
    let known = |name: &str| PROGRAMS.into_iter().find(|known| *known == name);
    if first == "cargo" {
        let bin = rest.iter().position(|word| word == "--bin")?;
        let program = known(rest.get(bin + 1)?)?;
        let arguments = rest.iter().position(|word| word == "--")?;
        return Some((program, &rest[arguments + 1..]));
    }
    let name = Path::new(first).file_name()?.to_str()?;
    known(name).map(|program| (program, rest))
}

/// Whether a word sets a variable for the command behind it.
fn is_assignment(word: &str) -> bool {
    word.split_once('=').is_some_and(|(name, _)| {
        !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    })
}

/// The command lines of a page: those of its `sh` blocks, and those between backticks. The changelog's backticks
/// speak of earlier versions.
fn command_lines(page: &Page) -> Vec<(usize, String)> {
    let (prose, blocks) = page.parts();
    let mut lines = Vec::new();
    for block in blocks.iter().filter(|block| block.language == "sh") {
        let mut text = String::new();
        let mut document_end: Option<String> = None;
        for &(number, line) in &block.lines {
            if let Some(end) = &document_end {
                if line.trim() == end {
                    document_end = None;
                }
                continue;
            }
            if let Some(begun) = line.strip_suffix('\\') {
                text.push_str(begun);
                text.push(' ');
                continue;
            }
            text.push_str(line);
            document_end = line
                .split_once("<<")
                .map(|(_, rest)| rest.split_whitespace().next().unwrap_or_default())
                .map(|word| word.trim_matches(['\'', '"']).to_owned());
            lines.push((number, std::mem::take(&mut text)));
        }
    }
    if page.path != Path::new("CHANGELOG.md") {
        for (number, line) in prose {
            lines.extend(
                spans(line)
                    .into_iter()
                    .map(|span| (number, span.to_owned())),
            );
        }
    }
    lines
}

/// The command lines of a page that the programs would refuse, by their `help` for a path of subcommands.
fn wrong_commands(page: &Page, mut help: impl FnMut(&str, &[&str]) -> Help) -> Vec<String> {
    let mut wrong = Vec::new();
    for (number, line) in command_lines(page) {
        for words in commands(&line) {
            let Some((program, arguments)) = program(&words) else {
                continue;
            };
            let complaint = |what: &str| page.at(number, &format!("{program}: {what}"));
            let mut path: Vec<&str> = Vec::new();
            let mut now = help(program, &path);
            for word in arguments {
                if word == "--" {
                    break;
                }
                if word.starts_with('-') {
                    let option = if word.starts_with("--") {
                        word.split_once('=').map_or(word.as_str(), |(name, _)| name)
                    } else {
                        // Of -j4 the -j.
                        word.get(..2).unwrap_or(word)
                    };
                    if !now.options.contains(option) {
                        let of = path.join(" ");
                        wrong.push(complaint(&format!("{of} has no option {option}")));
                    }
                } else if !now.commands.is_empty() {
                    if now.commands.contains(word) {
                        path.push(word);
                        now = help(program, &path);
                    } else {
                        if !is_placeholder(word) {
                            wrong.push(complaint(&format!("has no command {word}")));
                        }
                        break;
                    }
                }
            }
        }
    }
    wrong
}

/// Whether a word stands for others, as SCENE and … do.
fn is_placeholder(word: &str) -> bool {
    word.contains('…') || word.starts_with(|c: char| c.is_ascii_uppercase())
}

/// Commands and options in what clap prints for `-h`.
fn read_help(text: &str) -> Help {
    let mut help = Help::default();
    let mut in_commands = false;
    for line in text.lines() {
        if !line.starts_with(' ') {
            in_commands = line == "Commands:";
            continue;
        }
        let entry = line.trim_start();
        if entry.starts_with('-') {
            // "-j, --jobs <N>", two spaces, and what it does.
            let names = entry.split("  ").next().unwrap_or_default();
            help.options.extend(
                names
                    .split([' ', ',', '=', '<', '['])
                    .filter(|name| name.starts_with('-'))
                    .map(str::to_owned),
            );
        } else if in_commands && line.len() - entry.len() == 2 {
            help.commands
                .extend(entry.split_whitespace().next().map(str::to_owned));
        }
    }
    help
}

/// What a built program takes after `path`.
fn ask_for_help(name: &str, path: &[&str]) -> Help {
    // One that is older than its sources is refused there; cargo builds both at once.
    let program = bridge::path().with_file_name(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    let output = Command::new(&program)
        .args(path)
        .arg("-h")
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|error| {
            panic!(
                "{}: {error}: run ./test, which builds it, or `cargo build --workspace --bins`",
                program.display()
            )
        });
    assert!(output.status.success(), "{name} {path:?} -h: {output:?}");
    let help = read_help(&String::from_utf8_lossy(&output.stdout));
    assert!(
        help.options.contains("--help"),
        "{name} {path:?} -h: no options found in {output:?}"
    );
    help
}

#[test]
fn each_command_line_is_one_that_the_programs_take() {
    let mut known: BTreeMap<String, Help> = BTreeMap::new();
    let pages = pages();
    let wrong: Vec<String> = pages
        .iter()
        .flat_map(|page| {
            wrong_commands(page, |name, path| {
                known
                    .entry(format!("{name} {}", path.join(" ")))
                    .or_insert_with(|| ask_for_help(name, path))
                    .clone()
            })
        })
        .collect();
    none(&wrong);
    for program in PROGRAMS {
        assert!(
            known.keys().any(|asked| asked.starts_with(program)),
            "no page has a command line of {program}"
        );
    }
}

#[test]
fn a_wrong_command_line_is_found() {
    let sets = |commands: &[&str], options: &[&str]| Help {
        commands: commands.iter().map(|name| (*name).to_owned()).collect(),
        options: options.iter().map(|name| (*name).to_owned()).collect(),
    };
    let help = |program: &str, path: &[&str]| match (program, path) {
        ("hil-sim", []) => sets(&["run", "chart"], &["--help"]),
        ("hil-sim", ["run"]) => sets(&[], &["--json", "-j", "--jobs"]),
        ("hil-sim", ["chart"]) => sets(&["stop"], &[]),
        ("hil-sim", ["chart", "stop"]) => sets(&[], &["--out"]),
        _ => sets(&["doctor"], &[]),
    };
    let found = |line: &str| {
        let text = format!("```sh\n{line}\n```\n");
        wrong_commands(&Page::new("README.md", &text), help)
    };
    for right in [
        "hil-sim run a.toml --json out.json -j 4 # --no-comment",
        "cargo run --bin hil-sim -- chart stop --out=here",
        "A=1 target/debug/hil-sim run a.toml -j4 | grep -v --no-such",
        "hil-sim chart NAME --anything; host-bridge doctor && true",
        "hil-sim run \\\n  --json out.json",
        "cat > a <<'END'\nhil-sim nothing\nEND\nhil-sim run a",
        "grep nothing",
    ] {
        assert_eq!(found(right), Vec::<String>::new(), "{right}");
    }
    for wrong in [
        "hil-sim rum a.toml",
        "hil-sim run --jason out.json",
        "hil-sim run -x",
        "cargo run --bin hil-sim -- chart start",
        "hil-sim chart stop --json a",
        "true && host-bridge docter",
        "hil-sim run \\\n  --jason out.json",
        "cat > a <<'END'\nEND\nhil-sim rum a",
    ] {
        assert_eq!(found(wrong).len(), 1, "{wrong}");
    }
    let inline = Page::new("README.md", "By `hil-sim rum` and `hil-sim run`.");
    assert_eq!(wrong_commands(&inline, help).len(), 1);
}

#[test]
fn claps_help_is_read() {
    let help = read_help(
        "Ridgelink's simulator\n\nUsage: hil-sim <COMMAND>\n\nCommands:\n  run   Runs scenes: all of\n        them\n  help  Print\n\n\
         Options:\n  -j, --jobs <N>     Scenes at a time; see --other\n      --json <FILE>  Where\n  -h, --help         Print help\n",
    );
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    assert_eq!(
        help,
        Help {
            commands: names(&["run", "help"]),
            options: names(&["-j", "--jobs", "--json", "-h", "--help"]),
        }
    );
}
