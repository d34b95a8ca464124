//! The harmonics of a Ward lobe in the frame of its own normal, by a one-dimensional quadrature.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

use crate::harmonics::legendre;
use crate::reflectance::Variant;
use crate::sphere::Rule;

/// Nodes in one panel of the composite Gauss–Legendre rule.
pub(super) const NODES: usize = 24;

/// Lobes are dropped where their exponential is below exp(−REACH²), less than half a unit of
/// rounding.
const REACH: f64 = 6.1;

/// The zonal nodes of a lobe and what each order m' weighs there.
struct Node {
    /// cos and sin of the light's angle from the normal.
    cosine: f64,
    sine: f64,
    /// The quadrature weight, the solid angle's sine included.
    weight: f64,
}

/// The coefficients `f_lm'` of the lobe `F(ω) = f(ω, v)·cos θ_ω` of one view direction, in the
/// frame whose pole is the surface's normal and whose meridian φ = 0 holds the mirror direction.
///
/// F is even in φ, so only the cosine harmonics occur. Stored by m', then by l = m' … degree.
///
/// Every variant is `A(c_i, c_v)·(1 or |H|²)·exp(−|H_xy|²/(σ²H_z²))` with H = v + i, where `|H_xy|²
/// = (s_v − s_i)² + 2 s_v s_i (1 − cos φ)`. So the integral over φ is a modified Bessel function,
/// `∫ exp(−κ(1 − cos φ)) cos m'φ dφ = 2π e^(−κ) I_m'(κ)` with `κ = 2 s_v s_i/(σ²H_z²)`, and what is
/// left of the exponent is `exp(−tan²((θ_v − θ_i)/2)/σ²)`. Only the integral over `θ_i` is done
/// numerically, on panels so short that the harmonics and the lobe are resolved to rounding, graded
/// towards the horizon, where `H_z = 0` comes close for grazing views.
pub(super) fn lobe_coefficients(
    variant: Variant,
    sigma: f64,
    view_angle: f64,
    degree: usize,
    panel: &Rule,
) -> Vec<f64> {
    let mut columns = vec![0.0; (degree + 1) * (degree + 2) / 2];
    let (view_sine, view_cosine) = view_angle.sin_cos();
    let nodes = nodes(sigma, view_angle, degree, panel);
    let count = nodes.len();
    let powers = variant.powers();
    // weights[m'·count + i]: what node i gives to order m'.
    let mut weights = vec![0.0; (degree + 1) * count];
    let mut bessel = vec![0.0; degree + 2];
    let mut difference = vec![0.0; degree + 2];
    for (i, node) in nodes.iter().enumerate() {
        let height = node.cosine + view_cosine;
        let tangent = (view_sine - node.sine) / height;
        let product = 2.0 * view_sine * node.sine;
        let kappa = product / (sigma * height).powi(2);
        scaled_bessel(kappa, &mut bessel, &mut difference);
        let envelope = (-(tangent / sigma).powi(2)).exp() / (4.0 * PI * sigma * sigma)
            * 2.0
            * PI
            * node.weight;
        let in_plane = height * height * (1.0 + tangent * tangent);
        // |H|² = in_plane + product·(1 − cos φ); the second term's order m' is product·(I_m' −
        // (I_(m'−1) + I_(m'+1))/2), written so that it does not cancel at large κ.
        let squared_half = |m: usize| {
            let spread = if kappa > 0.0 {
                difference[m] - m as f64 / kappa * bessel[m]
            } else {
                0.0
            };
            in_plane * bessel[m] + product * spread
        };
        let factor = powers.value(node.cosine, view_cosine, 0.0, height);
        for m in 0..=degree {
            let norm = if m == 0 { envelope } else { envelope * SQRT_2 };
            // (1 + t²) = |H|²/H_z², of which each power has its own transform over azimuth.
            let azimuth = match powers.secant {
                0 => bessel[m],
                _ => squared_half(m) / (height * height),
            };
            weights[m * count + i] = norm * factor * azimuth;
        }
    }
    project(&nodes, &weights, degree, &mut columns);
    if variant.is_renormalised() {
        // Radiance draws again what falls below the horizon.
        let total = columns[0] * (4.0 * PI).sqrt();
        for value in &mut columns {
            *value /= total;
        }
    }
    columns
}

/// `Σ_i weights[m', i] P̄_lm'(cos θ_i)` for every l and m'.
fn project(nodes: &[Node], weights: &[f64], degree: usize, columns: &mut [f64]) {
    let count = nodes.len();
    let cosines: Vec<f64> = nodes.iter().map(|node| node.cosine).collect();
    let sines: Vec<f64> = nodes.iter().map(|node| node.sine).collect();
    // P̄_mm, carried from order to order.
    let mut sectoral = vec![(4.0 * PI).sqrt().recip(); count];
    let mut before = vec![0.0; count];
    let mut now = vec![0.0; count];
    let mut start = 0;
    for m in 0..=degree {
        if m > 0 {
            let factor = ((2 * m + 1) as f64 / (2 * m) as f64).sqrt();
            for (value, sine) in sectoral.iter_mut().zip(&sines) {
                *value *= factor * sine;
            }
        }
        now.copy_from_slice(&sectoral);
        before.fill(0.0);
        let weights = &weights[m * count..(m + 1) * count];
        let column = &mut columns[start..start + degree + 1 - m];
        start += column.len();
        for (l, value) in (m..).zip(column) {
            *value = dot(weights, &now);
            let a = legendre::step(l + 1, m);
            let b = if l > m {
                legendre::step(l, m).recip()
            } else {
                0.0
            };
            for ((now, before), x) in now.iter_mut().zip(&mut before).zip(&cosines) {
                let next = a * (x * *now - b * *before);
                *before = *now;
                *now = next;
            }
        }
    }
}

