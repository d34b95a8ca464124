//! Which illuminations are of one scene, and so are left out together.

use crate::harmonics::{Coefficients, Transform};
use crate::illumination::{EnvironmentMap, Luminance};
use crate::sphere::Grid;
use crate::{Error, Parallelism, Result};

/// Which illuminations are of one scene: one place, or one map twice.
///
/// Leaving one illumination out says how well a classifier does under light that it has not seen. That holds only where
/// everything of the same scene is left out with it: with a map twice in the folder, its spheres are all but in the set
/// to learn from, and a nearest neighbour is always right. Every loop of this crate that leaves an illumination out, the inner ones too, leaves out
/// its scene.
///
/// An illumination that nothing is said of is a scene of its own, so that the default leaves each out by itself.
///
/// ```
/// use lobes::classify::Scenes;
/// let names = ["hall", "street", "hall at night"];
/// let scenes = Scenes::of_groups(&names, &[["hall at night", "hall"]])?;
/// assert_eq!([0, 1, 2].map(|illumination| scenes.of(illumination)), [0, 1, 0]);
/// assert_eq!(scenes.others(&[true; 3], 2), [false, true, false]);
/// assert!(Scenes::of_groups(&names, &[["hall", "cellar"]]).is_err());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Scenes {
    /// The first illumination of the scene of each; those beyond the end are scenes of their own.
    first: Vec<usize>,
}

/// Two maps that look like one, whatever the exposure and however one is turned about the vertical.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alike {
    /// The index of the first.
    pub first: usize,
    /// The index of the second, which is larger.
    pub second: usize,
    /// The largest correlation, over all turns about the vertical.
    pub correlation: f64,
}

impl Scenes {
    /// The correlation above which [`of_maps`](Self::of_maps) takes two maps for one.
    pub const ALIKE: f64 = 0.995;

    /// The degree to which maps are compared.
    const DEGREE: usize = 8;
    /// The rows of the maps that are compared, of twice as many columns.
    const ROWS: usize = 64;
    /// The turns about the vertical that are tried.
    const TURNS: usize = 360;
    /// What is darker than this part of the mean luminance counts as that: no logarithm falls without end.
    const FLOOR: f64 = 1e-3;

    /// The scenes of illuminations called `names`, where each of `groups` names those of one.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for a name in a group that no illumination has.
    pub fn of_groups<G: AsRef<[S]>, S: AsRef<str>>(
        names: &[impl AsRef<str>],
        groups: &[G],
    ) -> Result<Self> {
        let mut scenes = Self::default();
        for group in groups {
            let mut first = None;
            for name in group.as_ref() {
                let of = names.iter().position(|n| n.as_ref() == name.as_ref());
                let of = of.ok_or_else(|| Error::UnknownName {
                    what: "map",
                    name: name.as_ref().to_owned(),
                    names: names.iter().map(|n| n.as_ref().to_owned()).collect(),
                })?;
                scenes.join(*first.get_or_insert(of), of);
            }
        }
        Ok(scenes)
    }

    /// The scenes of maps, where those that look alike are of one, and which those are.
    ///
    /// Two maps are alike where the logarithms of their luminances, to degree 8 and without their means, have a correlation
    /// above [`ALIKE`](Self::ALIKE) when one is turned about the vertical in some way. It does not depend on the exposure, the size of the maps or the mapping that they
    /// came in; the logarithm keeps a sun, which a great part of all outdoor maps have, from deciding alone.
    ///
    /// # Errors
    /// [`Error::SameLight`] for two maps of the same pixels.
    pub fn of_maps(
        maps: &[EnvironmentMap],
        parallelism: Parallelism,
    ) -> Result<(Self, Vec<Alike>)> {
        for (second, map) in maps.iter().enumerate() {
            if let Some(same) = maps[..second].iter().find(|m| m.pixels() == map.pixels()) {
                return Err(Error::SameLight {
                    first: same.name().to_owned(),
                    second: map.name().to_owned(),
                });
            }
        }
        let transform = Transform::new(&Grid::lat_long(Self::ROWS, 2 * Self::ROWS)?, Self::DEGREE)?;
        let low = parallelism
            .map(maps.len(), |i| transform.analyse(&logarithms(&maps[i])?))
            .into_iter()
            .collect::<Result<Vec<_>>>()?;
        let pairs: Vec<(usize, usize)> = (0..maps.len())
            .flat_map(|second| (0..second).map(move |first| (first, second)))
            .collect();
        let mut alike = Vec::new();
        let mut scenes = Self::default();
        let correlations = parallelism.map(pairs.len(), |i| {
            correlation(&low[pairs[i].0], &low[pairs[i].1])
        });
        for ((first, second), correlation) in pairs.into_iter().zip(correlations) {
            if correlation > Self::ALIKE {
                scenes.join(first, second);
                alike.push(Alike {
                    first,
                    second,
                    correlation,
                });
            }
        }
        Ok((scenes, alike))
    }

