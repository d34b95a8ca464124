//! Quadrature rules on [−1, 1].

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

use std::f64::consts::PI;

use crate::numeric::double_double::DoubleDouble;
use crate::{Error, Result};

/// The largest number of nodes of a [`Rule`].
pub const MAX_NODES: usize = 16384;

/// A quadrature rule on [−1, 1]: ∫ f(x) dx ≈ Σ wᵢ f(xᵢ), nodes from +1 down to −1.
///
/// In x = cos θ the nodes go from the north pole to the south pole, and ∫ f dx = ∫ f sin θ dθ.
///
/// ```
/// use lobes::sphere::Rule;
/// let rule = Rule::gauss_legendre(3)?;
/// let terms = rule.nodes.iter().zip(&rule.weights).map(|(x, weight)| weight * x.powi(4));
/// assert!((terms.sum::<f64>() - 2.0 / 5.0).abs() < 1e-15);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// The nodes xᵢ, descending.
    pub nodes: Vec<f64>,
    /// √(1 − xᵢ²), to full relative precision near the poles too.
    pub sines: Vec<f64>,
    /// The weights wᵢ; they sum to 2.
    pub weights: Vec<f64>,
}

fn check_nodes(n: usize) -> Result<()> {
    if (1..=MAX_NODES).contains(&n) {
        Ok(())
    } else {
        Err(Error::Domain {
            what: "the number of quadrature nodes",
            value: n as f64,
            allowed: "in 1 ..= 16384",
        })
    }
}

impl Rule {
    /// The Gauss–Legendre rule of `n` nodes, exact for polynomials of degree 2n − 1.
    ///
    /// Newton's method on P_n from Tricomi's guess, the last step in double-double arithmetic, so
    /// that nodes, sines and weights are correct to 2 ε relative. Costs O(n²).
    ///
    /// # Errors
    /// [`Error::Domain`] unless 1 ≤ n ≤ [`MAX_NODES`].
    ///
    /// ```
    /// let rule = lobes::sphere::Rule::gauss_legendre(2)?;
    /// assert_eq!(rule.nodes[0], (1.0f64 / 3.0).sqrt());
    /// assert_eq!(rule.weights, [1.0, 1.0]);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn gauss_legendre(n: usize) -> Result<Self> {
        check_nodes(n)?;
        let mut rule = Self {
            nodes: vec![0.0; n],
            sines: vec![1.0; n],
            weights: vec![0.0; n],
        };
        // (2k + 1)/(k + 1) in the recurrence P_{k+1} = P_k + [k (P_k − P_{k−1}) − (2k+1)(1−x)
        // P_k]/(k+1).
        let ratios: Vec<DoubleDouble> = (0..n)
            .map(|k| {
                DoubleDouble::from((2 * k + 1) as f64).divide(DoubleDouble::from((k + 1) as f64))
            })
            .collect();
        for i in 0..n.div_ceil(2) {
            let (x, s, w) = gauss_legendre_node(n, i, &ratios);
            rule.nodes[i] = x;
            rule.nodes[n - 1 - i] = -x;
            rule.sines[i] = s;
            rule.sines[n - 1 - i] = s;
            rule.weights[i] = w;
            rule.weights[n - 1 - i] = w;
        }
        if n % 2 == 1 {
            rule.nodes[n / 2] = 0.0;
        }
        Ok(rule)
    }

    /// Fejér's first rule: θᵢ = π (i + ½)/n, the pixel centres of a lat-long map; exact for
    /// polynomials of degree n − 1.
    ///
    /// # Errors
    /// [`Error::Domain`] unless 1 ≤ n ≤ [`MAX_NODES`].
    pub fn fejer(n: usize) -> Result<Self> {
        check_nodes(n)?;
        Ok(Self::equiangular(n, n, 1))
    }

    /// The Clenshaw–Curtis rule: θᵢ = π i/(n − 1), both poles included; exact for polynomials of
    /// degree n − 1.
    ///
    /// # Errors
    /// [`Error::Domain`] unless 2 ≤ n ≤ [`MAX_NODES`].
    pub fn clenshaw_curtis(n: usize) -> Result<Self> {
        check_nodes(n)?;
        if n < 2 {
            return Err(Error::Domain {
                what: "the number of Clenshaw–Curtis nodes",
                value: n as f64,
                allowed: "in 2 ..= 16384",
            });
        }
        Ok(Self::equiangular(n, n - 1, 0))
    }

    /// The interpolatory rule at θᵢ = π (2i + shift)/(2 intervals), from the cosine series of f(cos
    /// θ): ∫ cos(2jθ) sin θ dθ = −2/(4j² − 1).
    fn equiangular(n: usize, intervals: usize, shift: usize) -> Self {
        let period = 4 * intervals; // in units of π/(2 · intervals)
        let cosines: Vec<f64> = (0..period).map(|k| cos_turn(k, period)).collect();
        let last = intervals / 2;
        let mut rule = Self {
            nodes: Vec::with_capacity(n),
            sines: Vec::with_capacity(n),
            weights: Vec::with_capacity(n),
        };
        for i in 0..n {
            let k = 2 * i + shift;
            rule.nodes.push(cosines[k % period]);
            rule.sines
                .push(cosines[(k + period - intervals) % period].abs());
            let mut sum = 0.0;
            for j in (1..=last).rev() {
                // With the poles among the nodes the highest cosine is its own alias and counts
                // half.
                let half = if shift == 0 && 2 * j == intervals {
                    0.5
                } else {
                    1.0
                };
                sum += half * cosines[(2 * j * k) % period] / (4 * j * j - 1) as f64;
            }
            let end = shift == 0 && (i == 0 || i == n - 1);
            let share = if end { 1.0 } else { 2.0 } / intervals as f64;
            rule.weights.push(share * (1.0 - 2.0 * sum));
        }
        rule
    }

    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Never true: a rule has at least one node.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
}

