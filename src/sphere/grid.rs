//! Iso-latitude grids: rings of equally spaced points.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

use std::f64::consts::PI;

use crate::numeric::quadrature::{Rule, cos_turn};
use crate::{Error, Result};

/// How the colatitudes of a [`Grid`] are chosen.
///
/// ```
/// use lobes::sphere::{Grid, Latitudes};
/// assert_eq!(Grid::fejer(4, 8)?.latitudes(), Latitudes::Fejer);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Latitudes {
    /// Gauss–Legendre nodes: n rings carry degree n − 1.
    GaussLegendre,
    /// θᵢ = π i/(n − 1), the poles included: n rings carry degree n − 2.
    ClenshawCurtis,
    /// θᵢ = π (i + ½)/n, the pixel centres of a lat-long map: n rings carry degree n − 1.
    Fejer,
}

/// A grid of rings of constant colatitude, each of the same number of equally spaced points.
///
/// Directions are those of the harmonic frame: θ from the pole +z, φ = atan2(y, x). A map on the
/// grid is row-major, `map[ring * columns + column]`, rings from the north pole to the south.
/// Column j has φ_j = φ₀ + 2π j/columns, or φ₀ − 2π j/columns where the grid is
/// [descending](Grid::descending).
///
/// ```
/// use lobes::sphere::Grid;
/// let grid = Grid::gauss_legendre(64, 128)?;
/// assert_eq!(grid.max_degree(), 63);
/// let sphere: f64 = (0..64).map(|ring| 128.0 * grid.ring_weight(ring)).sum();
/// assert!((sphere - 4.0 * std::f64::consts::PI).abs() < 1e-13);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    latitudes: Latitudes,
    rule: Rule,
    columns: usize,
    first_azimuth: f64,
    descending: bool,
}

/// The largest number of columns of a [`Grid`].
pub const MAX_COLUMNS: usize = 32768;

impl Grid {
    fn new(latitudes: Latitudes, rule: Rule, columns: usize) -> Result<Self> {
        if !(1..=MAX_COLUMNS).contains(&columns) {
            return Err(Error::Domain {
                what: "the number of columns of a grid",
                value: columns as f64,
                allowed: "in 1 ..= 32768",
            });
        }
        Ok(Self {
            latitudes,
            rule,
            columns,
            first_azimuth: 0.0,
            descending: false,
        })
    }

    /// Rings at Gauss–Legendre nodes, the first azimuth 0.
    ///
    /// # Errors
    /// [`Error::Domain`] unless 1 ≤ rings ≤ 16384 and 1 ≤ columns ≤ 32768.
    pub fn gauss_legendre(rings: usize, columns: usize) -> Result<Self> {
        Self::new(
            Latitudes::GaussLegendre,
            Rule::gauss_legendre(rings)?,
            columns,
        )
    }

    /// Rings at θᵢ = π i/(rings − 1), both poles included, the first azimuth 0: n rings carry
    /// degree n − 2.
    ///
    /// # Errors
    /// [`Error::Domain`] unless 2 ≤ rings ≤ 16384 and 1 ≤ columns ≤ 32768.
    pub fn clenshaw_curtis(rings: usize, columns: usize) -> Result<Self> {
        Self::new(
            Latitudes::ClenshawCurtis,
            Rule::clenshaw_curtis(rings)?,
            columns,
        )
    }

    /// Rings at θᵢ = π (i + ½)/rings and azimuths at φ_j = 2π (j + ½)/columns: pixel centres. n
    /// rings carry degree n − 1.
    ///
    /// # Errors
    /// [`Error::Domain`] unless 1 ≤ rings ≤ 16384 and 1 ≤ columns ≤ 32768.
    pub fn fejer(rings: usize, columns: usize) -> Result<Self> {
        let grid = Self::new(Latitudes::Fejer, Rule::fejer(rings)?, columns)?;
        Ok(Self {
            first_azimuth: PI / columns as f64,
            ..grid
        })
    }

    /// The grid of this crate's lat-long maps: [`fejer`](Grid::fejer) with φ_j = 2π (1 − (j +
    /// ½)/columns).
    ///
    /// # Errors
    /// [`Error::Domain`] unless 1 ≤ rows ≤ 16384 and 1 ≤ columns ≤ 32768.
    pub fn lat_long(rows: usize, columns: usize) -> Result<Self> {
        let grid = Self::fejer(rows, columns)?;
        Ok(Self {
            first_azimuth: -grid.first_azimuth,
            descending: true,
            ..grid
        })
    }

    /// The same grid with the first column at azimuth `phi0`, in radians.
    #[must_use]
    pub fn with_first_azimuth(self, phi0: f64) -> Self {
        Self {
            first_azimuth: phi0,
            ..self
        }
    }

    /// The same grid with φ falling as the column grows, from the same first azimuth.
    #[must_use]
    pub fn descending(self) -> Self {
        Self {
            descending: true,
            ..self
        }
    }

    /// How the colatitudes are chosen.
    pub fn latitudes(&self) -> Latitudes {
        self.latitudes
    }

    /// The number of rings.
    pub fn rings(&self) -> usize {
        self.rule.len()
    }

    /// The number of points of each ring.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The number of points: rings × columns.
    pub fn len(&self) -> usize {
        self.rings() * self.columns
    }

