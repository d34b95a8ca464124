//! Under which of the choices that the paper leaves open are the misses of its features gold and
//! old gold, as it says of all its four?
//!
//! ```text
//! cargo run --release --example paper_misses -- --whole
//! ```
//!
//! The paper does not say which of Ward's lobes Radiance had, whether its numbers are Radiance's
//! arguments or albedos, what stands behind the sphere, to which degree the sums go, or how
//! features are scaled. Each combination is tried on the built-in maps, the nearest neighbour
//! leaving one map out, and printed with how many spheres are named right, how many of the misses
//! are of gold or old gold, and how many of those are taken for the other of the two. Nothing is
//! chosen by it. Without `--whole` it takes four maps and the default lobe and degree.

use lobes::features::{ImageSpectrum, PaperFeatures, TOP_DEGREE};
use lobes::illumination::builtin;
use lobes::inference::{Plan, Reader, collect};
use lobes::reflectance::{Material, Variant, presets, presets_as_albedos};
use lobes::reflection::Settings;
use lobes::{Parallelism, Result};
use lobes_experiments::{NearestNeighbour, Protocol, Scaling, leave_one_illumination_out};

/// What one combination of choices comes to.
struct Outcome {
    lobe: Variant,
    reading: &'static str,
    behind: &'static str,
    degree: usize,
    scaling: Scaling,
    right: usize,
    total: usize,
    /// Misses of which the truth is gold or old gold.
    of_gold: usize,
    /// Those of them that are taken for the other of the two.
    between: usize,
    /// The commonest miss and how often it occurs.
    commonest: String,
}

impl Outcome {
    fn misses(&self) -> usize {
        self.total - self.right
    }

    fn row(&self) -> String {
        format!(
            "| {} | {} | {} | {} | {} | {}/{} = {:.1} % | {} | {} | {} | {} |",
            self.lobe,
            self.reading,
            self.behind,
            self.degree,
            self.scaling,
            self.right,
            self.total,
            100.0 * self.right as f64 / self.total as f64,
            self.misses(),
            self.of_gold,
            self.between,
            self.commonest,
        )
    }
}

const HEADING: &str = "\
| lobe | numbers read as | behind | top degree | scaling | right | misses | of gold or old gold | between the two | commonest |
| --- | --- | --- | ---: | --- | ---: | ---: | ---: | ---: | --- |";

fn outcomes(
    lobe: Variant,
    reading: &'static str,
    materials: &[Material],
    degrees: &[usize],
    maps: &[lobes::illumination::EnvironmentMap],
) -> Result<Vec<Outcome>> {
    let mut spectra = Vec::new();
    for &degree in degrees {
        for behind in Reader::CONTINUATIONS {
            spectra.push((degree, behind, ImageSpectrum::new(degree, behind)?));
        }
    }
    let plan = Plan {
        lobe,
        settings: Settings::default(),
        turns: 1,
    };
    let data = collect(
        &Protocol::Paper.view().cameras(plan.turns)?,
        maps,
        materials,
        &plan,
        Parallelism::Rayon,
        &|| (),
        &|_, image| {
            let features = spectra
                .iter()
                .map(|(_, _, spectrum)| PaperFeatures::of_image(spectrum, image));
            features.collect::<Result<Vec<_>>>()
        },
    )?;
    let (labels, groups) = (data.labels(), data.groups());
    let gold = |material: usize| ["gold", "old gold"].contains(&materials[material].name());
    let mut outcomes = Vec::new();
    for (place, (degree, behind, _)) in spectra.iter().enumerate() {
        let features: Vec<[f64; 10]> = data
            .observations
            .iter()
            .map(|observation| observation.view[place].to_array())
            .collect();
        for scaling in Scaling::ALL {
            let nearest = NearestNeighbour::new(scaling, &features, &labels, materials.len())?;
            let evaluation = leave_one_illumination_out(
                &nearest,
                &labels,
                &groups,
                materials.len(),
                Parallelism::Rayon,
            )?;
            let confusions = evaluation.confusions();
            let matrix = evaluation.confusion_matrix();
            let pairs = (0..materials.len())
                .flat_map(|truth| (0..materials.len()).map(move |said| (truth, said)));
            let commonest = pairs
                .filter(|(truth, said)| truth != said && matrix[*truth][*said] > 0)
                .max_by_key(|(truth, said)| matrix[*truth][*said])
                .map_or_else(
                    || "–".into(),
                    |(truth, said)| {
                        let [truth_name, said_name] = [truth, said].map(|i| materials[i].name());
                        format!("{truth_name} → {said_name}, {}", matrix[truth][said])
                    },
                );
            outcomes.push(Outcome {
                lobe,
                reading,
                behind: behind.name(),
                degree: *degree,
                scaling,
                right: evaluation.correct(),
                total: evaluation.total(),
                of_gold: confusions.iter().filter(|c| gold(c.truth)).count(),
                between: confusions
                    .iter()
                    .filter(|c| gold(c.truth) && gold(c.said))
                    .count(),
                commonest,
            });
        }
    }
    Ok(outcomes)
}

fn main() -> Result<()> {
    let whole = std::env::args().any(|argument| argument == "--whole");
    let mut maps = builtin()?;
    let (lobes, degrees) = if whole {
        (&Variant::ALL[..], &[48, TOP_DEGREE, 96, 128][..])
    } else {
        maps.truncate(4);
        (&[Variant::RadianceSampled][..], &[TOP_DEGREE][..])
    };
    let mut all = Vec::new();
    for &lobe in lobes {
        for (reading, materials) in [
            ("Radiance's arguments", presets()),
            ("albedos", presets_as_albedos()),
        ] {
            all.extend(outcomes(lobe, reading, &materials, degrees, &maps)?);
        }
    }
    let only = all
        .iter()
        .filter(|o| o.misses() > 0 && o.of_gold == o.misses());
    println!(
        "{} combinations; in {} all misses are of gold or old gold.",
        all.len(),
        only.count(),
    );
    for (what, between) in [
        ("of gold or old gold", false),
        ("between gold and old gold", true),
    ] {
        let share = |o: &Outcome| {
            let count = if between { o.between } else { o.of_gold };
            count as f64 / o.misses().max(1) as f64
        };
        all.sort_by(|a, b| share(b).total_cmp(&share(a)).then(b.right.cmp(&a.right)));
        println!("\nThe six with the largest share of misses {what}:\n\n{HEADING}");
        for outcome in all.iter().take(6) {
            println!("{}", outcome.row());
        }
    }
    all.sort_by_key(|outcome| std::cmp::Reverse(outcome.right));
    println!("\nThe six that name most spheres right:\n\n{HEADING}");
    for outcome in all.iter().take(6) {
        println!("{}", outcome.row());
    }
    // One in eight is chance.
    assert!(all.iter().all(|o| 3 * o.right > o.total));
    Ok(())
}
