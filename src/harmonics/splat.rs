//! Rotation of many small sets of coefficients, such as splats carry.

use fearless_simd::prelude::*;
use fearless_simd::{Level, f64x8};
use glam::DQuat;

use super::coefficients::column_start;
use super::recurrence::{LANES, Lanes};
use super::simd::wide;
use super::work::over_chunks;
use crate::{Error, Parallelism, Result, vectors};

/// The largest degree of a [`SplatRotation`].
pub const MAX_SPLAT_DEGREE: usize = 4;

/// How far the length of a quaternion may be from 1.
const UNIT: f64 = 1e-4;

/// How many sets one thread takes at a time.
const CHUNK: usize = 64 * LANES;

/// Whose harmonics the coefficients of splats belong to, in which order they lie, and in which frame
/// rotations are.
///
/// ```
/// use lobes::harmonics::SplatBasis;
/// assert_eq!("3dgs".parse::<SplatBasis>()?, SplatBasis::Inria);
/// assert_eq!(SplatBasis::E3nn.to_string(), "e3nn");
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SplatBasis {
    /// That of 3-D Gaussian splatting (Kerbl, Kopanas, Leimkühler and Drettakis 2023,
    /// doi:10.1145/3592433) and all that reads its files: the pole on +z, the sign (−1)^m of Condon
    /// and Shortley, at l² + l + m. Degree 1 is (−y, z, −x).
    #[default]
    Inria,
    /// That of glTF's extension `KHR_gaussian_splatting`: the same harmonics as
    /// [`Inria`](Self::Inria), coefficient n of degree l at l² + n.
    Gltf,
    /// e3nn's: the pole on +y, without that sign, at l² + l + m. Degree 1 is (x, y, z).
    E3nn,
    /// This crate's, in the harmonic frame and in the order of
    /// [`Coefficients`](super::Coefficients).
    Lobes,
}

impl SplatBasis {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Inria, Self::Gltf, Self::E3nn, Self::Lobes];

    /// The name: `"3dgs"`, `"gltf"`, `"e3nn"` or `"lobes"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inria => "3dgs",
            Self::Gltf => "gltf",
            Self::E3nn => "e3nn",
            Self::Lobes => "lobes",
        }
    }

    /// The rotation of the frame in which the basis is this crate's: (−1)^m is half a turn about
    /// the pole.
    fn frame(self, turn: DQuat) -> DQuat {
        let DQuat { x, y, z, w } = turn;
        match self {
            Self::Inria | Self::Gltf => DQuat::from_xyzw(-x, -y, z, w),
            Self::E3nn => DQuat::from_xyzw(z, x, y, w),
            Self::Lobes => turn,
        }
    }
}

crate::named!(SplatBasis, "basis of splats");

mod sealed {
    pub trait Number: Copy + Send + Sync {
        /// No sum of a rotation overflows where no value is beyond this.
        const LARGEST: f64;
        fn get(self) -> f64;
        fn set(value: f64) -> Self;
    }

    impl Number for f32 {
        const LARGEST: f64 = f32::MAX as f64 / 4.0;

        #[inline(always)]
        fn get(self) -> f64 {
            f64::from(self)
        }

        #[inline(always)]
        fn set(value: f64) -> Self {
            value as f32
        }
    }

    impl Number for f64 {
        const LARGEST: f64 = f64::MAX / 4.0;

        #[inline(always)]
        fn get(self) -> f64 {
            self
        }

        #[inline(always)]
        fn set(value: f64) -> Self {
            value
        }
    }
}

/// What coefficients of splats are kept in: `f32` or `f64`.
pub trait SplatNumber: sealed::Number {}

impl SplatNumber for f32 {}
impl SplatNumber for f64 {}

