//! The experts that tables compare: evidence, log radiance, colour.

use lobes::features::RingLayout;
use lobes::harmonics::average_power;
use lobes::illumination::{EnvironmentMap, Luminance};
use lobes::inference::{
    Dataset, Expert, GaussianEvidence, Reader, Reading, SmoothModes, SmoothOperator, Stack,
    log_sum_exp,
};
use lobes::nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use lobes::reflectance::{Material, Variant};
use lobes::reflection::OperatorSet;
use lobes::{Error, Parallelism, Result};

use crate::evaluate::Classifier;

/// [`GaussianEvidence`] of named materials, the light's spectrum being that of one of the
/// illuminations that were seen.
///
/// Natural spectra differ, above all in how much power bright small lights put at high degrees,
/// where no power law is right. So the prior of the spectrum is the set of measured ones, each as
/// likely as the others: ln p(picture) is the logarithm of the mean likelihood over them. Channels
/// have one reflectance, one roughness and one spectrum, and a strength of light each, which is
/// integrated out: the colour of the light is unknown.
///
/// Suns and lamps, which are no draw from a Gaussian field, are lights of their own. Two limits.
/// Materials whose pictures differ by exposure only, such as a grey and a white matte one, have the
/// same evidence, and no method tells them apart without the exposure. And a Gaussian field knows
/// no light that is negative: roughness is read well, how much a body adds to the gloss is not.
#[derive(Debug, Clone)]
pub struct EvidenceExpert {
    /// evidence[observation][material][illumination whose spectrum it is], channels added; empty
    /// where the picture was not read for it.
    evidence: Vec<Vec<Vec<f64>>>,
}

impl EvidenceExpert {
    /// The evidence of every picture of `dataset` that has a [`Reading::judged`] for every one of
    /// `materials` under every spectrum of `spectra`. `layout` is that of the modes.
    ///
    /// `spectra[i]` is the average power B_l of the light of illumination i, to the degree of the
    /// operator or beyond.
    ///
    /// # Errors
    /// Pictures too small, a spectrum too short, and what the operator refuses.
    #[expect(
        clippy::too_many_arguments,
        reason = "each is one thing that the evidence depends on"
    )]
    pub fn new(
        dataset: &Dataset<Reading>,
        materials: &[Material],
        variant: Variant,
        layout: &RingLayout,
        degree: usize,
        spectra: &[Vec<f64>],
        noise: f64,
        parallelism: Parallelism,
    ) -> Result<Self> {
        // Light of a low degree has no higher orders.
        let layout = &layout.with_orders_up_to(degree);
        let set = OperatorSet::new(variant, layout.viewpoint(), layout.angles(), degree)?;
        let mut pictures = Vec::new();
        for (i, observation) in dataset.observations.iter().enumerate() {
            if let Some(judged) = &observation.view.judged {
                let channel = |c: usize| SmoothModes::new(&judged.evidence.channels[c], layout);
                pictures.push((
                    i,
                    [channel(0)?, channel(1)?, channel(2)?],
                    &judged.evidence.lights,
                ));
            }
        }
        let mut evidence = vec![Vec::new(); dataset.observations.len()];
        for (i, _, _) in &pictures {
            evidence[*i] = vec![vec![0.0; spectra.len()]; materials.len()];
        }
        for (label, material) in materials.iter().enumerate() {
            let operator = set.at(material.roughness().sigma(), parallelism)?;
            let operator = SmoothOperator::new(&operator, layout)?;
            let responses = parallelism
                .map(pictures.len(), |picture| {
                    operator.responses(pictures[picture].2)
                })
                .into_iter()
                .collect::<Result<Vec<_>>>()?;
            let columns = parallelism.map(spectra.len(), |light| {
                let spectrum = spectra[light].get(..=degree).ok_or(Error::Length {
                    what: "a spectrum of light",
                    expected: degree + 1,
                    got: spectra[light].len(),
                })?;
                let mut sums = vec![0.0; pictures.len()];
                let mut made: Option<(f64, GaussianEvidence)> = None;
                for channel in 0..3 {
                    // Strength is integrated out, so only the share of the specular part counts.
                    let (d, s) = (material.diffuse()[channel], material.specular()[channel]);
                    let share = s / (d + s);
                    if made
                        .as_ref()
                        .is_none_or(|(of, _)| (of - share).abs() > 1e-12)
                    {
                        let factors =
                            GaussianEvidence::new(&operator, spectrum, 1.0 - share, share, noise)?;
                        made = Some((share, factors));
                    }
                    if let Some((_, factors)) = &made {
                        for (sum, ((_, picture, _), responses)) in
                            sums.iter_mut().zip(pictures.iter().zip(&responses))
                        {
                            *sum += factors.of(&picture[channel], responses)?.log;
                        }
                    }
                }
                Ok(sums)
            });
            for (light, column) in columns.into_iter().enumerate() {
                for ((picture, _, _), value) in pictures.iter().zip(column?) {
                    evidence[*picture][label][light] = value;
                }
            }
        }
        Ok(Self { evidence })
    }
}

