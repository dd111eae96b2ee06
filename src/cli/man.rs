//! `man DIR`: the manual pages, one a command.

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;

use super::args;
use super::context::Context;
use super::exit::ExitCode;

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Where the pages go; made where it is missing
    pub(super) dir: PathBuf,
}

pub(super) fn man(args: &ManArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let dir = args.dir.display();
    std::fs::create_dir_all(&args.dir).with_context(|| format!("cannot make {dir}"))?;
    clap_mangen::generate_to(args::command(), &args.dir)
        .with_context(|| format!("cannot write manual pages to {dir}"))?;
    context.output.say(&format!("manual pages are in {dir}"));
    let page = args.dir.join("mocban.1");
    let page = super::context::quoted(&page.to_string_lossy());
    context.output.next(&format!("man -l {page}"));
    Ok(ExitCode::Done)
}