/// A plan for rotating many sets of coefficients of degree 1 … 4, all alike or each by a rotation of
/// its own. Immutable; share it by reference.
///
/// The rotated function is f(R⁻¹ ω): a colour that was seen in a direction ω is seen in R ω. With
/// n_a the components of ω and C^lm_ak = ∫ Y_l^m n_a Y_{l−1}^k dω, the matrices follow from that of
/// degree 1, which is R itself, by Σ_m′ D^l_mm′ C^lm′_bj = Σ_ak C^lm_ak R_ab D^{l−1}_kj, where b and
/// j are so chosen that one m′ remains; it is the recurrence of Ivanic and Ruedenberg
/// (doi:10.1021/jp953350u). All arithmetic is of doubles, for eight sets side by side: in `f64` a
/// coefficient is within 10⁻¹⁵ of the length of those of its degree, in `f32` it is rounded once, to
/// 6·10⁻⁸ of it.
///
/// ```
/// use lobes::Parallelism;
/// use lobes::glam::{DQuat, DVec3};
/// use lobes::harmonics::{SplatBasis, SplatRotation};
/// // Two splats, red, green and blue beside each other as glTF and 3DGS's tensors have them. The
/// // green of the first is y, that is −Y_1^−1, and a quarter turn about z makes −x of it: Y_1^1.
/// let mut splats = [[[0f32; 3]; 4]; 2];
/// splats[0][1][1] = -1.0;
/// let turn = DQuat::from_axis_angle(DVec3::Z, std::f64::consts::FRAC_PI_2);
/// let plan = SplatRotation::new(1, SplatBasis::Gltf)?.with_channels(3)?;
/// let values = splats.as_flattened_mut().as_flattened_mut();
/// plan.rotate(values, &[turn], Parallelism::Sequential)?;
/// assert!((splats[0][3][1] - 1.0).abs() < 1e-7 && splats[0][1][1].abs() < 1e-7);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct SplatRotation {
    degree: usize,
    basis: SplatBasis,
    channels: usize,
    /// 1 where sets begin with degree 1, else 0.
    left_out: usize,
    level: Level,
    /// Where the coefficient l² + l + m lies.
    places: Vec<usize>,
    /// How the elements of the matrices from degree 2 on, row after row, come from those before.
    elements: Vec<Vec<Term>>,
}

/// A product of an element of R, one of the matrix of the degree before, and a factor.
#[derive(Debug, Clone, Copy)]
struct Term {
    factor: f64,
    first: usize,
    before: usize,
}

/// Where the matrix of degree l begins among those from degree 1 on, one after the other.
const fn matrix_start(l: usize) -> usize {
    // Σ (2i + 1)² for i < l, but for i = 0.
    l * (2 * l - 1) * (2 * l + 1) / 3 - 1
}

/// How many coefficients there are from degree 1 on.
const COEFFICIENTS: usize = (MAX_SPLAT_DEGREE + 1) * (MAX_SPLAT_DEGREE + 1) - 1;

/// How many elements all matrices have.
const ELEMENTS: usize = matrix_start(MAX_SPLAT_DEGREE + 1);

/// Where the element of orders m and m′ of degree l is.
fn element(l: usize, row: isize, column: isize) -> usize {
    let at = |m: isize| l.wrapping_add_signed(m);
    matrix_start(l) + at(row) * (2 * l + 1) + at(column)
}

/// ∫ Y_l^m n_a Y_{l−1}^k dω, the axes y, z, x being −1, 0, 1.
fn coupling(l: usize, m: isize, axis: isize, k: isize) -> f64 {
    let (degree, order) = (l as f64, m.unsigned_abs() as f64);
    let scale = (4.0 * degree * degree - 1.0).sqrt();
    if axis == 0 {
        let along = ((degree - order) * (degree + order)).sqrt();
        return if k == m { along / scale } else { 0.0 };
    }
    // x cos kφ makes cosines and x sin kφ sines; y makes one of the other.
    if ((m < 0) == (k < 0)) != (axis == 1) {
        return 0.0;
    }
    let up = m.abs() > k.abs();
    let across = match m.abs() - k.abs() {
        1 => ((degree + order) * (degree + order - 1.0)).sqrt(),
        -1 => -((degree - order) * (degree - order - 1.0)).sqrt(),
        _ => return 0.0,
    };
    let sign = if axis == -1 && up == (m >= 0) {
        -1.0
    } else {
        1.0
    };
    let half = if m == 0 || k == 0 {
        std::f64::consts::FRAC_1_SQRT_2
    } else {
        0.5
    };
    sign * half * across / scale
}

/// The products that make the element of orders m and m′ of degree l ≥ 2.
fn terms(l: usize, row: isize, column: isize) -> Vec<Term> {
    let top = l as isize - 1;
    // Factors of n_b Y_{l−1}^j whose sum has, of degree l, the order m′ alone.
    let parts = if column.abs() <= top {
        vec![(1.0, 0, column)]
    } else if column > 0 {
        vec![(1.0, 1, top), (-1.0, -1, -top)]
    } else {
        vec![(1.0, 1, -top), (1.0, -1, top)]
    };
    let total: f64 = parts
        .iter()
        .map(|&(factor, axis, j)| factor * coupling(l, column, axis, j))
        .sum();
    let mut terms = Vec::new();
    for axis in -1..=1 {
        for k in -top..=top {
            let of_row = coupling(l, row, axis, k);
            if of_row != 0.0 {
                terms.extend(parts.iter().map(|&(factor, other, j)| Term {
                    factor: factor * of_row / total,
                    first: element(1, axis, other),
                    before: element(l - 1, k, j),
                }));
            }
        }
    }
    terms
}

