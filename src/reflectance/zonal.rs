//! The lobe in frequency: exact zonal coefficients.

use fearless_simd::{Level, dispatch, f64x8, prelude::*};

use super::direction::HORIZON;
use super::hemisphere;
use super::slope::{self, Gaussian};
use super::ward::Ward;
use crate::numeric::exponential::exp_of_negative;
use crate::numeric::sixteen_points::RULE;
use crate::{Error, Result, vectors};

/// The largest degree of [`Ward::zonal`].
pub const MAX_ZONAL_DEGREE: usize = 1024;

/// From this σ on rows of elevation are cheaper than the plane of slopes.
const WIDE: f64 = 0.08;

impl Ward {
    /// The zonal coefficients `b_0 … b_lmax` at `ρ_s` = 1, `b_l = ∫ f c_i P_l(i·r) dω`, about the
    /// mirror direction r of a view at this cosine from the normal.
    ///
    /// At normal incidence r is the normal, and the lobe acts on light as `B_lm = b_l L_lm`; `b_0`
    /// is the albedo. At other angles the lobe is not round about r and `b_l` is its round part.
    /// The view lies in the plane of the normal and the tangent +x, which matters to an anisotropic
    /// lobe only.
    ///
    /// Quadrature over the exact support, in half-vector slopes; the bound is 10⁻¹² of `b_0` for σ
    /// from 0.005 to 0.5.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`MAX_ZONAL_DEGREE`]; [`Error::Domain`] if the cosine is not in (0,
    /// 1].
    ///
    /// ```
    /// use lobes::reflectance::{Variant, Ward};
    /// let lobe = Ward::isotropic(Variant::Duer, 0.1)?;
    /// let b = lobe.zonal(1.0, 10)?;
    /// assert!((b[0] - lobe.albedo(1.0)).abs() < 1e-13);
    /// assert!((b[10] - (-1.1f64).exp()).abs() < 0.01);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn zonal(&self, view_cosine: f64, max_degree: usize) -> Result<Vec<f64>> {
        if max_degree > MAX_ZONAL_DEGREE {
            return Err(Error::Degree {
                what: "the zonal coefficients of a lobe",
                degree: max_degree,
                limit: MAX_ZONAL_DEGREE,
            });
        }
        if !(view_cosine > HORIZON && view_cosine <= 1.0) {
            return Err(Error::Domain {
                what: "the cosine of a view",
                value: view_cosine,
                allowed: "in (0, 1]",
            });
        }
        let mut sums = LegendreSums::new(max_degree);
        if view_cosine == 1.0 && self.is_isotropic() {
            self.visit_rings(&mut sums);
        } else {
            let sine = ((1.0 - view_cosine) * (1.0 + view_cosine)).sqrt();
            if self.is_isotropic() && self.sigma()[0] >= WIDE {
                self.visit_elevations((sine, view_cosine), &mut sums);
            } else {
                self.visit_slopes((sine, view_cosine), &mut sums);
            }
        }
        Ok(sums.finish())
    }

    /// Any view, by rows of the light's elevation: round lobes only.
    fn visit_elevations(&self, (sine, cosine): (f64, f64), sums: &mut LegendreSums) {
        let renormalisation = self.renormalisation(cosine);
        hemisphere::rows((sine, cosine), self.sigma()[0], sums.degree(), |row| {
            let factor = self.row_factor(cosine, row.cosine);
            let scale = renormalisation * row.solid_angle;
            row.visit(|light| {
                sums.push(
                    light.versine,
                    factor.exponent(light.tan2),
                    scale * factor.smooth(light.tan2),
                );
            });
        });
    }

    /// Any view, in the plane of slopes.
    fn visit_slopes(&self, (sine, cosine): (f64, f64), sums: &mut LegendreSums) {
        let gaussian = Gaussian::new(self.sigma(), 1.0, 0.0);
        let renormalisation = self.renormalisation(cosine);
        slope::visit((sine, cosine), &gaussian, sums.degree(), |node| {
            let weight = node.weight * self.node_weight(cosine, &node);
            sums.push(
                node.versine_from_mirror(sine, cosine),
                0.0,
                weight * renormalisation,
            );
        });
    }

    /// At normal incidence the support is t < 1 and only t matters: rings of a disk.
    fn visit_rings(&self, sums: &mut LegendreSums) {
        let sigma = self.sigma()[0];
        let end = (slope::REACH * sigma).min(1.0);
        let longest = (slope::PANEL_IN_SIGMA * sigma)
            .min(0.6)
            .min(6.0 / sums.degree().max(1.0));
        // t = sin χ undoes the branch of √c_i at t = 1.
        let end = end.asin();
        let panels = (end / longest).ceil().max(1.0);
        let length = end / panels;
        let renormalisation = self.renormalisation(1.0);
        for panel in 0..panels as usize {
            for &(node, weight) in RULE.iter() {
                let (tan, jacobian) = (length * (panel as f64 + node)).sin_cos();
                let tan2 = tan * tan;
                let ratio = jacobian * jacobian / (1.0 + tan2);
                let node = slope::Node {
                    x: tan,
                    y: 0.0,
                    weight: weight * length * jacobian * 2.0 * tan / (sigma * sigma),
                    cosine_ratio: ratio,
                };
                sums.push(
                    2.0 * tan2 / (1.0 + tan2),
                    tan2 / (sigma * sigma),
                    node.weight * self.node_weight(1.0, &node) * renormalisation,
                );
            }
        }
    }
}

