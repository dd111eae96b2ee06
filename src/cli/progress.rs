//! The only file that draws: the bar of a run, or what stands in for it off a terminal.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use serde_json::{Value, json};

use super::args::ProgressMode;
use super::output::{Palette, Tone, dumb_terminal};
use super::run_progress::RunProgress;
use super::time_text::span;
use crate::domain::{Failure, PairName, Stage};
use crate::runner::{RunEvent, StopLevel};

/// stderr, shared by talk, log and bar so that no line tears the bar.
#[derive(Debug, Clone)]
pub(super) struct Screen(MultiProgress);

impl Screen {
    /// The screen without a bar yet.
    pub(super) fn new() -> Self {
        Self(MultiProgress::new())
    }

    /// A line above the bar, or just a line.
    pub(super) fn line(&self, text: &str) {
        // When stderr is closed nobody is there to be told so.
        let _ = self.clone().write_all(format!("{text}\n").as_bytes());
    }
}

impl Write for Screen {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0
            .suspend(|| std::io::stderr().lock().write_all(bytes))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        std::io::stderr().flush()
    }
}

/// Puts the cursor to the top of a terminal and clears it, for `status --watch`.
pub(super) const CLEAR: &str = "\u{1b}[H\u{1b}[2J";

/// Shows one run.
#[derive(Debug)]
pub(super) struct Progress {
    screen: Screen,
    palette: Palette,
    counts: RunProgress,
    started: Instant,
    form: Form,
}

#[derive(Debug)]
enum Form {
    Bar(ProgressBar),
    Plain { at: Instant, percent: u64 },
    Json,
    None,
}

/// A plain line comes after this time or this share of the work, whichever is first.
const PLAIN_EVERY: Duration = Duration::from_secs(10);
const PLAIN_PERCENT: u64 = 5;
/// However fast the work goes, plain lines are at least this far apart.
const PLAIN_LEAST: Duration = Duration::from_secs(1);

impl Progress {
    /// Progress in the form asked for; `-q` takes the automatic one away.
    pub(super) fn new(mode: ProgressMode, quiet: bool, screen: &Screen, palette: Palette) -> Self {
        let now = Instant::now();
        Self {
            screen: screen.clone(),
            palette,
            counts: RunProgress::default(),
            started: now,
            form: form(mode, quiet, screen, now),
        }
    }

    /// Shows what has happened.
    pub(super) fn event(&mut self, event: &RunEvent) {
        self.counts.observe(event);
        match &mut self.form {
            Form::None => return,
            Form::Json => {
                self.screen.line(&as_json(event).to_string());
                return;
            }
            Form::Bar(bar) => draw(bar, &self.counts),
            Form::Plain { at, percent } => {
                let enough = self.counts.percent() >= *percent + PLAIN_PERCENT;
                let due = at.elapsed() >= PLAIN_EVERY || enough && at.elapsed() >= PLAIN_LEAST;
                if due {
                    (*at, *percent) = (Instant::now(), self.counts.percent());
                    let elapsed = self.started.elapsed().as_millis() as u64;
                    self.screen.line(&self.counts.line(elapsed));
                }
            }
        }
        if let Some(line) = note(event, self.palette) {
            self.screen.line(&line);
        }
    }

    /// Takes the bar away.
    pub(super) fn end(self) {
        if let Form::Bar(bar) = self.form {
            bar.finish_and_clear();
        }
    }
}

fn form(mode: ProgressMode, quiet: bool, screen: &Screen, now: Instant) -> Form {
    let plain = Form::Plain {
        at: now,
        percent: 0,
    };
    match mode {
        ProgressMode::Auto if quiet => Form::None,
        ProgressMode::Auto if std::io::stderr().is_terminal() && !dumb_terminal() => bar(screen),
        ProgressMode::Auto | ProgressMode::Plain => plain,
        ProgressMode::Bar => bar(screen),
        ProgressMode::Json => Form::Json,
        ProgressMode::None => Form::None,
    }
}

fn bar(screen: &Screen) -> Form {
    // Not the whole width: the terminal writes "^C" at the end of the line, and must not wrap.
    let style = ProgressStyle::with_template(
        "{msg}\n{bar:40} {percent:>3} %  {pos}/{len} stages  {per_sec}  {eta} left",
    )
    .unwrap_or_else(|_| ProgressStyle::default_bar())
    .progress_chars("━╸─")
    .with_key(
        "per_sec",
        |state: &indicatif::ProgressState, to: &mut dyn std::fmt::Write| {
            // A formatter into memory does not fail.
            let _ = write!(to, "{:.1}/s", state.per_sec());
        },
    );
    let bar = screen.0.add(ProgressBar::new(0).with_style(style));
    bar.enable_steady_tick(Duration::from_millis(250));
    Form::Bar(bar)
}

