//! The accuracy that each public function promises, as data.
//!
//! A [`Contract`] names a function, the oracle that it is held against, the domain, the metric and
//! the bound. `cargo test --test contracts` measures every one and fails past its bound; the
//! command `lobes accuracy` prints what it measured, and `ACCURACY.md` is that print-out. The
//! oracles ran long ago: their answers lie in [`Snapshots`], so neither needs Python.

#![forbid(unsafe_code)]

mod generator;
mod measurement;
mod metric;
mod snapshots;
mod table;

mod basis;
mod beckmann;
mod colorimetry;
mod complex;
mod convention;
mod convolution;
mod evaluation;
mod field;
mod ggx;
mod healpix;
mod invariance;
mod judgement;
mod legendre;
mod map;
mod masks;
mod peers;
mod picture;
mod pipeline;
mod radiance;
mod reflectance;
mod render;
mod rotation;
mod scattered;
mod single;
mod spectrum;
mod sphere;
mod splat;
mod transform;
mod view_operator;
mod ward_mitsuba;
mod wigner;

pub use measurement::{Measurement, Tally};
pub use metric::Metric;
pub use snapshots::{Provenance, Snapshot, Snapshots};
pub use table::{Measured, measure_all, print, table};

use lobes::Result;

/// What a function is held against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Oracle {
    /// The answers of another program: `oracles/snapshots/<subject>.json`.
    Snapshot(&'static str),
    /// An exact property or a closed form, in words.
    Identity(&'static str),
}

/// One promise of accuracy.
#[derive(Debug, Clone, Copy)]
pub struct Contract {
    /// `subject/what-is-promised`; unique. The subject is the file that holds the contract.
    pub id: &'static str,
    /// The function, as a caller writes it.
    pub function: &'static str,
    /// What it is held against.
    pub oracle: Oracle,
    /// The inputs for which the promise holds, and which of them are measured.
    pub domain: &'static str,
    /// How an error is counted.
    pub metric: Metric,
    /// The largest error allowed, in units of the metric.
    pub bound: f64,
    /// Why the bound is what it is, and no tighter.
    pub why: &'static str,
    /// A bound more than [`TIGHT`] times the largest error measured is stale, unless this says why
    /// it has to be.
    pub loose: Option<&'static str>,
    /// Measures every point.
    pub measure: fn(&Snapshots, &mut Tally) -> Result<()>,
}

/// How far a bound may lie above what is measured.
pub const TIGHT: f64 = 10.0;

impl Contract {
    /// The part of the id before the slash.
    pub fn subject(&self) -> &'static str {
        self.id.split('/').next().unwrap_or(self.id)
    }

    /// Measures the error at every point.
    ///
    /// # Errors
    ///
    /// A snapshot that is missing or malformed, or any error of the function itself.
    pub fn measure(&self, snapshots: &Snapshots) -> Result<Measurement> {
        let mut tally = Tally::new(self.metric);
        (self.measure)(snapshots, &mut tally)?;
        tally.finish(self.id)
    }

    /// What is wrong with a measurement of this contract, in one sentence, or `None`.
    ///
    /// ```
    /// # use lobes_contracts::{contracts, Measurement};
    /// let contract = contracts()[0];
    /// let off = Measurement { points: 1, largest: 1e9, mean: 1e9, at: "l = 3".into() };
    /// assert!(contract.verdict(&off).unwrap().contains("l = 3"));
    /// ```
    pub fn verdict(&self, measured: &Measurement) -> Option<String> {
        let Measurement { largest, at, .. } = measured;
        let unit = self.metric.unit();
        if largest.is_nan() || *largest > self.bound {
            Some(format!(
                "{}: off by {largest:.3e}{unit} at {at}, where {:.3e}{unit} is promised ({:.3e} times the bound)",
                self.function,
                self.bound,
                largest / self.bound,
            ))
        } else if self.loose.is_none() && largest * TIGHT < self.bound {
            Some(format!(
                "{}: the bound {:.3e}{unit} is stale; the largest error is {largest:.3e}{unit} at {at}",
                self.function, self.bound,
            ))
        } else {
            None
        }
    }
}

/// Every contract, by subject.
pub fn contracts() -> Vec<Contract> {
    [
        sphere::contracts(),
        basis::contracts(),
        legendre::contracts(),
        transform::contracts(),
        single::contracts(),
        convolution::contracts(),
        rotation::contracts(),
        splat::contracts(),
        scattered::contracts(),
        wigner::contracts(),
        complex::contracts(),
        field::contracts(),
        healpix::contracts(),
        masks::contracts(),
        convention::contracts(),
        peers::contracts(),
        invariance::contracts(),
        reflectance::contracts(),
        beckmann::contracts(),
        radiance::contracts(),
        ward_mitsuba::contracts(),
        ggx::contracts(),
        view_operator::contracts(),
        render::contracts(),
        map::contracts(),
        picture::contracts(),
        spectrum::contracts(),
        colorimetry::contracts(),
        pipeline::contracts(),
        evaluation::contracts(),
        judgement::contracts(),
    ]
    .concat()
}
