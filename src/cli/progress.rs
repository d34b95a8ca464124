//! Progress on a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of `steps` on standard error; nothing where that is no terminal.
pub(super) fn bar(steps: usize, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:>12} {bar:32} {pos}/{len} {elapsed}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(steps as u64).with_style(style);
    bar.set_message(what);
    bar
}
