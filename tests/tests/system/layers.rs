//! Imports run down the simulator's layers only, and no files of a crate import each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The layers of each crate that has some, the lowest first. Cargo holds the order of the crates.
const LAYERS: [(&str, &[&str]); 2] = [
    (
        "hil-sim/core",
        &[
            "scene",
            "hjif",
            "plant",
            "link",
            "run",
            "scene_file",
            "native",
            "judge",
        ],
    ),
    ("hil-sim/studies", &["output"]),
];

/// All crates.
const CRATES: [&str; 10] = [
    "protocol",
    "protocol/nucleo",
    "protocol/ros2msg",
    "firmware-sensor",
    "firmware-display",
    "host-bridge",
    "hil-sim/core",
    "hil-sim/boards",
    "hil-sim/studies",
    "hil-sim",
];

/// A module's place in its crate: `["scene_file", "read"]`.
type Module = Vec<String>;

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") {
            found.push(path);
        }
    }
}

/// The source without comments and without its tests.
fn code(text: &str) -> String {
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    text[..end]
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n")
}

/// Every path of the crate itself that `code`, which stands in `module`, names.
fn named(code: &str, module: &[String]) -> Vec<Module> {
    let mut paths = Vec::new();
    for root in ["crate", "super"] {
        for (at, _) in code.match_indices(root) {
            let before = code[..at].chars().next_back();
            if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
                continue;
            }
            let mut base = if root == "crate" {
                Vec::new()
            } else {
                module[..module.len().saturating_sub(1)].to_vec()
            };
            let mut rest = &code[at + root.len()..];
            while let Some(next) = rest.strip_prefix("::super") {
                base.pop();
                rest = next;
            }
            while let Some(next) = rest.strip_prefix("::") {
                let end = next
                    .find(|c: char| !(c.is_alphanumeric() || c == '_'))
                    .unwrap_or(next.len());
                if end == 0 {
                    // A group: each of its names may be a module.
                    let group = next.strip_prefix('{').and_then(|all| all.split(';').next());
                    for name in group
                        .unwrap_or_default()
                        .split(|c: char| !c.is_alphanumeric() && c != '_')
                    {
                        paths.push([base.clone(), vec![name.to_owned()]].concat());
                    }
                    break;
                }
                base.push(next[..end].to_owned());
                rest = &next[end..];
            }
            paths.push(base);
        }
    }
    paths
}

/// Which modules each module of a crate imports; what is above a module in its own path is left out.
fn imports(folder: &Path) -> BTreeMap<Module, BTreeSet<Module>> {
    let mut found = Vec::new();
    files(folder, &mut found);
    let modules: BTreeMap<Module, PathBuf> = found
        .into_iter()
        .map(|path| {
            let place = path.strip_prefix(folder).unwrap().with_extension("");
            let mut module: Module = place
                .iter()
                .map(|part| part.to_string_lossy().into_owned())
                .collect();
            if module.last().is_some_and(|last| last == "mod") || module == ["lib"] {
                module.pop();
            }
            (module, path)
        })
        .filter(|(module, _)| !module.iter().any(|part| part == "tests"))
        .collect();
    let texts = modules.iter().map(|(module, path)| {
        let text = code(&fs::read_to_string(path).unwrap());
        (module.clone(), text)
    });
    of_texts(&texts.collect())
}

/// The same of the modules' sources.
fn of_texts(texts: &BTreeMap<Module, String>) -> BTreeMap<Module, BTreeSet<Module>> {
    let handed_on: BTreeMap<&Module, BTreeMap<String, Module>> = texts
        .iter()
        .map(|(module, text)| (module, handed_on(text, module, texts)))
        .collect();
    let target = |mut path: Module| {
        let mut name = None;
        while !path.is_empty() && !texts.contains_key(&path) {
            name = path.pop();
        }
        let from = name.and_then(|name| handed_on.get(&path)?.get(&name));
        from.cloned().unwrap_or(path)
    };
    let targets = |(module, text): (&Module, &String)| {
        let mut targets: BTreeSet<Module> = named(text, module).into_iter().map(target).collect();
        targets.retain(|path| !path.is_empty() && !module.starts_with(path));
        (module.clone(), targets)
    };
    texts.iter().map(targets).collect()
}

