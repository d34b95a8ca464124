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

/// The message of reading these bytes under some name, which must be one sentence that names the
/// file.
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

/// Every prefix of every file: an error or, where only padding is missing, a picture; never a
/// panic.
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
        (
            with("EXPOSURE=0", good, &pixels),
            "EXPOSURE=0, where a positive number is needed",
        ),
        (
            with("EXPOSURE=-1", good, &pixels),
            "EXPOSURE=-1, where a positive",
        ),
        (
            with("EXPOSURE=nan", good, &pixels),
            "EXPOSURE=nan, where a positive",
        ),
        (
            with("COLORCORR=1 2", good, &pixels),
            "three positive numbers",
        ),
        (
            with("GAMMA=2.2", good, &pixels),
            "GAMMA=2.2: its pixels are encoded",
        ),
        (
            with("PRIMARIES= .64 .33 .3 .6 .15 .06", good, &pixels),
            "where the chromaticities of",
        ),
        (
            with("PRIMARIES= .3 .3 .3 .3 .3 .3 .3 .3", good, &pixels),
            "make no colour space",
        ),
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
        (
            b"PF9\n1 1\n-1.0\n".to_vec(),
            "begins with \"PF9\", a variant",
        ),
        (
            b"Pf\n1 1\n-1.0\n12345".to_vec(),
            "1 bytes follow its last pixel",
        ),
        (
            b"Pf\r\n1 1\r\n-1.0\r\n123456".to_vec(),
            "bytes follow its last",
        ),
        (
            b"Pf\r\n1 1\r\n-1.0\r\n123".to_vec(),
            "ends before its last pixel",
        ),
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

/// A colour whose light in other primaries is told by the package colour-science 0.4.7:
/// `RGB_to_RGB` from a space of these primaries and this white, its matrices derived, to one of
/// BT.709's with white (0.3127, 0.3290), adapted by "Bradford". CIE XYZ itself has no white to
/// adapt from: there it is the inverse of BT.709's matrix (from `numpy`), as OpenEXR's own
/// `RGBtoXYZ` writes such files.
const COLOUR: [f64; 3] = [0.2, 0.5, 0.9];

/// The name, the chromaticities of red, green, blue and white, and what [`COLOUR`] is in Rec. 709.
const SPACES: [(&str, [f32; 8], [f64; 3]); 7] = [
    (
        "ACES AP0",
        [0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767],
        [-0.41152793542483, 0.5444483048936429, 0.9719547798231835],
    ),
    (
        "ACES AP1",
        [0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767],
        [
            -0.044818846597786094,
            0.5348575976247697,
            0.9683899401892211,
        ],
    ),
    (
        "XYZ",
        [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0],
        [-0.5692472846678455, 0.7815345751641425, 0.8604118993135011],
    ),
    (
        "P3",
        [0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290],
        [0.13251794711583206, 0.5126170864129065, 0.9452007064334869],
    ),
    (
        "BT.2020",
        [0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290],
        [
            -0.027287245960484166,
            0.5340253733147294,
            0.9529370935516367,
        ],
    ),
    (
        "Adobe RGB",
        [0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290],
        [0.08049327681176639, 0.5, 0.9171715957177892],
    ),
    (
        "ProPhoto",
        [
            0.7347, 0.2653, 0.1596, 0.8404, 0.0366, 0.0001, 0.3457, 0.3585,
        ],
        [-0.2330034907651151, 0.5674774002462782, 0.9672981784469856],
    ),
];

/// Where Rec. 709 has parts below zero of a colour that had none, they are zero.
fn shown(colour: [f64; 3]) -> [f64; 3] {
    colour.map(|value| value.max(0.0))
}

fn close(got: [f64; 3], expected: [f64; 3], allowed: f64, what: &str) {
    for channel in 0..3 {
        assert!(
            (got[channel] - expected[channel]).abs() <= allowed,
            "{what}: {got:?} {expected:?}"
        );
    }
}