/// `Σ a_i b_i`, in four partial sums so that the compiler can keep them in lanes.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    for (a, b) in a4.iter().zip(b4) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// The composite rule over the part of `0 ≤ θ_i ≤ π/2` that the lobe reaches, from the horizon
/// down.
fn nodes(sigma: f64, view_angle: f64, degree: usize, panel: &Rule) -> Vec<Node> {
    let reach = 2.0 * (REACH * sigma).atan();
    let low = (view_angle - reach).max(0.0);
    let mut high = (view_angle + reach).min(FRAC_PI_2);
    let at_horizon = high == FRAC_PI_2;
    // A panel is no longer than the harmonics, the exponential and the singularity at
    // θ_i = π − θ_v allow for NODES nodes to reach rounding.
    let longest = (24.0 / (degree + 1) as f64).min(8.0 * sigma);
    let mut nodes = Vec::new();
    let mut horizon = at_horizon;
    while high > low {
        let longest = longest.min(2.0 * (PI - view_angle - high));
        let panels = ((high - low) / longest).ceil().max(1.0);
        let length = if panels < 2.0 { high - low } else { longest };
        for (x, w) in panel.nodes.iter().zip(&panel.weights) {
            let (offset, scale) = if horizon {
                // θ = π/2 − length·s²: the square root of cos θ_i of the 1992 lobe becomes smooth.
                let s = 0.5 * (1.0 + x);
                (length * s * s, length * s)
            } else {
                (0.5 * length * (1.0 + x), 0.5 * length)
            };
            let theta = high - offset;
            let (sine, cosine) = if horizon {
                (offset.cos(), offset.sin())
            } else {
                theta.sin_cos()
            };
            nodes.push(Node {
                cosine,
                sine,
                weight: w * scale * sine,
            });
        }
        horizon = false;
        high = if panels < 2.0 { low } else { high - length };
    }
    nodes
}

/// `e^(−κ) I_m(κ)`, and the differences `e^(−κ) (I_m(κ) − I_(m+1)(κ))`, for m = 0, 1, …
///
/// Always by the downward recurrence, which is stable, and the differences by one of their own, so
/// that they keep their relative accuracy where κ is large and neighbours are nearly equal. It
/// starts far beyond the last order (Miller), or at the last order from the asymptotic series
/// (DLMF 10.40.1) where κ is larger than its square.
fn scaled_bessel(kappa: f64, bessel: &mut [f64], difference: &mut [f64]) {
    let last = bessel.len() - 1;
    bessel.fill(0.0);
    difference.fill(0.0);
    if kappa < f64::MIN_POSITIVE / f64::EPSILON {
        bessel[0] = 1.0;
        difference[0] = 1.0;
        return;
    }
    let step = 2.0 / kappa;
    let top = ((last + 1) * (last + 1)) as f64;
    if kappa > top.max(400.0) {
        let (value, above) = (hankel(last, kappa), hankel(last + 1, kappa));
        let root = (2.0 * PI * kappa).sqrt().recip();
        bessel[last] = (1.0 + value) * root;
        difference[last] = (value - above) * root;
        for m in (1..=last).rev() {
            bessel[m - 1] = bessel[m] + difference_below(m, step, bessel[m], difference[m]);
            difference[m - 1] = difference_below(m, step, bessel[m], difference[m]);
        }
        return;
    }
    // e^(−κ) I_m falls as exp(−m²/2κ), and as (κ/2)^m/m! once m is past κ.
    let start = last + 20 + (9.0 * kappa.sqrt()).ceil() as usize;
    let (mut value, mut delta) = (1e-280, 1e-280);
    let mut total = 2.0 * value;
    for m in (1..=start).rev() {
        if m <= last {
            bessel[m] = value;
            difference[m] = delta;
        }
        delta = difference_below(m, step, value, delta);
        value += delta;
        total += if m == 1 { value } else { 2.0 * value };
        if value > 1e200 {
            let shrink = 1e-200;
            value *= shrink;
            delta *= shrink;
            total *= shrink;
            for v in bessel.iter_mut().chain(difference.iter_mut()) {
                *v *= shrink;
            }
        }
    }
    bessel[0] = value;
    difference[0] = delta;
    // e^κ = I_0 + 2 Σ I_m.
    for v in bessel.iter_mut().chain(difference.iter_mut()) {
        *v /= total;
    }
}

/// `I_(m−1) − I_m` from `I_m` and `I_m − I_(m+1)`, by `I_(m−1) − I_(m+1) = (2m/κ) I_m`.
fn difference_below(m: usize, step: f64, value: f64, difference: f64) -> f64 {
    m as f64 * step * value - difference
}

/// `√(2πκ) e^(−κ) I_m(κ) − 1` by Hankel's series.
fn hankel(m: usize, kappa: f64) -> f64 {
    let mu = 4.0 * (m * m) as f64;
    let mut term = 1.0;
    let mut sum = 0.0;
    for k in 1..60 {
        let odd = (2 * k - 1) as f64;
        term *= -(mu - odd * odd) / (8.0 * k as f64 * kappa);
        sum += term;
        if term.abs() < 1e-18 {
            break;
        }
    }
    sum
}
