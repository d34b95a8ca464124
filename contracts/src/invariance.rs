//! What a rotation must not change.

use std::f64::consts::FRAC_PI_2;

use lobes::glam::{DQuat, DVec3, EulerRot};

use super::generator::uniform;
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::features::{Continuation, ImageSpectrum, PaperFeatures, TOP_DEGREE};
use lobes::harmonics::{Rotation, average_power};
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::inference::{Plan, collect};
use lobes::reflectance::{Material, Variant, presets};
use lobes::reflection::{Camera, Renderer, Settings};
use lobes::{Parallelism, Result};
use lobes_experiments::{Classifier, NearestNeighbour, Scaling};

/// Green, so that a map's channels need not be weighed.
const CHANNEL: usize = 1;

pub(super) fn contracts() -> Vec<Contract> {
    let pixels = Contract {
        id: "invariance/pixels-512",
        function: "illumination::EnvironmentMap::{radiance, coefficients}",
        oracle: Oracle::Identity("a rotation keeps B_l; the truth is the map itself at 1024 rows"),
        domain: "B_0 … B_32 of each fourth built-in map, sampled anew at 512 rows through a rotation",
        metric: Metric::Relative,
        bound: 6e-2,
        why: "point samples of a bilinear map, whose kinks and suns alias",
        loose: None,
        measure: |_, tally| rotated_pixels(512, tally),
    };
    let roll = Contract {
        id: "invariance/roll-64",
        function: "features::PaperFeatures::of_image",
        oracle: Oracle::Identity("the features do not depend on the camera's roll"),
        domain: "the same rolled by 18°, 45° and 117°",
        metric: Metric::Relative,
        bound: 1.4,
        why: "the pixels sample the rim at other points, which tells in v6, a ratio of powers that the lobe has all but put out",
        loose: None,
        measure: |_, tally| rolled_camera(&ROLLS, 64, tally),
    };
    let names = Contract {
        id: "invariance/names",
        function: "experiments::NearestNeighbour",
        oracle: Oracle::Identity("the camera's roll changes none of the materials' names"),
        domain: "",
        metric: Metric::Absolute,
        bound: 0.0,
        why: "",
        loose: None,
        measure: |_, _| Ok(()),
    };
    vec![
        Contract {
            id: "invariance/coefficients",
            function: "harmonics::Rotation::rotate",
            oracle: Oracle::Identity("a rotation keeps B_l"),
            domain: "B_0 … B_64 of every built-in map under 100 random rotations",
            metric: Metric::Relative,
            bound: 1e-14,
            why: "a sum of up to 129 squares, each off by some ε",
            loose: None,
            measure: rotated_coefficients,
        },
        pixels,
        Contract {
            id: "invariance/pixels-1024",
            domain: "the same at 1024 rows: the error falls with the resolution",
            bound: 3e-3,
            measure: |_, tally| rotated_pixels(1024, tally),
            ..pixels
        },
        Contract {
            id: "invariance/quarter-turns",
            function: "features::PaperFeatures::of_image",
            oracle: Oracle::Identity("the features do not depend on the camera's roll"),
            domain: "v1 … v7 and colour of rough metal and glossy plastic in each sixth built-in map, 64², rolled by 90°, 180° and 270°",
            metric: Metric::Relative,
            bound: 5e-13,
            why: "the pixels come to lie on pixels, and each is rendered for itself: rounding alone",
            loose: None,
            measure: |_, tally| rolled_camera(&[1.0, 2.0, 3.0], 64, tally),
        },
        roll,
        Contract {
            id: "invariance/roll-128",
            domain: "the same at 128²: the error falls with the resolution",
            bound: 0.3,
            measure: |_, tally| rolled_camera(&ROLLS, 128, tally),
            ..roll
        },
        Contract {
            id: "invariance/names-quarter-turn",
            domain: "24 names: the eight presets in each sixth built-in map, 128², rolled by 90°; learned from the upright pictures in the other maps",
            bound: 0.0,
            why: "the pixels come to lie on pixels",
            measure: |_, tally| names_after_roll(1.0, tally),
            ..names
        },
        Contract {
            id: "invariance/names-eighth-turn",
            domain: "the same rolled by 45°",
            bound: 1.0,
            why: "other points at the rim are seen, which may turn what hardly differs: materials that mirror without blur",
            measure: |_, tally| names_after_roll(0.5, tally),
            ..names
        },
    ]
}

