//! Simulation-based calibration of the evidence: ranks of what draws of the model's own prior are
//! made of among their posteriors.
//!
//! ```text
//! cargo run --release -p lobes-experiments --example simulated_ranks -- --draws 1000
//! ```
//!
//! σ, the specular share and the spectrum of the light are drawn evenly from a grid, the light from
//! its Gaussian field with two lamps, the strength k from any law (here 10^(−1 … 1)), and the
//! noise; the posterior is taken on the same grid with [`GaussianEvidence`]. If the code is right,
//! P(parameter below the true one) + U P(that one), U uniform, is uniform (Talts et al. 2018,
//! arXiv:1804.06788; Cook, Gelman and Rubin 2006, doi:10.1198/106186006X136976). Of the strength,
//! which is all that the model knows of base colour and exposure, it is P(k below the true one),
//! whatever the law, since 1/k is the scale's own prior. Twenty bins, χ² of 19 degrees of freedom:
//! each of the three is above 36.19 in one of a hundred runs of code that is right.

use lobes::features::{Modes, RingLayout};
use lobes::harmonics::legendre;
use lobes::inference::{
    BrightLights, GaussianEvidence, SmoothModes, SmoothOperator, log_sum_exp, natural_spectrum,
};
use lobes::reflectance::Variant;
use lobes::reflection::{Operator, Viewpoint};
use lobes::{Parallelism, Result};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// As many rings as there are smooth functions, so that white noise on rings is white in them too.
const RINGS: usize = 24;
const ORDERS: usize = 16;
const DEGREE: usize = 48;
const NOISE: f64 = 1e-2;
const BINS: usize = 20;
/// τ², as `GaussianEvidence` has it.
const LAMPS: f64 = 100.0;

