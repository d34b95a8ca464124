//! Environment maps from pictures: other mappings, other sizes, folders, and whatever is wrong with
//! a file.
#![cfg(feature = "files")]

use approx::assert_abs_diff_eq;
use std::f64::consts::PI;
use std::path::Path;

use lobes::Error;
use lobes::files::{self, Picture, Precision};
use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, read, read_folder};
use lobes::sphere::Mapping;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Three different smooth fields, none of which has a symmetry that would hide a flip.
fn field(d: DVec3) -> [f64; 3] {
    let lobe = |centre: DVec3| (6.0 * (d.dot(centre.normalize()) - 1.0)).exp();
    [
        1.0 + 0.5 * d.x + 0.3 * d.y * d.z,
        0.5 + 0.4 * d.y + lobe(DVec3::new(0.3, 0.4, -1.0)),
        0.7 + 0.6 * d.z + lobe(DVec3::new(-0.8, 0.1, 0.9)),
    ]
}

/// The fields' exact means: the linear parts have none, and ∫ e^(κ(x − 1)) dx / 2 = (1 −
/// e^(−2κ))/2κ.
fn means() -> [f64; 3] {
    let lobe = (1.0 - (-12.0f64).exp()) / 12.0;
    [1.0, 0.5 + lobe, 0.7 + lobe]
}

/// The size of a picture of about so many pixels across.
fn size(mapping: Mapping, across: usize) -> (usize, usize) {
    let (a, b) = mapping.aspect();
    let unit = across / a;
    (unit * a, unit * b)
}

fn drawn(mapping: Mapping, across: usize, field: impl Fn(DVec3) -> [f64; 3]) -> Picture {
    let (width, height) = size(mapping, across);
    let pixels = (0..width * height)
        .map(|index| {
            let u = ((index % width) as f64 + 0.5) / width as f64;
            let v = ((index / width) as f64 + 0.5) / height as f64;
            mapping.direction(u, v).map_or([f64::NAN; 3], &field)
        })
        .collect();
    Picture {
        width,
        height,
        pixels,
    }
}

fn converted(mapping: Mapping, picture: Picture) -> EnvironmentMap {
    EnvironmentMap::from_picture("m", mapping, picture.width, picture.height, picture.pixels)
        .unwrap()
}

/// The largest error of the function, and that of its mean, over the fields' range of about 2.
fn errors(mapping: Mapping, across: usize) -> (f64, f64) {
    let map = converted(mapping, drawn(mapping, across, field));
    let mut random = Pcg64::seed_from_u64(7);
    let mut largest = 0.0f64;
    for _ in 0..4000 {
        let y: f64 = random.random_range(-1.0..1.0);
        let azimuth: f64 = random.random_range(-PI..PI);
        let s = (1.0 - y * y).sqrt();
        let d = DVec3::new(s * azimuth.sin(), y, -s * azimuth.cos());
        // Behind the ball, the last half pixel of the rim is 2 √(2/n) wide: 17° at n = 96.
        if mapping == Mapping::MirrorBall && d.z < -0.85 {
            continue;
        }
        for (got, expected) in map.radiance(d).into_iter().zip(field(d)) {
            largest = largest.max((got - expected).abs());
        }
    }
    let mean = (0..3)
        .map(|channel| (map.mean()[channel] - means()[channel]).abs())
        .fold(0.0, f64::max);
    (largest, mean)
}

#[test]
fn every_mapping_gives_the_same_light() {
    for mapping in Mapping::ALL {
        let (coarse, _) = errors(mapping, 96);
        let (fine, mean) = errors(mapping, 192);
        println!("{mapping}: {coarse:.2e} {fine:.2e}, mean {mean:.2e}");
        assert!(fine < 1e-2 && mean < 2e-4, "{mapping}: {fine:e} {mean:e}");
        assert!(
            fine < coarse / 2.0,
            "{mapping} does not converge: {coarse:e} {fine:e}"
        );
    }
}

/// One pixel of light: the map holds what the picture's pixel holds, radiance times solid angle.
#[test]
fn a_lamp_keeps_its_light() {
    for mapping in [
        Mapping::AngularMap,
        Mapping::MirrorBall,
        Mapping::VerticalCross,
        Mapping::HorizontalCross,
    ] {
        let mut worst = 0.0f64;
        for (along, down) in [
            (0.5, 0.4),
            (0.55, 0.45),
            (0.42, 0.37),
            (0.62, 0.52),
            (0.73, 0.45),
            (0.5, 0.04),
            (0.93, 0.45),
        ] {
            let mut picture = drawn(mapping, 96, |_| [0.0; 3]);
            let column = (along * picture.width as f64) as usize;
            let row = (down * picture.height as f64) as usize;
            let index = row * picture.width + column;
            if picture.pixels[index][0].is_nan() {
                continue;
            }
            let (w, h) = (picture.width as f64, picture.height as f64);
            let density =
                mapping.solid_angle_density((column as f64 + 0.5) / w, (row as f64 + 0.5) / h);
            picture.pixels[index] = [1.0; 3];
            let map = converted(mapping, picture);
            let light: f64 = (0..map.height())
                .map(|row| {
                    map.solid_angle(row)
                        * (0..map.width()).map(|c| map.pixel(row, c)[0]).sum::<f64>()
                })
                .sum();
            let kept = light / (density / (w * h));
            println!("{mapping} {along} {down}: {kept:.4}");
            worst = worst.max((kept - 1.0).abs());
        }
        assert!(worst < 0.06, "{mapping}: {worst}");
    }
}

