//! Rotated sets of coefficients in the bases that splats are kept in.

use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::glam::DQuat;
use lobes::harmonics::{SplatBasis, SplatNumber, SplatRotation};
use lobes::{Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("splat");

const DOMAIN: &str = "degrees 3 and 4 in all four bases, eight quaternions: general, quarter turns about the axes, a third and half a turn, 2·10⁻³";

const METRIC: Metric = Metric::Scaled("the length of the set's coefficients");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "splat/double",
            function: "harmonics::SplatRotation::rotate::<f64>",
            oracle: ORACLE,
            domain: DOMAIN,
            metric: METRIC,
            bound: 1e-15,
            why: "sums of up to nine products with elements of at most 1, which are sums of products themselves",
            loose: None,
            measure: |snapshots, tally| measure(snapshots, tally, |x| x, |x| x),
        },
        Contract {
            id: "splat/single",
            function: "harmonics::SplatRotation::rotate::<f32>",
            oracle: ORACLE,
            domain: DOMAIN,
            metric: METRIC,
            bound: 6e-8,
            why: "the coefficients are rounded to single precision before and after, 6·10⁻⁸ of each",
            loose: None,
            measure: |snapshots, tally| measure(snapshots, tally, |x| x as f32, f64::from),
        },
    ]
}

#[derive(Deserialize)]
struct Rotated {
    basis: String,
    degree: usize,
    /// x, y, z, w.
    quaternion: [f64; 4],
    coefficients: Vec<f64>,
    rotated: Vec<f64>,
}

fn measure<T: SplatNumber>(
    snapshots: &Snapshots,
    tally: &mut Tally,
    into: fn(f64) -> T,
    from: fn(T) -> f64,
) -> Result<()> {
    for case in snapshots.cases::<Rotated>("splat", "rotated")? {
        let basis: SplatBasis = case.basis.parse()?;
        let turn = DQuat::from_array(case.quaternion);
        let mut set: Vec<T> = case.coefficients.iter().map(|x| into(*x)).collect();
        let plan = SplatRotation::new(case.degree, basis)?;
        plan.rotate(&mut set, &[turn], Parallelism::Sequential)?;
        let squares: f64 = case.rotated.iter().map(|x| x * x).sum();
        for (i, (got, want)) in set.iter().zip(&case.rotated).enumerate() {
            tally.compare_scaled(from(*got), *want, squares.sqrt(), || {
                format!("{basis}, degree {}, coefficient {i}, {turn}", case.degree)
            });
        }
    }
    Ok(())
}
