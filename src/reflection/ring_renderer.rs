//! Pictures of spheres by rings about the line of sight, for lobes that are not sharp.
//!
//! A camera that looks at the sphere's centre and a lobe that knows no tangent are the same all
//! round the line of sight. With the light on a grid about that line, W(θ, φ), the picture is a
//! circular convolution on each ring, B(θ_n, φ_n) = Σ_θ Σ_φ W(θ, φ) k(θ_n, θ, φ − φ_n), which is a
//! product for each order m of the Fourier series in φ:
//!
//! ```text
//! B_m(θ_n) = Σ_θ k_m(θ_n, θ) W_m(θ)
//! ```
//!
//! Unlike [`Operator`](super::Operator) it has no top degree, so that lamps ring nowhere, and it
//! takes any lobe as a function. k_m is made once for a lobe and a camera; a picture then takes
//! milliseconds.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use realfft::RealFftPlanner;

use super::{Camera, SphereImage};
use crate::error::check_length;
use crate::illumination::EnvironmentMap;
use crate::reflection::check_size;
use crate::{Error, Parallelism, Result};

/// Rows of the light's grid about the line of sight, from the camera to behind the sphere.
const ROWS: usize = 256;

/// Its columns.
const COLUMNS: usize = 2 * ROWS;

/// The largest order m.
const ORDERS: usize = 128;

/// Rings of the picture, at equal steps of the normal's angle from the line of sight.
const RINGS: usize = 128;

/// Azimuths of a ring.
const AZIMUTHS: usize = 512;

/// Nodes, each way, of the interpolation between the picture's rings and azimuths.
const TAPS: usize = 6;

/// Columns of what is multiplied together: three channels, each a complex number, and two zeros.
const LANES: usize = 8;

/// A map of more rows is brought down to so many first.
const MOST_ROWS: usize = 1024;

/// The light of a map on a grid about a camera's line of sight, for [`RingRenderer`], which has an
/// example.
#[derive(Debug, Clone)]
pub struct RingLight {
    camera: Camera,
    /// The real and the imaginary part of each channel at \[m\]\[row\].
    orders: Vec<[f64; LANES]>,
}

impl RingLight {
    /// The light of a map as `camera` looks at it.
    ///
    /// The integral of the map's bilinear function against any function that is smooth over
    /// 2° is kept, to the fourth order of both grids' steps: each pixel's light is divided
    /// among the sixteen nodes about it by the weights with which cubics interpolate
    /// there. A map of more than 1024 rows is averaged down to at most those first.
    ///
    /// # Errors
    /// [`Error::Memory`] where the grid does not fit.
    pub fn of(map: &EnvironmentMap, camera: &Camera) -> Result<Self> {
        let factor = map.height().div_ceil(MOST_ROWS);
        let smaller;
        let map = if factor > 1 {
            let rows = 2 * (map.height() / factor / 2).max(1);
            smaller = map.resampled(2 * rows, rows)?;
            &smaller
        } else {
            map
        };
        let mut grid: [Vec<f64>; 3] = [
            crate::error::allocate("the light's grid", ROWS * COLUMNS)?,
            vec![0.0; ROWS * COLUMNS],
            vec![0.0; ROWS * COLUMNS],
        ];
        let step = PI / ROWS as f64;
        let cell = PI / map.height() as f64;
        for row in 0..map.height() {
            let area = cell * cell * (cell * (row as f64 + 0.5)).sin();
            for column in 0..map.width() {
                let value = hat_corrected(map, row, column);
                if value == [0.0; 3] {
                    continue;
                }
                let direction = map.direction(row, column);
                let x = direction.dot(camera.right());
                let y = direction.dot(camera.up());
                let z = direction.dot(camera.towards());
                let at_row = x.hypot(y).atan2(z) / step - 0.5;
                let at_column = (y.atan2(x) / step).rem_euclid(COLUMNS as f64);
                let (first_row, first_column) = (at_row.floor(), at_column.floor());
                let down = cubic(at_row - first_row);
                let along = cubic(at_column - first_column);
                for (i, down) in down.into_iter().enumerate() {
                    let (row, turn) = beyond_poles(first_row as isize + i as isize - 1);
                    for (j, along) in along.into_iter().enumerate() {
                        let column = (first_column as usize + COLUMNS + j - 1 + turn) % COLUMNS;
                        let weight = area * down * along;
                        for (grid, value) in grid.iter_mut().zip(value) {
                            grid[row * COLUMNS + column] += weight * value;
                        }
                    }
                }
            }
        }
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(COLUMNS);
        let mut spectrum = transform.make_output_vec();
        let mut orders = vec![[0.0; LANES]; (ORDERS + 1) * ROWS];
        for (channel, grid) in grid.iter_mut().enumerate() {
            for (row, values) in grid.chunks_exact_mut(COLUMNS).enumerate() {
                // The lengths are those of the plan.
                if transform.process(values, &mut spectrum).is_err() {
                    continue;
                }
                for (m, value) in spectrum.iter().take(ORDERS + 1).enumerate() {
                    let order = &mut orders[m * ROWS + row];
                    order[2 * channel] = value.re;
                    order[2 * channel + 1] = value.im;
                }
            }
        }
        Ok(Self {
            camera: *camera,
            orders,
        })
    }
}

