//! The command as a user meets it: what it writes, and what it says of bad input.
use std::path::Path;
use std::process::{Command, Output};

use lobes::reflectance::presets;

/// Runs the command with a file as its standard input.
fn lobes_reading(arguments: &[&str], folder: &Path, file: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lobes"))
        .args(arguments)
        .current_dir(folder)
        .stdin(std::fs::File::open(file).unwrap())
        .output()
        .expect("the command runs")
}

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
        // Coarse patches that differ with the radiance: light of another place, not the same one
        // brighter.
        let (u, v) = (pixel % width * 8 / width, pixel / width * 8 / height);
        let patch = (u * 7919 + v * 104_729 + usize::from(rgbe[0]) * 31_337) * 2_654_435_761;
        value[1] = value[1].wrapping_add((patch % 4_294_967_296 / 67_108_864) as u8);
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

/// What is too much, too little or nothing at all is refused at once, by a sentence, and leaves
/// nothing.
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
    set("ggx.toml", GOLD);
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
            &["render", "--light", "a.pfm", "--ior", "1.5"],
            &["--ior", "--lobe ggx"],
        ),
        (
            &[
                "render", "--light", "a.pfm", "--lobe", "ggx", "--ior", "1.5,1.6",
            ],
            &["--ior", "one, or one each"],
        ),
        (
            &[
                "render", "--light", "a.pfm", "--lobe", "ggx", "--ior", "0.5",
            ],
            &["0.5", "[1, 100]"],
        ),
        (
            &[
                "render",
                "--light",
                "a.pfm",
                "--bound",
                "--tolerance",
                "1e-12",
            ],
            &["tolerance", "1e-9"],
        ),
        (
            &["reproduce", "--materials", "ggx.toml", "--out", "r"],
            &["\"gold\"", "lobes render"],
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
        (
            &["render", "--light", "a.pfm", "--metal", "1.5"][..],
            "n+ki",
        ),
        (&["spectrum", "a.pfm", "--jobs", "0"], "from 1 to 1024"),
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

/// The table that people read, of the light in the library.
#[test]
fn the_table_of_the_built_in_light() {
    let folder = tempfile::tempdir().unwrap();
    let output = lobes(&["spectrum", "--plot", "s.svg"], folder.path());
    assert!(output.status.success());
    let plot = std::fs::read_to_string(folder.path().join("s.svg")).unwrap();
    assert!(plot.contains("<svg") && plot.contains("median"));
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
    assert_page_is_whole(&page, &at.join("r"));
    // Every material has its name in the plane, its sphere, and what it was called; every statement
    // of the paper its row.
    for material in presets() {
        assert!(page.contains(&format!("<b>{}</b>", material.name())));
    }
    assert_eq!(page.matches("data-heading=\"verdict\"").count(), 9);
    // The columns that say the same in every row are said once.
    assert!(page.contains("in every row: protocol paper"));
}

/// Nothing is asked of the network but by a link that is clicked, there is no script, and what is
/// linked or shown is there.
fn assert_page_is_whole(page: &str, folder: &Path) {
    let addresses = page.matches("http").count();
    let clicked = page.matches("<a href=\"http").count();
    let names = page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count();
    assert_eq!(
        addresses,
        clicked + names,
        "the page asks the network for something"
    );
    assert!(!page.contains("<script") && !page.contains("@import") && !page.contains("url("));
    for start in ["src=\"", "href=\""] {
        for rest in page.split(start).skip(1) {
            let path = rest.split('"').next().unwrap();
            if path.starts_with("http") || path.starts_with("data:") {
                continue;
            }
            match path.strip_prefix('#') {
                Some(name) => assert!(page.contains(&format!("id=\"{name}\"")), "#{name}"),
                None => assert!(folder.join(path).is_file(), "{path} is missing"),
            }
        }
    }
}

/// Debevec's probes are square angular maps, which a mirror ball could be too: the user says which.
/// A cross among them is known by its shape.
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

/// Three small maps in a folder, and the arguments that make `classify` learn from them and keep
/// nothing elsewhere.
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

/// A metal of GGX facets as a file of materials has it: gold at 650, 550 and 450 nm.
const GOLD: &str = "[[material]]\nname = 'gold'\nkind = 'ggx'\nalpha = 0.3\n\
    index = [0.168, 0.35, 1.508]\nextinction = [3.138, 2.714, 1.879]\n";

/// GGX's facets, given by options or by a file, come with a bound of every pixel, and Ward's lobes
/// where it is asked for.
#[test]
fn render_proves_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("a.pfm"), pfm(2.0)).unwrap();
    std::fs::write(at.join("ggx.toml"), GOLD).unwrap();
    let small = ["render", "--json", "--light", "a.pfm", "--size", "8"];
    let coarse = ["--tolerance", "0.01", "--out"];
    let metal = "0.168+3.138i,0.35+2.714i,1.508+1.879i";
    let mut seen = Vec::new();
    for (out, name, more) in [
        ("file", "gold", &["--materials", "ggx.toml"][..]),
        (
            "option",
            "old gold",
            &["--lobe", "ggx", "--metal", metal, "--material", "old gold"],
        ),
        (
            "glass",
            "black plastic",
            &[
                "--lobe",
                "ggx",
                "--ior",
                "1.5",
                "--material",
                "black plastic",
            ],
        ),
        (
            "ward",
            "old gold",
            &["--lobe", "gmd", "--bound", "--material", "old gold"],
        ),
    ] {
        let output = lobes(&[&small, more, &coarse, &[out]].concat(), at);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{message}");
        let line: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(line["material"], name);
        let bound = line["bound"].as_f64().unwrap();
        assert!(bound > 0.0 && bound <= 0.01, "{bound}");
        let read = |key: &str| {
            let path = at.join(line[key].as_str().unwrap());
            lobes::picture::Picture::read(&path).unwrap()
        };
        let (picture, bounds) = (read("exr"), read("bounds"));
        let (value, off) = (picture.get(4, 4).unwrap(), bounds.get(4, 4).unwrap());
        assert!(
            off[0] > 0.0 && off[0] <= 0.0101 * value[1],
            "{value:?}, {off:?}"
        );
        seen.push(value);
    }
    // Gold reflects more red than blue, and in even light what its albedo is.
    assert!(seen[0][0] > 1.3 * seen[0][2], "{:?}", seen[0]);
    assert!(seen[2][0] < 0.3 * seen[0][0], "{seen:?}");
}

