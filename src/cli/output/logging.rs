//! The log: `tracing` events on stderr or in a file, as text or JSON.

use std::fs::OpenOptions;
use std::io::IsTerminal as _;
use std::sync::Mutex;

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::format::{Format, Writer};
use tracing_subscriber::fmt::writer::{BoxMakeWriter, MakeWriter};
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;

use super::context::indented;
use super::screen::{Palette, Screen, warning_label};
use crate::cli::input::global::{Global, LogFormat};
use mocban_project::ProjectResult;
use mocban_project::error::WithContext as _;
use mocban_project::files;
use mocban_project::own_files::{refuse_foreign_file, refuse_project_file};

/// Starts the log. `RUST_LOG`, if set, overrides `-v` and `-q`.
pub(crate) fn start(global: &Global, screen: &Screen) -> ProjectResult<()> {
    let colours = Palette::choose(global.color, std::io::stderr().is_terminal());
    // A log has times and levels.
    let is_log = global.verbose > 0 || std::env::var_os("RUST_LOG").is_some();
    let (writer, to_file) = writer(global, screen, colours, !is_log)?;
    let level = level(global.verbose, global.quiet, to_file);
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(!to_file && colours.is_on())
        .with_writer(writer);
    let format = EventFormat {
        has_plain_warnings: !to_file && !is_log,
        log: Format::default().with_target(false),
    };
    // Only a test starts a second log in one process; the first one stays.
    let _ = match global.log_format {
        LogFormat::Text => builder.event_format(format).try_init(),
        LogFormat::Json => builder.json().flatten_event(true).try_init(),
    };
    Ok(())
}

fn writer(
    global: &Global,
    screen: &Screen,
    colours: Palette,
    has_plain_warnings: bool,
) -> ProjectResult<(BoxMakeWriter, bool)> {
    let Some(path) = &global.log_file else {
        let writer = LogWriter {
            screen: screen.clone(),
            format: global.log_format,
            colours,
            has_plain_warnings,
            is_warning: false,
        };
        return Ok((BoxMakeWriter::new(writer), false));
    };
    refuse_project_file(path)?;
    refuse_foreign_file(path, "a log file of this program", is_log_text)?;
    files::create_parent(path)?;
    let file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)
        .with_context(|| format!("cannot open the log file {}", path.display()))?;
    Ok((BoxMakeWriter::new(Mutex::new(file)), true))
}

/// Returns whether a file begins like a log: with a time, in JSON as the first field.
fn is_log_text(bytes: &[u8]) -> bool {
    let time = bytes.strip_prefix(b"{\"timestamp\":\"").unwrap_or(bytes);
    let Some(day) = time.get(..11) else {
        return false;
    };
    let is_day = |(i, byte): (usize, &u8)| match i {
        4 | 7 => *byte == b'-',
        10 => *byte == b'T',
        _ => byte.is_ascii_digit(),
    };
    day.iter().enumerate().all(is_day)
}

/// The fields of a warning.
#[derive(Debug, Default)]
struct PlainWarning {
    message: String,
    error: String,
    /// Names and values of other fields.
    others: Vec<String>,
}

impl PlainWarning {
    /// Returns a sentence such as `1.ply: 5 vertices are left out (pair b04-0117)`.
    fn text(&self) -> String {
        let error = if self.error.is_empty() {
            String::new()
        } else {
            format!(": {}", self.error)
        };
        let others = if self.others.is_empty() {
            String::new()
        } else {
            format!(" ({})", self.others.join(", "))
        };
        format!("{}{error}{others}", self.message)
    }
}

impl Visit for PlainWarning {
    fn record_str(&mut self, field: &Field, value: &str) {
        self.record_debug(field, &format_args!("{value}"));
    }

    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        match field.name() {
            "message" => self.message = format!("{value:?}"),
            "error" => self.error = format!("{value:?}"),
            name => self.others.push(format!("{name} {value:?}")),
        }
    }
}