/// What an OpenEXR file is made of here: channels of single precision over a data window.
struct Exr {
    channels: Vec<(&'static str, Vec<f32>)>,
    /// Column, row, width and height.
    data: [i32; 4],
    display: [i32; 4],
    chromaticities: Option<[f32; 8]>,
    environment: Option<exr::meta::attribute::EnvironmentMap>,
}

impl Exr {
    fn new(width: i32, height: i32, channels: &[(&'static str, f32)]) -> Self {
        let count = (width * height) as usize;
        Self {
            channels: channels
                .iter()
                .map(|(name, v)| (*name, vec![*v; count]))
                .collect(),
            data: [0, 0, width, height],
            display: [0, 0, width, height],
            chromaticities: None,
            environment: None,
        }
    }

    fn bytes(&self) -> Vec<u8> {
        use exr::prelude::*;
        let [left, top, width, height] = self.data;
        let mut attributes = LayerAttributes {
            layer_position: Vec2(left, top),
            ..LayerAttributes::default()
        };
        attributes.environment_map = self.environment;
        let layer = Layer::new(
            Vec2(width as usize, height as usize),
            attributes,
            Encoding {
                compression: Compression::ZIP1,
                blocks: Blocks::ScanLines,
                line_order: LineOrder::Increasing,
            },
            AnyChannels::sort(
                self.channels
                    .iter()
                    .map(|(name, values)| AnyChannel::new(*name, FlatSamples::F32(values.clone())))
                    .collect(),
            ),
        );
        let [left, top, width, height] = self.display;
        let mut image = Image::from_layer(layer);
        image.attributes.display_window =
            IntegerBounds::new((left, top), (width as usize, height as usize));
        image.attributes.chromaticities = self.chromaticities.map(|[a, b, c, d, e, f, g, h]| {
            exr::meta::attribute::Chromaticities {
                red: Vec2(a, b),
                green: Vec2(c, d),
                blue: Vec2(e, f),
                white: Vec2(g, h),
            }
        });
        let mut bytes = Vec::new();
        image
            .write()
            .non_parallel()
            .to_buffered(std::io::Cursor::new(&mut bytes))
            .unwrap();
        bytes
    }
}

const RGB: [(&str, f32); 3] = [("R", 0.2), ("G", 0.5), ("B", 0.9)];

#[test]
fn other_primaries_are_converted() {
    let mut exr = Exr::new(2, 1, &RGB);
    let rec709 = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];
    for said in [None, Some(rec709)] {
        exr.chromaticities = said;
        let picture = files::decode(&exr.bytes()).unwrap();
        assert_eq!(picture.pixels, [RGB.map(|(_, value)| f64::from(value)); 2]);
    }
    for (name, chromaticities, expected) in SPACES {
        exr.chromaticities = Some(chromaticities);
        let picture = files::decode(&exr.bytes()).unwrap();
        close(picture.pixels[0], shown(expected), 1e-6, name);
        // Radiance's mantissas of 8 bits hold 0.2 to 0.9 only to 2⁻⁹ of the largest: the matrices'
        // largest row sums to 6.
        let said: Vec<String> = chromaticities.iter().map(f32::to_string).collect();
        let mut hdr = format!(
            "#?RADIANCE\nPRIMARIES= {}\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n",
            said.join(" ")
        )
        .into_bytes();
        hdr.extend(COLOUR.map(|value| (value * 2.0 * 128.0 - 0.5f64).round() as u8));
        hdr.push(129);
        let picture = files::decode(&hdr).unwrap();
        close(picture.pixels[0], shown(expected), 0.02, name);
    }
    // A colour that is outside of its own gamut stays as it is, though Rec. 709 has it below zero
    // too.
    let mut exr = Exr::new(1, 1, &[("R", -0.1), ("G", 0.5), ("B", 0.9)]);
    exr.chromaticities = Some(SPACES[4].1);
    assert!(files::decode(&exr.bytes()).unwrap().pixels[0][0] < -0.1);
    exr.chromaticities = Some([0.3; 8]);
    assert!(refused(&exr.bytes()).contains("make no colour space"));
    exr.chromaticities = Some([f32::NAN; 8]);
    assert!(refused(&exr.bytes()).contains("make no colour space"));
}

/// OpenEXR's chroma: RY = (R − Y)/Y and BY = (B − Y)/Y with Y the luminance in the file's
/// primaries.
#[test]
fn luminance_and_chroma_become_colour() {
    // Y's weights in ACES AP0 are those of SMPTE ST 2065-1, to four digits more.
    for (chromaticities, weights) in [
        (None, [0.2126, 0.7152, 0.0722]),
        (
            Some(SPACES[0].1),
            [
                0.343_966_449_765_075,
                0.728_166_096_613_485,
                -0.072_132_546_378_560_7,
            ],
        ),
    ] {
        let y: f64 = (0..3).map(|c| weights[c] * COLOUR[c]).sum();
        let chroma = [0, 2].map(|c| (COLOUR[c] - y) / y);
        let mut exr = Exr::new(
            1,
            1,
            &[
                ("Y", y as f32),
                ("RY", chroma[0] as f32),
                ("BY", chroma[1] as f32),
            ],
        );
        exr.chromaticities = chromaticities;
        let picture = files::decode(&exr.bytes()).unwrap();
        let expected = if chromaticities.is_some() {
            SPACES[0].2
        } else {
            COLOUR
        };
        close(picture.pixels[0], shown(expected), 5e-5, "Y, RY, BY");
    }
    let grey = files::decode(&Exr::new(1, 1, &[("Y", 0.25)]).bytes()).unwrap();
    assert_eq!(grey.pixels, [[0.25; 3]]);
    let depth = refused(&Exr::new(1, 1, &[("Z", 1.0)]).bytes());
    assert!(
        depth.contains("no layer of the file has the channels"),
        "{depth}"
    );
    // Subsampled: the x and y sampling of the first channel become 2.
    let mut bytes = Exr::new(4, 4, &[("BY", 0.0), ("RY", 0.0), ("Y", 1.0)]).bytes();
    let at = bytes.windows(7).position(|w| w == b"chlist\0").unwrap() + 7 + 4;
    assert_eq!(&bytes[at..at + 3], b"BY\0");
    bytes[at + 3 + 8] = 2;
    bytes[at + 3 + 12] = 2;
    assert_eq!(
        refused(&bytes),
        "the file subsamples its channels, as luminance and chroma often are, which is not read here; \
         store it again as RGB, every channel at every pixel"
    );
}

/// The data window lies anywhere in the plane of the display window.
#[test]
fn pixels_lie_in_the_display_window() {
    let numbered = |data: [i32; 4], display: [i32; 4]| {
        let mut exr = Exr::new(data[2], data[3], &[]);
        let values = (0..data[3]).flat_map(|row| {
            (0..data[2]).map(move |column| (100 * (data[1] + row) + data[0] + column) as f32)
        });
        exr.channels = ["R", "G", "B"]
            .map(|name| (name, values.clone().collect()))
            .into();
        (exr.data, exr.display) = (data, display);
        exr.bytes()
    };
    for (data, display) in [
        ([0, 0, 4, 2], [0, 0, 4, 2]),
        ([-3, -2, 12, 7], [0, 0, 4, 2]),
        ([10, 20, 4, 2], [10, 20, 4, 2]),
        ([8, 19, 9, 4], [10, 20, 4, 2]),
    ] {
        let picture = files::decode(&numbered(data, display)).unwrap();
        assert_eq!((picture.width, picture.height), (4, 2));
        for (index, pixel) in picture.pixels.iter().enumerate() {
            let (row, column) = (index as i32 / 4, index as i32 % 4);
            let expected = f64::from(100 * (display[1] + row) + display[0] + column);
            assert_eq!(*pixel, [expected; 3], "{data:?} {display:?}");
        }
    }
    assert_eq!(
        refused(&numbered([1, 0, 2, 2], [0, 0, 4, 2])),
        "the file holds 2 by 2 pixels from column 1, row 0 of a picture of 4 by 2, and the rest is missing; \
         store the whole picture: a data window that covers the display window"
    );
    for outside in [[4, 0, 2, 2], [-2, 0, 2, 2], [0, 2, 4, 2], [0, -5, 4, 2]] {
        let message = refused(&numbered(outside, [0, 0, 4, 2]));
        assert!(message.contains("so nothing of it"), "{message}");
    }
    let message = refused(&numbered([0, 0, 2, 2], [0, 0, 1 << 20, 1 << 20]));
    assert!(message.contains("more than the"), "{message}");
}

/// Indented lines are those of pictures that this one was made of; old files begin without `#?`.
#[test]
fn radiance_headers_count_at_the_first_column() {
    let value = |header: &str| {
        let mut bytes = format!("{header}\n\n-Y 1 +X 1\n").into_bytes();
        bytes.extend([128, 64, 32, 129]);
        files::decode(&bytes).map(|picture| picture.pixels[0][0] / (128.5 / 128.0))
    };
    for (header, expected) in [
        (
            "#?RADIANCE\npcomb a.hdr\na.hdr:\n\tEXPOSURE=8\n EXPOSURE=8\n\tCOLORCORR=2 2 2",
            1.0,
        ),
        ("#?RADIANCE\n\tFORMAT=32-bit_rle_xyze\n\tGAMMA=2.2", 1.0),
        ("#?RADIANCE\nEXPOSURE=8\n\tEXPOSURE=2\nEXPOSURE= 0.5", 0.25),
        ("#?RADIANCE\nGAMMA=1.0\nEXPOSURE =4\n#EXPOSURE=4", 1.0),
        (
            "rpict -vp 0 0 0 scene.oct\nEXPOSURE=4\nFORMAT=32-bit_rle_rgbe",
            0.25,
        ),
        ("EXPOSURE=4", 0.25),
    ] {
        assert_eq!(value(header), Ok(expected), "{header:?}");
    }
    // Neither text nor bytes of another kind are one.
    assert!(value("\u{1}\nEXPOSURE=4").is_err());
    assert!(refused(b"one two\n\nthree four five six\n").contains("none of OpenEXR"));
}

#[test]
fn portable_float_maps_end_their_lines_as_windows_does_and_have_alpha() {
    let data: Vec<u8> = [0.25f32, 0.5, 0.75, 0.125]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let of = |header: &str, data: &[u8]| {
        files::decode(&[header.as_bytes(), data].concat()).map(|picture| picture.pixels)
    };
    let expected = Ok(vec![[0.25, 0.5, 0.75]]);
    assert_eq!(of("PF\n1 1\n-1.0\n", &data[..12]), expected);
    assert_eq!(of("PF\r\n1 1\r\n-1.0\r\n", &data[..12]), expected);
    assert_eq!(of("PF\r1 1\r-1.0\r", &data[..12]), expected);
    assert_eq!(of("PF4\n1 1\n-1.0\n", &data), expected);
    // A line feed that is data after a lone carriage return stays data.
    let feed = f32::from_le_bytes([b'\n', 0, 0, 0x3f]);
    assert_eq!(
        of("Pf\n1 1\n-1.0\r", &feed.to_le_bytes()),
        Ok(vec![[f64::from(feed); 3]])
    );
}

/// A PNG of one row with chunks before and after its pixels; the codes are bytes as they are
/// stored.
fn png_row(
    colour: png::ColorType,
    depth: png::BitDepth,
    width: u32,
    codes: &[u8],
    before: &[(&[u8; 4], Vec<u8>)],
    after: &[(&[u8; 4], Vec<u8>)],
    profile: Option<Vec<u8>>,
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut info = png::Info::with_size(width, 1);
    (info.color_type, info.bit_depth) = (colour, depth);
    info.icc_profile = profile.map(Into::into);
    if colour == png::ColorType::Indexed {
        info.palette = Some(vec![255, 0, 0, 0, 0, 255].into());
    }
    let mut writer = png::Encoder::with_info(&mut bytes, info)
        .unwrap()
        .write_header()
        .unwrap();
    for (name, data) in before {
        writer
            .write_chunk(png::chunk::ChunkType(**name), data)
            .unwrap();
    }
    writer.write_image_data(codes).unwrap();
    for (name, data) in after {
        writer
            .write_chunk(png::chunk::ChunkType(**name), data)
            .unwrap();
    }
    writer.finish().unwrap();
    bytes
}

/// The one pixel of [`COLOUR`] in 16 bits, through an encoding.
fn coded(
    encode: impl Fn(f64) -> f64,
    before: &[(&[u8; 4], Vec<u8>)],
    profile: Option<Vec<u8>>,
) -> Vec<u8> {
    let codes: Vec<u8> = COLOUR
        .iter()
        .flat_map(|value| ((encode(*value) * 65535.0).round() as u16).to_be_bytes())
        .collect();
    png_row(
        png::ColorType::Rgb,
        png::BitDepth::Sixteen,
        1,
        &codes,
        before,
        &[],
        profile,
    )
}

/// gAMA or cHRM: hundred-thousandths.
fn scaled(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| ((f64::from(*value) * 1e5).round() as u32).to_be_bytes())
        .collect()
}

/// An ICC profile of version 2: a matrix to XYZ under D50 and one power for all channels.
fn profile(colorants: [[f64; 3]; 3], power: f64) -> Vec<u8> {
    let fixed = |value: f64| ((value * 65536.0).round() as i32).to_be_bytes();
    let xyz = |values: [f64; 3]| {
        [
            b"XYZ \0\0\0\0".to_vec(),
            values.into_iter().flat_map(fixed).collect(),
        ]
        .concat()
    };
    let mut curve = b"curv\0\0\0\0\0\0\0\x01".to_vec();
    curve.extend(((power * 256.0).round() as u16).to_be_bytes());
    curve.extend([0; 2]);
    let tags: Vec<(&[u8; 4], Vec<u8>)> = vec![
        (b"wtpt", xyz([0.9642, 1.0, 0.8249])),
        (b"rXYZ", xyz(colorants[0])),
        (b"gXYZ", xyz(colorants[1])),
        (b"bXYZ", xyz(colorants[2])),
        (b"rTRC", curve.clone()),
        (b"gTRC", curve.clone()),
        (b"bTRC", curve),
    ];
    let mut table = (tags.len() as u32).to_be_bytes().to_vec();
    let mut data = Vec::new();
    for (name, content) in &tags {
        let at = 128 + 4 + 12 * tags.len() + data.len();
        table.extend(*name);
        table.extend((at as u32).to_be_bytes());
        table.extend((content.len() as u32).to_be_bytes());
        data.extend(content);
    }
    let size = (128 + table.len() + data.len()) as u32;
    let mut header = vec![0; 128];
    header[..4].copy_from_slice(&size.to_be_bytes());
    header[8..12].copy_from_slice(&[2, 0x40, 0, 0]);
    header[12..24].copy_from_slice(b"mntrRGB XYZ ");
    header[36..40].copy_from_slice(b"acsp");
    for (place, value) in [0.9642, 1.0, 0.8249].into_iter().enumerate() {
        header[68 + 4 * place..72 + 4 * place].copy_from_slice(&fixed(value));
    }
    [header, table, data].concat()
}

/// Adobe RGB (1998) under D50, as its own profile has it.
const ADOBE_D50: [[f64; 3]; 3] = [
    [0.60974, 0.31111, 0.01947],
    [0.20528, 0.62567, 0.06087],
    [0.14919, 0.06322, 0.74457],
];

fn seen(bytes: &[u8]) -> [f64; 3] {
    lobes::picture::Picture::from_bytes(bytes)
        .unwrap()
        .get(0, 0)
        .unwrap()
}

fn unseen(bytes: &[u8]) -> String {
    let message = lobes::picture::Picture::from_bytes(bytes)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("; ") && !message.contains('\n'),
        "{message}"
    );
    message
}

