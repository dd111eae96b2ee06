//! Writes messages, log and progress bar to stderr, and colours text.

use std::io::Write;

use clap::ColorChoice;
use indicatif::{MultiProgress, ProgressBar};

/// The stderr stream. Messages, log and progress bar share it, so that no line overwrites the bar.
#[derive(Debug, Clone)]
pub(super) struct Screen(MultiProgress);

impl Screen {
    /// Returns a screen without a bar.
    pub(super) fn new() -> Self {
        Self(MultiProgress::new())
    }

    /// Writes a line, above the bar if there is one.
    pub(super) fn line(&self, text: &str) {
        // A closed stderr cannot be reported anywhere.
        let _ = self.clone().write_all(format!("{text}\n").as_bytes());
    }

    /// Shows a bar below all lines.
    pub(super) fn add_bar(&self, bar: ProgressBar) -> ProgressBar {
        self.0.add(bar)
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

/// Moves the cursor to the top left and clears the terminal, for `status --watch`.
pub(super) const CLEAR: &str = "\u{1b}[H\u{1b}[2J";

/// Meaning of a piece of text, shown as a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
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
pub(super) struct Palette {
    on: bool,
}

impl Palette {
    /// Never any colour.
    pub(super) const PLAIN: Self = Self { on: false };

    /// Returns the palette for one stream. `--color always` and `--color never` decide alone. With `auto`, text has
    /// colours on a terminal unless `NO_COLOR` is set or `TERM` is `dumb`.
    pub(super) fn choose(when: ColorChoice, is_terminal: bool) -> Self {
        let on = match when {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => is_terminal && !is_no_color() && !is_dumb_terminal(),
        };
        Self { on }
    }

    /// Returns whether it colours text at all.
    pub(super) const fn is_on(self) -> bool {
        self.on
    }

    /// Returns the text in the colour of its tone.
    pub(super) fn paint(self, tone: Tone, text: impl std::fmt::Display) -> String {
        let code = match tone {
            Tone::Good => "32",
            Tone::Warn => "33",
            Tone::Bad => "31",
            Tone::Strong => "1",
            Tone::Faint => "2",
        };
        if self.on {
            format!("\u{1b}[{code}m{text}\u{1b}[0m")
        } else {
            text.to_string()
        }
    }
}

/// Returns whether the terminal cannot move its cursor.
pub(super) fn is_dumb_terminal() -> bool {
    std::env::var_os("TERM").is_some_and(|term| term == "dumb")
}

fn is_no_color() -> bool {
    std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
}

#[cfg(test)]
mod tests {
    use super::{ColorChoice, Palette, Tone};

    #[test]
    fn colour_is_used_only_where_it_is_wanted() {
        let always = Palette::choose(ColorChoice::Always, false);
        assert_eq!(always.paint(Tone::Bad, "x"), "\u{1b}[31mx\u{1b}[0m");
        let piped = Palette::choose(ColorChoice::Auto, false);
        assert_eq!(piped.paint(Tone::Bad, "x"), "x");
        assert_eq!(Palette::choose(ColorChoice::Never, true), Palette::PLAIN);
    }
}
