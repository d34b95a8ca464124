//! The paper's features from pixels to numbers, against numpy with ducc0.

use lobes::glam::DVec3;
use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::Result;
use lobes::features::{Continuation, ImagePower, ImageSpectrum, PaperFeatures};
use lobes::reflection::{Camera, SphereImage};

const ORACLE: Oracle = Oracle::Snapshot("pipeline");
const PICTURES: &str =
    "four pictures of 48² pixels, from smooth to sharp, continued by mirror, half-turn and zero";

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "pipeline/power",
            function: "features::ImageSpectrum::power",
            oracle: ORACLE,
            domain: PICTURES,
            metric: Metric::Relative,
            bound: 2e-11,
            why: "the highest degrees hold 10⁻¹⁰ of the power, so rounding in the map shows there",
            loose: None,
            measure: power,
        },
        Contract {
            id: "pipeline/features",
            function: "features::PaperFeatures::of_image",
            oracle: ORACLE,
            domain: PICTURES,
            metric: Metric::Relative,
            bound: 8e-13,
            why: "ratios of powers, some small",
            loose: None,
            measure: features,
        },
    ]
}

#[derive(Deserialize)]
struct PipelineCase {
    size: usize,
    /// Direction, sharpness and the weight in each channel.
    bumps: Vec<[f64; 7]>,
    continuation: String,
    power: Vec<f64>,
    colour: [f64; 3],
    features: [f64; 7],
}

impl PipelineCase {
    fn image(&self) -> Result<SphereImage> {
        let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
        let pixels = (0..self.size * self.size).map(|i| {
            let Some(point) = camera.pixel(self.size, i / self.size, i % self.size) else {
                return [0.0; 3];
            };
            let mut sum = [0.0; 3];
            for bump in &self.bumps {
                let direction = DVec3::new(bump[0], bump[1], bump[2]);
                let rise = (bump[3] * (point.normal.dot(direction) - 1.0)).exp();
                for (sum, weight) in sum.iter_mut().zip(&bump[4..]) {
                    *sum += weight * rise;
                }
            }
            sum
        });
        SphereImage::new(camera, self.size, pixels.collect())
    }

    fn power(&self) -> Result<(ImageSpectrum, ImagePower)> {
        let continuation: Continuation = self.continuation.parse()?;
        let spectrum = ImageSpectrum::new(self.power.len() - 1, continuation)?;
        let power = spectrum.power(&self.image()?)?;
        Ok((spectrum, power))
    }
}

fn power(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<PipelineCase>("pipeline", "features")? {
        let (_, power) = case.power()?;
        let name = &case.continuation;
        for (l, (got, want)) in power.luminance.iter().zip(&case.power).enumerate() {
            tally.compare(*got, *want, || format!("{name}, degree {l}"));
        }
        for (got, want) in power.colour.iter().zip(case.colour) {
            tally.compare(*got, want, || format!("{name}, colour"));
        }
    }
    Ok(())
}

fn features(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<PipelineCase>("pipeline", "features")? {
        let (spectrum, _) = case.power()?;
        let features = PaperFeatures::of_image(&spectrum, &case.image()?)?;
        let want = case.features.iter().chain(&case.colour);
        for (i, (got, want)) in features.to_array().iter().zip(want).enumerate() {
            tally.compare(*got, *want, || {
                format!("{}, {}", case.continuation, PaperFeatures::NAMES[i])
            });
        }
    }
    Ok(())
}
