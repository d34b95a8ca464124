//! The operator of one view, against quadrature of the reflection integral in numpy and scipy.

use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::reflection::{Operator, Viewpoint};
use lobes::{Parallelism, Result};

pub(super) fn contracts() -> Vec<Contract> {
    vec![Contract {
        id: "view-operator/specular",
        function: "reflection::Operator::specular",
        oracle: Oracle::Snapshot("view_operator"),
        domain: "single harmonics to degree 256, every lobe, rough and narrow, orthographic and near cameras",
        metric: Metric::Absolute,
        bound: 5e-11,
        why: "the quadrature that it is held against is good to 2·10⁻¹¹ by its own estimate",
        loose: None,
        measure: specular,
    }]
}

#[derive(Deserialize)]
struct OperatorCase {
    variant: String,
    sigma: f64,
    theta: f64,
    /// 0 for an orthographic camera.
    distance: f64,
    harmonics: Vec<(usize, usize)>,
    values: Vec<f64>,
}

fn specular(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<OperatorCase>("view_operator", "specular")? {
        let viewpoint = if case.distance == 0.0 {
            Viewpoint::Orthographic
        } else {
            Viewpoint::Perspective {
                distance: case.distance,
            }
        };
        let operator = Operator::new(
            case.variant.parse()?,
            case.sigma,
            viewpoint,
            &[case.theta],
            256,
            Parallelism::Rayon,
        )?;
        for (&(l, m), want) in case.harmonics.iter().zip(&case.values) {
            tally.compare(operator.specular(l, m)[0], *want, || {
                let OperatorCase {
                    variant,
                    sigma,
                    theta,
                    ..
                } = &case;
                format!("{variant}, σ = {sigma}, θ = {theta}, l = {l}, m = {m}")
            });
        }
    }
    Ok(())
}