impl Expert for EvidenceExpert {
    fn name(&self) -> String {
        "evidence".into()
    }

    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
        if !seen.contains(&true) {
            return Err(Error::TooFew {
                what: "evidence",
                items: "spectra of light",
                needed: 1,
                got: 0,
            });
        }
        Ok(observations
            .iter()
            .map(|&i| {
                self.evidence[i]
                    .iter()
                    .map(|lights| {
                        let terms = lights.iter().zip(seen).filter(|(_, seen)| **seen);
                        log_sum_exp(terms.map(|(&value, _)| value))
                    })
                    .collect()
            })
            .collect())
    }
}

/// B_l of a map's luminance to `degree`.
///
/// # Errors
/// A degree that the map does not carry.
pub fn light_spectrum(
    map: &EnvironmentMap,
    degree: usize,
    parallelism: Parallelism,
) -> Result<Vec<f64>> {
    let channels = map.coefficients(degree, parallelism)?;
    let mut luminance = channels[0].clone();
    for (i, value) in luminance.as_mut_slice().iter_mut().enumerate() {
        *value = Luminance::Rec709.of([0, 1, 2].map(|c: usize| channels[c].as_slice()[i]));
    }
    Ok(average_power(&luminance))
}

/// A Student t of the rings' amplitudes of log radiance about zero, one per material, learned from
/// spheres that were rendered under the illuminations seen.
///
/// Radiance is far from Gaussian, its logarithm is near (Dror, Willsky and Adelson 2004,
/// doi:10.1167/4.9.11). Per order the amplitudes over the first cosines across the rings are
/// Gaussian with a covariance that is learned and shrunk to its diagonal, and light differs in
/// contrast: one unknown factor on all variances of a picture, with a scaled inverse χ² prior of 50
/// degrees of freedom, integrates out to a Student t. The mean over the picture is left out, and
/// with it the exposure.
#[derive(Debug)]
pub struct LogRadianceExpert {
    labels: usize,
    noise: f64,
    /// moments[illumination][material][order]: the sum of y yᵀ.
    moments: Vec<Vec<Vec<DMatrix<f64>>>>,
    /// How many terms each sum of order 1 has; order 0 has half.
    counts: Vec<f64>,
    /// pictures[observation][order]: cosine and sine amplitudes.
    pictures: Vec<Vec<DMatrix<f64>>>,
}

/// How far covariances are drawn to their diagonal.
const SHRINKAGE: f64 = 0.1;

/// The degrees of freedom of the unknown contrast: a factor of 1.15 either way.
const DEGREES_OF_FREEDOM: f64 = 50.0;

impl LogRadianceExpert {
    /// Reads the pictures of a data set; all of those seen are learned from. `noise` is what pixels
    /// and interpolation add to each amplitude of log radiance; it keeps matte spheres, whose high
    /// orders are nothing else, from deciding by it.
    pub fn new(dataset: &Dataset<Reading>, noise: f64) -> Self {
        let labels = dataset.materials.len();
        let size = Reader::FUNCTIONS;
        let empty = vec![vec![DMatrix::zeros(size, size); Reader::LOG_ORDERS + 1]; labels];
        let mut moments = vec![empty; dataset.illuminations.len()];
        let mut counts = vec![0.0; dataset.illuminations.len()];
        for observation in &dataset.observations {
            let sums = &mut moments[observation.illumination][observation.material];
            for (sum, y) in sums.iter_mut().zip(&observation.view.log_amplitudes) {
                *sum += y * y.transpose();
            }
            counts[observation.illumination] += 2.0 / labels as f64;
        }
        let views = dataset.observations.iter();
        Self {
            labels,
            noise,
            moments,
            counts,
            pictures: views.map(|o| o.view.log_amplitudes.clone()).collect(),
        }
    }
}

