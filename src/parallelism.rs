//! Parallelism as a value that the caller passes.

use crate::cancellation::cancellable;

/// How many threads an operation may use.
///
/// The result does not depend on it: work is divided by index, never by who comes first, and every
/// sum is taken in the same order. Without the feature `parallel` every variant runs on the
/// caller's thread.
///
/// ```
/// use lobes::Parallelism;
/// assert_eq!(Parallelism::Sequential.map(3, |i| i * i), vec![0, 1, 4]);
/// assert_eq!(Parallelism::Rayon.map(3, |i| i * i), vec![0, 1, 4]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Parallelism {
    /// The caller's thread only.
    #[default]
    Sequential,
    /// The rayon pool that is current: the global one, or the one that the caller installed.
    Rayon,
}

/// Into so many parts a thread work is divided at the most.
#[cfg(feature = "parallel")]
const PARTS: usize = 1024;

impl Parallelism {
    /// How many threads there are to use.
    pub fn threads(self) -> usize {
        match self {
            Self::Sequential => 1,
            #[cfg(feature = "parallel")]
            Self::Rayon => rayon::current_num_threads(),
            #[cfg(not(feature = "parallel"))]
            Self::Rayon => 1,
        }
    }

    /// `(0..count).map(f)`, in order, on as many threads as allowed. A
    /// [`Cancellation`](crate::Cancellation) stops it between two calls of `f`.
    pub fn map<T: Send>(self, count: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        let f = cancellable(f);
        match self {
            #[cfg(feature = "parallel")]
            Self::Rayon => {
                use rayon::prelude::*;
                // Each part that is cancelled unwinds by itself, and rayon parts what is stolen
                // down to single calls: without a least length 10⁶ cancelled calls took 2 s.
                let least = count / (PARTS * rayon::current_num_threads()) + 1;
                let parts = (0..count).into_par_iter().with_min_len(least);
                parts.map(f).collect()
            }
            _ => (0..count).map(f).collect(),
        }
    }
}
