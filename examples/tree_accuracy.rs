//! The tree of light against itself and against the reference: every lobe, roughness, map and
//! tolerance, points chosen at random.
//!
//! ```text
//! cargo run --release --example tree_accuracy -- --whole --points 20 > docs/reference/rendering-bound-table.md
//! ```
//!
//! Without `--whole` it takes one map, three roughnesses, two tolerances and two points of each;
//! `--maps`, `--lobes`, `--roughnesses`, `--tolerances`, `--points` and `--seed` choose others.
//!
//! An answer is held against the tree at a hundredth of the tolerance, and for the first point of
//! each lobe of Ward's and Lambert's against `reflection::reference` too. It ends with an error if
//! any answer is off by more than its bound and that of the truth together, or if any bound passes
//! the tolerance. Maps that are done are told on standard error.

mod arguments;

use std::collections::BTreeMap;
use std::process::ExitCode;

use arguments::list;
use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::reflectance::{Fresnel, GgxMaterial, MIN_ALPHA, Material, Variant};
use lobes::reflection::{Bounded, Camera, LightTree, ShadingPoint, Surface, reference};
use lobes::{Error, Parallelism, Result};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const LOBES: [&str; 7] = [
    "lambert",
    "gmd",
    "duer",
    "sampled",
    "ward1992",
    "ggx",
    "ggx-two-widths",
];
const ROUGHNESSES: [f64; 9] = [0.0, 0.005, 0.01, 0.03, 0.05, 0.1, 0.2, 0.4, 1.0];
const TOLERANCES: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Ward's own lobe ends in a root at the horizon, where only ever smaller parts of cells help:
/// beyond this tolerance it takes seconds a point, or is refused.
const LEAST_FOR_A_ROOT: f64 = 1e-2;

/// Half of the points have a cosine below this.
const SLANTED: f64 = 0.35;

/// A material of either kind.
enum Owned {
    Ward(Material, Variant),
    Ggx(GgxMaterial),
}

impl Owned {
    /// A lobe by name; none where the roughness says nothing to it.
    fn new(lobe: &str, roughness: f64) -> Result<Option<Self>> {
        let specular = [0.85, 0.8, 0.7];
        Ok(match lobe {
            "lambert" if roughness == 0.0 => Some(Self::Ward(Material::white(), Variant::Duer)),
            "lambert" => None,
            "ggx" => {
                let fresnel = specular.map(|normal| Fresnel::Schlick { normal });
                Some(Self::Ggx(GgxMaterial::new(
                    "m", [0.0; 3], roughness, fresnel,
                )?))
            }
            // Along the grooves a quarter of the width across them.
            "ggx-two-widths" if roughness > 0.0 => {
                let fresnel = specular.map(|normal| Fresnel::Schlick { normal });
                let widths = [(0.25 * roughness).max(MIN_ALPHA), roughness];
                let axis = DVec3::new(0.48, 0.6, 0.64);
                Some(Self::Ggx(GgxMaterial::anisotropic(
                    "m", [0.0; 3], widths, axis, fresnel,
                )?))
            }
            // A mirror is one whatever the lobe.
            _ if roughness == 0.0 => None,
            name => {
                let variant = name.parse()?;
                let material = Material::from_albedos("m", [0.0; 3], specular, roughness)?;
                Some(Self::Ward(material, variant))
            }
        })
    }

    fn surface(&self) -> Surface<'_> {
        match self {
            Self::Ward(material, variant) => Surface::Ward(material, *variant),
            Self::Ggx(material) => Surface::Ggx(material),
        }
    }
}

/// What came of the points of one lobe and tolerance.
#[derive(Default)]
struct Row {
    /// Over its bound, the error less what the truth may be off.
    excess: Vec<f64>,
    /// The bound over the error.
    tightness: Vec<f64>,
    /// The bound over what was asked.
    used: f64,
    /// As `excess`, against the reference.
    reference: Vec<f64>,
    worst: String,
    /// Points that were refused, or of which no truth is to be had.
    refused: usize,
}

impl Row {
    fn compare(&mut self, got: &Bounded, truth: &Bounded, name: &str) {
        let error = difference(got, truth.value);
        let excess = (error - truth.bound).max(0.0) / got.bound;
        if self.excess.iter().all(|other| *other < excess) {
            name.clone_into(&mut self.worst);
        }
        self.excess.push(excess);
        self.tightness
            .push(got.bound / error.max(f64::MIN_POSITIVE));
    }

    fn join(&mut self, other: Self) {
        let largest = |row: &Self| row.excess.iter().copied().fold(0.0, f64::max);
        if largest(&other) > largest(self) || self.worst.is_empty() {
            self.worst = other.worst;
        }
        self.excess.extend(other.excess);
        self.tightness.extend(other.tightness);
        self.reference.extend(other.reference);
        self.used = self.used.max(other.used);
        self.refused += other.refused;
    }
}

