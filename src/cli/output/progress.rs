//! Shows a run's progress on stderr: a bar, or plain lines, or JSON.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use serde_json::json;

use super::run_progress::RunProgress;
use super::screen::{Palette, Screen, Tone, is_dumb_terminal};
use super::table::count;
use crate::cli::input::global::{Global, ProgressMode};
use mocban_core::domain::{Failure, one_line};
use mocban_runner::{RunEvent, StopLevel};
use mocban_system::time_text::duration;

/// Shows one run.
#[derive(Debug)]
pub(crate) struct ProgressReporter {
    screen: Screen,
    palette: Palette,
    /// Whether only the first of equal failures are shown.
    counts_equal: bool,
    progress: RunProgress,
    started: Instant,
    display: Display,
}

#[derive(Debug)]
enum Display {
    Bar {
        bar: ProgressBar,
        /// Whether the bar counts stages of blocks.
        is_of_blocks: bool,
    },
    Plain {
        last: Instant,
        percent: u64,
    },
    Json,
    None,
}

/// Time after which the next event prints a plain line.
const PLAIN_INTERVAL: Duration = Duration::from_secs(10);
/// After this many percentage points of progress, a plain line is printed before `PLAIN_INTERVAL` is over.
const PLAIN_PERCENT: u64 = 5;
/// Shortest time between two plain lines.
const PLAIN_MIN_INTERVAL: Duration = Duration::from_secs(1);

impl ProgressReporter {
    /// Starts the requested display; `-q` turns the automatic one off, and `-v` shows all failures.
    pub(crate) fn new(global: &Global, screen: &Screen, palette: Palette) -> Self {
        let now = Instant::now();
        Self {
            screen: screen.clone(),
            palette,
            counts_equal: global.verbose == 0,
            progress: RunProgress::default(),
            started: now,
            display: display(global.progress, global.quiet, screen, now),
        }
    }

    /// Shows an event.
    pub(crate) fn event(&mut self, event: &RunEvent) {
        let was_open = self.progress.blocks.is_open();
        self.progress.observe(event);
        if was_open && !self.progress.blocks.is_open() {
            // The time of blocks says nothing about that of pairs.
            self.started = Instant::now();
        }
        match &mut self.display {
            Display::None => return,
            Display::Json => {
                self.screen.json_line(&json!(event));
                return;
            }
            Display::Bar { bar, is_of_blocks } => update_bar(bar, is_of_blocks, &self.progress),
            Display::Plain { last, percent } => {
                // Blocks and then pairs each begin at 0 %.
                *percent = self.progress.percent().min(*percent);
                let is_enough = self.progress.percent() >= *percent + PLAIN_PERCENT
                    || matches!(event, RunEvent::BlockStageStarted { .. });
                let since = last.elapsed();
                if since >= PLAIN_INTERVAL || is_enough && since >= PLAIN_MIN_INTERVAL {
                    (*last, *percent) = (Instant::now(), self.progress.percent());
                    let elapsed = self.started.elapsed().as_millis() as u64;
                    self.screen.line(&self.progress.line(elapsed));
                }
            }
        }
        match event_line(event, self.palette) {
            Some((label, text)) if self.counts_equal && !label.is_empty() => {
                self.screen.warning(&label, &text);
            }
            Some((label, text)) => self.screen.line(&format!("{label}{text}")),
            None => {}
        }
    }

    /// Removes the bar.
    pub(crate) fn end(self) {
        if let Display::Bar { bar, .. } = self.display {
            bar.finish_and_clear();
        }
    }
}

fn display(mode: ProgressMode, quiet: bool, screen: &Screen, now: Instant) -> Display {
    match mode {
        ProgressMode::Auto if quiet => Display::None,
        ProgressMode::Auto if std::io::stderr().is_terminal() && !is_dumb_terminal() => bar(screen),
        ProgressMode::Auto | ProgressMode::Plain => Display::Plain {
            last: now,
            percent: 0,
        },
        ProgressMode::Bar => bar(screen),
        ProgressMode::Json => Display::Json,
        ProgressMode::None => Display::None,
    }
}

/// The second line of the bar. It is narrower than the terminal, so that the "^C" printed after it does not wrap.
const PAIR_BAR: &str = "{msg}\n{bar:40} {percent:>3} %  {pos}/{len} stages  {per_sec}  {eta} left";
/// The same while there are blocks to cut: without an estimate, because their pairs are not yet known.
const BLOCK_BAR: &str = "{msg}\n{bar:40} {percent:>3} %  {pos}/{len} stages of blocks  {elapsed}";

fn bar_style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("━╸─")
        .with_key(
            "per_sec",
            |state: &ProgressState, to: &mut dyn std::fmt::Write| {
                // Formatting into memory does not fail.
                let _ = write!(to, "{:.1}/s", state.per_sec());
            },
        )
}

