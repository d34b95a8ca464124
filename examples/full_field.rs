//! How far the paper's features of one image lie from those of the whole field, which the paper
//! could not see.
//!
//! ```text
//! cargo run --release --example full_field -- --whole
//! ```
//!
//! Without `--whole` it takes one map and small pictures.
//!
//! Every preset under every built-in map is rendered from six cameras all round, level, in three
//! opposite pairs. A pair shows every normal once: the spectrum of its field is the truth, and each
//! of its two images, with the unseen half continued or its mask undone, an estimate of it. It
//! prints a page of tables.

use lobes::features::{
    Continuation, ImagePower, ImageSpectrum, PaperFeatures, TOP_DEGREE, UnbiasedBands,
};
use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::reflectance::{Material, Variant, presets};
use lobes::reflection::{Camera, Renderer, Settings, SphereImage};
use lobes::{Parallelism, Result};

/// The estimates, in the order of the tables.
const ESTIMATES: [&str; 4] = ["mirror", "half-turn", "zero", "unbiased"];

/// v1 … v7 as one estimate has them over those of the whole field; none where the estimate has no
/// such feature.
type Ratios = [Option<f64>; 7];

fn main() -> Result<()> {
    let whole = std::env::args().any(|argument| argument == "--whole");
    let mut maps = builtin()?;
    if !whole {
        maps.truncate(1);
    }
    let materials = presets();
    let plans = Plans::new(if whole { 128 } else { 32 })?;
    // For each map: material by material, both images of the three pairs, the estimates.
    let found = Parallelism::Rayon.map(maps.len(), |index| plans.of_map(&maps[index], &materials));
    let mut rows = Vec::new();
    for of_map in found {
        rows.extend(of_map?);
    }
    println!("# One image and the whole field\n");
    println!(
        "What `cargo run --release --example full_field -- --whole` prints: {} maps, {} materials, six cameras. The whole field shows every normal, each from the \
         one of two opposite cameras that it faces. A cell has the middle ratio of a feature of one image to that of the whole field, and in brackets \
         the factor, up or down, within which nine in ten lie. `unbiased` undoes the mask over bands of degrees, within which it takes l⁻² for \
         granted; it has no v2. Matte materials have next to nothing above degree 2, so their v3 … v6 compare one rounding with another.\n",
        maps.len(),
        materials.len()
    );
    println!("## All materials\n");
    table(&ESTIMATES, |estimate| {
        rows.iter().map(|row| row.1[estimate]).collect()
    });
    for (estimate, name) in ESTIMATES.iter().enumerate() {
        println!("\n## By material: {name}\n");
        let names: Vec<&str> = materials.iter().map(Material::name).collect();
        table(&names, |material| {
            rows.iter()
                .filter(|row| row.0 == material)
                .map(|row| row.1[estimate])
                .collect()
        });
    }
    Ok(())
}

struct Plans {
    continued: [ImageSpectrum; 3],
    unbiased: UnbiasedBands,
    /// Pixels a side.
    size: usize,
}

impl Plans {
    fn new(size: usize) -> Result<Self> {
        let plan = |continuation| ImageSpectrum::new(TOP_DEGREE, continuation);
        Ok(Self {
            continued: [
                plan(Continuation::Mirror)?,
                plan(Continuation::HalfTurn)?,
                plan(Continuation::Zero)?,
            ],
            unbiased: UnbiasedBands::new()?,
            size,
        })
    }

    fn of_map(
        &self,
        map: &EnvironmentMap,
        materials: &[Material],
    ) -> Result<Vec<(usize, [Ratios; 4])>> {
        let renderer = Renderer::new(map, Parallelism::Sequential)?;
        let mut rows = Vec::new();
        for (index, material) in materials.iter().enumerate() {
            for pair in 0..3 {
                let (sin, cos) = (std::f64::consts::PI * f64::from(pair) / 3.0).sin_cos();
                let towards = DVec3::new(sin, 0.0, cos);
                let front = picture(&renderer, material, towards, self.size)?;
                let back = picture(&renderer, material, -towards, self.size)?;
                let whole = self.continued[0].whole_power(&front, &back)?;
                let truth = PaperFeatures::of_power(&whole)?.power;
                for image in [front, back] {
                    rows.push((index, self.ratios(&image, &truth)?));
                }
            }
        }
        Ok(rows)
    }

