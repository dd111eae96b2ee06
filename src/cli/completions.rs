//! `completions SHELL`: a completion script on stdout.

use clap::Args;
use clap_complete::Shell;

use super::args;
use super::exit::ExitCode;
use super::output;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell
    pub(super) shell: Shell,
}

pub(super) fn completions(args: &CompletionsArgs) -> anyhow::Result<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut args::command(), "mocban", &mut script);
    output::print(&String::from_utf8(script)?)?;
    Ok(ExitCode::Done)
}
