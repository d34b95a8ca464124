//! The features that models learn from, kept between runs.

use std::path::{Path, PathBuf};
use std::time::Instant;

use etcetera::BaseStrategy;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::Result;
use crate::{console, progress};
use lobes::Parallelism;
use lobes::illumination::EnvironmentMap;
use lobes::inference::{Dataset, Observation, Reflectance, Sample, Scenes, Training, TrainingPlan};
use lobes::reflectance::{Material, Variant};

/// What stands first in a file.
const MAGIC: &[u8] = b"lobes-training\n";

/// The version of what is kept; it changes with the renderer and the features that are learned
/// from.
const FORMAT: u32 = 6;

/// All that a training set depends on: a line of JSON that stands second in its file, and whose
/// hash is the file's name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Key {
    format: u32,
    version: String,
    lobe: String,
    cameras: usize,
    /// SHA-256 of the materials' names and numbers.
    materials: String,
    /// SHA-256 of the maps' names and pixels.
    lights: String,
}

impl Key {
    fn new(maps: &[EnvironmentMap], materials: &[Material], lobe: Variant, cameras: usize) -> Self {
        let mut of_materials = Sha256::new();
        for material in materials {
            name(&mut of_materials, material.name());
            numbers(&mut of_materials, &material.diffuse());
            numbers(&mut of_materials, &material.specular());
            numbers(&mut of_materials, &[material.roughness().sigma()]);
        }
        let mut of_lights = Sha256::new();
        for map in maps {
            name(&mut of_lights, map.name());
            of_lights.update((map.width() as u64).to_le_bytes());
            numbers(&mut of_lights, map.pixels().as_flattened());
        }
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            lobe: lobe.name().into(),
            cameras,
            materials: hex(&of_materials.finalize()),
            lights: hex(&of_lights.finalize()),
        }
    }

    fn json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }

    /// What is not the same in another one, in words.
    fn differences(&self, other: &Self) -> Vec<&'static str> {
        let version = (self.format, &self.version) != (other.format, &other.version);
        let parts = [
            (version, "another version of lobes"),
            (self.lobe != other.lobe, "another lobe"),
            (self.cameras != other.cameras, "another number of cameras"),
            (self.materials != other.materials, "other materials"),
            (self.lights != other.lights, "other maps"),
        ];
        let differs = parts.into_iter().filter(|(differs, _)| *differs);
        differs.map(|(_, what)| what).collect()
    }
}

/// A name with its length before it, so that no two lists of names run together.
fn name(hash: &mut Sha256, name: &str) {
    hash.update((name.len() as u64).to_le_bytes());
    hash.update(name.as_bytes());
}

fn numbers(hash: &mut Sha256, values: &[f64]) {
    for value in values {
        hash.update(value.to_le_bytes());
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The training set: what an earlier run kept, or made now and kept.
pub(super) fn load(
    maps: &[EnvironmentMap],
    materials: &[Material],
    lobe: Variant,
    turns: usize,
    fresh: bool,
) -> Result<Training> {
    let key = Key::new(maps, materials, lobe, turns);
    let path = folder().map(|folder| {
        let hash = hex(&Sha256::digest(key.json()));
        folder.join(format!("training-{}.bin", &hash[..16]))
    });
    if let Some(path) = path.as_deref().filter(|_| !fresh) {
        match std::fs::read(path) {
            Ok(bytes) => match unpack(&bytes, &key, maps, materials) {
                Some(training) => return Ok(training),
                None => console::complain(format!(
                    "lobes: {}: what was kept of an earlier run is damaged, and is made anew",
                    path.display()
                )),
            },
            Err(_) => {
                if let Some(why) = others(path, &key) {
                    console::note(format!(
                        "what earlier runs kept is of {why}, and is not used"
                    ));
                }
            }
        }
    }
    console::note(format!(
        "learning from {} materials under {} maps, once{}: half a minute on many cores, some minutes on few",
        materials.len(),
        maps.len(),
        match &path {
            Some(path) => format!(" (what is learned is kept in {})", path.display()),
            None => ", and again in the next run, since there is no folder to keep it in".into(),
        },
    ));
    let begin = Instant::now();
    let mut plan = TrainingPlan::default();
    plan.plan.lobe = lobe;
    plan.plan.turns = turns;
    let bar = progress::bar(2 * maps.len(), "learning");
    let training = Training::new(maps, materials, &plan, Parallelism::Rayon, &|| bar.inc(1))?;
    bar.finish_and_clear();
    let mut text = format!("learned in {:.0} s", begin.elapsed().as_secs_f64());
    if let Some(path) = path {
        let bytes = pack(&key, &training);
        text.push_str(&match keep(&path, &bytes) {
            Ok(()) => format!(
                "; kept {:.1} MB of features of pictures, which may be deleted at any time",
                bytes.len() as f64 / 1e6
            ),
            Err(error) => format!("; it is not kept, and the next run learns anew: {error}"),
        });
    }
    console::note(text);
    Ok(training)
}

/// Where this program keeps what it can make again: `$XDG_CACHE_HOME` or `~/.cache`,
/// `~/Library/Caches` of macOS, `%LOCALAPPDATA%` of Windows.
fn folder() -> Option<PathBuf> {
    let strategy = etcetera::base_strategy::choose_native_strategy().ok()?;
    Some(strategy.cache_dir().join("lobes"))
}

/// What is different about the set beside `path` that is the most alike, where there is one.
fn others(path: &Path, key: &Key) -> Option<String> {
    let files = std::fs::read_dir(path.parent()?).ok()?.flatten();
    let keys = files.filter_map(|file| read_key(&file.path()));
    let nearest = keys
        .map(|other| key.differences(&other))
        .min_by_key(Vec::len)?;
    (!nearest.is_empty()).then(|| nearest.join(", "))
}

fn read_key(path: &Path) -> Option<Key> {
    use std::io::{BufRead, Read};
    let mut file = std::io::BufReader::new(std::fs::File::open(path).ok()?).take(4096);
    let mut line = Vec::new();
    file.read_until(b'\n', &mut line).ok()?;
    if line != MAGIC {
        return None;
    }
    line.clear();
    file.read_until(b'\n', &mut line).ok()?;
    serde_json::from_slice(&line).ok()
}

fn keep(path: &Path, bytes: &[u8]) -> Result<()> {
    if let Some(folder) = path.parent() {
        // Where it cannot be made, writing says so.
        let _ = std::fs::create_dir_all(folder);
    }
    crate::output::write_file(path, bytes)
}

/// The magic, the key, the numbers, and the SHA-256 of all that.
fn pack(key: &Key, training: &Training) -> Vec<u8> {
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
    let mut bytes = MAGIC.to_vec();
    bytes.extend(key.json().as_bytes());
    bytes.push(b'\n');
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    let sum = Sha256::digest(&bytes);
    bytes.extend(sum.as_slice());
    bytes
}

/// Nothing for bytes that are not whole, or of another key.
fn unpack(
    bytes: &[u8],
    key: &Key,
    maps: &[EnvironmentMap],
    materials: &[Material],
) -> Option<Training> {
    let (bytes, sum) = bytes.split_last_chunk::<32>()?;
    if Sha256::digest(bytes).as_slice() != sum {
        return None;
    }
    let body = bytes.strip_prefix(MAGIC)?;
    let body = body
        .strip_prefix(key.json().as_bytes())?
        .strip_prefix(b"\n")?;
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
            scenes: Scenes::default(),
            observations,
            render_error,
        },
        random: samples,
    })
}