/// A pixel whose value at its centre, times its area, is what its bilinear hat holds of a smooth
/// function: ∫ hat f = h² (f + h²/12 (f_θθ + f_φφ)) + O(h⁶), and a second difference can be taken
/// of either factor of a sum.
fn hat_corrected(map: &EnvironmentMap, row: usize, column: usize) -> [f64; 3] {
    let (width, height) = (map.width(), map.height());
    let beyond = (column + width / 2) % width;
    let above = if row == 0 {
        map.pixel(0, beyond)
    } else {
        map.pixel(row - 1, column)
    };
    let below = if row + 1 == height {
        map.pixel(row, beyond)
    } else {
        map.pixel(row + 1, column)
    };
    let left = map.pixel(row, (column + width - 1) % width);
    let right = map.pixel(row, (column + 1) % width);
    let own = map.pixel(row, column);
    std::array::from_fn(|c| {
        own[c] + (above[c] + below[c] + left[c] + right[c] - 4.0 * own[c]) / 12.0
    })
}

/// Lagrange's weights of the nodes −1, 0, 1 and 2 at x in [0, 1).
fn cubic(x: f64) -> [f64; 4] {
    let (a, b, c) = (x + 1.0, x - 1.0, x - 2.0);
    [
        -x * b * c / 6.0,
        0.5 * a * b * c,
        -0.5 * a * x * c,
        a * x * b / 6.0,
    ]
}

/// A row of the light's grid, and by how many columns to turn it: beyond a pole, the row that the
/// great circle meets there.
fn beyond_poles(row: isize) -> (usize, usize) {
    if row < 0 {
        ((-1 - row) as usize, COLUMNS / 2)
    } else if row as usize >= ROWS {
        (2 * ROWS - 1 - row as usize, COLUMNS / 2)
    } else {
        (row as usize, 0)
    }
}

/// A lobe as one camera sees it, made once, and pictures of it under any light.
///
/// **Accuracy.** For lobes no narrower than Ward's at σ = 0.08 or GGX at α = 0.1, and continuous at
/// the horizon, the root mean square of a picture's error is below 5·10⁻⁴ of the picture's own, also
/// under a sun of one pixel. What is narrower is for [`Renderer`](super::Renderer), and mirrors for
/// [`EnvironmentMap::radiance`].
///
/// ```
/// use lobes::{Parallelism, glam::DVec3, illumination::EnvironmentMap};
/// use lobes::reflectance::{Fresnel, Ggx};
/// use lobes::reflection::{Camera, RingLight, RingRenderer};
/// let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// let lobe = Ggx::isotropic(0.4, Fresnel::Constant(1.0))?;
/// let all = |view, lights: &[DVec3], out: &mut [f64]| lobe.evaluate_batch(view, lights, out);
/// let renderer = RingRenderer::new(&camera, all, Parallelism::Sequential)?;
/// let map = EnvironmentMap::new("even", 64, 32, vec![[1.0; 3]; 64 * 32])?;
/// let image = renderer.render(&RingLight::of(&map, &camera)?, 16)?;
/// // In even light a sphere shows its albedo.
/// let seen = image.get(8, 8).unwrap()[0];
/// let along = lobe.albedo(1.0);
/// assert!((seen - along).abs() < 2e-3);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct RingRenderer {
    camera: Camera,
    /// k_m at \[m\]\[ring\]\[row\].
    kernels: Vec<f64>,
}

