//! The log: `tracing` events on stderr or in a file, as text or JSON.

use std::fs::OpenOptions;
use std::io::IsTerminal as _;
use std::sync::Mutex;

use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::writer::BoxMakeWriter;

use super::screen::{Palette, Screen};
use crate::cli::input::global::{Global, LogFormat};
use mocban_core::domain::FileKind;
use mocban_lists::manifest::is_named_like_input;
use mocban_project::error::WithContext as _;
use mocban_project::files;
use mocban_project::own_files::refuse_project_file;
use mocban_project::{ProjectResult, Refusal};

/// Starts the log. `RUST_LOG`, if set, overrides `-v` and `-q`.
pub(crate) fn start(global: &Global, screen: &Screen) -> ProjectResult<()> {
    let colours = Palette::choose(global.color, std::io::stderr().is_terminal());
    let (writer, to_file) = writer(global, screen, colours)?;
    let level = level(global.verbose, global.quiet, to_file);
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(!to_file && colours.is_on())
        .with_writer(writer);
    // Only a test starts a second log in one process; the first one stays.
    let _ = match global.log_format {
        LogFormat::Text => builder.with_target(false).try_init(),
        LogFormat::Json => builder.json().flatten_event(true).try_init(),
    };
    Ok(())
}

fn writer(
    global: &Global,
    screen: &Screen,
    colours: Palette,
) -> ProjectResult<(BoxMakeWriter, bool)> {
    let Some(path) = &global.log_file else {
        let writer = LogWriter {
            screen: screen.clone(),
            format: global.log_format,
            colours,
            counts_equal: global.verbose == 0,
        };
        return Ok((BoxMakeWriter::new(move || writer.clone()), false));
    };
    refuse_project_file(path)?;
    // Which files are inputs of the project is not known yet.
    let is_named_like_input = is_named_like_input(path) && path.exists();
    if is_named_like_input || files::kind(path).is_some_and(|kind| kind != FileKind::Text) {
        let text = format!(
            "{} is not a log file; name another file for the log",
            path.display()
        );
        return Err(Refusal::Usage(text).into());
    }
    files::create_parent(path)?;
    let file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)
        .with_context(|| format!("cannot open the log file {}", path.display()))?;
    Ok((BoxMakeWriter::new(Mutex::new(file)), true))
}

/// Writes log lines to the screen.
#[derive(Debug, Clone)]
struct LogWriter {
    screen: Screen,
    format: LogFormat,
    colours: Palette,
    /// Whether only the first of equal warnings is written.
    counts_equal: bool,
}

impl std::io::Write for LogWriter {
    /// Writes one event, which is passed in one call.
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let text = String::from_utf8_lossy(bytes);
        let line = text.trim_end_matches('\n');
        match self.format {
            LogFormat::Text if self.counts_equal && line.contains("WARN") => {
                self.screen.log_warning(line);
            }
            LogFormat::Text if self.colours.is_on() => self.screen.log_line(line),
            LogFormat::Text => self.screen.line(line),
            LogFormat::Json => self.screen.json_log_line(line),
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Returns the log filter. Without `-v`, a log file gets more messages than the terminal.
const fn level(verbose: u8, quiet: bool, to_file: bool) -> &'static str {
    match (verbose, to_file, quiet) {
        (0, false, true) => "mocban=error",
        (0, false, false) => "mocban=warn",
        (0, true, _) | (1, ..) => "mocban=info",
        (2.., ..) => "mocban=debug,sqlx=info",
    }
}

#[cfg(test)]
mod tests {
    use super::level;

    #[test]
    fn each_v_logs_more_and_a_file_more_than_the_terminal() {
        assert_eq!(level(0, true, false), "mocban=error");
        assert_eq!(level(0, false, false), "mocban=warn");
        for quiet in [false, true] {
            assert_eq!(level(0, quiet, true), "mocban=info");
            for to_file in [false, true] {
                assert_eq!(level(1, quiet, to_file), "mocban=info");
                for times in [2, 3, u8::MAX] {
                    assert_eq!(level(times, quiet, to_file), "mocban=debug,sqlx=info");
                }
            }
        }
    }
}
