//! The bounds of lobes against complex vectors drawn at random.

use fearless_simd::{dispatch, f64x8, prelude::*};
use glam::DVec3;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::half_vector::HalfVector;
use super::lobe::Lobe;
use super::neighbourhood::Neighbourhood;
use crate::vectors;

impl HalfVector {
    /// The light's height and the parts of H_T for a complex light.
    fn complex_parts(&self, light: [Complex64; 3]) -> [Complex64; 3] {
        let (axes, offsets) = self.axes();
        [0, 1, 2].map(|axis: usize| {
            let [x, y, z] = axes[axis].to_array();
            light[0] * x + light[1] * y + light[2] * z + offsets[axis]
        })
    }

    /// The parts of H_T.
    pub(super) fn complex_tangential(&self, light: [Complex64; 3]) -> [Complex64; 2] {
        let [_, forward, aside] = self.complex_parts(light);
        [forward, aside]
    }

    /// The light's height, H_z and t² for a complex light.
    pub(super) fn complex(&self, light: [Complex64; 3]) -> [Complex64; 3] {
        let [height, forward, aside] = self.complex_parts(light);
        let up = height + self.cosine;
        [height, up, (forward * forward + aside * aside) / (up * up)]
    }
}

/// Draws neighbourhoods about directions in the lobes that `make` gives for an index, a normal and
/// a view, with their width, and complex vectors in them, none of which may pass the bound. Says
/// how many neighbourhoods had a finite bound, and how near a vector came to its own.
pub(super) fn check<L: Lobe + std::fmt::Debug>(
    make: impl Fn(usize, DVec3, DVec3) -> (L, f64),
    complex: impl Fn(&L, [Complex64; 3]) -> f64,
) -> (usize, f64) {
    let mut random = Pcg64::seed_from_u64(5);
    let mut unit = || random.random::<f64>();
    let (mut finite, mut closest) = (0, 0.0f64);
    for index in 0..4000 {
        let mut direction = || {
            let (z, turn) = (2.0 * unit() - 1.0, 6.3 * unit());
            let across = (1.0 - z * z).sqrt();
            DVec3::new(across * turn.cos(), across * turn.sin(), z)
        };
        let (normal, mut view) = (direction(), direction());
        if normal.dot(view) < 0.0 {
            view = -view;
        }
        let (lobe, width) = make(index, normal, view);
        let mirror = 2.0 * normal.dot(view) * normal - view;
        let centre = (mirror + 2.0 * width * direction()).normalize();
        let size = width * (2.0 * unit());
        let [real, growth, shift] = [1.0, 0.2, 0.2].map(|part| part * size * unit());
        let imaginary = size * unit() + 1e-9;
        let [bound, over] = dispatch!(vectors::level(), simd => {
            let splat = |value| f64x8::splat(simd, value);
            let near = Neighbourhood {
                real: splat(real),
                growth: splat(growth),
                shift: splat(shift),
                imaginary: splat(imaginary),
            };
            let centre = [splat(centre.x), splat(centre.y), splat(centre.z)];
            let at = lobe.at(simd, centre);
            [
                lobe.bound(simd, &at, near).reduce_max(),
                lobe.over_height(simd, &at, near).reduce_max(),
            ]
        });
        assert!(!bound.is_nan() && !over.is_nan(), "{lobe:?}");
        if bound.is_infinite() {
            continue;
        }
        finite += 1;
        for _ in 0..50 {
            let mut direction = || {
                let (z, turn) = (2.0 * unit() - 1.0, 6.3 * unit());
                let across = (1.0 - z * z).sqrt();
                DVec3::new(across * turn.cos(), across * turn.sin(), z)
            };
            let (tangent, aside, pushed) = (direction(), direction(), direction());
            // A direction at a chord of at most `real`, and one across it.
            let chord = (real * unit()).min(2.0);
            let along = tangent.reject_from(centre).normalize();
            let square = 0.5 * chord * chord;
            let light = centre * (1.0 - square) + along * (square * (2.0 - square)).max(0.0).sqrt();
            let across = aside.reject_from(light).normalize();
            let x = light * (1.0 + growth * unit()) + pushed * (shift * unit());
            let y = across * (imaginary * unit().sqrt());
            let vector = [0, 1, 2].map(|axis: usize| Complex64::new(x[axis], y[axis]));
            let value = complex(&lobe, vector);
            closest = closest.max(value / bound);
            assert!(
                value <= bound * (1.0 + 1e-11),
                "{lobe:?}: {value:e}, {bound:e}"
            );
            let height: Complex64 = (0..3).map(|axis| vector[axis] * lobe.normal()[axis]).sum();
            assert!(
                value <= over * height.norm() * (1.0 + 1e-11),
                "{lobe:?}: {value:e}, {over:e} times {height}"
            );
        }
    }
    (finite, closest)
}
