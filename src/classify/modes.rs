//! A picture of a sphere as amplitudes on rings about the line of sight.

use num_complex::Complex64;
use realfft::RealFftPlanner;

use crate::reflection::{SphereImage, Viewpoint};
use crate::{Error, Result};

/// Where the rings of a picture lie and how many orders are kept: what the [`Modes`] of a picture and the operator of
/// its view have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct RingLayout {
    viewpoint: Viewpoint,
    angles: Vec<f64>,
    orders: usize,
}

impl RingLayout {
    /// The largest distance of a ring from the picture's centre, in radii of the sphere's outline. Pixels farther out
    /// see the sphere at grazing angles and mix it with what is behind.
    pub const LARGEST_RADIUS: f64 = 0.96;

    /// `rings` rings, their angles from the axis at equal steps from half a step to where the picture shows them at
    /// [`Self::LARGEST_RADIUS`], and the orders 0 … `orders`.
    ///
    /// # Errors
    /// No ring, or a camera inside the sphere.
    pub fn new(viewpoint: Viewpoint, rings: usize, orders: usize) -> Result<Self> {
        viewpoint.check()?;
        if rings == 0 {
            return Err(Error::Unanswerable(
                "a picture is read on one ring or more".into(),
            ));
        }
        let limb = viewpoint.limb();
        let (mut low, mut high) = (0.0, limb);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if viewpoint.radius(middle) < Self::LARGEST_RADIUS {
                low = middle;
            } else {
                high = middle;
            }
        }
        let angles = (0..rings)
            .map(|ring| (ring as f64 + 0.5) / rings as f64 * low)
            .collect();
        Ok(Self {
            viewpoint,
            angles,
            orders,
        })
    }

    /// Where the camera stands.
    pub fn viewpoint(&self) -> Viewpoint {
        self.viewpoint
    }

    /// The rings' angles from the axis, radians.
    pub fn angles(&self) -> &[f64] {
        &self.angles
    }

    /// The largest order.
    pub fn orders(&self) -> usize {
        self.orders
    }

    /// How many independent amplitudes a picture has: rings × (1 + 2·orders).
    pub fn len(&self) -> usize {
        self.angles.len() * (1 + 2 * self.orders)
    }

    /// Never: a layout has a ring.
    pub fn is_empty(&self) -> bool {
        self.angles.is_empty()
    }
}

/// The amplitudes of one channel: on ring r, value(φ) = Σ_m c_m,r cos mφ + s_m,r sin mφ, φ from the picture's right
/// towards its top.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    rings: usize,
    /// The cosine amplitudes of order 0, of order 1, its sine amplitudes, those of order 2, …; each over the rings.
    values: Vec<f64>,
}

impl Modes {
    /// Reads each value of `of` on the rings by bilinear interpolation between pixel centres; where one of the four
    /// misses the sphere the nearest that does not stands for it.
    ///
    /// # Errors
    /// A picture so small that a ring meets no pixel.
    pub fn of<const N: usize>(
        image: &SphereImage,
        layout: &RingLayout,
        of: impl Fn([f64; 3]) -> [f64; N],
    ) -> Result<[Self; N]> {
        let size = image.size();
        let columns = (4 * layout.orders + 4).max(64);
        let rings = layout.angles.len();
        let mut fields = vec![[0.0; N]; rings * columns];
        for (r, &angle) in layout.angles.iter().enumerate() {
            let radius = layout.viewpoint.radius(angle);
            for j in 0..columns {
                let (sin, cos) = (std::f64::consts::TAU * j as f64 / columns as f64).sin_cos();
                let x = (0.5 * (1.0 + radius * cos)) * size as f64 - 0.5;
                let y = (0.5 * (1.0 - radius * sin)) * size as f64 - 0.5;
                fields[r * columns + j] = bilinear(image, x, y, &of).ok_or_else(|| {
                    Error::Unanswerable(format!(
                        "a picture of {size} pixels a side is too small to be read on {rings} rings"
                    ))
                })?;
            }
        }
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(columns);
        let mut ring = transform.make_input_vec();
        let mut spectrum = vec![Complex64::ZERO; columns / 2 + 1];
        let mut modes: [Self; N] = std::array::from_fn(|_| Self {
            rings,
            values: vec![0.0; layout.len()],
        });
        for r in 0..rings {
            for (channel, modes) in modes.iter_mut().enumerate() {
                for (value, field) in ring.iter_mut().zip(&fields[r * columns..]) {
                    *value = field[channel];
                }
                // The lengths are the plan's own, so it cannot refuse.
                if transform.process(&mut ring, &mut spectrum).is_err() {
                    spectrum.fill(Complex64::ZERO);
                }
                modes.values[r] = spectrum[0].re / columns as f64;
                for m in 1..=layout.orders {
                    let amplitude = spectrum[m] * (2.0 / columns as f64);
                    modes.values[(2 * m - 1) * rings + r] = amplitude.re;
                    modes.values[2 * m * rings + r] = -amplitude.im;
                }
            }
        }
        Ok(modes)
    }

    /// Amplitudes that are known: those of order 0, the cosine and the sine ones of order 1, of order 2, …, each over the
    /// rings from the axis outwards.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are [`RingLayout::len`] of them.
    pub fn from_values(layout: &RingLayout, values: Vec<f64>) -> Result<Self> {
        crate::error::check_length("the amplitudes of a picture", layout.len(), values.len())?;
        Ok(Self {
            rings: layout.angles.len(),
            values,
        })
    }

    /// The cosine amplitudes of an order over the rings.
    pub fn cosine(&self, m: usize) -> &[f64] {
        self.column(if m == 0 { 0 } else { 2 * m - 1 })
    }

    /// The sine amplitudes of an order over the rings; empty for order 0.
    pub fn sine(&self, m: usize) -> &[f64] {
        if m == 0 { &[] } else { self.column(2 * m) }
    }

    fn column(&self, column: usize) -> &[f64] {
        &self.values[column * self.rings..(column + 1) * self.rings]
    }
}

fn bilinear<const N: usize>(
    image: &SphereImage,
    x: f64,
    y: f64,
    of: &impl Fn([f64; 3]) -> [f64; N],
) -> Option<[f64; N]> {
    let (column, row) = (x.floor(), y.floor());
    let mut sum = [0.0; N];
    let mut total = 0.0;
    for (dy, dx) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let (i, j) = (row as i64 + dy, column as i64 + dx);
        let (Ok(i), Ok(j)) = (usize::try_from(i), usize::try_from(j)) else {
            continue;
        };
        let Some(pixel) = image.get(i, j) else {
            continue;
        };
        let weight = (1.0 - (x - j as f64).abs()) * (1.0 - (y - i as f64).abs());
        for (sum, value) in sum.iter_mut().zip(of(pixel)) {
            *sum += weight * value;
        }
        total += weight;
    }
    (total > 1e-9).then(|| sum.map(|sum| sum / total))
}
