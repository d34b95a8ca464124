//! What single precision costs a transform: the error of sums of Legendre functions where the
//! recurrence and the sums run in f32, and where only the sums do.
//!
//! ```text
//! cargo run --release -p lobes-experiments --example single_precision
//! ```
//!
//! The recurrence is that of the transform in its two forms that lose least (`harmonics::recurrence`
//! in the library), entered with the values of f64 where a harmonic begins to matter, and its
//! constants are those of f64 rounded once. Sums of Legendre functions over l − m even, with weights of a normal
//! distribution (Pcg64, seed 1), eight orders and 32 Gauss–Legendre rings; errors are against f64, as
//! parts of the root mean square of all sums.

use lobes::Result;
use lobes::sphere::Grid;
use rand::RngExt;
use rand_pcg::Pcg64;

/// The arithmetic of one run.
trait Real: Copy {
    fn of(value: f64) -> Self;
    fn times_plus(self, factor: Self, term: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    fn value(self) -> f64;
}

macro_rules! real {
    ($type:ty) => {
        impl Real for $type {
            fn of(value: f64) -> Self {
                value as Self
            }
            fn times_plus(self, factor: Self, term: Self) -> Self {
                self.mul_add(factor, term)
            }
            fn minus(self, other: Self) -> Self {
                self - other
            }
            fn value(self) -> f64 {
                f64::from(self)
            }
        }
    };
}

real!(f32);
real!(f64);

/// Of each step, l = m + 2k: a, the constants of the polar and of the equatorial form, and α.
fn constants(m: usize, degree: usize) -> Vec<[f64; 4]> {
    let epsilon = |l: usize| {
        let (l, m) = (l as f64, m as f64);
        (l * l - m * m) / (4.0 * l * l - 1.0)
    };
    let count = (degree - m) / 2 + 1;
    let product = |k: usize| (epsilon(m + 2 * k) * epsilon(m + 2 * k - 1)).sqrt();
    let mut alpha = vec![0.0; count];
    alpha[count - 1] = (0.25 / (product(count) * product(count + 1)).sqrt()).sqrt();
    for k in (1..count).rev() {
        alpha[k - 1] = 0.25 / (alpha[k] * product(k));
    }
    let constant = |(k, alpha): (usize, &f64)| {
        let a = 4.0 * alpha * alpha;
        let e = epsilon(m + 2 * k) + epsilon(m + 2 * k + 1);
        [a, a * (1.0 - e) - 2.0, 2.0 - a * e, *alpha]
    };
    alpha.iter().enumerate().map(constant).collect()
}

/// The weighted sum of p from step `first` on, from the state there; the recurrence in `R`, the sum in
/// `T`.
fn sum<R: Real, T: Real>(
    constants: &[[f64; 4]],
    weights: &[f64],
    (polar, argument): (bool, f64),
    (first, state): (usize, [f64; 2]),
) -> f64 {
    let argument = R::of(argument);
    let [mut p, mut d] = state.map(R::of);
    let mut total = T::of(0.0);
    for (&[a, near_pole, near_equator, _], &weight) in constants.iter().zip(weights).skip(first) {
        total = T::of(p.value()).times_plus(T::of(weight), total);
        let u = argument.times_plus(
            R::of(a),
            R::of(if polar { near_pole } else { near_equator }),
        );
        if polar {
            d = u.times_plus(p, d);
            p = p.times_plus(R::of(1.0), d);
        } else {
            d = u.times_plus(p, R::of(0.0).minus(d));
            p = d.minus(p);
        }
    }
    total.value()
}

/// Where the harmonic first passes 10⁻¹², and p and d there, in f64 with an exponent of its own.
fn enter(
    constants: &[[f64; 4]],
    m: usize,
    (sine, polar, argument): (f64, bool, f64),
) -> Option<(usize, [f64; 2])> {
    let half_log: f64 = (1..=m).map(|i| (1.0 + 0.5 / i as f64).ln()).sum();
    // ln P̄_mm, of the real harmonics.
    let start =
        0.5 * (half_log - (4.0 * std::f64::consts::PI).ln() + 2f64.ln()) + m as f64 * sine.ln();
    let mut logarithm = start - constants[0][3].ln();
    let (mut p, mut d) = (1.0, 1.0);
    for (k, &[a, near_pole, near_equator, alpha]) in constants.iter().enumerate() {
        if (p * alpha).abs().ln() + logarithm > -27.6 {
            let scale = logarithm.exp();
            return Some((k, [p * scale, d * scale]));
        }
        let u = argument * a + if polar { near_pole } else { near_equator };
        if polar {
            d += u * p;
            p += d;
        } else {
            d = u * p - d;
            p = d - p;
        }
        if p.abs() > 1e100 {
            (p, d, logarithm) = (p * 1e-100, d * 1e-100, logarithm + 100.0 * 10f64.ln());
        }
    }
    None
}

fn main() -> Result<()> {
    println!("| degree | recurrence and sums in f32 | sums in f32 |");
    println!("| --- | ---: | ---: |");
    for degree in [63, 127, 255, 511, 1023, 2047, 4095] {
        let grid = Grid::gauss_legendre(degree + 1, 2 * degree + 2)?;
        let mut random = Pcg64::new(1, 0);
        let (mut square, mut errors, mut count) = (0.0, [0.0; 2], 0.0);
        for order in 0..8 {
            let m = order * (degree + 1) / 8;
            let constants = constants(m, degree);
            let weights: Vec<f64> = constants
                .iter()
                .map(|[.., alpha]| {
                    let normal = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
                    alpha * normal
                })
                .collect();
            for ring in 0..32 {
                let ring = ring * (degree + 1) / 64;
                let (cosine, sine) = (grid.cosines()[ring], grid.sines()[ring]);
                let polar = cosine > sine;
                let argument = if polar { -sine * sine } else { cosine * cosine };
                let Some(state) = enter(&constants, m, (sine, polar, argument)) else {
                    continue;
                };
                let form = (polar, argument);
                let exact = sum::<f64, f64>(&constants, &weights, form, state);
                let all = sum::<f32, f32>(&constants, &weights, form, state);
                let sums = sum::<f64, f32>(&constants, &weights, form, state);
                square += exact * exact;
                count += 1.0;
                for (error, value) in errors.iter_mut().zip([all, sums]) {
                    *error += (value - exact).powi(2);
                }
            }
        }
        let [all, sums] = errors.map(|error: f64| (error / square).sqrt());
        assert!(count > 0.0);
        println!("| {degree} | {all:.1e} | {sums:.1e} |");
    }
    Ok(())
}
