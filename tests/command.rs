//! The command as a user meets it: what it writes, and what it says of bad input.
#![cfg(feature = "cli")]

use std::path::Path;
use std::process::{Command, Output};

fn lobes(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lobes"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the command runs")
}

/// A flat Radiance picture that varies about one radiance, so that spectra have power everywhere.
fn hdr(width: usize, height: usize, rgbe: [u8; 4]) -> Vec<u8> {
    let mut bytes =
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for pixel in 0..width * height {
        let mut value = rgbe;
        value[0] = value[0].wrapping_add((pixel * 37 % 61) as u8);
        value[1] = value[1].wrapping_sub((pixel * 53 % 47) as u8);
        bytes.extend(value);
    }
    bytes
}

/// A little-endian PFM of 32 × 16 that is 1 but for one value.
fn pfm(value: f32) -> Vec<u8> {
    let mut bytes = b"PF\n32 16\n-1.0\n".to_vec();
    for i in 0..32 * 16 * 3 {
        let v = if i == 100 { value } else { 1.0 };
        bytes.extend(v.to_le_bytes());
    }
    bytes
}

/// Runs the command and checks that it fails with one line that holds every one of `words`, and
/// writes nothing.
fn fails(folder: &Path, arguments: &[&str], words: &[&str]) {
    let before = entries(folder);
    let output = lobes(arguments, folder);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success(), "{arguments:?} succeeded");
    assert_eq!(
        message.trim_end().lines().count(),
        1,
        "more than a sentence: {message}"
    );
    for word in words {
        assert!(
            message.contains(word),
            "{arguments:?}: no {word:?} in {message}"
        );
    }
    assert_eq!(
        entries(folder),
        before,
        "{arguments:?} left something behind"
    );
}

fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

const GREY: [u8; 4] = [128, 128, 128, 129];

#[test]
fn bad_light_gets_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let light = |name: &str, files: &[(&str, Vec<u8>)], words: &[&str]| {
        let path = at.join(name);
        std::fs::create_dir(&path).unwrap();
        for (file, bytes) in files {
            std::fs::write(path.join(file), bytes).unwrap();
        }
        fails(
            at,
            &["reproduce", "--out", "r", "--illuminations", name],
            words,
        );
    };
    fails(
        at,
        &["reproduce", "--out", "r", "--illuminations", "missing"],
        &["missing"],
    );
    light("empty", &[], &["empty"]);
    let good = hdr(64, 32, GREY);
    light("one", &[("a.hdr", good.clone())], &["two", "\"a\""]);
    light(
        "truncated",
        &[("a.hdr", good[..good.len() / 2].to_vec())],
        &["a.hdr"],
    );
    let huge = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 2000000\n".to_vec();
    light("huge", &[("a.hdr", huge)], &["a.hdr"]);
    light(
        "square",
        &[("a.hdr", hdr(64, 64, GREY))],
        &["a.hdr", "--mapping"],
    );
    light("odd", &[("a.hdr", hdr(70, 31, GREY))], &["a.hdr"]);
    let mut black = hdr(32, 16, GREY);
    let header = black.len() - 4 * 32 * 16;
    black[header..].fill(0);
    light("black", &[("a.hdr", black)], &["a.hdr", "black"]);
    light(
        "twins",
        &[("a.hdr", good), ("a.pfm", pfm(0.5))],
        &["a.hdr", "a.pfm"],
    );
    light("nan", &[("a.pfm", pfm(f32::NAN))], &["a.pfm"]);
    light("infinite", &[("a.pfm", pfm(f32::INFINITY))], &["a.pfm"]);
    light("negative", &[("a.pfm", pfm(-1.0))], &["a.pfm", "negative"]);
}

#[test]
fn bad_options_get_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("file"), b"").unwrap();
    fails(
        at,
        &["reproduce", "--out", "file/below"],
        &["file/below", "--out"],
    );
    fails(
        at,
        &["reproduce", "--out", "r", "--continuation", "antipodal"],
        &["antipodal", "odd"],
    );
    fails(
        at,
        &["reproduce", "--out", "r", "--materials", "none.toml"],
        &["none.toml"],
    );
    fails(at, &["spectrum", "none.hdr"], &["none.hdr"]);
    fails(at, &["render", "--light", "nowhere"], &["nowhere"]);
}

/// The table that people read, of the light in the library.
#[test]
fn the_table_of_the_built_in_light() {
    let folder = tempfile::tempdir().unwrap();
    let output = lobes(&["spectrum"], folder.path());
    assert!(output.status.success());
    assert!(folder.path().join("spectrum.svg").is_file());
    insta::assert_snapshot!(String::from_utf8_lossy(&output.stdout));
}

#[test]
fn reproduce_writes_the_whole_page() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("maps")).unwrap();
    for (name, rgbe) in [
        ("a", [90, 120, 160, 129]),
        ("b", [160, 90, 70, 130]),
        ("c", [100, 140, 60, 128]),
    ] {
        std::fs::write(at.join(format!("maps/{name}.hdr")), hdr(64, 32, rgbe)).unwrap();
    }
    let output = lobes(
        &[
            "reproduce",
            "--illuminations",
            "maps",
            "--size",
            "32",
            "--out",
            "r",
        ],
        at,
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("94.4 %") && said.contains("78.8 %"), "{said}");

    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(at.join("r/accuracy.json")).unwrap()).unwrap();
    for row in json["rows"].as_array().unwrap() {
        let correct = row["correct"].as_u64().unwrap();
        assert_eq!(row["total"], 24, "three maps and eight materials");
        let confusions = row["confusions"].as_array().unwrap().len() as u64;
        assert_eq!(confusions, 24 - correct);
        assert!(row["ci95"][0].as_f64() <= row["accuracy"].as_f64());
    }
    let page = std::fs::read_to_string(at.join("r/index.html")).unwrap();
    assert!(
        !page.contains("http"),
        "the page asks the network for something"
    );
    for source in page.split("src=\"").skip(1) {
        let path = source.split('"').next().unwrap();
        assert!(at.join("r").join(path).is_file(), "{path} is missing");
    }
}

/// Debevec's probes are square angular maps, which a mirror ball could be too: the user says which.
#[test]
fn a_folder_of_angular_maps_works() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("probes")).unwrap();
    for (name, rgbe) in [("a", [90, 120, 160, 129]), ("b", [160, 90, 70, 130])] {
        std::fs::write(at.join(format!("probes/{name}.hdr")), hdr(96, 96, rgbe)).unwrap();
    }
    let output = lobes(
        &[
            "reproduce",
            "--illuminations",
            "probes",
            "--mapping",
            "angular-map",
            "--size",
            "16",
            "--out",
            "r",
        ],
        at,
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(at.join("r/index.html").is_file());
}
