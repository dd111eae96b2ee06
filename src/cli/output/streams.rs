//! Results on stdout.

use std::io::Write as _;

use super::screen::terminal_text;
use mocban_core::domain::visible_json;
use mocban_project::ProjectResult;

/// Writes a result to stdout and ends it with a line feed. Escapes hidden characters, as `terminal_text` does.
pub(crate) fn print(text: &str) -> std::io::Result<()> {
    write(&terminal_text(text))
}

/// Writes a value to stdout as one JSON document.
pub(crate) fn print_json(value: &impl serde::Serialize) -> ProjectResult<()> {
    print_json_text(&serde_json::to_string_pretty(value)?)?;
    Ok(())
}

/// Writes JSON to stdout. Hidden characters become JSON escapes.
pub(crate) fn print_json_text(text: &str) -> std::io::Result<()> {
    write(&visible_json(text))
}

fn write(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    if !text.ends_with('\n') {
        out.write_all(b"\n")?;
    }
    out.flush()
}
