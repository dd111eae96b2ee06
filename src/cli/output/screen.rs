//! Writes messages, log and progress bar to stderr, and colours text.
//!
//! Text is sanitized in [`terminal_text`] when it is printed. If each value were sanitized separately, one could be
//! forgotten. The program's own colour codes contain a number that is random in each process, so a value cannot imitate
//! them. They become real codes only when they are printed.

use std::hash::{BuildHasher as _, RandomState};
use std::io::Write as _;
use std::sync::{Arc, LazyLock, Mutex};
use std::time::Instant;

use clap::ColorChoice;
use indicatif::{MultiProgress, ProgressBar};

use super::equal_warnings::EqualWarnings;
use mocban_core::domain::{one_line, visible, visible_json};
use mocban_core::locked;

/// Beginning of the program's own terminal codes. It contains a random number.
static OWN_CODE: LazyLock<String> =
    LazyLock::new(|| format!("\u{1b}[{};", RandomState::new().hash_one("own code")));

/// Returns the text that is printed: hidden characters become visible, except line breaks, tabs and the program's own
/// codes.
pub(crate) fn terminal_text(text: &str) -> String {
    let mut parts = text.split(OWN_CODE.as_str());
    let mut shown = parts
        .next()
        .map_or_else(String::new, |first| visible(first).into_owned());
    for part in parts {
        shown.push_str("\u{1b}[");
        shown.push_str(&visible(part));
    }
    shown
}

/// Returns a text as one line of visible characters. The program's own codes are kept.
pub(crate) fn terminal_line(text: &str) -> String {
    let parts = text.split(OWN_CODE.as_str()).map(one_line);
    parts.collect::<Vec<_>>().join(OWN_CODE.as_str())
}

/// The stderr stream. Messages, log and progress bar share it, so that no line overwrites the bar.
#[derive(Debug, Clone)]
pub(crate) struct Screen {
    bars: MultiProgress,
    warnings: Arc<Mutex<EqualWarnings>>,
}

impl Screen {
    /// Returns a screen without a bar.
    pub(crate) fn new() -> Self {
        Self {
            bars: MultiProgress::new(),
            warnings: Arc::default(),
        }
    }

    /// Writes a warning, or counts it if equal ones were written before.
    pub(crate) fn warning(&self, label: &str, text: &str) {
        let lines = locked(&self.warnings).add(label, text, Instant::now());
        for line in &lines {
            self.line(line);
        }
    }

    /// Writes the numbers of warnings that were only counted.
    pub(crate) fn count_warnings(&self) {
        let lines = locked(&self.warnings).take();
        for line in &lines {
            self.line(line);
        }
    }

    /// Writes a line, above the bar if there is one. Escapes hidden characters, as [`terminal_text`] does.
    pub(crate) fn line(&self, text: &str) {
        self.write(&terminal_text(text));
    }

    /// Writes a JSON document on one line, above the bar if there is one.
    pub(crate) fn json_line(&self, value: &serde_json::Value) {
        self.write(&visible_json(&value.to_string()));
    }

    /// Writes a line of the log with colours. `tracing` escapes terminal codes of values and adds its own.
    pub(crate) fn log_line(&self, text: &str) {
        self.line(&text.replace("\u{1b}[", &OWN_CODE));
    }

    /// Writes a line of a log in JSON.
    pub(crate) fn json_log_line(&self, text: &str) {
        self.write(&visible_json(text));
    }

    fn write(&self, line: &str) {
        let line = format!("{line}\n");
        let write = || std::io::stderr().lock().write_all(line.as_bytes());
        // A closed stderr cannot be reported anywhere.
        let _ = self.bars.suspend(write);
    }

    /// Shows a bar below all lines.
    pub(crate) fn add_bar(&self, bar: ProgressBar) -> ProgressBar {
        self.bars.add(bar)
    }
}

/// Returns the codes that move the cursor to the top left and clear the terminal, for `status --watch`.
pub(crate) fn clear_code() -> String {
    format!("{0}H{0}2J", OWN_CODE.as_str())
}

/// Meaning of a piece of text, shown as a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tone {
    /// Success.
    Good,
    /// Needs attention.
    Warn,
    /// Failure.
    Bad,
    /// A name or heading.
    Strong,
    /// Less important.
    Faint,
}

/// Colours text for one stream, or leaves it plain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Palette {
    on: bool,
}

impl Palette {
    /// Never any colour.
    pub(crate) const PLAIN: Self = Self { on: false };

    /// Returns the palette for one stream. With `--color auto`, text has colours only on a terminal, and only if
    /// `NO_COLOR` is empty or unset and `TERM` is not `dumb`.
    pub(crate) fn choose(when: ColorChoice, is_terminal: bool) -> Self {
        let on = match when {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => is_terminal && !is_no_color() && !is_dumb_terminal(),
        };
        Self { on }
    }

    /// Returns whether it colours text at all.
    pub(crate) const fn is_on(self) -> bool {
        self.on
    }

    /// Returns the text in the colour of its tone. The codes become real ones in [`terminal_text`].
    pub(crate) fn paint(self, tone: Tone, text: impl std::fmt::Display) -> String {
        let code = match tone {
            Tone::Good => "32",
            Tone::Warn => "33",
            Tone::Bad => "31",
            Tone::Strong => "1",
            Tone::Faint => "2",
        };
        if self.on {
            format!("{0}{code}m{text}{0}0m", OWN_CODE.as_str())
        } else {
            text.to_string()
        }
    }
}

/// Returns the word before a warning, in the colours of stderr.
pub(crate) fn warning_label(palette: Palette) -> String {
    format!("{} ", palette.paint(Tone::Warn, "warning:"))
}

/// Returns whether the terminal cannot move its cursor.
pub(crate) fn is_dumb_terminal() -> bool {
    std::env::var_os("TERM").is_some_and(|term| term == "dumb")
}

fn is_no_color() -> bool {
    std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
}

#[cfg(test)]
mod tests {
    use super::{ColorChoice, Palette, Tone, clear_code, terminal_line, terminal_text};

    #[test]
    fn only_own_codes_reach_the_terminal() {
        let palette = Palette::choose(ColorChoice::Always, false);
        let hostile = "\u{1b}[32mok\u{1b}[0m\u{1b}]0;title\u{7}";
        let text = format!(
            "{}\n{}\u{202e}",
            palette.paint(Tone::Good, hostile),
            clear_code()
        );
        assert_eq!(
            terminal_text(&text),
            "\u{1b}[32m\\u{1b}[32mok\\u{1b}[0m\\u{1b}]0;title\\u{7}\u{1b}[0m\n\u{1b}[H\u{1b}[2J\\u{202e}"
        );
        let cell = palette.paint(Tone::Bad, "a\nb");
        assert_eq!(
            terminal_text(&terminal_line(&cell)),
            "\u{1b}[31ma b\u{1b}[0m"
        );
    }

    #[test]
    fn colour_is_used_only_where_it_is_wanted() {
        let always = Palette::choose(ColorChoice::Always, false);
        assert_eq!(
            terminal_text(&always.paint(Tone::Bad, "x")),
            "\u{1b}[31mx\u{1b}[0m"
        );
        let piped = Palette::choose(ColorChoice::Auto, false);
        assert_eq!(piped.paint(Tone::Bad, "x"), "x");
        assert_eq!(Palette::choose(ColorChoice::Never, true), Palette::PLAIN);
    }
}