    /// These scenes, with those made one that share an illumination in `other`.
    #[must_use]
    pub fn and(mut self, other: &Self) -> Self {
        for (illumination, &first) in other.first.iter().enumerate() {
            self.join(first, illumination);
        }
        self
    }

    /// Makes one scene of those of two illuminations.
    fn join(&mut self, a: usize, b: usize) {
        let (a_first, b_first) = (self.of(a), self.of(b));
        let (low, high) = (a_first.min(b_first), a_first.max(b_first));
        while self.first.len() <= a.max(b) {
            self.first.push(self.first.len());
        }
        for first in &mut self.first {
            if *first == high {
                *first = low;
            }
        }
    }

    /// The scene of an illumination, named by the first illumination in it.
    pub fn of(&self, illumination: usize) -> usize {
        self.first
            .get(illumination)
            .copied()
            .unwrap_or(illumination)
    }

    /// The scenes that the illuminations which are `seen` belong to, rising.
    pub fn among(&self, seen: &[bool]) -> Vec<usize> {
        let all = (0..seen.len()).filter(|&i| seen[i]);
        let mut scenes: Vec<usize> = all.map(|i| self.of(i)).collect();
        scenes.sort_unstable();
        scenes.dedup();
        scenes
    }

    /// What of `seen` remains when the scene of an illumination is left out.
    pub fn others(&self, seen: &[bool], illumination: usize) -> Vec<bool> {
        let scene = self.of(illumination);
        let kept = seen.iter().enumerate();
        kept.map(|(i, seen)| *seen && self.of(i) != scene).collect()
    }

    /// The scenes of more than one of the first `count` illuminations: the indices of each.
    pub fn groups(&self, count: usize) -> Vec<Vec<usize>> {
        let of = |scene: usize| (0..count).filter(move |&i| self.of(i) == scene);
        (0..count)
            .map(|scene| of(scene).collect())
            .filter(|group: &Vec<usize>| group.len() > 1)
            .collect()
    }
}

/// The logarithms of a map's luminance as means of 64 by 128 cells.
fn logarithms(map: &EnvironmentMap) -> Result<Vec<f64>> {
    let cells = map.resampled(2 * Scenes::ROWS, Scenes::ROWS)?;
    let floor = Scenes::FLOOR * Luminance::Rec709.of(map.mean());
    let mut cells = cells.luminance(Luminance::Rec709);
    for cell in &mut cells {
        *cell = cell.max(floor).ln();
    }
    Ok(cells)
}

