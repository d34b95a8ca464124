//! Stopping work that a caller no longer wants.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A switch that stops long work from another thread, as Ctrl-C or a closed window wants it.
///
/// Work that [`run`](Self::run) has begun looks at the switch wherever it divides itself among
/// threads, which is often: a rendering stops within some milliseconds. What it has done by then is
/// lost.
///
/// The work is left by unwinding, without a message: a program that is compiled with `panic =
/// "abort"` must not cancel.
///
/// ```
/// use lobes::{Cancellation, Parallelism};
/// let cancellation = Cancellation::default();
/// let sum = cancellation.run(|| Parallelism::Rayon.map(3, |i| i).into_iter().sum());
/// assert_eq!(sum, Some(3));
/// let stopped = cancellation.run(|| {
///     Parallelism::Sequential.map(1000, |i| {
///         if i == 5 {
///             cancellation.cancel();
///         }
///     })
/// });
/// assert_eq!(stopped, None);
/// ```
#[derive(Debug, Clone, Default)]
pub struct Cancellation(Arc<AtomicBool>);

/// What unwinds.
struct Cancelled;

thread_local! {
    /// The switch of the work that this thread is at.
    static CURRENT: RefCell<Option<Cancellation>> = const { RefCell::new(None) };
}

impl Cancellation {
    /// Stops all work that runs under it, and all that would begin.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Does `work`; nothing comes back where it was cancelled before it was done.
    ///
    /// # Panics
    /// Where `work` does.
    pub fn run<T>(&self, work: impl FnOnce() -> T) -> Option<T> {
        match catch_unwind(AssertUnwindSafe(|| Scope::enter(Some(self)).run(work))) {
            Ok(done) => Some(done),
            Err(payload) if payload.is::<Cancelled>() => None,
            Err(payload) => resume_unwind(payload),
        }
    }

    /// The switch of the work that this thread is at.
    pub(crate) fn current() -> Option<Self> {
        CURRENT.with_borrow(Clone::clone)
    }
}

/// This thread works under a switch until this is dropped, by unwinding or otherwise.
pub(crate) struct Scope(Option<Cancellation>);

impl Scope {
    pub(crate) fn enter(cancellation: Option<&Cancellation>) -> Self {
        Self(CURRENT.replace(cancellation.cloned()))
    }

    /// Does `work` unless it is cancelled.
    pub(crate) fn run<T>(self, work: impl FnOnce() -> T) -> T {
        let cancelled = CURRENT.with_borrow(|current| {
            current
                .as_ref()
                .is_some_and(|cancellation| cancellation.0.load(Ordering::Relaxed))
        });
        if cancelled {
            // Not a panic: no hook is called and nothing is printed.
            resume_unwind(Box::new(Cancelled));
        }
        work()
    }
}

impl Drop for Scope {
    fn drop(&mut self) {
        CURRENT.set(self.0.take());
    }
}

/// `f`, which looks at the switch of the thread that makes it, wherever it is called.
pub(crate) fn cancellable<A, T>(f: impl Fn(A) -> T + Sync + Send) -> impl Fn(A) -> T + Sync + Send {
    let cancellation = Cancellation::current();
    move |argument| match &cancellation {
        None => f(argument),
        some => Scope::enter(some.as_ref()).run(|| f(argument)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parallelism;

    #[test]
    fn it_stops_its_own_work_alone() {
        let (one, other) = (Cancellation::default(), Cancellation::default());
        one.cancel();
        for parallelism in [Parallelism::Sequential, Parallelism::Rayon] {
            let work = || parallelism.map(4, |i| i + 1);
            assert_eq!(one.run(work), None);
            assert_eq!(other.run(work), Some(vec![1, 2, 3, 4]));
            assert_eq!(other.run(|| one.run(work)), Some(None));
            assert_eq!(work(), [1, 2, 3, 4]);
        }
    }

    #[test]
    fn it_reaches_work_within_work() {
        let cancellation = Cancellation::default();
        let inner = |i: usize| {
            if i == 0 {
                cancellation.cancel();
            }
            // Each of these would take a minute.
            Parallelism::Sequential.map(usize::MAX >> 32, |_| ())
        };
        let work = || Parallelism::Rayon.map(4, inner);
        assert!(cancellation.run(work).is_none());
    }

    /// What is left of a long list is not gone through one call at a time.
    #[test]
    fn it_does_not_call_what_is_left() {
        let cancellation = Cancellation::default();
        let work = || {
            Parallelism::Rayon.map(1 << 40, |i| {
                if i == 5 {
                    cancellation.cancel();
                }
            })
        };
        assert!(cancellation.run(work).is_none());
    }

    #[test]
    #[should_panic(expected = "a fault")]
    fn a_panic_goes_on() {
        Cancellation::default().run(|| panic!("a fault"));
    }
}
