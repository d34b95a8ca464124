//! The light about a ball of known reflectance, read off one picture of it.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix};

use super::bright_lights::BrightLights;
use super::light_grid::{LightField, LightGrid};
use crate::error::check_length;
use crate::features::{Modes, RingLayout};
use crate::harmonics::{Coefficients, legendre};
use crate::reflectance::Variant;
use crate::reflection::{Operator, check_spectrum};
use crate::{Error, Parallelism, Result};

/// Reads the light about a ball whose reflectance is known.
///
/// Light is taken as [`GaussianEvidence`](super::GaussianEvidence) takes it: a Gaussian field of
/// unknown strength k, L_lm ~ N(0, k C_l), and small bright lights in the directions ω_j that the
/// picture shows ([`BrightLights`]), a_j ~ N(0, k τ²), τ² = 100. Of order m the rings of the
/// picture have the amplitudes y_m = T_m L_m + U_m a + e_m, T_m the [`Operator`] of the view, and e_m
/// is independent from ring to ring: noise of a share ν² of the amplitudes' variance, and what the
/// degrees past the operator's add. With K_m = T_m C T_mᵀ + N_m = Λ Λᵀ, w = Λ⁻¹ y, W = Λ⁻¹ U and
/// A = τ⁻² 1 + Wᵀ W the posterior given k is Gaussian,
///
/// â = A⁻¹ Wᵀ w,    L̂ = C Tᵀ Λ⁻ᵀ (w − W â) + Σ_j â_j Y(ω_j),
/// Cov = k (C − G Gᵀ + B A⁻¹ Bᵀ),    G = C Tᵀ Λ⁻ᵀ,    B_j = Y(ω_j) − G Λ⁻¹ T Y(ω_j),
///
/// and k is taken as Q/n, Q = |w|² − âᵀ Wᵀ w over n amplitudes. Where the picture shows nothing,
/// behind the ball, L̂ returns to 0 and the deviation to that of the field. The limit of a mirror is
/// the unwrapped ball.
///
/// The frame is the view's: its pole towards the camera, azimuth 0 to the right of the picture and
/// growing towards its top.
///
/// **Accuracy**: the formulas to 1e-8 of one dense Gaussian (`tests/library/light.rs`). Under the built-in maps, of pictures
/// of 128 pixels a side, the irradiance at the normals that the camera sees is within 1 % (relative root mean square); of a
/// mirror under a map with a small sun, which its pixels hardly catch, within 6 % (`docs/reference/light-table.md`).
///
/// ```
/// use lobes::Parallelism;
/// use lobes::features::Modes;
/// use lobes::inference::{BrightLights, ChannelReflectance, LightReader, natural_spectrum};
/// use lobes::reflectance::Variant;
/// use lobes::reflection::Viewpoint;
///
/// // A mirror that shows 2 everywhere is in light of radiance 2.
/// let layout = LightReader::default_layout(Viewpoint::Orthographic)?;
/// let mirror = ChannelReflectance { diffuse: 0.0, specular: 1.0, sigma: 0.0 };
/// let spectrum = natural_spectrum(0.5, 64);
/// let one = Parallelism::Sequential;
/// let reader = LightReader::new(Variant::default(), mirror, &layout, &spectrum, LightReader::NOISE, one)?;
/// let mut amplitudes = vec![0.0; layout.len()];
/// amplitudes[..layout.angles().len()].fill(2.0);
/// let estimate = reader.read(&Modes::from_values(&layout, amplitudes)?, &BrightLights::default())?;
/// let (ahead, _) = reader.radiance(&estimate, 0.3, &[0.0])?[0];
/// assert!((ahead - 2.0).abs() < 0.01);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LightReader {
    layout: RingLayout,
    spectrum: Vec<f64>,
    orders: Vec<Order>,
    /// ½ Σ ln det K_m over the cosines and sines.
    half_log_determinant: f64,
}

/// What is ready of one order.
#[derive(Debug, Clone)]
struct Order {
    /// T, a row a ring, a column a degree.
    operator: DMatrix<f64>,
    /// Λ⁻¹.
    whitening: DMatrix<f64>,
    /// G, a row a degree, a column a ring.
    gain: DMatrix<f64>,
}

