//! Contracts of `reflectance`.

use std::f64::consts::PI;

use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally, generator};
use lobes::Result;
use lobes::glam::DVec3;
use lobes::reflectance::fit::{Measurement, Widths, fit};
use lobes::reflectance::recover::{KernelEstimate, recover_lobe};
use lobes::reflectance::{IsotropicCoefficients, Variant, Ward, approximation, lambert};

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "reflectance/lambert",
            function: "reflectance::lambert::{transfer, transfers, coefficient}",
            oracle: Oracle::Snapshot("lambert"),
            domain: "every degree to 256; 511, 512, 1023, 1024",
            metric: Metric::Relative,
            bound: 2e-15,
            why: "a product of l/2 rounded factors, whose errors add as a random walk",
            loose: None,
            measure: lambert_kernel,
        },
        Contract {
            id: "reflectance/lambert-far",
            function: "reflectance::lambert::{transfer, coefficient}",
            oracle: Oracle::Snapshot("lambert"),
            domain: "nine even degrees from 2^20 + 2 to 2^53",
            metric: Metric::Relative,
            bound: 1e-15,
            why: "a closed form of some ten roundings",
            loose: None,
            measure: lambert_far,
        },
        Contract {
            id: "reflectance/lobe",
            function: "Ward::evaluate",
            oracle: Oracle::Snapshot("ward"),
            domain: "500 geometries a lobe, σ 0.005 … 1, half vectors to 4σ, a third of the views at cosines 10⁻⁶ … 0.1",
            metric: Metric::Relative,
            bound: 5e-14,
            why: "the exponent reaches 16, and multiplies its own rounding",
            loose: None,
            measure: |snapshots, tally| lobes(snapshots, tally, "lobe"),
        },
        Contract {
            id: "reflectance/lobe-anisotropic",
            function: "Ward::evaluate, anisotropic",
            oracle: Oracle::Snapshot("ward"),
            domain: "500 geometries a lobe, σ_x and σ_y 0.005 … 1, half vectors to 4σ, a third of the views at cosines 10⁻⁶ … 0.1",
            metric: Metric::Relative,
            bound: 5e-14,
            why: "the exponent reaches 16, and multiplies its own rounding",
            loose: None,
            measure: |snapshots, tally| lobes(snapshots, tally, "lobe-anisotropic"),
        },
        Contract {
            id: "reflectance/lobe-batch",
            function: "Ward::evaluate_batch",
            oracle: Oracle::Snapshot("ward"),
            domain: "as reflectance/lobe and reflectance/lobe-anisotropic",
            metric: Metric::Relative,
            bound: 5e-14,
            why: "the exponent reaches 16, and multiplies its own rounding",
            loose: None,
            measure: batches,
        },
        Contract {
            id: "reflectance/albedo",
            function: "Ward::albedo",
            oracle: Oracle::Snapshot("ward"),
            domain: "σ 0.005 … 1, view cosines 1 … 10⁻⁶, three lobes",
            metric: Metric::Relative,
            bound: 1.5e-13,
            why: "the branch of √c_i beside the trapezoidal rule's strip where σ cos θ_v nears 1/6",
            loose: None,
            measure: albedos,
        },
        Contract {
            id: "reflectance/share-above-horizon",
            function: "Ward::share_above_horizon",
            oracle: Oracle::Snapshot("ward"),
            domain: "σ 0.005 … 1, view cosines 1 … 10⁻⁶",
            metric: Metric::Relative,
            bound: 2.5e-15,
            why: "a dozen error functions, and Gaussian tails cut at 10⁻¹⁷",
            loose: None,
            measure: shares,
        },
        Contract {
            id: "reflectance/zonal-normal",
            function: "Ward::zonal at normal incidence",
            oracle: Oracle::Snapshot("ward"),
            domain: "σ 0.005 … 0.5, degrees to 256, four lobes",
            metric: Metric::Absolute,
            bound: 4e-15,
            why: "sums of terms of either sign up to 1",
            loose: None,
            measure: |snapshots, tally| zonals(snapshots, tally, "zonal-normal"),
        },
        Contract {
            id: "reflectance/zonal-oblique",
            function: "Ward::zonal about the mirror direction",
            oracle: Oracle::Snapshot("ward"),
            domain: "σ 0.005 … 0.5, view cosines 0.02 … 0.87, degrees to 256, four lobes",
            metric: Metric::Scaled("b_0"),
            bound: 1e-13,
            why: "sums of terms of either sign up to b_0; 10⁻¹² is what the documentation says",
            loose: None,
            measure: |snapshots, tally| zonals(snapshots, tally, "zonal-oblique"),
        },
        Contract {
            id: "reflectance/isotropic",
            function: "reflectance::IsotropicCoefficients",
            oracle: Oracle::Snapshot("isotropic"),
            domain: "l and p to 6, σ 0.15 and 0.5, three lobes",
            metric: Metric::Absolute,
            bound: 1e-13,
            why: "sums of terms of either sign up to ½; the lowest panel of view elevations is cut at 10⁻⁶",
            loose: None,
            measure: isotropic,
        },
        Contract {
            id: "reflectance/approximation",
            function: "reflectance::approximation::{gaussian, series}",
            oracle: Oracle::Snapshot("ward"),
            domain: "σ 0.005 … 0.5, degrees to 256, four lobes, normal incidence",
            metric: Metric::Scaled("the bound that the function states"),
            bound: 1.0,
            why: "the bounds are read off the exact coefficients and rounded up; the largest error comes near them",
            loose: None,
            measure: approximations,
        },
        Contract {
            id: "reflectance/approximation-oblique",
            function: "reflectance::approximation::oblique",
            oracle: Oracle::Snapshot("ward"),
            domain: "as reflectance/zonal-oblique, where cos θ_v is at least σ and 0.1",
            metric: Metric::Scaled("the bound that the function states"),
            bound: 1.0,
            why: "as above",
            loose: None,
            measure: oblique_approximations,
        },
        Contract {
            id: "reflectance/recover",
            function: "reflectance::recover::recover_lobe",
            oracle: Oracle::Snapshot("ward"),
            domain: "ρ_d 0.3, ρ_s 0.4 and σ from 15 degrees of an exact kernel, σ 0.03 … 0.3, four lobes",
            metric: Metric::Relative,
            bound: 3e-9,
            why: "the golden section stops where the sum of squares no longer tells σ apart: at the root of the rounding",
            loose: None,
            measure: recovered,
        },
        Contract {
            id: "reflectance/fit",
            function: "reflectance::fit::fit",
            oracle: Oracle::Snapshot("ward"),
            domain: "ρ_d 0.3, ρ_s 0.4 and σ from 60 exact values of a lobe, σ 0.01 … 0.6, four lobes",
            metric: Metric::Relative,
            bound: 5e-12,
            why: "Levenberg and Marquardt end where a step is lost in rounding, and the rounding is that of 60 values",
            loose: None,
            measure: fitted,
        },
    ]
}

