//! `man DIR`: writes the manual pages, one per command.

use std::path::{Path, PathBuf};

use clap::{Args, Command};

use crate::cli::output::context::Context;
use mocban_core::domain::shell::shell_quoted;
use mocban_project::error::WithContext as _;
use mocban_project::files;
use mocban_project::own_files::{refuse_foreign_file, refuse_project_file};
use mocban_project::{ExitCode, ProjectResult};
use mocban_store::{StagingFolder, create_folders, rename_into_place};

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// The directory for the pages; created if it does not exist
    #[arg(required_unless_present = "output")]
    pub(crate) dir: Option<PathBuf>,
    /// The same as DIR
    #[arg(short, long, value_name = "DIR", conflicts_with = "dir")]
    pub(crate) output: Option<PathBuf>,
}

pub(crate) fn man(args: ManArgs, command: Command, context: &Context) -> ProjectResult<ExitCode> {
    let folder = args.dir.or(args.output).unwrap_or_default();
    let dir = folder.display();
    refuse_project_file(&folder)?;
    create_folders(&folder).with_context(|| format!("cannot create {dir}"))?;
    let failed = || format!("cannot write manual pages to {dir}");
    let staging = StagingFolder::beside(&folder.join("mocban.1")).with_context(failed)?;
    let pages = write_pages(command, staging.path()).with_context(failed)?;
    for page in &pages {
        refuse_foreign(page, &folder)?;
    }
    for page in &pages {
        let target = folder.join(page.file_name().unwrap_or_default());
        rename_into_place(page, &target).with_context(failed)?;
    }
    drop(staging);
    context.info(&format!("the manual pages are in {dir}"));
    let page = folder.join("mocban.1");
    let page = shell_quoted(&page.to_string_lossy());
    context.next_command(&format!("man -l {page}"));
    Ok(ExitCode::Done)
}

/// Writes the pages to a staging folder first, so that each page is replaced as a whole. Returns their paths.
fn write_pages(command: Command, staging: &Path) -> ProjectResult<Vec<PathBuf>> {
    let folder = staging.join("pages");
    std::fs::create_dir(&folder)?;
    clap_mangen::generate_to(command, &folder)?;
    let pages = std::fs::read_dir(&folder)?;
    let pages: std::io::Result<Vec<_>> = pages.map(|page| Ok(page?.path())).collect();
    Ok(pages?)
}

/// Refuses to replace a file that is not an earlier version of a page.
fn refuse_foreign(page: &Path, dir: &Path) -> ProjectResult<()> {
    let there = dir.join(page.file_name().unwrap_or_default());
    if files::small(&there)?.is_none() {
        return Ok(());
    }
    let new = files::small(page)?.unwrap_or_default();
    let is_ours = |earlier: &[u8]| title(&new).is_some_and(|name| title(earlier) == Some(name));
    refuse_foreign_file(&there, "a manual page of this program", is_ours)?;
    Ok(())
}

/// Returns the name in the title line of a manual page (`man(7)`), or `None` if the file has no such line.
fn title(page: &[u8]) -> Option<&[u8]> {
    let mut lines = page.split(|byte| *byte == b'\n');
    let title = lines.find_map(|line| line.strip_prefix(b".TH "))?;
    title.split(u8::is_ascii_whitespace).next()
}
