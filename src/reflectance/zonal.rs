//! The lobe in frequency: exact zonal coefficients.

use fearless_simd::{Level, dispatch, f64x8, prelude::*};

use super::gauss::RULE;
use super::slope::{self, Gaussian};
use super::ward::{HORIZON, Ward};
use crate::{Error, Result};

/// The largest degree of [`Ward::zonal`].
pub const MAX_ZONAL_DEGREE: usize = 1024;

impl Ward {
    /// The zonal coefficients `b_0 … b_lmax` at `ρ_s` = 1, `b_l = ∫ f c_i P_l(i·r) dω`, about the mirror direction r of a
    /// view at this cosine from the normal.
    ///
    /// At normal incidence r is the normal, and the lobe acts on light as `B_lm = b_l L_lm`; `b_0` is the albedo. At
    /// other angles the lobe is not round about r and `b_l` is its round part. The view lies in the plane of the normal
    /// and the tangent +x, which matters to an anisotropic lobe only.
    ///
    /// Quadrature over the exact support, in half-vector slopes; the bound is 10⁻¹² of `b_0` for σ from 0.005 to 0.5.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`MAX_ZONAL_DEGREE`]; [`Error::Domain`] if the cosine is not in (0, 1].
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
            self.visit_rings(max_degree, |versine, weight| sums.push(versine, weight));
        } else {
            let sine = ((1.0 - view_cosine) * (1.0 + view_cosine)).sqrt();
            let gaussian = Gaussian::new(self.sigma(), 1.0, 0.0);
            let renormalisation = self.renormalisation(view_cosine);
            slope::visit((sine, view_cosine), &gaussian, max_degree as f64, |node| {
                let weight = node.weight * self.node_weight(view_cosine, &node);
                sums.push(
                    node.versine_from_mirror(sine, view_cosine),
                    weight * renormalisation,
                );
            });
        }
        Ok(sums.finish())
    }

    /// At normal incidence the support is t < 1 and only t matters: rings of a disk.
    fn visit_rings(&self, max_degree: usize, mut at: impl FnMut(f64, f64)) {
        let sigma = self.sigma()[0];
        let end = (slope::REACH * sigma).min(1.0);
        let longest = (slope::PANEL_IN_SIGMA * sigma)
            .min(0.6)
            .min(6.0 / max_degree.max(1) as f64);
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
                    weight: weight * length * jacobian * 2.0 * tan / (sigma * sigma)
                        * (-tan2 / (sigma * sigma)).exp(),
                    cosine_ratio: ratio,
                };
                at(
                    2.0 * tan2 / (1.0 + tan2),
                    node.weight * self.node_weight(1.0, &node) * renormalisation,
                );
            }
        }
    }
}

/// How many nodes are summed at once.
const LANES: usize = 8;

/// Σ weight · `P_l(1 − versine)` for every l up to a degree, eight nodes at a time.
struct LegendreSums {
    level: Level,
    versines: [f64; LANES],
    weights: [f64; LANES],
    filled: usize,
    /// For each degree, the sums of the eight lanes.
    sums: Vec<[f64; LANES]>,
    /// l/(l + 1) and (2l + 1)/(l + 1).
    steps: Vec<(f64, f64)>,
}

impl LegendreSums {
    fn new(max_degree: usize) -> Self {
        Self {
            level: Level::new(),
            versines: [0.0; LANES],
            weights: [0.0; LANES],
            filled: 0,
            sums: vec![[0.0; LANES]; max_degree + 1],
            steps: (0..max_degree)
                .map(|l| {
                    let l = l as f64;
                    (l / (l + 1.0), (2.0 * l + 1.0) / (l + 1.0))
                })
                .collect(),
        }
    }

    fn push(&mut self, versine: f64, weight: f64) {
        self.versines[self.filled] = versine;
        self.weights[self.filled] = weight;
        self.filled += 1;
        if self.filled == LANES {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let level = self.level;
        dispatch!(level, simd => flush(simd, &self.versines, &self.weights, &self.steps, &mut self.sums));
        self.filled = 0;
    }

    fn finish(mut self) -> Vec<f64> {
        self.weights[self.filled..].fill(0.0);
        self.flush();
        self.sums.iter().map(|lanes| lanes.iter().sum()).collect()
    }
}

/// Adds eight nodes, by the recurrence of the differences `P_{l+1} − P_l`, which keeps the digits near the mirror direction, where the
/// versine is small (Reinsch's form).
#[inline(always)]
fn flush<S: Simd>(
    simd: S,
    versines: &[f64; LANES],
    weights: &[f64; LANES],
    steps: &[(f64, f64)],
    sums: &mut [[f64; LANES]],
) {
    let versine = f64x8::from_slice(simd, versines);
    // The recurrence is linear, so the weight is carried in it.
    let mut value = f64x8::from_slice(simd, weights);
    let mut difference = f64x8::splat(simd, 0.0);
    let Some((first, rest)) = sums.split_first_mut() else {
        return;
    };
    (f64x8::from_slice(simd, first) + value).store_slice(first);
    for (&(damping, step), sum) in steps.iter().zip(rest) {
        difference = difference * damping - versine * step * value;
        value += difference;
        (f64x8::from_slice(simd, sum) + value).store_slice(sum);
    }
}
