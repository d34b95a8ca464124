//! Iso-latitude grids: rings of equally spaced points.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

use std::f64::consts::PI;

use crate::error::{check_finite, check_length};
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
    /// The pixel centres of HEALPix.
    Healpix,
}

/// A grid of rings of constant colatitude, each of equally spaced points: as many on each, or, on
/// HEALPix, each of its own number.
///
/// Directions are those of the harmonic frame: θ from the pole +z, φ = atan2(y, x). A map on the
/// grid holds its rings one after the other from the north pole to the south, `map[ring * columns +
/// column]` where all are of one length. Column j of n has φ_j = φ₀ + 2π j/n, or φ₀ − 2π j/n where
/// the grid is [descending](Grid::descending); φ₀ is that of the grid or each ring's own.
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
    own: Option<Own>,
}

/// What rings have of their own.
#[derive(Debug, Clone, PartialEq)]
struct Own {
    /// Where each begins in a map, and where the last one ends.
    starts: Vec<usize>,
    /// The azimuth of its first point.
    azimuths: Vec<f64>,
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
            own: None,
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

    /// The pixel centres of HEALPix in the order of rings (Górski et al. 2005, doi:10.1086/427976):
    /// 12 nside² pixels of one area on 4 nside − 1 rings, of 4, 8 … 4 nside points at the poles and
    /// 4 nside between.
    ///
    /// Rings in a polar cap begin half a pixel past azimuth 0, of the others every second one. Pixel
    /// numbers are healpy's with `nest=False`.
    ///
    /// ```
    /// use lobes::sphere::Grid;
    /// let grid = Grid::healpix(2)?;
    /// assert_eq!((grid.len(), grid.rings(), grid.ring_columns(0)), (48, 7, 4));
    /// assert!((grid.cosines()[1] - 2.0 / 3.0).abs() < 1e-15);
    /// assert_eq!(grid.ring_azimuth(2), 0.0);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Domain`] unless 1 ≤ nside ≤ 4096.
    pub fn healpix(nside: usize) -> Result<Self> {
        if !(1..=4096).contains(&nside) {
            return Err(Error::Domain {
                what: "nside of a HEALPix grid",
                value: nside as f64,
                allowed: "in 1 ..= 4096",
            });
        }
        let square = (nside * nside) as f64;
        let mut rule = Rule {
            nodes: Vec::new(),
            sines: Vec::new(),
            weights: Vec::new(),
        };
        let mut own = Own {
            starts: vec![0],
            azimuths: Vec::new(),
        };
        let mut end = 0;
        for ring in 1..4 * nside {
            // From the nearer pole, so that both hemispheres are mirror images to the last bit.
            let from_pole = ring.min(4 * nside - ring);
            let (z, s) = if from_pole < nside {
                // 1 − i²/(3 nside²)
                let i = (from_pole * from_pole) as f64;
                let sine = (i * (6.0 * square - i)).sqrt();
                ((3.0 * square - i) / (3.0 * square), sine / (3.0 * square))
            } else {
                // 2 (2 nside − i)/(3 nside)
                let up = (4 * nside - 2 * from_pole) as f64;
                let whole = (3 * nside) as f64;
                (up / whole, (whole * whole - up * up).sqrt() / whole)
            };
            let columns = 4 * from_pole.min(nside);
            let shifted = from_pole < nside || (ring - nside).is_multiple_of(2);
            rule.nodes.push(if ring > 2 * nside { -z } else { z });
            rule.sines.push(s);
            rule.weights.push(columns as f64 / (6.0 * square));
            own.azimuths
                .push(if shifted { PI / columns as f64 } else { 0.0 });
            end += columns;
            own.starts.push(end);
        }
        Ok(Self {
            latitudes: Latitudes::Healpix,
            rule,
            columns: 4 * nside,
            first_azimuth: own.azimuths[0],
            descending: false,
            own: Some(own),
        })
    }

    /// The same grid with each ring's first point at an azimuth of its own, in radians.
    ///
    /// ```
    /// use lobes::sphere::Grid;
    /// // Every second ring turned by half a column.
    /// let step = std::f64::consts::PI / 8.0;
    /// let grid = Grid::gauss_legendre(3, 8)?.with_ring_azimuths(&[0.0, step, 0.0])?;
    /// assert_eq!(grid.ring_azimuth(1), step);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one a ring; [`Error::NotFinite`] where one is not finite.
    pub fn with_ring_azimuths(self, azimuths: &[f64]) -> Result<Self> {
        check_length("the azimuths of rings", self.rings(), azimuths.len())?;
        check_finite("the azimuths of rings", azimuths)?;
        let starts = (0..self.rings()).map(|ring| self.ring_points(ring).start);
        let own = Own {
            starts: starts.chain([self.len()]).collect(),
            azimuths: azimuths.to_vec(),
        };
        Ok(Self {
            first_azimuth: azimuths[0],
            own: Some(own),
            ..self
        })
    }

