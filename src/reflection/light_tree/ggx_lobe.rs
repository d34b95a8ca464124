//! The GGX lobe for the tree.

use std::f64::consts::PI;

use fearless_simd::{f64x8, prelude::*};
use glam::DVec3;
use num_complex::Complex64;

use super::half_vector::{HalfVector, LengthsAt, LengthsRange, Measure};
use super::lobe::Lobe;
use super::neighbourhood::Neighbourhood;
use crate::reflectance::Fresnel;

/// A relative step of |H|²/4 in the table of [`Facets`], as bits of a double: a quarter of a power
/// of 2.
const STEP: u32 = f64::MANTISSA_DIGITS - 1 - 2;

/// The smallest |H|²/4 of that table.
const LEAST: f64 = f64::from_bits((1023 - 60) << (f64::MANTISSA_DIGITS - 1));

/// The largest distance from |H|²/4, over itself, for which the table is made.
const SHARE: f64 = 0.6;

/// How facets reflect the three channels, and bounds of it.
#[derive(Debug, Clone)]
pub(super) struct Facets {
    fresnel: [Fresnel; 3],
    /// At least |F| of every channel over the complex disc about each |H|²/4 whose radius is
    /// [`SHARE`] of it, from [`LEAST`] to 1 in steps of a quarter of a power of 2.
    bounds: Vec<f64>,
}

impl Facets {
    pub(super) fn new(fresnel: [Fresnel; 3]) -> Self {
        let first = LEAST.to_bits() >> STEP;
        let last = 1.0f64.to_bits() >> STEP;
        let [red, green, blue] = fresnel;
        let mut distinct = vec![red];
        distinct.extend([green, blue].into_iter().filter(|other| *other != red));
        let bound = |index: u64| {
            let ends = [index, index + 1].map(|index| f64::from_bits(index << STEP));
            let (low, high) = (ends[0] * (1.0 - SHARE), ends[1] * (1.0 + SHARE));
            let disc = (0.5 * (low + high), 0.5 * (high - low) * (1.0 + 1e-12));
            distinct
                .iter()
                .map(|fresnel| bound_over_disc(*fresnel, disc))
                .fold(0.0, f64::max)
        };
        Self {
            fresnel,
            bounds: (first..=last).map(bound).collect(),
        }
    }

    /// At least |F| of every channel where |H|²/4 is complex and within `off` of `square`; infinite
    /// where the table does not say.
    #[inline(always)]
    fn bound<S: Simd>(&self, simd: S, square: f64x8<S>, off: f64x8<S>) -> f64x8<S> {
        let infinite = f64x8::splat(simd, f64::INFINITY);
        let mut squares = [0.0; 8];
        square.store_slice(&mut squares);
        let first = (LEAST.to_bits() >> STEP) as usize;
        let bounds = squares.map(|square: f64| {
            let index = ((square.min(1.0).to_bits() >> STEP) as usize).checked_sub(first);
            index
                .and_then(|index| self.bounds.get(index))
                .map_or(f64::INFINITY, |bound| *bound)
        });
        let near = off.simd_le(square * SHARE);
        near.select(f64x8::from_slice(simd, &bounds), infinite)
    }
}

/// At least |F| over a complex disc about a real middle.
///
/// What is analytic is largest on the rim, of which one half mirrors the other; that is covered by
/// small discs.
fn bound_over_disc(fresnel: Fresnel, (middle, radius): (f64, f64)) -> f64 {
    const ARCS: usize = 16;
    if fresnel.bound(middle.into(), radius).is_infinite() {
        return f64::INFINITY;
    }
    let step = PI / ARCS as f64;
    let small = 2.0 * radius * (0.25 * step).sin() * (1.0 + 1e-12);
    (0..ARCS)
        .map(|arc| {
            let place = Complex64::from_polar(radius, step * (arc as f64 + 0.5));
            fresnel.bound(place + middle, small)
        })
        .fold(0.0, f64::max)
}

/// A GGX lobe whose facets reflect each channel in their own way.
///
/// f c_i = F D c_i/(2 (c_i r_v + c_v r_i)), which is the product of D, F and Smith's factor of
/// [`Ggx`](crate::reflectance::Ggx). With s = α_x α_y and A the stretch of tangents by √(α_y/α_x)
/// along x and its inverse along y, D = (s H·H/q)²/(π s), q = s H_z² + (A H_T)·(A H_T); with α the
/// smaller of the widths and w the light's part along the tangent of the larger, β,
/// r² = α² + (1 − α²) c² + (β² − α²) w².
#[derive(Debug, Clone, Copy)]
pub(super) struct GgxLobe<'a> {
    half: HalfVector,
    measure: Measure,
    /// s and 1/s.
    square: f64,
    inverse: f64,
    /// α².
    narrow: f64,
    /// β² − α².
    wider: f64,
    /// w by the parts of H_T, and what is taken off it.
    along: [f64; 3],
    /// r_v.
    view: f64,
    facets: &'a Facets,
}