fn difference(got: &Bounded, truth: [f64; 3]) -> f64 {
    let channels = got.value.iter().zip(truth);
    channels.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn mean(value: [f64; 3]) -> f64 {
    value.iter().sum::<f64>() / 3.0
}

fn middle(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Light of other kinds than what is built in: a sun of 60 000 times the mean alone, across the seam
/// and at the pole, a checkerboard of pixels, noise whose amplitude falls as 1/l, and a large map.
fn made_up() -> Result<Vec<EnvironmentMap>> {
    const WIDTH: usize = 512;
    const HEIGHT: usize = 256;
    let flat = || vec![[1.0, 0.9, 1.1]; WIDTH * HEIGHT];
    let suns = [
        ("one-pixel sun", vec![70 * WIDTH + 200]),
        (
            "sun across the seam",
            vec![90 * WIDTH, 90 * WIDTH + WIDTH - 1],
        ),
        ("sun at the pole", vec![3, 4]),
    ];
    let mut maps = Vec::new();
    for (name, places) in suns {
        let mut pixels = flat();
        for place in places {
            pixels[place] = [6e4; 3];
        }
        maps.push(EnvironmentMap::new(name, WIDTH, HEIGHT, pixels)?);
    }
    let board = (0..WIDTH * HEIGHT)
        .map(|i| [f64::from(u8::from((i / WIDTH + i % WIDTH).is_multiple_of(2))); 3]);
    maps.push(EnvironmentMap::new(
        "checkerboard",
        WIDTH,
        HEIGHT,
        board.collect(),
    )?);
    maps.push(noise("noise", WIDTH, HEIGHT)?);
    maps.push(noise("noise of 4096 × 2048", 4096, 2048)?);
    Ok(maps)
}

/// Squares of random brightness, each octave of half the size and half the weight.
fn noise(name: &str, width: usize, height: usize) -> Result<EnvironmentMap> {
    let mut random = Pcg64::seed_from_u64(7);
    let mut pixels = vec![[0.2; 3]; width * height];
    let mut side = height / 2;
    while side > 0 {
        let columns = width.div_ceil(side);
        let values: Vec<f64> = (0..columns * height.div_ceil(side))
            .map(|_| random.random())
            .collect();
        let weight = side as f64 / height as f64;
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let value = weight * values[i / width / side * columns + i % width / side];
            *pixel = pixel.map(|v| v + value);
        }
        side /= 2;
    }
    EnvironmentMap::new(name, width, height, pixels)
}

struct Options {
    points: usize,
    seed: u64,
    lobes: Vec<String>,
    roughnesses: Vec<f64>,
    tolerances: Vec<f64>,
    maps: Vec<EnvironmentMap>,
}

impl Options {
    fn read() -> Result<Self> {
        let whole = std::env::args().any(|argument| argument == "--whole");
        let names: Vec<String> = list("--maps", &[])?;
        let mut maps = made_up()?;
        maps.truncate(if whole || !names.is_empty() {
            maps.len()
        } else {
            1
        });
        if whole || !names.is_empty() {
            maps.extend(builtin()?);
        }
        maps.retain(|map| names.is_empty() || names.iter().any(|name| name == map.name()));
        let chosen = |all: &[f64], few: &[f64]| if whole { all.to_vec() } else { few.to_vec() };
        let points = list("--points", &[if whole { 30 } else { 2 }])?[0];
        if points == 0 {
            return Err(Error::Domain {
                what: "the number of points",
                value: 0.0,
                allowed: "at least 1",
            });
        }
        let lobes: Vec<String> = list("--lobes", &LOBES.map(String::from))?;
        if let Some(name) = lobes.iter().find(|name| !LOBES.contains(&name.as_str())) {
            return Err(Error::UnknownName {
                what: "lobe",
                name: name.clone(),
                names: LOBES.map(String::from).to_vec(),
            });
        }
        Ok(Self {
            points,
            seed: list("--seed", &[1])?[0],
            lobes,
            roughnesses: list("--roughnesses", &chosen(&ROUGHNESSES, &[0.0, 0.05, 0.4]))?,
            tolerances: list("--tolerances", &chosen(&TOLERANCES, &TOLERANCES[..2]))?,
            maps,
        })
    }

    /// The points of a lobe: over the whole sphere, every second one near the rim.
    fn points(&self, random: &mut Pcg64) -> Result<Vec<ShadingPoint>> {
        let camera = Camera::orthographic(DVec3::new(0.3, 0.2, 1.0), DVec3::Y)?;
        let mut points = Vec::new();
        while points.len() < self.points {
            let (x, y) = (
                2.0 * random.random::<f64>() - 1.0,
                2.0 * random.random::<f64>() - 1.0,
            );
            if let Some(point) = camera.point(x, y)
                && (points.len() % 2 == 0 || point.normal.dot(point.view) < SLANTED)
            {
                points.push(point);
            }
        }
        Ok(points)
    }

    /// The rows of one map, by lobe and tolerance.
    fn rows(&self, map: &EnvironmentMap) -> Result<BTreeMap<(usize, usize), Row>> {
        let tree = LightTree::new(map, Parallelism::Sequential)?;
        let mut random = Pcg64::seed_from_u64(self.seed);
        let mut rows = BTreeMap::new();
        let floor = 0.01 * mean(map.mean());
        // Points are drawn for all lobes, so that those of one are the same whichever are chosen.
        for (at, lobe) in LOBES.into_iter().enumerate() {
            for &roughness in &self.roughnesses {
                let points = self.points(&mut random)?;
                let chosen = self.lobes.iter().any(|name| name == lobe);
                let Some(owned) = Owned::new(lobe, roughness)?.filter(|_| chosen) else {
                    continue;
                };
                let tolerances = self.tolerances.iter().enumerate();
                let tolerances: Vec<(usize, f64)> = tolerances
                    .map(|(index, tolerance)| (index, *tolerance))
                    .filter(|(_, tolerance)| lobe != "ward1992" || *tolerance >= LEAST_FOR_A_ROOT)
                    .collect();
                let least = tolerances
                    .iter()
                    .fold(0.1, |least: f64, (_, t)| least.min(*t));
                let seen = match &owned {
                    Owned::Ward(material, variant) => {
                        let ShadingPoint { normal, view } = points[0];
                        Some(reference(
                            map,
                            material,
                            *variant,
                            normal,
                            view,
                            0.1 * least,
                        )?)
                    }
                    Owned::Ggx(_) => None,
                };
                // A root allows no truer truth in finite time.
                let truer: &[f64] = if lobe == "ward1992" {
                    &[0.3]
                } else {
                    &[0.01, 0.1]
                };
                for (index, tolerance) in tolerances {
                    let row: &mut Row = rows.entry((at, index)).or_default();
                    let answers = |tolerance: f64| {
                        let one = Parallelism::Sequential;
                        match tree.radiance(owned.surface(), &points, tolerance, one) {
                            Ok(answers) => Ok(Some(answers)),
                            Err(Error::Tolerance { .. }) => Ok(None),
                            Err(error) => Err(error),
                        }
                    };
                    let got = answers(tolerance)?;
                    let mut truth = None;
                    for share in truer {
                        if truth.is_none() {
                            truth = answers(share * tolerance)?;
                        }
                    }
                    let (Some(got), Some(truth)) = (got, truth) else {
                        row.refused += points.len();
                        continue;
                    };
                    for (got, truth) in got.iter().zip(&truth) {
                        row.compare(got, truth, map.name());
                        let asked = tolerance * mean(got.value).max(floor);
                        row.used = row.used.max(got.bound / asked);
                    }
                    if let Some(seen) = &seen {
                        let error = difference(&got[0], seen.value) - seen.error;
                        row.reference.push(error.max(0.0) / got[0].bound);
                    }
                }
            }
        }
        eprintln!("{}", map.name());
        Ok(rows)
    }
}

fn run() -> Result<bool> {
    let options = Options::read()?;
    let maps = &options.maps;
    let of_maps = Parallelism::Rayon.map(maps.len(), |index| options.rows(&maps[index]));
    let mut rows: BTreeMap<(usize, usize), Row> = BTreeMap::new();
    for of_map in of_maps {
        for (key, row) in of_map? {
            rows.entry(key).or_default().join(row);
        }
    }
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    println!("# The tree of light against itself and against the reference\n");
    println!(
        "What `cargo run --release --example tree_accuracy -- {}` prints: {} maps, {} points of each lobe and roughness ({}), every second one of them where the view's cosine is below {SLANTED}. \
         Each is held against the tree at a hundredth of the tolerance, or a tenth where that is refused (of `ward1992`, which has a root at the horizon, three tenths), and the first of each Ward and Lambert lobe against \
         `reflection::reference`. An error counts as far as it is more than the truth's own bound.\n",
        std::env::args().skip(1).collect::<Vec<_>>().join(" "),
        maps.len(),
        options.points,
        options
            .roughnesses
            .iter()
            .map(f64::to_string)
            .collect::<Vec<_>>()
            .join(", "),
    );
    println!(
        "| lobe | tolerance | points | refused | largest error over bound | under | median bound over error | largest bound over what was asked | against the reference: points | largest error over bound |"
    );
    println!("| --- | ---: | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    let (mut points, mut held) = (0, true);
    for ((lobe, tolerance), row) in &rows {
        points += row.excess.len();
        held &= largest(&row.excess) <= 1.0 && largest(&row.reference) <= 1.0 && row.used <= 1.0;
        println!(
            "| `{}` | {:e} | {} | {} | {:.3} | {} | {:.0} | {:.2} | {} | {:.3} |",
            LOBES[*lobe],
            options.tolerances[*tolerance],
            row.excess.len(),
            row.refused,
            largest(&row.excess),
            row.worst,
            middle(&row.tightness),
            row.used,
            row.reference.len(),
            largest(&row.reference),
        );
    }
    println!();
    println!(
        "{points} points under {} maps; every one is within its bound, and every bound within what was asked: {held}.",
        maps.len()
    );
    Ok(held)
}

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