fn draw(bar: &ProgressBar, counts: &RunProgress) {
    if bar.length() != Some(counts.stages) {
        bar.set_length(counts.stages);
    }
    bar.set_position(counts.passed);
    bar.set_message(counts.by_stage_line());
}

/// What deserves a line of its own.
fn note(event: &RunEvent, palette: Palette) -> Option<String> {
    match event {
        RunEvent::PairFailed {
            pair,
            stage,
            failure,
            ..
        } => Some(failed_line(pair, *stage, failure, palette)),
        RunEvent::PairBackingOff {
            pair,
            stage,
            failure,
            wait_ms,
        } => Some(format!(
            "{} {pair} at {stage}: {} ({}), again in {}",
            palette.paint(Tone::Warn, "waits"),
            failure.message,
            failure.class,
            span(*wait_ms)
        )),
        RunEvent::Recovered { pairs } => Some(format!(
            "{} of a worker that died came back",
            super::table::count(*pairs, "pair")
        )),
        RunEvent::Stopping { level, reason } => {
            Some(palette.paint(Tone::Warn, stopping(*level, reason)))
        }
        RunEvent::Started { .. }
        | RunEvent::StageStarted { .. }
        | RunEvent::StageFinished { .. }
        | RunEvent::PairDone { .. } => None,
    }
}

/// `failed 0003 at fit: mesh has no faces (bad_input)`
fn failed_line(pair: &PairName, stage: Stage, failure: &Failure, palette: Palette) -> String {
    format!(
        "{} {} at {stage}: {} ({})",
        palette.paint(Tone::Bad, "failed"),
        palette.paint(Tone::Strong, pair),
        failure.message,
        failure.class
    )
}

fn stopping(level: StopLevel, reason: &str) -> String {
    match level {
        StopLevel::Go => reason.to_owned(),
        StopLevel::Drain => {
            format!("{reason}: finishing the stages in hand; Ctrl-C once more stops now")
        }
        StopLevel::Now => format!("{reason}: stopping now; what is stored stays"),
    }
}

fn as_json(event: &RunEvent) -> Value {
    match event {
        RunEvent::Started {
            pairs,
            stages,
            by_stage,
            workers,
        } => json!({"message_type": "started", "pairs": pairs, "stages": stages,
            "by_stage": by_stage, "workers": workers}),
        RunEvent::StageStarted { pair, stage } => {
            json!({"message_type": "stage_started", "pair": pair, "stage": stage})
        }
        RunEvent::StageFinished { pair, stage, ms } => {
            json!({"message_type": "stage_finished", "pair": pair, "stage": stage, "ms": ms})
        }
        RunEvent::PairDone { pair } => json!({"message_type": "pair_done", "pair": pair}),
        RunEvent::PairFailed {
            pair,
            stage,
            failure,
            skipped,
        } => json!({"message_type": "pair_failed", "pair": pair, "stage": stage,
            "class": failure.class, "message": failure.message, "skipped": skipped}),
        RunEvent::PairBackingOff {
            pair,
            stage,
            failure,
            wait_ms,
        } => json!({"message_type": "pair_backing_off", "pair": pair, "stage": stage,
            "class": failure.class, "message": failure.message, "wait_ms": wait_ms}),
        RunEvent::Recovered { pairs } => json!({"message_type": "recovered", "pairs": pairs}),
        RunEvent::Stopping { level, reason } => {
            json!({"message_type": "stopping", "now": *level == StopLevel::Now, "reason": reason})
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Palette, RunEvent, StopLevel, note};
    use crate::domain::{Failure, FailureClass, Stage};

    #[test]
    fn failure_is_named_in_one_line() {
        let event = RunEvent::PairFailed {
            pair: "0003".parse().expect("valid id"),
            stage: Stage::Fit,
            failure: Failure::new(FailureClass::BadInput, "a.stl: no faces"),
            skipped: 4,
        };
        assert_eq!(
            note(&event, Palette::PLAIN).as_deref(),
            Some("failed 0003 at fit: a.stl: no faces (bad_input)")
        );
    }

    #[test]
    fn drain_tells_how_to_stop_now() {
        let event = RunEvent::Stopping {
            level: StopLevel::Drain,
            reason: "interrupted".into(),
        };
        let line = note(&event, Palette::PLAIN).expect("a line");
        assert!(line.contains("Ctrl-C once more"), "{line}");
    }
}