impl<'a> GgxLobe<'a> {
    /// A lobe of the widths along a tangent and across it, at a normal and a view above its horizon,
    /// in the map's frame.
    pub(super) fn new(
        [first, second]: [f64; 2],
        tangent: DVec3,
        facets: &'a Facets,
        normal: DVec3,
        view: DVec3,
    ) -> Self {
        let half = HalfVector::new(normal, view);
        let square = first * second;
        let [forward, aside, _] = half.tangential(tangent);
        let wide = if first > second {
            tangent
        } else {
            normal.cross(tangent)
        };
        let narrow = first.min(second).powi(2);
        let wider = first.max(second).powi(2) - narrow;
        let part = view.dot(wide);
        let beside = (1.0 - narrow).mul_add(half.cosine * half.cosine, narrow);
        Self {
            half,
            measure: Measure::new([forward, aside], (second / first).sqrt()),
            square,
            inverse: 1.0 / square,
            narrow,
            wider,
            along: half.tangential(wide),
            view: (wider * part).mul_add(part, beside).sqrt(),
            facets,
        }
    }

    /// The factor 1/(2π s).
    fn peak(&self) -> f64 {
        self.inverse / (2.0 * PI)
    }

    /// r of a light of this height and w; never more without w.
    #[inline(always)]
    fn stretched<S: Simd>(&self, simd: S, height: f64x8<S>, along: f64x8<S>) -> f64x8<S> {
        let zero = f64x8::splat(simd, 0.0);
        let beside = height * height * (1.0 - self.narrow) + self.narrow;
        (along * along * self.wider + beside).max(zero).sqrt()
    }

    /// A bound of the largest channel's reflectance.
    #[inline(always)]
    fn reflectance<S: Simd>(&self, simd: S, range: &LengthsRange<S>) -> f64x8<S> {
        // The square of the half vector's cosine to the view, |H|²/4, and how far it is off.
        let square = range.length * range.length * 0.25;
        let off = (range.length * 2.0 + range.away) * range.away * 0.25;
        self.facets.bound(simd, square, off)
    }

    /// A bound of D c_i/(2 (c_i r_v + c_v r_i)) from one of c_i/(c_i r_v + c_v r_i).
    ///
    /// Re q is at least s (Re H_z)² + |Re A H_T|² − |A|² |Im H|², since s ≤ 1 ≤ |A|.
    #[inline(always)]
    fn with_density<S: Simd>(
        &self,
        simd: S,
        range: &LengthsRange<S>,
        masked: f64x8<S>,
    ) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let zero = splat(0.0);
        let up = range.up.max(zero);
        // |q| is no less than its real part.
        let aside = range.aside * self.measure.most;
        let real = up * up * self.square + range.tangent * range.tangent - aside * aside;
        let ratio = range.square * self.square / real;
        let value = ratio * ratio * masked * self.peak();
        zero.simd_lt(real).select(value, splat(f64::INFINITY))
    }

    /// A bound of 1/(c_i r_v + c_v r_i) where it is analytic over all of a range.
    #[inline(always)]
    fn masked_over_height<S: Simd>(&self, simd: S, range: &LengthsRange<S>) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let zero = splat(0.0);
        let above = range.least.max(zero);
        // The real part of r² is at least this, and √ of a number in the right half plane has a
        // real part of at least the root of its real part.
        let square = (above * above - range.imaginary * range.imaginary) * (1.0 - self.narrow)
            + self.narrow
            - range.aside * range.aside * self.wider;
        let whole = range.least * self.view + square.max(zero).sqrt() * self.half.cosine;
        let finite = zero.simd_lt(square) & zero.simd_lt(whole);
        finite.select(splat(1.0) / whole, splat(f64::INFINITY))
    }

    /// A bound of c_i/(c_i r_v + c_v r_i) where it is analytic over all of a range.
    #[inline(always)]
    fn masked<S: Simd>(&self, simd: S, range: &LengthsRange<S>) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let value = range.top * self.masked_over_height(simd, range);
        // r_i/c_i lies in the right half plane where c_i does, whose argument is beyond that of r_i; of
        // two widths, whose w may turn r_i by an eighth of a circle either way, where c_i has no larger
        // an argument than that.
        let turned = if self.wider > 0.0 {
            range.imaginary
        } else {
            splat(0.0)
        };
        let right = turned.simd_lt(range.least) & value.simd_lt(splat(f64::INFINITY));
        right.select(value.min(splat(1.0 / self.view)), value)
    }
}

