//! Data to stdout, talk to stderr, colour where a person reads it.

use std::io::{IsTerminal, Write};

use super::args::{ColorWhen, Global};
use super::exit::ExitCode;
use super::progress::Screen;

/// Meaning of a piece of text, shown by colour where there is colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    /// Went well.
    Good,
    /// Needs a look.
    Warn,
    /// Went wrong.
    Bad,
    /// A name or heading.
    Strong,
    /// Less important.
    Faint,
}

impl Tone {
    const fn code(self) -> &'static str {
        match self {
            Self::Good => "32",
            Self::Warn => "33",
            Self::Bad => "31",
            Self::Strong => "1",
            Self::Faint => "2",
        }
    }
}

/// Paints text for one stream, or leaves it plain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Palette {
    on: bool,
}

impl Palette {
    /// Decides for one stream: `--color`, then `NO_COLOR`, then whether a person reads it.
    pub(super) fn choose(when: ColorWhen, is_terminal: bool) -> Self {
        let on = match when {
            ColorWhen::Always => true,
            ColorWhen::Never => false,
            ColorWhen::Auto => is_terminal && !no_color() && !dumb_terminal(),
        };
        Self { on }
    }

    /// Never any colour.
    pub(super) const PLAIN: Self = Self { on: false };

    /// Whether it paints at all.
    pub(super) const fn is_on(self) -> bool {
        self.on
    }

    /// The text in its tone.
    pub(super) fn paint(self, tone: Tone, text: impl std::fmt::Display) -> String {
        if self.on {
            format!("\u{1b}[{}m{text}\u{1b}[0m", tone.code())
        } else {
            text.to_string()
        }
    }
}

/// Whether the terminal can move its cursor.
pub(super) fn dumb_terminal() -> bool {
    std::env::var_os("TERM").is_some_and(|term| term == "dumb")
}

fn no_color() -> bool {
    std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
}

/// The two streams of a command.
#[derive(Debug, Clone)]
pub(super) struct Output {
    quiet: bool,
    json: bool,
    screen: Screen,
    /// Paints stdout.
    pub(super) out: Palette,
    /// Paints stderr.
    pub(super) err: Palette,
}

impl Output {
    /// Streams as the flags ask.
    pub(super) fn new(global: &Global, screen: Screen) -> Self {
        Self {
            quiet: global.quiet,
            json: global.json,
            screen,
            out: Palette::choose(global.color, std::io::stdout().is_terminal()),
            err: Palette::choose(global.color, std::io::stderr().is_terminal()),
        }
    }

    /// A line on stderr; `-q` keeps it back.
    pub(super) fn say(&self, text: &str) {
        if !self.quiet {
            self.screen.line(text);
        }
    }

    /// A warning on stderr, kept back by nothing.
    pub(super) fn warn(&self, text: &str) {
        self.screen.line(&format!(
            "{} {text}",
            self.err.paint(Tone::Warn, "warning:")
        ));
    }

    /// Why a command ends without an answer: a sentence, or with `--json` an object on stderr.
    pub(super) fn error(&self, text: &str, code: ExitCode) {
        if self.json {
            let object = serde_json::json!({
                "message_type": "exit_error", "code": code as u8, "message": text,
            });
            self.screen.line(&object.to_string());
        } else {
            self.screen
                .line(&format!("{} {text}", self.err.paint(Tone::Bad, "error:")));
        }
    }

    /// A command to go on with, ready to be copied.
    pub(super) fn next(&self, command: &str) {
        if self.json {
            return;
        }
        self.say(&format!(
            "{} {command}",
            self.err.paint(Tone::Faint, "next:")
        ));
    }
}

/// Writes a command's answer to stdout, with a line end.
///
/// # Errors
/// When stdout is closed.
pub(super) fn print(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    if !text.ends_with('\n') {
        out.write_all(b"\n")?;
    }
    out.flush()
}

/// Writes a value as one JSON document to stdout.
///
/// # Errors
/// When stdout is closed.
pub(super) fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    print(&serde_json::to_string_pretty(value)?)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{ColorWhen, Palette, Tone};

    #[test]
    fn colour_only_where_it_is_asked_for() {
        let always = Palette::choose(ColorWhen::Always, false);
        assert_eq!(always.paint(Tone::Bad, "x"), "\u{1b}[31mx\u{1b}[0m");
        let piped = Palette::choose(ColorWhen::Auto, false);
        assert_eq!(piped.paint(Tone::Bad, "x"), "x");
        assert_eq!(Palette::choose(ColorWhen::Never, true), Palette::PLAIN);
    }
}
