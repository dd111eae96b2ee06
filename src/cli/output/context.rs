//! The context of a command: the project, its settings and the output streams.

use std::ffi::OsString;
use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use super::screen::{Palette, Screen, Tone, warning_label};
use super::streams;
use crate::cli::input::global::Global;
use mocban_catalog::SetApart;
use mocban_core::domain::shell::shell_quoted;
use mocban_project::location::Location;
use mocban_project::{ExitCode, ProjectResult};

/// Longer lines of warnings and errors are cut. A line still has room for the longest possible path (4,096 bytes).
const MAX_LINE_CHARS: usize = 6000;

/// The global flags and the state derived from them.
#[derive(Debug, Clone)]
pub(crate) struct Context {
    pub(crate) global: Global,
    pub(crate) screen: Screen,
    /// Colours of stdout.
    pub(crate) stdout: Palette,
    /// Colours of stderr.
    pub(crate) stderr: Palette,
    program: String,
    /// The project.
    pub(crate) location: Location,
}

impl Context {
    /// Builds the context from the flags and the name by which the program was called.
    pub(crate) fn new(global: Global, program: Option<&OsString>) -> Self {
        Self {
            screen: Screen::new(),
            stdout: Palette::choose(global.color, std::io::stdout().is_terminal()),
            stderr: Palette::choose(global.color, std::io::stderr().is_terminal()),
            program: program_name(program),
            location: location(&global),
            global,
        }
    }

    /// Returns the same context for another project directory.
    pub(crate) fn at(&self, dir: &Path) -> Self {
        let mut context = self.clone();
        context.global.directory = Some(dir.to_owned());
        context.location = self.location.at(dir);
        context
    }

    /// Returns a copy without `--config` and `--set`, for use after their settings were saved in the project's file.
    pub(crate) fn without_setting_flags(&self) -> Self {
        let mut context = self.clone();
        context.global.config = None;
        context.global.set.clear();
        context.location = self.location.with_saved_settings();
        context
    }

    /// Writes a line to stderr, unless `-q` is given.
    pub(crate) fn info(&self, text: &str) {
        if !self.global.quiet {
            self.screen.count_warnings();
            self.screen.line(&indented(text));
        }
    }

    /// Writes a warning to stderr, also with `-q`. Of equal ones, only the first few are written, unless `-v` is given.
    pub(crate) fn warn(&self, text: &str) {
        let label = warning_label(self.stderr);
        if self.global.verbose > 0 {
            self.screen.line(&format!("{label}{}", indented(text)));
        } else {
            self.screen.warning(&label, &indented(text));
        }
    }

    /// Writes an error message to stderr, as text or, with `--json`, as a JSON object.
    pub(crate) fn error(&self, text: &str, code: ExitCode) {
        self.screen.count_warnings();
        if self.global.json {
            let object = json!({"message_type": "exit_error", "code": code as u8, "message": text});
            self.screen.json_line(&object);
        } else {
            let label = self.stderr.paint(Tone::Bad, "error:");
            self.screen.line(&format!("{label} {}", indented(text)));
        }
    }

    /// Suggests the next command for this project on stderr. The text can be copied into a shell.
    pub(crate) fn next(&self, tail: &str) {
        self.next_command(&self.command(tail));
    }

    /// Suggests the next command as given.
    pub(crate) fn next_command(&self, command: &str) {
        if !self.global.json {
            let label = self.stderr.paint(Tone::Faint, "next:");
            self.info(&format!("{label} {command}"));
        }
    }

    /// Writes a result to stdout: as text, or as a JSON document with `--json`.
    pub(crate) fn print(
        &self,
        value: &impl Serialize,
        text: impl FnOnce() -> String,
    ) -> ProjectResult<()> {
        if self.global.json {
            streams::print_json(value)
        } else {
            Ok(streams::print(&text())?)
        }
    }

    /// Writes a JSON document to stdout with `--json`.
    pub(crate) fn print_json(&self, value: &impl Serialize) -> ProjectResult<()> {
        if self.global.json {
            streams::print_json(value)?;
        }
        Ok(())
    }

    /// Warns about damaged rows that the output does not include.
    pub(crate) fn warn_about_set_apart(&self, found: &SetApart) {
        if let Some(sentence) = found.sentence() {
            self.warn(&sentence);
        }
    }

    /// Returns a command for this project with the same settings. The text can be copied into a shell.
    pub(crate) fn command(&self, tail: &str) -> String {
        let mut words = vec![self.program.clone()];
        if let Some(dir) = &self.global.directory {
            words.extend(["-C".to_owned(), shell_quoted(&dir.to_string_lossy())]);
        }
        if let Some(config) = &self.global.config {
            words.extend(["--config".to_owned(), shell_quoted(config)]);
        }
        if let Some(url) = &self.global.catalog {
            words.extend(["--catalog".to_owned(), shell_quoted(url)]);
        }
        for set in &self.global.set {
            words.extend(["--set".to_owned(), shell_quoted(set)]);
        }
        words.push(tail.to_owned());
        words.join(" ")
    }

    /// Returns a command that needs no project.
    pub(crate) fn program_with(&self, tail: &str) -> String {
        format!("{} {tail}", self.program)
    }
}

/// Returns the project that the flags name.
fn location(global: &Global) -> Location {
    let dir = global.directory.clone();
    let mut location = Location::new(dir.unwrap_or_else(|| PathBuf::from(".")));
    location.catalog.clone_from(&global.catalog);
    location.config.clone_from(&global.config);
    location.sets.clone_from(&global.set);
    location
}

/// Indents the lines after the first, so that a line break in the name of a file cannot imitate another message. Cuts
/// lines that are longer than `MAX_LINE_CHARS`.
pub(super) fn indented(text: &str) -> String {
    let shown = |line: &str| match line.char_indices().nth(MAX_LINE_CHARS) {
        Some((end, _)) => format!("{}...", &line[..end]),
        None => line.to_owned(),
    };
    let indented = |line: &str| {
        shown(&if line.starts_with(' ') {
            line.to_owned()
        } else {
            format!("  {line}")
        })
    };
    let (first, rest) = text.split_once('\n').unwrap_or((text, ""));
    let lines = std::iter::once(shown(first)).chain(rest.lines().map(indented));
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns the path by which the program was called, or `mocban` if the shell found it through `PATH`.
fn program_name(called: Option<&OsString>) -> String {
    let called = called.map(|name| name.to_string_lossy().into_owned());
    match called {
        Some(path) if path.contains('/') => shell_quoted(&path),
        Some(_) | None => "mocban".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::indented;

    #[test]
    fn a_message_cannot_imitate_the_next_line() {
        assert_eq!(indented("a\nnext: b\n  c"), "a\n  next: b\n  c");
        assert_eq!(indented("a"), "a");
        assert_eq!(indented(&"a".repeat(7000)).len(), super::MAX_LINE_CHARS + 3);
    }
}
