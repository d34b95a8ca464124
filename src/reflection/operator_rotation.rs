//! Turning cosine-type harmonics about the y axis, for many angles at once.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Where column m starts among columns that hold l = m … degree each.
pub(super) fn column_start(degree: usize, m: usize) -> usize {
    m * (2 * degree + 3 - m) / 2
}

/// The square roots that the recurrence of Wigner's d needs, shared by every angle.
pub(super) struct Rotation {
    degree: usize,
    /// √(l² − m²) at `column_start(m) + l − m`.
    roots: Vec<f64>,
    /// ½ ln k!, k ≤ 2·degree.
    half_log_factorial: Vec<f64>,
}

impl Rotation {
    pub(super) fn new(degree: usize) -> Self {
        let mut roots = Vec::with_capacity(column_start(degree + 1, degree + 2));
        for m in 0..=degree {
            for l in m..=degree + 1 {
                roots.push((((l - m) * (l + m)) as f64).sqrt());
            }
        }
        let mut half_log_factorial = vec![0.0; 2 * degree + 1];
        for k in 1..=2 * degree {
            half_log_factorial[k] = half_log_factorial[k - 1] + 0.5 * (k as f64).ln();
        }
        Self {
            degree,
            roots,
            half_log_factorial,
        }
    }

    /// Turns `Σ f_lm √2 P̄_lm cos mφ` by the angle `θ_r` about +y (from +z towards +x), one `θ_r`
    /// and one set of coefficients a ring. `source` and the result hold ring r of (l, m) at
    /// `(column_start(m) + l − m)·rings + r`.
    ///
    /// With `p_l = (−1)^(m+k) d^l_{m,k}(θ)` and `q_l = (−1)^m d^l_{m,−k}(θ)·(−1)^k`, the matrix
    /// between the cosine harmonics is `M_mk = p + (−1)^k q` for m ≥ k > 0 (times 1/√2 where k = 0
    /// < m, and 1/2 at k = m = 0), and `M_km = (−1)^(m+k) M_mk`. Both follow the three-term
    /// recurrence of d in l at fixed orders from their closed forms at l = m (Edmonds, *Angular
    /// Momentum*, ch. 4), which is stable upwards.
    pub(super) fn turn(&self, angles: &[f64], source: &[f64]) -> Vec<f64> {
        let rings = angles.len();
        let degree = self.degree;
        let mut target = vec![0.0; source.len()];
        let cosines: Vec<f64> = angles.iter().map(|angle| angle.cos()).collect();
        let half_logs: Vec<(f64, f64)> = angles
            .iter()
            .map(|angle| ((0.5 * angle).cos().ln(), (0.5 * angle).sin().ln()))
            .collect();
        let mut p = vec![[0.0; 2]; rings];
        let mut q = vec![[0.0; 2]; rings];
        for m in 0..=degree {
            let m_roots = self.column(m);
            let m_start = column_start(degree, m);
            for k in 0..=m {
                let k_roots = &self.column(k)[m - k..];
                let k_start = column_start(degree, k) + m - k;
                self.start(m, k, &half_logs, &mut p, &mut q);
                let scale = match (m, k) {
                    (0, 0) => 0.5,
                    (_, 0) => FRAC_1_SQRT_2,
                    _ => 1.0,
                };
                let q_scale = if k % 2 == 0 { scale } else { -scale };
                let transposed = if (m + k) % 2 == 0 { 1.0 } else { -1.0 };
                for l in m..=degree {
                    let at = l - m;
                    let m_range = (m_start + at) * rings..(m_start + at + 1) * rings;
                    let k_range = (k_start + at) * rings..(k_start + at + 1) * rings;
                    // d_(l+1) = α (x ∓ β) d_l − γ d_(l−1).
                    let next = m_roots[at + 1] * k_roots[at + 1];
                    let alpha = ((2 * l + 1) * (l + 1)) as f64 / next;
                    let (beta, gamma) = if l == 0 {
                        (0.0, 0.0)
                    } else {
                        (
                            (m * k) as f64 / (l * (l + 1)) as f64,
                            (l + 1) as f64 / l as f64 * m_roots[at] * k_roots[at] / next,
                        )
                    };
                    if m == k {
                        let source = &source[m_range.clone()];
                        let target = &mut target[m_range];
                        for r in 0..rings {
                            let element = scale * p[r][0] + q_scale * q[r][0];
                            target[r] += element * source[r];
                            advance(&mut p[r], alpha, cosines[r] - beta, gamma);
                            advance(&mut q[r], alpha, cosines[r] + beta, gamma);
                        }
                    } else {
                        let (from_m, from_k) = (&source[m_range.clone()], &source[k_range.clone()]);
                        let (low, high) = target.split_at_mut(m_range.start);
                        let (to_k, to_m) = (&mut low[k_range], &mut high[..rings]);
                        for r in 0..rings {
                            let element = scale * p[r][0] + q_scale * q[r][0];
                            to_m[r] += element * from_k[r];
                            to_k[r] += transposed * element * from_m[r];
                            advance(&mut p[r], alpha, cosines[r] - beta, gamma);
                            advance(&mut q[r], alpha, cosines[r] + beta, gamma);
                        }
                    }
                }
            }
        }
        target
    }