impl RingRenderer {
    /// A lobe times the light's cosine, in sr⁻¹, as `camera` sees it.
    ///
    /// `lobe(view, lights, out)` writes its values for lights in the surface's local frame, whose
    /// normal is +z, and 0 for those below the horizon. It has to be isotropic: the same if view
    /// and lights are turned about the normal, or mirrored.
    ///
    /// # Errors
    /// What `lobe` says, and [`Error::Lobe`] if it is not finite.
    pub fn new(
        camera: &Camera,
        lobe: impl Fn(DVec3, &[DVec3], &mut [f64]) -> Result<()> + Sync + Send,
        parallelism: Parallelism,
    ) -> Result<Self> {
        let step = PI / ROWS as f64;
        let ring_step = camera.rim() / RINGS as f64;
        let rings = parallelism.map(RINGS, |ring| -> Result<Vec<f64>> {
            let polar = ring_step * (ring as f64 + 0.5);
            let point = camera.shading_point(polar, 0.0);
            let normal = point.normal;
            // The plane of incidence is the plane of azimuth 0.
            let across = camera.up();
            let along = across.cross(normal);
            let local = |d: DVec3| DVec3::new(d.dot(along), d.dot(across), d.dot(normal));
            let view = local(point.view).normalize();
            let transform = RealFftPlanner::<f64>::new().plan_fft_forward(COLUMNS);
            let mut spectrum = transform.make_output_vec();
            let mut lights = vec![DVec3::Z; ROWS + 1];
            let mut half = vec![0.0; ROWS + 1];
            let mut round = vec![0.0; COLUMNS];
            let mut kernels = vec![0.0; (ORDERS + 1) * ROWS];
            for row in 0..ROWS {
                let (sin, cos) = (step * (row as f64 + 0.5)).sin_cos();
                for (column, light) in lights.iter_mut().enumerate() {
                    let (s, c) = (step * column as f64).sin_cos();
                    let world =
                        (camera.right() * c + camera.up() * s) * sin + camera.towards() * cos;
                    *light = local(world).normalize();
                }
                half.fill(0.0);
                if lights.iter().any(|light| light.z > 0.0) {
                    lobe(view, &lights, &mut half)?;
                }
                if let Some(&value) = half.iter().find(|value| !value.is_finite()) {
                    return Err(Error::Lobe {
                        lobe: "of a sphere".into(),
                        value,
                    });
                }
                for column in 0..COLUMNS {
                    round[column] = half[column.min(COLUMNS - column)];
                }
                if transform.process(&mut round, &mut spectrum).is_err() {
                    continue;
                }
                for (m, value) in spectrum.iter().take(ORDERS + 1).enumerate() {
                    kernels[m * ROWS + row] = value.re;
                }
            }
            Ok(kernels)
        });
        let mut kernels: Vec<f64> =
            crate::error::allocate("a lobe's rings", (ORDERS + 1) * RINGS * ROWS)?;
        for (ring, of_ring) in rings.into_iter().enumerate() {
            for (m, rows) in of_ring?.chunks_exact(ROWS).enumerate() {
                let at = (m * RINGS + ring) * ROWS;
                kernels[at..at + ROWS].copy_from_slice(rows);
            }
        }
        Ok(Self {
            camera: *camera,
            kernels,
        })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// A picture of `size` × `size` pixels: what their centres see.
    ///
    /// # Errors
    /// [`Error::Domain`] for a size that no picture has; [`Error::OtherCamera`] if the light was
    /// put about another camera's line of sight.
    pub fn render(&self, light: &RingLight, size: usize) -> Result<SphereImage> {
        check_size(size)?;
        let same = light.camera.right() == self.camera.right()
            && light.camera.towards() == self.camera.towards();
        if !same {
            return Err(Error::OtherCamera {
                what: "the light's grid",
            });
        }
        check_length("the light's grid", (ORDERS + 1) * ROWS, light.orders.len())?;
        let rings = self.rings(&light.orders);
        let ring_step = self.camera.rim() / RINGS as f64;
        let azimuth_step = TAU / AZIMUTHS as f64;
        let pixels = (0..size * size)
            .map(|index| {
                let Some(point) = self.camera.pixel(size, index / size, index % size) else {
                    return [0.0; 3];
                };
                let x = point.normal.dot(self.camera.right());
                let y = point.normal.dot(self.camera.up());
                let z = point.normal.dot(self.camera.towards());
                let at_ring = x.hypot(y).atan2(z) / ring_step - 0.5;
                let at_azimuth = (y.atan2(x) / azimuth_step).rem_euclid(AZIMUTHS as f64);
                // Within the rim, where there is no ring beyond, the nodes are all on one side.
                let first = (at_ring.floor() as isize - (TAPS as isize / 2 - 1))
                    .min((RINGS - TAPS) as isize);
                let first_azimuth = at_azimuth.floor() as isize - (TAPS as isize / 2 - 1);
                let down = lagrange(at_ring - first as f64);
                let along = lagrange(at_azimuth - first_azimuth as f64);
                let mut sum = [0.0; 3];
                for (i, down) in down.into_iter().enumerate() {
                    let ring = first + i as isize;
                    // Through the middle to the other side.
                    let (ring, turn) = if ring < 0 {
                        ((-1 - ring) as usize, AZIMUTHS / 2)
                    } else {
                        (ring as usize, 0)
                    };
                    for (j, along) in along.into_iter().enumerate() {
                        let column = (first_azimuth + (AZIMUTHS + j + turn) as isize) as usize;
                        let value = rings[ring * AZIMUTHS + column % AZIMUTHS];
                        for c in 0..3 {
                            sum[c] += down * along * value[c];
                        }
                    }
                }
                // Interpolation swings below the darkest.
                sum.map(|value| value.max(0.0))
            })
            .collect();
        SphereImage::new(self.camera, size, pixels)
    }

    /// The picture's rings, each at [`AZIMUTHS`] azimuths.
    fn rings(&self, orders: &[[f64; LANES]]) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; LANES]; (ORDERS + 1) * RINGS];
        for (m, sums) in sums.chunks_exact_mut(RINGS).enumerate() {
            let light = &orders[m * ROWS..(m + 1) * ROWS];
            for (ring, sum) in sums.iter_mut().enumerate() {
                let at = (m * RINGS + ring) * ROWS;
                for (kernel, light) in self.kernels[at..at + ROWS].iter().zip(light) {
                    for lane in 0..LANES {
                        sum[lane] += kernel * light[lane];
                    }
                }
            }
        }
        let transform = RealFftPlanner::<f64>::new().plan_fft_inverse(AZIMUTHS);
        let mut spectrum = transform.make_input_vec();
        let mut round = transform.make_output_vec();
        let mut rings = vec![[0.0; 3]; RINGS * AZIMUTHS];
        for (ring, values) in rings.chunks_exact_mut(AZIMUTHS).enumerate() {
            for channel in 0..3 {
                for value in &mut spectrum {
                    (value.re, value.im) = (0.0, 0.0);
                }
                for m in 0..=ORDERS {
                    let sum = &sums[m * RINGS + ring];
                    // Σ_φ W(φ) e^(−imφ) times k_m, which is real; back by the grid's own count.
                    let scale = 1.0 / COLUMNS as f64;
                    spectrum[m].re = scale * sum[2 * channel];
                    spectrum[m].im = if m == 0 {
                        0.0
                    } else {
                        scale * sum[2 * channel + 1]
                    };
                }
                if transform.process(&mut spectrum, &mut round).is_err() {
                    continue;
                }
                for (value, round) in values.iter_mut().zip(&round) {
                    value[channel] = *round;
                }
            }
        }
        rings
    }
}

/// Lagrange's weights of the nodes 0 … [`TAPS`] − 1.
fn lagrange(x: f64) -> [f64; TAPS] {
    std::array::from_fn(|i| {
        (0..TAPS)
            .filter(|&j| j != i)
            .map(|j| (x - j as f64) / (i as f64 - j as f64))
            .product()
    })
}
