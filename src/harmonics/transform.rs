//! Analysis and synthesis on iso-latitude grids.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use fearless_simd::prelude::*;
use fearless_simd::{Level, f64x8};

use super::coefficients::{Coefficients, coefficient_count, column_start};
use super::kernel::{self, Quad};
use super::legendre_table::LegendreTable;
use super::meridian::Meridian;
use super::own_rings::OwnRings;
use super::recurrence::{LANES, Lanes, Recurrence};
use super::ring_fft::{Element, RingFft, transpose};
use super::simd::wide;
use super::work::{Chunks, Octets, Orders, Rows, aligned, divided, inside_pool};
use crate::error::{all_finite, allocate, check_length, not_finite};
use crate::sphere::{Grid, Latitudes};
use crate::{Error, Parallelism, Result, vectors};

/// The largest degree of a [`Transform`].
pub const MAX_DEGREE: usize = 4096;

/// A plan for analysis and synthesis on one grid, to one degree. Immutable, shared by cloning, used
/// by any number of threads.
///
/// Synthesis is f(θ, φ) = Σ f_lm Y_l^m at every point; analysis is f_lm = ∫ f Y_l^m dω by the
/// grid's quadrature, exact for fields of at most this degree. On equiangular rings past
/// [`Grid::max_degree_of_weights`] the quadrature is along meridians, by Fourier transforms (as in
/// Reinecke, Belkner and Carron 2023, doi:10.1051/0004-6361/202346717, though not resampled to more
/// rings), and takes about three times as long.
///
/// On HEALPix the weights integrate no product exactly: there
/// [`analyse_least_squares`](Self::analyse_least_squares) is exact, and
/// [`analyse_iterated`](Self::analyse_iterated) what others do. Orders past the half of a short ring
/// count as what they are at its points.
///
/// ```
/// use lobes::harmonics::{Coefficients, Transform};
/// use lobes::sphere::Grid;
/// let transform = Transform::new(&Grid::gauss_legendre(8, 16)?, 7)?;
/// let mut f = Coefficients::zeros(7);
/// f.set(3, -2, 1.0)?;
/// let map = transform.synthesise(&f)?;
/// assert!((transform.analyse(&map)?.get(3, -2) - 1.0).abs() < 1e-14);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Clone)]
pub struct Transform(Arc<Plan>);

pub(super) struct Plan {
    pub(super) grid: Grid,
    pub(super) degree: usize,
    pub(super) orders: usize,
    pub(super) level: Level,
    pub(super) recurrence: Recurrence,
    /// What the recurrence gives, where that is little enough to be kept.
    table: Option<LegendreTable>,
    /// Where each ring of a map begins, and where the last one ends.
    starts: Vec<usize>,
    /// The transforms along rings, where those are not all alike.
    own: Option<OwnRings>,
    fft: RingFft,
    /// e^(i m φ₀) for each order, halved for m > 0.
    phases: Vec<[f64; 2]>,
    /// Where the degree is more than weights on the rings serve: what makes them serve.
    meridian: Option<Meridian>,
    /// The quadrature weights of each octet's rings, in steradians a point.
    pub(super) weights: Vec<Lanes>,
    /// How many threads the scratch serves.
    workers: usize,
}

impl Transform {
    /// A plan for all orders up to `degree`.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`Grid::max_degree`] or [`MAX_DEGREE`].
    pub fn new(grid: &Grid, degree: usize) -> Result<Self> {
        Self::with_orders(grid, degree, degree)
    }

    /// A plan for the orders |m| ≤ `orders` only.
    ///
    /// # Errors
    /// [`Error::Degree`] for a degree beyond [`Grid::max_degree_of_rings`] or [`MAX_DEGREE`], or
    /// orders beyond [`Grid::max_order`].
    pub fn with_orders(grid: &Grid, degree: usize, orders: usize) -> Result<Self> {
        let orders = orders.min(degree);
        for (what, value, limit) in [
            ("the transform", degree, MAX_DEGREE),
            ("the grid's rings", degree, grid.max_degree_of_rings()),
            ("the grid's columns", orders, grid.max_order()),
        ] {
            if value > limit {
                return Err(Error::Degree {
                    what,
                    degree: value,
                    limit,
                });
            }
        }
        let level = vectors::level();
        let recurrence = Recurrence::new(grid, degree, orders, level);
        let pairs = grid.rings().div_ceil(2);
        let by_weights =
            degree <= grid.max_degree_of_weights() || grid.latitudes() == Latitudes::Healpix;
        let meridian = (!by_weights).then(|| Meridian::new(grid));
        let weight = |ring| match &meridian {
            Some(meridian) => meridian.weight(ring) * (2.0 * PI / grid.columns() as f64),
            None => grid.ring_weight(ring),
        };
        let weights = (0..recurrence.octets.len())
            .map(|octet| {
                std::array::from_fn(|lane| {
                    let ring = octet * LANES + lane;
                    if ring < pairs { weight(ring) } else { 0.0 }
                })
            })
            .collect();
        Ok(Self(Arc::new(Plan {
            degree,
            orders,
            level,
            table: LegendreTable::new(&recurrence, orders, level),
            recurrence,
            starts: (0..grid.rings())
                .map(|ring| grid.ring_points(ring).start)
                .chain([grid.len()])
                .collect(),
            own: (!grid.has_rings_alike()).then(|| OwnRings::new(grid)),
            fft: RingFft::new(grid.columns()),
            phases: (0..=orders)
                .map(|m| {
                    let (s, c) = (m as f64 * grid.first_azimuth()).sin_cos();
                    let half = if m == 0 { 1.0 } else { 0.5 };
                    [half * c, half * s]
                })
                .collect(),
            weights,
            meridian,
            workers: Parallelism::Rayon.threads(),
            grid: grid.clone(),
        })))
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.0.grid
    }

