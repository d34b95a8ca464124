//! What machines do to a command at work: disks that are full, folders that cannot be written,
//! files that shrink, very many files, a second run, Ctrl-C. Each ends in a whole answer or in a
//! sentence, and nothing half-written.
#![cfg(unix)]

use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const LOBES: &str = env!("CARGO_BIN_EXE_lobes");

fn lobes(arguments: &[&str], folder: &Path) -> Command {
    through(&[], arguments, folder)
}

/// The command, run by another.
fn through(before: &[&str], arguments: &[&str], folder: &Path) -> Command {
    let words = [before, &[LOBES], arguments].concat();
    let mut command = Command::new(words[0]);
    command
        .args(&words[1..])
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .stdin(Stdio::null());
    command
}

/// Every file and folder below, in order.
fn tree(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut todo = vec![folder.to_path_buf()];
    while let Some(path) = todo.pop() {
        for entry in std::fs::read_dir(&path).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap();
            found.push(name.to_str().unwrap().to_owned());
            if path.is_dir() {
                todo.push(path);
            }
        }
    }
    found.sort();
    found
}

/// One sentence, with these words, and no success.
fn refused(output: &Output, words: &[&str]) {
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");
    for word in words {
        assert!(message.contains(word), "no {word:?} in {message}");
    }
}

/// A PFM of 32 × 16 about one radiance.
fn map(seed: usize) -> Vec<u8> {
    let mut bytes = b"PF\n32 16\n-1.0\n".to_vec();
    for i in 0..32 * 16 * 3 {
        bytes.extend((1.0 + ((i + seed) * 37 % 61) as f32).to_le_bytes());
    }
    bytes
}

/// A grey PNG of a lit ball that fills it, alpha outside.
fn ball(size: usize) -> Vec<u8> {
    let place = |i: usize| (i as f64 + 0.5) / (0.5 * size as f64) - 1.0;
    lobes::picture::encode_png(size, size, 1.0, |row, column| {
        let (v, u) = (place(row), place(column));
        let square = u * u + v * v;
        (square < 1.0).then(|| [0.05 + 0.3 * ((1.0 - square).sqrt() - v).max(0.0); 3])
    })
    .unwrap()
}

/// What the commands below read.
fn inputs(at: &Path) {
    std::fs::create_dir(at.join("maps")).unwrap();
    for (i, name) in ["a", "b", "c"].iter().enumerate() {
        std::fs::write(at.join(format!("maps/{name}.pfm")), map(i)).unwrap();
    }
    std::fs::write(at.join("ball.png"), ball(64)).unwrap();
    std::fs::write(
        at.join("set.toml"),
        "size = 16\ntolerance = 0.1\nlights = ['maps/a.pfm']\n",
    )
    .unwrap();
}

const RENDER: [&str; 9] = [
    "render",
    "--light",
    "maps/a.pfm",
    "--size",
    "24",
    "--tolerance",
    "0.1",
    "--out",
    "spheres",
];
const SET: [&str; 5] = ["render", "--set", "set.toml", "--out", "set"];
const PLOT: [&str; 6] = ["spectrum", "maps/a.pfm", "--degree", "7", "--plot", "a.svg"];
// Quiet, for what it says of learning is no error.
const CLASSIFY: [&str; 8] = [
    "classify",
    "--quiet",
    "ball.png",
    "--illuminations",
    "maps",
    "--turns",
    "1",
    "--report",
];

