//! The rooms of the code and who may enter which: ARCHITECTURE.md's tables hold for the sources.
//!
//! Every path that begins with `crate` or `super` is followed to the file that it names, through
//! the names that a folder's `mod.rs` hands on. What a file uses in its tests does not count.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A module as a path of names: `["reflectance", "ward"]`; the crate's root is empty.
type Module = Vec<String>;

/// The files of a crate's `src`, by the module that each is.
fn files(src: &Path) -> BTreeMap<Module, PathBuf> {
    let mut found = BTreeMap::new();
    let mut folders = vec![src.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let place = path.strip_prefix(src).unwrap().with_extension("");
                let names = place.iter().map(|name| name.to_str().unwrap().to_owned());
                let mut module: Module = names.collect();
                if ["mod", "lib", "main"].contains(&module.last().unwrap().as_str()) {
                    module.pop();
                }
                found.insert(module, path);
            }
        }
    }
    found
}

/// A source without its comments, its strings and its unit tests.
fn code(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let text = text.split("mod tests {").next().unwrap_or_default();
    text.lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n")
}

/// The paths of a `use`: `a::{b, c::{d, e as f}}` is `a::b`, `a::c::d` and `a::c::e`.
fn expand(tree: &str, before: &[String], paths: &mut Vec<Module>) {
    let tree = tree.trim();
    let split = |text: &str| -> Module {
        let parts = text
            .split("::")
            .map(str::trim)
            .filter(|part| !part.is_empty());
        parts.map(str::to_owned).collect()
    };
    let Some((stem, list)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default();
        paths.push([before, &split(path)].concat());
        return;
    };
    let before = [before, &split(stem)].concat();
    let list = list.strip_suffix('}').unwrap_or(list);
    let (mut depth, mut start) = (0, 0);
    for (i, letter) in list.char_indices().chain([(list.len(), ',')]) {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !list[start..i].trim().is_empty() {
                    expand(&list[start..i], &before, paths);
                }
                start = i + 1;
            }
            _ => {}
        }
    }
}

/// A path from the crate's root, if it begins with `crate`, `self` or `super`.
fn absolute(module: &[String], path: &[String]) -> Option<Module> {
    let mut place = module.to_vec();
    let mut rest = path;
    match rest.first().map(String::as_str) {
        Some("crate") => return Some(rest[1..].to_vec()),
        Some("self") => rest = &rest[1..],
        Some("super") => {
            while rest.first().is_some_and(|name| name == "super") {
                place.pop();
                rest = &rest[1..];
            }
        }
        _ => return None,
    }
    place.extend_from_slice(rest);
    Some(place)
}

