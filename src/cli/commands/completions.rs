//! `completions SHELL`: prints a completion script, and the names of pairs and blocks for it.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Command};
use clap_complete::Shell;

use crate::cli::input::name_request::NameRequest;
use crate::cli::output::completion_script::completion_script;
use crate::cli::output::streams;
use mocban_project::details::names_with_prefix;
use mocban_project::files;
use mocban_project::location::Location;
use mocban_project::own_files::{refuse_foreign_script, refuse_project_file};
use mocban_project::script_checksum::with_checksum;
use mocban_project::{ExitCode, ProjectResult};
use mocban_system::failpoint::time_scale;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell. The first lines of its script say where it goes
    pub(crate) shell: Shell,
    /// The file to write [default: stdout]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// The words of an unfinished command line. Instead of the script, the names that its last word may be are printed
    #[arg(last = true, hide = true)]
    pub(crate) words: Vec<String>,
}

/// Longest time for names. The user waits for them.
const MAX_WAIT: Duration = Duration::from_secs(1);
/// Largest number of names.
const MAX_NAMES: usize = 200;

pub(crate) async fn completions(
    args: &CompletionsArgs,
    mut command: Command,
) -> ProjectResult<ExitCode> {
    if !args.words.is_empty() {
        command.build();
        // A shell has no place for an error.
        if let Some(names) = names(&command, &args.words).await {
            streams::print(&names.join("\n"))?;
        }
        return Ok(ExitCode::Done);
    }
    let script = completion_script(args.shell, &mut command);
    let Some(path) = &args.output else {
        streams::print(&script)?;
        return Ok(ExitCode::Done);
    };
    refuse_project_file(path)?;
    let first_line = |text: &str| text.lines().next().map(str::to_owned);
    let is_ours =
        |earlier: &[u8]| first_line(&String::from_utf8_lossy(earlier)) == first_line(&script);
    let what = format!("a completion script for {}", args.shell);
    refuse_foreign_script(path, &what, is_ours)?;
    files::write_output(path, with_checksum(&script).as_bytes(), true)?;
    Ok(ExitCode::Done)
}

/// Returns the names that the last word may be, or `None` if it is none or they cannot be read in time.
async fn names(command: &Command, words: &[String]) -> Option<Vec<String>> {
    let request = NameRequest::of(command, words)?;
    let mut location = Location::new(request.directory.as_deref().unwrap_or("."));
    location.catalog = request.catalog;
    location.config = request.config;
    let names = names_with_prefix(&location, &request.prefix, request.is_block, MAX_NAMES);
    let longest = MAX_WAIT * time_scale("MOCBAN_LIMIT_FACTOR");
    let names = tokio::time::timeout(longest, names).await;
    names.ok()?.ok().filter(|names| !names.is_empty())
}