impl SplatRotation {
    /// A plan for sets of one channel, all (degree + 1)² coefficients of it.
    ///
    /// # Errors
    /// [`Error::Domain`] for a degree that is not in 1 … [`MAX_SPLAT_DEGREE`].
    pub fn new(degree: usize, basis: SplatBasis) -> Result<Self> {
        if !(1..=MAX_SPLAT_DEGREE).contains(&degree) {
            return Err(Error::Domain {
                what: "the degree of splats",
                value: degree as f64,
                allowed: "1, 2, 3 or 4",
            });
        }
        let (mut places, mut elements) = (Vec::new(), Vec::new());
        for l in 0..=degree {
            let orders = -(l as isize)..=l as isize;
            for m in orders.clone() {
                let (order, column) = (m.unsigned_abs(), usize::from(m < 0));
                places.push(match basis {
                    SplatBasis::Lobes => {
                        column_start(degree, order) + column * (degree + 1 - order) + l - order
                    }
                    _ => (l * l + l).wrapping_add_signed(m),
                });
                if l > 1 {
                    elements.extend(orders.clone().map(|column| terms(l, m, column)));
                }
            }
        }
        Ok(Self {
            degree,
            basis,
            channels: 1,
            left_out: 0,
            level: vectors::level(),
            places,
            elements,
        })
    }

    /// The same for sets of several channels beside each other: `[coefficient][channel]`, as colours
    /// are in 3DGS's tensors and in glTF. (Channels one after the other, as in 3DGS's files, are sets
    /// by themselves.)
    ///
    /// # Errors
    /// [`Error::Domain`] for no channel.
    pub fn with_channels(self, channels: usize) -> Result<Self> {
        if channels == 0 {
            return Err(Error::Domain {
                what: "the number of channels",
                value: 0.0,
                allowed: "1 or more",
            });
        }
        Ok(Self { channels, ..self })
    }

    /// The same for sets without the coefficient of degree 0, which no rotation changes: 3DGS keeps
    /// it elsewhere.
    #[must_use]
    pub fn without_degree_0(self) -> Self {
        Self {
            left_out: 1,
            ..self
        }
    }

    /// The degree.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// How many values a set has, over all channels.
    pub fn set_len(&self) -> usize {
        (self.places.len() - self.left_out) * self.channels
    }

    /// Rotates the sets in place, each rotation as many that follow each other as the others: one
    /// rotation all of them, as many rotations as sets each its own set.
    ///
    /// Results do not depend on how sets are divided among calls or threads. What is refused is left
    /// as it was.
    ///
    /// # Errors
    /// [`Error::Length`] where the sets are not whole, or their number no multiple of that of the
    /// rotations; [`Error::NotUnit`] for a quaternion whose length is not within 10⁻⁴ of 1 (what it
    /// is off is divided out); [`Error::NotFinite`] where a coefficient is not finite, and
    /// [`Error::Overflow`] where one is beyond a quarter of the largest number.
    pub fn rotate<T: SplatNumber>(
        &self,
        sets: &mut [T],
        rotations: &[DQuat],
        parallelism: Parallelism,
    ) -> Result<()> {
        let length = self.set_len();
        let count = sets.len() / length;
        if !sets.len().is_multiple_of(length) {
            return Err(Error::Length {
                what: "the array of sets",
                expected: (count + 1) * length,
                got: sets.len(),
            });
        }
        for (index, turn) in rotations.iter().enumerate() {
            let size = turn.length();
            if !((size - 1.0).abs() <= UNIT) {
                return Err(Error::NotUnit {
                    what: "the quaternion",
                    index,
                    length: size,
                });
            }
        }
        if sets.is_empty() {
            return Ok(());
        }
        if rotations.is_empty() || !count.is_multiple_of(rotations.len()) {
            return Err(Error::Length {
                what: "the array of rotations",
                expected: count,
                got: rotations.len(),
            });
        }
        let size = CHUNK * length;
        let within = |value: &T| value.get().abs() <= T::LARGEST;
        let fine = parallelism.map(sets.len().div_ceil(size), |chunk| {
            let values = &sets[chunk * size..sets.len().min((chunk + 1) * size)];
            values.iter().fold(true, |all, value| all & within(value))
        });
        if let Some(chunk) = fine.iter().position(|fine| !fine) {
            let at = chunk * size;
            let index = at + sets[at..].iter().take_while(|value| within(value)).count();
            let value = sets[index].get();
            return Err(if value.is_finite() {
                Error::Overflow {
                    what: "the rotated coefficients",
                }
            } else {
                Error::NotFinite {
                    what: "the array of sets",
                    index,
                    value,
                }
            });
        }
        let share = count / rotations.len();
        over_chunks(parallelism, sets, size, |chunk, sets| {
            wide!(self.level, simd => self.chunk(simd, sets, chunk * CHUNK, rotations, share));
        });
        Ok(())
    }