fn approximations(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Zonal>("ward", "zonal-normal")? {
        let variant = case.variant.parse()?;
        for (&degree, &value) in case.degrees.iter().zip(&case.values) {
            for near in [
                approximation::gaussian(variant, case.sigma, degree)?,
                approximation::series(variant, case.sigma, degree)?,
            ] {
                tally.compare_scaled(near.value, value, near.bound, || {
                    format!("{variant}, σ {}, l = {degree}", case.sigma)
                });
            }
        }
    }
    Ok(())
}

fn oblique_approximations(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Zonal>("ward", "zonal-oblique")? {
        let (variant, cosine) = (case.variant.parse()?, case.cosine.unwrap_or(1.0));
        if cosine < approximation::MIN_OBLIQUE_COSINE.max(case.sigma) {
            continue;
        }
        let top = case.degrees.iter().copied().max().unwrap_or(0);
        let near = approximation::oblique(variant, case.sigma, cosine, top)?;
        for (&degree, &value) in case.degrees.iter().zip(&case.values) {
            tally.compare_scaled(near.values[degree], value, near.bound, || {
                format!(
                    "{variant}, σ {}, view cosine {cosine}, l = {degree}",
                    case.sigma
                )
            });
        }
    }
    Ok(())
}

/// `ρ_d` and `ρ_s` of the surfaces that are recovered and fitted.
const ALBEDOS: [f64; 2] = [0.3, 0.4];