    /// The largest degree l.
    pub fn degree(&self) -> usize {
        self.0.degree
    }

    /// The largest order |m|.
    pub fn orders(&self) -> usize {
        self.0.orders
    }

    /// How many coefficients one map has.
    pub fn coefficient_count(&self) -> usize {
        coefficient_count(self.0.degree, self.0.orders)
    }

    /// How many values of scratch the `_into` functions need for a batch of so many maps.
    pub fn scratch_len(&self, batch: usize) -> usize {
        LANES * self.0.scratch_lines(batch) + LANES - 1
    }

    /// How much memory the plan's tables take, in bytes.
    pub fn table_bytes(&self) -> usize {
        let table = self.0.table.as_ref().map_or(0, LegendreTable::bytes);
        self.0.recurrence.bytes() + table
    }

    /// The map of a coefficient set, `rings × columns`.
    ///
    /// # Errors
    /// [`Error::Length`] where the set has another degree or other orders than the plan;
    /// [`Error::NotFinite`] where a coefficient is not finite, [`Error::Overflow`] where they are
    /// and the map is not; [`Error::Memory`] where there is none.
    pub fn synthesise(&self, coefficients: &Coefficients) -> Result<Vec<f64>> {
        self.check_shape(coefficients)?;
        let mut map = allocate("the map", self.0.grid.len())?;
        let mut scratch = allocate("the scratch", self.scratch_len(1))?;
        self.synthesise_into(
            1,
            coefficients.as_slice(),
            &mut map,
            &mut scratch,
            Parallelism::Sequential,
        )?;
        Ok(map)
    }

    /// The coefficients of a map, `rings × columns`.
    ///
    /// # Errors
    /// [`Error::Length`] where the map has not as many values as the grid; [`Error::NotFinite`]
    /// where one is not finite, [`Error::Overflow`] where all are and a coefficient is not;
    /// [`Error::Memory`] where there is none.
    pub fn analyse(&self, map: &[f64]) -> Result<Coefficients> {
        let mut values = allocate("the coefficients", self.coefficient_count())?;
        let mut scratch = allocate("the scratch", self.scratch_len(1))?;
        self.analyse_into(1, map, &mut values, &mut scratch, Parallelism::Sequential)?;
        Coefficients::from_vec(self.0.degree, self.0.orders, values)
    }

    pub(super) fn check_shape(&self, coefficients: &Coefficients) -> Result<()> {
        if coefficients.degree() != self.0.degree || coefficients.orders() != self.0.orders {
            return Err(Error::Length {
                what: "the coefficient set",
                expected: self.coefficient_count(),
                got: coefficients.as_slice().len(),
            });
        }
        Ok(())
    }

    /// Synthesis of `batch` coefficient sets, one after the other in `coefficients`, into as many
    /// maps, one after the other in `maps`. Allocates nothing; `scratch` has at least
    /// [`scratch_len`](Self::scratch_len) values.
    ///
    /// # Errors
    /// [`Error::Length`] for any slice of the wrong length; [`Error::NotFinite`] where a
    /// coefficient is not finite and [`Error::Overflow`] where they are and a map is not; the maps
    /// are then not either.
    pub fn synthesise_into(
        &self,
        batch: usize,
        coefficients: &[f64],
        maps: &mut [f64],
        scratch: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        let weighing = Weighing::None;
        self.sets_to_maps(batch, coefficients, maps, scratch, weighing, parallelism)
    }

    /// Analysis of `batch` maps, one after the other in `maps`, into as many coefficient sets, one
    /// after the other in `coefficients`. Allocates nothing; `scratch` has at least
    /// [`scratch_len`](Self::scratch_len) values.
    ///
    /// # Errors
    /// [`Error::Length`] for any slice of the wrong length, [`Error::NotFinite`] where a value of a
    /// map is not finite and [`Error::Overflow`] where all are and a coefficient is not; the
    /// coefficients are then not either.
    pub fn analyse_into(
        &self,
        batch: usize,
        maps: &[f64],
        coefficients: &mut [f64],
        scratch: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        let weighing = Weighing::Quadrature;
        self.maps_to_sets(batch, maps, coefficients, scratch, weighing, parallelism)
    }

