//! A picture of a sphere unwrapped onto rings about the line of sight, and the amplitudes of those
//! rings.

use num_complex::Complex64;
use realfft::RealFftPlanner;

use crate::error::{check_count, check_length};
use crate::reflection::{SphereImage, Viewpoint};
use crate::{Error, Result};

/// Where the rings of a picture lie and how many orders are kept: what the [`Modes`] of a picture
/// and the operator of its view have in common.
///
/// ```
/// use lobes::{features::RingLayout, reflection::Viewpoint};
/// let layout = RingLayout::new(Viewpoint::Orthographic, 16, 4)?;
/// assert_eq!((layout.angles().len(), layout.orders()), (16, 4));
/// // A cosine amplitude of each order, and a sine amplitude of each but 0.
/// assert_eq!(layout.len(), 16 * 9);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RingLayout {
    viewpoint: Viewpoint,
    angles: Vec<f64>,
    orders: usize,
}

impl RingLayout {
    /// The largest distance of a ring from the picture's centre, in radii of the sphere's outline.
    /// Pixels farther out see the sphere at grazing angles and mix it with what is behind.
    pub const LARGEST_RADIUS: f64 = 0.96;

    /// The most rings, and the largest order.
    pub const MOST: usize = 16384;

    /// `rings` rings, their angles from the axis at equal steps from half a step to where the
    /// picture shows them at [`Self::LARGEST_RADIUS`], and the orders 0 … `orders`.
    ///
    /// # Errors
    /// [`Error::TooFew`] for no ring; [`Error::Domain`] for a camera inside the sphere or more than
    /// [`Self::MOST`] rings or orders.
    pub fn new(viewpoint: Viewpoint, rings: usize, orders: usize) -> Result<Self> {
        Self::within(viewpoint, rings, orders, Self::LARGEST_RADIUS)
    }