fn bar(screen: &Screen) -> Display {
    let bar = screen.add_bar(ProgressBar::new(0).with_style(bar_style(PAIR_BAR)));
    bar.enable_steady_tick(Duration::from_millis(250));
    Display::Bar {
        bar,
        is_of_blocks: false,
    }
}

fn update_bar(bar: &ProgressBar, is_of_blocks: &mut bool, progress: &RunProgress) {
    let blocks = progress.blocks.line();
    if blocks.is_some() != *is_of_blocks {
        *is_of_blocks = blocks.is_some();
        bar.set_style(bar_style(if *is_of_blocks { BLOCK_BAR } else { PAIR_BAR }));
        bar.reset_eta();
    }
    let (finished, stages) = progress.position();
    if bar.length() != Some(stages) {
        bar.set_length(stages);
    }
    bar.set_position(finished);
    bar.set_message(blocks.unwrap_or_else(|| progress.by_stage_line()));
}

/// Returns the line that is printed for an event, if any: a label, which failures have, and a text.
fn event_line(event: &RunEvent, palette: Palette) -> Option<(String, String)> {
    let label = |tone, word| palette.paint(tone, word) + " ";
    let [failed, waiting] =
        [(Tone::Bad, "failed"), (Tone::Warn, "waiting")].map(|(tone, word)| label(tone, word));
    let plain = |text: String| Some((String::new(), text));
    match event {
        RunEvent::PairFailed {
            pair,
            stage,
            failure,
            ..
        } => Some((failed, at_stage(palette.paint(Tone::Strong, pair), stage, failure))),
        RunEvent::PairBackingOff {
            pair,
            stage,
            failure,
            wait_ms,
        } => Some((waiting, format!("{}, retrying in {}", at_stage(pair, stage, failure), duration(*wait_ms)))),
        RunEvent::Recovered { pairs } => {
            let pairs = count(*pairs, "pair");
            plain(format!("{pairs} recovered from a worker that died"))
        }
        RunEvent::Stopping { level, reason } => {
            plain(palette.paint(Tone::Warn, stopping_line(*level, reason)))
        }
        RunEvent::BlockDone { block, cut, .. } => plain(format!(
            "block {block}: {} added, {} changed, {} retired",
            count(cut.added, "pair"),
            cut.changed,
            cut.retired
        )),
        RunEvent::BlockFailed {
            block,
            stage,
            failure,
        } => {
            let block = format!("block {}", palette.paint(Tone::Strong, block));
            Some((failed, at_stage(block, stage, failure)))
        }
        RunEvent::BlockBackingOff {
            block,
            stage,
            failure,
            wait_ms,
        } => Some((waiting, format!("block {}, retrying in {}", at_stage(block, stage, failure), duration(*wait_ms)))),
        RunEvent::Started { .. }
        | RunEvent::BlockStageStarted { .. }
        | RunEvent::BlockStageFinished { .. }
        // The terminal shows it as other warnings.
        | RunEvent::BlockWarned { .. }
        | RunEvent::StageStarted { .. }
        | RunEvent::StageFinished { .. }
        | RunEvent::PairDone { .. } => None,
    }
}

/// Returns what happened to a pair or block at a stage.
fn at_stage(
    what: impl std::fmt::Display,
    stage: impl std::fmt::Display,
    failure: &Failure,
) -> String {
    let message = one_line(&failure.message);
    format!("{what} at {stage}: {message} ({})", failure.class)
}

fn stopping_line(level: StopLevel, reason: &str) -> String {
    match level {
        StopLevel::Go => reason.to_owned(),
        StopLevel::Drain => {
            format!("{reason}: finishing the current stages; press Ctrl-C again to stop now")
        }
        StopLevel::Now => format!("{reason}: stopping now; stored results are kept"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Palette, RunEvent, StopLevel, event_line, json};
    use mocban_core::domain::{Failure, FailureClass, PairName, Stage};

    #[test]
    fn lines_of_events() {
        let pair: PairName = "0003".parse().expect("valid id");
        let (stage, failure) = (
            Stage::Fit,
            Failure::new(FailureClass::BadInput, "a.stl: no faces"),
        );
        let stopping = |level| RunEvent::Stopping {
            level,
            reason: "interrupted".into(),
        };
        let events = [
            RunEvent::PairFailed {
                pair: pair.clone(),
                stage,
                failure: failure.clone(),
                skipped: 4,
            },
            RunEvent::PairBackingOff {
                pair,
                stage,
                failure,
                wait_ms: 30_000,
            },
            RunEvent::Recovered { pairs: 1 },
            stopping(StopLevel::Drain),
            stopping(StopLevel::Now),
        ];
        let lines = events
            .each_ref()
            .map(|event| event_line(event, Palette::PLAIN).unwrap_or_default())
            .map(|(label, text)| label + &text);
        insta::assert_snapshot!(lines.join("\n"));
        insta::assert_snapshot!(
            "json",
            events.map(|event| json!(event).to_string()).join("\n")
        );
    }
}