/// A ball's reflectance, as far as one channel sees it.
///
/// ```
/// use lobes::inference::ChannelReflectance;
/// use lobes::reflectance::{Material, presets};
/// /// What the red channel sees of a material.
/// fn red(material: &Material) -> ChannelReflectance {
///     ChannelReflectance {
///         diffuse: material.diffuse()[0],
///         specular: material.specular()[0],
///         sigma: material.roughness().sigma(),
///     }
/// }
/// let mirror = presets().into_iter().find(|material| material.name() == "silver").unwrap();
/// assert_eq!(red(&mirror).sigma, 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelReflectance {
    /// The diffuse albedo.
    pub diffuse: f64,
    /// The specular albedo.
    pub specular: f64,
    /// σ of the lobe, 0 for a mirror.
    pub sigma: f64,
}

/// The light that one channel of a picture shows.
///
/// ```
/// use lobes::inference::LightEstimate;
/// /// The mean radiance of the light from all sides: L_00 Y_00.
/// fn mean_radiance(estimate: &LightEstimate) -> f64 {
///     estimate.mean.get(0, 0) / (4.0 * std::f64::consts::PI).sqrt()
/// }
/// ```
#[derive(Debug, Clone)]
pub struct LightEstimate {
    /// The posterior mean of the coefficients, the bright lights among them.
    pub mean: Coefficients,
    /// Polar angle, azimuth and flux (radiance times solid angle) of each bright light.
    pub lights: Vec<(f64, f64, f64)>,
    /// k.
    pub strength: f64,
    /// ln p(y) of this reflectance, the strength and the light integrated out, as
    /// [`GaussianEvidence`](super::GaussianEvidence) has it: what pictures of one layout and
    /// spectrum say of one reflectance against another. 0 of a picture that is black.
    pub log_evidence: f64,
    /// A⁻¹.
    between_lights: DMatrix<f64>,
    /// By order, B at azimuth 0: a row a degree, a column a light.
    unexplained: Vec<DMatrix<f64>>,
}

/// τ²: lights that may be far brighter than the field.
const LIGHT_VARIANCE: f64 = 100.0;

/// Degrees past the operator's are taken into account to this many times its degree.
const TAIL: usize = 4;

/// What readers of one lobe have in common, whatever there is of it and of the body under it.
#[derive(Debug, Clone)]
pub(super) struct SeenLobe {
    operator: Arc<Operator>,
    /// What light past the spectrum's degree adds at ρ_s = 1, by order and ring.
    tails: Vec<Vec<f64>>,
}

impl SeenLobe {
    /// Of a lobe of width σ, whose operator is at the layout's rings and to the spectrum's degree.
    pub(super) fn new(
        sigma: f64,
        operator: Arc<Operator>,
        layout: &RingLayout,
        spectrum: &[f64],
    ) -> Result<Self> {
        Ok(Self {
            operator,
            tails: tails(layout, spectrum, sigma)?,
        })
    }

    /// The rings of the picture that a light makes, ring by ring.
    pub(super) fn shown(
        &self,
        light: &Coefficients,
        diffuse: f64,
        specular: f64,
        columns: usize,
    ) -> Result<Vec<f64>> {
        self.operator.forward(light, diffuse, specular, columns)
    }
}

impl LightReader {
    /// ν of pictures of 128 pixels a side without noise.
    pub const NOISE: f64 = 1e-3;

    /// Rings and orders of [`Self::default_layout`].
    const RINGS: usize = 64;

    /// The rings on which pictures of 96 … 256 pixels a side are read: 64 rings, 64 orders.
    ///
    /// # Errors
    /// A camera inside the sphere.
    pub fn default_layout(viewpoint: crate::reflection::Viewpoint) -> Result<RingLayout> {
        Self::layout_within(viewpoint, RingLayout::LARGEST_RADIUS)
    }