/// Spheres that `render` makes are read back: by their transparency, by the circle, and found; with
/// colour and without.
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
        let names = &line["names"];
        for (all, none) in [
            (&names["probabilities"], &names["none"]),
            (&line["finishes"], &line["no_single_finish"]),
        ] {
            let of = all.as_object().unwrap().values();
            let total: f64 = of.map(|p| p.as_f64().unwrap()).sum();
            assert!((total + none.as_f64().unwrap() - 1.0).abs() < 1e-9);
        }
        for of in [
            &names["sigma"],
            &names["share"],
            &line["sigma"],
            &line["share"],
        ] {
            assert!(of["low"].as_f64() < of["high"].as_f64());
        }
        let radius = line["circle"][2].as_f64().unwrap();
        assert!((radius - 48.0).abs() < 0.5, "{file}: {}", line["circle"]);
        assert_eq!(
            line["found"],
            file.ends_with(".exr"),
            "a PNG is transparent"
        );
    }
    let page = std::fs::read_to_string(at.join("classified/index.html")).unwrap();
    assert_page_is_whole(&page, &at.join("classified"));
    assert!(
        page.contains("All pictures"),
        "four pictures have a summary"
    );
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

/// Without a question for names nothing is learned: the answer is the finish and its numbers, and
/// the likeliest material for other programs.
#[test]
fn classify_tells_the_finish() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for material in ["silver", "brown matte"] {
        let all = [
            "render",
            "--light",
            "pmndrs-city",
            "--material",
            material,
            "--elevation",
            "20",
        ];
        assert!(lobes(&all, at).status.success());
    }
    let output = lobes(
        &["classify", "spheres", "--json", "--pbr", "balls.gltf"],
        at,
    );
    let said = String::from_utf8_lossy(&output.stdout);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let lines: Vec<serde_json::Value> = said
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines.len(), 4, "two materials as PNG and as EXR: {said}");
    for line in &lines {
        let mirror = line["file"].as_str().unwrap().contains("silver");
        let finish = if mirror { "smooth metal" } else { "matte" };
        assert_eq!(line["finish"], finish, "{line}");
        assert_eq!(line["names"], serde_json::Value::Null);
        let metallic = line["metallic"].as_f64().unwrap();
        assert_eq!(metallic > 0.5, mirror, "{metallic}");
        for end in ["low", "median", "high"] {
            assert_eq!(line["base_colour"][end].as_array().unwrap().len(), 3);
        }
    }
    let written = std::fs::read_to_string(at.join("balls.gltf")).unwrap();
    let written: serde_json::Value = serde_json::from_str(&written).unwrap();
    assert_eq!(written["materials"].as_array().unwrap().len(), 4);
    let output = lobes(&["classify", "spheres"], at);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        said.ends_with("4 pictures: 2 matte, 2 smooth metal\n"),
        "{said}"
    );
    assert!(
        said.contains("σ ") && said.contains("base colour"),
        "{said}"
    );
    let output = lobes(&["classify", "spheres", "--pbr", "balls.blend"], at);
    assert_eq!(output.status.code(), Some(2));
}

/// The light that is read off a picture is like the map that it was rendered under, up to the
/// exposure, where the ball mirrors it.
#[test]
fn classify_reads_the_light() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let render = ["render", "--light", "pmndrs-city", "--material", "silver"];
    assert!(lobes(&render, at).status.success());
    let read = ["classify", "spheres/silver.png", "--light", "light.exr"];
    let output = lobes(&[&read[..], &["--report"]].concat(), at);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let map = |name: &str| lobes::illumination::read(&at.join(name), None).unwrap();
    let (mean, deviation) = (map("light.exr"), map("light-deviation.exr"));
    for map in [&mean, &deviation] {
        assert_eq!((map.width(), map.height()), (256, 128));
    }
    // The page has the light, its deviation, the ball again and what is left over in itself; of a
    // clean picture of a mirror little is.
    let page = std::fs::read_to_string(at.join("classified/index.html")).unwrap();
    assert_eq!(page.matches("src=\"data:image/png;base64,").count(), 4);
    let left = page.split("Left over: ").nth(1).unwrap();
    let left: f64 = left.split(' ').next().unwrap().parse().unwrap();
    assert!((0.0..5.0).contains(&left), "{left}");
    for words in [
        "The light about it",
        "base colour, red",
        "Its standard deviation",
    ] {
        assert!(page.contains(words), "{words}");
    }
    assert!(
        deviation
            .pixels()
            .as_flattened()
            .iter()
            .all(|value| *value > 0.0)
    );
    let maps = lobes::illumination::builtin().unwrap();
    let truth = maps.iter().find(|map| map.name() == "pmndrs-city").unwrap();
    // The camera stands at +z, so that the map's frame is the camera's.
    let (truth, mean) = (
        truth.resampled(64, 32).unwrap(),
        mean.resampled(64, 32).unwrap(),
    );
    let mut roots = [const { Vec::new() }; 2];
    for row in 0..32 {
        for column in 0..64 {
            let direction = mean.direction(row, column);
            let area = f64::from(u8::from(direction.z > -0.8)) * direction.x.hypot(direction.z);
            if area > 0.0 {
                let place = 64 * row + column;
                for (roots, map) in roots.iter_mut().zip([&truth, &mean]) {
                    roots.push((area, map.pixels()[place][1].cbrt()));
                }
            }
        }
    }
    let [truth, found] = &roots;
    let whole: f64 = truth.iter().map(|(area, _)| area).sum();
    let mean = |of: &[(f64, f64)]| of.iter().map(|(area, root)| area * root).sum::<f64>() / whole;
    let (centre, other) = (mean(truth), mean(found));
    let moment = |a: &[(f64, f64)], a_mean: f64, b: &[(f64, f64)], b_mean: f64| {
        let products = a
            .iter()
            .zip(b)
            .map(|(a, b)| a.0 * (a.1 - a_mean) * (b.1 - b_mean));
        products.sum::<f64>()
    };
    let correlation = moment(truth, centre, found, other)
        / (moment(truth, centre, truth, centre) * moment(found, other, found, other)).sqrt();
    assert!(correlation > 0.9, "{correlation}");
}