/// Nodes of one vector, …
const LANES: usize = 8;
/// … and vectors at once: their recurrences do not wait for one another.
const VECTORS: usize = 4;
/// How many nodes are summed at once.
const BLOCK: usize = LANES * VECTORS;

/// Σ factor · e^(−exponent) · `P_l(1 − versine)` for every l up to a degree, a block of nodes at a
/// time.
pub(super) struct LegendreSums {
    level: Level,
    versines: [f64; BLOCK],
    exponents: [f64; BLOCK],
    factors: [f64; BLOCK],
    filled: usize,
    /// For each degree, the sums of the eight lanes.
    sums: Vec<[f64; LANES]>,
    /// 2l + 1 and 1/(l + 1).
    steps: Vec<(f64, f64)>,
}

impl LegendreSums {
    pub(super) fn new(max_degree: usize) -> Self {
        Self {
            level: vectors::level(),
            versines: [0.0; BLOCK],
            exponents: [0.0; BLOCK],
            factors: [0.0; BLOCK],
            filled: 0,
            sums: vec![[0.0; LANES]; max_degree + 1],
            steps: (0..max_degree)
                .map(|l| {
                    let l = l as f64;
                    (2.0 * l + 1.0, 1.0 / (l + 1.0))
                })
                .collect(),
        }
    }

    pub(super) fn degree(&self) -> f64 {
        self.steps.len() as f64
    }