    /// As many rings within a radius.
    pub(super) fn layout_within(
        viewpoint: crate::reflection::Viewpoint,
        radius: f64,
    ) -> Result<RingLayout> {
        RingLayout::within(viewpoint, Self::RINGS, Self::RINGS, radius)
    }

    /// The plan for one reflectance under light of power `spectrum[l]` per order, read on `layout`.
    ///
    /// `noise` is ν, the noise's standard deviation as a share of the amplitudes'.
    ///
    /// # Errors
    /// A spectrum of fewer degrees than the layout has orders, or with a value that is negative or
    /// not finite; a noise that is not positive; a reflectance that is 0, negative or not finite,
    /// and what the operator refuses.
    pub fn new(
        variant: Variant,
        reflectance: ChannelReflectance,
        layout: &RingLayout,
        spectrum: &[f64],
        noise: f64,
        parallelism: Parallelism,
    ) -> Result<Self> {
        check_noise(noise)?;
        let degree = spectrum.len().saturating_sub(1);
        check_spectrum(spectrum, degree)?;
        if degree < layout.orders() {
            return Err(Error::TooFew {
                what: "reading light",
                items: "degrees",
                needed: layout.orders(),
                got: degree,
            });
        }
        let (sigma, viewpoint) = (reflectance.sigma, layout.viewpoint());
        let rings = layout.angles();
        let operator = Operator::new(variant, sigma, viewpoint, rings, degree, parallelism)?;
        let lobe = SeenLobe::new(sigma, Arc::new(operator), layout, spectrum)?;
        let ChannelReflectance {
            diffuse, specular, ..
        } = reflectance;
        Self::of_lobe(
            &lobe,
            diffuse,
            specular,
            layout,
            spectrum,
            noise,
            parallelism,
        )
    }

