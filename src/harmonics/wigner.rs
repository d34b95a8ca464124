//! Wigner's d and D: the matrices by which rotations act on the harmonics of one degree.
//!
//! With d^l_m′m(β) = ⟨l m′| e^(−iβ J_y) |l m⟩ (Wigner; Varshalovich, Moskalev and Khersonskii 1988,
//! doi:10.1142/0270, ch. 4) and R = Z(α) Y(β) Z(γ),
//!
//! D^l_m′m(R) = e^(−im′α) d^l_m′m(β) e^(−imγ),
//!
//! so that the function f(R⁻¹ ω) has the complex coefficients Σ_m D^l_m′m a_lm, harmonics with the
//! Condon–Shortley phase. Rows are m′ and columns m, both from −l to l.
//!
//! To rotate a whole set of coefficients, [`Rotation`](super::Rotation) is far faster and needs no
//! matrix.

use fearless_simd::f64x8;
use fearless_simd::prelude::*;
use glam::DQuat;
use nalgebra::DMatrix;
use num_complex::Complex64;

use super::euler::{Euler, times};
use super::recurrence::{LANES, Lanes};
use super::simd::wide;
use crate::error::allocate;
use crate::numeric::double_double::DoubleDouble;
use crate::numeric::factorial::roots_of_factorials;
use crate::numeric::wide_double::WideDouble;
use crate::{Error, Result, vectors};

/// The largest degree of the matrices.
pub const MAX_WIGNER_DEGREE: usize = 512;

/// The largest |β| of an angle in radians.
const MAX_ANGLE: f64 = 1e6;

/// d^l(β), (2l + 1) × (2l + 1), for β in radians.
///
/// By the recurrence in l at fixed orders, from its closed form at l = max(|m|, |m′|), in double-double
/// arithmetic: each element is within 10⁻¹⁵ of the truth at every degree. Costs O(degree³).
///
/// ```
/// use lobes::harmonics::wigner;
/// let d = wigner::d_matrix(1, 0.3)?;
/// // Rows m′ and columns m are −1, 0, 1.
/// assert!((d[(1, 1)] - 0.3f64.cos()).abs() < 1e-15);
/// assert!((d[(2, 1)] + 0.3f64.sin() / 2f64.sqrt()).abs() < 1e-15);
/// # Ok::<(), lobes::Error>(())
/// ```
///
/// # Errors
/// [`Error::Degree`] beyond [`MAX_WIGNER_DEGREE`]; [`Error::Domain`] for an angle that is not finite
/// or beyond 10⁶.
pub fn d_matrix(degree: usize, beta: f64) -> Result<DMatrix<f64>> {
    one(degree, half(beta)?)
}

/// d^l(β) for l = 0 … `degree`, for hardly more than the last costs: the recurrence passes them all.
///
/// All of them take 4/3 (degree + 1)³ numbers: 1.4 GB at degree 512.
///
/// ```
/// use lobes::harmonics::wigner;
/// let all = wigner::d_matrices(4, 0.7)?;
/// assert!((&all[3] - wigner::d_matrix(3, 0.7)?).amax() < 1e-15);
/// # Ok::<(), lobes::Error>(())
/// ```
///
/// # Errors
/// Those of [`d_matrix`], and [`Error::Memory`] where there is none.
pub fn d_matrices(degree: usize, beta: f64) -> Result<Vec<DMatrix<f64>>> {
    check(degree)?;
    let half = half(beta)?;
    let mut all = (0..=degree).map(zeros).collect::<Result<Vec<_>>>()?;
    WignerRecurrence::new(degree, half).fill(&mut all, 0);
    Ok(all)
}

