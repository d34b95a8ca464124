//! Quadrature rules, values at directions and synthesis against 200-bit sums.

use std::f64::consts::PI;

use lobes::glam::DVec3;
use serde::Deserialize;

use super::generator::noise;
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::harmonics::{Basis, Coefficients, Transform, legendre};
use lobes::sphere::{Grid, Rule};
use lobes::{Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("legendre");
const SCALE: Metric = Metric::Scaled("√((2l+1)/4π)");
const RMS: Metric = Metric::Scaled("the map's rms");
const DIRECTIONS: &str = "17 directions: 8 random of any length, θ = 10⁻², 10⁻⁵, 10⁻⁸ and 0.04 of a pole, the equator and beside it, both poles; m near 0, l/3, l/2 and l";

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "legendre/rule",
            function: "sphere::Rule::gauss_legendre",
            oracle: ORACLE,
            domain: "n = 1 … 4096: nodes, their sines and weights near the poles, inside and at the equator",
            metric: Metric::Mismatch,
            bound: 0.0,
            why: "rounded from double-double, so the double next to the truth",
            loose: None,
            measure: rule,
        },
        Contract {
            id: "legendre/values",
            function: "harmonics::Basis::values",
            oracle: ORACLE,
            domain: DIRECTIONS,
            metric: SCALE,
            bound: 16.0 * f64::EPSILON,
            why: "l ≤ 45: the rounding of 45 steps in double precision",
            loose: None,
            measure: |snapshots, tally| values(snapshots, tally, 0..=45),
        },
        Contract {
            id: "legendre/values-high",
            function: "harmonics::Basis::values",
            oracle: ORACLE,
            domain: DIRECTIONS,
            metric: SCALE,
            bound: 4.0 * f64::EPSILON,
            why: "l = 87 … 2047, by double-double steps: only the last products round",
            loose: None,
            measure: |snapshots, tally| values(snapshots, tally, 46..=2047),
        },
        Contract {
            id: "legendre/column",
            function: "harmonics::legendre::column",
            oracle: ORACLE,
            domain: "l ≤ 200 at the same directions, through Y_l^m = P̄_lm cos mφ or sin mφ",
            metric: SCALE,
            bound: 2e-12,
            why: "the plain recurrence in cos θ, whose error grows as l² at the poles; Basis is the exact one",
            loose: None,
            measure: columns,
        },
        Contract {
            id: "legendre/column-high",
            function: "harmonics::legendre::column",
            oracle: Oracle::Identity("Σ_m (P̄_lm)² = (2l+1)/4π"),
            domain: "l = 2047, every m, at θ = 0.1, 0.3, 0.6, 1 and 1.5, where columns start as far down as 10⁻²⁰⁴⁷",
            metric: Metric::Relative,
            bound: 5e-12,
            why: "the plain recurrence, whose phase rounds at each of 2047 steps, most near the pole",
            loose: None,
            measure: |_, tally| addition_theorem(tally),
        },
        Contract {
            id: "legendre/polynomials",
            function: "harmonics::legendre::polynomials",
            oracle: ORACLE,
            domain: "l ≤ 45 at the same directions, from Y_l^0",
            metric: Metric::Absolute,
            bound: 2e-13,
            why: "at a pole the rounding of x itself tells l(l+1)/2-fold",
            loose: None,
            measure: polynomials,
        },
        Contract {
            id: "legendre/synthesis-63",
            function: "harmonics::Transform::synthesise",
            oracle: ORACLE,
            domain: "degree 63, every ring of a Gauss–Legendre grid, three columns",
            metric: RMS,
            bound: 2e-14,
            why: "ducc0 has 1.5·10⁻¹⁴",
            loose: None,
            measure: |snapshots, tally| synthesis(snapshots, tally, 63),
        },
        Contract {
            id: "legendre/synthesis-255",
            function: "harmonics::Transform::synthesise",
            oracle: ORACLE,
            domain: "degree 255, 60 rings of a Gauss–Legendre grid: those at the poles and the equator, each seventh between",
            metric: RMS,
            bound: 2e-13,
            why: "ducc0 has 1.5·10⁻¹² on the ring at the pole",
            loose: None,
            measure: |snapshots, tally| synthesis(snapshots, tally, 255),
        },
        Contract {
            id: "legendre/synthesis-2047",
            function: "harmonics::Transform::synthesise",
            oracle: ORACLE,
            domain: "degree 2047, 30 rings of a Gauss–Legendre grid from the poles to the equator",
            metric: RMS,
            bound: 5e-13,
            why: "ducc0 has 8·10⁻¹¹ on the ring at the pole",
            loose: None,
            measure: |snapshots, tally| synthesis(snapshots, tally, 2047),
        },
    ]
}

#[derive(Deserialize)]
struct RuleCase {
    nodes: usize,
    shown: Vec<usize>,
    x: Vec<f64>,
    sine: Vec<f64>,
    weight: Vec<f64>,
}