fn recovered(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Zonal>("ward", "zonal-normal")? {
        if !(0.03..=0.3).contains(&case.sigma) {
            continue;
        }
        let top = case.degrees.iter().copied().max().unwrap_or(0);
        let unknown = KernelEstimate {
            value: 0.0,
            standard_error: f64::INFINITY,
        };
        let mut kernel = vec![unknown; top + 1];
        for (&degree, &value) in case.degrees.iter().zip(&case.values) {
            kernel[degree] = KernelEstimate {
                value: ALBEDOS[0] * lambert::transfer(degree) / PI + ALBEDOS[1] * value,
                standard_error: 0.0,
            };
        }
        let found = recover_lobe(&kernel, case.variant.parse()?)?;
        for ([got, _], want) in [
            (found.diffuse, ALBEDOS[0]),
            (found.specular, ALBEDOS[1]),
            (found.sigma, case.sigma),
        ] {
            tally.compare(got, want, || format!("{}, σ {}", case.variant, case.sigma));
        }
    }
    Ok(())
}

fn fitted(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    #[derive(Deserialize)]
    struct Case {
        variant: String,
        sigma: f64,
        seed: u64,
        values: Vec<f64>,
    }
    for case in snapshots.cases::<Case>("ward", "fit")? {
        let measurements: Vec<Measurement> =
            generator::reflections_of(case.sigma, case.seed, case.values.len())
                .into_iter()
                .zip(&case.values)
                .map(|((view, light), lobe)| Measurement {
                    light,
                    view,
                    value: ALBEDOS[0] / PI + ALBEDOS[1] * lobe / light.z,
                    weight: 1.0,
                })
                .collect();
        let found = fit(&measurements, case.variant.parse()?, Widths::One)?;
        for (got, want) in [
            (found.diffuse, ALBEDOS[0]),
            (found.specular, ALBEDOS[1]),
            (found.sigma[0], case.sigma),
        ] {
            tally.compare(got.value, want, || {
                format!("{}, σ {}", case.variant, case.sigma)
            });
        }
    }
    Ok(())
}

fn isotropic(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    #[derive(Deserialize)]
    struct Case {
        variant: String,
        sigma: f64,
        degree: usize,
        values: Vec<f64>,
    }
    for case in snapshots.cases::<Case>("isotropic", "coefficients")? {
        let lobe = Ward::isotropic(case.variant.parse()?, case.sigma)?;
        let got = IsotropicCoefficients::new(&lobe, case.degree, case.degree)?;
        let mut values = case.values.iter();
        for l in 0..=case.degree {
            for p in 0..=case.degree {
                for (q, &want) in (0..=l.min(p)).zip(values.by_ref()) {
                    tally.compare(got.get(l, p, q as isize), want, || {
                        format!("{}, σ {}, l {l}, p {p}, q {q}", case.variant, case.sigma)
                    });
                }
            }
        }
    }
    Ok(())
}

fn lambert_kernel(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    #[derive(Deserialize)]
    struct Case {
        degrees: Vec<usize>,
        transfers: Vec<f64>,
        coefficients: Vec<f64>,
    }
    for case in snapshots.cases::<Case>("lambert", "kernel")? {
        for (index, &degree) in case.degrees.iter().enumerate() {
            let at = || format!("l = {degree}");
            tally.compare(lambert::transfer(degree), case.transfers[index], at);
            let transfers = lambert::transfers(degree)?;
            tally.compare(transfers[degree], case.transfers[index], at);
            tally.compare(lambert::coefficient(degree), case.coefficients[index], at);
        }
    }
    Ok(())
}

