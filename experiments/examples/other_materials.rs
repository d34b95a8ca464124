//! The best features and the posterior on sixteen materials that are not the presets: where choices
//! are made, so that none is made on what is reported.
//!
//! ```text
//! cargo run --release --example other_materials -- --whole [--turns 4] [--shrinkage 0.2] [--protocols blind,tilted,photograph] [--without 371..388]
//! ```
//!
//! Two sets of eight, seen from so many sides, all of them judged; each map is left out in turn. A
//! line a protocol and set counts the pictures that were named right: by all features, and without
//! those of the range. Without `--whole` it takes six maps, one set, one side and the protocol
//! `blind`, on small pictures.

use std::ops::Range;

use lobes::illumination::builtin;
use lobes::inference::{Discriminant, Expert, Plan, Reading};
use lobes::reflectance::{Material, Variant};
use lobes::reflection::Settings;
use lobes::{Parallelism, Result};
use lobes_experiments::{Harness, Protocol};

type Albedos = (&'static str, [f64; 3], [f64; 3], f64);

const FIRST: [Albedos; 8] = [
    ("dark glaze", [0.03; 3], [0.06; 3], 0.0),
    ("grey matte", [0.3; 3], [0.0; 3], 0.0),
    ("blue gloss", [0.05, 0.1, 0.4], [0.05; 3], 0.015),
    ("green satin", [0.1, 0.3, 0.1], [0.05; 3], 0.08),
    ("red glaze", [0.4, 0.05, 0.05], [0.05; 3], 0.0),
    ("gold", [0.08, 0.06, 0.03], [0.8, 0.6, 0.3], 0.05),
    ("steel", [0.06; 3], [0.5; 3], 0.03),
    ("mirror", [0.0; 3], [0.6; 3], 0.0),
];

const SECOND: [Albedos; 8] = [
    ("white eggshell", [0.8; 3], [0.05; 3], 0.15),
    ("yellow gloss", [0.7, 0.6, 0.1], [0.05; 3], 0.03),
    ("brown matte", [0.3, 0.2, 0.1], [0.0; 3], 0.0),
    ("rough aluminium", [0.05; 3], [0.7; 3], 0.15),
    ("brass", [0.1, 0.07, 0.03], [0.75, 0.6, 0.3], 0.02),
    ("grey glaze", [0.1; 3], [0.08; 3], 0.0),
    ("rubber", [0.05; 3], [0.04; 3], 0.12),
    ("silver mirror", [0.0; 3], [0.9, 0.88, 0.85], 0.0),
];

/// What follows `--name`, split at commas.
fn list(name: &str) -> Option<Vec<String>> {
    let arguments: Vec<String> = std::env::args().collect();
    let at = arguments.iter().position(|argument| argument == name)?;
    let value = arguments.get(at + 1)?;
    Some(value.split(',').map(str::to_owned).collect())
}

fn number<T: std::str::FromStr>(name: &str, default: T) -> T {
    list(name)
        .and_then(|values| values[0].parse().ok())
        .unwrap_or(default)
}

fn materials(albedos: &[Albedos]) -> Result<Vec<Material>> {
    albedos
        .iter()
        .map(|&(name, diffuse, specular, sigma)| {
            Material::from_albedos(name, diffuse, specular, sigma)
        })
        .collect()
}

/// How many of all pictures are named right, each illumination left out in turn.
fn named_right(
    harness: &Harness,
    shrinkage: f64,
    features: &(dyn Fn(&Reading) -> Vec<f64> + Sync),
) -> Result<usize> {
    let data = harness.dataset();
    let discriminant = Discriminant::new("all", data, shrinkage, features)?;
    let folds = Parallelism::Rayon.map(data.illuminations.len(), |left_out| {
        let seen: Vec<bool> = (0..data.illuminations.len())
            .map(|i| i != left_out)
            .collect();
        let of: Vec<usize> = (0..data.observations.len())
            .filter(|&i| data.observations[i].illumination == left_out)
            .collect();
        let scores = discriminant.judge(&seen, &of)?;
        let right = of.iter().zip(&scores).filter(|(i, scores)| {
            let said = (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]));
            said == Some(data.observations[**i].material)
        });
        Ok::<_, lobes::Error>(right.count())
    });
    folds.into_iter().sum()
}

fn main() -> Result<()> {
    let whole = std::env::args().any(|argument| argument == "--whole");
    let mut maps = builtin()?;
    if !whole {
        maps.truncate(6);
    }
    let plan = Plan {
        lobe: Variant::RadianceSampled,
        settings: Settings {
            size: if whole { 128 } else { 96 },
            ..Settings::default()
        },
        turns: number("--turns", if whole { 4 } else { 1 }),
    };
    let shrinkage = number("--shrinkage", Discriminant::SHRINKAGE);
    let without: Range<usize> = list("--without").map_or(0..0, |values| {
        let mut ends = values[0].split("..").filter_map(|end| end.parse().ok());
        ends.next().unwrap_or(0)..ends.next().unwrap_or(0)
    });
    let all = ["blind", "tilted", "photograph"].map(str::to_owned);
    let count = if whole { all.len() } else { 1 };
    let protocols = list("--protocols").unwrap_or_else(|| all[..count].to_vec());
    let sets = [("first", &FIRST), ("second", &SECOND)];
    let sets = if whole { &sets[..] } else { &sets[..1] };
    for protocol in protocols {
        let protocol: Protocol = protocol.parse()?;
        for (name, set) in sets {
            let materials = materials(set.as_slice())?;
            let harness = Harness::new(
                protocol,
                &maps,
                &materials,
                &plan,
                7,
                Parallelism::Rayon,
                &|| (),
            )?;
            let total = harness.dataset().observations.len();
            let features = |reading: &Reading, dropped: &Range<usize>| {
                let mut features: Vec<f64> = (0..)
                    .zip(&reading.bands)
                    .filter(|(i, _)| !dropped.contains(i))
                    .map(|(_, value)| *value)
                    .collect();
                let [r, g, b] = reading.mean.map(|value| value.max(1e-12).ln());
                features.extend([r - g, b - g]);
                features
            };
            let all = named_right(&harness, shrinkage, &|reading| features(reading, &(0..0)))?;
            let fewer = named_right(&harness, shrinkage, &|reading| features(reading, &without))?;
            let percent = |count: usize| 100.0 * count as f64 / total as f64;
            println!(
                "{} {name}: {all}/{total} = {:.1} %, without {without:?} {fewer} = {:.1} %",
                protocol.name(),
                percent(all),
                percent(fewer),
            );
            // One in eight is chance.
            assert!(all > total / 2, "{all} of {total}");
        }
    }
    Ok(())
}