/// Two balls before a wall: without `--all` the one that is seen best, and that there is another; with it
/// both. What is pressed to an ellipse is said to be one.
#[test]
fn classify_reads_every_ball() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for material in ["silver", "brown matte"] {
        let all = ["render", "--light", "pmndrs-city", "--material", material];
        assert!(lobes(&all, at).status.success());
    }
    let [silver, brown] = ["silver", "brown-matte"].map(|name| {
        lobes::picture::Picture::read(&at.join(format!("spheres/{name}.exr"))).unwrap()
    });
    let (width, height) = (320, 180);
    let wall = |row: usize, column: usize| [0.3 + 0.1 * ((row / 20 + column / 20) % 2) as f64; 3];
    let shown = |row: usize, column: usize| {
        for (ball, left, top) in [(&silver, 20, 30), (&brown, 172, 26)] {
            let inside = row.checked_sub(top).zip(column.checked_sub(left));
            let seen = inside.and_then(|(row, column)| ball.get(row, column));
            // What is black about a rendered sphere is nothing.
            if let Some(rgb) = seen.filter(|rgb| rgb.iter().any(|value| *value > 0.0)) {
                return Some(rgb.map(|value| 0.4 * value));
            }
        }
        Some(wall(row, column))
    };
    let png = lobes::picture::encode_png(width, height, 1.0, shown).unwrap();
    std::fs::write(at.join("table.png"), png).unwrap();
    let said = |arguments: &[&str]| {
        let output = lobes(&[&["classify"], arguments].concat(), at);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{message}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let one = said(&["table.png"]);
    assert!(one.contains("--all") && one.lines().count() == 1, "{one}");
    let both = said(&["table.png", "--all", "--json"]);
    let lines: Vec<serde_json::Value> = both
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let mut centres: Vec<f64> = Vec::new();
    for (line, number) in lines.iter().zip(1..) {
        assert_eq!((&line["ball"], &line["balls"]), (&number.into(), &2.into()));
        centres.push(line["circle"][0].as_f64().unwrap());
    }
    centres.sort_by(f64::total_cmp);
    assert_eq!(centres.len(), 2, "{both}");
    assert!((centres[0] - 84.0).abs() < 3.0 && (centres[1] - 236.0).abs() < 3.0);
    let text = said(&["table.png", "--all"]);
    assert!(
        text.contains("ball 2 of 2") && text.contains("2 balls: "),
        "{text}"
    );
    let refused = lobes(
        &["classify", "table.png", "--all", "--circle", "84,94,64"],
        at,
    );
    assert_eq!(refused.status.code(), Some(2));

    let pressed = |row: usize, column: usize| shown(row * 10 / 9, column);
    let png = lobes::picture::encode_png(160, height * 9 / 10, 1.0, pressed).unwrap();
    std::fs::write(at.join("pressed.png"), png).unwrap();
    let long = said(&["pressed.png", "--circle", "84,84.6,60.7"]);
    assert!(long.contains("% longer than wide"), "{long}");
}

/// A band across a ball is a print: it is said, in JSON and on the page too.
#[test]
fn classify_says_how_much_of_a_ball_is_usable() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let write = |name: &str, banded: bool| {
        let shown = |row: usize, column: usize| {
            let (x, y) = (column as f64 - 79.5, row as f64 - 79.5);
            let shade = 0.4 - 0.002 * y + 0.001 * x;
            Some(match x.hypot(y) < 60.0 {
                false => [0.02; 3],
                true if banded && (-6.0..6.0).contains(&y) => [0.05, 0.05, 0.5 * shade],
                true => [shade, 0.3 * shade, 0.1 * shade],
            })
        };
        let png = lobes::picture::encode_png(160, 160, 1.0, shown).unwrap();
        std::fs::write(at.join(name), png).unwrap();
    };
    write("plain.png", false);
    write("banded.png", true);
    let all = [
        "classify",
        "plain.png",
        "banded.png",
        "--circle",
        "80,80,60",
    ];
    let output = lobes(&[&all[..], &["--json", "--report"]].concat(), at);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<serde_json::Value> = said
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let number = |line: usize, key: &str| lines[line][key].as_f64().unwrap();
    assert!(
        number(0, "usable") > 0.99 && number(0, "prints") < 0.01,
        "{said}"
    );
    // A tenth of the height, in the middle of a disc: 4/π · 0.1 over 0.93, that far out being looked at.
    assert!((number(1, "prints") - 0.137).abs() < 0.04, "{said}");
    assert!((number(1, "usable") + number(1, "prints") - 1.0).abs() < 1e-9);
    let page = std::fs::read_to_string(at.join("classified/index.html")).unwrap();
    assert_page_is_whole(&page, &at.join("classified"));
    assert!(page.contains("red is a print"), "{page}");
    let text = lobes(&all, at);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert_eq!(text.matches("of the ball is usable").count(), 1, "{text}");
}

