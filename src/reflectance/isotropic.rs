//! The coefficients of an isotropic BRDF in light and view at once.

use glam::DVec3;

use super::slope::{self, Gaussian};
use super::ward::Ward;
use crate::harmonics::{self, Basis, Coefficients};
use crate::sphere::Rule;
use crate::{Error, Parallelism, Result};

/// The largest degree of [`IsotropicCoefficients`].
pub const MAX_ISOTROPIC_DEGREE: usize = 32;

/// `ρ̂_lpq` of Ramamoorthi and Hanrahan 2001 ([doi:10.1145/383259.383271](https://doi.org/10.1145/383259.383271)), §4:
/// `f c_i = Σ ρ̂_lpq Y_lq(light) Y_pq(view)`, light and view in the surface's frame.
///
/// For an isotropic BRDF that is the same seen in a mirror the two real harmonics have the same order q, and −q the same
/// coefficient as q. Reflection is then, degree by degree, `B_pq = Σ_l ρ̂_lpq L_lq`, for light L in the surface's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct IsotropicCoefficients {
    light_degree: usize,
    view_degree: usize,
    /// By q, then l, then p.
    values: Vec<f64>,
}

impl IsotropicCoefficients {
    /// The coefficients of an isotropic lobe at `ρ_s` = 1, light to `light_degree` and view to `view_degree`.
    ///
    /// The light is integrated over the exact support and the view by Gauss–Legendre quadrature over the hemisphere, with nodes
    /// denser at grazing. As a function of the view a lobe ends abruptly at the horizon, so the sum over p converges slowly there;
    /// the sum over l is what light of limited degree needs.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`MAX_ISOTROPIC_DEGREE`]; [`Error::Unanswerable`] for an anisotropic lobe.
    pub fn new(lobe: &Ward, light_degree: usize, view_degree: usize) -> Result<Self> {
        for degree in [light_degree, view_degree] {
            if degree > MAX_ISOTROPIC_DEGREE {
                return Err(Error::Degree {
                    what: "the isotropic coefficients of a lobe",
                    degree,
                    limit: MAX_ISOTROPIC_DEGREE,
                });
            }
        }
        let mut result = Self {
            light_degree,
            view_degree,
            values: vec![
                0.0;
                (light_degree.min(view_degree) + 1)
                    * (light_degree + 1)
                    * (view_degree + 1)
            ],
        };
        if !lobe.is_isotropic() {
            return Err(Error::Unanswerable(
                "an anisotropic lobe has no isotropic coefficients".to_owned(),
            ));
        }
        let basis = Basis::new(light_degree)?;
        let (light_shape, view_shape) = (
            Coefficients::zeros(light_degree),
            Coefficients::zeros(view_degree),
        );
        let light_index = |l, q: usize| light_shape.index(l, q as isize).unwrap_or(0);
        let view_index = |p, q: usize| view_shape.index(p, q as isize).unwrap_or(0);
        let rule = Rule::gauss_legendre(48)?;
        let mut in_view = vec![0.0; (view_degree + 1) * (view_degree + 1)];
        for (&node, &weight) in rule.nodes.iter().zip(&rule.weights) {
            // cos θ = ((1 + x)/2)².
            let root = 0.5 * (1.0 + node);
            let (cosine, weight) = (root * root, weight * root);
            let projected = project(lobe, cosine, &basis, light_degree)?;
            let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
            harmonics::evaluate_all(DVec3::new(sine, 0.0, cosine), view_degree, &mut in_view)?;
            // Over the view's azimuth cos qφ cos qφ' leaves 2π, or π twice; at φ = 0 both come to 2π of the cosine's.
            for q in 0..=light_degree.min(view_degree) {
                let turn = std::f64::consts::TAU * if q == 0 { 1.0 } else { 0.5 };
                for l in q..=light_degree {
                    let from_light = projected[light_index(l, q)];
                    for p in q..=view_degree {
                        let index = result.index(l, p, q);
                        result.values[index] +=
                            turn * weight * from_light * in_view[view_index(p, q)];
                    }
                }
            }
        }
        Ok(result)
    }

    /// `ρ̂_lpq`; 0 outside the degrees or where |q| exceeds l or p.
    pub fn get(&self, l: usize, p: usize, q: isize) -> f64 {
        let q = q.unsigned_abs();
        if l > self.light_degree || p > self.view_degree || q > l.min(p) {
            return 0.0;
        }
        self.values[self.index(l, p, q)]
    }

    fn index(&self, l: usize, p: usize, q: usize) -> usize {
        (q * (self.light_degree + 1) + l) * (self.view_degree + 1) + p
    }
}

/// `∫ f c_i Y_lm(light) dω` for a view at azimuth 0, in the order of [`Coefficients`].
fn project(lobe: &Ward, cosine: f64, basis: &Basis, degree: usize) -> Result<Vec<f64>> {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
    let gaussian = Gaussian::new(lobe.sigma(), 1.0, 0.0);
    let renormalisation = lobe.renormalisation(cosine);
    let (mut lights, mut weights) = (Vec::new(), Vec::new());
    slope::visit((sine, cosine), &gaussian, degree as f64, |node| {
        // The sine orders cancel between the two halves that the node stands for.
        let twice = 2.0 * (sine * node.x + cosine) / (1.0 + node.x * node.x + node.y * node.y);
        let light = DVec3::new(twice * node.x - sine, twice * node.y, twice - cosine);
        lights.push(light.normalize());
        weights.push(node.weight * lobe.node_weight(cosine, &node) * renormalisation);
    });
    let count = (degree + 1) * (degree + 1);
    let mut values = vec![0.0; count * lights.len()];
    basis.values(&lights, &mut values, Parallelism::Sequential)?;
    let mut sums = vec![0.0; count];
    for (row, weight) in values.chunks_exact(count).zip(&weights) {
        for (sum, value) in sums.iter_mut().zip(row) {
            *sum += weight * value;
        }
    }
    Ok(sums)
}