/// D^l(R), (2l + 1) × (2l + 1), of a rotation of the harmonic frame: what takes the complex
/// coefficients of f, harmonics with the Condon–Shortley phase, to those of f(R⁻¹ ω).
///
/// The quaternion need not be of unit length. Each element is within 10⁻¹⁵ of the truth for the
/// rotation of the quaternion as it is given.
///
/// ```
/// use lobes::glam::DQuat;
/// use lobes::harmonics::wigner;
/// // About the pole by 0.4: e^(−0.4 i m) on the diagonal.
/// let d = wigner::rotation_matrix(2, DQuat::from_rotation_z(0.4))?;
/// assert!((d[(4, 4)].re - 0.8f64.cos()).abs() < 1e-15 && (d[(4, 4)].im + 0.8f64.sin()).abs() < 1e-15);
/// # Ok::<(), lobes::Error>(())
/// ```
///
/// # Errors
/// [`Error::Degree`] beyond [`MAX_WIGNER_DEGREE`]; [`Error::Domain`] for a quaternion of no or of
/// infinite length.
pub fn rotation_matrix(degree: usize, rotation: DQuat) -> Result<DMatrix<Complex64>> {
    let length = rotation.length();
    if !(length > 0.0 && length.is_finite()) {
        return Err(Error::Domain {
            what: "the length of a quaternion",
            value: length,
            allowed: "positive and finite",
        });
    }
    let euler = Euler::of(rotation);
    let d = one(degree, euler.half_beta)?;
    let (rows, columns) = (phases(degree, euler.alpha), phases(degree, euler.gamma));
    Ok(DMatrix::from_fn(2 * degree + 1, 2 * degree + 1, |i, j| {
        rows[i] * columns[j] * d[(i, j)]
    }))
}

/// What takes the real coefficients of one degree of f to those of f(R⁻¹ ω): orthogonal, rows and
/// columns m from −l (sine) to l (cosine).
///
/// It acts on the harmonics of this crate, without the Condon–Shortley phase, in their order l² + l +
/// m. For degree 1 these are (y, z, x), so that the matrix is that of the rotation with its rows and
/// columns in that order.
///
/// ```
/// use lobes::glam::{DMat3, DQuat};
/// use lobes::harmonics::wigner;
/// let turn = DQuat::from_xyzw(0.1, -0.4, 0.2, 0.7).normalize();
/// let (of_degree_1, matrix) = (wigner::real_rotation_matrix(1, turn)?, DMat3::from_quat(turn));
/// assert!((of_degree_1[(0, 2)] - matrix.row(1).x).abs() < 1e-15); // y from x
/// # Ok::<(), lobes::Error>(())
/// ```
///
/// # Errors
/// Those of [`rotation_matrix`].
pub fn real_rotation_matrix(degree: usize, rotation: DQuat) -> Result<DMatrix<f64>> {
    let d = rotation_matrix(degree, rotation)?;
    let sign = |m: usize| if m.is_multiple_of(2) { 1.0 } else { -1.0 };
    // a_lm = (−1)^m (c_m − i c_−m)/√2 and a_l,−m = (c_m + i c_−m)/√2 for m > 0.
    Ok(DMatrix::from_fn(2 * degree + 1, 2 * degree + 1, |i, j| {
        let (row, column) = (i.abs_diff(degree), j.abs_diff(degree));
        let at = |m: usize| d[(degree + row, m)];
        let (with, against) = (at(degree + column) * sign(column), at(degree - column));
        let value = if column == 0 {
            against * std::f64::consts::SQRT_2
        } else if j > degree {
            with + against
        } else {
            // −i (with − against)
            let difference = with - against;
            Complex64::new(difference.im, -difference.re)
        };
        let value = if row == 0 {
            value.re * std::f64::consts::FRAC_1_SQRT_2
        } else if i > degree {
            value.re
        } else {
            -value.im
        };
        value * sign(row)
    }))
}

fn check(degree: usize) -> Result<()> {
    if degree > MAX_WIGNER_DEGREE {
        return Err(Error::Degree {
            what: "Wigner's matrix",
            degree,
            limit: MAX_WIGNER_DEGREE,
        });
    }
    Ok(())
}

/// (cos, sin) of β/2.
fn half(beta: f64) -> Result<[DoubleDouble; 2]> {
    if !(beta.abs() <= MAX_ANGLE) {
        return Err(Error::Domain {
            what: "the angle β in radians",
            value: beta,
            allowed: "finite and at most 10⁶ in size",
        });
    }
    Ok(DoubleDouble::cos_sin(0.5 * beta))
}

fn zeros(degree: usize) -> Result<DMatrix<f64>> {
    let side = 2 * degree + 1;
    let values = allocate("Wigner's matrices", side * side)?;
    Ok(DMatrix::from_vec(side, side, values))
}

fn one(degree: usize, half: [DoubleDouble; 2]) -> Result<DMatrix<f64>> {
    check(degree)?;
    let mut d = [zeros(degree)?];
    WignerRecurrence::new(degree, half).fill(&mut d, degree);
    let [d] = d;
    Ok(d)
}

