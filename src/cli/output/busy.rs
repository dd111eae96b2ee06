//! A line on the terminal that says what a command is doing, so that no command is silent for long.

use std::io::IsTerminal as _;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::context::Context;
use super::screen::is_dumb_terminal;
use crate::cli::input::global::ProgressMode;

/// Time between two updates.
const TICK: Duration = Duration::from_millis(250);

/// Shows a text with the elapsed time below all other lines of stderr, until it is dropped.
///
/// It must be dropped before the command writes to stdout. Shows nothing if stderr is not a terminal.
#[derive(Debug)]
pub(crate) struct Busy(ProgressBar);

impl Busy {
    /// Shows a text such as `checking files`.
    pub(crate) fn start(context: &Context, text: &'static str) -> Self {
        Self::show(context, text, "{spinner} {msg}, {elapsed}")
    }

    /// Shows a text, and how many of `total` pairs were begun; see [`Self::begin_pair`].
    pub(crate) fn of_pairs(context: &Context, text: &'static str, total: u64) -> Self {
        let busy = Self::show(
            context,
            text,
            "{spinner} {msg}: {pos} of {len} pairs, {elapsed}",
        );
        busy.0.set_length(total);
        busy
    }

    fn show(context: &Context, text: &'static str, template: &str) -> Self {
        let is_wanted = match context.global.progress {
            ProgressMode::Auto => {
                !context.global.quiet && std::io::stderr().is_terminal() && !is_dumb_terminal()
            }
            ProgressMode::Bar => true,
            ProgressMode::Plain | ProgressMode::Json | ProgressMode::None => false,
        };
        if !is_wanted {
            return Self(ProgressBar::hidden());
        }
        let style = ProgressStyle::with_template(template);
        let style = style.unwrap_or_else(|_| ProgressStyle::default_spinner());
        let bar = ProgressBar::no_length()
            .with_style(style)
            .with_message(text);
        let bar = context.screen.add_bar(bar);
        bar.enable_steady_tick(TICK);
        Self(bar)
    }

    /// Returns whether anything is shown.
    pub(crate) fn is_shown(&self) -> bool {
        !self.0.is_hidden()
    }

    /// Counts a pair.
    pub(crate) fn begin_pair(&self) {
        self.0.inc(1);
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
