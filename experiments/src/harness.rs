//! Any classifier under any protocol.

use crate::colour_ceiling::{ColourCeiling, colour_ceilings};
use crate::evaluate::{Classifier, Evaluation, judge_leaving_one_out};
use crate::experts::{ColourExpert, EvidenceExpert, LogRadianceExpert, light_spectrum};
use crate::nearest::{NearestNeighbour, Scaling};
use crate::protocol::Protocol;
use lobes::illumination::EnvironmentMap;
use lobes::inference::GaussianEvidence;
use lobes::inference::{Dataset, Plan, collect};
use lobes::inference::{Discriminant, EVIDENCE_DEGREE};
use lobes::inference::{Expert, Scenes, Stack};
use lobes::inference::{JudgedReading, Reader, Reading, chromaticity};
use lobes::named;
use lobes::picture::Photograph;
use lobes::reflectance::{Finish, Material};
use lobes::{Error, Parallelism, Result};

/// A way of naming the material, from features to name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Method {
    /// The paper's features, the unseen half mirrored, and the nearest neighbour by logarithms.
    Paper,
    /// The same, the unseen half a half-turn of the front.
    PaperHalfTurn,
    /// The same, the unseen half zero.
    PaperZero,
    /// Bands of the unbiased spectrum and the nearest neighbour by logarithms.
    Unbiased,
    /// Dror, Adelson and Willsky's features and the nearest neighbour, standardised.
    DrorNearest,
    /// Their features and a linear discriminant.
    DrorDiscriminant,
    /// Needlet statistics and colour, and the nearest neighbour, standardised.
    NeedletsNearest,
    /// Needlet statistics and colour, and a linear discriminant.
    NeedletsDiscriminant,
    /// Gaussian evidence and colour, weighed by an inner loop.
    Evidence,
    /// The likelihood of log radiance and colour, weighed by an inner loop.
    LogRadiance,
    /// Bands of log radiance and a linear discriminant.
    LogBands,
    /// The discriminant on bands of log radiance, the likelihood of log radiance and evidence,
    /// weighed by an inner loop.
    Combined,
}

impl Method {
    /// Every method, in the order in which tables list them.
    pub const ALL: [Self; 12] = [
        Self::Paper,
        Self::PaperHalfTurn,
        Self::PaperZero,
        Self::Unbiased,
        Self::DrorNearest,
        Self::DrorDiscriminant,
        Self::NeedletsNearest,
        Self::NeedletsDiscriminant,
        Self::Evidence,
        Self::LogRadiance,
        Self::LogBands,
        Self::Combined,
    ];

    /// The name that `FromStr` reads.
    ///
    /// ```
    /// use lobes_experiments::Method;
    /// for method in Method::ALL {
    ///     assert_eq!(method.name().parse::<Method>().unwrap(), method);
    /// }
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::PaperHalfTurn => "paper-half-turn",
            Self::PaperZero => "paper-zero",
            Self::Unbiased => "unbiased",
            Self::DrorNearest => "dror-nearest",
            Self::DrorDiscriminant => "dror-discriminant",
            Self::NeedletsNearest => "needlets-nearest",
            Self::NeedletsDiscriminant => "needlets-discriminant",
            Self::Evidence => "evidence",
            Self::LogRadiance => "log-radiance",
            Self::LogBands => "log-bands",
            Self::Combined => "combined",
        }
    }

    /// Whether it learns from one picture of each sphere alone, as the paper does.
    fn learns_from_one_turn(self) -> bool {
        matches!(
            self,
            Self::Paper
                | Self::PaperHalfTurn
                | Self::PaperZero
                | Self::Unbiased
                | Self::DrorNearest
                | Self::NeedletsNearest
        )
    }

    /// Whether an inner loop chooses something, for which a fold needs two scenes and so the data
    /// three.
    pub fn has_inner_loop(self) -> bool {
        !self.learns_from_one_turn()
    }

    /// Whether it needs [`Evidence`](lobes::inference::Evidence), which is the slowest to make.
    fn needs_evidence(self) -> bool {
        matches!(self, Self::Evidence | Self::Combined)
    }
}

named!(Method, "classifier");

/// What pixels and interpolation add to an amplitude of log radiance.
const LOG_NOISE: f64 = 1e-3;

/// The readings of one protocol's pictures, and every method on them.
#[derive(Debug)]
pub struct Harness {
    protocol: Protocol,
    dataset: Dataset<Reading>,
    materials: Vec<Material>,
    evidence: Option<EvidenceExpert>,
}

