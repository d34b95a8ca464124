//! Soft edges of masks of any shape.

use std::f64::consts::PI;

use crate::error::{allocate, check_finite, check_length};
use crate::sphere::Grid;
use crate::{Error, Parallelism, Result};

/// How [`apodise`] rises from 0 at a masked point to 1: with x² = (1 − cos θ)/(1 − cos θ*), θ the
/// distance to the nearest masked point and θ* the width (Grain, Tristram and Stompor 2009,
/// doi:10.1103/PhysRevD.79.123515; NaMaster's kinds of the same names).
///
/// ```
/// use lobes::harmonics::Apodisation;
/// assert!((Apodisation::C2.value(0.5) - 0.5).abs() < 1e-15);
/// assert_eq!((Apodisation::C1.value(0.0), Apodisation::C1.value(2.0)), (0.0, 1.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Apodisation {
    /// x − sin(2πx)/2π: smooth to the second derivative at both ends.
    C1,
    /// (1 − cos πx)/2: smooth to the first.
    C2,
}

impl Apodisation {
    /// The factor at x; 1 from x = 1 on.
    pub fn value(self, x: f64) -> f64 {
        if x >= 1.0 {
            return 1.0;
        }
        match self {
            Self::C1 => x - (2.0 * PI * x).sin() / (2.0 * PI),
            Self::C2 => 0.5 * (1.0 - (PI * x).cos()),
        }
    }
}

/// A mask on a grid with soft edges: each point times the factor of `kind` for its distance to the
/// nearest point at which the mask is 0.
///
/// `width` is the angle in radians at which the factor comes to 1. Soft edges couple distant degrees
/// far less.
///
/// ```
/// use lobes::{Parallelism, sphere::Grid};
/// use lobes::harmonics::{Apodisation, Mask, apodise};
/// let grid = Grid::healpix(8)?;
/// let mut mask = vec![1.0; grid.len()];
/// Mask::Cap { radius: 1.0 }.apply(&grid, &mut mask)?;
/// let soft = apodise(&grid, &mask, 0.3, Apodisation::C1, Parallelism::Sequential)?;
/// assert_eq!(soft[0], 1.0);
/// assert!(soft.iter().any(|w| (0.1..0.9).contains(w)));
/// # Ok::<(), lobes::Error>(())
/// ```
///
/// # Errors
/// [`Error::Length`] where the mask is not the grid's; [`Error::NotFinite`] where a value is not
/// finite; [`Error::Domain`] for a width that is not above 0 and at most π; [`Error::Memory`] where
/// there is none.
pub fn apodise(
    grid: &Grid,
    mask: &[f64],
    width: f64,
    kind: Apodisation,
    parallelism: Parallelism,
) -> Result<Vec<f64>> {
    check_length("the mask", grid.len(), mask.len())?;
    check_finite("the mask", mask)?;
    if !(width > 0.0 && width <= PI) {
        return Err(Error::Domain {
            what: "the width of an edge in radians",
            value: width,
            allowed: "above 0 and at most π",
        });
    }
    // The masked points of each ring by their distance from its first point, 0 … columns.
    let masked: Vec<Vec<usize>> = (0..grid.rings())
        .map(|ring| {
            let row = &mask[grid.ring_points(ring)];
            (0..row.len()).filter(|&j| row[j] == 0.0).collect()
        })
        .collect();
    let colatitudes: Vec<f64> = (0..grid.rings())
        .map(|ring| grid.colatitude(ring))
        .collect();
    let chord = |angle: f64| (0.5 * angle).sin().powi(2);
    let limit = chord(width);
    let rows = parallelism.map(grid.rings(), |ring| {
        let row = &mask[grid.ring_points(ring)];
        let mut soft = row.to_vec();
        // Rings that are nearer than the width, the nearest first.
        let mut near: Vec<(f64, usize)> = (0..grid.rings())
            .filter(|&other| !masked[other].is_empty())
            .map(|other| (chord(colatitudes[other] - colatitudes[ring]), other))
            .filter(|(least, _)| *least < limit)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (column, value) in soft
            .iter_mut()
            .enumerate()
            .filter(|(_, value)| **value != 0.0)
        {
            // sin² of half the distance: sin²(Δθ/2) + sin θ sin θ′ sin²(Δφ/2).
            let mut nearest = limit;
            for &(least, other) in &near {
                if least >= nearest {
                    break;
                }
                let columns = grid.ring_columns(other) as f64;
                let sense = if grid.is_descending() { -1.0 } else { 1.0 };
                let turn = sense * (grid.azimuth_at(ring, column) - grid.ring_azimuth(other));
                let place = (turn / (2.0 * PI)).rem_euclid(1.0) * columns;
                let points = &masked[other];
                let after = points.partition_point(|&j| (j as f64) < place) % points.len();
                let before = (after + points.len() - 1) % points.len();
                for j in [points[before], points[after]] {
                    let across = ((j as f64 - place) * PI / columns).sin().powi(2);
                    let distance = least + grid.sines()[ring] * grid.sines()[other] * across;
                    nearest = nearest.min(distance);
                }
            }
            *value *= kind.value((nearest / limit).sqrt());
        }
        soft
    });
    let mut soft = allocate("the soft mask", mask.len())?;
    for (ring, row) in rows.into_iter().enumerate() {
        soft[grid.ring_points(ring)].copy_from_slice(&row);
    }
    Ok(soft)
}
