//! How well the finish of a ball is told off a simulated photograph.

use lobes::illumination::EnvironmentMap;
use lobes::inference::{FinishModel, FinishSample, FinishTruth, FinishVerdict, PortraitReader};
use lobes::picture::Circle;
use lobes::reflectance::Finish;
use lobes::{Error, Parallelism, Result};

use crate::simulation::{Nuisances, SimulatedPhotograph, Thing, simulate, simulate_thing};

/// Which simulated photographs are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FinishShots {
    /// In how many lights.
    pub lights: usize,
    /// How many balls in each.
    pub balls: usize,
    /// The generator's seed.
    pub seed: u64,
    /// What makes them hard to read.
    pub nuisances: Nuisances,
}

impl FinishShots {
    /// What the model in the repository has learned from: 3000 lights, 44 balls in each, seed 2.
    pub const LEARNED: Self = Self {
        lights: 3000,
        balls: 44,
        seed: 2,
        nuisances: Nuisances::ALL,
    };

    /// What it is judged on: 150 lights, 4 balls in each, seed 77.
    pub const JUDGED: Self = Self {
        lights: 150,
        balls: 4,
        seed: 77,
        nuisances: Nuisances::ALL,
    };

    /// The photographs of one light.
    fn of_light(
        &self,
        environments: &[EnvironmentMap],
        light: usize,
    ) -> Result<Vec<SimulatedPhotograph>> {
        let seed = self.seed.wrapping_mul(1_000_000).wrapping_add(light as u64);
        simulate(environments, self.nuisances, seed, self.balls)
    }
}

/// The maps that a model of finishes learns from, and those that it is judged under: every fourth,
/// from the first on.
pub fn learned_and_judged(maps: Vec<EnvironmentMap>) -> (Vec<EnvironmentMap>, Vec<EnvironmentMap>) {
    let numbered = maps.into_iter().enumerate();
    let (judged, learned): (Vec<_>, Vec<_>) = numbered.partition(|(i, _)| i % 4 == 0);
    let maps = |of: Vec<(usize, EnvironmentMap)>| of.into_iter().map(|(_, map)| map).collect();
    (maps(learned), maps(judged))
}

/// Samples to learn from; `done` is called after each light.
///
/// Photographs in which the ball cannot be read, black or saturated, are left out.
///
/// # Errors
/// What the renderer finds wrong.
pub fn finish_samples(
    environments: &[EnvironmentMap],
    shots: &FinishShots,
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<FinishSample>> {
    let reader = PortraitReader::new()?;
    let of_lights = parallelism.map(shots.lights, |light| {
        let mut samples = Vec::new();
        for photograph in shots.of_light(environments, light)? {
            match reader.read(&photograph.picture()?, photograph.circle) {
                Ok(portrait) => samples.push(FinishSample {
                    portrait,
                    truth: photograph.truth,
                }),
                Err(error) if unreadable(&error) => {}
                Err(error) => return Err(error),
            }
        }
        done();
        Ok(samples)
    });
    let mut samples = Vec::new();
    for of_light in of_lights {
        samples.extend(of_light?);
    }
    Ok(samples)
}

/// Whether an error says that the photograph shows no ball that can be read.
fn unreadable(error: &Error) -> bool {
    matches!(
        error,
        Error::Black { .. }
            | Error::Saturated { .. }
            | Error::NoSphere { .. }
            | Error::CircleOutside { .. }
            | Error::TooSmall { .. }
    )
}

/// The mean of −ln of the probability that a model gives to the true finish of each sample.
///
/// # Errors
/// [`Error::Empty`] without a sample.
pub fn finish_cross_entropy(
    model: &FinishModel,
    samples: &[FinishSample],
    parallelism: Parallelism,
) -> Result<f64> {
    if samples.is_empty() {
        return Err(Error::Empty {
            what: "a mean over samples",
            needs: "a sample",
        });
    }
    let of = parallelism.map(samples.len(), |i| {
        let verdict = model.verdict(&samples[i].portrait)?;
        let place = place(samples[i].truth.finish);
        let p = verdict.finishes.get(place).copied().unwrap_or(verdict.none);
        Ok(-p.max(f64::MIN_POSITIVE).ln())
    });
    let sum: f64 = of.into_iter().sum::<Result<f64>>()?;
    Ok(sum / samples.len() as f64)
}

/// The place of a finish among the answers: the last is "no single finish".
fn place(finish: Option<Finish>) -> usize {
    finish.map_or(Finish::ALL.len(), Finish::index)
}

/// How a model did on photographs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FinishTable {
    /// By truth, then by answer: the four finishes, and "no single finish".
    pub confusion: [[usize; 5]; 5],
    /// Photographs whose ball was not found or not read: they count as wrong.
    pub unread: usize,
    /// By how probable the answer was said to be, in tenths: answers, right ones, and the sum of
    /// their probabilities.
    pub calibration: [(usize, usize, f64); 10],
    /// Of each answer, by how probable it was said to be, in tenths, whether or not it was the
    /// likeliest: photographs, those of which it was the truth, and the sum of the probabilities.
    pub calibration_by_answer: [[(usize, usize, f64); 10]; 5],
    /// How many 90 % intervals there are of σ, of the share and of each channel of the base
    /// colour, and how many of them hold the truth.
    pub intervals: [(usize, usize); 3],
}

impl FinishTable {
    /// How many photographs there are.
    pub fn count(&self) -> usize {
        self.confusion.iter().flatten().sum::<usize>() + self.unread
    }