/// cos(2π k/period), to full relative precision about its zeros.
pub(crate) fn cos_turn(k: usize, period: usize) -> f64 {
    let k = k % period;
    let k = k.min(period - k); // now within half a turn
    if 8 * k > 3 * period {
        -(PI * (period - 2 * k) as f64 / period as f64).cos()
    } else if 8 * k > period {
        (PI * (period as f64 - (4 * k) as f64) / (2 * period) as f64).sin()
    } else {
        (PI * (2 * k) as f64 / period as f64).cos()
    }
}

/// Node i of n from the north pole: cos θ, sin θ and the weight, each rounded from double-double.
fn gauss_legendre_node(n: usize, i: usize, ratios: &[DoubleDouble]) -> (f64, f64, f64) {
    let nf = n as f64;
    let phase = PI * (4 * i + 3) as f64 / (4 * n + 2) as f64;
    // Tricomi's guess in θ, then Newton in double precision, in θ: near the poles x has no room.
    let mut theta = phase + (1.0 / (8.0 * nf * nf) - 1.0 / (8.0 * nf * nf * nf)) / phase.tan();
    for _ in 0..6 {
        let y = 2.0 * (0.5 * theta).sin().powi(2);
        let (mut p, mut d) = (1.0f64, 0.0f64);
        for k in 0..n {
            let kf = k as f64;
            d = (kf * d - (2.0 * kf + 1.0) * y * p) / (kf + 1.0);
            p += d;
        }
        // dP_n/dθ = −n (P_{n−1} − x P_n)/sin θ, with P_{n−1} − x P_n = y P_n − d.
        let derivative = -nf * (y * p - d) / theta.sin();
        let step = p / derivative;
        theta -= step;
        if step.abs() < 1e-12 * theta {
            break;
        }
    }
    // One step more in double-double, in y = 1 − x.
    let half = (0.5 * theta).sin();
    let y = DoubleDouble::product(half, half).scale(2.0);
    let (mut p, mut d) = (DoubleDouble::ONE, DoubleDouble::ZERO);
    for (k, &ratio) in ratios.iter().enumerate() {
        let shrink = if k == 0 {
            DoubleDouble::ZERO
        } else {
            // k/(k+1) = ratio − 1
            ratio - DoubleDouble::ONE
        };
        d = shrink * d - ratio * (y * p);
        p = p + d;
    }
    let x = DoubleDouble::ONE - y;
    let s2 = y.scale(2.0) - y * y;
    // (1 − x²) P_n′ = n (P_{n−1} − x P_n)
    let slope = (y * p - d).scale(nf); // = (1 − x²) P_n′
    let dx = -(p * s2).divide(slope); // Newton's correction
    // d/dx [(1 − x²) P_n′] = −n(n+1) P_n, so the slope at the corrected node differs in second
    // order only.
    let slope = slope - (p * dx).scale(nf * (nf + 1.0)).scale(0.5);
    let node = x + dx;
    let s2 = s2 - (x + node) * dx;
    // w = 2/((1 − x²) P_n′²) = 2 (1 − x²)/slope²
    let weight = s2.scale(2.0).divide(slope * slope);
    (node.to_f64(), s2.sqrt().to_f64(), weight.to_f64())
}