    /// The adjoint of [`synthesise`](Self::synthesise): the sums Σ y Y_l^m over the grid's points,
    /// without weights.
    ///
    /// For every coefficient set c and every map y the sum over points of synthesise(c) times y is
    /// the sum over coefficients of c times synthesise_adjoint(y), to 10⁻¹³ of the product of the
    /// two lengths. So it is the gradient of ½ Σ (synthesise(c) − d)² with y the difference in the
    /// parentheses.
    ///
    /// ```
    /// use lobes::harmonics::{Coefficients, Transform};
    /// use lobes::sphere::Grid;
    /// let transform = Transform::new(&Grid::lat_long(8, 16)?, 3)?;
    /// let mut c = Coefficients::zeros(3);
    /// c.set(2, 1, 1.0)?;
    /// let y: Vec<f64> = (0..128).map(|i| f64::from(i * i % 17)).collect();
    /// let at_points: f64 = transform.synthesise(&c)?.iter().zip(&y).map(|(f, y)| f * y).sum();
    /// let at_coefficients = transform.synthesise_adjoint(&y)?.get(2, 1);
    /// assert!((at_points - at_coefficients).abs() < 1e-11);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`analyse`](Self::analyse).
    pub fn synthesise_adjoint(&self, map: &[f64]) -> Result<Coefficients> {
        let mut values = allocate("the coefficients", self.coefficient_count())?;
        let mut scratch = allocate("the scratch", self.scratch_len(1))?;
        let one = Parallelism::Sequential;
        self.synthesise_adjoint_into(1, map, &mut values, &mut scratch, one)?;
        Coefficients::from_vec(self.0.degree, self.0.orders, values)
    }

    /// The adjoint of [`analyse`](Self::analyse): the map that gives, summed over the grid's points
    /// with any map y, what the coefficients give with those of y, to 10⁻¹³ of the product of the
    /// two lengths.
    ///
    /// ```
    /// use lobes::harmonics::{Coefficients, Transform};
    /// use lobes::sphere::Grid;
    /// let transform = Transform::new(&Grid::gauss_legendre(8, 16)?, 7)?;
    /// let mut c = Coefficients::zeros(7);
    /// c.set(0, 0, (4.0 * std::f64::consts::PI).sqrt())?;
    /// // The mean times 4π is a sum of values with weights.
    /// let weights = transform.analyse_adjoint(&c)?;
    /// assert!((weights.iter().sum::<f64>() / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-14);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`synthesise`](Self::synthesise).
    pub fn analyse_adjoint(&self, coefficients: &Coefficients) -> Result<Vec<f64>> {
        self.check_shape(coefficients)?;
        let mut map = allocate("the map", self.0.grid.len())?;
        let mut scratch = allocate("the scratch", self.scratch_len(1))?;
        let (set, one) = (coefficients.as_slice(), Parallelism::Sequential);
        self.analyse_adjoint_into(1, set, &mut map, &mut scratch, one)?;
        Ok(map)
    }

    /// [`synthesise_adjoint`](Self::synthesise_adjoint) of `batch` maps, laid out as for
    /// [`analyse_into`](Self::analyse_into).
    ///
    /// # Errors
    /// Those of [`analyse_into`](Self::analyse_into).
    pub fn synthesise_adjoint_into(
        &self,
        batch: usize,
        maps: &[f64],
        coefficients: &mut [f64],
        scratch: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        self.maps_to_sets(
            batch,
            maps,
            coefficients,
            scratch,
            Weighing::None,
            parallelism,
        )
    }

    /// [`analyse_adjoint`](Self::analyse_adjoint) of `batch` coefficient sets, laid out as for
    /// [`synthesise_into`](Self::synthesise_into).
    ///
    /// # Errors
    /// Those of [`synthesise_into`](Self::synthesise_into).
    pub fn analyse_adjoint_into(
        &self,
        batch: usize,
        coefficients: &[f64],
        maps: &mut [f64],
        scratch: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        let weighing = Weighing::Quadrature;
        self.sets_to_maps(batch, coefficients, maps, scratch, weighing, parallelism)
    }

    fn sets_to_maps(
        &self,
        batch: usize,
        coefficients: &[f64],
        maps: &mut [f64],
        scratch: &mut [f64],
        weighing: Weighing,
        parallelism: Parallelism,
    ) -> Result<()> {
        self.check_lengths(batch, coefficients.len(), maps.len(), scratch.len())?;
        let plan = &*self.0;
        let scratch = aligned(scratch);
        let parallelism = plan.worthwhile(batch, parallelism);
        inside_pool(parallelism, || {
            plan.synthesise(coefficients, maps, scratch, weighing, parallelism);
        });
        // The coefficients are half as many as the samples, and where they are moderate no sum of
        // them overflows.
        if coefficients
            .iter()
            .fold(true, |all, c| all & (c.abs() < MODERATE))
            || all_finite(maps)
        {
            Ok(())
        } else {
            Err(not_finite(
                "the values of the map",
                "the coefficients",
                coefficients,
            ))
        }
    }

    fn maps_to_sets(
        &self,
        batch: usize,
        maps: &[f64],
        coefficients: &mut [f64],
        scratch: &mut [f64],
        weighing: Weighing,
        parallelism: Parallelism,
    ) -> Result<()> {
        self.check_lengths(batch, coefficients.len(), maps.len(), scratch.len())?;
        let plan = &*self.0;
        let scratch = aligned(scratch);
        let parallelism = plan.worthwhile(batch, parallelism);
        inside_pool(parallelism, || {
            plan.analyse(maps, coefficients, scratch, weighing, parallelism);
        });
        // A sample that is not finite reaches the mean of its map, so only then is the map searched
        // for it.
        if all_finite(coefficients) {
            Ok(())
        } else {
            Err(not_finite("the coefficients", "the map", maps))
        }
    }

