//! Which illuminations are of one scene, and so are left out together.

use crate::harmonics::{Coefficients, Transform};
use crate::illumination::{EnvironmentMap, Luminance};
use crate::sphere::Grid;
use crate::{Error, Parallelism, Result};

/// Which illuminations are of one scene: one place, or one map twice.
///
/// Leaving one illumination out says how well a classifier does under light that it has not seen.
/// That holds only where everything of the same scene is left out with it: with a map twice in the
/// folder, its spheres are all but in the set to learn from, and a nearest neighbour is always
/// right. Every loop of this crate that leaves an illumination out, the inner ones too, leaves out
/// its scene.
///
/// An illumination that nothing is said of is a scene of its own, so that the default leaves each
/// out by itself.
///
/// ```
/// use lobes::inference::Scenes;
/// let names = ["hall", "street", "hall at night"];
/// let scenes = Scenes::from_groups(&names, &[["hall at night", "hall"]])?;
/// assert_eq!([0, 1, 2].map(|illumination| scenes.of(illumination)), [0, 1, 0]);
/// assert_eq!(scenes.others(&[true; 3], 2), [false, true, false]);
/// assert!(Scenes::from_groups(&names, &[["hall", "cellar"]]).is_err());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Vec<usize>", into = "Vec<usize>")
)]
pub struct Scenes {
    /// The first illumination of the scene of each; those beyond the end are scenes of their own.
    first: Vec<usize>,
}

/// From the first illumination of the scene of each.
#[cfg(feature = "serde")]
impl TryFrom<Vec<usize>> for Scenes {
    type Error = Error;

    fn try_from(first: Vec<usize>) -> Result<Self> {
        for (illumination, &of) in first.iter().enumerate() {
            if of > illumination || first[of] != of {
                return Err(Error::Domain {
                    what: "the first illumination of a scene",
                    value: of as f64,
                    allowed: "the first of its own scene",
                });
            }
        }
        Ok(Self { first })
    }
}

#[cfg(feature = "serde")]
impl From<Scenes> for Vec<usize> {
    fn from(scenes: Scenes) -> Self {
        scenes.first
    }
}

/// Two maps that look like one, whatever the exposure and however one is turned about the vertical.
///
/// ```
/// use lobes::Parallelism;
/// use lobes::illumination::EnvironmentMap;
/// use lobes::inference::Scenes;
/// // One light, and the same with three times the exposure.
/// let map = |scale: f64| {
///     let pixels = (0..16 * 8).map(|i| [scale * (1.0 + f64::from(i % 16) + f64::from(i / 16)); 3]);
///     EnvironmentMap::new("hall", 16, 8, pixels.collect())
/// };
/// let (scenes, alike) = Scenes::of_maps(&[map(1.0)?, map(3.0)?], Parallelism::Sequential)?;
/// assert_eq!((alike[0].first, alike[0].second), (0, 1));
/// assert!(alike[0].correlation > Scenes::ALIKE);
/// assert_eq!(scenes.of(1), 0);
/// # Ok::<(), lobes::Error>(())
/// ```
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
    /// What is darker than this part of the mean luminance counts as that: no logarithm falls
    /// without end.
    const FLOOR: f64 = 1e-3;

    /// The scenes of illuminations called `names`, where each of `groups` names those of one.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for a name in a group that no illumination has.
    pub fn from_groups<G: AsRef<[S]>, S: AsRef<str>>(
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
    /// Two maps are alike where the logarithms of their luminances, to degree 8 and without their
    /// means, have a correlation above [`ALIKE`](Self::ALIKE) when one is turned about the vertical
    /// in some way. It does not depend on the exposure, the size of the maps or the mapping that
    /// they came in; the logarithm keeps a sun, which a great part of all outdoor maps have, from
    /// deciding alone.
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

/// The largest correlation of two fields without their means over turns about the pole; 0 for a
/// field that does not vary.
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
    use super::*;
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

    /// The seventeen built-in maps: none of the 136 pairs looks like one, and each looks like
    /// itself whatever was done to it.
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
        // docs/how-to/groups.md says so.
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
        let scenes = Scenes::from_groups(&names, &[vec!["e", "d"], vec!["b", "d"]]).unwrap();
        assert_eq!([0, 1, 2, 3, 4].map(|i| scenes.of(i)), [0, 1, 2, 1, 1]);
        assert_eq!(scenes.groups(5), [[1, 3, 4]]);
        assert_eq!(scenes.among(&[true, false, true, true, true]), [0, 1, 2]);
        let more = scenes.and(&Scenes::from_groups(&names, &[["a", "e"]]).unwrap());
        assert_eq!(more.groups(5), [[0, 1, 3, 4]]);
        assert_eq!(more.of(17), 17);
    }
}
