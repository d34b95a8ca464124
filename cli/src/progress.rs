//! Progress on a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::console;

/// A bar of `steps` on standard error; nothing where that is no terminal, or under `--quiet`.
pub(super) fn bar(steps: usize, what: &'static str) -> ProgressBar {
    let target = if console::is_quiet() {
        ProgressDrawTarget::hidden()
    } else {
        ProgressDrawTarget::stderr()
    };
    let style =
        ProgressStyle::with_template("{msg:>12} {bar:32} {pos}/{len} {elapsed}, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::with_draw_target(Some(steps as u64), target).with_style(style);
    bar.set_message(what);
    bar
}
