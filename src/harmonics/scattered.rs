//! Sums of harmonics at many scattered directions, by a Fourier transform that need not be on a
//! grid.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use fearless_simd::prelude::*;
use fearless_simd::{Level, f64x8};
use glam::DVec3;
use num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::coefficients::{Coefficients, coefficient_count, column_start};
use super::kaiser_bessel::{Kernel, MAX_WIDTH};
use super::point::check_directions;
use super::recurrence::{LANES, Lanes};
use super::simd::wide;
use super::transform::Transform;
use super::work::over_chunks;
use crate::error::{all_finite, allocate, check_finite, check_length, not_finite};
use crate::sphere::Grid;
use crate::{Error, Parallelism, Result, vectors};

/// How much finer than need be the grid between whose points the kernel goes is, at the least.
const FINER: f64 = 1.8;

/// How far a row is repeated before its first point; as many circles stand before the first.
const BEFORE: usize = MAX_WIDTH / 2;

/// How far a row is repeated past its last point, at the least; and the circles past the last.
const PAST: usize = 2 * MAX_WIDTH;

/// How many circles begin the kernels of the points that are spread together: no fewer than a
/// kernel is wide.
const STRIP: usize = 2 * MAX_WIDTH;

/// How many points of a row begin those of the points that are near each other.
const TILE: usize = 128;

/// How many directions one thread takes at a time.
const CHUNK: usize = 4096;

/// Sums of harmonics at many scattered directions and their adjoint, to a tolerance: a plan,
/// immutable and shared by cloning.
///
/// A field of degree L, continued over the poles by f(2π − θ, φ) = f(θ, φ + π), is a trigonometric
/// polynomial of degree L in both angles. It is synthesised on rings, brought by Fourier transforms
/// to a grid that is nearly twice as fine as need be, and taken from there to each direction by a
/// kernel of Kaiser and Bessel in both angles, whose spectrum was divided out (Potts, Steidl and
/// Tasche 2001, doi:10.1007/978-1-4612-0143-4_12, and on the sphere Kunis and Potts 2003,
/// doi:10.1016/S0377-0427(03)00546-6). The rms of the error is within `tolerance` of the rms of the
/// field, and of 10⁻¹⁵ L beside it, which the rounding of the angles makes.
///
/// A plan sorts its directions. A sum is O(L³) for the rings, and w² for each direction with w some 1 +
/// log₁₀(1/tolerance), where [`Basis::sums`](super::Basis::sums) takes L² for each: beyond degree 48
/// it is quicker from some hundred directions on.
///
/// ```
/// use lobes::{Parallelism, glam::DVec3};
/// use lobes::harmonics::{Basis, ScatteredTransform, random_field};
/// let directions: Vec<_> = (0..500)
///     .map(|i| DVec3::new(f64::from(i).sin(), f64::from(2 * i).cos(), 0.3))
///     .collect();
/// let (f, one) = (random_field(&[1.0; 21], 1)?, Parallelism::Sequential);
/// let values = ScatteredTransform::new(20, &directions, 1e-9, one)?.synthesise(&f, one)?;
/// let mut exact = vec![0.0; 500];
/// Basis::new(20)?.sums(&f, &directions, &mut exact, one)?;
/// // The rms of this field is √(21²/4π) = 5.9.
/// assert!(values.iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-8));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Clone)]
pub struct ScatteredTransform(Arc<ScatteredPlan>);

struct ScatteredPlan {
    degree: usize,
    level: Level,
    kernel: Kernel,
    /// Rings at the middles of equal steps in θ, whose columns are as fine as the fine grid's.
    transform: Transform,
    /// Points of a ring; half of them are great circles.
    columns: usize,
    /// Rings, of which a great circle meets each twice.
    rings: usize,
    /// Points of a great circle of the fine grid.
    points: usize,
    /// How far circles are apart in memory.
    pitch: usize,
    /// What coefficients of order m are multiplied by.
    of_order: Vec<f64>,
    /// What waves e^(ikθ) of a great circle are multiplied by, k = 0 … degree; the phase is that of
    /// the first ring.
    of_wave: Vec<Complex64>,
    from_rings: Arc<dyn RealToComplex<f64>>,
    to_rings: Arc<dyn ComplexToReal<f64>>,
    from_fine: Arc<dyn RealToComplex<f64>>,
    to_fine: Arc<dyn ComplexToReal<f64>>,
    /// Where the directions lie, in steps of the fine grid along a great circle and across: those
    /// of a tile after each other.
    places: Vec<[f64; 2]>,
    /// Which direction each place is of, and where each direction's place is.
    order: Vec<u32>,
    ranks: Vec<u32>,
    /// Where the places of each strip begin, and where the last ends.
    strips: Vec<usize>,
}