/// e^(−imφ) for m = −degree … degree, from (cos φ, sin φ).
fn phases(degree: usize, angle: [DoubleDouble; 2]) -> Vec<Complex64> {
    let mut phases = vec![Complex64::ONE; 2 * degree + 1];
    let mut power = [DoubleDouble::ONE, DoubleDouble::ZERO];
    for m in 1..=degree {
        power = times(power, angle);
        let phase = Complex64::new(power[0].to_f64(), -power[1].to_f64());
        phases[degree + m] = phase;
        phases[degree - m] = phase.conj();
    }
    phases
}

/// A number as mantissa and exponent of 2.
type Scaled = (DoubleDouble, i32);

/// √(2l+1) d^l_km = α_l p_l with p_{l+1} = 2 α_l² (cos β − k m/(l(l+1))) p_l − p_{l−1}, α_l² = A²(k, l)
/// A²(m, l) B²(l), for m ≥ |k|; the other elements follow by symmetry.
struct WignerRecurrence {
    degree: usize,
    cosine: DoubleDouble,
    /// A²(k, l) of eight k from 8 · octet at `octet · (degree + 1) + l`, high and low; 0 for l < k.
    squares: Vec<[Lanes; 2]>,
    /// B²(l).
    of_degree: Vec<DoubleDouble>,
    /// √(k!), and the powers of cos β/2 and sin β/2.
    roots: Vec<Scaled>,
    cosines: Vec<Scaled>,
    sines: Vec<Scaled>,
}

/// x^k for k = 0 … last.
fn powers(x: DoubleDouble, last: usize) -> Vec<Scaled> {
    let mut power = (DoubleDouble::ONE, 0);
    let mut all = vec![power];
    for _ in 0..last {
        power.0 = power.0 * x;
        if power.0.hi != 0.0 && power.0.hi.abs() < 0.5f64.powi(64) {
            power.0 = power.0.scale(2f64.powi(64));
            power.1 -= 64;
        }
        all.push(power);
    }
    all
}

impl WignerRecurrence {
    fn new(degree: usize, [cosine, sine]: [DoubleDouble; 2]) -> Self {
        let octets = degree / LANES + 1;
        let mut squares = vec![[[0.0; LANES]; 2]; octets * (degree + 1)];
        // A²(k, l) A²(k, l+1) (1 − k²/(l+1)²) = 1, downwards from where it hardly alternates; B
        // likewise with l²/(4l²−1) and ¼.
        for k in 0..=degree {
            let f = |l: usize| ((l * l) as f64, (l * l - k * k) as f64);
            let ((n1, d1), (n2, d2)) = (f(degree + 1), f(degree + 2));
            let mut square = DoubleDouble::from((n1 / d1 * (n2 / d2)).powf(0.25));
            for l in (k..=degree).rev() {
                let [hi, lo] = &mut squares[k / LANES * (degree + 1) + l];
                (hi[k % LANES], lo[k % LANES]) = (square.hi, square.lo);
                if l > k {
                    let (n, d) = f(l);
                    square = DoubleDouble::from(n).divide(square.scale(d));
                }
            }
        }
        let mut of_degree = vec![DoubleDouble::ONE; degree + 1];
        for l in (0..degree).rev() {
            let four = (4 * (l + 1) * (l + 1)) as f64;
            of_degree[l] = DoubleDouble::from(four - 1.0).divide(of_degree[l + 1].scale(four));
        }
        Self {
            degree,
            cosine: (cosine - sine) * (cosine + sine),
            squares,
            of_degree,
            roots: roots_of_factorials(2 * degree),
            cosines: powers(cosine, 2 * degree),
            sines: powers(sine, 2 * degree),
        }
    }

    fn square(&self, k: usize, l: usize) -> DoubleDouble {
        let [hi, lo] = &self.squares[k / LANES * (self.degree + 1) + l];
        DoubleDouble {
            hi: hi[k % LANES],
            lo: lo[k % LANES],
        }
    }

    /// d^m_±k,m = √C(2m, m ± k) cos^(m ± k)(β/2) sin^(m ∓ k)(β/2), over its α/√(2m+1).
    fn start(&self, m: usize, k: usize) -> [DoubleDouble; 2] {
        let (n, d1, d2) = (self.roots[2 * m], self.roots[m + k], self.roots[m - k]);
        let square = self.square(k, m) * self.square(m, m) * self.of_degree[m];
        let scale = DoubleDouble::from((2 * m + 1) as f64).divide(square).sqrt();
        let root = n.0.divide(d1.0 * d2.0) * scale;
        [(m + k, m - k), (m - k, m + k)].map(|(of_cosine, of_sine)| {
            let (c, s) = (self.cosines[of_cosine], self.sines[of_sine]);
            let exponent = n.1 - d1.1 - d2.1 + c.1 + s.1;
            // What is of the size of 1 at degree 512 starts at 2^(−1024/e) at the least.
            if exponent < -900 {
                return DoubleDouble::ZERO;
            }
            (root * c.0 * s.0).scale(2f64.powi(exponent))
        })
    }