impl Harness {
    /// Renders and reads the pictures of a protocol.
    ///
    /// The pictures of [`Protocol::Photograph`] are photographed with a generator seeded by `seed`
    /// and the picture's place.
    ///
    /// # Errors
    /// Those of [`collect`] and of [`Reader::read`]; [`Protocol::Continuous`], which has no named
    /// materials.
    pub fn new(
        protocol: Protocol,
        illuminations: &[EnvironmentMap],
        materials: &[Material],
        plan: &Plan,
        seed: u64,
        parallelism: Parallelism,
        done: &(dyn Fn() + Sync),
    ) -> Result<Self> {
        if protocol == Protocol::Continuous {
            return Err(Error::Undefined {
                of: "the protocol continuous",
                what: "named materials",
                reason: "judge it by `Continuous`",
            });
        }
        let reader = Reader::new(protocol.view().viewpoint)?;
        let dataset = collect(
            &protocol.view().cameras(plan.turns)?,
            illuminations,
            materials,
            plan,
            parallelism,
            done,
            &|of, image| {
                let judged = of.turn == 0;
                let reading = if protocol == Protocol::Photograph {
                    let place = (of.illumination * plan.turns + of.turn) * materials.len();
                    let seed = seed.wrapping_mul(1 << 32) + (place + of.material) as u64;
                    reader.read(&Photograph::default().take(image, seed)?, judged)?
                } else {
                    reader.read(image, judged)?
                };
                Ok(if protocol.knows_exposure() {
                    reading
                } else {
                    reading.without_exposure()
                })
            },
        )?;
        Ok(Self {
            protocol,
            dataset,
            materials: materials.to_vec(),
            evidence: None,
        })
    }

    /// The pictures of [`Protocol::Paper`] as [`Protocol::Blind`] has them, without rendering them
    /// again.
    #[must_use]
    pub fn blind(&self) -> Self {
        let observations = self.dataset.observations.iter().cloned();
        Self {
            protocol: Protocol::Blind,
            dataset: Dataset {
                observations: observations
                    .map(|mut observation| {
                        observation.view = observation.view.without_exposure();
                        observation
                    })
                    .collect(),
                materials: self.dataset.materials.clone(),
                illuminations: self.dataset.illuminations.clone(),
                scenes: self.dataset.scenes.clone(),
                render_error: self.dataset.render_error,
            },
            materials: self.materials.clone(),
            evidence: self.evidence.clone(),
        }
    }

    /// With the scenes that the illuminations belong to: those of one are left out together.
    #[must_use]
    pub fn with_scenes(mut self, scenes: &Scenes) -> Self {
        self.dataset.scenes = scenes.clone();
        self
    }

    /// The protocol.
    pub fn protocol(&self) -> Protocol {
        self.protocol
    }

    /// The readings.
    pub fn dataset(&self) -> &Dataset<Reading> {
        &self.dataset
    }

    /// The finish of each material.
    pub fn finishes(&self) -> Vec<Finish> {
        self.materials.iter().map(Material::finish).collect()
    }

    /// How well the materials that differ in colour alone can be told apart at the best.
    ///
    /// # Errors
    /// Those of [`colour_ceilings`].
    pub fn colour_ceilings(&self) -> Result<Vec<ColourCeiling>> {
        colour_ceilings(self.protocol, &self.dataset, &self.materials)
    }

    /// Makes what `methods` need beyond the readings.
    ///
    /// # Errors
    /// A map that does not carry the degree of the evidence, and what the operator refuses.
    pub fn prepare(
        &mut self,
        methods: &[Method],
        illuminations: &[EnvironmentMap],
        plan: &Plan,
        parallelism: Parallelism,
    ) -> Result<()> {
        if self.evidence.is_none() && methods.iter().any(|method| method.needs_evidence()) {
            let degree = illuminations
                .iter()
                .map(|map| (map.height() - 1) / 2)
                .fold(EVIDENCE_DEGREE, usize::min);
            let spectra = parallelism
                .map(illuminations.len(), |i| {
                    light_spectrum(&illuminations[i], degree, Parallelism::Sequential)
                })
                .into_iter()
                .collect::<Result<Vec<_>>>()?;
            let reader = Reader::new(self.protocol.view().viewpoint)?;
            self.evidence = Some(EvidenceExpert::new(
                &self.dataset,
                &self.materials,
                plan.lobe,
                reader.evidence_layout(),
                degree,
                &spectra,
                GaussianEvidence::NOISE,
                parallelism,
            )?);
        }
        Ok(())
    }