fn deviate(rng: &mut Pcg64) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let draws: usize = arguments
        .iter()
        .position(|argument| argument == "--draws")
        .and_then(|at| arguments.get(at + 1)?.parse().ok())
        .unwrap_or(100);
    let one = Parallelism::Sequential;
    let layout = RingLayout::new(Viewpoint::Orthographic, RINGS, ORDERS)?;
    let sigmas: Vec<f64> = (0..6).map(|i| 0.04 * 1.5f64.powi(i)).collect();
    let shares: Vec<f64> = (0..6).map(|i| 0.1 + 0.16 * f64::from(i)).collect();
    let spectra = [0.2, 0.8].map(|eta| natural_spectrum(eta, DEGREE));
    let operators = sigmas
        .iter()
        .map(|sigma| {
            let (lobe, view) = (Variant::default(), Viewpoint::Orthographic);
            let operator = Operator::new(lobe, *sigma, view, layout.angles(), DEGREE, one)?;
            let smooth = SmoothOperator::new(&operator, &layout)?;
            Ok((operator, smooth))
        })
        .collect::<Result<Vec<_>>>()?;
    // σ, share, spectrum.
    let mut points = Vec::new();
    for sigma in 0..sigmas.len() {
        for share in 0..shares.len() {
            for spectrum in 0..spectra.len() {
                points.push((sigma, share, spectrum));
            }
        }
    }
    let factors = Parallelism::Rayon.map(points.len(), |i| {
        let (sigma, share, spectrum) = points[i];
        let share = shares[share];
        let smooth = &operators[sigma].1;
        GaussianEvidence::new(smooth, &spectra[spectrum], 1.0 - share, share, NOISE)
    });
    let factors = factors.into_iter().collect::<Result<Vec<_>>>()?;
    let directions = vec![(0.6, 0.4), (1.3, -2.0)];
    let lamps = BrightLights::from_directions(directions.clone());
    let responses = operators
        .iter()
        .map(|(_, smooth)| smooth.responses(&lamps))
        .collect::<Result<Vec<_>>>()?;
    let chi = |degrees: f64| ChiSquared::new(degrees).ok();
    let amplitudes = chi((RINGS * (1 + 2 * ORDERS)) as f64);
    let ranks = Parallelism::Rayon.map(draws, |draw| -> Result<[f64; 3]> {
        let mut rng = Pcg64::seed_from_u64(1_000_003 + draw as u64);
        let (sigma, share, spectrum) = points[rng.random_range(0..points.len())];
        let strength = 10f64.powf(2.0 * rng.random::<f64>() - 1.0);
        let (rho_d, rho_s) = (1.0 - shares[share], shares[share]);
        let (operator, power) = (&operators[sigma].0, &spectra[spectrum]);
        let mut total = 0.0;
        for m in 1..=ORDERS {
            total += operator.covariance(m, power, rho_d, rho_s)?.trace();
        }
        let white = NOISE * (total / (ORDERS * RINGS) as f64).sqrt();
        let fluxes = [(); 2].map(|()| LAMPS.sqrt() * deviate(&mut rng));
        let mut values = Vec::with_capacity(layout.len());
        for m in 0..=ORDERS {
            let block = operator.block(m, rho_d, rho_s)?;
            for part in 0..if m == 0 { 1 } else { 2 } {
                let mut light: Vec<f64> = power[m..]
                    .iter()
                    .map(|power| power.sqrt() * deviate(&mut rng))
                    .collect();
                for ((polar, azimuth), flux) in directions.iter().zip(fluxes) {
                    let mut column = vec![0.0; light.len()];
                    let (sin, cos) = f64::sin_cos(*polar);
                    legendre::column(m, DEGREE, cos, sin, &mut column)?;
                    let (sin, cos) = (m as f64 * azimuth).sin_cos();
                    let wave = if part == 0 { cos } else { sin };
                    for (light, value) in light.iter_mut().zip(column) {
                        *light += flux * wave * value;
                    }
                }
                for ring in 0..RINGS {
                    let row = block.row(ring);
                    let shown: f64 = row.iter().zip(&light).map(|(t, l)| t * l).sum();
                    values.push(strength.sqrt() * (shown + white * deviate(&mut rng)));
                }
            }
        }
        let modes = SmoothModes::new(&Modes::from_values(&layout, values)?, &layout)?;
        let evidence = points
            .iter()
            .zip(&factors)
            .map(|((sigma, _, _), factor)| factor.of(&modes, &responses[*sigma]))
            .collect::<Result<Vec<_>>>()?;
        let all = log_sum_exp(evidence.iter().map(|of| of.log));
        let weights: Vec<f64> = evidence.iter().map(|of| (of.log - all).exp()).collect();
        let mut rank = |index: &dyn Fn(&(usize, usize, usize)) -> usize, truth: usize| {
            let mass = |which: std::cmp::Ordering| -> f64 {
                let of = points.iter().zip(&weights);
                of.filter(|(point, _)| index(point).cmp(&truth) == which)
                    .map(|(_, weight)| weight)
                    .sum()
            };
            mass(std::cmp::Ordering::Less) + rng.random::<f64>() * mass(std::cmp::Ordering::Equal)
        };
        let of_sigma = rank(&|point| point.0, sigma);
        let of_share = rank(&|point| point.1, share);
        let count = (RINGS * (1 + 2 * ORDERS)) as f64;
        let below = |log_strength: f64| {
            let ratio = count * log_strength.exp() / strength;
            amplitudes.as_ref().map_or(f64::NAN, |chi| chi.sf(ratio))
        };
        let of_strength = evidence
            .iter()
            .zip(&weights)
            .map(|(of, weight)| weight * below(of.log_strength))
            .sum();
        Ok([of_sigma, of_share, of_strength])
    });
    let ranks = ranks.into_iter().collect::<Result<Vec<_>>>()?;
    println!("| of | χ² of {BINS} bins, {draws} draws | probability of more |");
    println!("| --- | ---: | ---: |");
    for (which, name) in ["σ", "the specular share", "the strength"]
        .iter()
        .enumerate()
    {
        let mut counts = [0.0; BINS];
        for rank in &ranks {
            counts[((rank[which] * BINS as f64) as usize).min(BINS - 1)] += 1.0;
        }
        let expected = draws as f64 / BINS as f64;
        let square: f64 = counts
            .iter()
            .map(|count| (count - expected).powi(2) / expected)
            .sum();
        let more = chi((BINS - 1) as f64).map_or(f64::NAN, |chi| chi.sf(square));
        println!("| {name} | {square:.1} | {more:.3} |");
        assert!(more > 1e-4, "{name}: χ² {square}");
    }
    Ok(())
}