    /// [`Self::new`] for what is made of a lobe that others share; the spectrum and the noise have
    /// been looked at.
    pub(super) fn of_lobe(
        lobe: &SeenLobe,
        diffuse: f64,
        specular: f64,
        layout: &RingLayout,
        spectrum: &[f64],
        noise: f64,
        parallelism: Parallelism,
    ) -> Result<Self> {
        for (what, value) in [
            ("the diffuse albedo", diffuse),
            ("the specular albedo", specular),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::Domain {
                    what,
                    value,
                    allowed: "finite and at least 0",
                });
            }
        }
        let rings = layout.angles().len();
        let blocks = (0..=layout.orders())
            .map(|m| lobe.operator.block(m, diffuse, specular))
            .collect::<Result<Vec<_>>>()?;
        let covariances: Vec<DMatrix<f64>> = blocks
            .iter()
            .enumerate()
            .map(|(m, block)| {
                let mut scaled = block.clone();
                for (mut column, power) in scaled.column_iter_mut().zip(&spectrum[m..]) {
                    column *= *power;
                }
                scaled * block.transpose()
            })
            .collect();
        // The variance of an amplitude, averaged over the rings and the orders past 0.
        let past = &covariances[1.min(covariances.len() - 1)..];
        let total: f64 = past.iter().map(DMatrix::trace).sum();
        let white = noise * noise * total / (past.len() * rings) as f64;
        let made = parallelism.map(blocks.len(), |m| {
            let mut covariance = covariances[m].clone();
            for ring in 0..rings {
                covariance[(ring, ring)] += white + specular * specular * lobe.tails[m][ring];
            }
            let refused = || Error::NotPositiveDefinite {
                what: format!("the covariance of order {m} at ρ_d = {diffuse}, ρ_s = {specular}"),
            };
            let factor = Cholesky::new(covariance).ok_or_else(refused)?;
            let whitening = inverse_of_lower(factor.l_dirty());
            let logs: f64 = factor.l_dirty().diagonal().map(f64::ln).sum();
            if whitening.iter().any(|value| !value.is_finite()) {
                return Err(refused());
            }
            let mut gain = blocks[m].tr_mul(&whitening.transpose());
            for (mut row, power) in gain.row_iter_mut().zip(&spectrum[m..]) {
                row *= *power;
            }
            let order = Order {
                operator: blocks[m].clone(),
                whitening,
                gain,
            };
            Ok((order, parts(m) as f64 * logs))
        });
        let (mut orders, mut half_log_determinant) = (Vec::with_capacity(made.len()), 0.0);
        for made in made {
            let (order, logs) = made?;
            orders.push(order);
            half_log_determinant += logs;
        }
        Ok(Self {
            layout: layout.clone(),
            spectrum: spectrum.to_vec(),
            orders,
            half_log_determinant,
        })
    }

    /// The largest degree of the light.
    pub fn degree(&self) -> usize {
        self.spectrum.len() - 1
    }

    /// The rings that pictures are read on.
    pub fn layout(&self) -> &RingLayout {
        &self.layout
    }

    /// The light that one channel of a picture shows, with small bright lights where `lights` says.
    ///
    /// # Errors
    /// [`Error::Length`] for modes of another layout.
    pub fn read(&self, modes: &Modes, lights: &BrightLights) -> Result<LightEstimate> {
        let rings = self.layout.angles().len();
        modes.check(&self.layout)?;
        let directions = lights.directions();
        let count = directions.len();
        let mut square = 0.0;
        let mut gram = DMatrix::identity(count, count) / LIGHT_VARIANCE;
        let mut projection = DMatrix::zeros(count, 1);
        let (mut whites, mut harmonics, mut responses) = (Vec::new(), Vec::new(), Vec::new());
        let mut amplitudes_in_all = 0;
        for (m, order) in self.orders.iter().enumerate() {
            let parts = parts(m);
            let both = modes.cosine(m).iter().chain(modes.sine(m)).copied();
            let white = &order.whitening * DMatrix::from_iterator(rings, parts, both);
            let of_lights = self.harmonics(m, directions)?;
            let response = &order.whitening * (&order.operator * &of_lights);
            square += white.norm_squared();
            amplitudes_in_all += rings * parts;
            let along = response.tr_mul(&white);
            let between = response.tr_mul(&response);
            for (i, (_, azimuth)) in directions.iter().enumerate() {
                let wave = waves(m, *azimuth);
                for part in 0..parts {
                    projection[i] += wave[part] * along[(i, part)];
                }
                for (j, (_, other)) in directions.iter().enumerate() {
                    let turn = (m as f64 * (azimuth - other)).cos();
                    gram[(i, j)] += turn * between[(i, j)];
                }
            }
            whites.push(white);
            harmonics.push(of_lights);
            responses.push(response);
        }
        let factor = Cholesky::new(gram).ok_or_else(|| Error::NotPositiveDefinite {
            what: "the Gram matrix of the responses to the lights".into(),
        })?;
        let strengths = factor.solve(&projection);
        let square = square - strengths.dot(&projection);
        let mut mean = Coefficients::zeros(self.degree());
        let mut unexplained = Vec::with_capacity(self.orders.len());
        for (m, order) in self.orders.iter().enumerate() {
            let of_lights = &harmonics[m];
            let mut white = whites[m].clone();
            let mut direct = DMatrix::zeros(of_lights.nrows(), white.ncols());
            for (j, (_, azimuth)) in directions.iter().enumerate() {
                let wave = waves(m, *azimuth);
                for part in 0..white.ncols() {
                    let strength = strengths[j] * wave[part];
                    white
                        .column_mut(part)
                        .axpy(-strength, &responses[m].column(j), 1.0);
                    direct
                        .column_mut(part)
                        .axpy(strength, &of_lights.column(j), 1.0);
                }
            }
            let field = &order.gain * white + direct;
            mean.cosine_mut(m)
                .copy_from_slice(field.column(0).as_slice());
            if m > 0 {
                mean.sine_mut(m).copy_from_slice(field.column(1).as_slice());
            }
            unexplained.push(of_lights - &order.gain * &responses[m]);
        }
        // The lights have orders that are not read too.
        for m in self.orders.len()..=self.degree() {
            let of_lights = self.harmonics(m, directions)?;
            for (j, (_, azimuth)) in directions.iter().enumerate() {
                let wave = waves(m, *azimuth);
                for (l, value) in of_lights.column(j).iter().enumerate() {
                    mean.cosine_mut(m)[l] += strengths[j] * wave[0] * value;
                    mean.sine_mut(m)[l] += strengths[j] * wave[1] * value;
                }
            }
            unexplained.push(of_lights);
        }
        let fluxes = directions.iter().zip(strengths.iter());
        let n = amplitudes_in_all as f64;
        // ½ ln det(τ² A).
        let of_lights: f64 = factor.l_dirty().diagonal().map(f64::ln).sum();
        let of_lights = of_lights + 0.5 * count as f64 * LIGHT_VARIANCE.ln();
        let log_evidence = if square > 0.0 {
            statrs::function::gamma::ln_gamma(0.5 * n)
                - 0.5 * n * (std::f64::consts::PI * square).ln()
                - self.half_log_determinant
                - of_lights
        } else {
            0.0
        };
        Ok(LightEstimate {
            mean,
            lights: fluxes
                .map(|((polar, azimuth), flux)| (*polar, *azimuth, *flux))
                .collect(),
            strength: square / n,
            log_evidence,
            between_lights: factor.inverse(),
            unexplained,
        })
    }

    /// Checks that an estimate is to this reader's degree.
    fn check(&self, estimate: &LightEstimate) -> Result<()> {
        let orders = estimate.unexplained.len();
        check_length(
            "the orders of an estimate of light",
            self.degree() + 1,
            orders,
        )
    }

    /// P̄_lm(cos θ_j), a row a degree, a column a light.
    fn harmonics(&self, m: usize, directions: &[(f64, f64)]) -> Result<DMatrix<f64>> {
        let mut all = DMatrix::zeros(self.degree() + 1 - m, directions.len());
        for (mut column, (polar, _)) in all.column_iter_mut().zip(directions) {
            let (sin, cos) = polar.sin_cos();
            legendre::column(m, self.degree(), cos, sin, column.as_mut_slice())?;
        }
        Ok(all)
    }

    /// The posterior standard deviation of one coefficient of an estimate of this reader, l ≥ |m|,
    /// m ≥ 0 of the cosine and m < 0 of the sine; that of the field for an order that is not read.
    ///
    /// # Errors
    /// [`Error::Degree`] for l beyond the reader's or |m| beyond l; [`Error::Length`] for an
    /// estimate to another degree.
    pub fn deviation(&self, estimate: &LightEstimate, l: usize, m: isize) -> Result<f64> {
        self.check(estimate)?;
        let order = m.unsigned_abs();
        if l > self.degree() || order > l {
            return Err(Error::Degree {
                what: "the deviation of a coefficient",
                degree: l.max(order),
                limit: self.degree(),
            });
        }
        let mut variance = self.spectrum[l];
        if let Some(of_order) = self.orders.get(order) {
            variance -= of_order.gain.row(l - order).norm_squared();
        }
        let row = estimate.unexplained[order].row(l - order);
        let part = usize::from(m < 0);
        let waves = estimate
            .lights
            .iter()
            .map(|(_, azimuth, _)| waves(order, *azimuth)[part]);
        let along = DMatrix::from_iterator(
            estimate.lights.len(),
            1,
            row.iter().zip(waves).map(|(value, wave)| value * wave),
        );
        variance += (&estimate.between_lights * &along).dot(&along);
        Ok((estimate.strength * variance.max(0.0)).sqrt())
    }

    /// The posterior mean and standard deviation of the radiance on a circle about the line of
    /// sight, at a polar angle and some azimuths, of light to the reader's degree.
    ///
    /// The mean of a light that is sharper than the degree shows swings below 0 about bright
    /// lights.
    ///
    /// # Errors
    /// [`Error::Length`] for an estimate to another degree.
    pub fn radiance(
        &self,
        estimate: &LightEstimate,
        polar: f64,
        azimuths: &[f64],
    ) -> Result<Vec<(f64, f64)>> {
        self.check(estimate)?;
        let (sin, cos) = polar.sin_cos();
        // What the field leaves open is the same all round.
        let mut field = 0.0;
        let mut means = Vec::with_capacity(self.degree() + 1);
        let mut open = DMatrix::<f64>::zeros(estimate.lights.len(), self.degree() + 1);
        let mut column = vec![0.0; self.degree() + 1];
        for m in 0..=self.degree() {
            let column = &mut column[..self.degree() + 1 - m];
            legendre::column(m, self.degree(), cos, sin, column)?;
            let along = |of: &[f64]| -> f64 { of.iter().zip(&*column).map(|(a, p)| a * p).sum() };
            let squares: Vec<f64> = column.iter().map(|p| p * p).collect();
            let powers = squares.iter().zip(&self.spectrum[m..]);
            field += powers.map(|(square, power)| square * power).sum::<f64>();
            if let Some(order) = self.orders.get(m) {
                for ring in 0..order.gain.ncols() {
                    let gains = order.gain.column(ring);
                    let explained: f64 = gains.iter().zip(&*column).map(|(g, p)| g * p).sum();
                    field -= explained * explained;
                }
            }
            let sine = if m == 0 {
                0.0
            } else {
                along(estimate.mean.sine(m))
            };
            means.push((along(estimate.mean.cosine(m)), sine));
            for (light, unexplained) in estimate.unexplained[m].column_iter().enumerate() {
                let values = unexplained.iter().zip(&*column);
                open[(light, m)] = values.map(|(b, p)| b * p).sum::<f64>();
            }
        }
        let of = azimuths.iter().map(|azimuth| {
            let mut mean = 0.0;
            let mut of_lights = DMatrix::<f64>::zeros(estimate.lights.len(), 1);
            for (m, (cosine, sine)) in means.iter().enumerate() {
                let [cos, sin] = waves(m, *azimuth);
                mean += cosine * cos + sine * sin;
                for (light, (_, other, _)) in estimate.lights.iter().enumerate() {
                    of_lights[light] += open[(light, m)] * (m as f64 * (azimuth - other)).cos();
                }
            }
            let lights = (&estimate.between_lights * &of_lights).dot(&of_lights);
            let variance = estimate.strength * (field + lights).max(0.0);
            (mean, variance.sqrt())
        });
        Ok(of.collect())
    }

    /// The posterior mean and variance of what `grid` asks for, at all its points at once: what
    /// [`Self::radiance`] says, by transforms. The variance of the field is interpolated between
    /// the grid's polar angles, of which it takes fewer.
    ///
    /// ```
    /// use lobes::inference::{LightEstimate, LightField, LightGrid, LightReader};
    /// # use lobes::Result;
    /// /// The irradiance at normals all round, and how sure it is.
    /// fn irradiance(reader: &LightReader, estimate: &LightEstimate) -> Result<LightField> {
    ///     reader.field(estimate, &LightGrid::irradiance(32, reader.degree())?)
    /// }
    /// ```
    ///
    /// # Errors
    /// [`Error::Length`] for an estimate or a grid to another degree.
    pub fn field(&self, estimate: &LightEstimate, grid: &LightGrid) -> Result<LightField> {
        self.check(estimate)?;
        check_length("the orders of a grid", self.degree() + 1, grid.degree() + 1)?;
        // The field's own variance, the same all round; orders that are not read have all of it.
        let mut own = vec![0.0; grid.coarse_rows()];
        for m in 0..=self.degree() {
            let harmonics = grid.coarse(m);
            for (value, row) in own.iter_mut().zip(harmonics.row_iter()) {
                let powers = row.iter().zip(&self.spectrum[m..]);
                *value += powers.map(|(p, power)| p * p * power).sum::<f64>();
            }
            if let Some(order) = self.orders.get(m) {
                let explained = harmonics * &order.gain;
                for (value, row) in own.iter_mut().zip(explained.row_iter()) {
                    *value -= row.norm_squared();
                }
            }
        }
        let azimuths: Vec<f64> = estimate.lights.iter().map(|light| light.1).collect();
        let refused = || Error::NotPositiveDefinite {
            what: "the covariance of the lights' strengths".into(),
        };
        let factor = Cholesky::new(estimate.between_lights.clone()).ok_or_else(refused)?;
        let mean = grid.synthesise(&estimate.mean);
        let lights = grid.sum_of_squares(&estimate.unexplained, &azimuths, factor.l_dirty());
        let columns = grid.columns();
        let variance = lights.iter().enumerate().map(|(place, lights)| {
            let field = grid.between_coarse(&own, place / columns);
            estimate.strength * (field + lights).max(0.0)
        });
        Ok(LightField {
            rows: grid.rows(),
            columns,
            variance: variance.collect(),
            mean,
        })
    }
}

