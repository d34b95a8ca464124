//! Legendre polynomials and normalised associated Legendre functions at one colatitude.

use std::f64::consts::PI;

use crate::error::check_length;
use crate::{Error, Result};

/// The largest degree of a [`column()`].
pub const MAX_COLUMN_DEGREE: usize = 1 << 20;

/// P_l(x) for l = 0 … `out.len()` − 1, by Bonnet's recurrence in its difference form, which keeps
/// its digits near x = 1 too: (l+1)(P_{l+1} − P_l) = l (P_l − P_{l−1}) − (2l+1)(1−x) P_l.
///
/// |x| ≤ 1 is assumed; beyond it the polynomials grow as they must.
///
/// ```
/// let mut p = [0.0; 3];
/// lobes::harmonics::legendre::polynomials(0.5, &mut p);
/// assert_eq!(p, [1.0, 0.5, -0.125]);
/// ```
pub fn polynomials(x: f64, out: &mut [f64]) {
    // P_l(−x) = (−1)^l P_l(x)
    let y = 1.0 - x.abs();
    let (mut p, mut d) = (1.0, 0.0);
    for (l, value) in out.iter_mut().enumerate() {
        let lf = l as f64;
        *value = if x < 0.0 && l % 2 == 1 { -p } else { p };
        d = (lf * d - (2.0 * lf + 1.0) * y * p) / (lf + 1.0);
        p += d;
    }
}

/// a_l = √((4l² − 1)/(l² − m²)), by which P̄_lm = a_l (cos θ P̄_(l−1)m − P̄_(l−2)m / a_(l−1)).
pub(crate) fn step(l: usize, m: usize) -> f64 {
    let l2 = (l * l) as f64;
    ((4.0 * l2 - 1.0) / (l2 - (m * m) as f64)).sqrt()
}

/// P̄_lm(cos θ) for l = m … `degree`, the factor of [Y_l^m](super) that depends on θ: √2 included
/// for m > 0.
///
/// `out` has `degree + 1 − m` values. Takes (cos θ, sin θ) and not cos θ alone, because √(1 −
/// cos²θ) loses the poles. Values below the smallest double come out as 0; nothing overflows.
///
/// # Errors
/// [`Error::Degree`] beyond [`MAX_COLUMN_DEGREE`]; [`Error::Length`] unless `out` has `degree + 1 −
/// m` values; `m > degree` asks for none.
///
/// ```
/// use lobes::harmonics::legendre;
/// let mut column = [0.0; 2];
/// legendre::column(1, 2, 0.6, 0.8, &mut column)?; // P̄_11 = √(3/4π) sin θ
/// assert!((column[0] - (0.75 / std::f64::consts::PI).sqrt() * 0.8).abs() < 1e-16);
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn column(m: usize, degree: usize, cos: f64, sin: f64, out: &mut [f64]) -> Result<()> {
    if degree > MAX_COLUMN_DEGREE {
        return Err(Error::Degree {
            what: "a column of Legendre functions",
            degree,
            limit: MAX_COLUMN_DEGREE,
        });
    }
    check_length(
        "the Legendre column",
        (degree + 1).saturating_sub(m),
        out.len(),
    )?;
    if out.is_empty() {
        return Ok(());
    }
    const BIG: f64 = 1.157_920_892_373_162e77; // 2^256
    const SMALL: f64 = 1.0 / BIG;
    // The true value is p · 2^(−512 steps).
    let mut steps = 0u32;
    let mut p = (1.0 / (4.0 * PI)).sqrt();
    for k in 1..=m {
        let factor = if k == 1 {
            3f64.sqrt() // √2 of the real basis included
        } else {
            ((2 * k + 1) as f64 / (2 * k) as f64).sqrt()
        };
        p *= factor * sin;
        if p.abs() < SMALL {
            p *= BIG * BIG;
            steps += 1;
            if p == 0.0 {
                out.fill(0.0);
                return Ok(());
            }
        }
    }
    let (mut before, mut previous_a) = (0.0, 1.0);
    for (l, value) in (m..=degree).zip(out.iter_mut()) {
        *value = match steps {
            0 => p,
            1 => p * SMALL * SMALL,
            _ => 0.0,
        };
        let a = step(l + 1, m);
        let next = a * (cos * p - before / previous_a);
        before = p;
        p = next;
        previous_a = a;
        if steps > 0 && p.abs() > BIG {
            p *= SMALL * SMALL;
            before *= SMALL * SMALL;
            steps -= 1;
        }
    }
    Ok(())
}