    /// Fills the matrices of the degrees from `first` on.
    fn fill(&self, matrices: &mut [DMatrix<f64>], first: usize) {
        let level = vectors::level();
        for m in 0..=self.degree {
            for octet in 0..=m / LANES {
                wide!(level, simd => self.pairs(simd, m, octet, matrices, first));
            }
        }
    }

    /// Order m with eight orders k ≤ m and their negatives.
    #[inline(always)]
    fn pairs<S: Simd>(
        &self,
        simd: S,
        m: usize,
        octet: usize,
        matrices: &mut [DMatrix<f64>],
        first: usize,
    ) {
        let low = octet * LANES;
        let used = LANES.min(m + 1 - low);
        let mut starts = [[[0.0; LANES]; 2]; 2];
        let mut orders = [0.0; LANES];
        for lane in 0..LANES {
            orders[lane] = (low + lane) as f64;
            if lane < used {
                for (start, value) in starts.iter_mut().zip(self.start(m, low + lane)) {
                    (start[0][lane], start[1][lane]) = (value.hi, value.lo);
                }
            }
        }
        let mut plus = WideDouble::load(simd, &starts[0][0], &starts[0][1]);
        let mut minus = WideDouble::load(simd, &starts[1][0], &starts[1][1]);
        let zero = WideDouble::splat(simd, DoubleDouble::ZERO);
        let (mut before_plus, mut before_minus) = (zero, zero);
        let orders = WideDouble {
            hi: f64x8::load_array(simd, orders),
            lo: zero.hi,
        };
        let cosine = WideDouble::splat(simd, self.cosine);
        let squares = &self.squares[octet * (self.degree + 1)..][..=self.degree];
        for l in m..=self.degree {
            let of_m = self.square(m, l) * self.of_degree[l];
            let [hi, lo] = &squares[l];
            if l >= first {
                // α_l/√(2l+1)
                let over = of_m.divide(DoubleDouble::from((2 * l + 1) as f64)).hi;
                let scale = (f64x8::load_array_ref(simd, hi) * over).sqrt();
                let values = [plus, minus].map(|p| Lanes::from(p.rounded() * scale));
                place(&mut matrices[l - first], l, m, low, used, &values);
            }
            if l == self.degree {
                break;
            }
            let twice =
                WideDouble::load(simd, hi, lo).times(WideDouble::splat(simd, of_m.scale(2.0)));
            let ratio = if l == 0 {
                DoubleDouble::ZERO
            } else {
                DoubleDouble::from(m as f64).divide(DoubleDouble::from((l * (l + 1)) as f64))
            };
            let shift = orders.times(WideDouble::splat(simd, ratio));
            let next = twice
                .times(cosine.minus(shift))
                .times(plus)
                .minus(before_plus);
            (before_plus, plus) = (plus, next);
            let next = twice
                .times(cosine.plus(shift))
                .times(minus)
                .minus(before_minus);
            (before_minus, minus) = (minus, next);
        }
    }
}

/// Writes d_km and d_−k,m for `used` orders k from `low`, and what is equal to them: d_m′m = (−1)^(m−m′)
/// d_mm′ = d_−m,−m′.
fn place(
    d: &mut DMatrix<f64>,
    l: usize,
    m: usize,
    low: usize,
    used: usize,
    [plus, minus]: &[Lanes; 2],
) {
    for lane in 0..used {
        let k = low + lane;
        let sign = if (m + k).is_multiple_of(2) { 1.0 } else { -1.0 };
        let (value, other) = (plus[lane], minus[lane]);
        d[(l + k, l + m)] = value;
        d[(l - m, l - k)] = value;
        d[(l + m, l + k)] = sign * value;
        d[(l - k, l - m)] = sign * value;
        d[(l - k, l + m)] = other;
        d[(l - m, l + k)] = other;
        d[(l + m, l - k)] = sign * other;
        d[(l + k, l - m)] = sign * other;
    }
}