    /// How many were answered right.
    pub fn right(&self) -> usize {
        (0..5).map(|i| self.confusion[i][i]).sum()
    }

    /// How many answers had a probability of at least 0.9, and how many of those are right.
    pub fn sure(&self) -> (usize, usize) {
        (self.calibration[9].0, self.calibration[9].1)
    }

    fn add(&mut self, truth: &FinishTruth, verdict: &FinishVerdict) {
        let (truly, said) = (place(truth.finish), place(verdict.finish()));
        self.confusion[truly][said] += 1;
        let probability = verdict.probability();
        let tenth = &mut self.calibration[((10.0 * probability) as usize).min(9)];
        tenth.0 += 1;
        tenth.1 += usize::from(truly == said);
        tenth.2 += probability;
        let probabilities = verdict.finishes.into_iter().chain([verdict.none]);
        for (answer, probability) in probabilities.enumerate() {
            let tenth = ((10.0 * probability) as usize).min(9);
            let tenth = &mut self.calibration_by_answer[answer][tenth];
            tenth.0 += 1;
            tenth.1 += usize::from(truly == answer);
            tenth.2 += probability;
        }
        let mut interval = |which: usize, truth: f64, [low, high]: [f64; 2]| {
            self.intervals[which].0 += 1;
            self.intervals[which].1 += usize::from((low..=high).contains(&truth));
        };
        for (which, truth, posterior) in [
            (0, truth.sigma, &verdict.sigma),
            (1, truth.share, &verdict.share),
        ] {
            if let Some(truth) = truth {
                let [low, _, high] = posterior.interval(0.9);
                interval(which, truth, [low, high]);
            }
        }
        if let Some(colour) = truth.base_colour {
            for (truth, [low, high]) in colour.into_iter().zip(verdict.base_colour_interval()) {
                // What is darker than 0.01 is as good as black, in learning too.
                interval(2, truth.max(0.01), [low, high.max(0.01)]);
            }
        }
    }

    fn join(&mut self, other: &Self) {
        for (row, of) in self.confusion.iter_mut().zip(&other.confusion) {
            for (count, of) in row.iter_mut().zip(of) {
                *count += of;
            }
        }
        self.unread += other.unread;
        let mine = self.calibration_by_answer.as_flattened_mut().iter_mut();
        let theirs = other.calibration_by_answer.as_flattened();
        let all = self.calibration.iter_mut().chain(mine);
        for (tenth, of) in all.zip(other.calibration.iter().chain(theirs)) {
            *tenth = (tenth.0 + of.0, tenth.1 + of.1, tenth.2 + of.2);
        }
        for (held, of) in self.intervals.iter_mut().zip(&other.intervals) {
            *held = (held.0 + of.0, held.1 + of.1);
        }
    }
}

/// Whether the reader is told where the ball is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outline {
    /// It is told, as well as [`Nuisances::outline`] says.
    Told,
    /// It finds the ball itself.
    Found,
}

/// Judges a model on simulated photographs; `done` is called after each light.
///
/// # Errors
/// What the renderer finds wrong.
pub fn judge_finishes(
    model: &FinishModel,
    environments: &[EnvironmentMap],
    shots: &FinishShots,
    outline: Outline,
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
) -> Result<FinishTable> {
    let reader = PortraitReader::new()?;
    let of_lights = parallelism.map(shots.lights, |light| {
        let mut table = FinishTable::default();
        for photograph in shots.of_light(environments, light)? {
            let picture = photograph.picture()?;
            let circle: Result<Circle> = match outline {
                Outline::Told => Ok(photograph.circle),
                Outline::Found => picture.circle(),
            };
            match circle.and_then(|circle| reader.read(&picture, circle)) {
                Ok(portrait) => table.add(&photograph.truth, &model.verdict(&portrait)?),
                Err(error) if unreadable(&error) => table.unread += 1,
                Err(error) => return Err(error),
            }
        }
        done();
        Ok(table)
    });
    let mut table = FinishTable::default();
    for of_light in of_lights {
        table.join(&of_light?);
    }
    Ok(table)
}

/// What was said of pictures without a ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ThingTally {
    /// What they show.
    pub thing: Thing,
    /// How many pictures there are.
    pub pictures: usize,
    /// In how many of them something round was taken for the outline of a ball.
    pub found: usize,
    /// Of how many of these a finish was told, and not "no single finish": the false alarms.
    pub told: usize,
}

/// Tries a model on pictures without a ball, so many of each kind; `done` is called after each kind.
///
/// # Errors
/// What the renderer finds wrong.
pub fn judge_things(
    model: &FinishModel,
    environments: &[EnvironmentMap],
    each: usize,
    seed: u64,
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<ThingTally>> {
    let reader = PortraitReader::new()?;
    let tallies = Thing::ALL.into_iter().enumerate().map(|(kind, thing)| {
        let said = parallelism.map(each, |i| {
            let seed = seed.wrapping_mul(1_000_000) + (kind * each + i) as u64;
            let picture = simulate_thing(environments, thing, seed)?;
            let read = picture
                .circle()
                .and_then(|circle| reader.read(&picture, circle));
            match read {
                Ok(portrait) => Ok(Some(model.verdict(&portrait)?.finish())),
                Err(error) if unreadable(&error) => Ok(None),
                Err(error) => Err(error),
            }
        });
        let said = said.into_iter().collect::<Result<Vec<_>>>()?;
        done();
        Ok(ThingTally {
            thing,
            pictures: each,
            found: said.iter().flatten().count(),
            told: said.iter().flatten().flatten().count(),
        })
    });
    tallies.collect()
}