    /// Rotates sets of which the first is the set `first` of all, each rotation a share of them.
    #[inline(always)]
    fn chunk<S: Simd, T: SplatNumber>(
        &self,
        simd: S,
        sets: &mut [T],
        first: usize,
        rotations: &[DQuat],
        share: usize,
    ) {
        let mut matrices = [[0.0; LANES]; ELEMENTS];
        let mut known = [usize::MAX; LANES];
        let length = self.set_len();
        // Of the first channel, from degree 1 on.
        let mut places = [0; COEFFICIENTS];
        for (at, place) in places.iter_mut().zip(&self.places[1..]) {
            *at = (place - self.left_out) * self.channels;
        }
        let places = &places[..self.places.len() - 1];
        for (octet, sets) in sets.chunks_mut(LANES * length).enumerate() {
            let used = sets.len() / length;
            // Lanes without a set turn as the last set does.
            let whose: [usize; LANES] =
                std::array::from_fn(|lane| (first + octet * LANES + lane.min(used - 1)) / share);
            if whose != known {
                known = whose;
                let turns = whose.map(|which| self.basis.frame(rotations[which]));
                self.fill(simd, &turns, &mut matrices);
            }
            for channel in 0..self.channels {
                let mut values = [[0.0; LANES]; COEFFICIENTS];
                for (lane, set) in sets.chunks_exact(length).enumerate() {
                    for (values, place) in values.iter_mut().zip(places) {
                        values[lane] = set[place + channel].get();
                    }
                }
                let mut turned = [[0.0; LANES]; COEFFICIENTS];
                for l in 1..=self.degree {
                    let (side, from) = (2 * l + 1, l * l - 1);
                    let rows = matrices[matrix_start(l)..].chunks_exact(side);
                    for (turned, row) in turned[from..from + side].iter_mut().zip(rows) {
                        let mut sum = f64x8::splat(simd, 0.0);
                        for (element, value) in row.iter().zip(&values[from..]) {
                            let element = f64x8::load_array_ref(simd, element);
                            sum = element.mul_add(f64x8::load_array_ref(simd, value), sum);
                        }
                        *turned = sum.into();
                    }
                }
                for (lane, set) in sets.chunks_exact_mut(length).enumerate() {
                    for (turned, place) in turned.iter().zip(places) {
                        set[place + channel] = T::set(turned[lane]);
                    }
                }
            }
        }
    }

    /// The matrices of eight rotations, by lane.
    #[inline(always)]
    fn fill<S: Simd>(&self, simd: S, turns: &[DQuat; LANES], matrices: &mut [Lanes; ELEMENTS]) {
        let load = |of: fn(&DQuat) -> f64| f64x8::load_array(simd, turns.each_ref().map(of));
        let [x, y, z, w] = [load(|q| q.x), load(|q| q.y), load(|q| q.z), load(|q| q.w)];
        let [xx, yy, zz, ww] = [x * x, y * y, z * z, w * w];
        let scale = 1.0 / (ww + xx + yy + zz);
        let twice = scale + scale;
        // Rows and columns y, z, x.
        let first = [
            (ww - xx + yy - zz) * scale,
            (y * z - w * x) * twice,
            (x * y + w * z) * twice,
            (y * z + w * x) * twice,
            (ww - xx - yy + zz) * scale,
            (x * z - w * y) * twice,
            (x * y - w * z) * twice,
            (x * z + w * y) * twice,
            (ww + xx - yy - zz) * scale,
        ];
        for (lanes, value) in matrices.iter_mut().zip(first) {
            *lanes = value.into();
        }
        for (i, terms) in self.elements.iter().enumerate() {
            let mut sum = f64x8::splat(simd, 0.0);
            for term in terms {
                let product = f64x8::load_array_ref(simd, &matrices[term.first])
                    * f64x8::load_array_ref(simd, &matrices[term.before]);
                sum = product.mul_add(f64x8::splat(simd, term.factor), sum);
            }
            matrices[matrix_start(2) + i] = sum.into();
        }
    }
}