#[test]
fn codes_mean_what_the_picture_says() {
    let srgb = files::srgb_of_linear;
    let gamma = |file: f32| ("gAMA", scaled(&[file]));
    let said = |chunks: &[(&str, Vec<u8>)]| -> Vec<(&'static [u8; 4], Vec<u8>)> {
        chunks
            .iter()
            .map(|(name, data)| {
                let name: &'static [u8; 4] = match *name {
                    "gAMA" => b"gAMA",
                    "cHRM" => b"cHRM",
                    "cICP" => b"cICP",
                    _ => b"sRGB",
                };
                (name, data.clone())
            })
            .collect()
    };
    // White, red, green, blue.
    let primaries = |space: usize| {
        let c = SPACES[space].1;
        (
            "cHRM",
            scaled(&[c[6], c[7], c[0], c[1], c[2], c[3], c[4], c[5]]),
        )
    };
    let rec709 = (
        "cHRM",
        scaled(&[0.3127, 0.329, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06]),
    );
    let camera = |v: f64| {
        if v < 0.018 {
            4.5 * v
        } else {
            1.099 * v.powf(0.45) - 0.099
        }
    };
    let power = |p: f64| move |v: f64| v.powf(1.0 / p);
    for (name, bytes, expected) in [
        ("nothing", coded(srgb, &[], None), COLOUR),
        ("gAMA 1", coded(|v| v, &said(&[gamma(1.0)]), None), COLOUR),
        (
            "gAMA of sRGB",
            coded(srgb, &said(&[gamma(0.45455), rec709.clone()]), None),
            COLOUR,
        ),
        (
            "gAMA 1/1.8",
            coded(power(1.8), &said(&[gamma(0.55556)]), None),
            COLOUR,
        ),
        (
            "sRGB before gAMA",
            coded(srgb, &said(&[("sRGB", vec![0]), gamma(0.5)]), None),
            COLOUR,
        ),
        (
            "gAMA, cHRM",
            coded(power(2.2), &said(&[gamma(0.45455), primaries(5)]), None),
            SPACES[5].2,
        ),
        (
            "cHRM",
            coded(srgb, &said(&[primaries(4)]), None),
            SPACES[4].2,
        ),
        (
            "cICP P3",
            coded(srgb, &said(&[("cICP", vec![12, 13, 0, 1])]), None),
            SPACES[3].2,
        ),
        (
            "cICP BT.2020",
            coded(
                camera,
                &said(&[("cICP", vec![9, 14, 0, 1]), gamma(0.3)]),
                None,
            ),
            SPACES[4].2,
        ),
        (
            "cICP linear",
            coded(|v| v, &said(&[("cICP", vec![1, 8, 0, 1])]), None),
            COLOUR,
        ),
        (
            "Adobe's profile",
            coded(power(2.19921875), &[], Some(profile(ADOBE_D50, 2.19921875))),
            SPACES[5].2,
        ),
    ] {
        // A code of 16 bits; Adobe's profile has five digits, and rounds D65.
        let allowed = if name.starts_with("Adobe") {
            2e-3
        } else {
            5e-5
        };
        close(seen(&bytes), shown(expected), allowed, name);
    }
    for (chunk, words) in [
        (vec![9, 16, 0, 1], "the transfer PQ (number 16)"),
        (vec![9, 18, 0, 1], "the transfer HLG"),
        (vec![1, 13, 0, 0], "no RGB of full range"),
        (vec![1, 13, 6, 1], "the matrix coefficients number 6"),
        (vec![2, 13, 0, 1], "the primaries number 2"),
    ] {
        let message = unseen(&coded(srgb, &said(&[("cICP", chunk)]), None));
        assert!(message.contains(words), "{message}");
    }
    let message = unseen(&coded(srgb, &[], Some(b"no profile".to_vec())));
    assert!(
        message.contains("ICC profile cannot be read") || message.contains("corrupt"),
        "{message}"
    );
}

