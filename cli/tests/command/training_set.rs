//! `lobes render --set`: sets that are complete, can be stopped, and say what is wrong with their
//! description.
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const SET: &str = r#"
size = 24
tolerance = 1e-2
lights = ["pmndrs-dawn", "blender-studio"]

[[camera]]

[[camera]]
elevation = 45.0
azimuth = 30.0
roll = 10.0
distance = 4.0
"#;

fn command(set: &Path, out: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lobes"));
    command
        .args(["render", "--set"])
        .arg(set)
        .arg("--out")
        .arg(out);
    command
}

fn run(set: &Path, out: &Path) -> Output {
    command(set, out).output().unwrap()
}

/// Every file below a folder and its bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut waiting = vec![folder.to_path_buf()];
    while let Some(path) = waiting.pop() {
        for entry in fs::read_dir(path).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().display().to_string();
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn a_set_that_was_killed_is_finished_with_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let set = folder.path().join("set.toml");
    fs::write(&set, SET).unwrap();
    let (whole, broken) = (folder.path().join("whole"), folder.path().join("broken"));
    let output = run(&set, &whole);
    assert!(output.status.success(), "{output:?}");
    let expected = files(&whole);
    assert_eq!(expected.len(), 2 * 8 * 2 + 2);
    assert_eq!(
        String::from_utf8_lossy(&expected["index.jsonl"])
            .lines()
            .count(),
        32
    );
    let errors = String::from_utf8_lossy(&expected["errors.jsonl"]).into_owned();
    for line in errors.lines() {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        assert!(expected.contains_key(line["file"].as_str().unwrap()));
        assert!(line["error"].as_f64().unwrap() <= 1e-2);
    }
    assert_eq!(errors.lines().count(), 32);

    let mut child = command(&set, &broken)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let images = || {
        let first = broken.join("pmndrs-dawn");
        fs::read_dir(first)
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| !entry.file_name().to_string_lossy().starts_with('.'))
            .count()
    };
    while images() < 3 && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(
        files(&broken).len() < expected.len(),
        "the set was whole before it was killed"
    );
    // Whatever has its name is whole.
    for (name, bytes) in files(&broken) {
        if !name.contains("-partial") && name != "errors.jsonl" {
            assert_eq!(bytes, expected[&name], "{name}");
        }
    }
    // What a kill in the middle of a file leaves.
    let aside = broken.join("pmndrs-dawn/.old-gold-000.exr-1-partial");
    fs::write(aside, b"half").unwrap();
    let mut errors = fs::read(broken.join("errors.jsonl")).unwrap();
    errors.extend(b"{\"file\": \"pmn");
    fs::write(broken.join("errors.jsonl"), errors).unwrap();
    let output = run(&set, &broken);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(files(&broken), expected);
    // And again: nothing is new.
    let output = run(&set, &broken);
    assert!(String::from_utf8_lossy(&output.stdout).contains("0 of them new"));
}

#[test]
fn what_is_wrong_with_a_set_is_said_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let set = folder.path().join("set.toml");
    let out = folder.path().join("out");
    for (text, words) in [
        ("size = 0", "size of a picture"),
        ("tolerance = 0.0", "tolerance"),
        ("sise = 64", "line 1"),
        ("lights = [\"nowhere\"]", "nowhere"),
        ("lights = []", "names no light"),
        (
            "lights = [\"blender-city\", \"blender-city\"]",
            "both be written",
        ),
        ("lobe = \"phong\"", "phong"),
        ("lobe = \"phong\"", "ggx"),
        ("materials = \"none.toml\"", "none.toml"),
        ("[[camera]]\ndistance = 0.5", "outside the sphere"),
        ("[[camera]]\nelevation = 90.0", "up vector"),
        ("[[camera]]\nroll = nan", "roll"),
    ] {
        fs::write(&set, text).unwrap();
        let output = run(&set, &out);
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{text:?} succeeded");
        assert_eq!(message.trim_end().lines().count(), 1, "{message}");
        assert!(
            message.contains(words),
            "{text:?}: no {words:?} in {message}"
        );
        assert!(!out.exists(), "{text:?} left something behind");
        let _ = fs::remove_dir_all(&out);
    }
}

