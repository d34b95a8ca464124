//! How an error is counted; each way is defined here and nowhere else.

/// How an error is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Metric {
    /// |got − want| in units in the last place of `want`.
    Ulp,
    /// |got − want| / |want|. Only where `want` stays away from its zeros.
    Relative,
    /// |got − want|.
    Absolute,
    /// |got − want| / scale, with the scale named here.
    Scaled(&'static str),
    /// |got − want| in standard errors of the oracle, which is itself a Monte Carlo estimate.
    ZScore,
    /// 1 where an answer is not the very same, 0 where it is.
    Mismatch,
}

impl Metric {
    /// The metric's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ulp => "ulp",
            Self::Relative => "relative",
            Self::Absolute => "absolute",
            Self::Scaled(_) => "scaled",
            Self::ZScore => "z-score",
            Self::Mismatch => "mismatch",
        }
    }

    /// What the metric counts, in one sentence.
    pub fn definition(self) -> &'static str {
        match self {
            Self::Ulp => {
                "|got − want| in units in the last place of want: the gap between want and the next larger magnitude in double precision"
            }
            Self::Relative => {
                "|got − want| / |want|; never used near a zero of want, where it means nothing"
            }
            Self::Absolute => "|got − want|",
            Self::Scaled(_) => "|got − want| divided by the scale that the contract names",
            Self::ZScore => {
                "|got − want| in standard errors of the oracle's own Monte Carlo estimate"
            }
            Self::Mismatch => "1 where the answer is not the very same, 0 where it is",
        }
    }

    /// What follows a number in this metric.
    pub(super) fn unit(self) -> String {
        match self {
            Self::Ulp => " ulp".into(),
            Self::Relative => " of the value".into(),
            Self::Scaled(scale) => format!(" of {scale}"),
            Self::ZScore => " standard errors".into(),
            Self::Absolute | Self::Mismatch => String::new(),
        }
    }
}

/// The gap between |x| and the next larger double; the smallest subnormal at zero.
pub(super) fn ulp(x: f64) -> f64 {
    let x = x.abs();
    x.next_up() - x
}
