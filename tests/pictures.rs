//! Each reader against files that other tools wrote and read back, and against damaged ones.
#![cfg(feature = "files")]

use std::path::{Path, PathBuf};

use lobes::files::{self, MOST_PIXELS, Picture, Precision};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/pictures")
}

fn expected() -> serde_json::Map<String, serde_json::Value> {
    let text = std::fs::read_to_string(folder().join("expected.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&text).unwrap();
    record["files"].as_object().unwrap().clone()
}

/// The message of reading these bytes under some name, which must be one sentence that names the file.
fn refused(bytes: &[u8]) -> String {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let message = files::read(file.path()).unwrap_err().to_string();
    assert!(message.starts_with(&file.path().display().to_string()));
    assert!(
        !message.contains('\n') && message.contains("; "),
        "{message}"
    );
    message.split_once(": ").unwrap().1.to_string()
}

#[test]
fn every_picture_reads_as_its_own_tool_reads_it() {
    let expected = expected();
    assert!(expected.len() > 30);
    for (name, expected) in &expected {
        let read = files::read(&folder().join(name));
        if let Some(reason) = expected["refused"].as_str() {
            let message = read.unwrap_err().to_string();
            assert!(message.contains(reason), "{message}");
            continue;
        }
        let picture = read.unwrap();
        assert_eq!(expected["width"], picture.width, "{name}");
        assert_eq!(expected["height"], picture.height, "{name}");
        let values = expected["pixels"].as_array().unwrap();
        let got = picture.pixels.as_flattened();
        assert_eq!(got.len(), values.len());
        for (index, (got, value)) in got.iter().zip(values).enumerate() {
            let value = value.as_f64().unwrap();
            let allowed = match name.as_str() {
                // Through a matrix that subtracts: relative to the pixel's brightest channel.
                _ if name.starts_with("xyze") => {
                    let pixel = picture.pixels[index / 3];
                    1e-6 * pixel.into_iter().fold(0.0, f64::max)
                }
                // Single precision on the other side; radiances of half precision are exact.
                _ if name.ends_with(".hdr") => 2e-7 * value,
                _ => 1e-8 * value.abs(),
            };
            assert!(
                (got - value).abs() <= allowed,
                "{name}, value {index}: {got} {value}"
            );
        }
    }
}

#[test]
fn an_xyze_picture_has_the_radiance_of_the_rgbe_picture_it_was_made_of() {
    let read = |name: &str| files::read(&folder().join(name)).unwrap();
    let (xyze, rgbe) = (read("xyze.hdr"), read("order-Y+X.hdr"));
    for (a, b) in xyze.pixels.iter().zip(&rgbe.pixels) {
        let brightest = b.iter().copied().fold(0.0, f64::max);
        for channel in 0..3 {
            // Two steps of mantissa, in XYZ, through a matrix whose largest row sums to 4.1.
            assert!(
                (a[channel] - b[channel]).abs() <= 0.03 * brightest,
                "{a:?} {b:?}"
            );
        }
    }
}

/// Every prefix of every file: an error or, where only padding is missing, a picture; never a panic.
#[test]
fn truncated_files_are_refused() {
    for name in expected().keys() {
        let bytes = std::fs::read(folder().join(name)).unwrap();
        let file = tempfile::NamedTempFile::new().unwrap();
        for length in (0..bytes.len()).step_by(41).chain([bytes.len() - 1]) {
            std::fs::write(file.path(), &bytes[..length]).unwrap();
            let read = files::read(file.path());
            assert!(read.is_err(), "{name} cut to {length} bytes");
        }
    }
}

/// Random damage: whatever is read, nothing panics, and what is read is of the size it says.
#[test]
fn damaged_files_do_not_panic() {
    let mut random = Pcg64::seed_from_u64(20_261_122);
    let file = tempfile::NamedTempFile::new().unwrap();
    for name in expected().keys() {
        let bytes = std::fs::read(folder().join(name)).unwrap();
        for _ in 0..20 {
            let mut damaged = bytes.clone();
            for _ in 0..random.random_range(1..8) {
                let at = random.random_range(0..damaged.len());
                damaged[at] = random.random();
            }
            std::fs::write(file.path(), &damaged).unwrap();
            if let Ok(picture) = files::read(file.path()) {
                assert_eq!(picture.pixels.len(), picture.width * picture.height);
            }
        }
    }
}

#[test]
fn huge_headers_cost_nothing() {
    let hdr = |size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
    assert_eq!(
        refused(&hdr("-Y 100000 +X 200000")),
        format!(
            "the header claims 200000 by 100000 pixels, more than the {MOST_PIXELS} that are read; give a smaller picture, \
             or fetch the file again if it is not that large"
        )
    );
    assert!(refused(&hdr("-Y 18446744073709551615 +X 2")).contains("more than"));
    assert!(refused(&hdr("-Y 0 +X 2")).contains("not empty"));
    // Allowed sizes with nothing behind them.
    assert!(refused(&hdr("-Y 5792 +X 11584")).contains("more than a file of its length"));
    assert!(refused(&hdr("-Y 100 +X 200")).contains("ends before its last pixel"));
    assert!(refused(b"PF\n8192 8192\n-1.0\n").contains("more than a file of its length"));
    assert!(refused(b"PF\n80 80\n-1.0\n").contains("ends before its last pixel"));
    assert!(refused(b"PF\n99999999 99999999\n-1.0\n").contains("more than"));
    // The size of an EXR: its data window.
    let mut exr = std::fs::read(folder().join("half-zip.exr")).unwrap();
    let at = exr.windows(10).position(|w| w == b"dataWindow").unwrap() + 10 + 1 + 6 + 4;
    for (corner, words) in [
        ([0xff, 0xff, 0xff, 0x00], "more than the"),
        ([0xff, 0x1f, 0x00, 0x00], "more than a file of its length"),
    ] {
        exr[at + 8..at + 12].copy_from_slice(&corner);
        exr[at + 12..at + 16].copy_from_slice(&corner);
        let message = refused(&exr);
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn bad_radiance_headers_are_named() {
    let with = |header: &str, size: &str, body: &[u8]| {
        let mut bytes = format!("#?RADIANCE\n{header}\n\n{size}\n").into_bytes();
        bytes.extend_from_slice(body);
        bytes
    };
    let good = "-Y 1 +X 2";
    let pixels = [128, 128, 128, 128, 1, 2, 3, 130];
    assert!(files::read(Path::new("/nonexistent/sky.hdr")).is_err());
    for (bytes, words) in [
        (
            with("FORMAT=16-bit_rle_uvw", good, &pixels),
            "16-bit_rle_uvw",
        ),
        (with("EXPOSURE=0", good, &pixels), "EXPOSURE is \"0\""),
        (with("EXPOSURE=-1", good, &pixels), "1 positive number"),
        (with("COLORCORR=1 2", good, &pixels), "3 positive numbers"),
        (
            with("EXPOSURE=1e300\nEXPOSURE=1e300", good, &pixels),
            "without bound",
        ),
        (
            with("SOFTWARE=a test", "-Y 1 -Y 2", &pixels),
            "its size reads",
        ),
        (
            with("SOFTWARE=a test", "-Y one +X 2", &pixels),
            "its size reads",
        ),
        (
            with("SOFTWARE=a test", "-Y 1 +X", &pixels),
            "its size reads",
        ),
        (with("SOFTWARE=a test", good, &pixels[..7]), "ends before"),
        (with("SOFTWARE=a test", good, &[1, 1, 1, 1]), "does not fit"), // repeats nothing
        (
            with("SOFTWARE=a test", good, &[9, 9, 9, 9, 1, 1, 1, 2]),
            "does not fit",
        ), // one too many
        (
            with("SOFTWARE=a test", "-Y 1 +X 8", &[2, 2, 0, 9, 0]),
            "another length",
        ),
        (
            with(
                "SOFTWARE=a test",
                "-Y 1 +X 8",
                &[2, 2, 0, 8, 137, 1, 1, 1, 1, 1, 1, 1],
            ),
            "does not fit",
        ),
        (
            with(
                "SOFTWARE=a test",
                "-Y 1 +X 8",
                &[2, 2, 0, 8, 0, 1, 1, 1, 1, 1, 1, 1],
            ),
            "does not fit",
        ),
        (
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe".to_vec(),
            "header does not end",
        ),
        (b"GIF89a".to_vec(), "none of OpenEXR, Radiance and PFM"),
        (Vec::new(), "is empty"),
        (b"PF\n4 -4\n1.0\n".to_vec(), "its size reads"),
        (b"PF\n1 1\n0\n".to_vec(), "its scale reads"),
    ] {
        let message = refused(&bytes);
        assert!(message.contains(words), "{message} does not say {words}");
    }
}

#[test]
fn what_is_written_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Pcg64::seed_from_u64(3);
    let picture = Picture {
        width: 33,
        height: 17,
        pixels: (0..33 * 17)
            .map(|_| std::array::from_fn(|_| 10f64.powf(random.random_range(-3.0..4.0))))
            .collect(),
    };
    for (precision, relative) in [
        (Precision::Half, 2f64.powi(-11)),
        (Precision::Single, 2f64.powi(-24)),
    ] {
        let path = folder.path().join("a.exr");
        files::write_exr(&path, &picture, precision).unwrap();
        let back = files::read(&path).unwrap();
        for (a, b) in picture
            .pixels
            .as_flattened()
            .iter()
            .zip(back.pixels.as_flattened())
        {
            assert!((a - b).abs() <= relative * a, "{a} {b}");
        }
    }
    let nowhere = folder.path().join("no/such/folder.exr");
    let message = files::write_exr(&nowhere, &picture, Precision::Half)
        .unwrap_err()
        .to_string();
    assert!(message.contains("cannot be written"), "{message}");
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "nothing is left beside it"
    );
}