/// How many spheres get another name than with the camera upright, by what was learned from upright
/// pictures in other light.
fn names_after_roll(quarters: f64, tally: &mut Tally) -> Result<()> {
    let upright = Camera::orthographic(DVec3::Z, DVec3::Y)?;
    let cameras = [upright, upright.rolled(quarters * FRAC_PI_2)];
    let maps: Vec<EnvironmentMap> = builtin()?.iter().step_by(6).cloned().collect();
    let spectrum = ImageSpectrum::new(TOP_DEGREE, Continuation::Mirror)?;
    let plan = Plan {
        lobe: Variant::Ward1992,
        settings: Settings::default(),
        turns: cameras.len(),
    };
    let dataset = collect(
        &cameras,
        &maps,
        &presets(),
        &plan,
        Parallelism::Rayon,
        &|| (),
        &|_, image| Ok(PaperFeatures::of_image(&spectrum, image)?.to_array()),
    )?;
    let observations = &dataset.observations;
    let features: Vec<[f64; 10]> = observations.iter().map(|o| o.view).collect();
    let count = dataset.materials.len();
    let classifier =
        NearestNeighbour::new(Scaling::default(), &features, &dataset.labels(), count)?;
    let name = |i: usize| -> Result<&str> {
        let light = observations[i].illumination;
        let training: Vec<usize> = (0..observations.len())
            .filter(|&j| observations[j].turn == 0 && observations[j].illumination != light)
            .collect();
        let scores = &classifier.score(&training, &[i])?[0];
        let best = (0..count).max_by(|&a, &b| scores[a].total_cmp(&scores[b]));
        Ok(&dataset.materials[best.unwrap_or(0)])
    };
    let mut changes = Vec::new();
    for i in (0..observations.len()).filter(|&i| observations[i].turn == 0) {
        // The rolled pictures of a light come after its upright ones, in the same order.
        let (upright, rolled) = (name(i)?, name(i + count)?);
        if rolled != upright {
            let light = &dataset.illuminations[observations[i].illumination];
            let material = &dataset.materials[observations[i].material];
            changes.push(format!("{material} in {light}, {upright} to {rolled}"));
        }
    }
    tally.compare(changes.len() as f64, 0.0, || match changes.as_slice() {
        [] => "no sphere".into(),
        changes => changes.join("; "),
    });
    Ok(())
}

/// Rolls of the camera, in quarter turns.
const ROLLS: [f64; 3] = [0.2, 0.5, 1.3];

fn rolled_camera(quarters: &[f64], size: usize, tally: &mut Tally) -> Result<()> {
    let settings = Settings {
        size,
        ..Settings::default()
    };
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
    let spectrum = ImageSpectrum::new(TOP_DEGREE, Continuation::Mirror)?;
    let materials = [
        Material::metal("metal", [0.7, 0.5, 0.3], 0.9, 0.1)?,
        Material::plastic("plastic", [0.2, 0.3, 0.4], 0.05, 0.05)?,
    ];
    for map in builtin()?.iter().step_by(6) {
        let renderer = Renderer::new(map, Parallelism::Rayon)?;
        for material in &materials {
            let features = |camera: &Camera| -> Result<[f64; 10]> {
                let threads = Parallelism::Rayon;
                let rendering =
                    renderer.render(material, Variant::Ward1992, camera, &settings, threads)?;
                Ok(PaperFeatures::of_image(&spectrum, &rendering.image)?.to_array())
            };
            let want = features(&camera)?;
            for quarter in quarters {
                let got = features(&camera.rolled(quarter * FRAC_PI_2))?;
                for (i, name) in PaperFeatures::NAMES.iter().enumerate() {
                    tally.compare(got[i], want[i], || {
                        format!(
                            "{name} of {} in {}, {}°",
                            material.name(),
                            map.name(),
                            90.0 * quarter
                        )
                    });
                }
            }
        }
    }
    Ok(())
}

/// The map's own function sampled at other directions: those of a grid of so many rows, turned.
fn sampled(map: &EnvironmentMap, turn: DQuat, rows: usize) -> Result<EnvironmentMap> {
    let columns = 2 * rows;
    let grid = EnvironmentMap::new("grid", columns, rows, vec![[1.0; 3]; rows * columns])?;
    let pixels = Parallelism::Rayon.map(rows * columns, |i| {
        map.radiance(turn * grid.direction(i / columns, i % columns))
    });
    EnvironmentMap::new(map.name(), columns, rows, pixels)
}

fn power(map: &EnvironmentMap) -> Result<Vec<f64>> {
    Ok(average_power(
        &map.coefficients(32, Parallelism::Rayon)?[CHANNEL],
    ))
}

fn rotated_pixels(rows: usize, tally: &mut Tally) -> Result<()> {
    for map in builtin()?.iter().step_by(4) {
        let want = power(&sampled(map, DQuat::IDENTITY, 1024)?)?;
        let turn = DQuat::from_euler(EulerRot::YXZ, 0.4, 1.1, -0.7);
        let got = power(&sampled(map, turn, rows)?)?;
        for (l, (got, want)) in got.iter().zip(want).enumerate() {
            tally.compare(*got, want, || format!("{}, l = {l}", map.name()));
        }
    }
    Ok(())
}

fn rotated_coefficients(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let rotation = Rotation::new(64)?;
    for (index, map) in builtin()?.iter().enumerate() {
        let [_, green, _] = map.coefficients(64, Parallelism::Rayon)?;
        let want = average_power(&green);
        let turns: Vec<DQuat> = uniform(900 + index as u64, 400)
            .chunks_exact(4)
            .map(|q| DQuat::from_xyzw(q[0], q[1], q[2], q[3]).normalize())
            .collect();
        let turned = Parallelism::Rayon.map(turns.len(), |i| {
            rotation.rotate(&green, turns[i], Parallelism::Sequential)
        });
        for (turned, turn) in turned.into_iter().zip(&turns) {
            for (l, (got, want)) in average_power(&turned?).iter().zip(&want).enumerate() {
                tally.compare(*got, *want, || format!("{}, l = {l}, {turn}", map.name()));
            }
        }
    }
    Ok(())
}