/// Which modules each module of a crate uses.
fn edges(src: &Path) -> BTreeMap<Module, BTreeSet<Module>> {
    let files = files(src);
    let mut uses: Vec<(Module, Module)> = Vec::new();
    let mut handed_on: BTreeMap<(Module, String), Module> = BTreeMap::new();
    for (module, path) in &files {
        let code = code(path);
        let mut rest = code.as_str();
        while let Some(at) = rest.find("use ") {
            let statement = &rest[at + 4..];
            let begins = rest[..at]
                .chars()
                .next_back()
                .is_none_or(|c| !c.is_alphanumeric());
            let line = rest[..at].rsplit('\n').next().unwrap_or_default().trim();
            let Some(end) = statement.find(';') else {
                break;
            };
            if begins && (line.is_empty() || line.starts_with("pub")) {
                let mut paths = Vec::new();
                expand(&statement[..end], &[], &mut paths);
                for path in paths {
                    let own = [module.as_slice(), &path[..1]].concat();
                    let target = absolute(module, &path).or_else(|| {
                        let child = files.contains_key(&own);
                        child.then(|| [module.as_slice(), &path].concat())
                    });
                    let Some(target) = target else { continue };
                    if line.starts_with("pub") {
                        let name = target.last().cloned().unwrap_or_default();
                        handed_on.insert((module.clone(), name), target.clone());
                    }
                    uses.push((module.clone(), target));
                }
            }
            rest = &statement[end..];
        }
        for start in ["crate::", "super::"] {
            for (at, _) in code.match_indices(start) {
                let longest: String = code[at..]
                    .chars()
                    .take_while(|c| c.is_alphanumeric() || *c == ':' || *c == '_')
                    .collect();
                let names = longest.split("::").filter(|name| !name.is_empty());
                let path: Module = names.map(str::to_owned).collect();
                uses.extend(absolute(module, &path).map(|target| (module.clone(), target)));
            }
        }
    }
    let mut edges: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for (from, mut target) in uses {
        // The file that holds what the path names.
        for _ in 0..5 {
            let length = (0..=target.len())
                .rev()
                .find(|&n| files.contains_key(&target[..n]));
            let (module, rest) = target.split_at(length.unwrap_or(0));
            let name = rest.first().cloned().unwrap_or_default();
            match handed_on.get(&(module.to_vec(), name)) {
                Some(next) => {
                    target = [next.as_slice(), rest.get(1..).unwrap_or_default()].concat();
                }
                None => break,
            }
        }
        while !files.contains_key(&target) {
            target.pop();
        }
        // A folder may name what is in it, and everyone may use what stands in the crate's root.
        let inside = target.starts_with(&from) || target.is_empty();
        if target != from && !inside {
            edges.entry(from).or_default().insert(target);
        }
    }
    edges
}