#[test]
fn a_folder_takes_one_set_only() {
    let folder = tempfile::tempdir().unwrap();
    let (set, out) = (folder.path().join("set.toml"), folder.path().join("out"));
    fs::create_dir(&out).unwrap();
    fs::write(out.join("thesis.txt"), "mine").unwrap();
    fs::write(&set, SET).unwrap();
    let output = run(&set, &out);
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("something else"));
    assert_eq!(files(&out).len(), 1);
}

/// With `lobe = "ggx"` every material has its facets, with one of Ward's those that are of GGX keep
/// theirs; the index says what they reflect, the list of errors how far they are off.
#[test]
fn ggx_is_rendered_within_its_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let set = folder.path().join("set.toml");
    let materials = "[[material]]\nname = 'lacquer'\nkind = 'plastic'\nreflectance = [0.3, 0.1, 0.1]\n\
                     specularity = 0.05\nsigma = 0.1\n\
                     [[material]]\nname = 'gold'\nkind = 'ggx'\nalpha = 0.3\nindex = [0.2, 0.4, 1.5]\n\
                     extinction = [3.1, 2.7, 1.9]\n";
    fs::write(folder.path().join("paints.toml"), materials).unwrap();
    let rest = "size = 6\ntolerance = 1e-2\npixel_samples = 2\nprecision = \"single\"\n\
                materials = \"paints.toml\"\nlights = [\"pmndrs-dawn\"]\n";
    for (lobe, lacquer) in [
        (
            "ggx",
            "\"alpha\":0.1,\"f0\":[0.05,0.05,0.05],\"lobe\":\"ggx\"",
        ),
        ("gmd", "\"sigma\":0.1,\"lobe\":\"gmd\""),
    ] {
        fs::write(&set, format!("lobe = \"{lobe}\"\n{rest}")).unwrap();
        let out = folder.path().join(lobe);
        let output = run(&set, &out);
        assert!(output.status.success(), "{output:?}");
        let index = fs::read_to_string(out.join("index.jsonl")).unwrap();
        let lines: Vec<&str> = index.lines().collect();
        assert_eq!(lines.len(), 2);
        assert!(lines[0].contains(lacquer), "{}", lines[0]);
        let gold =
            "\"alpha\":0.3,\"index\":[0.2,0.4,1.5],\"extinction\":[3.1,2.7,1.9],\"lobe\":\"ggx\"";
        assert!(lines[1].contains(gold), "{}", lines[1]);
        let errors = fs::read_to_string(out.join("errors.jsonl")).unwrap();
        for line in errors.lines() {
            let error: serde_json::Value = serde_json::from_str(line).unwrap();
            let error = error["error"].as_f64().unwrap();
            assert!(error > 0.0 && error <= 2e-2, "{line}");
        }
        assert_eq!(errors.lines().count(), 2);
    }
    // Gold is the same beside either lobe of the lacquer.
    let gold = |lobe: &str| fs::read(folder.path().join(lobe).join("pmndrs-dawn/gold-000.exr"));
    assert_eq!(gold("ggx").unwrap(), gold("gmd").unwrap());
}

#[test]
fn light_that_half_precision_cannot_hold_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let set = folder.path().join("set.toml");
    let mut sun = b"PF\n8 4\n-1.0\n".to_vec();
    sun.extend(
        [1e6_f32; 3 * 32]
            .iter()
            .flat_map(|value| value.to_le_bytes()),
    );
    fs::write(folder.path().join("sun.pfm"), sun).unwrap();
    let text = "size = 8\ntolerance = 1e-2\nlights = [\"sun.pfm\"]\n";
    fs::write(&set, text).unwrap();
    let half = run(&set, &folder.path().join("half"));
    assert!(!half.status.success());
    let message = String::from_utf8_lossy(&half.stderr);
    assert!(message.contains("more than half precision"), "{message}");
    fs::write(&set, format!("{text}precision = \"single\"\n")).unwrap();
    let out = folder.path().join("single");
    let single = run(&set, &out);
    assert!(single.status.success(), "{single:?}");
    assert_eq!(files(&out).len(), 8 + 2);
}
