//! Double-double arithmetic on vectors of eight: see [`DoubleDouble`] for its sources.

use fearless_simd::f64x8;
use fearless_simd::prelude::*;

use crate::numeric::double_double::DoubleDouble;

/// Eight numbers of about 106 bits.
#[derive(Clone, Copy)]
pub(crate) struct WideDouble<S: Simd> {
    pub(crate) hi: f64x8<S>,
    pub(crate) lo: f64x8<S>,
}

impl<S: Simd> WideDouble<S> {
    #[inline(always)]
    pub(crate) fn load(simd: S, hi: &[f64; 8], lo: &[f64; 8]) -> Self {
        Self {
            hi: f64x8::load_array_ref(simd, hi),
            lo: f64x8::load_array_ref(simd, lo),
        }
    }

    #[inline(always)]
    pub(crate) fn splat(simd: S, value: DoubleDouble) -> Self {
        Self {
            hi: f64x8::splat(simd, value.hi),
            lo: f64x8::splat(simd, value.lo),
        }
    }

    #[inline(always)]
    fn fast_two_sum(a: f64x8<S>, b: f64x8<S>) -> Self {
        let hi = a + b;
        Self {
            hi,
            lo: b - (hi - a),
        }
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        let hi = self.hi + other.hi;
        let t = hi - self.hi;
        let lo = (self.hi - (hi - t)) + (other.hi - t);
        Self::fast_two_sum(hi, lo + (self.lo + other.lo))
    }

    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        self.plus(Self {
            hi: -other.hi,
            lo: -other.lo,
        })
    }

    #[inline(always)]
    pub(crate) fn times(self, other: Self) -> Self {
        let hi = self.hi * other.hi;
        // The error of the product, exact even where the machine has no fused multiply-add.
        let lo = self.hi.mul_add_precise(other.hi, -hi);
        let cross = self.hi.mul_add(other.lo, self.lo * other.hi);
        Self::fast_two_sum(hi, lo + cross)
    }

    /// The exact product of two doubles in each lane.
    #[inline(always)]
    pub(crate) fn product(a: f64x8<S>, b: f64x8<S>) -> Self {
        let hi = a * b;
        Self {
            hi,
            lo: a.mul_add_precise(b, -hi),
        }
    }

    #[inline(always)]
    pub(crate) fn divide(self, other: Self) -> Self {
        let first = self.hi / other.hi;
        let rest = self.minus(other.scaled(first));
        Self::fast_two_sum(first, rest.hi / other.hi)
    }

    #[inline(always)]
    fn scaled(self, factor: f64x8<S>) -> Self {
        let product = Self::product(self.hi, factor);
        Self::fast_two_sum(product.hi, self.lo.mul_add(factor, product.lo))
    }

    /// The square root of numbers above 0.
    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        let root = self.hi.sqrt();
        let rest = self.minus(Self::product(root, root));
        Self::fast_two_sum(root, rest.hi / (root + root))
    }

    #[inline(always)]
    pub(crate) fn store(self, [hi, lo]: &mut [[f64; 8]; 2]) {
        self.hi.store_array(hi);
        self.lo.store_array(lo);
    }

    #[inline(always)]
    pub(crate) fn rounded(self) -> f64x8<S> {
        self.hi + self.lo
    }
}
