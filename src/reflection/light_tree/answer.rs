//! Radiances, each with its bound.

use fearless_simd::{dispatch, prelude::*};
use glam::DVec3;

use super::descent::Workspace;
use super::ggx_lobe::{Facets, GgxLobe};
use super::lobe::{FunctionLobe, LambertLobe, Lobe};
use super::opening::LEBESGUE;
use super::tree::LightTree;
use super::ward_lobe::WardLobe;
use crate::reflectance::{Fresnel, GgxMaterial, Ward};
use crate::reflection::renderer::check_unit;
use crate::reflection::{Camera, Settings, ShadingPoint, SphereImage, Surface};
use crate::sphere::to_map;
use crate::{Error, Parallelism, Result};

/// A radiance and what its error does not pass.
///
/// ```
/// use lobes::illumination::EnvironmentMap;
/// use lobes::reflectance::{Material, Variant};
/// use lobes::reflection::{LightTree, ShadingPoint, Surface};
/// use lobes::{Parallelism, glam::DVec3};
/// let map = EnvironmentMap::new("grey", 32, 16, vec![[2.0; 3]; 512])?;
/// let tree = LightTree::new(&map, Parallelism::Sequential)?;
/// let point = ShadingPoint { normal: DVec3::Y, view: DVec3::Y };
/// let white = Material::white();
/// let surface = Surface::Ward(&white, Variant::Duer);
/// let seen = tree.radiance(surface, &[point], 1e-4, Parallelism::Sequential)?[0];
/// // White under the same light from everywhere: the light itself.
/// assert!((seen.value[0] - 2.0).abs() <= seen.bound && seen.bound <= 2e-4);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bounded {
    /// The radiance of each channel.
    pub value: [f64; 3],
    /// No channel is off by more.
    pub bound: f64,
}

/// A picture of a sphere and what the error of each pixel does not pass.
///
/// ```
/// use lobes::illumination::EnvironmentMap;
/// use lobes::reflectance::{Fresnel, GgxMaterial};
/// use lobes::reflection::{Camera, LightTree, Settings, Surface};
/// use lobes::{Parallelism, glam::DVec3};
/// let map = EnvironmentMap::new("even", 32, 16, vec![[1.0; 3]; 512])?;
/// let tree = LightTree::new(&map, Parallelism::Sequential)?;
/// let glass = [Fresnel::Dielectric { index: 1.5 }; 3];
/// let plastic = GgxMaterial::new("plastic", [0.5; 3], 0.3, glass)?;
/// let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// let settings = Settings { size: 8, ..Settings::default() };
/// let picture = tree.render(Surface::Ggx(&plastic), &camera, &settings, Parallelism::Sequential)?;
/// let (seen, bound) = (picture.image.get(4, 4).unwrap(), picture.bounds.get(4, 4).unwrap());
/// // The body, and of the facets some 4 %.
/// assert!(seen[0] > 0.5 && seen[0] < 0.56 && bound[0] <= 1e-3 * seen[0]);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct BoundedImage {
    /// The picture.
    pub image: SphereImage,
    /// No channel of the picture's pixel is off by more; the three channels are the same.
    pub bounds: SphereImage,
    /// The least radiance that an error is relative to.
    floor: f64,
}

impl BoundedImage {
    /// The largest bound over the mean of its pixel's channels, or over a hundredth of what a white
    /// surface would show under the map's mean radiance, if that is larger; at most the tolerance
    /// that was asked where a pixel is one point, and twice that where it is several, some of which
    /// may be dark.
    pub fn relative_bound(&self) -> f64 {
        let size = self.image.size();
        let relative = (0..size * size).filter_map(|at| {
            let value = self.image.get(at / size, at % size)?;
            let [bound, ..] = self.bounds.get(at / size, at % size)?;
            Some(bound / mean(&value).max(self.floor))
        });
        relative.fold(0.0, f64::max)
    }
}

/// The specular part of a surface.
enum Specular<'a> {
    None,
    /// What it reflects as a mirror, by the cosine of the view.
    Mirror([Fresnel; 3]),
    Ward(Ward, [f64; 3]),
    Ggx(&'a GgxMaterial, Facets),
}

impl<'a> Specular<'a> {
    fn new(surface: Surface<'a>) -> Self {
        match surface {
            Surface::Ward(material, _) if material.is_matte() => Self::None,
            Surface::Ward(material, variant) => match material.lobe(variant) {
                Some(ward) => Self::Ward(ward, material.specular()),
                None => Self::Mirror(material.specular().map(Fresnel::Constant)),
            },
            Surface::Ggx(material) if material.alpha()[0] == 0.0 => {
                Self::Mirror(material.fresnel())
            }
            Surface::Ggx(material) => Self::Ggx(material, Facets::new(material.fresnel())),
        }
    }
}

