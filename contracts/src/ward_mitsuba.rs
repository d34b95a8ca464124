//! Ward's lobes, their density and their sampler, against a Mitsuba BSDF written from the papers.

use lobes::glam::DVec3;
use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::Result;
use lobes::reflectance::{Variant, Ward};

const ORACLE: Oracle = Oracle::Snapshot("ward_mitsuba");
const GEOMETRIES: &str = "36 geometries each, half vectors to 2.5σ, view cosines from 0.05; σ 0.01, 0.05, 0.2, 0.5 and (0.1, 0.3)";

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "ward-mitsuba/lobe",
            function: "reflectance::Ward::evaluate",
            oracle: ORACLE,
            domain: GEOMETRIES,
            metric: Metric::Relative,
            bound: 6e-6,
            why: "Mitsuba computes in single precision, and the Gaussian multiplies the half vector's rounding by 2t²/σ²",
            loose: None,
            measure: lobe,
        },
        Contract {
            id: "ward-mitsuba/pdf",
            function: "reflectance::Ward::pdf",
            oracle: ORACLE,
            domain: GEOMETRIES,
            metric: Metric::Relative,
            bound: 6e-6,
            why: "as above",
            loose: None,
            measure: pdf,
        },
        Contract {
            id: "ward-mitsuba/furnace",
            function: "reflectance::Ward::albedo_from",
            oracle: ORACLE,
            domain: "a white furnace of 2·10⁶ samples each; σ 0.01, 0.05, 0.2, 0.5 and (0.1, 0.3), view cosines 1, 0.7, 0.3 and 0.1",
            metric: Metric::ZScore,
            bound: 4.0,
            why: "the largest of some seventy standard normal deviates is above 4 once in 230 runs; the snapshot is one run",
            loose: None,
            measure: furnace,
        },
    ]
}

#[derive(Deserialize)]
struct MitsubaLobe {
    variant: Option<String>,
    sigma: [f64; 2],
    views: Vec<[f64; 3]>,
    lights: Vec<Vec<[f64; 3]>>,
    values: Vec<Vec<f64>>,
}

fn lobe(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each(snapshots, tally, "lobe", Ward::evaluate)
}

fn pdf(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each(snapshots, tally, "pdf", Ward::pdf)
}

fn each(
    snapshots: &Snapshots,
    tally: &mut Tally,
    name: &str,
    of: fn(&Ward, DVec3, DVec3) -> f64,
) -> Result<()> {
    for case in snapshots.cases::<MitsubaLobe>("ward_mitsuba", name)? {
        let variant = case.variant.as_deref().unwrap_or("duer").parse()?;
        let [x, y] = case.sigma;
        let ward = Ward::anisotropic(variant, x, y)?;
        for ((view, lights), values) in case.views.iter().zip(&case.lights).zip(&case.values) {
            for (light, want) in lights.iter().zip(values) {
                let got = of(&ward, DVec3::from_array(*view), DVec3::from_array(*light));
                tally.compare(got, *want, || {
                    format!(
                        "{variant}, σ = ({x}, {y}), cosines {} and {}",
                        view[2], light[2]
                    )
                });
            }
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Furnace {
    variant: String,
    sigma: [f64; 2],
    views: Vec<[f64; 3]>,
    means: Vec<f64>,
    errors: Vec<f64>,
}

fn furnace(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Furnace>("ward_mitsuba", "furnace")? {
        let variant: Variant = case.variant.parse()?;
        let [x, y] = case.sigma;
        let ward = Ward::anisotropic(variant, x, y)?;
        for ((view, mean), error) in case.views.iter().zip(&case.means).zip(&case.errors) {
            let got = ward.albedo_from(DVec3::from_array(*view));
            // A weight that is 1 for every draw has no scatter but single precision's.
            tally.compare_scaled(got, *mean, error.max(1e-6), || {
                format!("{variant}, σ = ({x}, {y}), view cosine {}", view[2])
            });
        }
    }
    Ok(())
}
