//! WebP and TIFF against files that other tools wrote: `scripts/make-test-codes`.
#![cfg(feature = "files")]

use std::path::{Path, PathBuf};

use lobes::files::{linear_of_srgb, srgb_of_linear};
use lobes::picture::Picture;

const ROWS: usize = 5;
const COLUMNS: usize = 7;

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/codes")
        .join(name)
}

fn read(name: &str) -> Picture {
    Picture::read(&path(name)).unwrap()
}

/// The code of 8 bits that stands there in all of the files but the lossy ones.
fn code(row: usize, column: usize, channel: usize) -> usize {
    (37 * row + 11 * column + 71 * channel) % 256
}

/// That the picture has these linear values, by row, column and channel.
fn check(name: &str, expected: impl Fn(usize, usize, usize) -> f64) {
    let picture = read(name);
    assert_eq!(
        (picture.width(), picture.height()),
        (COLUMNS, ROWS),
        "{name}"
    );
    for (i, rgb) in picture.radiance().enumerate() {
        let (row, column) = (i / COLUMNS, i % COLUMNS);
        for channel in 0..3 {
            let expected = expected(row, column, channel);
            let got = rgb[channel];
            assert!(
                (got - expected).abs() <= 1e-12 + 1e-6 * expected,
                "{name}: {got}, not {expected}, at {row}, {column}, {channel}"
            );
        }
    }
}

#[test]
fn codes_are_read_as_they_were_written() {
    let eight = |row, column, channel| linear_of_srgb(code(row, column, channel) as f64 / 255.0);
    for name in [
        "lossless.webp",
        "alpha.webp",
        "rgb8.tif",
        "rgb8-lzw.tif",
        "rgb8-big.tif",
        "rgba8.tif",
    ] {
        check(name, eight);
        assert!(read(name).is_encoded(), "{name}");
    }
    let wide = |row, column, channel| {
        linear_of_srgb((251 * code(row, column, channel) + 13) as f64 / 65535.0)
    };
    for name in [
        "rgb16-deflate.tif",
        "rgb16-planes.tif",
        "rgb16-big-endian.tif",
    ] {
        check(name, wide);
    }
    for name in ["grey8.tif", "white-is-zero.tif"] {
        check(name, |row, column, _| eight(row, column, 0));
    }
    for name in ["float32.tif", "float16.tif"] {
        check(name, |row, column, channel| {
            code(row, column, channel) as f64 / 64.0
        });
        assert!(!read(name).is_encoded(), "{name}");
    }
    // Tiles of 16, of which the last ones are cut off.
    let tiles = read("tiles.tif");
    assert_eq!((tiles.width(), tiles.height()), (5 * COLUMNS, 5 * ROWS));
    for (i, rgb) in tiles.radiance().enumerate() {
        let (row, column) = (i / (5 * COLUMNS) % ROWS, i % COLUMNS);
        assert_eq!(rgb[1], eight(row, column, 1), "{i}");
    }
}

#[test]
fn alpha_is_the_mask() {
    for name in ["alpha.webp", "rgba8.tif"] {
        let picture = read(name);
        for (i, alpha) in picture.mask().unwrap().iter().enumerate() {
            let expected = code(i / COLUMNS, i % COLUMNS, 3) as f32 / 255.0;
            assert_eq!(*alpha, expected, "{name}");
        }
    }
}

/// EXIF's 6: what is stored is to be turned clockwise, so that its first column is the top row.
#[test]
fn orientation_is_undone() {
    for name in ["turned.webp", "turned.tif"] {
        let picture = read(name);
        assert_eq!(
            (picture.width(), picture.height()),
            (ROWS, COLUMNS),
            "{name}"
        );
        for (i, rgb) in picture.radiance().enumerate() {
            let (row, column) = (i / ROWS, i % ROWS);
            let stored = code(ROWS - 1 - column, row, 2) as f64 / 255.0;
            assert_eq!(rgb[2], linear_of_srgb(stored), "{name}");
        }
    }
}

fn expected(name: &str) -> Vec<Vec<[f64; 3]>> {
    let text = std::fs::read_to_string(path("expected.json")).unwrap();
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    serde_json::from_value(all["files"][name].clone()).unwrap()
}

/// Codes of sRGB as Pillow reads the lossy one, and as Little CMS converts those of wide primaries.
#[test]
fn lossy_codes_and_profiles_are_as_other_tools_have_them() {
    for (name, of, most) in [
        ("lossy.webp", "lossy.webp", 3.0),
        ("display-p3.webp", "display-p3", 1.5),
        ("display-p3.tif", "display-p3", 1.5),
    ] {
        let picture = read(name);
        for (row, pixels) in expected(of).iter().enumerate() {
            for (column, pixel) in pixels.iter().enumerate() {
                let rgb = picture.get(row, column).unwrap();
                for channel in 0..3 {
                    // Codes end at 255; what is read does not.
                    let got = (255.0 * srgb_of_linear(rgb[channel])).min(255.0);
                    assert!(
                        (got - pixel[channel]).abs() <= most,
                        "{name}: {got}, not {}, at {row}, {column}",
                        pixel[channel]
                    );
                }
            }
        }
    }
}

/// Every prefix of every file is refused as damaged: never a panic, never a picture.
#[test]
fn what_is_cut_off_is_damaged() {
    for entry in std::fs::read_dir(path("")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.ends_with(".webp") && !name.ends_with(".tif") {
            continue;
        }
        let bytes = std::fs::read(&path).unwrap();
        for end in 13..bytes.len() {
            // What may follow the pixels of a TIFF is not needed.
            if let Err(error) = Picture::from_bytes(&bytes[..end]) {
                let message = error.to_string();
                assert!(
                    [
                        "corrupt",
                        "ends before",
                        "damaged",
                        "empty",
                        "claims",
                        "not read here"
                    ]
                    .iter()
                    .any(|word| message.contains(word)),
                    "{name} cut to {end}: {message}"
                );
            } else {
                assert!(
                    name.ends_with(".tif") && end + 16 > bytes.len(),
                    "{name} cut to {end}"
                );
            }
        }
    }
}

#[test]
fn what_no_decoder_reads_is_told_by_its_name() {
    let message = Picture::read(&path("rgb.avif")).unwrap_err().to_string();
    assert!(
        message.contains("AVIF") && message.contains("convert"),
        "{message}"
    );
    let heic = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic";
    let message = Picture::from_bytes(heic).unwrap_err().to_string();
    assert!(
        message.contains("HEIC") && message.contains("convert"),
        "{message}"
    );
}