/// A picture that cannot be read is reported, the others are done, and the exit code says so.
#[test]
fn classify_says_what_is_wrong_and_does_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    assert!(!classify(at, &["none.png"]).status.success());
    let png = |name: &str, pixel: &dyn Fn(usize, usize) -> [f64; 3]| {
        let bytes = lobes::picture::encode_png(96, 96, 1.0, |y, x| Some(pixel(x, y))).unwrap();
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
    // Two answers, and what came of all.
    assert_eq!(said.lines().count(), 3, "{said}");
    assert!(
        said.ends_with("5 pictures: 2 none of these, 3 not read\n"),
        "{said}"
    );
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

/// A plot is written where it is asked for, as what its name says, and nothing else is written.
#[test]
fn plots_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("a.pfm"), scene(1, 32)).unwrap();
    let before = entries(at);
    for flags in [&[][..], &["--quiet", "--json"]] {
        let arguments = [&["spectrum", "a.pfm", "--degree", "7"], flags].concat();
        assert!(lobes(&arguments, at).status.success());
        assert_eq!(entries(at), before, "{arguments:?} wrote something");
    }
    for name in ["x.png", "x", "x.svg.gz"] {
        let output = lobes(&["spectrum", "a.pfm", "--plot", name], at);
        assert_eq!(output.status.code(), Some(2), "{name}");
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains("ends in .svg"), "{message}");
        assert_eq!(entries(at), before);
    }
    let output = lobes(
        &["spectrum", "a.pfm", "--degree", "7", "--plot", "x.SVG"],
        at,
    );
    assert!(output.status.success());
    let plot = std::fs::read_to_string(at.join("x.SVG")).unwrap();
    assert!(!plot.contains("median"), "one map has no median");
}

#[test]
fn lists_of_names() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (what, key, count) in [
        ("lights", "light", 17),
        ("materials", "material", 8),
        ("lobes", "lobe", 4),
    ] {
        let table = lobes(&["list", what], at);
        let table = String::from_utf8(table.stdout).unwrap();
        let json = lobes(&["list", what, "--json"], at);
        let json = String::from_utf8(json.stdout).unwrap();
        assert_eq!(json.lines().count(), count);
        for line in json.lines() {
            let value: serde_json::Value = serde_json::from_str(line).unwrap();
            assert!(table.contains(value[key].as_str().unwrap()), "{line}");
        }
        assert_eq!(table.lines().count(), count + 1, "{table}");
    }
    let lobe = lobes(&["list", "lobes", "--json"], at);
    let lobe = String::from_utf8(lobe.stdout).unwrap();
    assert_eq!(lobe.matches("\"default\":true").count(), 1);
    // What is listed is taken.
    let some = [
        "list",
        "materials",
        "--material",
        "silver",
        "--material",
        "black plastic",
        "--json",
    ];
    let some = String::from_utf8(lobes(&some, at).stdout).unwrap();
    let names: Vec<String> = some
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap())
        .map(|value| value["material"].as_str().unwrap().to_owned())
        .collect();
    assert_eq!(names, ["silver", "black plastic"]);
}

/// Names that nothing has are answered with those that there are, the nearest first, and shells
/// complete them.
#[test]
fn names_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let light = ["render", "--light", "blender-city", "--material"];
    fails(
        at,
        &[&light[..], &["silvr"]].concat(),
        &["no material \"silvr\"; the names are silver, "],
    );
    fails(
        at,
        &["render", "--light", "blender-citty"],
        &["blender-citty", "maps are blender-city, "],
    );
    for (arguments, words) in [
        (
            &["reproduce", "--protocol", "blnd"][..],
            &[
                "paper",
                "blind",
                "tilted",
                "photograph",
                "continuous",
                "files",
                "all",
            ][..],
        ),
        (
            &["fit", "a.csv", "--lobe", "ward"],
            &["ward1992", "duer", "gmd", "sampled"],
        ),
        (
            &["spectrum", "--mapping", "cube"],
            &["lat-long", "angular-map", "mirror-ball", "vertical-cross"],
        ),
        (
            &["reproduce", "--classifier", "best"],
            &["paper", "combined", "dror-nearest"],
        ),
    ] {
        let output = lobes(arguments, at);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let message = String::from_utf8_lossy(&output.stderr);
        for word in words {
            assert!(message.contains(word), "no {word} in {message}");
        }
    }
    for shell in ["bash", "zsh", "fish"] {
        let script = String::from_utf8(lobes(&["completions", shell], at).stdout).unwrap();
        for word in [
            "blender-city",
            "black plastic",
            "sampled",
            "photograph",
            "log-bands",
            "mirror-ball",
        ] {
            let plain = script.replace('\\', "");
            assert!(plain.contains(word), "{shell} does not complete {word}");
        }
    }
}

/// What comes through a pipe is read as a file is, whatever it is.
#[test]
fn standard_input() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("a.pfm"), scene(1, 32)).unwrap();
    std::fs::write(at.join("a.hdr"), hdr(64, 32, GREY)).unwrap();
    for (file, name) in [("a.pfm", "a"), ("a.hdr", "a")] {
        let piped = lobes_reading(&["spectrum", "-", "--json"], at, &at.join(file));
        let opened = lobes(&["spectrum", file, "--json"], at);
        let line = |output: Output| -> serde_json::Value {
            assert!(output.status.success());
            serde_json::from_slice(&output.stdout).unwrap()
        };
        let (piped, opened) = (line(piped), line(opened));
        assert_eq!(opened["map"], name);
        assert_eq!(piped["map"], "standard input");
        assert_eq!(piped["luminance"], opened["luminance"]);
    }
    let silver = ["--material", "silver", "--size", "96", "--tolerance", "0.1"];
    let render = [&["render", "--light", "-", "--out", "s"], &silver[..]].concat();
    let output = lobes_reading(&render, at, &at.join("a.hdr"));
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(at.join("s/silver.png").is_file());
    // Bad bytes, and none, are one sentence.
    std::fs::write(at.join("text"), "text").unwrap();
    std::fs::write(at.join("empty"), "").unwrap();
    for verb in [
        &["spectrum", "-"][..],
        &["render", "--light", "-"],
        &["classify", "-"],
        &["fit", "-"],
    ] {
        for file in ["text", "empty"] {
            let output = lobes_reading(verb, at, &at.join(file));
            assert_eq!(output.status.code(), Some(1), "{verb:?} {file}");
            let message = String::from_utf8_lossy(&output.stderr);
            assert_eq!(message.lines().count(), 1, "{message}");
            assert!(message.contains("standard input"), "{message}");
        }
    }
    assert!(!at.join("spheres").exists());
    let mut table = "theta_i,phi_i,theta_o,phi_o,value\n".to_owned();
    for degrees in (0..85).step_by(5) {
        for other in (0..85).step_by(5) {
            let off = f64::from(degrees - other);
            let value = 0.1 + 0.5 * (-off * off / 50.0).exp();
            table.push_str(&format!("{degrees},0,{other},180,{value}\n"));
        }
    }
    std::fs::write(at.join("a.csv"), table).unwrap();
    let piped = lobes_reading(&["fit", "-"], at, &at.join("a.csv"));
    let opened = lobes(&["fit", "a.csv"], at);
    assert!(piped.status.success() && !piped.stdout.is_empty());
    assert_eq!(piped.stdout, opened.stdout);
}