    fn check_lengths(
        &self,
        batch: usize,
        coefficients: usize,
        maps: usize,
        scratch: usize,
    ) -> Result<()> {
        check_length(
            "the coefficients of the batch",
            batch.saturating_mul(self.coefficient_count()),
            coefficients,
        )?;
        check_length(
            "the maps of the batch",
            batch.saturating_mul(self.0.grid.len()),
            maps,
        )?;
        let needed = self.scratch_len(batch);
        if scratch < needed {
            return Err(Error::Length {
                what: "the scratch",
                expected: needed,
                got: scratch,
            });
        }
        Ok(())
    }
}

/// A sum of (degree + 1)² harmonics with coefficients below this is below 10²⁰⁰.
const MODERATE: f64 = 1e150;

/// What goes between the sums over azimuth and those over rings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weighing {
    /// Nothing: synthesis and its adjoint.
    None,
    /// The weights of the quadrature: analysis and its adjoint.
    Quadrature,
}

/// How many maps share a recurrence.
const GROUP: usize = 3;

/// From so many maps on they go in eights: of fewer, threads would have too few eights to share.
const MANY: usize = 32;

/// Up to this degree a group is too little work to divide among threads, so groups are.
const SMALL_DEGREE: usize = 512;

/// Below so many steps of eight rings waking another thread costs more than it saves.
const SMALL_WORK: usize = 8000;

/// How many parts a thread's share of the work has, so that threads of unequal luck end together.
const PARTS: usize = 4;

impl Plan {
    /// How many maps go together, and how many such groups there are.
    fn groups(&self, batch: usize) -> (usize, usize) {
        let group = if self.by_eights(batch) {
            LANES
        } else if batch < GROUP {
            1
        } else {
            GROUP
        };
        (group, batch.div_ceil(group))
    }

    /// Whether threads take whole groups.
    fn by_groups(&self, batch: usize) -> bool {
        self.degree <= SMALL_DEGREE && batch >= 2 * GROUP
    }

    /// Whether groups are of eight maps, a lane each.
    fn by_eights(&self, batch: usize) -> bool {
        self.by_groups(batch) && batch >= MANY && self.meridian.is_none() && self.own.is_none()
    }

    fn worthwhile(&self, batch: usize, parallelism: Parallelism) -> Parallelism {
        let work = self.recurrence.steps_of_all() * self.recurrence.octets.len();
        if batch.saturating_mul(work) < SMALL_WORK {
            Parallelism::Sequential
        } else {
            parallelism
        }
    }

    /// Lines of the sums of one map between the two stages.
    fn spectrum_len(&self) -> usize {
        (self.orders + 1) * self.recurrence.octets.len() * 4
    }

    /// Lines that the work on one order needs.
    fn order_len(&self, group: usize) -> usize {
        let sums = (self.degree / 2 + 1).next_multiple_of(2).div_ceil(2) * group;
        let columns = (2 * group * (self.degree + 1)).div_ceil(LANES);
        let parts = self.recurrence.octets.len() * 4 * group;
        sums + columns.max(parts)
    }

    /// Lines that the analysis of orders needs beside those of one order.
    fn meridian_len(&self, group: usize) -> usize {
        self.meridian.as_ref().map_or(0, |meridian| {
            2 * meridian.work_len() + group * self.recurrence.octets.len() * 4 * LANES
        })
    }

    /// Lines that the work on sixteen rings needs.
    pub(super) fn rows_len(&self) -> usize {
        2 * match &self.own {
            Some(own) => own.work_len(),
            None => self.fft.work_len(),
        }
    }

    fn group_lines(&self, group: usize, parts: usize) -> usize {
        if group == LANES {
            // The maps that are left over go in threes.
            return self.eight_lines().max(self.group_lines(GROUP, parts));
        }
        group * self.spectrum_len()
            + parts * (self.order_len(group) + self.meridian_len(group)).max(self.rows_len())
    }

    fn scratch_lines(&self, batch: usize) -> usize {
        let (group, groups) = self.groups(batch);
        let parts = PARTS * self.workers;
        if self.by_groups(batch) {
            self.workers.min(groups) * self.group_lines(group, 1)
        } else {
            self.group_lines(group, parts)
        }
    }

    /// Synthesis group by group, with the adjoint of the quadrature's weights on the way where
    /// that is asked.
    fn synthesise(
        &self,
        sets: &[f64],
        maps: &mut [f64],
        scratch: &mut [Lanes],
        weighing: Weighing,
        parallelism: Parallelism,
    ) {
        let size = self.grid.len();
        let count = coefficient_count(self.degree, self.orders);
        let batch = sets.len() / count;
        let (group, groups) = self.groups(batch);
        let maps = Chunks {
            values: maps,
            length: group * size,
        };
        let run = |first: usize, maps: &mut [f64], scratch: &mut [Lanes], parallelism| {
            let sets = &sets[first * group * count..];
            for (sets, maps) in sets
                .chunks(group * count)
                .zip(maps.chunks_mut(group * size))
            {
                if maps.len() == LANES * size {
                    self.synthesise_eight(sets, maps, scratch, weighing);
                    continue;
                }
                let threes = maps.chunks_mut(GROUP * size);
                for (sets, maps) in sets.chunks(GROUP * count).zip(threes) {
                    if maps.len() == GROUP * size {
                        self.synthesise_group::<GROUP>(sets, maps, scratch, weighing, parallelism);
                        continue;
                    }
                    for (set, map) in sets.chunks_exact(count).zip(maps.chunks_exact_mut(size)) {
                        self.synthesise_group::<1>(set, map, scratch, weighing, parallelism);
                    }
                }
            }
        };
        if self.by_groups(batch) {
            let share = self.group_lines(group, 1);
            divided(
                parallelism,
                0..groups,
                maps,
                scratch,
                share,
                &|items, maps, scratch| {
                    run(items.start, maps.values, scratch, Parallelism::Sequential);
                },
            );
        } else {
            run(0, maps.values, scratch, parallelism);
        }
    }

