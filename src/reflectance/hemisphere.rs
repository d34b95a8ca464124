//! Integrals over a round lobe, row by row of the light's elevation.
//!
//! In elevations e = π/2 − θ the slope of the half vector is `t² = tan²((e_i − e_v)/2) + 4 s_v s_i
//! sin²(φ/2)/(c_v + c_i)²`, with φ from the plane of incidence: the light fills a rectangle, and
//! over φ the lobe is e^(κ cos φ), of which the trapezoidal rule asks few nodes. For wide lobes
//! this is many times cheaper than the plane of slopes ([`slope`](super::slope)), whose rows the
//! horizon cuts; for narrow ones the slopes are cheaper.

use std::f64::consts::{FRAC_PI_2, PI};

use super::slope::{PANEL_IN_SIGMA, REACH};
use crate::numeric::sixteen_points::RULE;

/// The phase of a polynomial that sixteen nodes carry beside the Gaussian, in radians.
const PHASE: f64 = 12.0;

/// The longest panel, in radians.
const PANEL: f64 = 0.6;

/// The lights of one elevation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    /// Sine and cosine of the light's angle from the normal.
    pub sine: f64,
    pub cosine: f64,
    /// tan²δ in the plane of incidence, …
    tan2: f64,
    /// … and what it grows by, times sin²(φ/2).
    spread: f64,
    /// 1 − i·r in the plane of incidence, r the mirror direction, …
    versine: f64,
    /// … and what it grows by, times sin²(φ/2).
    rise: f64,
    /// The solid angle of a node: both sides of the plane together.
    pub solid_angle: f64,
    /// Nodes of the whole circle.
    count: f64,
    /// sin²(φ/2) past which the lobe has faded out.
    last: f64,
}

/// One light of a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Light {
    /// tan²δ.
    pub tan2: f64,
    /// 1 − i·r, r the mirror direction.
    pub versine: f64,
    /// sin and cos of half the azimuth from the plane of incidence, on the mirror direction's side.
    pub half_azimuth: (f64, f64),
}

impl Row {
    /// Calls `at` for the nodes on one side of the plane of incidence.
    #[inline]
    pub(super) fn visit(&self, mut at: impl FnMut(Light)) {
        let (step_sine, step_cosine) = (PI / self.count).sin_cos();
        let (mut sine, mut cosine) = (0.5 * PI / self.count).sin_cos();
        let nodes = 0.5 * self.count;
        let mut node = 0.5;
        while node < nodes {
            let square = sine * sine;
            if square > self.last {
                return;
            }
            at(Light {
                tan2: self.tan2 + self.spread * square,
                versine: self.versine + self.rise * square,
                half_azimuth: (sine, cosine),
            });
            (sine, cosine) = (
                sine * step_cosine + cosine * step_sine,
                cosine * step_cosine - sine * step_sine,
            );
            node += 1.0;
        }
    }
}

/// Visits rows of lights above the horizon for a view at (sine, cosine) from the normal; with
/// `degree` as for [`slope::visit`](super::slope::visit).
pub(super) fn rows((sine, cosine): (f64, f64), sigma: f64, degree: f64, mut at: impl FnMut(&Row)) {
    let view = cosine.atan2(sine);
    let reach = 2.0 * (REACH * sigma).atan();
    // The half vector turns by half the light's angle.
    let longest = (2.0 * PANEL_IN_SIGMA * sigma)
        .min(PANEL)
        .min(PHASE / degree);
    let low = view - reach;
    let low = if low < 0.25 * longest { 0.0 } else { low };
    let high = (view + reach).min(FRAC_PI_2);
    let mut from = low;
    while from < high {
        // √c_i has a branch at the horizon, which θ = w² undoes; it doubles the degree. 1/(c_v +
        // c_i) has its pole as far below as the view is above.
        let at_horizon = from == 0.0;
        let length = if at_horizon {
            (0.5 * longest).min(2.0 * view)
        } else {
            longest.min(2.0 * from)
        };
        // No sliver at the end.
        let to = if from + 1.25 * length > high {
            high
        } else {
            from + length
        };
        let length = to - from;
        for &(node, weight) in RULE.iter() {
            let (elevation, measure) = if at_horizon {
                (length * node * node, length * 2.0 * node * weight)
            } else {
                (from + length * node, length * weight)
            };
            let (light_cosine, light_sine) = elevation.sin_cos();
            let (rise_sine, rise_cosine) = (0.5 * (elevation - view)).sin_cos();
            let half_z = cosine + light_cosine;
            let tangent = rise_sine / rise_cosine;
            let spread = 4.0 * sine * light_sine / (half_z * half_z);
            // e^(κ cos φ) has the harmonics e^(−κ) I_n(κ), and the polynomials have theirs.
            let kappa = 0.5 * spread / (sigma * sigma);
            let count =
                degree * sine.min(light_sine) + 3.0 * degree.cbrt() + 8.0 * kappa.sqrt() + 14.0;
            let count = 2.0 * (0.5 * count).ceil();
            let left = REACH * REACH - tangent * tangent / (sigma * sigma);
            if left <= 0.0 {
                continue;
            }
            at(&Row {
                sine: light_sine,
                cosine: light_cosine,
                tan2: tangent * tangent,
                spread,
                versine: 2.0 * rise_sine * rise_sine,
                rise: 2.0 * sine * light_sine,
                solid_angle: measure * light_sine * 4.0 * PI / count,
                count,
                last: if kappa > 0.0 { 0.5 * left / kappa } else { 1.0 },
            });
        }
        from = to;
    }
}