/// One bad file of many is told by name, and the others are done.
#[test]
fn one_bad_file_silences_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("a.pfm"), scene(1, 32)).unwrap();
    std::fs::write(at.join("b.pfm"), pfm(f32::NAN)).unwrap();
    std::fs::write(at.join("c.pfm"), pfm(1.0)).unwrap();
    std::fs::write(at.join("d.pfm"), scene(2, 32)).unwrap();
    let files = ["spectrum", "a.pfm", "b.pfm", "none.pfm", "c.pfm", "d.pfm"];
    let output = lobes(&files, at);
    assert_eq!(output.status.code(), Some(1));
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.lines().any(|line| line.starts_with(" a ")), "{table}");
    assert!(table.lines().any(|line| line.starts_with(" d ")), "{table}");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    let lines: Vec<&str> = message.lines().collect();
    assert_eq!(lines.len(), 4, "{message}");
    for (line, word) in lines.iter().zip(["b.pfm", "none.pfm", "c.pfm", "3 of 5"]) {
        assert!(line.contains(word), "{line}");
    }
    let json = lobes(&[&files[..], &["--json"]].concat(), at);
    assert_eq!(String::from_utf8_lossy(&json.stdout).lines().count(), 5);
    // A degree that a map does not carry is said, with both.
    let output = lobes(&["spectrum", "a.pfm", "--degree", "500"], at);
    assert!(output.status.success());
    let message = String::from_utf8_lossy(&output.stderr);
    for word in ["a.pfm", "500", " 15,"] {
        assert!(message.contains(word), "{message}");
    }
}

/// No two materials are written to one file, nor is one named twice.
#[test]
fn materials_have_names_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let material = |name: &str| {
        format!("[[material]]\nname = {name:?}\nkind = 'plastic'\nreflectance = [0.9, 0.9, 0.9]\n")
    };
    std::fs::write(at.join("slug.toml"), material("a b") + &material("a-b")).unwrap();
    std::fs::write(at.join("twice.toml"), material("a") + &material("a")).unwrap();
    std::fs::write(at.join("set.toml"), "size = 4\nmaterials = 'slug.toml'\n").unwrap();
    let render = ["render", "--light", "blender-city", "--materials"];
    fails(
        at,
        &[&render[..], &["slug.toml"]].concat(),
        &["slug.toml", "\"a b\"", "\"a-b\""],
    );
    fails(
        at,
        &[&render[..], &["twice.toml"]].concat(),
        &["twice.toml", "\"a\""],
    );
    fails(
        at,
        &["render", "--set", "set.toml", "--out", "s"],
        &["\"a b\"", "\"a-b\""],
    );
    // One of the two alone is well.
    let one = [
        &render[..],
        &[
            "slug.toml",
            "--material",
            "a b",
            "--size",
            "8",
            "--out",
            "o",
        ],
    ];
    assert!(lobes(&one.concat(), at).status.success());
}

#[test]
fn missing_snapshots_are_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fails(
        at,
        &["accuracy", "--snapshots", "none"],
        &["none", "snapshots"],
    );
    fails(at, &["accuracy"], &["snapshots"]);
}

/// A map of its own for each seed, which no other looks like.
fn scene(seed: usize, width: usize) -> Vec<u8> {
    let mut bytes = format!("PF\n{width} {}\n-1.0\n", width / 2).into_bytes();
    for i in 0..width * width / 2 {
        // PFM's rows begin at the bottom.
        let (x, y) = (i % width, i / width);
        let (u, v) = (x * 16 / width, y * 16 / width);
        // SplitMix64, so that no seed's map is another's moved along.
        let mut hash = ((seed * 64 + v) * 64 + u) as u64;
        hash = hash.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let value = 0.1 + 4.0 * ((hash ^ (hash >> 31)) as f64 / u64::MAX as f64).powi(3);
        for channel in [1.0, 0.8, 0.6] {
            bytes.extend(((value * channel) as f32).to_le_bytes());
        }
    }
    bytes
}