    /// Never true: a grid has at least one point.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The azimuth of column 0, in radians.
    pub fn first_azimuth(&self) -> f64 {
        self.first_azimuth
    }

    /// Whether φ falls as the column grows.
    pub fn is_descending(&self) -> bool {
        self.descending
    }

    /// θ of a ring, in radians from the north pole.
    ///
    /// # Panics
    /// Unless `ring` is below [`rings`](Grid::rings): [`get_colatitude`](Self::get_colatitude) says
    /// so.
    pub fn colatitude(&self, ring: usize) -> f64 {
        self.rule.sines[ring].atan2(self.rule.nodes[ring])
    }

    /// [`colatitude`](Self::colatitude), or nothing where there is no such ring.
    ///
    /// ```
    /// # use lobes::sphere::Grid;
    /// let grid = Grid::clenshaw_curtis(3, 4)?;
    /// assert_eq!(grid.get_colatitude(0), Some(0.0));
    /// assert_eq!(grid.get_colatitude(3), None);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn get_colatitude(&self, ring: usize) -> Option<f64> {
        (ring < self.rings()).then(|| self.colatitude(ring))
    }

    /// cos θ of each ring, north to south.
    pub fn cosines(&self) -> &[f64] {
        &self.rule.nodes
    }

    /// sin θ of each ring, to full relative precision near the poles.
    pub fn sines(&self) -> &[f64] {
        &self.rule.sines
    }

    /// φ of a column, in radians, not reduced to one turn.
    pub fn azimuth(&self, column: usize) -> f64 {
        let step = 2.0 * PI * column as f64 / self.columns as f64;
        if self.descending {
            self.first_azimuth - step
        } else {
            self.first_azimuth + step
        }
    }

    /// The unit vector at a ring and column, in the harmonic frame; columns go round, so that any
    /// number is one.
    ///
    /// # Panics
    /// Unless `ring` is below [`rings`](Grid::rings): [`get_direction`](Self::get_direction) says
    /// so.
    pub fn direction(&self, ring: usize, column: usize) -> glam::DVec3 {
        let [cos, sin] = self.cos_sin_azimuth(column % self.columns);
        let sine = self.rule.sines[ring];
        glam::DVec3::new(sine * cos, sine * sin, self.rule.nodes[ring])
    }

    /// cos φ and sin φ of a column that there is.
    pub(crate) fn cos_sin_azimuth(&self, column: usize) -> [f64; 2] {
        let (sin, cos) = self.first_azimuth.sin_cos();
        let c = cos_turn(column, self.columns);
        let s = cos_turn(4 * column + 3 * self.columns, 4 * self.columns);
        let s = if self.descending { -s } else { s };
        [cos * c - sin * s, sin * c + cos * s]
    }

    /// [`direction`](Self::direction), or nothing where there is no such ring.
    ///
    /// ```
    /// # use lobes::{glam::DVec3, sphere::Grid};
    /// let grid = Grid::clenshaw_curtis(3, 4)?;
    /// assert_eq!(grid.get_direction(0, 0), Some(DVec3::Z));
    /// assert_eq!(grid.get_direction(3, 0), None);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn get_direction(&self, ring: usize, column: usize) -> Option<glam::DVec3> {
        (ring < self.rings()).then(|| self.direction(ring, column))
    }

    /// The quadrature weight of each point of a ring, in steradians: over the grid they sum to 4π.
    ///
    /// # Panics
    /// Unless `ring` is below [`rings`](Grid::rings): [`get_ring_weight`](Self::get_ring_weight)
    /// says so.
    pub fn ring_weight(&self, ring: usize) -> f64 {
        self.rule.weights[ring] * (2.0 * PI / self.columns as f64)
    }

    /// [`ring_weight`](Self::ring_weight), or nothing where there is no such ring.
    ///
    /// ```
    /// # use lobes::sphere::Grid;
    /// let grid = Grid::gauss_legendre(1, 4)?;
    /// assert!((grid.get_ring_weight(0).unwrap() - std::f64::consts::PI).abs() < 1e-15);
    /// assert_eq!(grid.get_ring_weight(1), None);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn get_ring_weight(&self, ring: usize) -> Option<f64> {
        (ring < self.rings()).then(|| self.ring_weight(ring))
    }

    /// The largest degree whose harmonics, all orders, are recovered exactly from samples on this
    /// grid.
    pub fn max_degree(&self) -> usize {
        self.max_degree_of_rings().min(self.max_order())
    }

    /// The largest order m that the columns carry: (columns − 1)/2.
    pub fn max_order(&self) -> usize {
        (self.columns - 1) / 2
    }

    /// The largest degree that the rings carry, were there columns enough: n − 1 for n rings, n − 2
    /// where two of them are the poles.
    pub fn max_degree_of_rings(&self) -> usize {
        let n = self.rings();
        match self.latitudes {
            Latitudes::GaussLegendre | Latitudes::Fejer => n - 1,
            Latitudes::ClenshawCurtis => n - 2,
        }
    }

    /// The largest degree at which [`ring_weight`](Self::ring_weight) integrates any product of two
    /// harmonics exactly.
    pub fn max_degree_of_weights(&self) -> usize {
        let n = self.rings();
        match self.latitudes {
            Latitudes::GaussLegendre => n - 1,
            Latitudes::ClenshawCurtis | Latitudes::Fejer => (n - 1) / 2,
        }
    }
}
