//! The features that models learn from, kept between runs.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

use crate::classify::{Dataset, Observation, Reflectance, Sample, Training, TrainingPlan};
use crate::cli::progress;
use crate::illumination::EnvironmentMap;
use crate::reflectance::{Material, Variant};
use crate::{Parallelism, Result};

/// The training set: what an earlier run kept, or made now and kept.
pub(super) fn load(
    maps: &[EnvironmentMap],
    materials: &[Material],
    lobe: Variant,
    turns: usize,
    fresh: bool,
) -> Result<Training> {
    let path = place(maps, materials, lobe, turns);
    let kept = path.as_deref().filter(|_| !fresh).and_then(|path| {
        let bytes = std::fs::read(path).ok()?;
        unpack(&bytes, maps, materials)
    });
    if let Some(training) = kept {
        return Ok(training);
    }
    let mut plan = TrainingPlan::default();
    plan.plan.lobe = lobe;
    plan.plan.turns = turns;
    let bar = progress::bar(2 * maps.len(), "learning");
    let training = Training::new(maps, materials, &plan, Parallelism::Rayon, &|| bar.inc(1))?;
    bar.finish_and_clear();
    if let Some(path) = path {
        keep(&path, &pack(&training));
    }
    Ok(training)
}

/// Where a training set is kept: in the user's folder for caches, by all that it depends on.
fn place(
    maps: &[EnvironmentMap],
    materials: &[Material],
    lobe: Variant,
    turns: usize,
) -> Option<PathBuf> {
    let folder = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .filter(|path| path.is_absolute())
        .or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))?;
    let mut hasher = DefaultHasher::new();
    (env!("CARGO_PKG_VERSION"), FORMAT, lobe.name(), turns).hash(&mut hasher);
    let numbers = |hasher: &mut DefaultHasher, values: &[f64]| {
        for value in values {
            value.to_bits().hash(hasher);
        }
    };
    for material in materials {
        material.name().hash(&mut hasher);
        numbers(&mut hasher, &material.diffuse());
        numbers(&mut hasher, &material.specular());
        numbers(&mut hasher, &[material.roughness().sigma()]);
    }
    for map in maps {
        map.name().hash(&mut hasher);
        (map.width(), map.height()).hash(&mut hasher);
        for i in 0..map.width() * map.height() {
            numbers(&mut hasher, &map.pixel(i / map.width(), i % map.width()));
        }
    }
    let name = format!("training-{:016x}.bin", hasher.finish());
    Some(folder.join("lobes").join(name))
}

/// What stands first in a file; it changes with what is kept, and with the renderer that it is learned from.
const FORMAT: &[u8; 8] = b"lobes-t5";

/// Keeps the bytes if it can: without them the next run learns anew.
fn keep(path: &std::path::Path, bytes: &[u8]) {
    if let Some(folder) = path.parent() {
        let _ = std::fs::create_dir_all(folder);
    }
    let _ = crate::cli::output::write_file(path, bytes);
}

fn pack(training: &Training) -> Vec<u8> {
    let width = training
        .named
        .observations
        .first()
        .map_or(0, |o| o.view.len());
    let mut numbers = vec![
        width as f64,
        training.named.observations.len() as f64,
        training.random.len() as f64,
        training.named.render_error,
    ];
    for o in &training.named.observations {
        numbers.extend([o.material as f64, o.illumination as f64, o.turn as f64]);
        numbers.extend(&o.view);
    }
    for s in &training.random {
        let judged = f64::from(u8::from(s.judged));
        numbers.extend([s.illumination as f64, judged, s.truth.share, s.truth.sigma]);
        numbers.extend(&s.view);
    }
    let mut bytes = FORMAT.to_vec();
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    bytes
}

/// Nothing for bytes that are not whole.
fn unpack(bytes: &[u8], maps: &[EnvironmentMap], materials: &[Material]) -> Option<Training> {
    let body = bytes.strip_prefix(FORMAT)?;
    let mut numbers = body.chunks_exact(8).map(|chunk| {
        let mut eight = [0; 8];
        eight.copy_from_slice(chunk);
        f64::from_le_bytes(eight)
    });
    let mut next = || numbers.next();
    let (width, named, random) = (next()? as usize, next()? as usize, next()? as usize);
    let render_error = next()?;
    let expected = named
        .checked_mul(width.checked_add(3)?)?
        .checked_add(random.checked_mul(width.checked_add(4)?)?)?
        .checked_add(4)?;
    if body.len() != expected.checked_mul(8)? {
        return None;
    }
    let mut observations = Vec::with_capacity(named);
    for _ in 0..named {
        let (material, illumination, turn) = (next()? as usize, next()? as usize, next()? as usize);
        let view = (0..width).map(|_| next()).collect::<Option<Vec<f64>>>()?;
        if material >= materials.len() || illumination >= maps.len() {
            return None;
        }
        observations.push(Observation {
            material,
            illumination,
            turn,
            view,
        });
    }
    let mut samples = Vec::with_capacity(random);
    for _ in 0..random {
        let illumination = next()? as usize;
        let judged = next()? != 0.0;
        let truth = Reflectance {
            share: next()?,
            sigma: next()?,
        };
        let view = (0..width).map(|_| next()).collect::<Option<Vec<f64>>>()?;
        samples.push(Sample {
            illumination,
            judged,
            truth,
            view,
        });
    }
    Some(Training {
        named: Dataset {
            materials: materials.iter().map(|m| m.name().to_owned()).collect(),
            illuminations: maps.iter().map(|m| m.name().to_owned()).collect(),
            observations,
            render_error,
        },
        random: samples,
    })
}
