//! Operators of one view for many roughnesses: kept once made, or interpolated.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

use super::operator::{Operator, Viewpoint};
use crate::error::{Error, Result};
use crate::parallelism::Parallelism;
use crate::reflectance::Variant;

/// The operators of one view that differ in σ only, each made when it is first asked for and kept.
///
/// They share their diffuse part.
///
/// ```
/// use std::sync::Arc;
/// use lobes::{Parallelism, reflectance::Variant, reflection::{OperatorSet, Viewpoint}};
/// let set = OperatorSet::new(Variant::Duer, Viewpoint::Orthographic, &[0.2, 0.9], 8)?;
/// let first = set.at(0.1, Parallelism::Sequential)?;
/// assert!(Arc::ptr_eq(&first, &set.at(0.1, Parallelism::Sequential)?));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug)]
pub struct OperatorSet {
    variant: Variant,
    viewpoint: Viewpoint,
    mirror: Operator,
    kept: Mutex<HashMap<u64, Arc<Operator>>>,
}

impl OperatorSet {
    /// The set of a lobe, a camera, the angles of the rings of normals from the axis, and the
    /// degree of the light.
    ///
    /// # Errors
    /// Those of [`Operator::new`].
    pub fn new(
        variant: Variant,
        viewpoint: Viewpoint,
        rings: &[f64],
        degree: usize,
    ) -> Result<Self> {
        Ok(Self {
            variant,
            viewpoint,
            mirror: Operator::new(
                variant,
                0.0,
                viewpoint,
                rings,
                degree,
                Parallelism::Sequential,
            )?,
            kept: Mutex::default(),
        })
    }

    /// The operator at σ.
    ///
    /// # Errors
    /// A σ that [`Operator::new`] refuses.
    pub fn at(&self, sigma: f64, parallelism: Parallelism) -> Result<Arc<Operator>> {
        let key = sigma.to_bits();
        let find = || {
            let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.get(&key).map(Arc::clone)
        };
        if let Some(operator) = find() {
            return Ok(operator);
        }
        // Made outside the lock: two threads may make the same one, and the first to finish is
        // kept.
        let made = self
            .mirror
            .with_roughness(self.variant, sigma, self.viewpoint, parallelism)?;
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(Arc::clone(
            kept.entry(key).or_insert_with(|| Arc::new(made)),
        ))
    }
}

/// The operators of one view over a range of σ, by interpolation.
///
/// Chebyshev's nodes in ln σ and the barycentric formula (Berrut and Trefethen 2004,
/// doi:10.1137/S0036144502417715). The error is not a guess: the table makes the exact operator
/// halfway between all neighbouring nodes too, and [`OperatorTable::error`] is the largest
/// difference found there.
///
/// ```
/// use lobes::{Parallelism, reflectance::Variant};
/// use lobes::reflection::{OperatorSet, OperatorTable, Viewpoint};
/// let one = Parallelism::Sequential;
/// let set = OperatorSet::new(Variant::Duer, Viewpoint::Orthographic, &[0.2, 0.9], 8)?;
/// let table = OperatorTable::new(&set, 0.1, 0.2, 6, one)?;
/// // What it interpolates at a σ that is no node of its own is as near as it says.
/// let (interpolated, exact) = (table.at(0.123)?, set.at(0.123, one)?);
/// let off = (interpolated.specular(4, 0)[1] - exact.specular(4, 0)[1]).abs();
/// assert!(off <= 2.0 * table.error() && table.error() < 1e-5);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug)]
pub struct OperatorTable {
    low: f64,
    high: f64,
    logarithms: Vec<f64>,
    nodes: Vec<Arc<Operator>>,
    error: f64,
}

impl OperatorTable {
    /// A table of `nodes` operators of `set` for σ in [`low`, `high`].
    ///
    /// # Errors
    /// An empty range, a σ out of range, fewer than two nodes or more than 4096.
    pub fn new(
        set: &OperatorSet,
        low: f64,
        high: f64,
        nodes: usize,
        parallelism: Parallelism,
    ) -> Result<Self> {
        if !(low > 0.0 && high > low && high.is_finite()) {
            return Err(Error::Domain {
                what: "the lower end of the table's roughnesses",
                value: low,
                allowed: "above 0 and below the upper end",
            });
        }
        if nodes < 2 {
            return Err(Error::TooFew {
                what: "a table of operators",
                items: "nodes",
                needed: 2,
                got: nodes,
            });
        }
        if nodes > 4096 {
            return Err(Error::Domain {
                what: "the number of nodes of a table of operators",
                value: nodes as f64,
                allowed: "from 2 to 4096",
            });
        }
        let (centre, half) = (0.5 * (low.ln() + high.ln()), 0.5 * (high.ln() - low.ln()));
        let logarithm = |i: f64| centre - half * (PI * (i + 0.5) / nodes as f64).cos();
        let logarithms: Vec<f64> = (0..nodes).map(|i| logarithm(i as f64)).collect();
        let made = logarithms
            .iter()
            .map(|x| set.at(x.exp(), parallelism))
            .collect::<Result<Vec<_>>>()?;
        let mut table = Self {
            low,
            high,
            logarithms,
            nodes: made,
            error: 0.0,
        };
        for i in 0..nodes - 1 {
            let sigma = logarithm(i as f64 + 0.5).exp();
            let exact =
                set.mirror
                    .with_roughness(set.variant, sigma, set.viewpoint, parallelism)?;
            let difference = table.at(sigma)?.largest_specular_difference(&exact);
            table.error = table.error.max(difference);
        }
        Ok(table)
    }

    /// The largest `|T_lm(θ)|` difference from the exact operator, over all l, m and rings, at the
    /// σ halfway between neighbouring nodes.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// The operator at σ.
    ///
    /// # Errors
    /// A σ outside the table.
    pub fn at(&self, sigma: f64) -> Result<Operator> {
        if !(self.low..=self.high).contains(&sigma) {
            return Err(Error::Domain {
                what: "the roughness σ",
                value: sigma,
                allowed: "inside the table's range",
            });
        }
        let x = sigma.ln();
        if let Some(exact) = self.logarithms.iter().position(|node| *node == x) {
            return Ok(Operator::clone(&self.nodes[exact]));
        }
        let count = self.nodes.len() as f64;
        let mut weights: Vec<f64> = self
            .logarithms
            .iter()
            .enumerate()
            .map(|(i, node)| {
                let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
                sign * (PI * (i as f64 + 0.5) / count).sin() / (x - node)
            })
            .collect();
        let total: f64 = weights.iter().sum();
        for weight in &mut weights {
            *weight /= total;
        }
        Ok(Operator::mixture(&self.nodes, &weights))
    }
}