/// The first circle that is met, as the modules along it.
fn circle(edges: &BTreeMap<Module, BTreeSet<Module>>) -> Option<Vec<Module>> {
    fn visit(
        module: &Module,
        edges: &BTreeMap<Module, BTreeSet<Module>>,
        path: &mut Vec<Module>,
        done: &mut BTreeSet<Module>,
    ) -> Option<Vec<Module>> {
        if let Some(at) = path.iter().position(|on| on == module) {
            return Some(path[at..].to_vec());
        }
        if done.contains(module) {
            return None;
        }
        path.push(module.clone());
        for next in edges.get(module).into_iter().flatten() {
            if let Some(found) = visit(next, edges, path, done) {
                return Some(found);
            }
        }
        path.pop();
        done.insert(module.clone());
        None
    }
    let mut done = BTreeSet::new();
    let mut starts = edges.keys();
    starts.find_map(|module| visit(module, edges, &mut Vec::new(), &mut done))
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The rows of ARCHITECTURE.md's table of modules: which other modules each may use.
fn allowed() -> BTreeMap<String, BTreeSet<String>> {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let table = text
        .split("| module | what it holds | may use |")
        .nth(1)
        .unwrap();
    let rows = table
        .lines()
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    let names = |cell: &str| -> BTreeSet<String> {
        cell.split('`')
            .skip(1)
            .step_by(2)
            .map(str::to_owned)
            .collect()
    };
    rows.map(|row| {
        let cells: Vec<&str> = row.split('|').collect();
        (names(cells[1]).pop_first().unwrap(), names(cells[3]))
    })
    .collect()
}

#[test]
fn modules_use_what_the_table_allows() {
    let allowed = allowed();
    for (from, targets) in edges(&root().join("src")) {
        let Some(may) = allowed.get(&from[0]) else {
            let stands_in_the_root = from.len() == 1;
            assert!(
                stands_in_the_root,
                "{from:?} is in no row of ARCHITECTURE.md"
            );
            continue;
        };
        for target in targets {
            let (room, own) = (&target[0], target[0] == from[0]);
            // `error`, `parallelism` and their like stand in the crate's root, for everyone.
            let shared = target.len() == 1 && !allowed.contains_key(room);
            assert!(
                own || shared || may.contains(room),
                "{} uses {}, which ARCHITECTURE.md does not allow",
                from.join("::"),
                target.join("::")
            );
        }
    }
}

#[test]
fn no_row_allows_what_nobody_uses() {
    let mut unused = allowed();
    for (from, targets) in edges(&root().join("src")) {
        for target in targets {
            if let Some(row) = unused.get_mut(&from[0]) {
                row.remove(&target[0]);
            }
        }
    }
    unused.retain(|_, row| !row.is_empty());
    assert!(
        unused.is_empty(),
        "ARCHITECTURE.md allows more than is used: {unused:?}"
    );
}

/// The sources of every crate of the workspace that stand here: a package holds the library alone.
fn sources() -> impl Iterator<Item = PathBuf> {
    let crates = ["", "experiments", "contracts", "cli", "python"];
    let sources = crates.map(|name| root().join(name).join("src"));
    sources.into_iter().filter(|src| src.exists())
}

/// What the folders of a crate's `src`, and the files beside them, use of each other.
fn edges_between_folders(
    edges: &BTreeMap<Module, BTreeSet<Module>>,
) -> BTreeMap<Module, BTreeSet<Module>> {
    let mut folders: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for (from, targets) in edges {
        for target in targets {
            if from[0] != target[0] {
                let of = folders.entry(vec![from[0].clone()]).or_default();
                of.insert(vec![target[0].clone()]);
            }
        }
    }
    folders
}

#[test]
fn files_and_folders_do_not_import_each_other_in_circles() {
    for src in sources() {
        let edges = edges(&src);
        assert!(edges.len() > 3, "{} has no imports", src.display());
        for edges in [&edges_between_folders(&edges), &edges] {
            if let Some(found) = circle(edges) {
                let names: Vec<String> = found.iter().map(|module| module.join("::")).collect();
                panic!("{}: {}", src.display(), names.join(" → "));
            }
        }
    }
}

/// A reader who has met a name in a folder knows which type it is.
#[test]
fn no_folder_has_two_types_of_one_name() {
    for src in sources() {
        let mut places: BTreeMap<(PathBuf, String), PathBuf> = BTreeMap::new();
        for path in files(&src).into_values() {
            for line in code(&path).lines() {
                let line = line.strip_prefix("pub ").unwrap_or(line);
                let line = match line.strip_prefix("pub(") {
                    Some(rest) => rest.split_once(") ").map_or("", |(_, line)| line),
                    None => line,
                };
                let kinds = ["struct ", "enum ", "trait ", "type "];
                let Some(rest) = kinds.iter().find_map(|kind| line.strip_prefix(kind)) else {
                    continue;
                };
                let name: String = rest
                    .chars()
                    .take_while(|c| c.is_alphanumeric() || *c == '_')
                    .collect();
                let folder = path.parent().unwrap().to_owned();
                let first = places.entry((folder, name)).or_insert_with(|| path.clone());
                assert!(
                    *first == path,
                    "{} and {} both have the type of {line}",
                    first.display(),
                    path.display()
                );
            }
        }
    }
}

/// The scanner sees a circle where there is one, and an edge through a name that is handed on.
#[test]
fn circles_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("lib.rs", "mod a;\nmod b;\nmod c;\npub use b::B;\n");
    write("a.rs", "use crate::B;\npub struct A(B);\n");
    write(
        "b.rs",
        "use std::fmt;\nuse super::{c::{C as D}};\npub struct B(D);\n",
    );
    write("c.rs", "pub struct C; // crate::a\n");
    assert_eq!(circle(&edges(folder.path())), None);
    write("c.rs", "pub struct C;\nfn f() { crate::a::g() }\n");
    let found = circle(&edges(folder.path())).unwrap();
    assert_eq!(found, [["a"], ["b"], ["c"]]);
}

/// So does it where two folders use each other through different files.
#[test]
fn circles_of_folders_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a", "b"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("a/mod.rs", "pub mod low;\npub mod high;\n");
    write("a/low.rs", "pub struct Low;\n");
    write("a/high.rs", "use crate::b::B;\npub struct High(B);\n");
    write("b/mod.rs", "use crate::a::low::Low;\npub struct B(Low);\n");
    let edges = edges(folder.path());
    assert_eq!(circle(&edges), None);
    assert!(circle(&edges_between_folders(&edges)).is_some());
}