    fn synthesise_group<const MAPS: usize>(
        &self,
        sets: &[f64],
        maps: &mut [f64],
        scratch: &mut [Lanes],
        weighing: Weighing,
        parallelism: Parallelism,
    ) {
        let octets = self.recurrence.octets.len();
        let orders = self.orders + 1;
        let (spectra, scratch) = scratch.split_at_mut(MAPS * self.spectrum_len());
        let spectra: &mut [Quad] = spectra.as_chunks_mut().0;
        // Order by order: coefficients to the cosine and sine sums of every ring, [m][map][octet].
        divided(
            parallelism,
            0..orders,
            Chunks {
                values: &mut *spectra,
                length: MAPS * octets,
            },
            scratch,
            self.order_len(MAPS),
            &|orders, spectra, scratch| {
                wide!(self.level, simd => {
                    for (m, out) in orders.zip(spectra.values.chunks_exact_mut(MAPS * octets)) {
                        self.synthesise_order::<_, MAPS>(simd, m, sets, out, scratch);
                    }
                });
            },
        );
        if weighing == Weighing::Quadrature {
            self.weigh_sums::<MAPS>(spectra, scratch, parallelism);
        }
        // Sixteen rings after another: those sums to samples.
        let spectra = &*spectra;
        for (index, map) in maps.chunks_exact_mut(self.grid.len()).enumerate() {
            divided(
                parallelism,
                0..octets,
                Octets::new(map, &self.starts),
                scratch,
                self.rows_len(),
                &|range, rows, scratch| {
                    wide!(self.level, simd => {
                        for (octet, rows) in range.zip(rows) {
                            let sums = &spectra[index * octets + octet..];
                            let stride = MAPS * octets;
                            if let Some(own) = &self.own {
                                let sums = (sums, stride, orders);
                                own.synthesise(simd, octet, sums, rows, scratch);
                            } else {
                                self.synthesise_rows(simd, sums, stride, rows, scratch);
                            }
                        }
                    });
                },
            );
        }
    }

    /// The quadrature's weights on the sums of every ring, [m][map][octet]: the adjoint of what
    /// analysis does to them, and the same, for the weights are a diagonal and what goes along
    /// meridians is symmetric on their circle.
    fn weigh_sums<const MAPS: usize>(
        &self,
        sums: &mut [Quad],
        scratch: &mut [Lanes],
        parallelism: Parallelism,
    ) {
        let octets = self.recurrence.octets.len();
        let eight = LANES * MAPS * octets;
        divided(
            parallelism,
            0..(self.orders + 1).div_ceil(LANES),
            Chunks {
                values: sums,
                length: eight,
            },
            scratch,
            self.order_len(MAPS) + self.meridian_len(MAPS.max(2)),
            &|range, sums, scratch| {
                wide!(self.level, simd => {
                    for (index, sums) in range.zip(sums.values.chunks_mut(eight)) {
                        self.weigh_eight_orders::<_, MAPS>(simd, index * LANES, sums, scratch);
                    }
                });
            },
        );
    }

    /// As [`weigh_sums`](Self::weigh_sums), eight orders from `first` or as many as there are.
    #[inline(always)]
    fn weigh_eight_orders<S: Simd, const MAPS: usize>(
        &self,
        simd: S,
        first: usize,
        sums: &mut [Quad],
        scratch: &mut [Lanes],
    ) {
        let octets = self.recurrence.octets.len();
        let orders = sums.len() / (MAPS * octets);
        if let Some(meridian) = &self.meridian {
            let (buffer, rest) = scratch.split_at_mut(2 * meridian.work_len());
            let buffer: &mut [Element] = buffer.as_chunks_mut().0;
            let rest: &mut [Quad] = rest.as_chunks_mut().0;
            let (by_octet, projected) = rest.split_at_mut(octets * LANES);
            let projected = &mut projected[..octets * LANES];
            for map in 0..MAPS {
                let at = |i: usize, octet: usize| (i * MAPS + map) * octets + octet;
                for octet in 0..octets {
                    for i in 0..orders {
                        by_octet[octet * LANES + i] = sums[at(i, octet)];
                    }
                }
                meridian.project(simd, first, orders, (by_octet, LANES), projected, buffer);
                for octet in 0..octets {
                    for i in 0..orders {
                        sums[at(i, octet)] = projected[octet * LANES + i];
                    }
                }
            }
        }
        for (index, quad) in sums.iter_mut().enumerate() {
            let weights = f64x8::load_array_ref(simd, &self.weights[index % octets]);
            for part in quad {
                (weights * f64x8::load_array_ref(simd, part)).store_array(part);
            }
        }
    }