/// What a module hands on by `pub use` of its own modules, and from which.
fn handed_on(
    text: &str,
    module: &[String],
    texts: &BTreeMap<Module, String>,
) -> BTreeMap<String, Module> {
    let mut found = BTreeMap::new();
    for (at, _) in text.match_indices("pub use ") {
        let path = text[at + "pub use ".len()..].split(';').next();
        let path = path.unwrap_or_default().trim_start_matches("self::");
        let mut words = path
            .split(|c: char| !(c.is_alphanumeric() || c == '_'))
            .filter(|word| !word.is_empty());
        let first = words.next().unwrap_or_default().to_owned();
        let child = [module, &[first]].concat();
        if texts.contains_key(&child) {
            found.extend(words.map(|word| (word.to_owned(), child.clone())));
        }
    }
    found
}

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn upwards(graph: &BTreeMap<Module, BTreeSet<Module>>, layers: &[&str]) -> Vec<String> {
    // What no list names lies above all that one does.
    let rank = |module: &Module| {
        let top = module.first().map(String::as_str).unwrap_or_default();
        layers
            .iter()
            .position(|layer| *layer == top)
            .unwrap_or(layers.len())
    };
    let mut wrong = Vec::new();
    for (module, targets) in graph.iter().filter(|(module, _)| !module.is_empty()) {
        for target in targets.iter().filter(|target| rank(module) < rank(target)) {
            wrong.push(format!(
                "{} imports {}",
                module.join("::"),
                target.join("::")
            ));
        }
    }
    wrong
}

/// Modules that reach themselves by imports, the crate's root apart: it only lists the others.
fn circles(graph: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<String> {
    graph
        .keys()
        .filter(|module| !module.is_empty())
        .filter(|start| {
            let mut seen = BTreeSet::new();
            let mut next: Vec<&Module> = graph[*start].iter().collect();
            while let Some(module) = next.pop() {
                if module == *start {
                    return true;
                }
                if seen.insert(module) {
                    next.extend(graph.get(module).into_iter().flatten());
                }
            }
            false
        })
        .map(|module| module.join("::"))
        .collect()
}

/// A judge that used the firmware's own code would be wrong where that is. What a surface needs is no judgement of it, and is
/// foretold by the display's library.
#[test]
fn no_judge_uses_the_firmware() {
    let folder = workspace().join("hil-sim/core/src");
    let mut found = vec![folder.join("judge.rs")];
    files(&folder.join("judge"), &mut found);
    assert!(found.len() > 20);
    for path in found {
        let text = code(&fs::read_to_string(&path).unwrap());
        let is_forecast = path.ends_with("judge/needed.rs");
        let names = |word: &str| text.contains(word);
        assert!(!names("firmware_"), "{}", path.display());
        assert_eq!(names("native::rendered"), is_forecast, "{}", path.display());
    }
}

#[test]
fn no_layer_imports_one_above_it() {
    for (folder, layers) in LAYERS {
        let graph = imports(&workspace().join(folder).join("src"));
        assert!(graph.len() > 20, "{folder}: {} modules", graph.len());
        let wrong = upwards(&graph, layers);
        assert!(wrong.is_empty(), "{folder}: {wrong:#?}");
    }
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    for folder in CRATES {
        let found = circles(&imports(&workspace().join(folder).join("src")));
        assert!(found.is_empty(), "{folder}: {found:#?}");
    }
}

#[test]
fn an_import_upwards_and_a_circle_are_seen() {
    let module = |name: &str| vec![name.to_owned()];
    let text =
        code("use super::plant::Contact;\n// use crate::run;\nuse crate::{link, run::Kept};");
    let paths = named(&text, &module("scene"));
    for name in ["plant", "link", "run"] {
        assert!(
            paths
                .iter()
                .any(|path| path.first().is_some_and(|first| first == name)),
            "{name}: {paths:?}"
        );
    }
    // By what their parent hands on.
    let texts = [
        (
            vec!["fault".to_owned()],
            "pub mod catalogue; mod kind; pub use kind::{All, Kind};",
        ),
        (
            ["fault", "kind"].map(str::to_owned).to_vec(),
            "use super::catalogue::Row;",
        ),
        (
            ["fault", "catalogue"].map(str::to_owned).to_vec(),
            "use super::Kind;",
        ),
    ];
    let texts = texts.map(|(module, text)| (module, text.to_owned()));
    assert_eq!(
        circles(&of_texts(&BTreeMap::from(texts))),
        ["fault::catalogue", "fault::kind"]
    );
    let graph = BTreeMap::from([
        (module("scene"), BTreeSet::from([module("plant")])),
        (module("plant"), BTreeSet::from([module("scene")])),
    ]);
    assert_eq!(
        upwards(&graph, &["scene", "plant"]),
        ["scene imports plant"]
    );
    assert_eq!(circles(&graph), ["plant", "scene"]);
}

#[test]
fn each_deliberate_defect_finds_its_place_in_the_code() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |file: &str| {
        fs::read_to_string(root.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
    };
    let table: toml::Table = read("tests/defects.toml").parse().expect("TOML");
    let rows = table["defect"].as_array().expect("a list");
    assert!(rows.len() > 40, "{}", rows.len());
    for row in rows {
        let [name, file, from, to] =
            ["name", "file", "from", "to"].map(|key| row[key].as_str().unwrap_or_default());
        assert_eq!(
            read(file).matches(from).count(),
            1,
            "{name}: {from:?} in {file}"
        );
        assert_ne!(from, to, "{name}");
    }
}
