//! σ and the specular share of random reflectances.

use lobes::illumination::EnvironmentMap;
use lobes::inference::{
    EvidenceReader, EvidenceReading, JudgedPosteriors, LearnedPosterior, LogReader, Plan,
    Posterior, RandomReflectances, ReflectanceGrid, Sample, Scenes, collect_random,
};
use lobes::{Parallelism, Result};

use crate::calibration::Calibration;
use crate::protocol::Protocol;

/// What was read off pictures of random reflectances, of [`Protocol::Continuous`].
#[derive(Debug)]
pub struct ContinuousReadings {
    features: Vec<Sample<Vec<f64>>>,
    /// Of those that are judged.
    evidence: Vec<Option<EvidenceReading>>,
    reader: EvidenceReader,
}

impl ContinuousReadings {
    /// Renders and reads the pictures; `done` is called after each map.
    ///
    /// # Errors
    /// Those of [`collect_random`] and of the readers.
    pub fn new(
        maps: &[EnvironmentMap],
        plan: &Plan,
        seed: u64,
        parallelism: Parallelism,
        done: &(dyn Fn() + Sync),
    ) -> Result<Self> {
        let view = Protocol::Continuous.view();
        let reader = LogReader::new(view.viewpoint)?;
        let evidence_reader = EvidenceReader::new(view.viewpoint)?;
        let random = RandomReflectances {
            seed,
            ..RandomReflectances::default()
        };
        let samples = collect_random(
            &view.cameras(plan.turns)?,
            maps,
            &random,
            plan,
            parallelism,
            done,
            &|judged, _, image| {
                let reading = judged.then(|| evidence_reader.read(image));
                Ok((reader.features(image)?, reading.transpose()?))
            },
        )?;
        let (mut features, mut evidence) = (Vec::new(), Vec::new());
        for sample in samples {
            let (view, reading) = sample.view;
            features.push(Sample {
                illumination: sample.illumination,
                judged: sample.judged,
                truth: sample.truth,
                view,
            });
            evidence.push(reading);
        }
        Ok(Self {
            features,
            evidence,
            reader: evidence_reader,
        })
    }

    /// How many pictures there are.
    pub fn count(&self) -> usize {
        self.features.len()
    }

    /// How well what is read knows the truth, each scene left out in turn: by evidence, by what was
    /// learned, and by both. `done` is called after each picture.
    ///
    /// # Errors
    /// What the operator refuses, and too few scenes.
    pub fn judge(
        &self,
        plan: &Plan,
        scenes: &Scenes,
        parallelism: Parallelism,
        done: &(dyn Fn() + Sync),
    ) -> Result<[(&'static str, Calibration); 3]> {
        let grid = ReflectanceGrid::of_view(plan.lobe, self.reader.layout(), parallelism)?;
        let evidence = parallelism.map(self.evidence.len(), |i| {
            done();
            let of = |reading: &EvidenceReading| {
                grid.log_likelihoods(&reading.luminance, &reading.lights)
            };
            self.evidence[i].as_ref().map(of).transpose()
        });
        let evidence = evidence.into_iter().collect::<Result<Vec<_>>>()?;
        let learned = LearnedPosterior::new(
            &self.features,
            &Posterior::default_shares(),
            &Posterior::default_sigmas(),
        )?
        .with_scenes(scenes);
        let results = learned.leave_one_illumination_out(&evidence, parallelism)?;
        let calibration = |of: fn(&JudgedPosteriors) -> &Posterior| {
            let posteriors: Vec<_> = results.iter().map(|r| (r.truth, of(r))).collect();
            Calibration::of(&posteriors)
        };
        Ok([
            ("evidence", calibration(|r| &r.evidence)),
            ("learned", calibration(|r| &r.learned)),
            ("both", calibration(|r| &r.both)),
        ])
    }
}