/// Maps that stand twice: the same pixels are refused, the same light is left out together, and so
/// is what a file says.
#[test]
fn maps_of_one_place() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let maps = at.join("maps");
    std::fs::create_dir(&maps).unwrap();
    for seed in 0..4 {
        std::fs::write(maps.join(format!("{seed}.pfm")), scene(seed, 64)).unwrap();
    }
    let run = |more: &[&str]| {
        let base = [
            "reproduce",
            "--illuminations",
            "maps",
            "--size",
            "24",
            "--out",
            "r",
            "--json",
        ];
        lobes(&[&base[..], more].concat(), at)
    };
    let together = |output: &Output| -> serde_json::Value {
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{message}");
        let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        said["settings"]["left_out_together"].clone()
    };
    let apart = run(&[]);
    assert_eq!(together(&apart), serde_json::json!([]));
    assert!(apart.stderr.is_empty());
    std::fs::write(
        at.join("groups.toml"),
        "groups = [['1', '3']] # one street\n",
    )
    .unwrap();
    let named = run(&["--groups", "groups.toml"]);
    assert_eq!(together(&named), serde_json::json!([["1", "3"]]));
    // Four times the pixels: another file of the same light.
    std::fs::write(maps.join("large.pfm"), scene(2, 128)).unwrap();
    let alike = run(&[]);
    assert_eq!(together(&alike), serde_json::json!([["2", "large"]]));
    let message = String::from_utf8_lossy(&alike.stderr);
    assert!(
        message.contains("\"2\"") && message.contains("\"large\""),
        "{message}"
    );
    for (text, words) in [
        ("groups = [['1', 'street']]", ["street", "names are"]),
        ("groups = [['1']]", ["fewer than two", "groups ="]),
        ("groups = 7", ["line 1", "groups ="]),
        ("scenes = []", ["line 1", "groups ="]),
    ] {
        std::fs::write(at.join("bad.toml"), text).unwrap();
        let base = [
            "reproduce",
            "--illuminations",
            "maps",
            "--out",
            "q",
            "--groups",
        ];
        fails(
            at,
            &[&base[..], &["bad.toml"]].concat(),
            &[&["bad.toml"], &words[..]].concat(),
        );
    }
    std::fs::write(maps.join("copy.pfm"), scene(1, 64)).unwrap();
    fails(
        at,
        &["reproduce", "--illuminations", "maps", "--out", "q"],
        &["maps", "1.pfm", "copy.pfm", "same pixels"],
    );
}

/// What was learned is kept with a checksum and with what it depends on: nothing else is ever used,
/// and that is said.
#[test]
fn what_is_kept_is_checked() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let picture = lobes::picture::encode_png(48, 48, 1.0, |y, x| {
        let (u, v) = ((x as f64 - 23.5) / 20.0, (y as f64 - 23.5) / 20.0);
        let square = u * u + v * v;
        (square < 1.0).then(|| [0.1 + 0.5 * ((1.0 - square).sqrt() - v).max(0.0); 3])
    });
    std::fs::write(at.join("a.png"), picture.unwrap()).unwrap();
    let kept = || -> Vec<std::path::PathBuf> {
        let files = std::fs::read_dir(at.join("cache/lobes")).unwrap();
        files.map(|file| file.unwrap().path()).collect()
    };
    let first = classify(at, &["a.png"]);
    let message = String::from_utf8_lossy(&first.stderr).into_owned();
    assert!(first.status.success(), "{message}");
    for word in ["once", "kept in", "MB", "learned in"] {
        assert!(message.contains(word), "no {word} in {message}");
    }
    let second = classify(at, &["a.png"]);
    assert_eq!(second.stdout, first.stdout);
    assert!(!String::from_utf8_lossy(&second.stderr).contains("learn"));
    // A bit that has changed is noticed, said, and mended.
    let path = kept().remove(0);
    let whole = std::fs::read(&path).unwrap();
    for damage in [whole.len() / 2, whole.len() - 1, 20] {
        let mut bytes = whole.clone();
        bytes[damage] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        let output = classify(at, &["a.png"]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains("damaged"), "{damage}: {message}");
        assert_eq!(output.stdout, first.stdout);
        assert_eq!(std::fs::read(&path).unwrap(), whole, "made anew as it was");
    }
    // Other materials are another file.
    let output = classify(
        at,
        &[
            "a.png",
            "--material",
            "silver",
            "--material",
            "black plastic",
        ],
    );
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("other materials"), "{message}");
    assert_eq!(kept().len(), 2);
}

/// A PFM map of 32 × 16 with a lamp at a column, all of it times a scale.
fn lamp(column: usize, scale: f32) -> Vec<u8> {
    let mut bytes = b"PF\n32 16\n-1.0\n".to_vec();
    for i in 0..32 * 16 {
        // Rows of a PFM go upwards: row 10 from the bottom is above the horizon.
        let value = if i == 10 * 32 + column { 50.0 } else { 1.0 };
        for _ in 0..3 {
            bytes.extend((scale * value).to_le_bytes());
        }
    }
    bytes
}

