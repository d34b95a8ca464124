//! The trial of `lobes classify` itself: pictures in files, under light that it has not learned
//! from.

use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::output::sphere_exr;
use crate::progress;
use crate::report::FilesRow;
use lobes::files::srgb8_of_linear;
use lobes::illumination::{EnvironmentMap, Luminance};
use lobes::inference::{Model, Plan, SphereFeatures, Training, View, collect};
use lobes::picture::encode_png;
use lobes::picture::{Circle, Picture};
use lobes::reflectance::Material;
use lobes::reflection::{SphereImage, Viewpoint};
use lobes::{Error, Parallelism, Result};

/// The kinds of files, in the order of the rows.
const KINDS: [&str; 5] = [
    "rendered, PNG with alpha, level",
    "rendered, EXR, level",
    "rendered, EXR, 35° above, at 6 radii",
    "rendered, PNG without alpha, 35° above, at 6 radii",
    "photograph, JPEG, before a wall, 35° above, at 6 radii",
];

/// What came of one file: its kind, its features, and how far off the circle was in radii.
type Outcome = (usize, Result<(SphereFeatures, f64)>);

/// Renders every material under every light, writes the pictures into files, reads them again as
/// `lobes classify` does, and names them by what was learned under the other lights.
pub(super) fn run(
    maps: &[EnvironmentMap],
    materials: &[Material],
    training: &Training,
    plan: &Plan,
    seed: u64,
) -> Result<Vec<FilesRow>> {
    let folder = std::env::temp_dir().join(format!("lobes-trial-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|error| {
        Error::file(
            &folder,
            format!("the folder cannot be made: {error}"),
            "set TMPDIR to a place that can be written",
        )
    })?;
    let outcomes = outcomes(maps, materials, plan, seed, &folder);
    // What is left of it harms nobody.
    let _ = std::fs::remove_dir_all(&folder);
    let outcomes = outcomes?;
    let all = vec![true; maps.len()];
    let scenes = training.named.scenes.among(&all);
    let bar = progress::bar(scenes.len(), "files");
    let folds = Parallelism::Rayon.map(scenes.len(), |fold| {
        let seen = training.named.scenes.others(&all, scenes[fold]);
        let model = Model::learn_from(training, &seen, Parallelism::Sequential)?;
        let mut rows = vec![FilesRow::default(); KINDS.len()];
        let of = outcomes.iter().filter(|o| !seen[o.0]);
        for (_, material, (kind, outcome)) in of {
            let row = &mut rows[*kind];
            row.total += 1;
            let Ok((features, off)) = outcome else {
                continue;
            };
            row.read += 1;
            row.circle_errors.push(*off);
            let verdict = model.verdict(features)?;
            let best = (0..materials.len())
                .max_by(|&a, &b| verdict.probabilities[a].total_cmp(&verdict.probabilities[b]));
            if let Some(said) = best {
                row.correct += usize::from(said == *material);
                row.finish +=
                    usize::from(materials[said].finish() == materials[*material].finish());
            }
            row.strange += usize::from(verdict.material().is_none());
        }
        bar.inc(1);
        Ok(rows)
    });
    bar.finish_and_clear();
    let mut rows = vec![FilesRow::default(); KINDS.len()];
    for (row, kind) in rows.iter_mut().zip(KINDS) {
        kind.clone_into(&mut row.kind);
    }
    for fold in folds {
        for (row, part) in rows.iter_mut().zip::<Vec<FilesRow>>(fold?) {
            row.total += part.total;
            row.read += part.read;
            row.correct += part.correct;
            row.finish += part.finish;
            row.strange += part.strange;
            row.circle_errors.extend(part.circle_errors);
        }
    }
    for row in &mut rows {
        row.circle_errors.sort_by(f64::total_cmp);
    }
    Ok(rows)
}

