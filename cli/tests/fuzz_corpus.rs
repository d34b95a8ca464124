//! The fuzzers' corpora (`fuzz/`), and what they found, through the functions that the fuzzers
//! call: no nightly compiler needed.
#[path = "../../fuzz/targets.rs"]
mod targets;

use std::path::Path;

/// Calls a target with every file of its corpus, and with the beginnings of some.
fn replay(name: &str, target: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../fuzz/corpus")
        .join(name);
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    assert!(!files.is_empty());
    for file in files {
        println!("{}", file.display());
        let bytes = std::fs::read(&file).unwrap();
        target(&bytes);
        target(&bytes[..bytes.len() / 2]);
    }
}

macro_rules! replayed {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() {
            replay(stringify!($name), targets::$name);
        })*
    };
}

replayed!(exr hdr pfm photograph measurements toml transforms points lobes spheres);
