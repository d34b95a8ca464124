//! Rotations as angles, in double-double.

use glam::DQuat;

use crate::numeric::double_double::DoubleDouble;

/// (cos, sin) of the angles of R = Z(α) Y(β) Z(γ).
pub(super) struct Euler {
    pub(super) alpha: [DoubleDouble; 2],
    pub(super) beta: [DoubleDouble; 2],
    pub(super) gamma: [DoubleDouble; 2],
    /// Of β/2, neither below 0.
    pub(super) half_beta: [DoubleDouble; 2],
}

impl Euler {
    /// Of a quaternion of any length but 0.
    pub(super) fn of(q: DQuat) -> Self {
        // A power of two brings the largest component near 1.
        let size = q.w.abs().max(q.x.abs()).max(q.y.abs()).max(q.z.abs());
        let exponent =
            f64::from_bits((size.to_bits() & 0x7FF0_0000_0000_0000).clamp(1 << 52, 0x7FD << 52));
        let [w, x, y, z] = [q.w, q.x, q.y, q.z].map(|v| v / exponent);
        let square = |a: f64, b: f64| DoubleDouble::product(a, a) + DoubleDouble::product(b, b);
        // w + iz = cos(β/2) e^(i(α+γ)/2), y − ix = sin(β/2) e^(i(α−γ)/2)
        let (a2, b2) = (square(w, z), square(x, y));
        let unit = |re: f64, im: f64, square: DoubleDouble| {
            let length = square.sqrt();
            if length.hi > 0.0 {
                [
                    DoubleDouble::from(re).divide(length),
                    DoubleDouble::from(im).divide(length),
                ]
            } else {
                [DoubleDouble::ONE, DoubleDouble::ZERO]
            }
        };
        let (a, b) = (unit(w, z, a2), unit(y, -x, b2));
        let sum = a2 + b2;
        Self {
            alpha: times(a, b),
            beta: [
                (a2 - b2).divide(sum),
                (a2.sqrt() * b2.sqrt()).scale(2.0).divide(sum),
            ],
            gamma: times(a, [b[0], -b[1]]),
            half_beta: [a2.divide(sum).sqrt(), b2.divide(sum).sqrt()],
        }
    }
}

/// The product of two complex numbers.
pub(super) fn times(a: [DoubleDouble; 2], b: [DoubleDouble; 2]) -> [DoubleDouble; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}