#[test]
fn every_kind_of_png_is_read() {
    use png::BitDepth::{Eight, Four, One, Sixteen, Two};
    use png::ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgba};
    let linear = |code: f64| files::linear_of_srgb(code);
    let of = |colour, depth, width, codes: &[u8]| {
        lobes::picture::Picture::from_bytes(&png_row(colour, depth, width, codes, &[], &[], None))
            .unwrap()
    };
    for (depth, byte, expected) in [
        (One, 0b0100_0000, [0.0, 1.0]),
        (Two, 0b0110_0000, [1.0 / 3.0, 2.0 / 3.0]),
        (Four, 0x5a, [1.0 / 3.0, 2.0 / 3.0]),
    ] {
        let picture = of(Grayscale, depth, 2, &[byte]);
        for (pixel, code) in picture.radiance().zip(expected) {
            close(pixel, [linear(code); 3], 1e-12, "grey");
        }
        assert!(!picture.has_mask());
    }
    let palette = of(Indexed, One, 2, &[0b0100_0000]);
    assert!(palette.radiance().eq([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]));
    assert!(of(GrayscaleAlpha, Eight, 2, &[9, 255, 9, 0]).has_mask());
    assert!(of(Rgba, Sixteen, 1, &[0, 0, 0, 0, 0, 0, 0x7f, 0]).has_mask());
    // White of a single bit a pixel: 8256 pixels of a byte, at most.
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 4096, 2048);
    encoder.set_color(Grayscale);
    encoder.set_depth(One);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header().unwrap();
    writer
        .write_image_data(&vec![255; 4096 / 8 * 2048])
        .unwrap();
    writer.finish().unwrap();
    assert!(bytes.len() < 4096 * 2048 / files::MOST_PIXELS_PER_BYTE);
    let picture = lobes::picture::Picture::from_bytes(&bytes).unwrap();
    assert_eq!(
        (picture.width(), picture.get(2047, 4095)),
        (4096, Some([1.0; 3]))
    );
    // Cut off, wherever.
    for end in (0..bytes.len()).step_by(37) {
        assert!(
            lobes::picture::Picture::from_bytes(&bytes[..end]).is_err(),
            "{end}"
        );
    }
    // What claims more than its bytes can hold.
    bytes[18] = 0x7f;
    let message = unseen(&bytes);
    assert!(
        message.contains("claims") || message.contains("CRC"),
        "{message}"
    );
}