impl Lobe for GgxLobe<'_> {
    type At<S: Simd> = LengthsAt<S>;

    fn normal(&self) -> DVec3 {
        self.half.normal
    }

    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, light: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
        let one = f64x8::splat(simd, 1.0);
        let [height, forward, aside] = self.half.parts(simd, light);
        let recip = one / (height + self.half.cosine);
        let recip2 = recip * recip;
        let stretch = forward.mul_add(forward, aside * aside) * recip2 + 1.0;
        let square = self.measure.square(forward, aside) * recip2;
        let ratio = stretch / (square * self.inverse + 1.0);
        let [first, second, less] = self.along;
        let along = forward * first + (aside * second - less);
        let beside = self.stretched(simd, height, along);
        let whole = height * self.view + beside * self.half.cosine;
        let value = ratio * ratio * (height / whole) * self.peak();
        // Half the length of H is the cosine between it and the view.
        let cosine = (stretch.sqrt() / recip * 0.5).min(one);
        let [red, green, blue] = self.facets.fresnel;
        let first = value * red.reflectances(simd, cosine);
        if red == green && green == blue {
            return [first; 3];
        }
        [
            first,
            value * green.reflectances(simd, cosine),
            value * blue.reflectances(simd, cosine),
        ]
    }

    #[inline(always)]
    fn size<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], radius: f64x8<S>) -> f64x8<S> {
        let one = f64x8::splat(simd, 1.0);
        let at = self.at(simd, centre);
        let range = self.half.lengths_above(simd, &at, radius);
        // c_i/(c_i r_v + c_v r_i) = 1/(r_v + c_v r_i/c_i) grows with c_i, and is largest without w.
        let beside = self.stretched(simd, range.top, f64x8::splat(simd, 0.0));
        let masked = range.top / (range.top * self.view + beside * self.half.cosine);
        let reflectance = self.reflectance(simd, &range).min(one);
        self.with_density(simd, &range, masked) * reflectance
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3]) -> LengthsAt<S> {
        self.half.lengths_at(simd, centre, &self.measure)
    }

    #[inline(always)]
    fn bound<S: Simd>(&self, simd: S, at: &LengthsAt<S>, near: Neighbourhood<S>) -> f64x8<S> {
        let range = self.half.lengths_near(simd, at, near);
        self.with_density(simd, &range, self.masked(simd, &range)) * self.reflectance(simd, &range)
    }

    #[inline(always)]
    fn at_the_horizon<S: Simd>(
        &self,
        simd: S,
        centre: [f64x8<S>; 3],
        real: f64x8<S>,
        depth: f64x8<S>,
    ) -> f64x8<S> {
        let one = f64x8::splat(simd, 1.0);
        let at = self.at(simd, centre);
        let range = self.half.lengths_over(simd, &at, real, -depth, depth);
        let reflectance = self.reflectance(simd, &range).min(one);
        self.with_density(simd, &range, self.masked(simd, &range)) * reflectance
    }

    #[inline(always)]
    fn over_height<S: Simd>(&self, simd: S, at: &LengthsAt<S>, near: Neighbourhood<S>) -> f64x8<S> {
        let range = self.half.lengths_near(simd, at, near);
        let masked = self.masked_over_height(simd, &range);
        self.with_density(simd, &range, masked) * self.reflectance(simd, &range)
    }

    #[inline(always)]
    fn reach<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], order: f64) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let [height, forward, aside] = self.half.parts(simd, centre);
        let true_square = forward.mul_add(forward, aside * aside);
        let up = height + splat(self.half.cosine);
        // (1 − x²)⁻² x⁻ᵖ, x the share of the way to the pole of D, is least at x² = p/(p + 4). The real
        // part moves towards the pole as well, in the tail that of H_T, for a rough lobe that of H_z.
        let alpha = self.square.sqrt();
        let share = 0.75 * (order / (order + 4.0)).sqrt() / (1.0 + 0.6 * alpha);
        let square = self.measure.square(forward, aside);
        let pole = (square * 0.25 + up * up * self.square).sqrt();
        // The masking has a pole at H_z = 0.
        let reach = (pole * (share / self.measure.most)).min(up * 0.4);
        // r has a root where the square of the height is −α²/(1 − α²), and F has one where H has no
        // length; the real part moves about as far as the imaginary.
        let square = height * height + self.narrow;
        let root = (square.sqrt() * 0.6).min(square / height.abs() * 0.4);
        let length = up.mul_add(up, true_square).sqrt();
        reach.min(root).min(length * 0.14).max(splat(1e-9))
    }

    fn rounding(&self) -> f64 {
        1e-12 + 1e-14 / (self.narrow.sqrt() * self.half.cosine)
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::super::sampled_bound;
    use super::*;
    use crate::reflectance::Ggx;
    use crate::vectors;

    const FRESNELS: [Fresnel; 5] = [
        Fresnel::Constant(1.0),
        Fresnel::Schlick { normal: 0.04 },
        Fresnel::Dielectric { index: 1.5 },
        Fresnel::Conductor {
            index: 0.17,
            extinction: 3.1,
        },
        Fresnel::Conductor {
            index: 2.7,
            extinction: 0.8,
        },
    ];

    /// F continued analytically, by Fresnel's amplitudes.
    fn reflectance(fresnel: Fresnel, square: Complex64) -> Complex64 {
        let c = square.sqrt();
        let power = |index: Complex64| {
            let g = (index * index - 1.0 + square).sqrt();
            let along = index * index * c;
            ((c - g) / (c + g), (along - g) / (along + g))
        };
        let both = |index: Complex64| {
            let (first, second) = (power(index), power(index.conj()));
            (first.0 * second.0 + first.1 * second.1) * 0.5
        };
        match fresnel {
            Fresnel::Constant(value) => value.into(),
            Fresnel::Schlick { normal } => (1.0 - c).powi(5) * (1.0 - normal) + normal,
            Fresnel::Dielectric { index } => both(index.into()),
            Fresnel::Conductor { index, extinction } => both(Complex64::new(index, extinction)),
        }
    }

    /// The lobe's formula at a complex vector.
    fn complex(lobe: &GgxLobe<'_>, light: [Complex64; 3]) -> f64 {
        let [cosine, up, square] = lobe.half.complex(light);
        let stretch = square + 1.0;
        let [forward, aside] = lobe.half.complex_tangential(light);
        let parts = lobe.measure.parts.map(|[f, a]| forward * f + aside * a);
        let counted = parts[0] * parts[0] + parts[1] * parts[1];
        let density = (stretch / (counted / (up * up) * lobe.inverse + 1.0)).powi(2) * lobe.peak();
        let along = forward * lobe.along[0] + aside * lobe.along[1] - lobe.along[2];
        let beside =
            (cosine * cosine * (1.0 - lobe.narrow) + lobe.narrow + along * along * lobe.wider)
                .sqrt();
        let masked = cosine / (cosine * lobe.view + beside * lobe.half.cosine);
        let value =
            density * masked * reflectance(lobe.facets.fresnel[0], stretch * up * up * 0.25);
        value.norm()
    }

    #[test]
    fn no_complex_vector_passes_the_bound() {
        let facets = FRESNELS.map(|fresnel| Facets::new([fresnel; 3]));
        let lobe = |index: usize, normal: DVec3, view: DVec3| {
            let alpha = [0.01, 0.05, 0.3, 1.0][index % 4];
            let facets = &facets[index / 4 % FRESNELS.len()];
            // Of one width, of a little different ones, and of very different ones, either way.
            let stretch = [1.0, 1.5, 8.0][index / 20 % 3];
            let mut widths = [
                f64::min(alpha * stretch, 1.0),
                f64::max(alpha / stretch, 0.001),
            ];
            if index / 60 % 2 == 1 {
                widths.reverse();
            }
            let tangent = normal.any_orthonormal_vector();
            let lobe = GgxLobe::new(widths, tangent, facets, normal, view);
            (lobe, widths[(index / 120) % 2])
        };
        let (finite, closest) = sampled_bound::check(lobe, complex);
        assert!(finite > 1000 && closest > 0.3, "{finite}, {closest}");
    }

    #[test]
    fn above_the_horizon_it_is_the_lobe() {
        let view = DVec3::new(0.48, 0.36, 0.8);
        for fresnel in FRESNELS {
            for widths in [[0.2, 0.2], [0.05, 0.6], [0.9, 0.01], [1.0, 0.001]] {
                let ggx = Ggx::anisotropic(widths[0], widths[1], fresnel).unwrap();
                let facets = Facets::new([fresnel; 3]);
                let lobe = GgxLobe::new(widths, DVec3::X, &facets, DVec3::Z, view);
                for light in [
                    DVec3::Z,
                    DVec3::new(-0.6, 0.0, 0.8),
                    DVec3::new(0.0, 0.8, 0.6),
                    DVec3::new(-0.64, -0.48, 0.6),
                ] {
                    let [x, y, z] = light.to_array().map(Complex64::from);
                    let (seen, want) = (complex(&lobe, [x, y, z]), ggx.evaluate(view, light));
                    assert!(
                        (seen - want).abs() < 1e-12 * want,
                        "{fresnel:?}, {widths:?}: {seen}, {want}"
                    );
                    let fast = dispatch!(vectors::level(), simd => {
                        let [x, y, z] = light.to_array().map(|part| f64x8::splat(simd, part));
                        lobe.value(simd, [x, y, z])[1].reduce_max()
                    });
                    assert!(
                        (fast - want).abs() < 1e-12 * want,
                        "{fresnel:?}, {widths:?}: {fast}, {want}"
                    );
                }
            }
        }
    }
}