/// What is wanted of a part of a radiance.
#[derive(Debug, Clone, Copy)]
struct Goal {
    tolerance: f64,
    /// The least radiance that the error is relative to.
    floor: f64,
    /// What the lobe is multiplied by.
    albedo: [f64; 3],
    /// What is there beside it, as the mean of the channels, and its bound.
    beside: f64,
    spent: f64,
}

/// What the last point took: where the next begins. It changes how long an answer takes, never
/// whether its bound holds.
#[derive(Debug, Clone, Copy)]
struct Pace {
    /// The mean of the channels.
    value: f64,
    /// What a value of the lobe is worth, as a share of the bound.
    price: f64,
}

/// Points that share a pace: always the same, so that answers do not depend on the number of
/// threads.
const BLOCK: usize = 64;

/// How often a price is tried.
const TRIES: usize = 60;

/// The error of the arithmetic of the bound itself.
const SLACK: f64 = 1.0 + 1e-9;

/// The relative rounding of the weights and of the sums over them.
const WEIGHTS: f64 = 1e-13;

/// The error is relative to this share of the map's mean radiance, where a radiance is less.
const FLOOR: f64 = 0.01;

impl LightTree {
    /// The radiance that each point sees, with an error of at most `tolerance` times the mean of
    /// its channels, or times a hundredth of what a white surface would show under the map's mean
    /// radiance, if that is larger. A view below the horizon sees black.
    ///
    /// The bound of each radiance is proven (docs/reference/rendering-bound.md), and never above
    /// what is asked. The time of one is 20 to 500 µs for 10⁻³ on one core, of GGX 130 to 500 µs, and
    /// grows about as the logarithm of 1/`tolerance`; more for lobes that jump at the horizon, and
    /// much more for Ward's own lobe (`ward1992`), which has a root there.
    ///
    /// # Errors
    /// [`Error::Domain`] if the tolerance is not in [10⁻⁹, 0.1], or a normal or a view is not of
    /// unit length; [`Error::Tolerance`] where rounding allows no such tolerance, or a lobe that
    /// ends in a root at the horizon would take more than memory.
    pub fn radiance(
        &self,
        surface: Surface<'_>,
        points: &[ShadingPoint],
        tolerance: f64,
        parallelism: Parallelism,
    ) -> Result<Vec<Bounded>> {
        self.radiance_with(surface, points, tolerance, parallelism, &|_| {})
    }