/// The smallest number from `least` ≥ 10 on that is a power of two, or three or five times one: such
/// Fourier transforms are quick.
fn smooth(least: usize) -> usize {
    let from = |odd: usize| odd * least.div_ceil(odd).next_power_of_two();
    from(1).min(from(3)).min(from(5))
}

/// Along a great circle and across, in radians, on [0, 2π] and [0, π].
fn angles(direction: DVec3) -> [f64; 2] {
    let theta = direction.x.hypot(direction.y).atan2(direction.z);
    let phi = direction.y.atan2(direction.x);
    if phi < 0.0 {
        [TAU - theta, phi + PI]
    } else {
        [theta, phi]
    }
}

impl ScatteredTransform {
    /// A plan for these directions of the harmonic frame, of any length.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`MAX_DEGREE`](super::MAX_DEGREE); [`Error::Domain`] for a direction
    /// of no or of infinite length, for more than 2³² − 1 of them, and for a tolerance that is not in
    /// 10⁻¹³ … 0.1; [`Error::Memory`] where there is none.
    pub fn new(
        degree: usize,
        directions: &[DVec3],
        tolerance: f64,
        parallelism: Parallelism,
    ) -> Result<Self> {
        if !(1e-13..=0.1).contains(&tolerance) {
            return Err(Error::Domain {
                what: "the tolerance of sums at directions",
                value: tolerance,
                allowed: "in 10⁻¹³ … 0.1",
            });
        }
        if u32::try_from(directions.len()).is_err() {
            return Err(Error::Domain {
                what: "the number of directions",
                value: directions.len() as f64,
                allowed: "below 2³²",
            });
        }
        check_directions(directions)?;
        if degree > super::MAX_DEGREE {
            return Err(Error::Degree {
                what: "the transform",
                degree,
                limit: super::MAX_DEGREE,
            });
        }
        // No kernel is wider than half of what it goes along.
        let fine = (FINER * (2 * degree + 1) as f64).ceil() as usize;
        let points = smooth(fine.max(4 * MAX_WIDTH));
        let (columns, rings) = (points, smooth((2 * degree + 2).max(16)) / 2);
        let grid = Grid::fejer(rings, columns)?.with_first_azimuth(0.0);
        let transform = Transform::new(&grid, degree)?;
        let kernel = Kernel::new(points, degree, tolerance);
        let of_order: Vec<f64> = (0..=degree)
            .map(|m| 1.0 / kernel.spectrum(m as f64 / points as f64))
            .collect();
        let of_wave = of_order.iter().enumerate().map(|(k, scale)| {
            let angle = -PI * k as f64 / (2 * rings) as f64;
            Complex64::from_polar(scale / (2 * rings) as f64, angle)
        });
        let of_wave = of_wave.collect();
        let mut planner = RealFftPlanner::new();
        let mut plan = ScatteredPlan {
            degree,
            level: vectors::level(),
            kernel,
            transform,
            columns,
            rings,
            points,
            pitch: (BEFORE + points + PAST).next_multiple_of(LANES) + LANES,
            of_order,
            of_wave,
            from_rings: planner.plan_fft_forward(2 * rings),
            to_rings: planner.plan_fft_inverse(2 * rings),
            from_fine: planner.plan_fft_forward(points),
            to_fine: planner.plan_fft_inverse(points),
            places: Vec::new(),
            order: Vec::new(),
            ranks: Vec::new(),
            strips: Vec::new(),
        };
        plan.sort(directions, parallelism)?;
        Ok(Self(Arc::new(plan)))
    }