    #[inline(always)]
    fn synthesise_order<S: Simd, const MAPS: usize>(
        &self,
        simd: S,
        m: usize,
        sets: &[f64],
        out: &mut [Quad],
        slot: &mut [Lanes],
    ) {
        let steps = self.recurrence.steps(m).len();
        let set_len = sets.len() / MAPS;
        let start = column_start(self.degree, m);
        let count = self.degree + 1 - m;
        let used = if m == 0 { count } else { 2 * count };
        let (sums, columns) = slot.split_at_mut((MAPS * steps).div_ceil(2));
        let mut columns = columns.as_flattened_mut();
        let columns = std::array::from_fn(|map| {
            let column = &sets[map * set_len + start..][..used];
            // Columns are read backwards. Several sets lie beyond the nearest cache, from where a
            // copy forwards, which processors foresee, brings them faster; order 0 gets the sines
            // that it lacks.
            if MAPS == 1 && m > 0 {
                return column;
            }
            let copy = columns.split_off_mut(..2 * count).unwrap_or_default();
            copy[..used].copy_from_slice(column);
            copy[used..].fill(0.0);
            copy
        });
        let sums = &mut sums.as_flattened_mut().as_chunks_mut().0.as_chunks_mut().0[..steps];
        self.recurrence.prepare::<MAPS>(m, &columns, sums);
        let octets = out.len() / MAPS;
        let mut rest = out;
        let mut out: [&mut [Quad]; MAPS] =
            std::array::from_fn(|_| rest.split_off_mut(..octets).unwrap_or_default());
        match &self.table {
            Some(table) => table.synthesise(simd, &self.recurrence, m, sums, &mut out),
            None => kernel::synthesise(simd, &self.recurrence, m, sums, &mut out),
        }
    }

    /// Eight northern rows and their mirror images from their sums; `sums[m · stride]` is order
    /// m's.
    #[inline(always)]
    pub(super) fn synthesise_rows<S: Simd>(
        &self,
        simd: S,
        sums: &[Quad],
        stride: usize,
        rows: Rows<&mut [f64]>,
        slot: &mut [Lanes],
    ) {
        let columns = self.grid.columns();
        let buffer: &mut [Element] = slot.as_chunks_mut().0;
        let zero = [[0.0; LANES]; 2];
        for k in self.orders + 1..columns - self.orders {
            buffer[self.fft.position(k)] = zero;
        }
        let sign = f64x8::splat(simd, if self.grid.is_descending() { -1.0 } else { 1.0 });
        for (m, (sums, phase)) in sums.iter().step_by(stride).zip(&self.phases).enumerate() {
            let [nc, ns, sc, ss] = load_quad(simd, sums);
            let (c, s) = (f64x8::splat(simd, phase[0]), f64x8::splat(simd, phase[1]));
            // (cosine − i sine) e^(i m φ₀)/2
            let (nr, ni) = (nc.mul_add(c, ns * s), sign * nc.mul_sub(s, ns * c));
            let (sr, si) = (sc.mul_add(c, ss * s), sign * sc.mul_sub(s, ss * c));
            let element = &mut buffer[self.fft.position(m)];
            (nr - si).store_array(&mut element[0]);
            (ni + sr).store_array(&mut element[1]);
            if m > 0 {
                let element = &mut buffer[self.fft.position(columns - m)];
                (nr + si).store_array(&mut element[0]);
                (sr - ni).store_array(&mut element[1]);
            }
        }
        self.fft.inverse(simd, buffer);
        for (part, mut rows) in rows.into_iter().enumerate() {
            let mut chunks = buffer[..columns].chunks_exact(LANES);
            let mut column = 0;
            for chunk in &mut chunks {
                let mut lanes = [sign; LANES];
                for (lane, element) in lanes.iter_mut().zip(chunk) {
                    *lane = f64x8::load_array_ref(simd, &element[part]);
                }
                for (row, values) in rows.iter_mut().zip(transpose(lanes)) {
                    if let Some(out) = row.get_mut(column..).and_then(<[f64]>::first_chunk_mut) {
                        values.store_array(out);
                    }
                }
                column += LANES;
            }
            for element in chunks.remainder() {
                for (row, value) in rows.iter_mut().zip(element[part]) {
                    if let Some(out) = row.get_mut(column) {
                        *out = value;
                    }
                }
                column += 1;
            }
        }
    }

