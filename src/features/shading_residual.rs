//! What is left of a picture when all that a matte sphere can show is taken out.

use nalgebra::{Cholesky, DMatrix};

use super::log_bands::{EDGES, ORDERS, energies_of_order};
use super::percentiles::percentiles;
use super::rings::{Modes, RingLayout, Unwrapped, add_waves};
use crate::features::cosine_basis;
use crate::harmonics::legendre;
use crate::illumination::Luminance;
use crate::reflectance::lambert;
use crate::{Error, Result};

/// The degrees of shading: a matte surface keeps no odd one above the first, and of degree 14 a
/// five-hundredth of what it keeps of degree 0.
const DEGREES: [usize; 8] = [0, 1, 2, 4, 6, 8, 10, 12];

/// The last of them.
const LAST: usize = DEGREES[DEGREES.len() - 1];

/// What an amplitude may be off shading for no reason, over the mean: interpolation between pixels,
/// degrees above the last.
const NOISE: f64 = 1e-3;

/// The first radial frequency of each band, and the end of the last.
const RADIAL: [usize; 4] = [0, 4, 12, ORDERS + 1];

/// What is added to a band's mean square before its logarithm is taken.
const FAINTEST: f64 = 1e-8;

/// Percentiles of the residual over the shading.
const LEVELS: [f64; 8] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.998];

/// The least shading that a residual is taken over, as a share of the mean.
const DARKEST: f64 = 0.05;

/// The relative residual from which on its logarithm counts, not itself.
const SMALL: f64 = 1e-3;

/// The plan of the features of what no matte sphere can show.
///
/// Under any light a Lambertian sphere shows Σ A_l L_lm Y_lm(n), A_l = 0 for odd l above 1 and
/// falling as l^(−5/2) (Basri and Jacobs 2003, doi:10.1109/TPAMI.2003.1177153). So of luminance y
/// over its mean, unwrapped onto rings at the normals' angles θ and split into orders m, the part
///
/// s_m = S_m (S_mᵀ S_m + ν² 1)⁻¹ S_mᵀ y_m,  (S_m)_rl = A_l P̄_lm(cos θ_r)/max(l, 1),  l ∈ {0, 1, 2,
/// 4, 6, 8, 10, 12},  ν = 10⁻³,
///
/// is the shading that is likeliest if light has a power of l⁻² an order, and r = y − s is what the
/// sphere mirrors: of a matte one nothing, however strong the contrast of the light; of a glossy
/// plastic its gloss without its body; of a metal all but what is smooth.
///
/// Features: ln (E + 10⁻⁸), E the mean square of r in bands of ten orders m and three radial
/// frequencies k, as in [`LogBands`](super::LogBands); the skewness of r and ln of its kurtosis;
/// and eight percentiles p of r/max(s, 0.05), as arsinh(1000 p).
///
/// Exposure changes none of them. What is saturated or noise is taken for gloss.
///
/// ```
/// use lobes::features::{ShadingResidual, RingLayout, Unwrapped};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let layout = RingLayout::new(Viewpoint::Orthographic, 64, 32)?;
/// let features = ShadingResidual::new(&layout)?.of(&Unwrapped::new(&image, &layout)?)?;
/// assert_eq!(features.len(), ShadingResidual::FEATURES);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct ShadingResidual {
    layout: RingLayout,
    /// S_m, and what makes its weights from amplitudes.
    shadings: Vec<[DMatrix<f64>; 2]>,
    basis: DMatrix<f64>,
}

impl ShadingResidual {
    /// How many features there are.
    pub const FEATURES: usize = (EDGES.len() - 1) * (RADIAL.len() - 1) + 2 + LEVELS.len();

