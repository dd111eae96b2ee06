//! `completions SHELL`: prints a completion script.

use clap::{Args, Command};
use clap_complete::Shell;

use super::output;
use mocban_project::exit::ExitCode;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell
    pub(super) shell: Shell,
}

pub(super) fn completions(
    args: &CompletionsArgs,
    mut command: Command,
) -> anyhow::Result<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "mocban", &mut script);
    output::print(&String::from_utf8(script)?)?;
    Ok(ExitCode::Done)
}