    /// Analysis group by group; without the quadrature's weights it is the adjoint of synthesis.
    fn analyse(
        &self,
        maps: &[f64],
        sets: &mut [f64],
        scratch: &mut [Lanes],
        weighing: Weighing,
        parallelism: Parallelism,
    ) {
        let size = self.grid.len();
        let count = coefficient_count(self.degree, self.orders);
        let batch = sets.len() / count;
        let (group, groups) = self.groups(batch);
        let sets = Chunks {
            values: sets,
            length: group * count,
        };
        let run = |first: usize, sets: &mut [f64], scratch: &mut [Lanes], parallelism| {
            let maps = &maps[first * group * size..];
            for (sets, maps) in sets
                .chunks_mut(group * count)
                .zip(maps.chunks(group * size))
            {
                if sets.len() == LANES * count {
                    self.analyse_eight(maps, sets, scratch, weighing);
                    continue;
                }
                let threes = maps.chunks(GROUP * size);
                for (sets, maps) in sets.chunks_mut(GROUP * count).zip(threes) {
                    if sets.len() == GROUP * count {
                        self.analyse_group::<GROUP>(maps, sets, scratch, weighing, parallelism);
                        continue;
                    }
                    for (set, map) in sets.chunks_exact_mut(count).zip(maps.chunks_exact(size)) {
                        self.analyse_group::<1>(map, set, scratch, weighing, parallelism);
                    }
                }
            }
        };
        if self.by_groups(batch) {
            let share = self.group_lines(group, 1);
            divided(
                parallelism,
                0..groups,
                sets,
                scratch,
                share,
                &|items, sets, scratch| {
                    run(items.start, sets.values, scratch, Parallelism::Sequential);
                },
            );
        } else {
            run(0, sets.values, scratch, parallelism);
        }
    }

    fn analyse_group<const MAPS: usize>(
        &self,
        maps: &[f64],
        mut sets: &mut [f64],
        scratch: &mut [Lanes],
        weighing: Weighing,
        parallelism: Parallelism,
    ) {
        let octets = self.recurrence.octets.len();
        let orders = self.orders + 1;
        let (spectra, scratch) = scratch.split_at_mut(MAPS * self.spectrum_len());
        let spectra: &mut [Quad] = spectra.as_chunks_mut().0;
        // Sixteen rings after another: samples to cosine and sine sums, [map][octet][m].
        divided(
            parallelism,
            0..MAPS * octets,
            Chunks {
                values: &mut *spectra,
                length: orders,
            },
            scratch,
            self.rows_len(),
            &|range, spectra, scratch| {
                wide!(self.level, simd => {
                    for (index, out) in range.zip(spectra.values.chunks_exact_mut(orders)) {
                        let (map, octet) = (index / octets, index % octets);
                        let map = &maps[map * self.grid.len()..][..self.grid.len()];
                        let rows = self.rows_of(octet, map);
                        if let Some(own) = &self.own {
                            own.analyse(simd, octet, rows, out, scratch);
                        } else {
                            self.analyse_rows(simd, rows, out, scratch);
                        }
                    }
                });
            },
        );
        // Order by order: those sums to coefficients.
        let spectra = &*spectra;
        let length = sets.len() / MAPS;
        let sets = std::array::from_fn(|_| sets.split_off_mut(..length).unwrap_or_default());
        divided(
            parallelism,
            0..orders,
            Orders::<MAPS> {
                sets,
                first: 0,
                degree: self.degree,
            },
            scratch,
            self.order_len(MAPS) + self.meridian_len(MAPS),
            &|range, columns, scratch| {
                wide!(self.level, simd => self.analyse_orders::<_, MAPS>(simd, range, columns, spectra, scratch, weighing));
            },
        );
    }