/// Two estimates of two scenes: what is printed and written, what is kept, and what has no partner.
#[test]
fn light_is_evaluated_in_folders_and_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for name in ["truth", "good", "bad"] {
        std::fs::create_dir(at.join(name)).unwrap();
    }
    let write = |path: &str, bytes: &[u8]| std::fs::write(at.join(path), bytes).unwrap();
    for (scene, column) in [("a", 8), ("b", 20)] {
        write(&format!("truth/{scene}.pfm"), &lamp(column, 1.0));
        write(&format!("good/{scene}.pfm"), &lamp(column, 1.1));
        write(&format!("bad/{scene}.pfm"), &lamp((column + 8) % 32, 1.0));
    }
    let verb = ["evaluate", "truth", "good", "bad", "--size", "24", "--json"];
    let output = lobes(&verb, at);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let lines: Vec<serde_json::Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines.len(), 6);
    let (good, bad) = (&lines[4], &lines[5]);
    assert_eq!(
        (&good["estimate"], &good["scenes"]),
        (&"good".into(), &2.into())
    );
    let close = |value: &serde_json::Value, expected: f64| {
        let value = value.as_f64().unwrap();
        assert!((value - expected).abs() < 1e-4, "{value} {expected}");
    };
    for ball in ["mirror", "rough metal", "matte"] {
        close(&good["balls"][ball]["relative-rmse"], 0.1);
        close(&good["balls"][ball]["relative-si-rmse"], 0.0);
        assert!(bad["balls"][ball]["relative-rmse"].as_f64().unwrap() > 0.05);
    }
    close(&good["light"]["irradiance"], 0.1);
    close(&good["light"]["exposure"], 1.1f64.log2());
    assert!(bad["light"]["peak-direction"].as_f64().unwrap() > 60.0);
    assert!(
        good["definitions"]["angle"]
            .as_str()
            .unwrap()
            .contains("degrees")
    );
    let csv = std::fs::read_to_string(at.join("evaluated/errors.csv")).unwrap();
    // Two scenes of two estimates: three measures of three balls, and four of the light.
    assert_eq!(csv.lines().count(), 1 + 4 * (9 + 4));
    let page = std::fs::read_to_string(at.join("evaluated/index.html")).unwrap();
    assert!(page.matches("data:image/png;base64,").count() == 4 && !page.contains("http"));
    // What was kept is taken again: a number that no run would make shows that it was.
    let done = at.join("evaluated/done");
    let kept: Vec<_> = std::fs::read_dir(&done)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    assert_eq!(kept.len(), 4);
    let text = r#"{"balls":[[7,7,7],[7,7,7],[7,7,7]],"light":[7,7,7,7]}"#;
    kept.iter()
        .for_each(|path| std::fs::write(path, text).unwrap());
    let again = lobes(&verb, at);
    assert!(
        String::from_utf8(again.stdout)
            .unwrap()
            .contains("\"relative-rmse\":7.0")
    );
    let anew = lobes(&[&verb[..], &["--fresh"]].concat(), at);
    assert!(!String::from_utf8(anew.stdout).unwrap().contains(":7.0"));
    // What has no partner is told, and the rest compared.
    write("truth/c.pfm", &lamp(3, 1.0));
    let partly = lobes(
        &[
            "evaluate", "truth", "good", "--size", "24", "--out", "other",
        ],
        at,
    );
    assert_eq!(partly.status.code(), Some(1));
    let said = String::from_utf8_lossy(&partly.stderr).into_owned();
    assert!(
        said.contains("c.pfm: has no estimate of its name in good"),
        "{said}"
    );
    assert!(said.contains("1 of 3 pairs were not compared"), "{said}");
    let said = String::from_utf8_lossy(&partly.stdout).into_owned();
    assert!(said.contains("relative-rmse: root mean square"), "{said}");
}

#[test]
fn what_evaluate_cannot_compare_is_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let write = |path: &str, bytes: &[u8]| std::fs::write(at.join(path), bytes).unwrap();
    write("a.pfm", &lamp(3, 1.0));
    write("black.pfm", &lamp(3, 0.0));
    write("nan.pfm", &lamp(3, f32::NAN));
    write("small.hdr", &hdr(16, 8, [90, 90, 90, 129]));
    write("square.hdr", &hdr(16, 16, [90, 90, 90, 129]));
    std::fs::create_dir(at.join("empty")).unwrap();
    for (estimate, words) in [
        ("black.pfm", &["black.pfm", "every radiance", "0"][..]),
        ("nan.pfm", &["nan.pfm", "NaN"]),
        ("small.hdr", &["32 by 16", "16 by 8", "--rows"]),
        ("square.hdr", &["square.hdr", "--mapping"]),
        ("none.exr", &["none.exr", "cannot be read"]),
        ("empty", &["is a file", "a folder"]),
    ] {
        fails(at, &["evaluate", "a.pfm", estimate, "--size", "8"], words);
    }
    fails(
        at,
        &["evaluate", "empty", "empty"],
        &["empty", "no environment map"],
    );
    fails(
        at,
        &["evaluate", "a.pfm", "a.pfm", "--rows", "5"],
        &["rows", "5"],
    );
    fails(
        at,
        &["evaluate", "a.pfm", "a.pfm", "--size", "0"],
        &["size", "0"],
    );
}

/// A linear picture of a ball that mirrors a bright sky over dark ground, before grey.
fn mirrored(folder: &Path, name: &str, scale: f64) {
    let pixels = (0..120 * 120).map(|i| {
        let (x, y) = ((i % 120) as f64 - 59.5, 59.5 - (i / 120) as f64);
        let off = x.hypot(y) / 50.0;
        // Above the middle a far camera sees the upper half of the world mirrored.
        let value = if off > 1.0 {
            0.4
        } else if y > 0.0 {
            1.6
        } else {
            0.2
        };
        [scale * value, scale * value, 2.0 * scale * value]
    });
    let picture = lobes::files::Picture {
        width: 120,
        height: 120,
        pixels: pixels.collect(),
    };
    lobes::files::write_exr(
        &folder.join(name),
        &picture,
        lobes::files::Precision::Single,
    )
    .unwrap();
}

#[test]
fn a_mirror_ball_becomes_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    mirrored(at, "ball.exr", 0.5);
    let verb = [
        "probe",
        "ball.exr",
        "--circle",
        "60,60,50",
        "--reflectance",
        "0.5",
        "--json",
    ];
    let rest = ["--rows", "16", "--photographer", "20", "--out", "light.exr"];
    let output = lobes(&[&verb[..], &rest[..]].concat(), at);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let line: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&line["rows"], &line["distance"]),
        (&16.into(), &serde_json::Value::Null)
    );
    // The cone of the photographer is (1 − cos 20°)/2 of the sphere; the rim hides some too.
    let seen = line["seen"].as_f64().unwrap();
    assert!((0.85..0.97).contains(&seen), "{seen}");
    let map = lobes::illumination::read(&at.join("light.exr"), None).unwrap();
    let up = map.radiance(lobes::glam::DVec3::Y);
    assert!(
        (up[0] - 1.6).abs() < 1e-3 && (up[2] - 3.2).abs() < 1e-3,
        "{up:?}"
    );
    assert!((map.radiance(lobes::glam::DVec3::NEG_Y)[1] - 0.2).abs() < 1e-3);
    let picture = lobes::picture::Picture::read(&at.join("light.exr")).unwrap();
    assert!(
        picture.mask().unwrap().contains(&0.0),
        "the photographer is transparent"
    );
    // Bad input is one sentence each.
    mirrored(at, "other.exr", 0.1);
    std::fs::write(at.join("not.jpg"), b"no picture").unwrap();
    for (arguments, words) in [
        (
            &["probe", "none.jpg"][..],
            &["none.jpg", "cannot be read"][..],
        ),
        (&["probe", "not.jpg"], &["not.jpg", "none of PNG"]),
        (
            &["probe", "ball.exr", "--exposures", "1,2"],
            &["2 exposures", "1 photographs"],
        ),
        (
            &[
                "probe",
                "ball.exr",
                "--circle",
                "60,60,50",
                "--distance",
                "0.5",
            ],
            &["distance", "0.5"],
        ),
        (
            &["probe", "ball.exr", "--circle", "10,60,50"],
            &["circle", "10.0"],
        ),
        (
            &["probe", "ball.exr", "--circle", "60,60,50", "--rows", "7"],
            &["rows", "7"],
        ),
        (
            &[
                "probe", "ball.exr", "--circle", "60,60,50", "--grey", "20,20,9",
            ],
            &["sun", "saturated"],
        ),
    ] {
        fails(at, arguments, words);
    }
}