/// The largest correlation of two fields without their means over turns about the pole; 0 for a field that does not vary.
fn correlation(a: &Coefficients, b: &Coefficients) -> f64 {
    // Turned by α, Σ_l a_lm* b_lm of each order goes round by e^(imα).
    let mut norms = [0.0; 2];
    let mut orders = Vec::with_capacity(a.orders() + 1);
    for m in 0..=a.orders() {
        // The mean is no part of the pattern.
        let skip = usize::from(m == 0);
        let (c, s) = (&a.cosine(m)[skip..], a.sine(m));
        let (p, q) = (&b.cosine(m)[skip..], b.sine(m));
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        norms[0] += dot(c, c) + dot(s, s);
        norms[1] += dot(p, p) + dot(q, q);
        orders.push((dot(c, p) + dot(s, q), dot(c, q) - dot(s, p)));
    }
    let scale = (norms[0] * norms[1]).sqrt();
    if scale <= f64::MIN_POSITIVE {
        return 0.0;
    }
    let at = |turn: usize| {
        let angle = std::f64::consts::TAU * turn as f64 / Scenes::TURNS as f64;
        let turned = orders.iter().enumerate().map(|(m, (even, odd))| {
            let (sin, cos) = (m as f64 * angle).sin_cos();
            even * cos + odd * sin
        });
        turned.sum::<f64>() / scale
    };
    (0..Scenes::TURNS).map(at).fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(all(test, feature = "builtin"))]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::classify::{
        Dataset, Expert, LearnedPosterior, NearestNeighbour, Observation, Reflectance, Sample,
        Stack, leave_one_illumination_out,
    };
    use crate::glam::DVec3;
    use crate::illumination::builtin;
    use crate::sphere::Mapping;

    fn low(map: &EnvironmentMap) -> Coefficients {
        let grid = Grid::lat_long(Scenes::ROWS, 2 * Scenes::ROWS).unwrap();
        let transform = Transform::new(&grid, Scenes::DEGREE).unwrap();
        transform.analyse(&logarithms(map).unwrap()).unwrap()
    }

    /// The same light as pixels of another size, turned about the vertical, its exposure changed.
    fn turned(map: &EnvironmentMap, height: usize, angle: f64) -> EnvironmentMap {
        let (sin, cos) = angle.sin_cos();
        let fine = EnvironmentMap::new("fine", 1024, 512, vec![[1.0; 3]; 1024 * 512]).unwrap();
        let pixels = (0..1024 * 512).map(|i| {
            let d = fine.direction(i / 1024, i % 1024);
            let d = DVec3::new(cos * d.x + sin * d.z, d.y, cos * d.z - sin * d.x);
            map.radiance(d).map(|value| 3.7 * value)
        });
        let turned = EnvironmentMap::new("turned", 1024, 512, pixels.collect()).unwrap();
        turned.resampled(2 * height, height).unwrap()
    }

    /// The same light as Debevec's square probes have it.
    fn probe(map: &EnvironmentMap, side: usize) -> EnvironmentMap {
        let mapping = Mapping::AngularMap;
        let pixels = (0..side * side).map(|i| {
            let (row, column) = (i / side, i % side);
            let at = |place: usize| (place as f64 + 0.5) / side as f64;
            mapping
                .direction(at(column), at(row))
                .map_or([0.0; 3], |d| map.radiance(d))
        });
        EnvironmentMap::from_picture("probe", mapping, side, side, pixels.collect()).unwrap()
    }

    /// The seventeen built-in maps: none of the 136 pairs looks like one, and each looks like itself whatever was done to it.
    #[test]
    fn the_same_light_is_told_from_other_light() {
        let maps = builtin().unwrap();
        let lows: Vec<_> = maps.iter().map(low).collect();
        let mut most_alike = (0.0, "", "");
        for (i, (map, own)) in maps.iter().zip(&lows).enumerate() {
            for (other, low) in maps.iter().zip(&lows).take(i) {
                let found = correlation(low, own);
                if found > most_alike.0 {
                    most_alike = (found, other.name(), map.name());
                }
            }
            for (what, same) in [
                ("smaller", turned(map, 64, 0.0)),
                ("turned", turned(map, 256, 1.2345)),
                ("both", turned(map, 128, 2.0)),
                ("clipped", map.clipped(0.002).unwrap()),
                ("a probe", probe(map, 256)),
            ] {
                let found = correlation(own, &low(&same));
                assert!(found > Scenes::ALIKE, "{} {what}: {found}", map.name());
            }
        }
        // docs/groups.md says so.
        assert_eq!(
            (most_alike.1, most_alike.2),
            ("blender-night", "pmndrs-night")
        );
        assert!((0.92..0.94).contains(&most_alike.0), "{most_alike:?}");
    }

    #[test]
    fn the_same_pixels_are_refused_and_the_same_light_is_one_scene() {
        let maps = builtin().unwrap();
        let one = Parallelism::Sequential;
        let mut few = vec![maps[0].clone(), maps[1].clone(), turned(&maps[0], 200, 0.7)];
        let (scenes, alike) = Scenes::of_maps(&few, one).unwrap();
        assert_eq!([0, 1, 2].map(|i| scenes.of(i)), [0, 1, 0]);
        assert_eq!(alike.len(), 1);
        assert_eq!((alike[0].first, alike[0].second), (0, 2));
        let renamed = maps[1].pixels().to_vec();
        few.push(EnvironmentMap::new("copy", 512, 256, renamed).unwrap());
        let error = Scenes::of_maps(&few, one).unwrap_err();
        let expected = Error::SameLight {
            first: maps[1].name().into(),
            second: "copy".into(),
        };
        assert_eq!(error, expected);
        // Light that does not vary is like no other.
        let grey = |value: f64| EnvironmentMap::new("grey", 8, 4, vec![[value; 3]; 32]).unwrap();
        let (_, alike) = Scenes::of_maps(&[grey(1.0), grey(2.0)], one).unwrap();
        assert_eq!(alike, []);
    }

    #[test]
    fn groups_that_share_a_map_are_one() {
        let names = ["a", "b", "c", "d", "e"];
        let scenes = Scenes::of_groups(&names, &[vec!["e", "d"], vec!["b", "d"]]).unwrap();
        assert_eq!([0, 1, 2, 3, 4].map(|i| scenes.of(i)), [0, 1, 2, 1, 1]);
        assert_eq!(scenes.groups(5), [[1, 3, 4]]);
        assert_eq!(scenes.among(&[true, false, true, true, true]), [0, 1, 2]);
        let more = scenes.and(&Scenes::of_groups(&names, &[["a", "e"]]).unwrap());
        assert_eq!(more.groups(5), [[0, 1, 3, 4]]);
        assert_eq!(more.of(17), 17);
    }

    /// Pictures whose light decides almost everything: of each illumination of `places` (equal numbers are one map twice), one of each
    /// of two materials.
    fn pictures(places: &[u64], scenes: Scenes) -> Dataset<Vec<f64>> {
        let mut observations = Vec::new();
        for (illumination, &place) in places.iter().enumerate() {
            let mut rng = Pcg64::seed_from_u64(place);
            let light: Vec<f64> = (0..3).map(|_| 10.0 * rng.random::<f64>()).collect();
            for material in 0..2 {
                let mut view = light.clone();
                view[0] += 0.2 * material as f64;
                view[1] += 0.1 * rng.random::<f64>();
                observations.push(Observation {
                    material,
                    illumination,
                    turn: 0,
                    view,
                });
            }
        }
        Dataset {
            materials: vec!["a".into(), "b".into()],
            illuminations: places.iter().map(u64::to_string).collect(),
            scenes,
            observations,
            render_error: 0.0,
        }
    }

    /// Every map twice: a nearest neighbour is always right, and no better than without the copies once they are left out too.
    #[test]
    fn maps_that_stand_twice_leak_and_scenes_do_not() {
        let once: Vec<u64> = (0..12).collect();
        let twice: Vec<u64> = once.iter().flat_map(|&place| [place, place]).collect();
        let groups: Vec<[String; 2]> = (0..12)
            .map(|i| [format!("{}", 2 * i), format!("{}", 2 * i + 1)])
            .collect();
        let names: Vec<String> = (0..24).map(|i| i.to_string()).collect();
        let pairs = Scenes::of_groups(&names, &groups).unwrap();
        let accuracy = |data: &Dataset<Vec<f64>>| {
            let features = data.observations.iter().map(|o| o.view.clone()).collect();
            let nearest = NearestNeighbour::plain(features, &data.labels(), 2).unwrap();
            let one = Parallelism::Sequential;
            leave_one_illumination_out(&nearest, &data.labels(), &data.groups(), 2, one)
                .unwrap()
                .accuracy()
        };
        let honest = accuracy(&pictures(&once, Scenes::default()));
        assert!(honest < 0.8, "the light decides: {honest}");
        assert_eq!(accuracy(&pictures(&twice, Scenes::default())), 1.0);
        assert_eq!(accuracy(&pictures(&twice, pairs)), honest);
    }

    /// Refuses to judge a picture of a place that it has seen.
    struct Honest<'a> {
        places: &'a [u64],
        data: &'a Dataset<Vec<f64>>,
    }

    impl Expert for Honest<'_> {
        fn name(&self) -> String {
            "honest".into()
        }

        fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
            for &i in observations {
                let place = self.places[self.data.observations[i].illumination];
                let known = |(j, other): (usize, &u64)| seen[j] && *other == place;
                if self.places.iter().enumerate().any(known) {
                    return Err(Error::Unanswerable(format!("place {place} was seen")));
                }
            }
            Ok(vec![vec![0.0; 2]; observations.len()])
        }
    }

    #[test]
    fn inner_loops_leave_scenes_out() {
        let places = [1, 2, 3, 1, 2, 3];
        let names: Vec<String> = (0..6).map(|i| i.to_string()).collect();
        let groups = [["0", "3"], ["1", "4"], ["2", "5"]];
        let pairs = Scenes::of_groups(&names, &groups).unwrap();
        let run = |scenes: &Scenes| {
            let data = pictures(&places, scenes.clone());
            let honest = Honest {
                places: &places,
                data: &data,
            };
            let stack = Stack::new(&data, vec![&honest as &dyn Expert]);
            let one = Parallelism::Sequential;
            leave_one_illumination_out(&stack, &data.labels(), &data.groups(), 2, one)
        };
        assert!(run(&pairs).is_ok());
        assert!(run(&Scenes::default()).is_err());
        // Of two scenes a fold has one, and the inner loop needs two.
        let few = Scenes::of_groups(&names, &[vec!["0", "3", "1", "4"], vec!["2", "5"]]).unwrap();
        assert!(run(&few).is_err());
    }

    /// A posterior learned from samples that stand twice, their copies left out with them, is the posterior learned from them once.
    #[test]
    fn posteriors_leave_scenes_out() {
        let samples = |copies: usize| -> Vec<Sample<Vec<f64>>> {
            let mut samples = Vec::new();
            for copy in 0..copies {
                for place in 0..4 {
                    let mut rng = Pcg64::seed_from_u64(place as u64);
                    let light: f64 = rng.random();
                    for i in 0..60 {
                        let truth = Reflectance {
                            share: rng.random(),
                            sigma: 0.02 + 0.28 * rng.random::<f64>(),
                        };
                        let noise = |rng: &mut Pcg64| 0.1 * rng.random::<f64>();
                        let view = vec![
                            truth.sigma.ln() + light + noise(&mut rng),
                            truth.share + light + noise(&mut rng),
                        ];
                        samples.push(Sample {
                            illumination: place + 4 * copy,
                            judged: i % 10 == 0 && copy == 0,
                            truth,
                            view,
                        });
                    }
                }
            }
            samples
        };
        let groups: Vec<[String; 2]> = (0..4)
            .map(|i| [i.to_string(), (i + 4).to_string()])
            .collect();
        let names: Vec<String> = (0..8).map(|i| i.to_string()).collect();
        let pairs = Scenes::of_groups(&names, &groups).unwrap();
        let medians = |copies: usize, scenes: &Scenes| -> Vec<f64> {
            let samples = samples(copies);
            let learned = LearnedPosterior::new(
                &samples,
                &LearnedPosterior::shares(),
                &LearnedPosterior::sigmas(),
            )
            .unwrap()
            .with_scenes(scenes);
            let grid = LearnedPosterior::shares().len() * LearnedPosterior::sigmas().len();
            let evidence: Vec<Option<Vec<f64>>> = samples
                .iter()
                .map(|sample| sample.judged.then(|| vec![0.0; grid]))
                .collect();
            let results = learned
                .leave_one_illumination_out(&evidence, Parallelism::Sequential)
                .unwrap();
            results
                .iter()
                .map(|r| r.learned.sigma_quantile(0.5))
                .collect()
        };
        let once = medians(1, &Scenes::default());
        let off = |other: &[f64]| {
            let pairs = once.iter().zip(other);
            pairs.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
        };
        assert_eq!(once.len(), 24);
        assert!(off(&medians(2, &pairs)) < 1e-6);
        assert!(off(&medians(2, &Scenes::default())) > 1e-3);
    }
}