    /// The degree.
    pub fn degree(&self) -> usize {
        self.0.degree
    }

    /// How many directions there are.
    pub fn directions(&self) -> usize {
        self.0.places.len()
    }

    /// How many values of scratch [`synthesise_into`](Self::synthesise_into) and
    /// [`synthesise_adjoint_into`](Self::synthesise_adjoint_into) need.
    pub fn scratch_len(&self) -> usize {
        let plan = &*self.0;
        plan.transform.scratch_len(1)
            + plan.transform.coefficient_count()
            + plan.transform.grid().len()
            + plan.rows() * plan.pitch
            + plan.places.len()
    }

    /// Σ f_lm Y_l^m at each direction.
    ///
    /// # Errors
    /// [`Error::Degree`] where the set has another degree than the plan; [`Error::NotFinite`] where a
    /// coefficient is not finite, [`Error::Overflow`] where they are and a sum is not;
    /// [`Error::Memory`] where there is none.
    pub fn synthesise(
        &self,
        coefficients: &Coefficients,
        parallelism: Parallelism,
    ) -> Result<Vec<f64>> {
        let degree = self.0.degree;
        if coefficients.degree() != degree {
            return Err(Error::Degree {
                what: "the plan for directions",
                degree: coefficients.degree(),
                limit: degree,
            });
        }
        // Orders that are left out are the last.
        let mut whole = Coefficients::try_zeros(degree, degree)?;
        let given = coefficients.as_slice();
        whole.as_mut_slice()[..given.len()].copy_from_slice(given);
        let mut values = allocate("the values at directions", self.directions())?;
        let mut scratch = allocate("the scratch", self.scratch_len())?;
        self.synthesise_into(whole.as_slice(), &mut values, &mut scratch, parallelism)?;
        Ok(values)
    }

    /// [`synthesise`](Self::synthesise) of the coefficients of all orders, laid out as in
    /// [`Coefficients`], with at least [`scratch_len`](Self::scratch_len) values of scratch. Allocates
    /// nothing that grows with the number of directions.
    ///
    /// # Errors
    /// [`Error::Length`] for any slice of the wrong length, and as of
    /// [`synthesise`](Self::synthesise).
    pub fn synthesise_into(
        &self,
        coefficients: &[f64],
        values: &mut [f64],
        scratch: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        let plan = &*self.0;
        let parts = plan.divide(coefficients, values, scratch)?;
        let Parts {
            set,
            map,
            circles,
            sorted,
            rest,
        } = parts;
        set.copy_from_slice(coefficients);
        plan.scale(set);
        plan.transform
            .synthesise_into(1, set, map, rest, parallelism)
            .map_err(|_| not_finite("the sums", "the coefficients", coefficients))?;
        plan.to_circles(map, circles, parallelism);
        over_chunks(parallelism, sorted, CHUNK, |chunk, out| {
            let places = &plan.places[chunk * CHUNK..];
            wide!(plan.level, simd => {
                if plan.kernel.width > LANES {
                    plan.interpolate::<_, 2>(simd, circles, places, out);
                } else {
                    plan.interpolate::<_, 1>(simd, circles, places, out);
                }
            });
        });
        over_chunks(parallelism, values, CHUNK, |chunk, out| {
            for (value, rank) in out.iter_mut().zip(&plan.ranks[chunk * CHUNK..]) {
                *value = sorted[*rank as usize];
            }
        });
        if all_finite(values) {
            Ok(())
        } else {
            Err(not_finite("the sums", "the coefficients", coefficients))
        }
    }