fn rule(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<RuleCase>("legendre", "rule")? {
        let rule = Rule::gauss_legendre(case.nodes)?;
        for (at, &i) in case.shown.iter().enumerate() {
            let where_ = |what: &str| format!("{what} {i} of {}", case.nodes);
            tally.compare(rule.nodes[i], case.x[at], || where_("node"));
            tally.compare(rule.sines[i], case.sine[at], || where_("sine"));
            tally.compare(rule.weights[i], case.weight[at], || where_("weight"));
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct ValueCase {
    l: usize,
    direction: [f64; 3],
    m: Vec<isize>,
    y: Vec<f64>,
}

fn values(
    snapshots: &Snapshots,
    tally: &mut Tally,
    degrees: std::ops::RangeInclusive<usize>,
) -> Result<()> {
    let mut basis = Basis::new(0)?;
    for case in snapshots.cases::<ValueCase>("legendre", "value")? {
        let l = case.l;
        if !degrees.contains(&l) {
            continue;
        }
        if basis.degree() != l {
            basis = Basis::new(l)?;
        }
        let mut out = vec![0.0; basis.count()];
        let direction = DVec3::from_array(case.direction);
        basis.values(&[direction], &mut out, Parallelism::Sequential)?;
        let out = Coefficients::from_vec(l, l, out)?;
        let scale = ((2 * l + 1) as f64 / (4.0 * PI)).sqrt();
        for (&m, want) in case.m.iter().zip(&case.y) {
            tally.compare_scaled(out.get(l, m), *want, scale, || {
                format!("l = {l}, m = {m}, {direction}")
            });
        }
    }
    Ok(())
}

fn columns(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<ValueCase>("legendre", "value")? {
        let l = case.l;
        let [x, y, z] = case.direction;
        let (across, azimuth) = (x.hypot(y), y.atan2(x));
        let length = across.hypot(z);
        let scale = ((2 * l + 1) as f64 / (4.0 * PI)).sqrt();
        for (&m, want) in case.m.iter().zip(&case.y).filter(|_| l <= 200) {
            let order = m.unsigned_abs();
            let mut column = vec![0.0; l + 1 - order];
            legendre::column(order, l, z / length, across / length, &mut column)?;
            let (sine, cosine) = (order as f64 * azimuth).sin_cos();
            let got = column[l - order] * if m < 0 { sine } else { cosine };
            tally.compare_scaled(got, *want, scale, || {
                format!("l = {l}, m = {m}, {:?}", case.direction)
            });
        }
    }
    Ok(())
}

fn addition_theorem(tally: &mut Tally) -> Result<()> {
    const DEGREE: usize = 2047;
    let mut column = vec![0.0; DEGREE + 1];
    for theta in [0.1f64, 0.3, 0.6, 1.0, 1.5] {
        let (sine, cosine) = theta.sin_cos();
        let mut sum = 0.0;
        for m in 0..=DEGREE {
            let column = &mut column[m..];
            legendre::column(m, DEGREE, cosine, sine, column)?;
            sum += column[DEGREE - m].powi(2);
        }
        let want = (2 * DEGREE + 1) as f64 / (4.0 * PI);
        tally.compare(sum, want, || format!("θ = {theta}"));
    }
    Ok(())
}

fn polynomials(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<ValueCase>("legendre", "value")? {
        let l = case.l;
        if l > 45 {
            continue;
        }
        let mut values = vec![0.0; l + 1];
        let direction = DVec3::from_array(case.direction);
        legendre::polynomials(direction.z / direction.length(), &mut values);
        for (_, want) in case.m.iter().zip(&case.y).filter(|(m, _)| **m == 0) {
            let want = want * (4.0 * PI / (2 * l + 1) as f64).sqrt();
            tally.compare(values[l], want, || format!("l = {l}, {direction}"));
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct SynthesisCase {
    degree: usize,
    rings: usize,
    columns: usize,
    seed: u64,
    shown: Vec<usize>,
    shown_columns: Vec<usize>,
    north: Vec<Vec<f64>>,
    south: Vec<Vec<f64>>,
}

fn synthesis(snapshots: &Snapshots, tally: &mut Tally, degree: usize) -> Result<()> {
    for case in snapshots.cases::<SynthesisCase>("legendre", "synthesis")? {
        if case.degree != degree {
            continue;
        }
        let coefficients = noise(degree, case.seed);
        let grid = Grid::gauss_legendre(case.rings, case.columns)?;
        let map = Transform::new(&grid, degree)?.synthesise(&coefficients)?;
        let rms = (coefficients.energy() / (4.0 * PI)).sqrt();
        for (&ring, (north, south)) in case.shown.iter().zip(case.north.iter().zip(&case.south)) {
            for (ring, row) in [(ring, north), (case.rings - 1 - ring, south)] {
                for (&column, want) in case.shown_columns.iter().zip(row) {
                    tally.compare_scaled(map[ring * case.columns + column], *want, rms, || {
                        format!("ring {ring} of {}, column {column}", case.rings)
                    });
                }
            }
        }
    }
    Ok(())
}