/// A disk that fills while files are written: files end after some kilobytes.
#[test]
fn the_disk_is_full() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    inputs(at);
    let before = tree(at);
    // In blocks of 512 or of 1024 bytes, by the shell. Past it writing fails as it does on a full
    // disk, where the signal is ignored.
    let limited = |arguments: &[&str]| {
        through(
            &["sh", "-c", "trap '' XFSZ; ulimit -f 4; exec \"$0\" \"$@\""],
            arguments,
            at,
        )
        .output()
        .unwrap()
    };
    refused(&limited(&RENDER), &["spheres", "cannot be written"]);
    assert_eq!(tree(at), before);
    refused(&limited(&PLOT), &["a.svg", "cannot be written"]);
    assert_eq!(tree(at), before);
    let output = limited(&CLASSIFY);
    refused(&output, &["classified", "cannot be written"]);
    // What was learned was not kept either, and that is no error.
    let _ = std::fs::remove_dir_all(at.join("cache"));
    assert_eq!(tree(at), before);
    // A set keeps what is whole, and goes on when there is room.
    refused(&limited(&SET), &["set", "cannot be written"]);
    assert!(!tree(at).iter().any(|name| name.contains("partial")));
    let _ = std::fs::remove_dir_all(at.join("set"));
    assert!(lobes(&SET, at).status().unwrap().success());
}

/// A folder that nobody may write to: by its mode for users, and as an unprivileged user where the
/// tests run as root.
#[cfg(target_os = "linux")]
#[test]
fn the_folder_is_read_only() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    inputs(at);
    let mode = |mode| std::fs::set_permissions(at, PermissionsExt::from_mode(mode)).unwrap();
    mode(0o555);
    let root = std::fs::write(at.join("probe"), b"").is_ok();
    let _ = std::fs::remove_file(at.join("probe"));
    let nobody = [
        "setpriv",
        "--reuid=65534",
        "--regid=65534",
        "--clear-groups",
    ];
    // Where the user that tests run as may write anyway, another may not; who may not even start
    // the command is no test of it.
    let before: &[&str] = if root { &nobody } else { &[] };
    let starts = through(before, &["--version"], at)
        .output()
        .is_ok_and(|output| output.status.success());
    if starts {
        let entries = tree(at);
        for (arguments, words) in [
            (&RENDER[..], ["spheres", "--out"]),
            (&SET, ["set", "--out"]),
            (&PLOT, ["a.svg", "another place"]),
            (&CLASSIFY, ["classified", "--out"]),
        ] {
            refused(&through(before, arguments, at).output().unwrap(), &words);
            assert_eq!(tree(at), entries);
        }
    } else {
        println!(
            "not tested: root may write anywhere, and setpriv cannot make the command another user's"
        );
    }
    mode(0o755);
}

/// A file that shrinks and grows while it is read is read whole, or refused: never a part of it.
#[test]
fn a_file_shrinks_while_it_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pfm");
    let whole = map(0);
    std::fs::write(&path, &whole).unwrap();
    let pixels = lobes::files::read(&path).unwrap().pixels;
    let done = AtomicBool::new(false);
    let (mut read, mut refused) = (0, 0);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut file = std::fs::OpenOptions::new()
                .append(true)
                .open(&path)
                .unwrap();
            while !done.load(Ordering::Relaxed) {
                for half in [whole.len() / 2, 20, 5, 0] {
                    file.set_len(half as u64).unwrap();
                    file.write_all(&whole[half..]).unwrap();
                    std::thread::yield_now();
                }
            }
        });
        for _ in 0..100_000 {
            match lobes::files::read(&path) {
                Ok(picture) => {
                    assert!(picture.pixels == pixels);
                    read += 1;
                }
                Err(error) => {
                    assert!(error.to_string().contains("a.pfm"), "{error}");
                    refused += 1;
                }
            }
            if read >= 20 && refused >= 20 {
                break;
            }
        }
        done.store(true, Ordering::Relaxed);
    });
    assert!(read > 0 && refused > 0, "{read} {refused}");
    // The same, step by step: a pipe has no length, and this one ends early.
    let pipe = folder.path().join("pipe");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut file = std::fs::OpenOptions::new().write(true).open(&pipe).unwrap();
            file.write_all(&whole[..whole.len() / 2]).unwrap();
        });
        let error = lobes::files::read(&pipe).unwrap_err().to_string();
        assert!(error.contains("ends before its last pixel"), "{error}");
    });
}