    #[inline]
    pub(super) fn push(&mut self, versine: f64, exponent: f64, factor: f64) {
        self.versines[self.filled] = versine;
        self.exponents[self.filled] = exponent;
        self.factors[self.filled] = factor;
        self.filled += 1;
        if self.filled == BLOCK {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let level = self.level;
        dispatch!(level, simd => flush(simd, &self.versines, &self.exponents, &self.factors, &self.steps, &mut self.sums));
        self.filled = 0;
    }

    pub(super) fn finish(mut self) -> Vec<f64> {
        self.factors[self.filled..].fill(0.0);
        self.flush();
        self.sums.iter().map(|lanes| lanes.iter().sum()).collect()
    }
}

/// Adds a block, by the recurrence of the differences `P_{l+1} − P_l`, which keeps the digits near
/// the mirror direction, where the versine is small (Reinsch's form): with `e_l = l (P_l −
/// P_{l−1})`, `e_{l+1} = e_l − (2l + 1) versine P_l` and `P_{l+1} = P_l + e_{l+1}/(l + 1)`.
#[inline(always)]
fn flush<S: Simd>(
    simd: S,
    versines: &[f64; BLOCK],
    exponents: &[f64; BLOCK],
    factors: &[f64; BLOCK],
    steps: &[(f64, f64)],
    sums: &mut [[f64; LANES]],
) {
    let load = |from: &[f64; BLOCK], vector: usize| {
        f64x8::from_slice(simd, &from[LANES * vector..LANES * (vector + 1)])
    };
    let falls: [f64x8<S>; VECTORS] = std::array::from_fn(|k| load(versines, k) * -1.0);
    // The recurrence is linear, so the weight is carried in it.
    let mut values: [f64x8<S>; VECTORS] =
        std::array::from_fn(|k| load(factors, k) * exp_of_negative(simd, load(exponents, k)));
    let mut slopes = [f64x8::splat(simd, 0.0); VECTORS];
    let Some((first, rest)) = sums.split_first_mut() else {
        return;
    };
    let total = |values: &[f64x8<S>; VECTORS]| (values[0] + values[1]) + (values[2] + values[3]);
    (f64x8::from_slice(simd, first) + total(&values)).store_slice(first);
    for (&(twice, inverse), sum) in steps.iter().zip(rest) {
        let inverse = f64x8::splat(simd, inverse);
        for k in 0..VECTORS {
            slopes[k] = (falls[k] * twice).mul_add(values[k], slopes[k]);
            values[k] = slopes[k].mul_add(inverse, values[k]);
        }
        (f64x8::from_slice(simd, sum) + total(&values)).store_slice(sum);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::super::Variant;
    use super::*;

    /// The two planes of integration, which share no node, and the recurrence in its plain form.
    #[test]
    fn rows_of_elevation_and_the_plane_of_slopes_agree() {
        let compare = |variant: Variant, sigma: f64, cosine: f64| {
            let lobe = Ward::isotropic(variant, sigma).unwrap();
            let view = (((1.0 - cosine) * (1.0 + cosine)).sqrt(), cosine);
            let degree = if sigma < 0.05 { 256 } else { 48 };
            let [mut a, mut b] = [(); 2].map(|()| LegendreSums::new(degree));
            lobe.visit_elevations(view, &mut a);
            lobe.visit_slopes(view, &mut b);
            let (a, b) = (a.finish(), b.finish());
            for (l, (x, y)) in a.iter().zip(&b).enumerate() {
                assert!(
                    (x - y).abs() < 3e-13 * b[0],
                    "{variant} σ {sigma} c {cosine} l {l}: {x} {y}, off by {:e}",
                    (x - y) / b[0]
                );
            }
        };
        for variant in Variant::ALL {
            for sigma in [0.005, 0.079, 0.3, 1.0] {
                for cosine in [0.999, 0.5, 0.02, 1e-4] {
                    compare(variant, sigma, cosine);
                }
            }
        }
        // And where no table has them: the regimes of both rules change with σ and the view.
        let mut rng = Pcg64::seed_from_u64(5);
        for k in 0..300 {
            let sigma = 0.005 * 200f64.powf(rng.random());
            let cosine = 10f64.powf(-2.0 * rng.random::<f64>());
            compare(Variant::ALL[k % 4], sigma, cosine);
        }
        // Where the horizon begins to cut the lobe.
        for k in 0..60 {
            let sigma = 0.01 + 0.002 * f64::from(k);
            let half = (slope::REACH * sigma * (1.0 + 0.002 * f64::from(k % 7))).atan();
            compare(Variant::RadianceSampled, sigma, (2.0 * half).sin());
        }
    }

    #[test]
    fn blocks_are_the_plain_recurrence() {
        let nodes: Vec<[f64; 3]> = (0..77)
            .map(|k| {
                let k = f64::from(k);
                [2.0 * (k / 76.0).powi(3), 0.1 * k, 1.0 + 0.01 * k]
            })
            .collect();
        let mut sums = LegendreSums::new(64);
        let mut plain = vec![0.0; 65];
        for &[versine, exponent, factor] in &nodes {
            sums.push(versine, exponent, factor);
            let weight = factor * (-exponent).exp();
            let (mut value, mut difference) = (weight, 0.0);
            for (l, sum) in plain.iter_mut().enumerate() {
                *sum += value;
                let l = l as f64;
                difference = (l * difference - (2.0 * l + 1.0) * versine * value) / (l + 1.0);
                value += difference;
            }
        }
        for (got, want) in sums.finish().iter().zip(&plain) {
            assert!((got - want).abs() < 1e-13, "{got} {want}");
        }
    }
}