    /// Names every picture of turn 0, leaving one scene out at a time.
    ///
    /// # Errors
    /// [`Error::Undefined`] for evidence that was not [prepared](Self::prepare) and for fewer than
    /// three scenes where an inner loop needs two to learn from.
    pub fn evaluate(&self, method: Method, parallelism: Parallelism) -> Result<Evaluation> {
        let data = &self.dataset;
        let count = data.materials.len();
        let judged = data.judged();
        let run = |classifier: &dyn Classifier, observations: &[usize]| {
            let labels: Vec<usize> = observations
                .iter()
                .map(|&i| data.observations[i].material)
                .collect();
            let groups: Vec<usize> = observations
                .iter()
                .map(|&i| data.scenes.of(data.observations[i].illumination))
                .collect();
            let places: Vec<usize> = (0..observations.len())
                .filter(|&i| data.observations[observations[i]].turn == 0)
                .collect();
            judge_leaving_one_out(classifier, &labels, &groups, &places, count, parallelism)
        };
        let labels: Vec<usize> = judged
            .iter()
            .map(|&i| data.observations[i].material)
            .collect();
        let all: Vec<usize> = (0..data.observations.len()).collect();
        if method.learns_from_one_turn() {
            let readings: Vec<&Reading> =
                judged.iter().map(|&i| &data.observations[i].view).collect();
            let paper = |continuation: usize| {
                let features = readings
                    .iter()
                    .map(|reading| Ok(judged_reading(reading)?.paper[continuation].to_array()))
                    .collect::<Result<Vec<_>>>()?;
                NearestNeighbour::new(Scaling::default(), &features, &labels, count)
            };
            let vectors = |of: &dyn Fn(&Reading) -> Vec<f64>| {
                let features = readings.iter().map(|reading| of(reading)).collect();
                NearestNeighbour::standardised(features, &labels, count)
            };
            let nearest = match method {
                Method::Paper => paper(0)?,
                Method::PaperHalfTurn => paper(1)?,
                Method::PaperZero => paper(2)?,
                Method::Unbiased => {
                    let features = readings
                        .iter()
                        .map(|reading| Ok(judged_reading(reading)?.unbiased.clone()))
                        .collect::<Result<Vec<_>>>()?;
                    NearestNeighbour::plain(features, &labels, count)?
                }
                Method::DrorNearest => vectors(&|reading| self.dror(reading))?,
                _ => vectors(&|reading| self.needlets(reading))?,
            };
            let mut evaluation = run(&nearest, &judged)?;
            evaluation.observations = judged;
            return Ok(evaluation);
        }
        let colour = ColourExpert::new(data, self.protocol.knows_exposure());
        let discriminant = |name, features: &dyn Fn(&Reading) -> Vec<f64>| {
            Discriminant::new(name, data, Discriminant::SHRINKAGE, features)
        };
        let alone = |expert: &dyn Expert| run(&Stack::new(data, vec![expert]), &all);
        let log_bands = || discriminant("log bands", &|reading| self.log_bands(reading));
        let evidence = || {
            self.evidence.as_ref().ok_or(Error::Undefined {
                of: "a harness that was not prepared",
                what: "evidence",
                reason: "call `prepare` first",
            })
        };
        match method {
            Method::DrorDiscriminant => alone(&discriminant("Dror", &|r| self.dror(r))?),
            Method::NeedletsDiscriminant => {
                alone(&discriminant("needlets", &|r| self.needlets(r))?)
            }
            Method::LogBands => alone(&log_bands()?),
            Method::LogRadiance => {
                let log = LogRadianceExpert::new(data, LOG_NOISE);
                run(&Stack::new(data, vec![&log, &colour]), &all)
            }
            Method::Evidence => run(&Stack::new(data, vec![evidence()?, &colour]), &all),
            _ => {
                let bands = log_bands()?;
                let log = LogRadianceExpert::new(data, LOG_NOISE);
                run(&Stack::new(data, vec![&bands, &log, evidence()?]), &all)
            }
        }
    }

    fn dror(&self, reading: &Reading) -> Vec<f64> {
        let mut features = reading.dror.statistics.clone();
        if self.protocol.knows_exposure() {
            features.push(reading.dror.brightness);
        }
        features
    }

    fn needlets(&self, reading: &Reading) -> Vec<f64> {
        self.with_colour(&reading.needlets, reading.mean)
    }

    fn log_bands(&self, reading: &Reading) -> Vec<f64> {
        self.with_colour(&reading.bands, reading.mean)
    }

    fn with_colour(&self, features: &[f64], mean: [f64; 3]) -> Vec<f64> {
        let mut features = features.to_vec();
        features.extend(chromaticity(mean));
        if self.protocol.knows_exposure() {
            features.push(mean[1].max(1e-12).ln());
        }
        features
    }
}

fn judged_reading(reading: &Reading) -> Result<&JudgedReading> {
    reading.judged.as_ref().ok_or(Error::Undefined {
        of: "a picture that was read to learn from",
        what: "features of the paper",
        reason: "they are read of the pictures that are judged",
    })
}