/// Some thousand files, most of them none: answers come in their order, and a picture a long way
/// down is read as the first would be.
#[test]
fn a_folder_of_thousands() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    inputs(at);
    std::fs::create_dir(at.join("many")).unwrap();
    for i in 0..3000 {
        let path = at.join(format!("many/{i:04}.png"));
        if [700, 701, 2999].contains(&i) {
            std::fs::hard_link(at.join("ball.png"), path).unwrap();
        } else {
            std::fs::write(path, b"nothing").unwrap();
        }
    }
    let output = lobes(
        &[
            "classify",
            "many",
            "--illuminations",
            "maps",
            "--turns",
            "1",
            "--json",
        ],
        at,
    )
    .output()
    .unwrap();
    refused(&output, &["2997 of 3000"]);
    let text = String::from_utf8(output.stdout).unwrap();
    let mut answers = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        let file = line["file"].as_str().unwrap();
        assert_eq!(file, format!("many/{i:04}.png"));
        match line.get("error") {
            Some(error) => assert!(error.as_str().unwrap().contains(file)),
            None => answers.push((
                line["names"]["probabilities"].clone(),
                line["finishes"].clone(),
            )),
        }
    }
    assert_eq!(answers.len(), 3);
    assert!(answers.iter().all(|answer| *answer == answers[0]));
    assert!(answers[0].0.is_object() && answers[0].1.is_object());
}

/// Two runs at once into one folder: every file is of one of them.
#[test]
fn two_runs_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    inputs(at);
    let run = |light: &str, out: &str| -> Child {
        let mut arguments = RENDER;
        arguments[2] = light;
        arguments[8] = out;
        let mut command = lobes(&arguments, at);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    };
    for (light, out) in [("maps/a.pfm", "a"), ("maps/b.pfm", "b")] {
        assert!(run(light, out).wait().unwrap().success());
    }
    for turn in 0..4 {
        let mut runs = [run("maps/a.pfm", "both"), run("maps/b.pfm", "both")];
        for run in &mut runs {
            assert!(run.wait().unwrap().success());
        }
        let names = tree(&at.join("both"));
        assert_eq!(names, tree(&at.join("a")));
        let of = |out: &str| {
            names
                .iter()
                .all(|name| std::fs::read(at.join(out).join(name)).unwrap() == both(at, name))
        };
        assert!(of("a") || of("b"), "mixed in turn {turn}");
    }
    // A set is one run's at a time: the other is refused, or finds everything there.
    let mut runs = [(); 2].map(|()| lobes(&SET, at).stderr(Stdio::null()).spawn().unwrap());
    let done = runs.each_mut().map(|run| run.wait().unwrap().success());
    assert!(done.contains(&true));
    assert!(lobes(&SET, at).status().unwrap().success());
    let set = tree(&at.join("set"));
    assert_eq!(set.iter().filter(|name| name.ends_with(".exr")).count(), 8);
    assert!(!set.iter().any(|name| name.contains("partial")));
}

fn both(at: &Path, name: &str) -> Vec<u8> {
    std::fs::read(at.join("both").join(name)).unwrap()
}

/// Stopped while it learns, or while it makes its table, the command leaves nothing.
#[test]
fn stopped_midway() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("ball.png"), ball(64)).unwrap();
    let before = tree(at);
    for (arguments, began) in [
        (
            &["classify", "ball.png", "--names", "--report"][..],
            "classified",
        ),
        (&["reproduce", "--out", "deep/report"], "deep/report"),
    ] {
        let mut run = lobes(arguments, at)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        while !at.join(began).exists() {
            assert!(run.try_wait().unwrap().is_none(), "it ended by itself");
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(100));
        let id = run.id().to_string();
        assert!(
            Command::new("kill")
                .args(["-INT", &id])
                .status()
                .unwrap()
                .success()
        );
        assert_eq!(run.wait().unwrap().code(), Some(130));
        assert_eq!(tree(at), before, "{arguments:?}");
    }
}