/// A matte ellipsoid lit from the upper left, its normals, its mask and that of what faces the
/// camera, as linear files.
fn vase(folder: &Path) {
    const SIDE: usize = 160;
    let [mut normals, mut shown, mut mask, mut part] = [const { Vec::new() }; 4];
    for i in 0..SIDE * SIDE {
        let at = |index: usize| (2 * index + 1) as f64 / SIDE as f64 - 1.0;
        let (x, y) = (at(i % SIDE), -at(i / SIDE));
        let rest = 1.0 - (x / 0.7).powi(2) - (y / 0.9).powi(2);
        let normal = if rest > 0.0 {
            lobes::glam::DVec3::new(x / 0.49, y / 0.81, rest.sqrt() / 0.8).normalize()
        } else {
            lobes::glam::DVec3::ZERO
        };
        let light = normal
            .dot(lobes::glam::DVec3::new(-0.48, 0.6, 0.64))
            .max(0.0);
        normals.push(normal.to_array());
        mask.push([f64::from(u8::from(rest > 0.0)); 3]);
        part.push([f64::from(u8::from(normal.z > 0.75)); 3]);
        shown.push(if rest > 0.0 {
            [0.4, 0.3, 0.2].map(|body| body * (0.3 + light))
        } else {
            [0.9; 3]
        });
    }
    for (name, pixels) in [
        ("normals.exr", normals),
        ("vase.exr", shown),
        ("mask.exr", mask),
        ("part.exr", part),
    ] {
        let picture = lobes::files::Picture {
            width: SIDE,
            height: SIDE,
            pixels,
        };
        let path = folder.join(name);
        lobes::files::write_exr(&path, &picture, lobes::files::Precision::Single).unwrap();
    }
}

#[test]
fn a_shape_is_read_by_its_normals() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    vase(at);
    let verb = ["classify", "vase.exr", "--normals", "normals.exr"];
    let rest = ["--mask", "mask.exr", "--light", "light.exr", "--json"];
    let output = lobes(&[&verb[..], &rest[..]].concat(), at);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let line: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(line["finishes"]["matte"].is_number(), "{line}");
    assert!(line["shape"]["coverage"].as_f64().unwrap() > 0.9, "{line}");
    let told = lobes(&[&verb[..], &["--mask", "mask.exr"]].concat(), at);
    let told = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(told.contains("of the normals that a ball does"), "{told}");
    // The light stands up and to the left of the camera, and its deviation beside it.
    let lit_from_above = |name: &str| {
        let map = lobes::illumination::read(&at.join(name), None).unwrap();
        let up = map.radiance(lobes::glam::DVec3::new(-0.48, 0.6, 0.64));
        let down = map.radiance(lobes::glam::DVec3::new(0.48, -0.6, 0.64));
        assert!(up[1] > down[1], "{name}: {up:?} {down:?}");
    };
    lit_from_above("light.exr");
    assert!(at.join("light-deviation.exr").exists());
    // Of a part of it σ and the light, and no more.
    let part = ["--mask", "part.exr", "--light", "part-light.exr"];
    let output = lobes(&[&verb[..], &part[..]].concat(), at);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success() && said.contains("by evidence alone"),
        "{said}"
    );
    lit_from_above("part-light.exr");
    fails(
        at,
        &[&verb[..], &part[..2], &["--report", "--pbr", "part.gltf"]].concat(),
        &["--pbr or --report", "σ and the light"],
    );
    for (arguments, words) in [
        (
            &["--frame", "opencv"][..],
            &["normals.exr", "another frame"][..],
        ),
        (
            &["--frame", "world", "--towards", "1,0,0"],
            &["another frame"],
        ),
        (&["--frame", "world", "--up", "0,0,1"], &["sideways"]),
        (&["--mask", "small.exr"], &["small.exr", "2 by 1"]),
        (&["--mask", "nothing.exr"], &["shape", "mask"]),
        (&["--mask", "none.exr"], &["none.exr", "cannot be read"]),
    ] {
        for (name, width, height) in [("small.exr", 2, 1), ("nothing.exr", 160, 160)] {
            let picture = lobes::files::Picture {
                width,
                height,
                pixels: vec![[0.0; 3]; width * height],
            };
            let path = at.join(name);
            lobes::files::write_exr(&path, &picture, lobes::files::Precision::Single).unwrap();
        }
        fails(at, &[&verb[..], arguments].concat(), words);
    }
    fails(
        at,
        &[
            "classify",
            "vase.exr",
            "vase.exr",
            "--normals",
            "normals.exr",
        ],
        &["one picture", "2 are given"],
    );
    fails(
        at,
        &["classify", "vase.exr", "--normals", "vase.exr"],
        &["length of a normal"],
    );
}