/// The bytes of a PNG's chunk.
fn chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let mut crc = !0u32;
    for byte in name.iter().chain(data) {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ ((crc & 1) * 0xedb8_8320);
        }
    }
    let length = u32::try_from(data.len()).unwrap().to_be_bytes();
    [&length[..], name, data, &(!crc).to_be_bytes()].concat()
}

/// A PNG of eight bits and three channels, its pixels stored as they are (deflate without packing).
fn png_of(width: u32, height: u32, interlaced: bool, rows: &[u8]) -> Vec<u8> {
    let (mut a, mut b) = (1u32, 0u32);
    for byte in rows {
        a = (a + u32::from(*byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    let length = u16::try_from(rows.len()).unwrap();
    let mut data = vec![0x78, 0x01, 1];
    data.extend(length.to_le_bytes());
    data.extend((!length).to_le_bytes());
    data.extend(rows);
    data.extend((b << 16 | a).to_be_bytes());
    let mut header = [width.to_be_bytes(), height.to_be_bytes()].concat();
    header.extend([8, 2, 0, 0, u8::from(interlaced)]);
    [
        &b"\x89PNG\r\n\x1a\n"[..],
        &chunk(b"IHDR", &header),
        &chunk(b"IDAT", &data),
        &chunk(b"IEND", &[]),
    ]
    .concat()
}

/// PNG's seven passes (third edition, 8.1): first column and row of each, and the steps.
const ADAM7: [[usize; 4]; 7] = [
    [0, 0, 8, 8],
    [4, 0, 8, 8],
    [0, 4, 4, 8],
    [2, 0, 4, 4],
    [0, 2, 2, 4],
    [1, 0, 2, 2],
    [0, 1, 1, 2],
];

#[test]
fn interlaced_pngs_are_read_pixel_by_pixel() {
    let of = |bytes: &[u8]| lobes::picture::Picture::from_bytes(bytes).unwrap();
    // Of some sizes there is nothing in some of the passes.
    for (width, height) in [(1, 1), (3, 2), (5, 5), (9, 11), (16, 8)] {
        let code = |row: usize, column: usize| [7 * row, 13 * column, row * width + column];
        let mut rows = Vec::new();
        let mut straight = Vec::new();
        let put = |rows: &mut Vec<u8>, row: usize, columns: Vec<usize>| {
            if !columns.is_empty() {
                rows.push(0);
                for column in columns {
                    rows.extend(code(row, column).map(|code| u8::try_from(code).unwrap()));
                }
            }
        };
        for [left, top, across, down] in ADAM7 {
            for row in (top..height).step_by(down) {
                put(&mut rows, row, (left..width).step_by(across).collect());
            }
        }
        for row in 0..height {
            put(&mut straight, row, (0..width).collect());
        }
        let (w, h) = (width as u32, height as u32);
        let picture = of(&png_of(w, h, true, &rows));
        for (index, pixel) in picture.radiance().enumerate() {
            let expected = code(index / width, index % width)
                .map(|code| files::linear_of_srgb(code as f64 / 255.0));
            close(pixel, expected, 1e-12, "an interlaced pixel");
        }
        assert_eq!(picture, of(&png_of(w, h, false, &straight)));
        // Cut off, wherever.
        let bytes = png_of(w, h, true, &rows);
        for end in (0..bytes.len() - 12).step_by(11) {
            assert!(lobes::picture::Picture::from_bytes(&bytes[..end]).is_err());
        }
    }
}

/// TIFF 6, page 36: at which sides of what is seen the first row and the first column of what is
/// stored are.
#[test]
fn orientation_turns_and_mirrors_a_picture_of_many_pixels() {
    use png::BitDepth::Eight;
    let (width, height) = (3usize, 2usize);
    // A name for each pixel.
    let stored = |row: usize, column: usize| (10 * row + column) as u8;
    for orientation in 1..=8u8 {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(Eight);
        let mut writer = encoder.write_header().unwrap();
        let mut exif = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec();
        exif.extend([orientation, 0, 0, 0, 0, 0, 0, 0]);
        writer.write_chunk(png::chunk::eXIf, &exif).unwrap();
        let codes: Vec<u8> = (0..width * height)
            .map(|i| stored(i / width, i % width))
            .collect();
        writer.write_image_data(&codes).unwrap();
        writer.finish().unwrap();
        let picture = lobes::picture::Picture::from_bytes(&bytes).unwrap();
        // What is seen, rows from the top, as names.
        let expected: &[&[u8]] = match orientation {
            1 => &[&[0, 1, 2], &[10, 11, 12]],
            // The first column is at the right.
            2 => &[&[2, 1, 0], &[12, 11, 10]],
            // The first row is at the bottom, and the first column at the right.
            3 => &[&[12, 11, 10], &[2, 1, 0]],
            // The first row is at the bottom.
            4 => &[&[10, 11, 12], &[0, 1, 2]],
            // The first row is at the left, the first column at the top.
            5 => &[&[0, 10], &[1, 11], &[2, 12]],
            // At the right and at the top.
            6 => &[&[10, 0], &[11, 1], &[12, 2]],
            // At the right and at the bottom.
            7 => &[&[12, 2], &[11, 1], &[10, 0]],
            // At the left and at the bottom.
            _ => &[&[2, 12], &[1, 11], &[0, 10]],
        };
        assert_eq!(
            (picture.height(), picture.width()),
            (expected.len(), expected[0].len()),
            "{orientation}"
        );
        for (pixel, name) in picture.radiance().zip(expected.concat()) {
            let value = files::linear_of_srgb(f64::from(name) / 255.0);
            close(pixel, [value; 3], 1e-12, &format!("{orientation}"));
        }
    }
}

/// EXIF of one entry, an orientation, before the pixels of a PNG or after them.
#[test]
fn orientation_is_undone_wherever_it_stands() {
    let codes = [255, 0, 0, 0, 0, 255];
    for orientation in 1..=8 {
        let mut exif = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec();
        exif.extend([orientation, 0, 0, 0, 0, 0, 0, 0]);
        let chunk = [(b"eXIf", exif)];
        for (before, after) in [(&chunk[..], &[][..]), (&[][..], &chunk[..])] {
            let bytes = png_row(
                png::ColorType::Rgb,
                png::BitDepth::Eight,
                2,
                &codes,
                before,
                after,
                None,
            );
            let picture = lobes::picture::Picture::from_bytes(&bytes).unwrap();
            let size = if orientation > 4 { (1, 2) } else { (2, 1) };
            assert_eq!((picture.width(), picture.height()), size, "{orientation}");
            // TIFF 6: where the first row and the first column of what is stored are to be seen. Of
            // a single row, red comes first where the first column is on the left or at the top.
            let red_first = matches!(orientation, 1 | 4 | 5 | 6);
            let first = picture.get(0, 0).unwrap();
            assert_eq!(
                first == [1.0, 0.0, 0.0],
                red_first,
                "{orientation}: {first:?}"
            );
        }
    }
}

/// A picture of noise, whose every block takes many bits.
fn jpeg(set: impl Fn(&mut image::codecs::jpeg::JpegEncoder<&mut Vec<u8>>)) -> Vec<u8> {
    let mut random = Pcg64::seed_from_u64(8);
    let codes: Vec<u8> = (0..3 * 48 * 40).map(|_| random.random()).collect();
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 80);
    set(&mut encoder);
    encoder
        .encode(&codes, 48, 40, image::ExtendedColorType::Rgb8)
        .unwrap();
    bytes
}

#[test]
fn damaged_jpegs_are_refused() {
    let whole = jpeg(|_| ());
    let decoded = |bytes: &[u8]| lobes::picture::Picture::from_bytes(bytes);
    assert!(decoded(&whole).is_ok());
    let scan = whole.windows(2).position(|w| w == [0xff, 0xda]).unwrap() + 14;
    for end in (0..whole.len()).step_by(53).chain([whole.len() - 1]) {
        assert!(decoded(&whole[..end]).is_err(), "{end}");
        let closed = [&whole[..end.max(2)], &[0xff, 0xd9]].concat();
        assert!(end == whole.len() - 1 || decoded(&closed).is_err(), "{end}");
    }
    // A JPEG without restart markers has no checksum: damage within shows only where the codes end
    // too early or too late, or none is one. Of this picture's 86 pieces of damage 67 show; what
    // decodes to the end cannot be known from a picture.
    let (mut found, mut count) = (0, 0);
    for start in (scan..whole.len() - 120).step_by(61) {
        let without = [&whole[..start], &whole[start + 40..]].concat();
        let mut zeroed = whole.clone();
        zeroed[start..start + 30].fill(0);
        for damaged in [without, zeroed] {
            found += usize::from(decoded(&damaged).is_err());
            count += 1;
        }
    }
    assert!(4 * found >= 3 * count, "{found} of {count}");
    let trailing = [&whole[..], b"what follows the end of the picture"].concat();
    assert!(decoded(&trailing).is_ok());
}

/// Each component by itself and two of them subsampled: baseline, which the decoder misreads.
#[test]
fn jpegs_by_component_are_refused_where_they_are_subsampled() {
    let mut bytes = jpeg(|_| ());
    let frame = bytes.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    bytes[frame + 2 + 2 + 6 + 1] = 0x22;
    let scan = bytes.windows(2).position(|w| w == [0xff, 0xda]).unwrap();
    bytes.splice(scan + 2..scan + 14, [0, 8, 1, 1, 0, 0, 63, 0]);
    let message = unseen(&bytes);
    assert!(
        message.contains("each of its subsampled components by itself"),
        "{message}"
    );
    // Four components: CMYK.
    let mut bytes = jpeg(|_| ());
    bytes.splice(
        frame + 2..frame + 19,
        [
            0, 20, 8, 0, 8, 0, 8, 4, 1, 17, 0, 2, 17, 0, 3, 17, 0, 4, 17, 0,
        ],
    );
    let message = unseen(&bytes);
    assert!(message.contains("4 components, as CMYK"), "{message}");
}

/// A progressive JPEG of 28 × 20 pixels with subsampled chroma, by Pillow 13.0.0 (libjpeg-turbo),
/// and two of its pixels as Pillow reads them.
const PROGRESSIVE: &str = "ffd8ffe000104a46494600010100000100010000ffdb0043000d090a0b0a080d0b0a0b0e0e0d0f13201513121213271c1e17202e2931302e292d2c33\
     3a4a3e333646372c2d405741464c4e525352323e5a615a50604a51524fffdb0043010e0e0e131113261515264f352d354f4f4f4f4f4f4f4f4f4f4f4f\
     4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4f4fffc20011080014001c03012200021101031101ffc400\
     17000101010100000000000000000000000003000504ffc400160101010100000000000000000000000000040302ffda000c03010002100310000001\
     e96cf59074178128cc75a56596a8bfffc4001810010101010100000000000000000000000001021210ffda00080101000105029a4d269d269349a748\
     89e7ffc400161101010100000000000000000000000000000203ffda0008010301013f018cd19a10ffc4001611010101000000000000000000000000\
     00000103ffda0008010201013f0198a6288fffc40014100100000000000000000000000000000030ffda0008010100063f024fffc400171001010101\
     00000000000000000000000001001020ffda0008010100013f21d00e00113264c2dfffda000c03010002000300000010967783ffc400161101010100\
     000000000000000000000000000121ffda0008010301013f10582518ffc400161101010100000000000000000000000000010010ffda000801020101\
     3f10c8240bffc400191001000301010000000000000000000000003151612111ffda0008010100013f10d9b367096cd9b384af2f2f3c52ffd9";

#[test]
fn progressive_jpegs_are_read_whole_or_not_at_all() {
    let bytes: Vec<u8> = (0..PROGRESSIVE.len() / 2)
        .map(|i| u8::from_str_radix(&PROGRESSIVE[2 * i..2 * i + 2], 16).unwrap())
        .collect();
    let picture = lobes::picture::Picture::from_bytes(&bytes).unwrap();
    for (row, column, expected) in [(3, 5, [67, 230, 89]), (17, 24, [190, 113, 225])] {
        let pixel = picture.get(row, column).unwrap();
        for (value, code) in pixel.into_iter().zip(expected) {
            let got = 255.0 * files::srgb_of_linear(value);
            assert!((got - f64::from(code)).abs() <= 3.0, "{got} {code}");
        }
    }
    let scans: Vec<usize> = (0..bytes.len() - 1)
        .filter(|i| bytes[*i..*i + 2] == [0xff, 0xda])
        .collect();
    assert!(scans.len() > 5);
    for end in 0..bytes.len() {
        assert!(
            lobes::picture::Picture::from_bytes(&bytes[..end]).is_err(),
            "{end}"
        );
    }
    // Each scan without its last bytes: what follows stands where bits are wanted.
    for pair in scans.windows(2) {
        let mut cut = bytes.clone();
        let next = (pair[0] + 2..pair[1])
            .find(|i| bytes[*i] == 0xff && bytes[*i + 1] != 0)
            .unwrap_or(pair[1]);
        cut.drain(next - 2..next);
        assert!(
            lobes::picture::Picture::from_bytes(&cut).is_err(),
            "{pair:?}"
        );
    }
}

#[test]
fn jpegs_heed_their_profile() {
    use image::ImageEncoder;
    let of = |profile: Option<Vec<u8>>| {
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100);
        if let Some(profile) = profile {
            encoder.set_icc_profile(profile).unwrap();
        }
        let codes = COLOUR.map(|value| (255.0 * value.powf(1.0 / 2.19921875)).round() as u8);
        encoder
            .encode(
                &codes.repeat(16 * 16),
                16,
                16,
                image::ExtendedColorType::Rgb8,
            )
            .unwrap();
        seen(&bytes)
    };
    close(
        of(Some(profile(ADOBE_D50, 2.19921875))),
        shown(SPACES[5].2),
        0.015,
        "Adobe RGB",
    );
    assert!((of(None)[0] - 0.2).abs() < 0.02);
}

/// A gain map is known by what XMP or ISO 21496-1 say of it, and left aside.
#[test]
fn a_gain_map_is_told() {
    let mut plain = Vec::new();
    image::codecs::jpeg::JpegEncoder::new(&mut plain)
        .encode(&[90; 3 * 16 * 16], 16, 16, image::ExtendedColorType::Rgb8)
        .unwrap();
    let with = |marker: u8, contents: &[u8]| {
        let length = (contents.len() as u16 + 2).to_be_bytes();
        let segment = [&[0xff, marker], &length[..], contents].concat();
        [&plain[..2], &segment, &plain[2..]].concat()
    };
    let read = |bytes: &[u8]| lobes::picture::Picture::from_bytes(bytes).unwrap();
    assert!(!read(&plain).has_gain_map());
    let xmp = |words: &str| format!("http://ns.adobe.com/xap/1.0/\0<x:xmpmeta {words}/>");
    let google = with(0xe1, xmp("hdrgm:Version=\"1.0\"").as_bytes());
    let iso = with(0xe2, b"urn:iso:std:iso:ts:21496:-1\0\0\0\0\0");
    for bytes in [&google, &iso] {
        assert!(read(bytes).has_gain_map());
        assert_eq!(read(bytes).get(3, 3), read(&plain).get(3, 3));
    }
    let other = with(0xe1, xmp("dc:title=\"a ball\"").as_bytes());
    assert!(!read(&other).has_gain_map());
}