    /// As [`radiance`](Self::radiance), and tells of how many points more there are answers, from
    /// any thread.
    fn radiance_with(
        &self,
        surface: Surface<'_>,
        points: &[ShadingPoint],
        tolerance: f64,
        parallelism: Parallelism,
        tell: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Bounded>> {
        check_tolerance(tolerance)?;
        for point in points {
            check_unit(point.normal)?;
            check_unit(point.view)?;
        }
        let specular = Specular::new(surface);
        let blocks = parallelism.map(points.len().div_ceil(BLOCK), |block| {
            let mut work = Workspace::default();
            let mut paces = [Pace::new(self); 2];
            let points = &points[block * BLOCK..((block + 1) * BLOCK).min(points.len())];
            let answers = points
                .iter()
                .map(|point| {
                    let diffuse = surface.diffuse();
                    self.point(diffuse, &specular, point, tolerance, &mut paces, &mut work)
                })
                .collect::<Result<Vec<_>>>();
            tell(points.len());
            answers
        });
        let blocks = blocks.into_iter().collect::<Result<Vec<_>>>()?;
        Ok(blocks.concat())
    }

    /// A picture of a sphere, each point of each pixel as [`radiance`](Self::radiance) has it. The
    /// bound of a pixel is the mean of those of its points.
    ///
    /// # Errors
    /// As [`radiance`](Self::radiance), and [`Error::Domain`] if a size is outside its domain.
    pub fn render(
        &self,
        surface: Surface<'_>,
        camera: &Camera,
        settings: &Settings,
        parallelism: Parallelism,
    ) -> Result<BoundedImage> {
        self.render_telling(surface, camera, settings, parallelism, &|_| {})
    }

    /// As [`render`](Self::render), for whoever waits: `tell` hears of how many points more there
    /// are answers, from any thread.
    ///
    /// # Errors
    /// As [`render`](Self::render).
    pub fn render_telling(
        &self,
        surface: Surface<'_>,
        camera: &Camera,
        settings: &Settings,
        parallelism: Parallelism,
        tell: &(dyn Fn(usize) + Sync),
    ) -> Result<BoundedImage> {
        settings.check_sizes()?;
        let samples = settings.samples(camera)?;
        let (tolerance, points) = (settings.tolerance, &samples.points);
        let answers = self.radiance_with(surface, points, tolerance, parallelism, tell)?;
        Ok(BoundedImage {
            image: samples.image(camera, |index| answers[index].value)?,
            bounds: samples.image(camera, |index| [answers[index].bound; 3])?,
            floor: self.floor(1.0),
        })
    }

    /// ∫ L f dω over the directions above the horizon, of a lobe that the caller gives, with an
    /// error of at most `tolerance` times the mean of the channels, or times a hundredth of the
    /// map's mean radiance, if that is larger.
    ///
    /// ```
    /// use lobes::illumination::EnvironmentMap;
    /// use lobes::reflection::{FunctionLobe, LightTree};
    /// use lobes::{Parallelism, glam::DVec3};
    /// let map = EnvironmentMap::new("grey", 32, 16, vec![[1.0; 3]; 512])?;
    /// let tree = LightTree::new(&map, Parallelism::Sequential)?;
    /// // The square of the cosine: ∫ = 2π/3.
    /// let lobe = FunctionLobe {
    ///     name: "the square of the cosine",
    ///     normal: DVec3::Y,
    ///     value: |light: DVec3| light.y * light.y,
    ///     bound: |centre: DVec3, real: f64, imaginary: f64| {
    ///         let height = centre.y.abs() + real;
    ///         height * height + imaginary * imaginary
    ///     },
    ///     width: 1.0,
    /// };
    /// let sum = tree.integral(&lobe, 1e-4)?;
    /// assert!((sum.value[0] - 2.0 * std::f64::consts::PI / 3.0).abs() <= sum.bound && sum.bound <= 3e-4);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`radiance`](Self::radiance); and [`Error::Lobe`] if the lobe is not finite, or is
    /// negative above the horizon, where it was asked.
    pub fn integral<V, B>(&self, lobe: &FunctionLobe<V, B>, tolerance: f64) -> Result<Bounded>
    where
        V: Fn(DVec3) -> f64 + Sync,
        B: Fn(DVec3, f64, f64) -> f64 + Sync,
    {
        check_tolerance(tolerance)?;
        check_unit(lobe.normal)?;
        let goal = Goal {
            tolerance,
            floor: self.floor(1.0),
            albedo: [1.0; 3],
            beside: 0.0,
            spent: 0.0,
        };
        let answer = self.solve(lobe, goal, &mut Pace::new(self), &mut Workspace::default());
        match answer {
            Err(Error::Lobe { value, .. }) => Err(Error::Lobe {
                lobe: lobe.name.to_owned(),
                value,
            }),
            answer => answer,
        }
    }

    /// A hundredth of what a surface of this albedo would show under the map's mean radiance.
    fn floor(&self, albedo: f64) -> f64 {
        FLOOR * albedo * mean(&self.total) / (4.0 * std::f64::consts::PI)
    }

    fn point(
        &self,
        diffuse: [f64; 3],
        specular: &Specular<'_>,
        point: &ShadingPoint,
        tolerance: f64,
        paces: &mut [Pace; 2],
        work: &mut Workspace,
    ) -> Result<Bounded> {
        let (normal, view) = (
            to_map(point.normal).normalize(),
            to_map(point.view).normalize(),
        );
        let cosine = normal.dot(view);
        let mut sum = Bounded::default();
        if cosine <= 0.0 {
            return Ok(sum);
        }
        let floor = self.floor(1.0);
        if largest(&diffuse) > 0.0 {
            let alone = matches!(specular, Specular::None);
            let goal = Goal {
                tolerance: if alone { tolerance } else { 0.5 * tolerance },
                floor,
                albedo: diffuse,
                beside: 0.0,
                spent: 0.0,
            };
            sum = self.solve(&LambertLobe { normal }, goal, &mut paces[0], work)?;
        }
        let goal = Goal {
            tolerance,
            floor,
            albedo: [1.0; 3],
            beside: mean(&sum.value),
            spent: sum.bound,
        };
        let part = match specular {
            Specular::None => return Ok(sum),
            Specular::Mirror(fresnel) => self.mirror(
                2.0 * cosine * normal - view,
                fresnel.map(|fresnel| fresnel.reflectance(cosine)),
            ),
            Specular::Ward(ward, albedo) => {
                let lobe = WardLobe::new(ward, normal, view);
                let goal = Goal {
                    albedo: *albedo,
                    ..goal
                };
                self.solve(&lobe, goal, &mut paces[1], work)?
            }
            Specular::Ggx(material, facets) => {
                let tangent = to_map(material.tangent(point.normal));
                let lobe = GgxLobe::new(material.alpha(), tangent, facets, normal, view);
                self.solve(&lobe, goal, &mut paces[1], work)?
            }
        };
        for (sum, part) in sum.value.iter_mut().zip(part.value) {
            *sum += part;
        }
        sum.bound += part.bound;
        Ok(sum)
    }

    /// The light from one direction of the map's frame.
    fn mirror(&self, direction: DVec3, albedo: [f64; 3]) -> Bounded {
        let sine = direction.x.hypot(direction.y);
        let row = sine.atan2(direction.z) / self.step + 0.5;
        let turn = direction
            .y
            .atan2(direction.x)
            .rem_euclid(std::f64::consts::TAU);
        let column = (turn / self.step - 0.5).rem_euclid(self.columns as f64);
        let (y, x) = (row - row.floor(), column - column.floor());
        let row = (row as usize).min(self.rows - 1);
        let at = row * (self.columns + 1) + column as usize % self.columns;
        let corners = [at, at + 1, at + self.columns + 1, at + self.columns + 2];
        let weights = [(1.0 - y) * (1.0 - x), (1.0 - y) * x, y * (1.0 - x), y * x];
        let mut answer = Bounded::default();
        // A direction is off by a few units in the last place, and the azimuth by that over the
        // sine.
        let off = (1e-15 / self.step / sine.max(1e-15)).min(1.0);
        for (index, weight) in corners.into_iter().zip(weights) {
            for (channel, albedo) in albedo.into_iter().enumerate() {
                let light = albedo * self.pixels[index][channel];
                answer.value[channel] += weight * light;
                answer.bound = answer.bound.max(4.0 * off * light);
            }
        }
        answer
    }

    /// An albedo times the integral of the light and a lobe.
    fn solve(
        &self,
        lobe: &impl Lobe,
        goal: Goal,
        pace: &mut Pace,
        work: &mut Workspace,
    ) -> Result<Bounded> {
        dispatch!(self.simd, simd => self.solve_with(simd, lobe, goal, pace, work))
    }

    #[inline(always)]
    fn solve_with<S: Simd>(
        &self,
        simd: S,
        lobe: &impl Lobe,
        goal: Goal,
        pace: &mut Pace,
        work: &mut Workspace,
    ) -> Result<Bounded> {
        let most = largest(&goal.albedo);
        // The largest bound of the integral, if all of it comes to `value`.
        let allowed = |value: f64| {
            let whole = (goal.beside + value).max(goal.floor);
            (goal.tolerance * whole - goal.spent) / most
        };
        let rounding = LEBESGUE * LEBESGUE * (lobe.rounding() + WEIGHTS);
        let mut reached = 1.0;
        let mut target = 0.8 * allowed(pace.value);
        for _ in 0..TRIES {
            self.descend(simd, lobe, target * pace.price, work);
            let bound = (work.bound + rounding * work.size) * SLACK;
            if !bound.is_finite() {
                break;
            }
            if rounding * work.size > 0.5 * target && rounding * work.size > 0.5 * allowed(0.0) {
                reached = rounding * work.size * most / (goal.beside + pace.value).max(goal.floor);
                if rounding * work.size > target {
                    break;
                }
            }
            if bound > target {
                pace.price *= (0.7 * target / bound).max(0.05);
                continue;
            }
            let (sums, least) = self.sum(simd, lobe, work);
            if let Some(value) = sums.into_iter().find(|sum| !sum.is_finite()) {
                return Err(bad(value));
            }
            if least < 0.0 {
                return Err(bad(least));
            }
            let value: [f64; 3] =
                std::array::from_fn(|channel| goal.albedo[channel] * sums[channel]);
            let level = mean(&value);
            pace.value = level;
            let limit = allowed(level - most * bound);
            if bound <= limit {
                pace.price *= (0.8 * target / bound).clamp(0.3, 2.0);
                return Ok(Bounded {
                    value,
                    bound: most * bound,
                });
            }
            reached = most * bound / (goal.beside + level).max(goal.floor);
            target = 0.8 * limit.max(0.3 * target);
        }
        Err(Error::Tolerance {
            what: "a radiance by the tree of light",
            asked: goal.tolerance,
            reached: reached.min(1.0),
        })
    }
}

impl Pace {
    fn new(tree: &LightTree) -> Self {
        Self {
            value: mean(&tree.total) / (4.0 * std::f64::consts::PI),
            price: 1e-4,
        }
    }
}

/// A value that no lobe has; the caller names it.
fn bad(value: f64) -> Error {
    Error::Lobe {
        lobe: String::new(),
        value,
    }
}

fn mean(value: &[f64; 3]) -> f64 {
    value.iter().sum::<f64>() / 3.0
}

fn largest(value: &[f64; 3]) -> f64 {
    value[0].max(value[1]).max(value[2])
}

fn check_tolerance(tolerance: f64) -> Result<()> {
    if (1e-9..=0.1).contains(&tolerance) {
        Ok(())
    } else {
        Err(Error::Domain {
            what: "the tolerance of a radiance by the tree of light",
            value: tolerance,
            allowed: "from 1e-9 to 0.1",
        })
    }
}
