//! Flags that every command takes.

use std::path::PathBuf;

use clap::builder::{PathBufValueParser, TypedValueParser as _};
use clap::{ArgAction, Args, ColorChoice, ValueEnum};

use mocban_project::input_paths::is_windows_path;

/// Parses the project's directory. Refuses a path of a Windows computer elsewhere: a folder with such a name would be
/// created in the current one.
fn project_folder(path: PathBuf) -> Result<PathBuf, String> {
    if is_windows_path(&path) {
        return Err(
            "this is a path of a Windows computer; write the path that the folder has here"
                .to_owned(),
        );
    }
    Ok(path)
}

/// Flags of every command.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Global options")]
pub(crate) struct Global {
    /// The project's directory [default: the current one]
    #[arg(short = 'C', value_name = "DIR", global = true, value_parser = PathBufValueParser::new().try_map(project_folder))]
    pub(crate) directory: Option<PathBuf>,
    /// Read settings from this file instead of the project's mocban.toml; "default" and "paper" are built in
    #[arg(long, value_name = "FILE", global = true)]
    pub(crate) config: Option<String>,
    /// Override one setting, such as run.workers=2; may be repeated
    #[arg(long, value_name = "SECTION.KEY=VALUE", global = true, action = ArgAction::Append)]
    pub(crate) set: Vec<String>,
    /// Address of the catalog in PostgreSQL, such as <postgres://me@db.example/lab> [default: storage.catalog, or the
    /// file catalog.sqlite in the project]
    #[arg(long, value_name = "URL", global = true)]
    pub(crate) catalog: Option<String>,
    /// Print only warnings and errors
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Log more: -v also what a run does, such as failures and retries, as every log file has; -vv also claims, stages and waits
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub(crate) verbose: u8,
    /// Print the result as JSON on stdout
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// When to use colour: auto, always or never
    #[arg(
        long,
        global = true,
        value_name = "WHEN",
        default_value = "auto",
        hide_possible_values = true
    )]
    pub(crate) color: ColorChoice,
    /// Format of the log: text or json
    #[arg(
        long,
        global = true,
        value_name = "FORMAT",
        default_value = "text",
        hide_possible_values = true
    )]
    pub(crate) log_format: LogFormat,
    /// Append the log to this file instead of printing it on stderr
    #[arg(long, value_name = "FILE", global = true)]
    pub(crate) log_file: Option<PathBuf>,
    /// How a run shows its progress on stderr: auto, bar, plain, json or none
    #[arg(
        long,
        global = true,
        value_name = "MODE",
        default_value = "auto",
        hide_possible_values = true
    )]
    pub(crate) progress: ProgressMode,
}

/// Format of the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum LogFormat {
    /// Lines for people.
    Text,
    /// One JSON object per line.
    Json,
}

/// How a run shows its progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProgressMode {
    /// A bar on a terminal, plain lines elsewhere.
    Auto,
    /// A bar.
    Bar,
    /// One line every ten seconds or five per cent.
    Plain,
    /// One JSON object per event.
    Json,
    /// Nothing.
    None,
}
