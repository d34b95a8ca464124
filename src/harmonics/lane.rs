//! The numbers that go side by side in the vectors of a transform: eight in double precision,
//! sixteen in single.

use std::fmt::Debug;

use fearless_simd::prelude::*;
use fearless_simd::{SimdFloatElement, f32x16, f64x8};

/// f64 or f32, and its vector of 512 bits.
///
/// The loops of the transform are written once for both. What is worked out beforehand, the tables
/// of the recurrence and the scales of the coefficients, is in f64 for either.
pub(crate) trait Lane:
    SimdFloatElement + Default + PartialOrd + Send + Sync + 'static
{
    /// How many go side by side.
    const LANES: usize;
    /// Whether the recurrence has to be helped to its digits.
    const SINGLE: bool;
    /// What is left out of a map at most, as a part of its root mean square.
    const NEGLIGIBLE: f64;
    /// A sum of (degree + 1)² harmonics with coefficients below this is finite.
    const MODERATE: Self;
    /// Zero in each lane.
    const ZEROS: Self::Lanes;

    /// One for each lane.
    type Lanes: Copy + Debug + Send + Sync + AsRef<[Self]> + AsMut<[Self]>;
    /// Something for each lane.
    type Each<T>: AsRef<[T]> + AsMut<[T]> + IntoIterator<Item = T>;
    /// The vector.
    type Vector<S: Simd>: SimdFloat<S, Element = Self, Array = Self::Lanes>;

    /// The nearest to a value.
    fn of(value: f64) -> Self;
    /// The value.
    fn value(self) -> f64;
    /// Something for each lane by its number.
    fn each<T>(f: impl FnMut(usize) -> T) -> Self::Each<T>;
    /// A number for each lane by its own.
    fn lanes(f: impl FnMut(usize) -> Self) -> Self::Lanes;
    /// Values as lines of `LANES`; what is left over is left out.
    fn lines(values: &mut [Self]) -> &mut [Self::Lanes];
    /// The line at the beginning of some values, where they are as many.
    fn first_line(values: &[Self]) -> Option<&Self::Lanes>;
    /// That line, to be written.
    fn first_line_mut(values: &mut [Self]) -> Option<&mut Self::Lanes>;
    /// Lines as values.
    fn values(lines: &mut [Self::Lanes]) -> &mut [Self];
    /// A vector of one value.
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Vector<S>;
    /// Transposes as many vectors as there are lanes.
    fn transpose<S: Simd>(rows: Self::Each<Self::Vector<S>>) -> Self::Each<Self::Vector<S>>;

    /// The vector of a line.
    #[inline(always)]
    fn load<S: Simd>(simd: S, line: &Self::Lanes) -> Self::Vector<S> {
        Self::Vector::<S>::load_array_ref(simd, line)
    }

    /// The part of some scratch that begins at a cache line, by lines.
    fn aligned(scratch: &mut [Self]) -> &mut [Self::Lanes] {
        let offset = scratch.as_ptr().align_offset(64).min(scratch.len());
        Self::lines(&mut scratch[offset..])
    }
}

macro_rules! lane {
    ($number:ident, $vector:ident, $lanes:literal, $rounds:literal, $negligible:literal, $moderate:literal) => {
        impl Lane for $number {
            const LANES: usize = $lanes;
            const SINGLE: bool = $lanes == 16;
            const NEGLIGIBLE: f64 = $negligible;
            const MODERATE: Self = $moderate;
            const ZEROS: Self::Lanes = [0.0; $lanes];

            type Lanes = [Self; $lanes];
            type Each<T> = [T; $lanes];
            type Vector<S: Simd> = $vector<S>;

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn value(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn each<T>(f: impl FnMut(usize) -> T) -> [T; $lanes] {
                std::array::from_fn(f)
            }

            #[inline(always)]
            fn lanes(f: impl FnMut(usize) -> Self) -> Self::Lanes {
                std::array::from_fn(f)
            }

            #[inline(always)]
            fn lines(values: &mut [Self]) -> &mut [Self::Lanes] {
                values.as_chunks_mut().0
            }

            #[inline(always)]
            fn first_line(values: &[Self]) -> Option<&Self::Lanes> {
                values.first_chunk()
            }

            #[inline(always)]
            fn first_line_mut(values: &mut [Self]) -> Option<&mut Self::Lanes> {
                values.first_chunk_mut()
            }

            #[inline(always)]
            fn values(lines: &mut [Self::Lanes]) -> &mut [Self] {
                lines.as_flattened_mut()
            }

            #[inline(always)]
            fn splat<S: Simd>(simd: S, value: Self) -> $vector<S> {
                $vector::splat(simd, value)
            }

            #[inline(always)]
            fn transpose<S: Simd>(rows: [$vector<S>; $lanes]) -> [$vector<S>; $lanes] {
                let mut rows = rows;
                for _ in 0..$rounds {
                    let mut next = rows;
                    for i in 0..$lanes / 2 {
                        let (low, high) = rows[i].interleave(rows[i + $lanes / 2]);
                        next[2 * i] = low;
                        next[2 * i + 1] = high;
                    }
                    rows = next;
                }
                rows
            }
        }
    };
}

lane!(f64, f64x8, 8, 3, 1e-14, 1e150);
lane!(f32, f32x16, 16, 4, 1e-8, 1e28);
