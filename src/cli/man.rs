//! `man DIR`: writes the manual pages, one per command.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::{Args, Command};

use super::context::{Context, shell_quoted};
use super::exit::ExitCode;
use mocban_store::{StagingFolder, rename_into_place};

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// The directory for the pages; created if it does not exist
    pub(super) dir: PathBuf,
}

pub(super) fn man(args: &ManArgs, command: Command, context: &Context) -> anyhow::Result<ExitCode> {
    let dir = args.dir.display();
    std::fs::create_dir_all(&args.dir).with_context(|| format!("cannot create {dir}"))?;
    write_pages(command, &args.dir)
        .with_context(|| format!("cannot write manual pages to {dir}"))?;
    context.info(&format!("the manual pages are in {dir}"));
    let page = args.dir.join("mocban.1");
    let page = shell_quoted(&page.to_string_lossy());
    context.next_command(&format!("man -l {page}"));
    Ok(ExitCode::Done)
}

/// Writes the pages to a staging folder first, so that each page is replaced as a whole.
fn write_pages(command: Command, dir: &Path) -> anyhow::Result<()> {
    let staging = StagingFolder::beside(&dir.join("mocban.1"))?;
    let pages = staging.path().join("pages");
    std::fs::create_dir(&pages)?;
    clap_mangen::generate_to(command, &pages)?;
    for page in std::fs::read_dir(&pages)? {
        let page = page?;
        rename_into_place(&page.path(), &dir.join(page.file_name()))?;
    }
    Ok(())
}
