//! The Legendre recurrence in single precision, from that in double.

use fearless_simd::Level;

use super::kernel;
use super::lane::Lane;
use super::recurrence::{Entry, LANES, Lanes, Recurrence, STRIDE, Scale, bundles, negligible};
use super::simd::wide;
use crate::sphere::Grid;

/// Values of single precision begin no lower, so that no step of the recurrence falls below the
/// least normal number, 1.2·10⁻³⁸.
const LEAST: f64 = 1e-34;

/// After so many steps the recurrence in single precision takes the state of double precision
/// again, a multiple of [`STRIDE`].
const RENEWED: usize = 128;

impl Recurrence<f32> {
    /// The tables in single precision from those in double.
    ///
    /// The state of the recurrence is not left to single precision alone, whose rounding turns the
    /// phase of p_k by more and more: every [`RENEWED`] steps it is taken anew from double precision.
    /// Without that synthesis is off by 2.7·10⁻⁶ of the rms at degree 2047 instead of 1.7·10⁻⁶.
    pub(crate) fn rounded(exact: &Recurrence, grid: &Grid, degree: usize, level: Level) -> Self {
        let (bundles, _, blocks) = bundles::<f32>(grid, level);
        let mut recurrence = Self {
            bundles,
            blocks,
            steps: exact.steps.iter().map(|step| step.map(f32::of)).collect(),
            scales: exact.scales.clone(),
            starts: exact.starts.clone(),
            entries: Vec::new(),
            entry_starts: vec![0],
        };
        let negligible = negligible::<f32>(degree);
        let mut states = [Vec::new(), Vec::new()];
        for m in 0..exact.starts.len() - 1 {
            for (bundle, own) in recurrence.bundles.iter().enumerate() {
                for (half, states) in states.iter_mut().enumerate() {
                    let at = 2 * bundle + half;
                    states.clear();
                    if at < exact.bundles.len() {
                        wide!(level, simd => kernel::states(simd, exact, m, at, STRIDE, states));
                    }
                }
                let of_halves = [0, 1].map(|half| {
                    let same = exact
                        .bundles
                        .get(2 * bundle + half)
                        .map(|b| b.is_polar() == own.is_polar());
                    (&*states[half], same.unwrap_or(true))
                });
                enter_rounded(
                    of_halves,
                    exact.scales(m),
                    negligible,
                    &mut recurrence.entries,
                );
                recurrence
                    .entry_starts
                    .push(recurrence.entries.len() as u32);
            }
        }
        recurrence
    }
}

/// The entries of a bundle in single precision from the states of its two halves, p and d every
/// [`STRIDE`] steps, and whether those are of the bundle's form.
fn enter_rounded(
    halves: [(&[[Lanes; 2]], bool); 2],
    scales: &[Scale],
    negligible: f64,
    entries: &mut Vec<Entry<f32>>,
) {
    let count = halves[0].0.len();
    let state = |k: usize, lane: usize| {
        let (states, same) = halves[lane / LANES];
        let [p, d] = states
            .get(k)
            .map_or([0.0; 2], |state| state.map(|v| v[lane % LANES]));
        // p_k + p_{k−1} from p_k − p_{k−1}, or the other way.
        [p, if same { d } else { 2.0 * p - d }]
    };
    let matters = |k: usize| {
        let alpha = scales[(k * STRIDE).min(scales.len() - 1)][0];
        (0..f32::LANES).any(|lane| state(k, lane)[0].abs() * alpha >= negligible)
    };
    let Some(first) = (0..count).find(|&k| matters(k)) else {
        return;
    };
    let mut inside = [false; f32::LANES];
    for k in first.saturating_sub(1)..count {
        let mut any = (k * STRIDE).is_multiple_of(RENEWED);
        for (lane, inside) in inside.iter_mut().enumerate() {
            if !*inside && state(k, lane)[0].abs() >= LEAST {
                *inside = true;
                any = true;
            }
        }
        if any {
            let of = |part: usize| {
                f32::lanes(|lane| {
                    if inside[lane] {
                        f32::of(state(k, lane)[part])
                    } else {
                        0.0
                    }
                })
            };
            entries.push(Entry {
                step: k * STRIDE,
                p: of(0),
                d: of(1),
            });
        }
    }
}
