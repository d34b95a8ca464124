//! Zonal convolution against the kernel itself.

use lobes::glam::DVec3;

use super::generator::uniform;
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::Result;
use lobes::harmonics::{
    Coefficients, convolve_zonal, deconvolve_zonal, evaluate, evaluate_all, zonal_factor,
};

/// K(x) = 1 + 2x + 3x² − x³ in Legendre polynomials: x² = (2P₂ + 1)/3, x³ = (2P₃ + 3P₁)/5.
const KERNEL: [f64; 4] = [2.0, 1.4, 2.0, -0.4];
const FLOOR: f64 = 0.25;

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "convolution/kernel",
            function: "harmonics::{convolve_zonal, zonal_factor}",
            oracle: Oracle::Identity(
                "a point source convolved with K is K(ω·ω₀), K(x) = 1 + 2x + 3x² − x³",
            ),
            domain: "30 pairs of random directions",
            metric: Metric::Absolute,
            bound: 4e-15,
            why: "K reaches 6; a sum of 16 products",
            loose: None,
            measure: kernel,
        },
        Contract {
            id: "convolution/inverse",
            function: "harmonics::deconvolve_zonal",
            oracle: Oracle::Identity("each coefficient times factor²/(factor² + floor²)"),
            domain: "the same after convolution, with no floor and with a floor of a quarter",
            metric: Metric::Absolute,
            bound: 5e-16,
            why: "a few roundings of numbers near one",
            loose: None,
            measure: inverse,
        },
    ]
}

fn directions() -> Vec<DVec3> {
    uniform(950, 180)
        .chunks_exact(3)
        .map(|v| DVec3::new(v[0], v[1], v[2]).normalize())
        .collect()
}

fn point_source(direction: DVec3) -> Result<Coefficients> {
    let mut source = Coefficients::zeros(KERNEL.len() - 1);
    evaluate_all(direction, KERNEL.len() - 1, source.as_mut_slice())?;
    Ok(source)
}

fn factors() -> Vec<f64> {
    (0..KERNEL.len())
        .map(|l| KERNEL[l] * zonal_factor(l).powi(2))
        .collect()
}

fn kernel(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    for pair in directions().chunks_exact(2) {
        let mut field = point_source(pair[0])?;
        convolve_zonal(&mut field, &factors())?;
        let x = pair[0].dot(pair[1]);
        let want = 1.0 + x * (2.0 + x * (3.0 - x));
        tally.compare(evaluate(&field, pair[1])?, want, || format!("ω·ω₀ = {x}"));
    }
    Ok(())
}

fn inverse(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    for direction in directions() {
        let source = point_source(direction)?;
        for floor in [0.0, FLOOR] {
            let mut field = source.clone();
            convolve_zonal(&mut field, &factors())?;
            deconvolve_zonal(&mut field, &factors(), floor)?;
            for (l, factor) in factors().iter().enumerate() {
                let kept = factor * factor / (factor * factor + floor * floor);
                for m in -(l as isize)..=l as isize {
                    let (got, want) = (field.get(l, m), kept * source.get(l, m));
                    tally.compare(got, want, || format!("floor {floor}, l = {l}, m = {m}"));
                }
            }
        }
    }
    Ok(())
}