/// Writes log lines to the screen.
#[derive(Debug, Clone)]
struct LogWriter {
    screen: Screen,
    format: LogFormat,
    colours: Palette,
    /// Whether warnings are written like those of the commands, of equal ones only the first.
    has_plain_warnings: bool,
    /// Whether the event is a warning.
    is_warning: bool,
}

impl MakeWriter<'_> for LogWriter {
    type Writer = Self;

    fn make_writer(&self) -> Self {
        self.clone()
    }

    fn make_writer_for(&self, meta: &Metadata<'_>) -> Self {
        Self {
            is_warning: *meta.level() == Level::WARN,
            ..self.clone()
        }
    }
}

/// Formats events. Unless a log was asked for, warnings have no time and no level.
struct EventFormat {
    has_plain_warnings: bool,
    log: Format,
}

impl<S, N> FormatEvent<S, N> for EventFormat
where
    S: Subscriber + for<'l> LookupSpan<'l>,
    N: for<'w> FormatFields<'w> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> std::fmt::Result {
        if self.has_plain_warnings && *event.metadata().level() == Level::WARN {
            let mut warning = PlainWarning::default();
            event.record(&mut warning);
            return writeln!(writer, "{}", warning.text());
        }
        self.log.format_event(context, writer, event)
    }
}

impl std::io::Write for LogWriter {
    /// Writes one event, which is passed in one call.
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let text = String::from_utf8_lossy(bytes);
        let line = text.trim_end_matches('\n');
        match self.format {
            LogFormat::Text if self.has_plain_warnings && self.is_warning => {
                let label = warning_label(self.colours);
                self.screen.warning(&label, &indented(line));
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
    use std::sync::{Arc, Mutex};

    use super::{EventFormat, Format, is_log_text, level};

    /// Keeps what is written.
    #[derive(Debug, Clone, Default)]
    struct Written(Arc<Mutex<Vec<u8>>>);

    impl std::io::Write for Written {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().expect("no panic").write(bytes)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn warnings_of_the_log_are_sentences_unless_a_log_was_asked_for() {
        let lines = |has_plain_warnings| {
            let (written, log) = (Written::default(), Format::default().with_target(false));
            let writer = written.clone();
            let subscriber = tracing_subscriber::fmt()
                .with_ansi(false)
                .with_writer(move || writer.clone())
                .event_format(EventFormat {
                    has_plain_warnings,
                    log,
                });
            tracing::subscriber::with_default(subscriber.finish(), || {
                let (pair, error) = ("b1", "it is full");
                tracing::warn!(%pair, times = 2, "1.ply: 5 vertices are left out");
                tracing::warn!(%error, "not stored");
                tracing::info!("the run ends");
            });
            let bytes = written.0.lock().expect("no panic").clone();
            String::from_utf8(bytes).expect("text")
        };
        let plain = lines(true);
        let plain: Vec<&str> = plain.lines().collect();
        let sentence = "1.ply: 5 vertices are left out (pair b1, times 2)";
        assert_eq!(plain[..2], [sentence, "not stored: it is full"]);
        assert!(plain[2].contains("INFO the run ends"), "{plain:?}");
        let log = lines(false);
        assert!(log.contains("WARN 1.ply: 5 vertices"), "{log}");
        assert!(log.contains("pair=b1"), "{log}");
    }

    #[test]
    fn lists_are_no_logs() {
        for (text, is_log) in [
            ("2026-11-30T08:14:24.123456Z  INFO the run ends\n", true),
            (
                "{\"timestamp\":\"2026-11-30T08:14:24.1Z\",\"level\":\"INFO\"}\n",
                true,
            ),
            ("id,mesh,print\n2026-11-30,a.stl,a.png\n", false),
            ("{\"id\":\"a\"}\n", false),
            ("2026-11-30,a.stl,a.png\n", false),
        ] {
            assert_eq!(is_log_text(text.as_bytes()), is_log, "{text}");
        }
    }

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
