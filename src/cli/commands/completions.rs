//! `completions SHELL`: prints a completion script.

use clap::{Args, Command};
use clap_complete::Shell;

use crate::cli::output::streams;
use mocban_project::{ExitCode, ProjectResult};

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell
    pub(crate) shell: Shell,
}

pub(crate) fn completions(args: &CompletionsArgs, mut command: Command) -> ProjectResult<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "mocban", &mut script);
    streams::print(&String::from_utf8_lossy(&script))?;
    Ok(ExitCode::Done)
}