    /// The same grid with the first column at azimuth `phi0`, in radians. Where rings have azimuths
    /// of their own it is that of the first ring, and all are turned with it.
    #[must_use]
    pub fn with_first_azimuth(mut self, phi0: f64) -> Self {
        if let Some(own) = &mut self.own {
            let turn = phi0 - own.azimuths[0];
            own.azimuths.iter_mut().for_each(|azimuth| *azimuth += turn);
            own.azimuths[0] = phi0;
        }
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

    /// The number of points of each ring; of the longest where they are not of one length.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The number of points: rings × columns where all are of one length.
    pub fn len(&self) -> usize {
        match &self.own {
            Some(own) => own.starts[self.rings()],
            None => self.rings() * self.columns,
        }
    }

    /// Whether all rings have as many points, at the same azimuths.
    pub fn has_rings_alike(&self) -> bool {
        self.own.is_none()
    }

    /// Where the points of a ring are in a map.
    ///
    /// ```
    /// # use lobes::sphere::Grid;
    /// assert_eq!(Grid::healpix(1)?.ring_points(1), 4..8);
    /// assert_eq!(Grid::fejer(4, 10)?.ring_points(2), 20..30);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Panics
    /// Unless `ring` is below [`rings`](Grid::rings), where rings are not alike.
    pub fn ring_points(&self, ring: usize) -> std::ops::Range<usize> {
        match &self.own {
            Some(own) => own.starts[ring]..own.starts[ring + 1],
            None => ring * self.columns..(ring + 1) * self.columns,
        }
    }

    /// The number of points of a ring.
    ///
    /// # Panics
    /// As [`ring_points`](Self::ring_points).
    pub fn ring_columns(&self, ring: usize) -> usize {
        self.ring_points(ring).len()
    }

    /// The azimuth of a ring's first point, in radians.
    ///
    /// # Panics
    /// As [`ring_points`](Self::ring_points).
    pub fn ring_azimuth(&self, ring: usize) -> f64 {
        match &self.own {
            Some(own) => own.azimuths[ring],
            None => self.first_azimuth,
        }
    }

    /// Never true: a grid has at least one point.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The azimuth of column 0, in radians: on the first ring, where they are not alike.
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

    /// φ of a column, in radians, not reduced to one turn: with the first azimuth and the number of
    /// columns of the grid, which are not those of every ring where they are not alike
    /// ([`azimuth_at`](Self::azimuth_at)).
    pub fn azimuth(&self, column: usize) -> f64 {
        let step = 2.0 * PI * column as f64 / self.columns as f64;
        if self.descending {
            self.first_azimuth - step
        } else {
            self.first_azimuth + step
        }
    }

    /// φ of a point, in radians, not reduced to one turn.
    ///
    /// # Panics
    /// As [`ring_points`](Self::ring_points).
    pub fn azimuth_at(&self, ring: usize, column: usize) -> f64 {
        let step = 2.0 * PI * column as f64 / self.ring_columns(ring) as f64;
        if self.descending {
            self.ring_azimuth(ring) - step
        } else {
            self.ring_azimuth(ring) + step
        }
    }

    /// The unit vector at a ring and column, in the harmonic frame; columns go round, so that any
    /// number is one.
    ///
    /// # Panics
    /// Unless `ring` is below [`rings`](Grid::rings): [`get_direction`](Self::get_direction) says
    /// so.
    pub fn direction(&self, ring: usize, column: usize) -> glam::DVec3 {
        let [cos, sin] = self.cos_sin_azimuth(ring, column % self.ring_columns(ring));
        let sine = self.rule.sines[ring];
        glam::DVec3::new(sine * cos, sine * sin, self.rule.nodes[ring])
    }

    /// cos φ and sin φ of a point that there is.
    pub(crate) fn cos_sin_azimuth(&self, ring: usize, column: usize) -> [f64; 2] {
        let columns = self.ring_columns(ring);
        let (sin, cos) = self.ring_azimuth(ring).sin_cos();
        let c = cos_turn(column, columns);
        let s = cos_turn(4 * column + 3 * columns, 4 * columns);
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
        self.rule.weights[ring] * (2.0 * PI / self.ring_columns(ring) as f64)
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
    /// grid: on HEALPix by least squares, to 2 nside with a condition of 1.6 at most.
    pub fn max_degree(&self) -> usize {
        match self.latitudes {
            Latitudes::Healpix => self.columns / 2,
            _ => self.max_degree_of_rings().min(self.max_order()),
        }
    }

    /// The largest order m that the columns carry: (columns − 1)/2. On HEALPix, where the columns of
    /// neighbouring rings do not lie on the same meridians, that of the rings.
    pub fn max_order(&self) -> usize {
        match self.latitudes {
            Latitudes::Healpix => self.max_degree_of_rings(),
            _ => (self.columns - 1) / 2,
        }
    }

    /// The largest degree that the rings carry, were there columns enough: n − 1 for n rings, n − 2
    /// where two of them are the poles.
    pub fn max_degree_of_rings(&self) -> usize {
        let n = self.rings();
        match self.latitudes {
            Latitudes::GaussLegendre | Latitudes::Fejer | Latitudes::Healpix => n - 1,
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
            Latitudes::Healpix => 0,
        }
    }
}
