//! The GGX lobe: Fresnel's equations, the lobe, its sampler, its albedo and its zonal coefficients.

use lobes::glam::DVec3;
use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally, generator};
use lobes::reflectance::{Fresnel, Ggx, Masking, approximation};
use lobes::{Error, Result};

const ORACLE: Oracle = Oracle::Snapshot("ggx");
const MITSUBA: Oracle = Oracle::Snapshot("ggx_mitsuba");
const GEOMETRIES: &str = "200 geometries each of seven reflectances, α 0.005 … 1, one width and two, half vectors to 4α, a third of the views at cosines 10⁻⁶ … 0.1";
const PLUGINS: &str = "36 geometries each, half vectors to 98 % of the distribution, view cosines from 0.05; α 0.01, 0.1, 0.5 and (0.1, 0.4)";

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "ggx/fresnel",
            function: "reflectance::Fresnel::reflectance",
            oracle: ORACLE,
            domain: "eleven boundaries, indices 0.05 … 10, extinctions to 8, cosines 1 … 0",
            metric: Metric::Relative,
            bound: 3e-15,
            why: "some twenty roundings; differences that cancel are taken apart",
            loose: None,
            measure: fresnel,
        },
        Contract {
            id: "ggx/lobe",
            function: "reflectance::Ggx::{evaluate, brdf}",
            oracle: ORACLE,
            domain: GEOMETRIES,
            metric: Metric::Relative,
            bound: 1e-14,
            why: "some fifty roundings, of which the fourth power of the slopes multiplies those of the half vector",
            loose: None,
            measure: lobe,
        },
        Contract {
            id: "ggx/lobe-batch",
            function: "reflectance::Ggx::evaluate_batch",
            oracle: ORACLE,
            domain: "as ggx/lobe",
            metric: Metric::Relative,
            bound: 1e-14,
            why: "as above",
            loose: None,
            measure: batch,
        },
        Contract {
            id: "ggx/lobe-ends",
            function: "reflectance::Ggx::evaluate, α = 0.001 and 1",
            oracle: ORACLE,
            domain: "100 geometries each, half vectors to 4 · 0.001 and to 2.8, a third of the views at cosines 10⁻⁶ … 0.1",
            metric: Metric::Relative,
            bound: 1e-14,
            why: "as above",
            loose: None,
            measure: ends,
        },
        Contract {
            id: "ggx/distribution",
            function: "reflectance::Ggx::distribution",
            oracle: ORACLE,
            domain: "as ggx/lobe",
            metric: Metric::Relative,
            bound: 1e-14,
            why: "as above",
            loose: None,
            measure: distribution,
        },
        Contract {
            id: "ggx/masking",
            function: "reflectance::Ggx::masking",
            oracle: ORACLE,
            domain: "as ggx/lobe",
            metric: Metric::Relative,
            bound: 2e-15,
            why: "a dozen roundings",
            loose: None,
            measure: masking,
        },
        Contract {
            id: "ggx/pdf",
            function: "reflectance::Ggx::pdf",
            oracle: ORACLE,
            domain: "as ggx/lobe and ggx/lobe-ends",
            metric: Metric::Relative,
            bound: 1e-14,
            why: "as ggx/lobe",
            loose: None,
            measure: pdf,
        },
        Contract {
            id: "ggx/sample",
            function: "reflectance::Ggx::sample",
            oracle: ORACLE,
            domain: "the lights and weights of 64 pairs of numbers each; α 0.001, 0.1, 0.4, 1 and (0.05, 0.3), view cosines from 10⁻⁶",
            metric: Metric::Absolute,
            bound: 2e-14,
            why: "the reflection doubles the half vector's roundings; a weight near a light at the horizon follows that light's height over its own",
            loose: None,
            measure: sample,
        },
        Contract {
            id: "ggx/albedo",
            function: "reflectance::Ggx::{albedo, albedo_from}",
            oracle: ORACLE,
            domain: "α 0.001 … 1 and (0.1, 0.4), (0.02, 1), view cosines 1 … 10⁻⁶, five reflectances",
            metric: Metric::Relative,
            bound: 1e-10,
            why: "panels where the horizon cuts the ridge of a lobe whose widths differ fifty times; a lobe of one width keeps 5·10⁻¹⁵",
            loose: None,
            measure: albedo,
        },
        Contract {
            id: "ggx/zonal",
            function: "reflectance::Ggx::zonal",
            oracle: ORACLE,
            domain: "α 0.001 … 1 and (0.2, 0.5), degrees to 256, three maskings, three reflectances",
            metric: Metric::Absolute,
            bound: 5e-15,
            why: "sums of terms of either sign up to 1",
            loose: None,
            measure: zonal,
        },
        Contract {
            id: "ggx/bessel",
            function: "reflectance::approximation::bessel, its value x K₁(x)",
            oracle: ORACLE,
            domain: "α 0.001 … 1, x 0.003 … 700",
            metric: Metric::Relative,
            bound: 2e-13,
            why: "K₁ falls as e^(−x), so that a rounding of x counts x times",
            loose: None,
            measure: bessel,
        },
        Contract {
            id: "ggx/bessel-bound",
            function: "reflectance::approximation::bessel, its bound",
            oracle: ORACLE,
            domain: "α 0.001 … 1, degrees to 256, three maskings",
            metric: Metric::Scaled("the bound that the function states"),
            bound: 1.0,
            why: "the bounds are read off the exact coefficients and rounded up; one of them is exact at l = 0",
            loose: None,
            measure: bessel_bound,
        },
        Contract {
            id: "ggx/mitsuba-lobe",
            function: "reflectance::Ggx::evaluate",
            oracle: MITSUBA,
            domain: PLUGINS,
            metric: Metric::Relative,
            bound: 2e-6,
            why: "Mitsuba computes in single precision, and the distribution multiplies the half vector's rounding by up to 4; G₂ is made separable as Mitsuba's is",
            loose: None,
            measure: mitsuba_lobe,
        },
        Contract {
            id: "ggx/mitsuba-pdf",
            function: "reflectance::Ggx::pdf",
            oracle: MITSUBA,
            domain: PLUGINS,
            metric: Metric::Relative,
            bound: 2e-6,
            why: "as above",
            loose: None,
            measure: mitsuba_pdf,
        },
        Contract {
            id: "ggx/mitsuba-furnace",
            function: "reflectance::Ggx::albedo_from",
            oracle: MITSUBA,
            domain: "a white furnace of 2·10⁶ visible normals each; α 0.01, 0.1, 0.5 and (0.1, 0.4), view cosines 1, 0.7, 0.3 and 0.1",
            metric: Metric::ZScore,
            bound: 4.0,
            why: "the largest of 16 standard normal deviates is above 4 once in 1000 runs; the snapshot is one run",
            loose: None,
            measure: mitsuba_furnace,
        },
    ]
}