impl Expert for LogRadianceExpert {
    fn name(&self) -> String {
        "log radiance".into()
    }

    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
        let counts = self.counts.iter().zip(seen);
        let count: f64 = counts.filter(|(_, s)| **s).map(|(c, _)| c).sum();
        if count == 0.0 {
            return Err(Error::TooFew {
                what: "the log-radiance likelihood",
                items: "pictures to learn from",
                needed: 1,
                got: 0,
            });
        }
        let size = Reader::FUNCTIONS;
        let mut scores = vec![vec![0.0; self.labels]; observations.len()];
        for label in 0..self.labels {
            let mut squares = vec![0.0; observations.len()];
            let (mut log_determinant, mut amplitudes) = (0.0, 0.0);
            for order in 0..=Reader::LOG_ORDERS {
                let mut covariance = DMatrix::zeros(size, size);
                for (moments, seen) in self.moments.iter().zip(seen) {
                    if *seen {
                        covariance += &moments[label][order];
                    }
                }
                // Order 0 has no sine, and lost its mean: the first function is the constant.
                let (copies, first) = if order == 0 { (1.0, 1) } else { (2.0, 0) };
                covariance /= 0.5 * copies * count;
                let size = size - first;
                let mut covariance = covariance.view((first, first), (size, size)).into_owned();
                let diagonal = covariance.diagonal();
                covariance *= 1.0 - SHRINKAGE;
                for i in 0..size {
                    covariance[(i, i)] += SHRINKAGE * diagonal[i] + self.noise * self.noise;
                }
                let factor = cholesky(covariance)?;
                let half_log: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
                log_determinant += copies * half_log;
                amplitudes += copies * size as f64;
                for (square, &i) in squares.iter_mut().zip(observations) {
                    let y = &self.pictures[i][order];
                    let mut y = y.view((first, 0), (size, y.ncols())).into_owned();
                    factor.l_dirty().solve_lower_triangular_mut(&mut y);
                    *square += y.norm_squared();
                }
            }
            for (score, square) in scores.iter_mut().zip(squares) {
                let weight = 0.5 * (amplitudes + DEGREES_OF_FREEDOM);
                score[label] = -weight * (square / DEGREES_OF_FREEDOM).ln_1p() - log_determinant;
            }
        }
        Ok(scores)
    }
}

fn cholesky(matrix: DMatrix<f64>) -> Result<Cholesky<f64, Dyn>> {
    Cholesky::new(matrix).ok_or_else(|| Error::NotPositiveDefinite {
        what: "a covariance that was learned".into(),
    })
}

/// A Gaussian of the logarithms of a picture's mean colour, one mean per material and one
/// covariance.
#[derive(Debug)]
pub struct ColourExpert {
    labels: Vec<usize>,
    illuminations: Vec<usize>,
    materials: usize,
    colours: Vec<DVector<f64>>,
}

impl ColourExpert {
    /// With the brightness, which needs a known exposure, or with the colour alone.
    pub fn new(dataset: &Dataset<Reading>, with_brightness: bool) -> Self {
        let colours = dataset.observations.iter().map(|observation| {
            let [r, g, b] = observation.view.mean.map(|value| value.max(1e-12).ln());
            if with_brightness {
                DVector::from_vec(vec![r - g, b - g, g])
            } else {
                DVector::from_vec(vec![r - g, b - g])
            }
        });
        Self {
            labels: dataset.labels(),
            illuminations: dataset
                .observations
                .iter()
                .map(|o| o.illumination)
                .collect(),
            materials: dataset.materials.len(),
            colours: colours.collect(),
        }
    }
}

impl Expert for ColourExpert {
    fn name(&self) -> String {
        "colour".into()
    }

    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
        let size = self.colours.first().map_or(0, DVector::len);
        let mut means = vec![DVector::zeros(size); self.materials];
        let mut counts = vec![0.0; self.materials];
        let training: Vec<usize> = (0..self.labels.len())
            .filter(|&i| seen[self.illuminations[i]])
            .collect();
        for &i in &training {
            means[self.labels[i]] += &self.colours[i];
            counts[self.labels[i]] += 1.0;
        }
        for (mean, count) in means.iter_mut().zip(&counts) {
            if *count == 0.0 {
                return Err(Error::TooFew {
                    what: "learning the colour of a material",
                    items: "pictures",
                    needed: 1,
                    got: 0,
                });
            }
            *mean /= *count;
        }
        let mut covariance = DMatrix::zeros(size, size);
        for &i in &training {
            let off = &self.colours[i] - &means[self.labels[i]];
            covariance += &off * off.transpose();
        }
        covariance /= (training.len().saturating_sub(self.materials)).max(1) as f64;
        for i in 0..size {
            covariance[(i, i)] += 1e-4;
        }
        let factor = cholesky(covariance)?;
        Ok(observations
            .iter()
            .map(|&i| {
                means
                    .iter()
                    .map(|mean| {
                        let mut off = &self.colours[i] - mean;
                        factor.l_dirty().solve_lower_triangular_mut(&mut off);
                        -0.5 * off.norm_squared()
                    })
                    .collect()
            })
            .collect())
    }
}

impl Classifier for Stack<'_> {
    fn name(&self) -> String {
        Stack::name(self)
    }

    fn score(&self, training: &[usize], test: &[usize]) -> Result<Vec<Vec<f64>>> {
        Stack::score(self, training, test)
    }
}