fn lambert_far(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    #[derive(Deserialize)]
    struct Case {
        degrees: Vec<usize>,
        transfers: Vec<f64>,
        coefficients: Vec<f64>,
    }
    for case in snapshots.cases::<Case>("lambert", "far")? {
        for (index, &degree) in case.degrees.iter().enumerate() {
            let at = || format!("l = {degree}");
            tally.compare(lambert::transfer(degree), case.transfers[index], at);
            tally.compare(lambert::coefficient(degree), case.coefficients[index], at);
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Lobes {
    variant: String,
    seed: u64,
    values: Vec<f64>,
}

impl Lobes {
    fn each(&self, mut with: impl FnMut(Ward, DVec3, DVec3, f64) -> Result<()>) -> Result<()> {
        let variant: Variant = self.variant.parse()?;
        // The even seeds are those of round lobes.
        let rows = generator::reflections(self.seed, self.values.len(), self.seed % 2 == 1);
        for (([sigma_x, sigma_y], view, light), &value) in rows.into_iter().zip(&self.values) {
            with(
                Ward::anisotropic(variant, sigma_x, sigma_y)?,
                view,
                light,
                value,
            )?;
        }
        Ok(())
    }
}

fn lobes(snapshots: &Snapshots, tally: &mut Tally, name: &str) -> Result<()> {
    for case in snapshots.cases::<Lobes>("ward", name)? {
        case.each(|lobe, view, light, value| {
            tally.compare(lobe.evaluate(view, light), value, || {
                where_of(&lobe, view.z)
            });
            Ok(())
        })?;
    }
    Ok(())
}

fn batches(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    let round = snapshots.cases::<Lobes>("ward", "lobe")?;
    for case in round
        .iter()
        .chain(&snapshots.cases("ward", "lobe-anisotropic")?)
    {
        case.each(|lobe, view, light, value| {
            // Eleven lights: one block of eight and a rest.
            let mut out = [0.0; 11];
            lobe.evaluate_batch(view, &[light; 11], &mut out)?;
            for got in [out[0], out[10]] {
                tally.compare(got, value, || where_of(&lobe, view.z));
            }
            Ok(())
        })?;
    }
    Ok(())
}

#[derive(Deserialize)]
struct Albedos {
    variant: Option<String>,
    sigma: f64,
    cosines: Vec<f64>,
    values: Vec<f64>,
}

fn albedos(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Albedos>("ward", "albedo")? {
        let variant = case.variant.as_deref().unwrap_or_default().parse()?;
        let lobe = Ward::isotropic(variant, case.sigma)?;
        for (&cosine, &value) in case.cosines.iter().zip(&case.values) {
            tally.compare(lobe.albedo(cosine), value, || where_of(&lobe, cosine));
        }
    }
    Ok(())
}

fn shares(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Albedos>("ward", "share")? {
        let lobe = Ward::isotropic(Variant::RadianceSampled, case.sigma)?;
        for (&cosine, &value) in case.cosines.iter().zip(&case.values) {
            tally.compare(lobe.share_above_horizon(cosine), value, || {
                where_of(&lobe, cosine)
            });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Zonal {
    variant: String,
    sigma: f64,
    cosine: Option<f64>,
    degrees: Vec<usize>,
    values: Vec<f64>,
}

fn zonals(snapshots: &Snapshots, tally: &mut Tally, name: &str) -> Result<()> {
    for case in snapshots.cases::<Zonal>("ward", name)? {
        let lobe = Ward::isotropic(case.variant.parse()?, case.sigma)?;
        let cosine = case.cosine.unwrap_or(1.0);
        let top = case.degrees.iter().copied().max().unwrap_or(0);
        let got = lobe.zonal(cosine, top)?;
        for (&degree, &value) in case.degrees.iter().zip(&case.values) {
            let at = || format!("l = {degree}, {}", where_of(&lobe, cosine));
            if case.cosine.is_some() {
                tally.compare_scaled(got[degree], value, case.values[0], at);
            } else {
                tally.compare(got[degree], value, at);
            }
        }
    }
    Ok(())
}

fn where_of(lobe: &Ward, cosine: f64) -> String {
    let [x, y] = lobe.sigma();
    format!(
        "{}, σ ({x:.4}, {y:.4}), view cosine {cosine:.3e}",
        lobe.variant()
    )
}