/// Checks ν.
pub(super) fn check_noise(noise: f64) -> Result<()> {
    if noise > 0.0 && noise.is_finite() {
        return Ok(());
    }
    Err(Error::Domain {
        what: "the noise",
        value: noise,
        allowed: "a finite number above 0",
    })
}

/// Cosine and sine, but for order 0.
fn parts(m: usize) -> usize {
    if m == 0 { 1 } else { 2 }
}

/// cos mφ and sin mφ.
fn waves(m: usize, azimuth: f64) -> [f64; 2] {
    let (sin, cos) = (m as f64 * azimuth).sin_cos();
    [cos, sin]
}

/// What a tail adds is left out below this share of the spectrum's end: the noise is far more.
const NEGLIGIBLE: f64 = 1e-12;

/// The inverse of a lower triangular matrix; what stands above the diagonal is not read.
fn inverse_of_lower(factor: &DMatrix<f64>) -> DMatrix<f64> {
    let n = factor.nrows();
    let mut inverse = DMatrix::zeros(n, n);
    let entries = factor.as_slice();
    for (j, column) in inverse.as_mut_slice().chunks_exact_mut(n).enumerate() {
        column[j] = 1.0;
        for k in j..n {
            let below = &entries[k * n + k..(k + 1) * n];
            let (value, rest) = (column[k] / below[0], &mut column[k + 1..]);
            for (entry, of_factor) in rest.iter_mut().zip(&below[1..]) {
                *entry -= value * of_factor;
            }
            column[k] = value;
        }
    }
    inverse
}

