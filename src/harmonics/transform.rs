//! Analysis and synthesis on iso-latitude grids.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use fearless_simd::f64x8;
use fearless_simd::prelude::*;

use super::coefficients::{Coefficients, coefficient_count};
use super::kernel::Quad;
use super::lane::Lane;
use super::legendre_table::LegendreTable;
use super::meridian::Meridian;
use super::own_rings::OwnRings;
use super::recurrence::{LANES, Lanes, Recurrence};
use super::ring_fft::Element;
use super::simd::wide;
use super::stages::{PARTS, Stages, Weighing};
use super::work::{Bundles, Chunks, Orders, divided, inside_pool};
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
    pub(super) stages: Stages,
    /// The transforms along rings, where those are not all alike.
    own: Option<OwnRings>,
    /// Where the degree is more than weights on the rings serve: what makes them serve.
    meridian: Option<Meridian>,
}

/// Refuses a degree or orders that a grid does not serve, or a transform.
pub(super) fn check_degree(grid: &Grid, degree: usize, orders: usize) -> Result<()> {
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
    Ok(())
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
        check_degree(grid, degree, orders)?;
        let level = vectors::level();
        let recurrence = Recurrence::new(grid, degree, orders, level);
        let table = LegendreTable::new(&recurrence, &recurrence, orders, level);
        let by_weights =
            degree <= grid.max_degree_of_weights() || grid.latitudes() == Latitudes::Healpix;
        let meridian = (!by_weights).then(|| Meridian::new(grid));
        let weight = |ring| match &meridian {
            Some(meridian) => meridian.weight(ring) * (2.0 * PI / grid.columns() as f64),
            None => grid.ring_weight(ring),
        };
        let size = (degree, orders);
        Ok(Self(Arc::new(Plan {
            stages: Stages::new(grid, size, level, (recurrence, table), weight),
            own: (!grid.has_rings_alike()).then(|| OwnRings::new(grid)),
            meridian,
        })))
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.0.stages.grid
    }

    /// The largest degree l.
    pub fn degree(&self) -> usize {
        self.0.stages.degree
    }

    /// The largest order |m|.
    pub fn orders(&self) -> usize {
        self.0.stages.orders
    }

    /// How many coefficients one map has.
    pub fn coefficient_count(&self) -> usize {
        coefficient_count(self.0.stages.degree, self.0.stages.orders)
    }

    /// How many values of scratch the `_into` functions need for a batch of so many maps.
    pub fn scratch_len(&self, batch: usize) -> usize {
        LANES * self.0.scratch_lines(batch) + LANES - 1
    }

    /// How much memory the plan's tables take, in bytes.
    pub fn table_bytes(&self) -> usize {
        self.0.stages.table_bytes()
    }

    /// The map of a coefficient set, `rings × columns`.
    ///
    /// # Errors
    /// [`Error::Length`] where the set has another degree or other orders than the plan;
    /// [`Error::NotFinite`] where a coefficient is not finite, [`Error::Overflow`] where they are
    /// and the map is not; [`Error::Memory`] where there is none.
    pub fn synthesise(&self, coefficients: &Coefficients) -> Result<Vec<f64>> {
        self.check_shape(coefficients)?;
        let mut map = allocate("the map", self.0.stages.grid.len())?;
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
        Coefficients::from_vec(self.0.stages.degree, self.0.stages.orders, values)
    }

    pub(super) fn check_shape(&self, coefficients: &Coefficients) -> Result<()> {
        if coefficients.degree() != self.0.stages.degree
            || coefficients.orders() != self.0.stages.orders
        {
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
        Coefficients::from_vec(self.0.stages.degree, self.0.stages.orders, values)
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
        let mut map = allocate("the map", self.0.stages.grid.len())?;
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
        let scratch = f64::aligned(scratch);
        let parallelism = plan.stages.worthwhile(batch, parallelism);
        inside_pool(parallelism, || {
            plan.synthesise(coefficients, maps, scratch, weighing, parallelism);
        });
        // The coefficients are half as many as the samples, and where they are moderate no sum of
        // them overflows.
        if coefficients
            .iter()
            .fold(true, |all, c| all & (c.abs() < f64::MODERATE))
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
        let scratch = f64::aligned(scratch);
        let parallelism = plan.stages.worthwhile(batch, parallelism);
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
            batch.saturating_mul(self.0.stages.grid.len()),
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

/// How many maps share a recurrence.
const GROUP: usize = 3;

/// From so many maps on they go in eights: of fewer, threads would have too few eights to share.
const MANY: usize = 32;

/// Up to this degree a group is too little work to divide among threads, so groups are.
const SMALL_DEGREE: usize = 512;

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
        self.stages.degree <= SMALL_DEGREE && batch >= 2 * GROUP
    }

    /// Whether groups are of eight maps, a lane each.
    fn by_eights(&self, batch: usize) -> bool {
        self.by_groups(batch) && batch >= MANY && self.meridian.is_none() && self.own.is_none()
    }

    /// Lines that the analysis of orders needs beside those of one order.
    fn meridian_len(&self, group: usize) -> usize {
        self.meridian.as_ref().map_or(0, |meridian| {
            2 * meridian.work_len() + group * self.stages.recurrence.bundles.len() * 4 * LANES
        })
    }

    /// Lines that the work on sixteen rings needs.
    pub(super) fn rows_len(&self) -> usize {
        2 * match &self.own {
            Some(own) => own.work_len(),
            None => return self.stages.rows_len(),
        }
    }

    fn group_lines(&self, group: usize, parts: usize) -> usize {
        if group == LANES {
            // The maps that are left over go in threes.
            return self.eight_lines().max(self.group_lines(GROUP, parts));
        }
        group * self.stages.spectrum_len()
            + parts * (self.stages.order_len(group) + self.meridian_len(group)).max(self.rows_len())
    }

    fn scratch_lines(&self, batch: usize) -> usize {
        let (group, groups) = self.groups(batch);
        let parts = PARTS * self.stages.workers;
        if self.by_groups(batch) {
            self.stages.workers.min(groups) * self.group_lines(group, 1)
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
        let size = self.stages.grid.len();
        let count = coefficient_count(self.stages.degree, self.stages.orders);
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
        let bundles = self.stages.recurrence.bundles.len();
        let orders = self.stages.orders + 1;
        let (spectra, scratch) = scratch.split_at_mut(MAPS * self.stages.spectrum_len());
        let spectra: &mut [Quad] = spectra.as_chunks_mut().0;
        // Order by order: coefficients to the cosine and sine sums of every ring, [m][map][bundle].
        divided(
            parallelism,
            0..orders,
            Chunks {
                values: &mut *spectra,
                length: MAPS * bundles,
            },
            scratch,
            self.stages.order_len(MAPS),
            &|orders, spectra, scratch| {
                wide!(self.stages.level, simd => {
                    for (m, out) in orders.zip(spectra.values.chunks_exact_mut(MAPS * bundles)) {
                        self.stages.synthesise_order::<_, MAPS>(simd, m, sets, out, scratch);
                    }
                });
            },
        );
        if weighing == Weighing::Quadrature {
            self.weigh_sums::<MAPS>(spectra, scratch, parallelism);
        }
        // Sixteen rings after another: those sums to samples.
        let spectra = &*spectra;
        for (index, map) in maps.chunks_exact_mut(self.stages.grid.len()).enumerate() {
            divided(
                parallelism,
                0..bundles,
                Bundles::new(map, &self.stages.starts),
                scratch,
                self.rows_len(),
                &|range, rows, scratch| {
                    wide!(self.stages.level, simd => {
                        for (bundle, rows) in range.zip(rows) {
                            let sums = &spectra[index * bundles + bundle..];
                            let stride = MAPS * bundles;
                            if let Some(own) = &self.own {
                                let sums = (sums, stride, orders);
                                own.synthesise(simd, bundle, sums, rows, scratch);
                            } else {
                                self.stages.synthesise_rows(simd, sums, stride, rows, scratch);
                            }
                        }
                    });
                },
            );
        }
    }

    /// The quadrature's weights on the sums of every ring, [m][map][bundle]: the adjoint of what
    /// analysis does to them, and the same, for the weights are a diagonal and what goes along
    /// meridians is symmetric on their circle.
    fn weigh_sums<const MAPS: usize>(
        &self,
        sums: &mut [Quad],
        scratch: &mut [Lanes],
        parallelism: Parallelism,
    ) {
        let bundles = self.stages.recurrence.bundles.len();
        let eight = LANES * MAPS * bundles;
        divided(
            parallelism,
            0..(self.stages.orders + 1).div_ceil(LANES),
            Chunks {
                values: sums,
                length: eight,
            },
            scratch,
            self.stages.order_len(MAPS) + self.meridian_len(MAPS.max(2)),
            &|range, sums, scratch| {
                wide!(self.stages.level, simd => {
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
        let bundles = self.stages.recurrence.bundles.len();
        let orders = sums.len() / (MAPS * bundles);
        if let Some(meridian) = &self.meridian {
            let (buffer, rest) = scratch.split_at_mut(2 * meridian.work_len());
            let buffer: &mut [Element] = buffer.as_chunks_mut().0;
            let rest: &mut [Quad] = rest.as_chunks_mut().0;
            let (by_bundle, projected) = rest.split_at_mut(bundles * LANES);
            let projected = &mut projected[..bundles * LANES];
            for map in 0..MAPS {
                let at = |i: usize, bundle: usize| (i * MAPS + map) * bundles + bundle;
                for bundle in 0..bundles {
                    for i in 0..orders {
                        by_bundle[bundle * LANES + i] = sums[at(i, bundle)];
                    }
                }
                meridian.project(simd, first, orders, (by_bundle, LANES), projected, buffer);
                for bundle in 0..bundles {
                    for i in 0..orders {
                        sums[at(i, bundle)] = projected[bundle * LANES + i];
                    }
                }
            }
        }
        for (index, quad) in sums.iter_mut().enumerate() {
            let weights = f64x8::load_array_ref(simd, &self.stages.weights[index % bundles]);
            for part in quad {
                (weights * f64x8::load_array_ref(simd, part)).store_array(part);
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
        let size = self.stages.grid.len();
        let count = coefficient_count(self.stages.degree, self.stages.orders);
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
        let bundles = self.stages.recurrence.bundles.len();
        let orders = self.stages.orders + 1;
        let (spectra, scratch) = scratch.split_at_mut(MAPS * self.stages.spectrum_len());
        let spectra: &mut [Quad] = spectra.as_chunks_mut().0;
        // Sixteen rings after another: samples to cosine and sine sums, [map][bundle][m].
        divided(
            parallelism,
            0..MAPS * bundles,
            Chunks {
                values: &mut *spectra,
                length: orders,
            },
            scratch,
            self.rows_len(),
            &|range, spectra, scratch| {
                wide!(self.stages.level, simd => {
                    for (index, out) in range.zip(spectra.values.chunks_exact_mut(orders)) {
                        let (map, bundle) = (index / bundles, index % bundles);
                        let map = &maps[map * self.stages.grid.len()..][..self.stages.grid.len()];
                        let rows = self.stages.rows_of(bundle, map);
                        if let Some(own) = &self.own {
                            own.analyse(simd, bundle, rows, out, scratch);
                        } else {
                            self.stages.analyse_rows(simd, rows, out, scratch);
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
            Orders::<_, MAPS> {
                sets,
                first: 0,
                degree: self.stages.degree,
            },
            scratch,
            self.stages.order_len(MAPS) + self.meridian_len(MAPS),
            &|range, columns, scratch| {
                wide!(self.stages.level, simd => self.analyse_orders::<_, MAPS>(simd, range, columns, spectra, scratch, weighing));
            },
        );
    }

    /// Some orders of the coefficients from the sums of all rings, `spectra[(map · bundles + bundle)
    /// · orders + m]`.
    #[inline(always)]
    fn analyse_orders<S: Simd, const MAPS: usize>(
        &self,
        simd: S,
        range: Range<usize>,
        columns: Orders<'_, f64, MAPS>,
        spectra: &[Quad],
        scratch: &mut [Lanes],
        weighing: Weighing,
    ) {
        let (orders, bundles) = (self.stages.orders + 1, self.stages.recurrence.bundles.len());
        let (scratch, rest) = scratch.split_at_mut(self.stages.order_len(MAPS));
        let meridian = self.meridian.as_ref();
        let Some(meridian) = meridian.filter(|_| weighing == Weighing::Quadrature) else {
            for (m, columns) in range.zip(columns) {
                let spectra = (&spectra[m..], orders);
                self.stages
                    .analyse_order::<_, MAPS>(simd, m, spectra, columns, scratch, weighing);
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
                        (&spectra[map * bundles * orders + m..], orders),
                        &mut projected[map * bundles * LANES..][..bundles * LANES],
                        buffer,
                    );
                }
            }
            let spectra = (&projected[lane..], LANES);
            self.stages
                .analyse_order::<_, MAPS>(simd, m, spectra, columns, scratch, weighing);
        }
    }
}

impl std::fmt::Debug for Transform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Transform")
            .field("latitudes", &self.0.stages.grid.latitudes())
            .field("rings", &self.0.stages.grid.rings())
            .field("columns", &self.0.stages.grid.columns())
            .field("degree", &self.0.stages.degree)
            .field("orders", &self.0.stages.orders)
            .finish()
    }
}
