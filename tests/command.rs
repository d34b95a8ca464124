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
        &[
            "reproduce",
            "--out",
            "r",
            "--materials",
            "none.toml",
            "--write",
            "file",
        ],
        &["none.toml"],
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
/// What is too much, too little or nothing at all is refused at once, by a sentence, and leaves nothing.
#[test]
fn bad_amounts_get_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("a.pfm"), pfm(2.0)).unwrap();
    std::fs::write(at.join("flat.pfm"), pfm(1.0)).unwrap();
    std::fs::write(at.join("nan.pfm"), pfm(f32::NAN)).unwrap();
    std::fs::write(at.join("empty.png"), b"").unwrap();
    std::fs::write(at.join("text.png"), b"text").unwrap();
    let set = |name: &str, text: &str| std::fs::write(at.join(name), text).unwrap();
    set("huge.toml", "size = 1000000000\nlights = ['a.pfm']\n");
    set("nan.toml", "size = 8\nlights = ['a.pfm', 'nan.pfm']\n");
    for (arguments, words) in [
        (
            &["spectrum", "a.pfm", "--degree", "0"][..],
            &["degree", "at least 4"][..],
        ),
        (
            &["spectrum", "a.pfm", "--degree", "3"],
            &["degree", "at least 4"],
        ),
        (&["spectrum", "flat.pfm"], &["uniform"]),
        (
            &["render", "--light", "a.pfm", "--tolerance", "-1"],
            &["tolerance", "-1"],
        ),
        (
            &["render", "--light", "a.pfm", "--distance", "-2"],
            &["distance", "-2"],
        ),
        (
            &["render", "--set", "huge.toml", "--out", "s"],
            &["1000000000", "16384"],
        ),
        (
            &["render", "--set", "nan.toml", "--out", "s"],
            &["nan.pfm", "NaN"],
        ),
        (&["classify", "empty.png"], &["empty.png", "empty"]),
        (&["classify", "text.png"], &["text.png", "PNG, JPEG"]),
        (&["classify", "none.png"], &["none.png", "cannot be read"]),
    ] {
        fails(at, arguments, words);
    }
    // What the command line itself cannot mean: exit code 2, and the usage after the sentence.
    for (arguments, words) in [
        (&["spectrum", "a.pfm", "--jobs", "0"][..], "from 1 to 1024"),
        (&["spectrum", "a.pfm", "--jobs", "100000"], "from 1 to 1024"),
        (
            &["classify", "a.pfm", "--turns", "99999999999"],
            "from 1 to 1024",
        ),
        (&["reproduce", "--turns", "0"], "from 1 to 1024"),
        (&["classify", "a.pfm", "--circle", "-5,5"], "three numbers"),
    ] {
        let output = lobes(arguments, at);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains(words), "{arguments:?}: {message}");
    }
    let output = lobes(&["classify", "text.png", "--circle", "-5,5,20"], at);
    assert_eq!(output.status.code(), Some(1));
}

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
    std::fs::write(
        at.join("table.md"),
        "before\n<!-- table -->\nold\n<!-- end of table -->\nafter",
    )
    .unwrap();
    let output = lobes(
        &[
            "reproduce",
            "--illuminations",
            "maps",
            "--size",
            "32",
            "--turns",
            "1",
            "--protocol",
            "blind",
            "--protocol",
            "photograph",
            "--classifier",
            "paper",
            "--classifier",
            "needlets-discriminant",
            "--write",
            "table.md",
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
    let written = std::fs::read_to_string(at.join("table.md")).unwrap();
    assert!(written.starts_with("before") && written.ends_with("after"));
    assert!(
        written.contains("| blind | paper |")
            && written.contains("| photograph | needlets-discriminant |")
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

/// Debevec's probes are square angular maps, which a mirror ball could be too: the user says which. A cross among them is known by its shape.
#[test]
fn a_folder_of_angular_maps_and_crosses_works() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("probes")).unwrap();
    for (name, width, rgbe) in [
        ("a", 96, [90, 120, 160, 129]),
        ("b", 96, [160, 90, 70, 130]),
        ("cross", 72, [120, 110, 90, 129]),
    ] {
        std::fs::write(at.join(format!("probes/{name}.hdr")), hdr(width, 96, rgbe)).unwrap();
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
            "--json",
        ],
        at,
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let written = std::fs::read(at.join("r/accuracy.json")).unwrap();
    assert_eq!(
        said,
        serde_json::from_slice::<serde_json::Value>(&written).unwrap()
    );
    let names = &said["settings"]["illuminations"];
    assert_eq!(*names, serde_json::json!(["a", "b", "cross"]));
    assert!(at.join("r/index.html").is_file());
}

/// Three small maps in a folder, and the arguments that make `classify` learn from them and keep nothing elsewhere.
fn classify(at: &Path, arguments: &[&str]) -> Output {
    let maps = at.join("maps");
    if !maps.is_dir() {
        std::fs::create_dir(&maps).unwrap();
        for (name, rgbe) in [
            ("a", [90, 120, 160, 129]),
            ("b", [160, 90, 70, 130]),
            ("c", [100, 140, 60, 128]),
        ] {
            std::fs::write(maps.join(format!("{name}.hdr")), hdr(64, 32, rgbe)).unwrap();
        }
    }
    let mut all = vec!["classify", "--illuminations", "maps", "--turns", "1"];
    all.extend(arguments);
    Command::new(env!("CARGO_BIN_EXE_lobes"))
        .args(all)
        .current_dir(at)
        .env("XDG_CACHE_HOME", at.join("cache"))
        .output()
        .expect("the command runs")
}

/// Spheres that `render` makes are read back: by their transparency, by the circle, and found; with colour and without.
#[test]
fn classify_reads_rendered_spheres() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // Makes the maps.
    assert!(!classify(at, &["none.png"]).status.success());
    for material in ["silver", "black plastic"] {
        let output = lobes(
            &[
                "render",
                "--light",
                "maps/a.hdr",
                "--material",
                material,
                "--size",
                "96",
            ],
            at,
        );
        assert!(output.status.success());
    }
    let output = classify(at, &["spheres", "--json", "--report"]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let lines: Vec<serde_json::Value> = said
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines.len(), 4, "two materials as PNG and as EXR: {said}");
    for line in &lines {
        let file = line["file"].as_str().unwrap();
        let named = line["probabilities"].as_object().unwrap().values();
        let total: f64 = named.map(|p| p.as_f64().unwrap()).sum();
        assert!((total + line["none"].as_f64().unwrap() - 1.0).abs() < 1e-9);
        let (low, high) = (&line["sigma"]["low"], &line["sigma"]["high"]);
        assert!(low.as_f64() < high.as_f64());
        let radius = line["circle"][2].as_f64().unwrap();
        assert!((radius - 48.0).abs() < 0.5, "{file}: {}", line["circle"]);
        assert_eq!(
            line["found"],
            file.ends_with(".exr"),
            "a PNG is transparent"
        );
    }
    let page = std::fs::read_to_string(at.join("classified/index.html")).unwrap();
    for source in page.split("src=\"").skip(1) {
        let path = source.split('"').next().unwrap();
        assert!(
            at.join("classified").join(path).is_file(),
            "{path} is missing"
        );
    }
    // What was learned is kept, and gives the same answer.
    assert_eq!(
        std::fs::read_dir(at.join("cache/lobes")).unwrap().count(),
        1
    );
    let again = classify(at, &["spheres", "--json"]);
    assert_eq!(String::from_utf8_lossy(&again.stdout), said);
    // A circle by hand.
    let output = classify(at, &["spheres/silver.exr", "--circle", "48,48,47.5"]);
    assert!(output.status.success());
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("silver") && !said.contains("found"), "{said}");
}