    fn ratios(&self, image: &SphereImage, truth: &[f64; 7]) -> Result<[Ratios; 4]> {
        let mut found = [[None; 7]; 4];
        for (found, plan) in found.iter_mut().zip(&self.continued) {
            let features = PaperFeatures::of_image(plan, image)?.power;
            *found = std::array::from_fn(|index| Some(ratio(index, features[index], truth[index])));
        }
        let bands = self.unbiased.of(image)?;
        let estimate = of_bands(&bands[..8]);
        found[3] =
            std::array::from_fn(|index| estimate[index].map(|v| ratio(index, v, truth[index])));
        Ok(found)
    }
}

fn picture(
    renderer: &Renderer,
    material: &Material,
    towards: DVec3,
    size: usize,
) -> Result<SphereImage> {
    let settings = Settings {
        size,
        // A mirror's picture has to be averaged over its pixels.
        pixel_samples: if material.roughness().sigma() == 0.0 {
            6
        } else {
            1
        },
        ..Settings::default()
    };
    let camera = Camera::orthographic(towards, DVec3::Y)?;
    let one = Parallelism::Sequential;
    let rendering = renderer.render(material, Variant::RadianceSampled, &camera, &settings, one)?;
    Ok(rendering.image)
}

/// The first degrees of the bands of [`UnbiasedBands`], and the end of the last.
const EDGES: [usize; 9] = [0, 3, 5, 9, 15, 25, 35, 45, 65];

/// The paper's features from ln of the share that each band has of all power, spread over the band
/// as l⁻².
fn of_bands(bands: &[f64]) -> [Option<f64>; 7] {
    let mut luminance = vec![0.0; TOP_DEGREE + 1];
    for (share, edge) in bands.iter().zip(EDGES.windows(2)) {
        let shape = |l: usize| (l.max(1) as f64).powi(-2);
        let sum: f64 = (edge[0]..edge[1]).map(shape).sum();
        for (l, power) in luminance.iter_mut().enumerate().take(edge[1]).skip(edge[0]) {
            *power = share.exp() * shape(l) / sum;
        }
    }
    let power = ImagePower {
        luminance,
        colour: [1.0; 3],
    };
    match PaperFeatures::of_power(&power) {
        Ok(features) => {
            let mut found = features.power.map(Some);
            found[1] = None;
            found
        }
        Err(_) => [None; 7],
    }
}

/// Of v7, a degree that may be 0, the next degree counts.
fn ratio(index: usize, one: f64, whole: f64) -> f64 {
    let more = if index == 6 { 1.0 } else { 0.0 };
    (one + more) / (whole + more)
}

fn table(names: &[&str], ratios: impl Fn(usize) -> Vec<Ratios>) {
    println!("| | v1 | v2 | v3 | v4 | v5 | v6 | v7 |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (index, name) in names.iter().enumerate() {
        let ratios = ratios(index);
        let cells: Vec<String> = (0..7)
            .map(|feature| {
                let mut logs: Vec<f64> = ratios
                    .iter()
                    .filter_map(|row| row[feature].map(f64::ln))
                    .collect();
                if logs.is_empty() {
                    return "–".into();
                }
                logs.sort_by(f64::total_cmp);
                let middle = logs[logs.len() / 2];
                let mut sizes: Vec<f64> = logs.iter().map(|log| log.abs()).collect();
                sizes.sort_by(f64::total_cmp);
                let wide = sizes[(sizes.len() * 9 / 10).min(sizes.len() - 1)];
                let middle = match middle.exp() {
                    middle if middle < 0.005 => "< 0.01".into(),
                    middle => format!("{middle:.2}"),
                };
                let wide = match wide.exp() {
                    wide if wide > 100.0 => "> 100".into(),
                    wide => format!("{wide:.2}"),
                };
                format!("{middle} ({wide})")
            })
            .collect();
        println!("| {name} | {} |", cells.join(" | "));
    }
}