    /// The adjoint of [`synthesise`](Self::synthesise): Σ_i y_i Y_l^m(ω_i), all orders, to the same
    /// tolerance.
    ///
    /// It is the exact transpose of what [`synthesise`](Self::synthesise) does, and not of what it
    /// approximates: for every coefficient set c the sum over directions of synthesise(c) times y is the
    /// sum over coefficients of c times synthesise_adjoint(y), to 10⁻¹³ of the product of their lengths,
    /// whatever the tolerance.
    ///
    /// ```
    /// use lobes::{Parallelism, glam::DVec3, harmonics::ScatteredTransform};
    /// let one = Parallelism::Sequential;
    /// let plan = ScatteredTransform::new(2, &[DVec3::Z, -DVec3::Z], 1e-12, one)?;
    /// let sums = plan.synthesise_adjoint(&[1.0, 1.0], one)?;
    /// assert!(sums.get(1, 0).abs() < 1e-11);
    /// assert!((sums.get(2, 0) - (5.0 / std::f64::consts::PI).sqrt()).abs() < 1e-11);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one value a direction; [`Error::NotFinite`] where a value is
    /// not finite, [`Error::Overflow`] where all are and a sum is not; [`Error::Memory`] where there
    /// is none.
    pub fn synthesise_adjoint(
        &self,
        values: &[f64],
        parallelism: Parallelism,
    ) -> Result<Coefficients> {
        let degree = self.0.degree;
        let mut sums = Coefficients::try_zeros(degree, degree)?;
        let mut scratch = allocate("the scratch", self.scratch_len())?;
        self.synthesise_adjoint_into(values, sums.as_mut_slice(), &mut scratch, parallelism)?;
        Ok(sums)
    }

    /// [`synthesise_adjoint`](Self::synthesise_adjoint) into coefficients of all orders, as
    /// [`synthesise_into`](Self::synthesise_into).
    ///
    /// # Errors
    /// [`Error::Length`] for any slice of the wrong length, and as of
    /// [`synthesise_adjoint`](Self::synthesise_adjoint).
    pub fn synthesise_adjoint_into(
        &self,
        values: &[f64],
        coefficients: &mut [f64],
        scratch: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        let plan = &*self.0;
        let Parts {
            map,
            circles,
            sorted,
            rest,
            ..
        } = plan.divide(coefficients, values, scratch)?;
        check_finite("the values", values)?;
        over_chunks(parallelism, sorted, CHUNK, |chunk, sorted| {
            for (value, index) in sorted.iter_mut().zip(&plan.order[chunk * CHUNK..]) {
                *value = values[*index as usize];
            }
        });
        let length = 2 * STRIP * plan.pitch;
        over_chunks(parallelism, circles, length, |_, rows| rows.fill(0.0));
        // A strip writes into itself and into the next: every other one at a time, so that no two
        // threads write to one place and sums come in one order.
        for parity in 0..2 {
            let own = &mut circles[parity * STRIP * plan.pitch..];
            over_chunks(parallelism, own, length, |pair, rows| {
                let strip = 2 * pair + parity;
                let Some(&[start, end]) = plan.strips.get(strip..strip + 2) else {
                    return;
                };
                let (places, values) = (&plan.places[start..end], &sorted[start..end]);
                let first = strip * STRIP;
                wide!(plan.level, simd => {
                    if plan.kernel.width > LANES {
                        plan.spread::<_, 2>(simd, rows, first, places, values);
                    } else {
                        plan.spread::<_, 1>(simd, rows, first, places, values);
                    }
                });
            });
        }
        plan.to_map(circles, map, parallelism);
        plan.transform
            .synthesise_adjoint_into(1, map, coefficients, rest, parallelism)
            .map_err(|_| not_finite("the sums", "the values", values))?;
        plan.scale(coefficients);
        if all_finite(coefficients) {
            Ok(())
        } else {
            Err(not_finite("the sums", "the values", values))
        }
    }
}

impl std::fmt::Debug for ScatteredTransform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ScatteredTransform")
            .field("degree", &self.0.degree)
            .field("directions", &self.directions())
            .finish()
    }
}

/// The scratch, by what it is for.
struct Parts<'a> {
    set: &'a mut [f64],
    map: &'a mut [f64],
    circles: &'a mut [f64],
    sorted: &'a mut [f64],
    rest: &'a mut [f64],
}

impl ScatteredPlan {
    /// How many great circles there are, half a turn of them.
    fn half(&self) -> usize {
        self.columns / 2
    }

