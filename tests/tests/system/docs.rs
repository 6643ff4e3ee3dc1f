//! The documents: each link leads somewhere, each path exists, each command line is one that the programs take, each
//! picture has its command, and a newcomer's ten questions are answered where CONTRIBUTING.md says.
//!
//! Command lines are compared with what the built programs print for `-h`: neither library exports its command line.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::{Command, Stdio};

use tests::bridge;

mod commands;

/// The README is read in one sitting.
const README_LINES: usize = 200;
/// Documents in the root.
const ROOT_PAGES: [&str; 4] = [
    "README.md",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
];
/// Where the book is, and its list of pages.
const BOOK: &str = "docs/src";
const SUMMARY: &str = "docs/src/SUMMARY.md";
/// A path between backticks that begins with one of these has to exist.
const FOLDERS: [&str; 9] = [
    "protocol",
    "firmware-sensor",
    "firmware-display",
    "hil-sim",
    "host-bridge",
    "tests",
    "docs",
    ".ci",
    ".github",
];
/// What pictures were made by, where it is not `hil-sim chart NAME`, `hil-sim map NAME` or `hil-sim NAME`.
const MADE_BY: [(&str, &str); 5] = [
    ("monitor", "host-bridge monitor"),
    ("report", "--report"),
    ("fig7", "host-bridge/doc/fig7.py"),
    ("live-light", "host-bridge live"),
    ("live-dark", "host-bridge live"),
];
/// The heading of a newcomer's questions, and how many there are.
const QUESTIONS: &str = "Ten questions";
const QUESTION_COUNT: usize = 10;

/// A document, by its path from the root.
struct Page {
    path: PathBuf,
    text: String,
}

/// A line of a document and its number, from 1 on.
type Line<'a> = (usize, &'a str);

/// A part of a document between two fences.
struct Block<'a> {
    language: &'a str,
    lines: Vec<Line<'a>>,
}

impl Page {
    fn new(path: &str, text: &str) -> Self {
        Self {
            path: path.into(),
            text: text.to_owned(),
        }
    }

    fn at(&self, line: usize, what: &str) -> String {
        format!("{}:{line}: {what}", self.path.display())
    }

    /// The lines outside of fences, and what is between fences.
    fn parts(&self) -> (Vec<Line<'_>>, Vec<Block<'_>>) {
        let mut prose = Vec::new();
        let mut blocks: Vec<Block> = Vec::new();
        let mut fenced = false;
        for (number, line) in (1..).zip(self.text.lines()) {
            if let Some(language) = line.trim_start().strip_prefix("```") {
                fenced = !fenced;
                if fenced {
                    blocks.push(Block {
                        language: language.trim(),
                        lines: Vec::new(),
                    });
                }
            } else if !fenced {
                prose.push((number, line));
            } else if let Some(block) = blocks.last_mut() {
                block.lines.push((number, line));
            }
        }
        (prose, blocks)
    }

    /// What links to its headings end in, as forges and mdBook make it.
    fn anchors(&self) -> BTreeSet<String> {
        let mut times: BTreeMap<String, usize> = BTreeMap::new();
        let mut anchors = BTreeSet::new();
        for (_, line) in self.parts().0 {
            let text = line.trim_start_matches('#');
            let level = line.len() - text.len();
            if !(1..=6).contains(&level) || !text.starts_with(' ') {
                continue;
            }
            let anchor = anchor(text);
            let before = times.entry(anchor.clone()).or_default();
            anchors.insert(match *before {
                0 => anchor,
                nth => format!("{anchor}-{nth}"),
            });
            *before += 1;
        }
        anchors
    }
}

fn anchor(heading: &str) -> String {
    heading
        .trim()
        .to_lowercase()
        .chars()
        .filter_map(|c| match c {
            ' ' => Some('-'),
            '-' | '_' => Some(c),
            c => c.is_alphanumeric().then_some(c),
        })
        .collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the package lies in the workspace")
        .to_owned()
}

fn pages() -> Vec<Page> {
    let root = root();
    let mut paths: Vec<PathBuf> = ROOT_PAGES.iter().map(PathBuf::from).collect();
    paths.extend(book());
    paths
        .into_iter()
        .map(|path| Page {
            text: fs::read_to_string(root.join(&path))
                .unwrap_or_else(|error| panic!("{}: {error}", path.display())),
            path,
        })
        .collect()
}

/// The book's pages, by their paths from the root.
fn book() -> Vec<PathBuf> {
    let root = root();
    let mut folders = vec![PathBuf::from(BOOK)];
    let mut paths = Vec::new();
    while let Some(folder) = folders.pop() {
        let entries = fs::read_dir(root.join(&folder))
            .unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        for entry in entries {
            let entry = entry.expect("a folder can be listed");
            let path = folder.join(entry.file_name());
            if root.join(&path).is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "md") {
                paths.push(path);
            }
        }
    }
    paths.sort();
    paths
}

