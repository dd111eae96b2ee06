//! Results on stdout, messages on stderr.

use std::io::{IsTerminal, Write};

use super::exit::ExitCode;
use super::global::Global;
use super::screen::{Palette, Screen, Tone};

/// The two streams of a command.
#[derive(Debug, Clone)]
pub(super) struct Output {
    quiet: bool,
    json: bool,
    screen: Screen,
    /// Colours of stdout.
    pub(super) stdout: Palette,
    /// Colours of stderr.
    pub(super) stderr: Palette,
}

impl Output {
    /// Returns the streams with the colours that the flags ask for.
    pub(super) fn new(global: &Global, screen: Screen) -> Self {
        Self {
            quiet: global.quiet,
            json: global.json,
            screen,
            stdout: Palette::choose(global.color, std::io::stdout().is_terminal()),
            stderr: Palette::choose(global.color, std::io::stderr().is_terminal()),
        }
    }

    /// Writes a line to stderr, unless `-q` is given.
    pub(super) fn info(&self, text: &str) {
        if !self.quiet {
            self.screen.line(text);
        }
    }

    /// Writes a warning to stderr, also with `-q`.
    pub(super) fn warn(&self, text: &str) {
        let label = self.stderr.paint(Tone::Warn, "warning:");
        self.screen.line(&format!("{label} {text}"));
    }

    /// Writes why the command failed to stderr: a sentence, or an object with `--json`.
    pub(super) fn error(&self, text: &str, code: ExitCode) {
        if self.json {
            let object = serde_json::json!({
                "message_type": "exit_error", "code": code as u8, "message": text,
            });
            self.screen.line(&object.to_string());
        } else {
            let label = self.stderr.paint(Tone::Bad, "error:");
            self.screen.line(&format!("{label} {text}"));
        }
    }

    /// Suggests the next command on stderr, ready to be copied.
    pub(super) fn next(&self, command: &str) {
        if !self.json {
            let label = self.stderr.paint(Tone::Faint, "next:");
            self.info(&format!("{label} {command}"));
        }
    }
}

/// Writes a result to stdout and ends it with a line feed.
pub(super) fn print(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    if !text.ends_with('\n') {
        out.write_all(b"\n")?;
    }
    out.flush()
}

/// Writes a value to stdout as one JSON document.
pub(super) fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    print(&serde_json::to_string_pretty(value)?)?;
    Ok(())
}