    /// The rows of an octet.
    fn rows_of<'a>(&self, octet: usize, map: &'a [f64]) -> Rows<&'a [f64]> {
        let rings = self.grid.rings();
        let row = |row: usize| &map[self.starts[row]..self.starts[row + 1]];
        let ring = |lane: usize| octet * LANES + lane;
        [
            std::array::from_fn(|lane| match ring(lane) {
                ring if ring < rings.div_ceil(2) => row(ring),
                _ => &[],
            }),
            std::array::from_fn(|lane| match ring(lane) {
                ring if ring < rings / 2 => row(rings - 1 - ring),
                _ => &[],
            }),
        ]
    }

    /// Eight northern rows and their mirror images to their sums over azimuth, `out[m]`.
    #[inline(always)]
    pub(super) fn analyse_rows<S: Simd>(
        &self,
        simd: S,
        rows: Rows<&[f64]>,
        out: &mut [Quad],
        slot: &mut [Lanes],
    ) {
        let columns = self.grid.columns();
        let buffer: &mut [Element] = slot.as_chunks_mut().0;
        for (part, rows) in rows.iter().enumerate() {
            let mut chunks = buffer[..columns].chunks_exact_mut(LANES);
            let mut column = 0;
            for chunk in &mut chunks {
                let mut lanes = [f64x8::splat(simd, 0.0); LANES];
                for (lane, row) in lanes.iter_mut().zip(rows) {
                    if let Some(values) = row.get(column..).and_then(<[f64]>::first_chunk) {
                        *lane = f64x8::load_array_ref(simd, values);
                    }
                }
                for (element, values) in chunk.iter_mut().zip(transpose(lanes)) {
                    values.store_array(&mut element[part]);
                }
                column += LANES;
            }
            for element in chunks.into_remainder() {
                element[part] = rows.map(|row| row.get(column).copied().unwrap_or(0.0));
                column += 1;
            }
        }
        self.fft.forward(simd, buffer);
        let sign = f64x8::splat(simd, if self.grid.is_descending() { -1.0 } else { 1.0 });
        for (m, (out, phase)) in out.iter_mut().zip(&self.phases).enumerate() {
            let load =
                |k: usize| buffer[self.fft.position(k)].map(|part| f64x8::load_array(simd, part));
            let [ar, ai] = load(m);
            let [br, bi] = load((columns - m) % columns);
            // The two rings' spectra, doubled; for m > 0 the phase holds the half.
            let (nr, ni) = (ar + br, sign * (ai - bi));
            let (sr, si) = (ai + bi, sign * (br - ar));
            let half = if m == 0 { 0.5 } else { 1.0 };
            let (c, s) = (
                f64x8::splat(simd, half * phase[0]),
                f64x8::splat(simd, half * phase[1]),
            );
            // times e^(−i m φ₀): cosine − i sine
            nr.mul_add(c, ni * s).store_array(&mut out[0]);
            nr.mul_sub(s, ni * c).store_array(&mut out[1]);
            sr.mul_add(c, si * s).store_array(&mut out[2]);
            sr.mul_sub(s, si * c).store_array(&mut out[3]);
        }
    }

    /// Some orders of the coefficients from the sums of all rings, `spectra[(map · octets + octet)
    /// · orders + m]`.
    #[inline(always)]
    fn analyse_orders<S: Simd, const MAPS: usize>(
        &self,
        simd: S,
        range: Range<usize>,
        columns: Orders<'_, MAPS>,
        spectra: &[Quad],
        scratch: &mut [Lanes],
        weighing: Weighing,
    ) {
        let (orders, octets) = (self.orders + 1, self.recurrence.octets.len());
        let (scratch, rest) = scratch.split_at_mut(self.order_len(MAPS));
        let meridian = self.meridian.as_ref();
        let Some(meridian) = meridian.filter(|_| weighing == Weighing::Quadrature) else {
            for (m, columns) in range.zip(columns) {
                let spectra = (&spectra[m..], orders);
                self.analyse_order::<_, MAPS>(simd, m, spectra, columns, scratch, weighing);
            }
            return;
        };
        let (buffer, projected) = rest.split_at_mut(2 * meridian.work_len());
        let buffer: &mut [Element] = buffer.as_chunks_mut().0;
        let projected: &mut [Quad] = projected.as_chunks_mut().0;
        let start = range.start;
        for (m, columns) in range.clone().zip(columns) {
            let lane = (m - start) % LANES;
            if lane == 0 {
                for map in 0..MAPS {
                    meridian.project(
                        simd,
                        m,
                        LANES.min(range.end - m),
                        (&spectra[map * octets * orders + m..], orders),
                        &mut projected[map * octets * LANES..][..octets * LANES],
                        buffer,
                    );
                }
            }
            let spectra = (&projected[lane..], LANES);
            self.analyse_order::<_, MAPS>(simd, m, spectra, columns, scratch, weighing);
        }
    }

    /// Order m of the coefficients from its sums, `spectra[(map · octets + octet) · stride]`.
    #[inline(always)]
    fn analyse_order<S: Simd, const MAPS: usize>(
        &self,
        simd: S,
        m: usize,
        (spectra, stride): (&[Quad], usize),
        columns: [&mut [f64]; MAPS],
        slot: &mut [Lanes],
        weighing: Weighing,
    ) {
        let octets = self.recurrence.octets.len();
        let steps = self.recurrence.steps(m).len();
        let (parts, sums) = slot.split_at_mut(MAPS * octets * 4);
        let parts: &mut [Quad] = parts.as_chunks_mut().0;
        let sums = &mut sums[..MAPS * steps / 2];
        sums.fill([0.0; LANES]);
        for (index, (parts, sums)) in parts
            .iter_mut()
            .zip(spectra.iter().step_by(stride))
            .enumerate()
        {
            let octet = index % octets;
            let w = match weighing {
                Weighing::Quadrature => f64x8::load_array_ref(simd, &self.weights[octet]),
                Weighing::None => f64x8::splat(simd, 1.0),
            };
            let wx = w * f64x8::load_array_ref(simd, &self.recurrence.octets[octet].x);
            let [nc, ns, sc, ss] = load_quad(simd, sums);
            ((nc + sc) * w).store_array(&mut parts[0]);
            ((ns + ss) * w).store_array(&mut parts[1]);
            ((nc - sc) * wx).store_array(&mut parts[2]);
            ((ns - ss) * wx).store_array(&mut parts[3]);
        }
        let parts: [&[Quad]; MAPS] =
            std::array::from_fn(|map| &parts[map * octets..(map + 1) * octets]);
        let sums: &mut [[Lanes; MAPS]] = sums.as_chunks_mut().0;
        match &self.table {
            Some(table) => table.analyse(simd, &self.recurrence, m, &parts, sums),
            None => kernel::analyse(simd, &self.recurrence, m, &parts, sums),
        }
        self.recurrence.finish::<MAPS>(m, sums, columns);
    }
}

#[inline(always)]
pub(super) fn load_quad<S: Simd>(simd: S, quad: &Quad) -> [f64x8<S>; 4] {
    [
        f64x8::load_array_ref(simd, &quad[0]),
        f64x8::load_array_ref(simd, &quad[1]),
        f64x8::load_array_ref(simd, &quad[2]),
        f64x8::load_array_ref(simd, &quad[3]),
    ]
}

impl std::fmt::Debug for Transform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Transform")
            .field("latitudes", &self.0.grid.latitudes())
            .field("rings", &self.0.grid.rings())
            .field("columns", &self.0.grid.columns())
            .field("degree", &self.0.degree)
            .field("orders", &self.0.orders)
            .finish()
    }
}