/// What stands between single backticks in a line.
fn spans(line: &str) -> Vec<&str> {
    let pieces: Vec<&str> = line.split('`').collect();
    // Of an odd number of backticks the last opens nothing.
    let closed = pieces.len().saturating_sub(1) / 2;
    pieces.into_iter().skip(1).step_by(2).take(closed).collect()
}

/// A line without what stands between backticks.
fn without_spans(line: &str) -> String {
    line.split('`').step_by(2).collect()
}

/// Where a line's links and pictures lead.
fn targets(line: &str) -> Vec<String> {
    let text = without_spans(line);
    text.split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'))
        .map(|(target, _)| target.to_owned())
        .collect()
}

/// A path from the root, for a link's from a page. None if it leaves the root.
fn resolve(page: &Path, link: &str) -> Option<PathBuf> {
    let folder = page.parent().unwrap_or(Path::new(""));
    let mut path = PathBuf::new();
    for component in folder.join(link).components() {
        match component {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            Component::ParentDir if path.pop() => {}
            _ => return None,
        }
    }
    Some(path)
}

/// What is wrong with the links of `page`, some of which lead to `pages`.
fn wrong_links(page: &Page, pages: &[Page]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (number, line) in page.parts().0 {
        for target in targets(line) {
            if target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let path = if file.is_empty() {
                Some(page.path.clone())
            } else {
                resolve(&page.path, file).filter(|path| root().join(path).exists())
            };
            let Some(path) = path else {
                wrong.push(page.at(number, &format!("{target}: there is no such file")));
                continue;
            };
            // A page that is only being tried is not among the others.
            let other = [page]
                .into_iter()
                .chain(pages)
                .find(|other| other.path == path);
            if !anchor.is_empty() && !other.is_some_and(|other| other.anchors().contains(anchor)) {
                wrong.push(page.at(number, &format!("{target}: there is no such heading")));
            }
        }
    }
    wrong
}

/// The paths between backticks that do not exist.
fn wrong_paths(page: &Page) -> Vec<String> {
    let mut wrong = Vec::new();
    for (number, line) in page.parts().0 {
        for span in spans(line) {
            let is_path = span
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "_./*-".contains(c));
            let first = span.split('/').next().unwrap_or_default();
            if !is_path || !span.contains('/') || !FOLDERS.contains(&first) {
                continue;
            }
            // Of `hil-sim/scenes/*.toml` the folder has to exist.
            let known: PathBuf = Path::new(span)
                .components()
                .take_while(|part| !part.as_os_str().to_string_lossy().contains('*'))
                .collect();
            if !root().join(known).exists() {
                wrong.push(page.at(number, &format!("{span}: there is no such file")));
            }
        }
    }
    wrong
}

/// Pictures without the command that draws them on the same page.
fn wrong_pictures(page: &Page) -> Vec<String> {
    let mut wrong = Vec::new();
    for (number, line) in page.parts().0 {
        if !line.contains("![") {
            continue;
        }
        for target in targets(line) {
            let Some(name) = Path::new(&target)
                .file_stem()
                .and_then(|stem| stem.to_str())
            else {
                continue;
            };
            let is_named = match MADE_BY.iter().find(|(picture, _)| *picture == name) {
                Some((_, by)) => page.text.contains(by),
                None => ["chart ", "map ", ""]
                    .iter()
                    .any(|kind| page.text.contains(&format!("hil-sim {kind}{name}"))),
            };
            if !is_named {
                wrong.push(page.at(number, &format!("{target}: which command draws it?")));
            }
        }
    }
    wrong
}

/// The questions' rows, and what is wrong with them.
fn wrong_questions(page: &Page) -> (usize, Vec<String>) {
    let mut rows = 0;
    let mut wrong = Vec::new();
    let (prose, _) = page.parts();
    let section = prose
        .iter()
        .skip_while(|(_, line)| *line != format!("## {QUESTIONS}"))
        .skip(1)
        .take_while(|(_, line)| !line.starts_with("## "));
    // The first two lines of a table are its head.
    for (number, line) in section.filter(|(_, line)| line.starts_with('|')).skip(2) {
        rows += 1;
        let places = line.trim_end_matches('|').rsplit('|').next();
        let places = spans(places.unwrap_or_default());
        let (pairs, rest) = places.as_chunks::<2>();
        if pairs.is_empty() || !rest.is_empty() {
            wrong.push(page.at(*number, "the last column is not `file`: `item`; …"));
        }
        for [file, item] in pairs {
            match fs::read_to_string(root().join(file)) {
                Ok(text) if text.contains(item) => {}
                Ok(_) => wrong.push(page.at(*number, &format!("{file} has no {item}"))),
                Err(error) => wrong.push(page.at(*number, &format!("{file}: {error}"))),
            }
        }
    }
    (rows, wrong)
}

/// The book's pages that its summary leaves out.
fn forgotten(summary: &Page, book: &[PathBuf]) -> Vec<String> {
    let listed: BTreeSet<PathBuf> = summary
        .text
        .lines()
        .flat_map(targets)
        .filter_map(|target| resolve(&summary.path, &target))
        .collect();
    book.iter()
        .filter(|path| **path != summary.path && !listed.contains(*path))
        .map(|path| format!("{}: is not in {SUMMARY}", path.display()))
        .collect()
}

