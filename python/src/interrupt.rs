//! Long calls that Ctrl-C ends and that tell how far they are.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use lobes::Cancellation;
use pyo3::prelude::*;

/// How often Python is asked whether a signal came.
const ASK: Duration = Duration::from_millis(50);

/// How long work that was cancelled is waited for. What does not look at its switch by then goes on
/// in the background, for nothing.
const PATIENCE: Duration = Duration::from_millis(500);

/// How far a piece of work is.
#[derive(Clone, Default)]
pub(crate) struct Progress(Arc<AtomicUsize>);

impl Progress {
    /// One step more is done.
    pub(crate) fn step(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

/// Does `work` on a thread of its own, without the interpreter's lock, while this one attends to
/// Python's signals.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    run_with_progress(py, None, |_| work())
}

/// As [`run`]; `callback(done, total)` is called on this thread whenever more of the steps are
/// done. What it raises ends the work.
pub(crate) fn run_with_progress<T: Send + 'static>(
    py: Python<'_>,
    callback: Option<(&Bound<'_, PyAny>, usize)>,
    work: impl FnOnce(&Progress) -> T + Send + 'static,
) -> PyResult<T> {
    let cancellation = Cancellation::default();
    let progress = Progress::default();
    let (sender, mut receiver) = channel();
    let worker = std::thread::Builder::new().spawn({
        let (cancellation, progress) = (cancellation.clone(), progress.clone());
        move || {
            let done = cancellation.run(|| work(&progress));
            // Nobody listens any more where the call was given up.
            let _ = sender.send(done);
        }
    })?;
    let mut told = 0;
    let mut tell = || -> PyResult<()> {
        let done = progress.0.load(Ordering::Relaxed);
        if let Some((callback, total)) = callback
            && done > told
        {
            told = done;
            callback.call1((done, total))?;
        }
        Ok(())
    };
    loop {
        let heard;
        (heard, receiver) = py.detach(move || (receiver.recv_timeout(ASK), receiver));
        match heard {
            Ok(Some(done)) => {
                tell()?;
                return Ok(done);
            }
            Ok(None) | Err(RecvTimeoutError::Timeout) => {}
            // It panicked: so does this thread.
            Err(RecvTimeoutError::Disconnected) => {
                if let Err(payload) = worker.join() {
                    std::panic::resume_unwind(payload);
                }
                unreachable!("a worker that ends well has sent what it did");
            }
        }
        if let Err(raised) = py.check_signals().and_then(|()| tell()) {
            cancellation.cancel();
            let end = Instant::now() + PATIENCE;
            py.detach(|| {
                while !worker.is_finished() && Instant::now() < end {
                    std::thread::sleep(Duration::from_millis(5));
                }
            });
            return Err(raised);
        }
    }
}