#[test]
fn resampling_keeps_the_light() {
    let mut random = Pcg64::seed_from_u64(5);
    let pixels = (0..2 * 24 * 24).map(|_| std::array::from_fn(|_| random.random::<f64>()));
    let map = EnvironmentMap::new("m", 48, 24, pixels.collect()).unwrap();
    let light = |map: &EnvironmentMap| -> f64 {
        (0..map.height())
            .map(|row| {
                map.solid_angle(row) * (0..map.width()).map(|c| map.pixel(row, c)[1]).sum::<f64>()
            })
            .sum()
    };
    for height in [2, 5, 8, 12, 24, 31, 48, 100] {
        let other = map.resampled(2 * height, height).unwrap();
        assert!(
            (light(&other) / light(&map) - 1.0).abs() < 1e-13,
            "{height}"
        );
    }
    let same = map.resampled(48, 24).unwrap();
    for (a, b) in same
        .pixels()
        .as_flattened()
        .iter()
        .zip(map.pixels().as_flattened())
    {
        assert_abs_diff_eq!(a, b, epsilon = 1e-14);
    }
    // Halving: the mean of 2 × 2 pixels weighed by their solid angles.
    let half = map.resampled(24, 12).unwrap();
    let (a, b) = (map.solid_angle(6), map.solid_angle(7));
    let expected = (a * (map.pixel(6, 4)[0] + map.pixel(6, 5)[0])
        + b * (map.pixel(7, 4)[0] + map.pixel(7, 5)[0]))
        / (2.0 * (a + b));
    assert_abs_diff_eq!(half.pixel(3, 2)[0], expected, epsilon = 1e-14);
    for (width, height) in [(10, 4), (2, 1), (0, 0), (1 << 40, 1 << 39)] {
        assert!(matches!(
            map.resampled(width, height),
            Err(Error::Domain { .. })
        ));
    }
}

#[test]
fn a_folder_of_angular_maps_reads() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["b", "a"] {
        let mut picture = drawn(Mapping::AngularMap, 40, field);
        picture
            .pixels
            .iter_mut()
            .filter(|p| p[0].is_nan())
            .for_each(|p| *p = [0.0; 3]);
        files::write_exr(
            &folder.path().join(format!("{name}.exr")),
            &picture,
            Precision::Single,
        )
        .unwrap();
    }
    let wide = drawn(Mapping::LatLong, 32, field);
    files::write_exr(&folder.path().join("c.EXR"), &wide, Precision::Single).unwrap();
    std::fs::write(folder.path().join("README.txt"), "not a map").unwrap();
    std::fs::write(folder.path().join("._a.exr"), "what a Mac leaves").unwrap();
    let maps = read_folder(folder.path(), Some(Mapping::AngularMap)).unwrap();
    let names: Vec<_> = maps.iter().map(EnvironmentMap::name).collect();
    assert_eq!(names, ["a", "b", "c"]);
    assert_eq!((maps[0].width(), maps[0].height()), (40, 20));
    assert_eq!(maps[2].width(), 32);
    // Without a mapping the squares ask for one.
    let message = read_folder(folder.path(), None).unwrap_err().to_string();
    assert!(
        message.ends_with(
            "a.exr: a square of 40 by 40 pixels can be an angular map or a mirror ball; \
             say which with --mapping angular-map or --mapping mirror-ball"
        ),
        "{message}"
    );
}

#[test]
fn the_files_of_other_tools_are_light() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/pictures");
    let map = read(&folder.join("order+X-Y.hdr"), None).unwrap();
    assert_eq!(
        (map.name(), map.width(), map.height()),
        ("order+X-Y", 16, 8)
    );
    assert_eq!(
        map.pixels(),
        read(&folder.join("order-Y+X.hdr"), Some(Mapping::LatLong))
            .unwrap()
            .pixels()
    );
}