/// A picture that cannot be read is reported, the others are done, and the exit code says so.
#[test]
fn classify_says_what_is_wrong_and_does_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    assert!(!classify(at, &["none.png"]).status.success());
    let png = |name: &str, pixel: &dyn Fn(usize, usize) -> [f64; 3]| {
        let bytes = lobes::report::encode_png(96, 96, 1.0, |y, x| Some(pixel(x, y))).unwrap();
        std::fs::write(at.join(name), bytes).unwrap();
    };
    let ball = |x: usize, y: usize| {
        let (u, v) = ((x as f64 - 47.5) / 36.0, (y as f64 - 47.5) / 36.0);
        let square = u * u + v * v;
        if square < 1.0 {
            [0.05 + 0.6 * ((1.0 - square).sqrt() - v).max(0.0) * 0.5; 3]
        } else {
            [0.9; 3]
        }
    };
    std::fs::create_dir(at.join("pictures")).unwrap();
    png("pictures/1.png", &ball);
    let whole = std::fs::read(at.join("pictures/1.png")).unwrap();
    std::fs::write(at.join("pictures/2.png"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(at.join("pictures/3.jpg"), b"\xff\xd8\xff nonsense").unwrap();
    std::fs::write(at.join("pictures/4.exr"), b"neither").unwrap();
    png("pictures/5.png", &|x, y| ball(x, y).map(|v| 0.9 * v));
    let output = classify(at, &["pictures"]);
    assert!(!output.status.success());
    let (said, message) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert_eq!(said.lines().count(), 2, "{said}");
    assert!(said.contains("1.png") && said.contains("5.png") && said.contains("without colour"));
    for word in ["2.png", "3.jpg", "4.exr", "3 of 5"] {
        assert!(message.contains(word), "no {word} in {message}");
    }
    let output = classify(at, &["pictures", "--json"]);
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(lines.lines().count(), 5);
    assert_eq!(lines.matches("\"error\"").count(), 3);

    // One picture and one sentence each.
    png("flat.png", &|_, _| [0.4; 3]);
    png("white.png", &|_, _| [1.0; 3]);
    png("black.png", &|_, _| [0.0; 3]);
    for (arguments, words) in [
        (vec!["flat.png"], vec!["flat.png", "no sphere", "--circle"]),
        (
            vec!["white.png", "--circle", "48,48,40"],
            vec!["white.png", "saturated"],
        ),
        (
            vec!["black.png", "--circle", "48,48,40"],
            vec!["black.png", "black"],
        ),
        (
            vec!["flat.png", "--circle", "48,48,60"],
            vec!["flat.png", "leaves the picture"],
        ),
        (
            vec!["flat.png", "--circle", "48,48,3"],
            vec!["flat.png", "too small"],
        ),
        (vec!["none.png"], vec!["none.png", "cannot be read"]),
        (vec!["maps", "--materials", "none.toml"], vec!["none.toml"]),
    ] {
        let output = classify(at, &arguments);
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{arguments:?}");
        for word in words {
            assert!(
                message.contains(word),
                "{arguments:?}: no {word:?} in {message}"
            );
        }
    }
    std::fs::create_dir(at.join("empty")).unwrap();
    let output = classify(at, &["empty"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("holds no picture"));
}