/// By order and ring: the variance that light past the spectrum's degree adds where a lobe of width
/// σ mirrors it, Σ_l C_l g_l² P̄_lm(cos θ′)², g_l = exp(−l²σ²), θ′ the angle at which the ring
/// mirrors the light. C_l goes on as the spectrum ends, by the power law of its last octave.
fn tails(layout: &RingLayout, spectrum: &[f64], sigma: f64) -> Result<Vec<Vec<f64>>> {
    let degree = spectrum.len() - 1;
    let rings = layout.angles().len();
    let mut all = vec![vec![0.0; rings]; layout.orders() + 1];
    let (half, last) = (spectrum[degree / 2], spectrum[degree]);
    if degree < 2 || half <= 0.0 || last <= 0.0 {
        return Ok(all);
    }
    let slope = (last / half).ln() / (degree as f64 / (degree / 2) as f64).ln();
    let top = TAIL * degree;
    let power: Vec<f64> = (degree + 1..=top)
        .map(|l| {
            let l = l as f64;
            let law = last * (l / degree as f64).powf(slope);
            law * (-2.0 * (l * sigma).powi(2)).exp()
        })
        .collect();
    // Of a lobe so wide that it shows nothing of them.
    if power[0] < NEGLIGIBLE * last {
        return Ok(all);
    }
    let viewpoint = layout.viewpoint();
    for (ring, &angle) in layout.angles().iter().enumerate() {
        let (sin, cos) = (angle + viewpoint.view_angle(angle)).sin_cos();
        for (m, of_order) in all.iter_mut().enumerate() {
            let mut column = vec![0.0; top + 1 - m];
            legendre::column(m, top, cos, sin, &mut column)?;
            let past = column[degree + 1 - m..].iter().zip(&power);
            of_order[ring] = past.map(|(p, power)| p * p * power).sum();
        }
    }
    Ok(all)
}