fn named(kind: &str, parameters: &[f64]) -> Result<Fresnel> {
    match (kind, parameters) {
        ("constant", &[value]) => Ok(Fresnel::Constant(value)),
        ("schlick", &[normal]) => Ok(Fresnel::Schlick { normal }),
        ("dielectric", &[index]) => Ok(Fresnel::Dielectric { index }),
        ("conductor", &[index, extinction]) => Ok(Fresnel::Conductor { index, extinction }),
        _ => Err(Error::UnknownName {
            what: "reflectance of a boundary",
            name: format!("{kind} of {} parameters", parameters.len()),
            names: ["constant", "schlick", "dielectric", "conductor"]
                .map(str::to_owned)
                .to_vec(),
        }),
    }
}

fn where_of(lobe: &Ggx, cosine: f64) -> String {
    let [x, y] = lobe.alpha();
    format!(
        "{:?}, α ({x:.4}, {y:.4}), view cosine {cosine:.3e}",
        lobe.fresnel()
    )
}

fn fresnel(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    #[derive(Deserialize)]
    struct Case {
        kind: String,
        parameters: Vec<f64>,
        cosines: Vec<f64>,
        values: Vec<f64>,
    }
    for case in snapshots.cases::<Case>("ggx", "fresnel")? {
        let boundary = named(&case.kind, &case.parameters)?;
        for (&cosine, &value) in case.cosines.iter().zip(&case.values) {
            tally.compare(boundary.reflectance(cosine), value, || {
                format!("{boundary:?}, cosine {cosine}")
            });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct GgxLobes {
    kind: String,
    parameters: Vec<f64>,
    seed: u64,
    values: Vec<f64>,
    densities: Vec<f64>,
    distributions: Vec<f64>,
    maskings: Vec<f64>,
}

/// Of every geometry the lobe, view and light, and what `answers` has of it, if anything.
fn each_lobe(
    snapshots: &Snapshots,
    answers: fn(&GgxLobes) -> &[f64],
    mut with: impl FnMut(&Ggx, DVec3, DVec3, f64) -> Result<()>,
) -> Result<()> {
    for case in snapshots.cases::<GgxLobes>("ggx", "lobe")? {
        let boundary = named(&case.kind, &case.parameters)?;
        let count = case.values.len();
        // The even seeds are those of round lobes.
        let rows = generator::reflections(case.seed, count, case.seed % 2 == 1);
        for (([x, y], view, light), &value) in rows.into_iter().zip(answers(&case)) {
            with(&Ggx::anisotropic(x, y, boundary)?, view, light, value)?;
        }
    }
    Ok(())
}

fn lobe(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each_lobe(
        snapshots,
        |case| &case.values,
        |lobe, view, light, value| {
            for got in [lobe.evaluate(view, light), lobe.brdf(light, view) * light.z] {
                tally.compare(got, value, || where_of(lobe, view.z));
            }
            Ok(())
        },
    )
}

fn batch(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each_lobe(
        snapshots,
        |case| &case.values,
        |lobe, view, light, value| {
            // Eleven lights: one block of eight and a rest.
            let mut out = [0.0; 11];
            lobe.evaluate_batch(view, &[light; 11], &mut out)?;
            for got in [out[0], out[10]] {
                tally.compare(got, value, || where_of(lobe, view.z));
            }
            Ok(())
        },
    )
}

fn distribution(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each_lobe(
        snapshots,
        |case| &case.distributions,
        |lobe, view, light, value| {
            tally.compare(lobe.distribution(view + light), value, || {
                where_of(lobe, view.z)
            });
            Ok(())
        },
    )
}

fn masking(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each_lobe(
        snapshots,
        |case| &case.maskings,
        |lobe, view, light, value| {
            tally.compare(lobe.masking(view, light), value, || where_of(lobe, view.z));
            Ok(())
        },
    )
}

#[derive(Deserialize)]
struct Ends {
    alpha: f64,
    sigma: f64,
    seed: u64,
    values: Vec<f64>,
    densities: Vec<f64>,
}

fn each_end(
    snapshots: &Snapshots,
    answers: fn(&Ends) -> &[f64],
    mut with: impl FnMut(&Ggx, DVec3, DVec3, f64),
) -> Result<()> {
    for case in snapshots.cases::<Ends>("ggx", "ends")? {
        let lobe = Ggx::isotropic(case.alpha, Fresnel::Constant(1.0))?;
        let rows = generator::reflections_of(case.sigma, case.seed, case.values.len());
        for ((view, light), &value) in rows.into_iter().zip(answers(&case)) {
            with(&lobe, view, light, value);
        }
    }
    Ok(())
}

fn ends(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each_end(
        snapshots,
        |case| &case.values,
        |lobe, view, light, value| {
            tally.compare(lobe.evaluate(view, light), value, || where_of(lobe, view.z));
        },
    )
}

fn pdf(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each_lobe(
        snapshots,
        |case| &case.densities,
        |lobe, view, light, value| {
            tally.compare(lobe.pdf(view, light), value, || where_of(lobe, view.z));
            Ok(())
        },
    )?;
    each_end(
        snapshots,
        |case| &case.densities,
        |lobe, view, light, value| {
            tally.compare(lobe.pdf(view, light), value, || where_of(lobe, view.z));
        },
    )
}

fn sample(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    #[derive(Deserialize)]
    struct Case {
        kind: String,
        parameters: Vec<f64>,
        alpha: [f64; 2],
        view: [f64; 3],
        numbers: Vec<[f64; 2]>,
        lights: Vec<[f64; 3]>,
        weights: Vec<f64>,
    }
    for case in snapshots.cases::<Case>("ggx", "sample")? {
        let [x, y] = case.alpha;
        let lobe = Ggx::anisotropic(x, y, named(&case.kind, &case.parameters)?)?;
        let view = DVec3::from_array(case.view);
        let wanted = case.lights.iter().zip(&case.weights);
        for (&numbers, (light, &weight)) in case.numbers.iter().zip(wanted) {
            let got = lobe.sample(view, numbers);
            let at = || format!("{}, {numbers:?}", where_of(&lobe, view.z));
            for (got, &want) in got.light.to_array().into_iter().zip(light) {
                tally.compare(got, want, at);
            }
            tally.compare(got.weight, weight, at);
        }
    }
    Ok(())
}

fn albedo(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    #[derive(Deserialize)]
    struct Case {
        kind: String,
        parameters: Vec<f64>,
        alpha: [f64; 2],
        views: Vec<[f64; 3]>,
        values: Vec<f64>,
    }
    for case in snapshots.cases::<Case>("ggx", "albedo")? {
        let [x, y] = case.alpha;
        let lobe = Ggx::anisotropic(x, y, named(&case.kind, &case.parameters)?)?;
        for (view, &value) in case.views.iter().zip(&case.values) {
            let view = DVec3::from_array(*view);
            tally.compare(lobe.albedo_from(view), value, || where_of(&lobe, view.z));
            if view.y == 0.0 {
                tally.compare(lobe.albedo(view.z), value, || where_of(&lobe, view.z));
            }
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct GgxZonal {
    kind: String,
    parameters: Vec<f64>,
    alpha: [f64; 2],
    masking: String,
    degrees: Vec<usize>,
    values: Vec<f64>,
}

fn zonal(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<GgxZonal>("ggx", "zonal")? {
        let [x, y] = case.alpha;
        let lobe = Ggx::anisotropic(x, y, named(&case.kind, &case.parameters)?)?;
        let top = case.degrees.iter().copied().max().unwrap_or(0);
        let got = lobe.zonal(case.masking.parse()?, top)?;
        for (&degree, &value) in case.degrees.iter().zip(&case.values) {
            tally.compare(got[degree], value, || {
                format!("{}, {}, l = {degree}", case.masking, where_of(&lobe, 1.0))
            });
        }
    }
    Ok(())
}

fn bessel(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    #[derive(Deserialize)]
    struct Case {
        alpha: f64,
        degrees: Vec<usize>,
        values: Vec<f64>,
    }
    for case in snapshots.cases::<Case>("ggx", "bessel")? {
        for (&degree, &value) in case.degrees.iter().zip(&case.values) {
            let got = approximation::bessel(Masking::Smith, case.alpha, degree)?;
            tally.compare(got.value, value, || {
                format!("α {}, l = {degree}", case.alpha)
            });
        }
    }
    Ok(())
}

fn bessel_bound(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<GgxZonal>("ggx", "zonal")? {
        if case.kind != "constant" || case.alpha[0] != case.alpha[1] {
            continue;
        }
        for (&degree, &value) in case.degrees.iter().zip(&case.values) {
            let near = approximation::bessel(case.masking.parse()?, case.alpha[0], degree)?;
            tally.compare_scaled(near.value, value, near.bound, || {
                format!("{}, α {}, l = {degree}", case.masking, case.alpha[0])
            });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Plugin {
    plugin: String,
    kind: String,
    parameters: Vec<f64>,
    alpha: [f64; 2],
    views: Vec<[f64; 3]>,
    lights: Vec<Vec<[f64; 3]>>,
    values: Vec<Vec<f64>>,
    densities: Vec<Vec<f64>>,
}

fn each_plugin(
    snapshots: &Snapshots,
    tally: &mut Tally,
    answers: fn(&Plugin) -> &[Vec<f64>],
    of: fn(&Ggx, DVec3, DVec3) -> f64,
) -> Result<()> {
    for case in snapshots.cases::<Plugin>("ggx_mitsuba", "lobe")? {
        let [x, y] = case.alpha;
        let lobe = Ggx::anisotropic(x, y, named(&case.kind, &case.parameters)?)?;
        let geometry = case.views.iter().zip(&case.lights);
        for ((view, lights), values) in geometry.zip(answers(&case)) {
            let view = DVec3::from_array(*view);
            for (light, &value) in lights.iter().zip(values) {
                tally.compare(of(&lobe, view, DVec3::from_array(*light)), value, || {
                    format!("{}: {}", case.plugin, where_of(&lobe, view.z))
                });
            }
        }
    }
    Ok(())
}

fn mitsuba_lobe(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each_plugin(
        snapshots,
        tally,
        |case| &case.values,
        |lobe, view, light| {
            // Seen along the normal nothing is masked, so that this is G₁.
            let alone = |direction| lobe.masking(direction, DVec3::Z);
            lobe.evaluate(view, light) * (alone(view) * alone(light) / lobe.masking(view, light))
        },
    )
}

fn mitsuba_pdf(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each_plugin(snapshots, tally, |case| &case.densities, Ggx::pdf)
}

fn mitsuba_furnace(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    #[derive(Deserialize)]
    struct Case {
        alpha: [f64; 2],
        views: Vec<[f64; 3]>,
        means: Vec<f64>,
        errors: Vec<f64>,
    }
    for case in snapshots.cases::<Case>("ggx_mitsuba", "furnace")? {
        let [x, y] = case.alpha;
        let lobe = Ggx::anisotropic(x, y, Fresnel::Constant(1.0))?;
        for ((view, &mean), error) in case.views.iter().zip(&case.means).zip(&case.errors) {
            let view = DVec3::from_array(*view);
            // The sum of single precision has its own rounding.
            tally.compare_scaled(lobe.albedo_from(view), mean, error.max(1e-6), || {
                where_of(&lobe, view.z)
            });
        }
    }
    Ok(())
}
