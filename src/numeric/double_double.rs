//! Numbers of about 106 bits as unevaluated sums of two doubles.
//!
//! Used where a double's rounding would show in a result that is promised to the last bits: the
//! nodes and weights of quadrature, and recurrences that run through thousands of steps. The
//! algorithms are Dekker's and Knuth's; their error bounds are in Joldes, Muller and Popescu 2017,
//! *Tight and rigorous error bounds for basic building blocks of double-word arithmetic*,
//! doi:10.1145/3121432.

use std::f64::consts::FRAC_PI_2;
use std::ops::{Add, Mul, Neg, Sub};

/// The unevaluated sum `hi + lo`, with |lo| at most half a unit in the last place of `hi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DoubleDouble {
    pub(crate) hi: f64,
    pub(crate) lo: f64,
}

/// `a + b` exactly, as a rounded sum and its error (Knuth).
#[inline(always)]
fn two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    let t = hi - a;
    DoubleDouble {
        hi,
        lo: (a - (hi - t)) + (b - t),
    }
}

/// `a + b` exactly where |a| ≥ |b| (Dekker).
#[inline(always)]
fn fast_two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    DoubleDouble {
        hi,
        lo: b - (hi - a),
    }
}

/// `a · b` exactly, by one fused multiply-add.
#[inline(always)]
fn two_product(a: f64, b: f64) -> DoubleDouble {
    let hi = a * b;
    DoubleDouble {
        hi,
        lo: a.mul_add(b, -hi),
    }
}

impl DoubleDouble {
    pub(crate) const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    pub(crate) const ONE: Self = Self { hi: 1.0, lo: 0.0 };

    /// π to 106 bits.
    pub(crate) const PI: Self = Self {
        hi: std::f64::consts::PI,
        lo: 1.224_646_799_147_353_2e-16,
    };

    /// The exact product of two doubles.
    #[inline(always)]
    pub(crate) fn product(a: f64, b: f64) -> Self {
        two_product(a, b)
    }

    /// The nearest double.
    #[inline(always)]
    pub(crate) fn to_f64(self) -> f64 {
        self.hi + self.lo
    }

    /// `self · b` for a double `b`.
    #[inline(always)]
    pub(crate) fn scale(self, b: f64) -> Self {
        let p = two_product(self.hi, b);
        fast_two_sum(p.hi, self.lo.mul_add(b, p.lo))
    }

    /// `self / other`.
    #[inline(always)]
    pub(crate) fn divide(self, other: Self) -> Self {
        let first = self.hi / other.hi;
        let rest = self - other.scale(first);
        let second = rest.hi / other.hi;
        let rest = rest - other.scale(second);
        fast_two_sum(first, second) + Self::from(rest.hi / other.hi)
    }

    /// The cosine and sine of a double, |x| at most some 10⁶: π in 106 bits is what it is reduced by.
    pub(crate) fn cos_sin(x: f64) -> [Self; 2] {
        let quarters = (x / FRAC_PI_2).round();
        let rest = Self::from(x) - Self::PI.scale(0.5 * quarters);
        // Taylor's series of a thirty-second of what is left; the angle is then doubled five times.
        let small = rest.scale(1.0 / 32.0);
        let minus_square = -(small * small);
        let (mut term, mut sine) = (small, small);
        let (mut even, mut versine) = (minus_square.scale(-0.5), minus_square.scale(-0.5));
        for k in 1..9 {
            let k = f64::from(2 * k);
            term = (term * minus_square).divide(Self::from(k * (k + 1.0)));
            sine = sine + term;
            even = (even * minus_square).divide(Self::from((k + 1.0) * (k + 2.0)));
            versine = versine + even;
        }
        // 1 − cos x keeps its digits where cos x would lose them.
        for _ in 0..5 {
            let cosine = Self::ONE - versine;
            versine = (sine * sine).scale(2.0);
            sine = (sine * cosine).scale(2.0);
        }
        let cosine = Self::ONE - versine;
        match quarters.rem_euclid(4.0) as u8 {
            0 => [cosine, sine],
            1 => [-sine, cosine],
            2 => [-cosine, -sine],
            _ => [sine, -cosine],
        }
    }

    /// The square root; 0 for 0.
    pub(crate) fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::ZERO;
        }
        let root = self.hi.sqrt();
        let rest = self - two_product(root, root);
        let root = fast_two_sum(root, rest.hi / (2.0 * root));
        let rest = self - root * root;
        root + Self::from(rest.hi / (2.0 * root.hi))
    }
}

impl From<f64> for DoubleDouble {
    #[inline(always)]
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let s = two_sum(self.hi, other.hi);
        let t = two_sum(self.lo, other.lo);
        let v = fast_two_sum(s.hi, s.lo + t.hi);
        fast_two_sum(v.hi, t.lo + v.lo)
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + (-other)
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let p = two_product(self.hi, other.hi);
        let cross = self.hi.mul_add(other.lo, self.lo * other.hi);
        fast_two_sum(p.hi, p.lo + cross)
    }
}