fn page<'a>(pages: &'a [Page], path: &str) -> &'a Page {
    pages
        .iter()
        .find(|page| page.path == Path::new(path))
        .unwrap_or_else(|| panic!("{path}: there is no such page"))
}

/// Fails with all that is wrong at once.
fn none(wrong: &[String]) {
    assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
}

#[test]
fn each_link_and_picture_leads_to_a_file_and_each_anchor_to_a_heading() {
    let pages = pages();
    let wrong: Vec<String> = pages
        .iter()
        .flat_map(|page| wrong_links(page, &pages))
        .collect();
    none(&wrong);
    let links = pages
        .iter()
        .flat_map(|page| page.text.lines())
        .flat_map(targets);
    assert!(links.count() > 100, "the book has more links than that");
}

#[test]
fn each_path_between_backticks_exists() {
    let wrong: Vec<String> = pages().iter().flat_map(wrong_paths).collect();
    none(&wrong);
}

#[test]
fn the_readme_is_short_and_leads_to_the_questions() {
    let pages = pages();
    let readme = page(&pages, "README.md");
    let lines = readme.text.lines().count();
    assert!(lines <= README_LINES, "README.md has {lines} lines");
    let questions = format!("CONTRIBUTING.md#{}", anchor(QUESTIONS));
    assert!(
        readme
            .text
            .lines()
            .flat_map(targets)
            .any(|target| target == questions),
        "README.md does not link to {questions}"
    );
}

#[test]
fn each_picture_stands_beside_the_command_that_draws_it() {
    let wrong: Vec<String> = pages().iter().flat_map(wrong_pictures).collect();
    none(&wrong);
}

#[test]
fn ten_questions_are_answered_where_it_says() {
    let pages = pages();
    let (rows, wrong) = wrong_questions(page(&pages, "CONTRIBUTING.md"));
    none(&wrong);
    assert_eq!(rows, QUESTION_COUNT);
}

#[test]
fn the_summary_lists_each_page_of_the_book() {
    let pages = pages();
    none(&forgotten(page(&pages, SUMMARY), &book()));
}

#[test]
fn what_is_wrong_is_found() {
    let found = |text: &str| wrong_links(&Page::new("docs/src/tried.md", text), &[]).len();
    assert_eq!(found("[a](index.md) ![b](../../hil-sim/doc/stop.svg)"), 0);
    assert_eq!(found("[a](no-such-page.md)"), 1);
    assert_eq!(found("![a](../../hil-sim/doc/no-such.svg)"), 1);
    assert_eq!(found("[a](../../../outside)"), 1);
    assert_eq!(found("# One thing\n[a](#one-thing)"), 0);
    assert_eq!(found("# One thing\n[a](#another-thing)"), 1);
    assert_eq!(found("`[a](no-such-page.md)`"), 0);
    assert_eq!(found("```sh\n[a](no-such-page.md)\n```\n"), 0);

    let found = |text: &str| wrong_paths(&Page::new("README.md", text)).len();
    assert_eq!(
        found("`protocol/src/lib.rs` and `hil-sim/scenes/*.toml`"),
        0
    );
    assert_eq!(found("`target/debug/hil-sim`, `a/b`, `hil-sim/<scene>`"), 0);
    assert_eq!(found("`protocol/src/no-such-file.rs`"), 1);
    assert_eq!(found("`hil-sim/no-such-folder/*.toml`"), 1);

    let found = |text: &str| wrong_pictures(&Page::new("README.md", text)).len();
    assert_eq!(found("`hil-sim chart stop`\n![a](hil-sim/doc/stop.svg)"), 0);
    assert_eq!(found("![a](hil-sim/doc/stop.svg)"), 1);

    let summary = Page::new(SUMMARY, "- [a](how-to/ci.md)\n");
    let book = ["docs/src/how-to/ci.md", "docs/src/index.md"].map(PathBuf::from);
    assert_eq!(forgotten(&summary, &book).len(), 1);
}

#[test]
fn a_wrong_answer_to_a_question_is_found() {
    let questions = |place: &str| {
        let text = format!(
            "## {QUESTIONS}\n\n| q | a | where |\n| --- | --- | --- |\n| q | a | {place} |\n\n## More\n| a |\n"
        );
        wrong_questions(&Page::new("CONTRIBUTING.md", &text))
    };
    let right = "`protocol/src/frame.rs`: `MAX_FRAME`; `protocol/src/message.rs`: `enum Message`";
    assert_eq!(questions(right), (1, Vec::new()));
    for wrong in [
        "`protocol/src/frame.rs`: `NO_SUCH_ITEM`",
        "`protocol/src/no-such-file.rs`: `MAX_FRAME`",
        "`protocol/src/frame.rs`",
        "nowhere",
    ] {
        let (rows, complaints) = questions(wrong);
        assert_eq!((rows, complaints.len()), (1, 1), "{wrong}: {complaints:?}");
    }
}