    /// √(l² − m²) for l = m … degree + 1.
    fn column(&self, m: usize) -> &[f64] {
        &self.roots[column_start(self.degree + 1, m)..column_start(self.degree + 1, m + 1)]
    }

    /// p and q at l = m: √C(2m, m+k) cos^(m±k)(θ/2) sin^(m∓k)(θ/2).
    fn start(
        &self,
        m: usize,
        k: usize,
        half_logs: &[(f64, f64)],
        p: &mut [[f64; 2]],
        q: &mut [[f64; 2]],
    ) {
        let log = &self.half_log_factorial;
        let binomial = log[2 * m] - log[m + k] - log[m - k];
        let (plus, minus) = ((m + k) as f64, (m - k) as f64);
        for (r, &(cosine, sine)) in half_logs.iter().enumerate() {
            // 0·ln 0 is 0 here: at θ = 0 the power is 1.
            let power =
                |exponent: f64, log: f64| if exponent == 0.0 { 0.0 } else { exponent * log };
            // What starts this small stays negligible up to the largest degree; zeros are faster
            // than subnormals.
            let value = |log: f64| if log < -600.0 { 0.0 } else { log.exp() };
            p[r] = [
                value(binomial + power(plus, cosine) + power(minus, sine)),
                0.0,
            ];
            q[r] = [
                value(binomial + power(minus, cosine) + power(plus, sine)),
                0.0,
            ];
        }
    }
}

fn advance(value: &mut [f64; 2], alpha: f64, x: f64, gamma: f64) {
    let next = alpha * x * value[0] - gamma * value[1];
    *value = [next, value[0]];
}

/// `√2 P̄_lm(cos θ_r)` (`P̄_l0` for m = 0), stored as [`Rotation::turn`] stores.
pub(super) fn cosine_harmonics(degree: usize, angles: &[f64]) -> Vec<f64> {
    let rings = angles.len();
    let mut values = vec![0.0; column_start(degree, degree + 1) * rings];
    for (r, angle) in angles.iter().enumerate() {
        let (sine, cosine) = angle.sin_cos();
        let mut sectoral = (4.0 * PI).sqrt().recip();
        for m in 0..=degree {
            if m > 0 {
                let doubled = if m == 1 { 2.0 } else { 1.0 };
                sectoral *= (doubled * (2 * m + 1) as f64 / (2 * m) as f64).sqrt() * sine;
            }
            let start = column_start(degree, m);
            let (mut now, mut before) = (sectoral, 0.0);
            for l in m..=degree {
                values[(start + l - m) * rings + r] = now;
                let next = (((l + 1) * (l + 1) - m * m) as f64).sqrt();
                let root = |l: usize| ((2 * l + 1) as f64).sqrt();
                let below = if l > m {
                    ((l * l - m * m) as f64).sqrt() / root(l - 1) * before
                } else {
                    0.0
                };
                let after = root(l + 1) / next * (root(l) * cosine * now - below);
                before = now;
                now = after;
            }
        }
    }
    values
}
