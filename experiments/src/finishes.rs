//! How well the finish of a ball is told off a simulated photograph.

use lobes::features::{Seen, SeenMask, ShadingOutliers};
use lobes::illumination::EnvironmentMap;
use lobes::inference::{
    FinishModel, FinishSample, FinishTruth, FinishVerdict, Portrait, PortraitReader,
};
use lobes::picture::{Circle, Picture, Sphere};
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
    /// What the model in the repository has learned from: 7000 lights, invented ones among them, 20
    /// balls in each, seed 2.
    pub const LEARNED: Self = Self {
        lights: 7000,
        balls: 20,
        seed: 2,
        nuisances: Nuisances {
            invented: true,
            ..Nuisances::ALL
        },
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
    /// Photographs whose circle has its centre and its radius to [`FinishTable::NEAR`] of the radius.
    pub outlined: usize,
    /// By how probable the answer was said to be, in tenths: answers, right ones, and the sum of
    /// their probabilities.
    pub calibration: [(usize, usize, f64); 10],
    /// Of each answer, by how probable it was said to be, in tenths, whether or not it was the
    /// likeliest: photographs, those of which it was the truth, and the sum of the probabilities.
    pub calibration_by_answer: [[(usize, usize, f64); 10]; 5],
    /// How many 90 % intervals there are of σ, of the share and of each channel of the base
    /// colour, and how many of them hold the truth.
    pub intervals: [(usize, usize); 3],
    /// How well prints are found.
    pub prints: PrintTally,
    /// By how much of the ball is usable, in [`FinishTable::USABLE`]: answers, and right ones.
    pub usable: [(usize, usize); 4],
}

/// How well prints are found on balls that are matte or of glossy plastic, without clouds, and of which
/// prints cover between a hundredth and two fifths: places of all of them together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PrintTally {
    /// Balls.
    pub balls: usize,
    /// Places where something is painted.
    pub painted: usize,
    /// Those of them that are said to be a print.
    pub found: usize,
    /// Those of them that are said to be a print, a reflection or clipped.
    pub noticed: usize,
    /// Places that are said to be a print.
    pub said: usize,
    /// Balls of the same kinds without a print.
    pub plain: usize,
    /// The sum of the shares of those that are said to be a print.
    pub false_share: f64,
}

impl PrintTally {
    fn join(&mut self, other: &Self) {
        self.balls += other.balls;
        self.painted += other.painted;
        self.found += other.found;
        self.noticed += other.noticed;
        self.said += other.said;
        self.plain += other.plain;
        self.false_share += other.false_share;
    }

    /// Adds what is said of a photograph of which the ball was found at a circle.
    fn add(&mut self, photograph: &SimulatedPhotograph, circle: Circle, mask: &SeenMask) {
        let of = photograph.truth.finish;
        if !matches!(of, Some(Finish::Matte | Finish::GlossyPlastic)) || photograph.cloudy {
            return;
        }
        let (mut one, mut places) = (Self::default(), 0);
        let place = |index: usize| (2 * index + 1) as f64 / Sphere::SIZE as f64 - 1.0;
        for i in 0..Sphere::SIZE * Sphere::SIZE {
            let (row, column) = (i / Sphere::SIZE, i % Sphere::SIZE);
            let Some(seen) = mask.get(row, column) else {
                continue;
            };
            let (x, y) = (
                circle.x + circle.radius * place(column),
                circle.y + circle.radius * place(row),
            );
            let side = photograph.side;
            let within = x >= 0.0 && y >= 0.0 && (x as usize) < side && (y as usize) < side;
            let painted = within && photograph.painted[y as usize * side + x as usize];
            places += 1;
            one.said += usize::from(seen == Seen::Print);
            one.painted += usize::from(painted);
            one.found += usize::from(painted && seen == Seen::Print);
            one.noticed += usize::from(painted && seen != Seen::Body);
        }
        if one.painted == 0 {
            self.plain += 1;
            self.false_share += one.said as f64 / f64::from(places);
        } else if (0.01..0.4).contains(&(one.painted as f64 / f64::from(places))) {
            self.join(&Self { balls: 1, ..one });
        }
    }
}

impl FinishTable {
    /// How far a circle may be off, by its centre or its radius, as a share of the radius.
    pub const NEAR: f64 = 0.035;

    /// The least usable share of each class of it, from the second on.
    pub const USABLE: [f64; 3] = [0.8, 0.95, 0.99];

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
        self.outlined += other.outlined;
        self.prints.join(&other.prints);
        for (class, of) in self.usable.iter_mut().zip(&other.usable) {
            *class = (class.0 + of.0, class.1 + of.1);
        }
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

/// What is read off each photograph.
struct Readers {
    portraits: PortraitReader,
    outliers: ShadingOutliers,
}

impl Readers {
    fn read(&self, picture: &Picture, circle: Circle) -> Result<(Circle, Portrait, SeenMask)> {
        let sphere = picture.sphere(circle)?;
        let portrait = self.portraits.of_sphere(picture, circle, &sphere)?;
        let mask = self.outliers.of(&sphere.image, sphere.ceiling)?;
        Ok((circle, portrait, mask))
    }
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
    let readers = Readers {
        portraits: PortraitReader::new()?,
        outliers: ShadingOutliers::new(Sphere::SIZE)?,
    };
    let of_lights = parallelism.map(shots.lights, |light| {
        let mut table = FinishTable::default();
        for photograph in shots.of_light(environments, light)? {
            let picture = photograph.picture()?;
            let circle: Result<Circle> = match outline {
                Outline::Told => Ok(photograph.circle),
                Outline::Found => picture.circle(),
            };
            let near = |circle: &Circle| {
                let Circle { x, y, radius } = photograph.outline;
                let centres = (circle.x - x).hypot(circle.y - y);
                centres.max((circle.radius - radius).abs()) < FinishTable::NEAR * radius
            };
            table.outlined += usize::from(circle.as_ref().is_ok_and(near));
            match circle.and_then(|circle| readers.read(&picture, circle)) {
                Ok((circle, portrait, mask)) => {
                    let verdict = model.verdict(&portrait)?;
                    table.add(&photograph.truth, &verdict);
                    table.prints.add(&photograph, circle, &mask);
                    let usable = mask.usable();
                    let above = FinishTable::USABLE.iter().filter(|least| usable >= **least);
                    let class = &mut table.usable[above.count()];
                    class.0 += 1;
                    class.1 += usize::from(verdict.finish() == photograph.truth.finish);
                }
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