    /// [`new`](Self::new) for a picture of which only what lies within `radius` of its centre is to
    /// be read, in radii of the sphere's outline; no farther out than [`Self::LARGEST_RADIUS`].
    ///
    /// ```
    /// use lobes::{features::RingLayout, reflection::Viewpoint};
    /// // The normals to 30° from the line of sight.
    /// let layout = RingLayout::within(Viewpoint::Orthographic, 16, 4, 0.5)?;
    /// assert!(layout.angles().iter().all(|angle| *angle < 30f64.to_radians()));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`Error::Domain`] for a radius that is not above 0.
    pub fn within(viewpoint: Viewpoint, rings: usize, orders: usize, radius: f64) -> Result<Self> {
        viewpoint.check()?;
        if !(radius > 0.0) {
            return Err(Error::Domain {
                what: "the largest radius of the rings",
                value: radius,
                allowed: "above 0",
            });
        }
        let radius = radius.min(Self::LARGEST_RADIUS);
        if rings == 0 {
            return Err(Error::TooFew {
                what: "the layout of a picture",
                items: "rings",
                needed: 1,
                got: 0,
            });
        }
        for (what, value) in [
            ("the number of rings", rings),
            ("the largest order of the rings", orders),
        ] {
            if value > Self::MOST {
                return Err(Error::Domain {
                    what,
                    value: value as f64,
                    allowed: "at most 16384, as many as the largest picture has pixels a side",
                });
            }
        }
        let limb = viewpoint.limb();
        let (mut low, mut high) = (0.0, limb);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if viewpoint.radius(middle) < radius {
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

    /// The same rings with no more than these orders.
    #[must_use]
    pub fn with_orders_up_to(&self, orders: usize) -> Self {
        Self {
            orders: self.orders.min(orders),
            ..self.clone()
        }
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

    /// Checks that there are as many rings and orders as `what` needs.
    pub(super) fn check(&self, what: &'static str, rings: usize, orders: usize) -> Result<()> {
        check_count(what, "rings", rings, self.angles.len())?;
        check_count(what, "orders", orders, self.orders)
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

/// A picture of a sphere unwrapped: one row a ring of a [`RingLayout`], from the axis outwards, and
/// `columns` values a ring, the first at the picture's right and on towards its top.
///
/// Equal steps of the normal's angle are equal steps of the angle at which a mirror sees the light,
/// so that this is also a map of the light around, as far as the surface mirrors.
///
/// ```
/// use lobes::features::{RingLayout, Unwrapped};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let layout = RingLayout::new(Viewpoint::Orthographic, 32, 16)?;
/// let unwrapped = Unwrapped::new(&image, &layout)?;
/// assert_eq!(unwrapped.values().len() % unwrapped.rings(), 0);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Unwrapped {
    columns: usize,
    values: Vec<[f64; 3]>,
}

impl Unwrapped {
    /// Reads the picture on the rings by bilinear interpolation between pixel centres; where one of
    /// the four misses the sphere the others stand for it. Columns: the least power of two, 64 or
    /// more, that carries the orders twice over.
    ///
    /// # Errors
    /// A picture so small that a ring meets no pixel.
    pub fn new(image: &SphereImage, layout: &RingLayout) -> Result<Self> {
        let size = image.size();
        let columns = (4 * layout.orders).max(64).next_power_of_two();
        let rings = layout.angles.len();
        let azimuths: Vec<(f64, f64)> = (0..columns)
            .map(|j| (std::f64::consts::TAU * j as f64 / columns as f64).sin_cos())
            .collect();
        let mut values = Vec::with_capacity(rings * columns);
        for &angle in &layout.angles {
            let radius = layout.viewpoint.radius(angle);
            for &(sin, cos) in &azimuths {
                let x = (0.5 * (1.0 + radius * cos)) * size as f64 - 0.5;
                let y = (0.5 * (1.0 - radius * sin)) * size as f64 - 0.5;
                let value = image.interpolate(x, y).ok_or(Error::Unseen {
                    what: "a point on one of its rings",
                })?;
                values.push(value);
            }
        }
        Ok(Self { columns, values })
    }

    /// How many rings there are.
    pub fn rings(&self) -> usize {
        self.values.len() / self.columns
    }

    /// How many values a ring has.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The values, ring by ring.
    pub fn values(&self) -> &[[f64; 3]] {
        &self.values
    }

    /// The mean of each channel over the values, which weighs the middle of the picture more than
    /// its pixels do.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for value in &self.values {
            for channel in 0..3 {
                sum[channel] += value[channel];
            }
        }
        sum.map(|sum| sum / self.values.len() as f64)
    }
}

/// The amplitudes of one channel: on ring r, value(φ) = Σ_m c_m,r cos mφ + s_m,r sin mφ, φ from the
/// picture's right towards its top.
///
/// ```
/// use lobes::features::{Modes, RingLayout, Unwrapped};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let layout = RingLayout::new(Viewpoint::Orthographic, 8, 2)?;
/// let unwrapped = Unwrapped::new(&image, &layout)?;
/// // Red is 1 + ½ sin θ sin φ on this sphere.
/// let [red] = Modes::of(&unwrapped, &layout, |rgb| [rgb[0]])?;
/// let angle = layout.angles()[3];
/// assert!((red.cosine(0)[3] - 1.0).abs() < 0.01);
/// assert!((red.sine(1)[3] - 0.5 * angle.sin()).abs() < 0.01);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    rings: usize,
    /// The cosine amplitudes of order 0, of order 1, its sine amplitudes, those of order 2, …; each
    /// over the rings.
    values: Vec<f64>,
}

impl Modes {
    /// The amplitudes, to the layout's last order, of each value of `of` over the unwrapped
    /// picture.
    ///
    /// # Errors
    /// [`Error::Length`] for a picture that was unwrapped for another layout.
    pub fn of<const N: usize>(
        picture: &Unwrapped,
        layout: &RingLayout,
        of: impl Fn([f64; 3]) -> [f64; N],
    ) -> Result<[Self; N]> {
        let (rings, columns) = (layout.angles.len(), picture.columns);
        crate::error::check_length(
            "the unwrapped picture",
            rings * columns,
            picture.values.len(),
        )?;
        if columns <= 2 * layout.orders {
            return Err(Error::Length {
                what: "a ring of the unwrapped picture",
                expected: 2 * layout.orders + 1,
                got: columns,
            });
        }
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(columns);
        let mut scratch = transform.make_scratch_vec();
        let mut fields: [Vec<f64>; N] = std::array::from_fn(|_| vec![0.0; columns]);
        let mut spectrum = vec![Complex64::ZERO; columns / 2 + 1];
        let mut modes: [Self; N] = std::array::from_fn(|_| Self {
            rings,
            values: vec![0.0; layout.len()],
        });
        for (r, ring) in picture.values.chunks_exact(columns).enumerate() {
            for (j, rgb) in ring.iter().enumerate() {
                for (field, value) in fields.iter_mut().zip(of(*rgb)) {
                    field[j] = value;
                }
            }
            for (field, modes) in fields.iter_mut().zip(&mut modes) {
                // The lengths are the plan's own, so it cannot refuse.
                if transform
                    .process_with_scratch(field, &mut spectrum, &mut scratch)
                    .is_err()
                {
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

    /// Amplitudes that are known: those of order 0, the cosine and the sine ones of order 1, of
    /// order 2, …, each over the rings from the axis outwards.
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

    /// Checks that they were read on a layout of as many rings, and of as many orders or more.
    pub(crate) fn check(&self, layout: &RingLayout) -> Result<()> {
        check_length("a ring's amplitudes", layout.angles.len(), self.rings)?;
        let known = self.values.len().min(layout.len());
        check_length("a picture's amplitudes", layout.len(), known)
    }

    fn column(&self, column: usize) -> &[f64] {
        &self.values[column * self.rings..(column + 1) * self.rings]
    }
}

/// Adds a cos mφ + b sin mφ to every ring of `values`, [a, b] being the ring's `amplitudes`.
pub(super) fn add_waves(
    values: &mut [f64],
    columns: usize,
    m: usize,
    amplitudes: impl Fn(usize) -> [f64; 2],
) {
    let turn = std::f64::consts::TAU / columns as f64;
    let waves: Vec<(f64, f64)> = (0..columns)
        .map(|column| (turn * ((m * column) % columns) as f64).sin_cos())
        .collect();
    for (ring, values) in values.chunks_exact_mut(columns).enumerate() {
        let [cosine, sine] = amplitudes(ring);
        for (value, (sin, cos)) in values.iter_mut().zip(&waves) {
            *value += cosine * cos + sine * sin;
        }
    }
}