/// What OpenEXR's `envmap` says: a lat-long map is one, a cube is none of the mappings.
#[test]
fn the_attribute_of_environments_is_heeded() {
    use exr::meta::attribute::EnvironmentMap::{Cube, LatitudeLongitude};
    use exr::prelude::*;
    let file = tempfile::NamedTempFile::new().unwrap();
    let reading = |size: (usize, usize), said, mapping| {
        let channels = SpecificChannels::rgb(|_: Vec2<usize>| (1.0f32, 1.0f32, 1.0f32));
        let attributes = LayerAttributes {
            environment_map: said,
            ..LayerAttributes::default()
        };
        Image::from_layer(Layer::new(
            size,
            attributes,
            Encoding::UNCOMPRESSED,
            channels,
        ))
        .write()
        .to_file(file.path())
        .unwrap();
        lobes::illumination::read(file.path(), mapping).map_err(|error| error.to_string())
    };
    assert!(reading((8, 4), Some(LatitudeLongitude), None).is_ok());
    assert!(reading((8, 4), Some(LatitudeLongitude), Some(Mapping::LatLong)).is_ok());
    for (size, said, mapping, words) in [
        ((4, 24), Cube, None, "the six faces of a cube"),
        (
            (8, 8),
            LatitudeLongitude,
            Some(Mapping::AngularMap),
            "is a lat-long map, and angular-map was asked for",
        ),
    ] {
        let message = reading(size, Some(said), mapping).unwrap_err();
        assert!(message.contains(words), "{message}");
    }
}

/// Each is one sentence that names the file, what is wrong, and what to do.
#[test]
fn bad_files_and_folders_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, width: usize, height: usize, fill: f64, odd: f64| {
        let mut pixels = vec![[fill; 3]; width * height];
        pixels[5][1] = odd;
        let path = folder.path().join(name);
        files::write_exr(
            &path,
            &Picture {
                width,
                height,
                pixels,
            },
            Precision::Single,
        )
        .unwrap();
        path
    };
    let message = |path: &Path, mapping| {
        let message = read(path, mapping).unwrap_err().to_string();
        let (file, rest) = message.split_once(": ").unwrap();
        assert_eq!(file, path.display().to_string());
        rest.to_string()
    };
    for (name, width, height, fill, odd, expected) in [
        (
            "nan",
            8,
            4,
            1.0,
            f64::NAN,
            "the environment map holds NaN at index 16; every value must be finite; mend the file or leave it out",
        ),
        (
            "inf",
            8,
            4,
            1.0,
            f64::INFINITY,
            "the environment map holds inf at index 16; every value must be finite; mend the file or leave it out",
        ),
        (
            "negative",
            8,
            4,
            1.0,
            -0.5,
            "a radiance of the environment map is -0.5, which is not zero or above; negative light comes from resampling filters and must be set to zero; mend the file or leave it out",
        ),
        (
            "black",
            8,
            4,
            0.0,
            0.0,
            "every radiance of the environment map is 0, which is not above zero anywhere; a map must hold some light; mend the file or leave it out",
        ),
        (
            "shape",
            7,
            4,
            1.0,
            1.0,
            "7 by 4 pixels fit no mapping of the sphere; give a lat-long map (2:1), an angular map or mirror ball (1:1), or a cross (3:4 or 4:3)",
        ),
    ] {
        let path = write(&format!("{name}.exr"), width, height, fill, odd);
        assert_eq!(message(&path, None), expected);
    }
    // The same under another mapping; what is outside the disc does not matter.
    let middle = 5 * 11;
    for (value, words) in [
        (f64::NAN, "holds NaN"),
        (-1.0, "is -1"),
        (f64::INFINITY, "holds inf"),
    ] {
        let mut picture = drawn(Mapping::MirrorBall, 11, |_| [1.0; 3]);
        assert!(picture.pixels[0][0].is_nan());
        picture.pixels[middle] = [value; 3];
        let path = folder.path().join("ball.exr");
        files::write_exr(&path, &picture, Precision::Single).unwrap();
        let message = message(&path, Some(Mapping::MirrorBall));
        assert!(message.contains(words), "{message}");
    }
    let square = write("square.exr", 8, 8, 1.0, 1.0);
    assert_eq!(
        message(&square, Some(Mapping::LatLong)),
        "8 by 8 pixels are no lat-long, which is 2:1; give another --mapping"
    );
    let missing = folder.path().join("missing.exr");
    assert!(message(&missing, None).contains("the file cannot be read: No such file"));

    let bad = |path: &Path| read_folder(path, None).unwrap_err().to_string();
    let empty = tempfile::tempdir().unwrap();
    assert_eq!(
        bad(empty.path()),
        format!(
            "{}: the folder holds no environment map; put .exr, .hdr, .pic or .pfm files into it",
            empty.path().display()
        )
    );
    assert!(bad(&empty.path().join("none")).contains("the folder cannot be listed: No such file"));
    assert!(bad(&square).contains("the folder cannot be listed"));
    for name in ["sky.exr", "sky.hdr"] {
        std::fs::copy(&square, empty.path().join(name)).unwrap();
    }
    let message = bad(empty.path());
    assert!(
        message
            .ends_with("sky.hdr: the map has the name of sky.exr beside it; rename one of the two"),
        "{message}"
    );
    std::fs::remove_file(empty.path().join("sky.hdr")).unwrap();
    std::fs::write(empty.path().join("sky.exr"), "not a picture").unwrap();
    assert!(bad(empty.path()).contains("sky.exr: the file is none of OpenEXR"));
}