/// (illumination, material, outcome) of every file.
fn outcomes(
    maps: &[EnvironmentMap],
    materials: &[Material],
    plan: &Plan,
    seed: u64,
    folder: &Path,
) -> Result<Vec<(usize, usize, Outcome)>> {
    let plan = Plan { turns: 1, ..*plan };
    let mut all = Vec::new();
    for tilted in [false, true] {
        let view = View {
            elevation: if tilted { 35f64.to_radians() } else { 0.0 },
            viewpoint: if tilted {
                Viewpoint::Perspective { distance: 6.0 }
            } else {
                Viewpoint::Orthographic
            },
        };
        let bar = progress::bar(maps.len(), "pictures");
        let set = collect(
            &view.cameras(plan.turns)?,
            maps,
            materials,
            &plan,
            Parallelism::Rayon,
            &|| bar.inc(1),
            &|of, image| {
                let place = of.illumination * materials.len() + of.material;
                let stem = folder.join(format!("{}-{place}", u8::from(tilted)));
                let through = |kind: usize, ending: &str, bytes: Vec<u8>, truth: Circle| {
                    let path = stem.with_extension(ending);
                    std::fs::write(&path, bytes).map_err(|error| {
                        Error::file(&path, error.to_string(), "make room for it")
                    })?;
                    let outcome = read(&path, truth);
                    let _ = std::fs::remove_file(&path);
                    Ok((kind, outcome))
                };
                let half = 0.5 * image.size() as f64;
                let filling = Circle {
                    x: half,
                    y: half,
                    radius: half,
                };
                if tilted {
                    let seed = seed.wrapping_mul(1 << 32).wrapping_add(place as u64);
                    let (jpeg, truth) = photograph(image, seed)?;
                    Ok(vec![
                        through(2, "exr", sphere_exr(image)?, filling)?,
                        through(3, "png", opaque_png(image)?, filling)?,
                        through(4, "jpg", jpeg, truth)?,
                    ])
                } else {
                    let pixel = |row, column| image.get(row, column);
                    let png = encode_png(image.size(), image.size(), 0.5, pixel)?;
                    Ok(vec![
                        through(0, "png", png, filling)?,
                        through(1, "exr", sphere_exr(image)?, filling)?,
                    ])
                }
            },
        )?;
        bar.finish_and_clear();
        for of in set.observations {
            let (illumination, material) = (of.illumination, of.material);
            all.extend(of.view.into_iter().map(|o| (illumination, material, o)));
        }
    }
    Ok(all)
}

/// As `lobes classify` reads a file.
fn read(path: &Path, truth: Circle) -> Result<(SphereFeatures, f64)> {
    let picture = Picture::read(path)?;
    let circle = picture.circle()?;
    let off = (circle.x - truth.x)
        .hypot(circle.y - truth.y)
        .max((circle.radius - truth.radius).abs());
    let features = SphereFeatures::of(&picture.sphere(circle)?)?;
    Ok((features, off / truth.radius))
}

fn not_encoded(format: &'static str, size: (usize, usize), problem: &impl ToString) -> Error {
    Error::Encoding {
        format,
        width: size.0,
        height: size.1,
        problem: problem.to_string(),
    }
}

/// Black behind the sphere, and no alpha.
fn opaque_png(image: &SphereImage) -> Result<Vec<u8>> {
    let size = image.size();
    let pixels = (0..size * size).map(|i| image.get(i / size, i % size).unwrap_or_default());
    let codes: Vec<u8> = pixels
        .flatten()
        .map(|value| srgb8_of_linear(0.5 * value))
        .collect();
    let side = u32::try_from(size).unwrap_or(u32::MAX);
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&codes, side, side, ExtendedColorType::Rgb8)
        .map_err(|error| not_encoded("PNG", (size, size), &error))?;
    Ok(bytes)
}

/// The sphere somewhere before a wall of patches, exposed to a mean of 0.2 · 2^(±1) of what
/// saturates, with noise, as JPEG of quality 90.
fn photograph(image: &SphereImage, seed: u64) -> Result<(Vec<u8>, Circle)> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let size = image.size();
    let (width, height) = (size * 8 / 5, size * 6 / 5);
    let left = (rng.random::<f64>() * (width - size) as f64) as usize;
    let top = (rng.random::<f64>() * (height - size) as f64) as usize;
    let mean = Luminance::Rec709.of(image.mean());
    let exposure = 0.2 * (2.0 * rng.random::<f64>() - 1.0).exp2() / mean;
    let patch = (size / 5).max(1);
    let patches: Vec<[f64; 3]> = (0..(width / patch + 1) * (height / patch + 1))
        .map(|_| {
            let bright = mean * 4f64.powf(2.0 * rng.random::<f64>() - 1.5);
            std::array::from_fn(|_| bright * (0.7 + 0.6 * rng.random::<f64>()))
        })
        .collect();
    let mut codes = Vec::with_capacity(3 * width * height);
    for i in 0..width * height {
        let (row, column) = (i / width, i % width);
        let seen = row.checked_sub(top).zip(column.checked_sub(left));
        let rgb = seen
            .and_then(|(row, column)| image.get(row, column))
            .unwrap_or(patches[row / patch * (width / patch + 1) + column / patch]);
        for value in rgb {
            let light = value * exposure;
            let deviation = (light / 1e4 + 1e-6).sqrt();
            // The sum of twelve uniform deviates, less six, is as good as normal here.
            let normal = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            codes.push(srgb8_of_linear(light + deviation * normal));
        }
    }
    let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, 90)
        .encode(&codes, side(width), side(height), ExtendedColorType::Rgb8)
        .map_err(|error| not_encoded("JPEG", (width, height), &error))?;
    let radius = 0.5 * size as f64;
    let truth = Circle {
        x: left as f64 + radius,
        y: top as f64 + radius,
        radius,
    };
    Ok((jpeg, truth))
}