    /// The plan for pictures that are unwrapped by a layout of the same viewpoint.
    ///
    /// # Errors
    /// [`Error::TooFew`] for a layout of fewer than 33 rings or 32 orders.
    pub fn new(layout: &RingLayout) -> Result<Self> {
        layout.check("what is left of shading", ORDERS + 1, ORDERS)?;
        let rings = layout.angles().len();
        let shadings = (0..=LAST)
            .map(|m| {
                let degrees: Vec<usize> = DEGREES.into_iter().filter(|&l| l >= m).collect();
                let mut shading = DMatrix::zeros(rings, degrees.len());
                let mut column = vec![0.0; LAST + 1 - m];
                for (ring, angle) in layout.angles().iter().enumerate() {
                    let (sin, cos) = angle.sin_cos();
                    legendre::column(m, LAST, cos, sin, &mut column)?;
                    for (value, &l) in shading.row_mut(ring).iter_mut().zip(&degrees) {
                        *value = lambert::transfer(l) / l.max(1) as f64 * column[l - m];
                    }
                }
                let mut gram = shading.tr_mul(&shading);
                for i in 0..degrees.len() {
                    gram[(i, i)] += NOISE * NOISE;
                }
                let gram = Cholesky::new(gram).ok_or_else(|| Error::NotPositiveDefinite {
                    what: "the Gram matrix of a sphere's shadings".into(),
                })?;
                let weights = gram.solve(&shading.transpose());
                Ok([shading, weights])
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Self {
            layout: layout.clone(),
            shadings,
            basis: cosine_basis(rings, ORDERS + 1),
        })
    }

    /// The features.
    ///
    /// # Errors
    /// [`Error::Black`] for a black picture; [`Error::Length`] for one that was unwrapped for
    /// another layout.
    pub fn of(&self, picture: &Unwrapped) -> Result<Vec<f64>> {
        let mean = Luminance::Rec709.of(picture.mean());
        if mean.is_nan() || mean <= 0.0 {
            return Err(Error::Black {
                what: "the picture of the sphere",
            });
        }
        let luminance = |rgb: [f64; 3]| Luminance::Rec709.of(rgb) / mean;
        let [modes] = Modes::of(picture, &self.layout, |rgb| [luminance(rgb)])?;
        let (rings, columns) = (picture.rings(), picture.columns());
        let mut shading = vec![0.0; rings * columns];
        let mut energy = Vec::with_capacity(ORDERS + 1);
        for m in 0..=ORDERS {
            let parts = if m == 0 { 1 } else { 2 };
            let both = modes.cosine(m).iter().chain(modes.sine(m)).copied();
            let mut amplitudes = DMatrix::from_iterator(rings, parts, both);
            if let Some([shadings, weights]) = self.shadings.get(m) {
                let fit = shadings * (weights * &amplitudes);
                let sine = if m == 0 { None } else { Some(fit.column(1)) };
                add_waves(&mut shading, columns, m, |ring| {
                    [fit[(ring, 0)], sine.as_ref().map_or(0.0, |sine| sine[ring])]
                });
                amplitudes -= fit;
            }
            energy.push(energies_of_order(&self.basis, m, amplitudes.as_slice()));
        }
        let mut features = Vec::with_capacity(Self::FEATURES);
        for orders in EDGES.windows(2) {
            for radial in RADIAL.windows(2) {
                let sum: f64 = energy[orders[0]..orders[1]]
                    .iter()
                    .flat_map(|row| &row[radial[0]..radial[1]])
                    .sum();
                features.push((sum + FAINTEST).ln());
            }
        }
        let mut sums = [0.0; 3];
        let mut relative = shading;
        for (value, rgb) in relative.iter_mut().zip(picture.values()) {
            let residual = luminance(*rgb) - *value;
            let square = residual * residual;
            for (sum, term) in sums
                .iter_mut()
                .zip([square, square * residual, square * square])
            {
                *sum += term;
            }
            *value = residual / value.max(DARKEST);
        }
        let [second, third, fourth] = sums.map(|sum| sum / relative.len() as f64);
        let tame = second + 0.1 * FAINTEST;
        features.push(third / tame.powf(1.5));
        features.push((fourth / (tame * tame) + 0.1).ln());
        features.extend(percentiles(&mut relative, LEVELS).map(|p| (p / SMALL).asinh()));
        Ok(features)
    }
}
