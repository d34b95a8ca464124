//! The documents hold together: every link between files leads somewhere, and every document is led
//! to.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The Markdown files of a folder and of those in it.
fn documents(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            documents(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
}

/// The documents at the root and in `docs` and `python`.
fn all() -> Vec<PathBuf> {
    let mut found = Vec::new();
    documents(&root().join("docs"), &mut found);
    // A package holds the library and its documents.
    for name in [
        "README",
        "ARCHITECTURE",
        "CONTRIBUTING",
        "BENCHMARKS",
        "ACCURACY",
        "CHANGELOG",
        "python/README",
    ] {
        let path = root().join(name).with_extension("md");
        found.extend(path.exists().then_some(path));
    }
    found
}

/// Without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(plain.pop()),
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// What a document links to in the repository.
fn links(document: &Path) -> Vec<PathBuf> {
    let text = std::fs::read_to_string(document).unwrap();
    let mut links = Vec::new();
    for (at, _) in text.match_indices("](") {
        let target = text[at + 2..].split(')').next().unwrap_or_default();
        let file = target.split('#').next().unwrap_or_default();
        if !file.is_empty() && !target.contains(':') && !target.contains(' ') {
            links.push(plain(&document.parent().unwrap().join(file)));
        }
    }
    links
}

#[test]
fn links_lead_somewhere() {
    let mut count = 0;
    for document in all() {
        for link in links(&document) {
            // Of the other members of the workspace a package holds nothing.
            let other = ["python", "cli", "contracts", "experiments", "fuzz"];
            let member = other
                .iter()
                .find(|name| link.starts_with(root().join(name)));
            if member.is_some_and(|name| !root().join(name).exists()) {
                continue;
            }
            assert!(
                link.exists(),
                "{} links to {}",
                document.display(),
                link.display()
            );
            count += 1;
        }
    }
    assert!(count > 30, "{count} links");
}

/// Whoever begins at the README comes to each document by links.
#[test]
fn every_document_is_led_to() {
    let mut reached = BTreeSet::from([root().join("README.md")]);
    let mut next: Vec<PathBuf> = reached.iter().cloned().collect();
    while let Some(document) = next.pop() {
        for link in links(&document) {
            if link.extension().is_some_and(|extension| extension == "md")
                && reached.insert(link.clone())
            {
                next.push(link);
            }
        }
    }
    let lost: Vec<PathBuf> = all()
        .into_iter()
        .filter(|document| !reached.contains(document))
        .collect();
    assert!(lost.is_empty(), "no way leads from the README to {lost:?}");
}