    /// How many rows there are: the circles, and those that are repeated.
    fn rows(&self) -> usize {
        BEFORE + self.half() + PAST
    }

    fn divide<'a>(
        &self,
        coefficients: &[f64],
        values: &[f64],
        scratch: &'a mut [f64],
    ) -> Result<Parts<'a>> {
        let count = coefficient_count(self.degree, self.degree);
        check_length("the coefficients", count, coefficients.len())?;
        check_length("the values at directions", self.places.len(), values.len())?;
        let map = self.transform.grid().len();
        let circles = self.rows() * self.pitch;
        let least = count + map + circles + values.len() + self.transform.scratch_len(1);
        if scratch.len() < least {
            return Err(Error::Length {
                what: "the scratch",
                expected: least,
                got: scratch.len(),
            });
        }
        let (set, rest) = scratch.split_at_mut(count);
        let (map, rest) = rest.split_at_mut(map);
        let (circles, rest) = rest.split_at_mut(circles);
        let (sorted, rest) = rest.split_at_mut(values.len());
        Ok(Parts {
            set,
            map,
            circles,
            sorted,
            rest,
        })
    }

    /// Multiplies the coefficients of each order by what the kernel across circles needs.
    fn scale(&self, set: &mut [f64]) {
        for (m, factor) in self.of_order.iter().enumerate() {
            let end = column_start(self.degree, m + 1).min(set.len());
            for value in &mut set[column_start(self.degree, m)..end] {
                *value *= factor;
            }
        }
    }

    /// Where the kernel of a place begins, in steps, and v = 2u − 1 of the place u within its pieces.
    #[inline(always)]
    fn begin(&self, place: f64) -> (isize, f64) {
        let left = place - 0.5 * self.kernel.width as f64;
        let first = left.ceil();
        (first as isize, 2.0 * (first - left) - 1.0)
    }

    /// Finds the places of directions and puts those together that are near each other.
    fn sort(&mut self, directions: &[DVec3], parallelism: Parallelism) -> Result<()> {
        let count = directions.len();
        let mut places = allocate("the places of directions", count)?;
        let step = TAU / self.points as f64;
        over_chunks(parallelism, &mut places, CHUNK, |chunk, places| {
            for (place, direction) in places.iter_mut().zip(&directions[chunk * CHUNK..]) {
                *place = angles(*direction).map(|angle| angle / step);
            }
        });
        let tiles = (self.points + PAST) / TILE + 1;
        let bin = |[along, across]: [f64; 2]| {
            let from = |place: f64| self.begin(place).0 + BEFORE as isize;
            from(across) as usize / STRIP * tiles + from(along) as usize / TILE
        };
        let strips = self.rows() / STRIP + 1;
        let mut starts = vec![0usize; strips * tiles + 1];
        for place in &places {
            starts[bin(*place) + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let strips = starts.iter().step_by(tiles).copied().collect();
        let mut order = allocate("the order of directions", count)?;
        let mut ranks = allocate("the order of directions", count)?;
        let mut sorted = allocate("the places of directions", count)?;
        for (index, place) in places.iter().enumerate() {
            let at = &mut starts[bin(*place)];
            order[*at] = index as u32;
            ranks[index] = *at as u32;
            sorted[*at] = *place;
            *at += 1;
        }
        (self.places, self.order, self.ranks, self.strips) = (sorted, order, ranks, strips);
        Ok(())
    }

    /// Great circles on the fine grid, with what is repeated of them, from rings.
    fn to_circles(&self, map: &[f64], circles: &mut [f64], parallelism: Parallelism) {
        let (half, pitch, rings) = (self.half(), self.pitch, self.rings);
        let own = &mut circles[BEFORE * pitch..(BEFORE + half) * pitch];
        over_chunks(parallelism, own, LANES * pitch, |chunk, rows| {
            let first = chunk * LANES;
            for (ring, values) in map.chunks_exact(self.columns).enumerate() {
                for (lane, row) in rows.chunks_exact_mut(pitch).enumerate() {
                    row[ring] = values[first + lane];
                    row[2 * rings - 1 - ring] = values[first + lane + half];
                }
            }
            let (mut waves, mut scratch) = self.buffers();
            for row in rows.chunks_exact_mut(pitch) {
                let (coarse, fine) = (2 * rings, BEFORE..BEFORE + self.points);
                // The lengths are the plans'. Wave 0 is real unless sums have overflowed, which is told
                // from the values.
                let _ = self.from_rings.process_with_scratch(
                    &mut row[..coarse],
                    &mut waves[..=rings],
                    &mut scratch,
                );
                for (wave, factor) in waves.iter_mut().zip(&self.of_wave) {
                    *wave *= factor;
                }
                waves[self.degree + 1..].fill(Complex64::ZERO);
                let _ = self.to_fine.process_with_scratch(
                    &mut waves[..=self.points / 2],
                    &mut row[fine],
                    &mut scratch,
                );
                self.repeat(row);
            }
        });
        // Half a turn further a circle is run through the other way.
        for row in (0..BEFORE).chain(BEFORE + half..self.rows()) {
            let source = self.opposite(row);
            for place in 0..self.points {
                circles[row * pitch + BEFORE + place] =
                    circles[source * pitch + BEFORE + self.backwards(place)];
            }
            self.repeat(&mut circles[row * pitch..(row + 1) * pitch]);
        }
    }

    /// The transpose of [`to_circles`](Self::to_circles).
    fn to_map(&self, circles: &mut [f64], map: &mut [f64], parallelism: Parallelism) {
        let (half, pitch, rings) = (self.half(), self.pitch, self.rings);
        for row in (0..BEFORE).chain(BEFORE + half..self.rows()) {
            let target = self.opposite(row);
            self.fold(&mut circles[row * pitch..(row + 1) * pitch]);
            for place in 0..self.points {
                let value = circles[row * pitch + BEFORE + place];
                circles[target * pitch + BEFORE + self.backwards(place)] += value;
            }
        }
        let own = &mut circles[BEFORE * pitch..(BEFORE + half) * pitch];
        over_chunks(parallelism, own, LANES * pitch, |_, rows| {
            let (mut waves, mut scratch) = self.buffers();
            for row in rows.chunks_exact_mut(pitch) {
                self.fold(row);
                let fine = BEFORE..BEFORE + self.points;
                let _ = self.from_fine.process_with_scratch(
                    &mut row[fine],
                    &mut waves[..=self.points / 2],
                    &mut scratch,
                );
                for (wave, factor) in waves.iter_mut().zip(&self.of_wave) {
                    *wave *= factor.conj();
                }
                waves[self.degree + 1..].fill(Complex64::ZERO);
                let _ = self.to_rings.process_with_scratch(
                    &mut waves[..=rings],
                    &mut row[..2 * rings],
                    &mut scratch,
                );
            }
        });
        let own = &*own;
        over_chunks(parallelism, map, LANES * self.columns, |chunk, lines| {
            let first = chunk * LANES;
            for (circle, row) in own.chunks_exact(pitch).enumerate() {
                for (lane, line) in lines.chunks_exact_mut(self.columns).enumerate() {
                    line[circle] = row[first + lane];
                    line[circle + half] = row[2 * rings - 1 - first - lane];
                }
            }
        });
    }

    /// Room for the waves of a circle, and for its Fourier transforms.
    fn buffers(&self) -> (Vec<Complex64>, Vec<Complex64>) {
        let scratch = [
            self.from_rings.get_scratch_len(),
            self.to_rings.get_scratch_len(),
            self.from_fine.get_scratch_len(),
            self.to_fine.get_scratch_len(),
        ];
        let scratch = scratch.into_iter().fold(0, usize::max);
        let waves = self.rings.max(self.points / 2) + 1;
        (vec![Complex64::ZERO; waves], vec![Complex64::ZERO; scratch])
    }

    /// The circle that a row which is repeated is, half a turn away.
    fn opposite(&self, row: usize) -> usize {
        if row < BEFORE {
            row + self.half()
        } else {
            row - self.half()
        }
    }

    /// A place along a circle, run through the other way.
    fn backwards(&self, place: usize) -> usize {
        if place == 0 { 0 } else { self.points - place }
    }

    /// Repeats the end of a circle before its beginning, and its beginning past its end.
    fn repeat(&self, row: &mut [f64]) {
        let end = BEFORE + self.points;
        row.copy_within(end - BEFORE..end, 0);
        let past = row.len() - end;
        row.copy_within(BEFORE..BEFORE + past, end);
    }

    /// The transpose of [`repeat`](Self::repeat).
    fn fold(&self, row: &mut [f64]) {
        for place in 0..BEFORE {
            row[place + self.points] += row[place];
        }
        for place in BEFORE + self.points..row.len() {
            row[place - self.points] += row[place];
        }
    }

    /// The weights of the pieces of a kernel.
    #[inline(always)]
    fn weights<S: Simd, const VECTORS: usize>(&self, simd: S, v: f64) -> [f64x8<S>; VECTORS] {
        let v = f64x8::splat(simd, v);
        let mut sums = [f64x8::splat(simd, 0.0); VECTORS];
        for pieces in &self.kernel.pieces {
            for (sum, piece) in sums.iter_mut().zip(pieces) {
                *sum = sum.mul_add(v, f64x8::load_array_ref(simd, piece));
            }
        }
        sums
    }

    /// The row and the place in it at which the kernel of a place begins, and its weights.
    #[inline(always)]
    fn around<S: Simd, const VECTORS: usize>(
        &self,
        simd: S,
        [along, across]: [f64; 2],
    ) -> (usize, usize, [f64x8<S>; VECTORS], [Lanes; VECTORS]) {
        let (from, v) = self.begin(along);
        let weights = self.weights(simd, v);
        let (row, v) = self.begin(across);
        let rows = self.weights::<S, VECTORS>(simd, v).map(Lanes::from);
        let start = |first: isize| BEFORE.wrapping_add_signed(first);
        (start(row), start(from), weights, rows)
    }

    /// Values at places, from the circles.
    #[inline(always)]
    fn interpolate<S: Simd, const VECTORS: usize>(
        &self,
        simd: S,
        circles: &[f64],
        places: &[[f64; 2]],
        out: &mut [f64],
    ) {
        for (value, place) in out.iter_mut().zip(places) {
            let (row, from, weights, rows) = self.around::<S, VECTORS>(simd, *place);
            let mut sums = [f64x8::splat(simd, 0.0); VECTORS];
            for i in 0..self.kernel.width {
                let at = (row + i) * self.pitch + from;
                let weight = f64x8::splat(simd, rows[i / LANES][i % LANES]);
                let (chunks, _) = circles[at..at + LANES * VECTORS].as_chunks();
                for (sum, values) in sums.iter_mut().zip(chunks) {
                    *sum = weight.mul_add(f64x8::load_array_ref(simd, values), *sum);
                }
            }
            let mut total = f64x8::splat(simd, 0.0);
            for (sum, weight) in sums.into_iter().zip(weights) {
                total = sum.mul_add(weight, total);
            }
            *value = total.reduce_sum();
        }
    }

    /// The transpose of [`interpolate`](Self::interpolate), for places whose kernels begin in rows
    /// from `first` on, which are given.
    #[inline(always)]
    fn spread<S: Simd, const VECTORS: usize>(
        &self,
        simd: S,
        circles: &mut [f64],
        first: usize,
        places: &[[f64; 2]],
        values: &[f64],
    ) {
        for (value, place) in values.iter().zip(places) {
            let (row, from, weights, rows) = self.around::<S, VECTORS>(simd, *place);
            let weights = weights.map(|weight| weight * *value);
            for i in 0..self.kernel.width {
                let at = (row - first + i) * self.pitch + from;
                let factor = f64x8::splat(simd, rows[i / LANES][i % LANES]);
                let (chunks, _) = circles[at..at + LANES * VECTORS].as_chunks_mut();
                for (sum, weight) in chunks.iter_mut().zip(weights) {
                    *sum = factor
                        .mul_add(weight, f64x8::load_array_ref(simd, sum))
                        .into();
                }
            }
        }
    }
}
