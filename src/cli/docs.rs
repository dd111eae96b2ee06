//! `docs DIR`: writes the documentation as web pages.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;

use super::context::Context;
use super::exit::{ExitCode, Refusal};
use crate::documentation::web_files;
use crate::store::ReplacementFolder;

/// The first page.
const INDEX: &str = "index.html";

/// Arguments of `docs`.
#[derive(Debug, Args)]
pub(super) struct DocsArgs {
    /// The directory to write; pages that this command wrote there earlier are replaced
    #[arg(default_value = "mocban-docs")]
    pub(super) dir: PathBuf,
}

pub(super) fn docs(args: &DocsArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let shown = args.dir.display();
    let failed = || format!("cannot write the documentation to {shown}");
    refuse_foreign(&args.dir)?;
    let folder = ReplacementFolder::begin(&args.dir).with_context(failed)?;
    for (path, bytes) in web_files() {
        let path = folder.path().join(path);
        let parent = path.parent().unwrap_or(folder.path());
        fs::create_dir_all(parent).with_context(failed)?;
        fs::write(path, bytes).with_context(failed)?;
    }
    refuse_foreign(&args.dir)?;
    folder.finish().with_context(failed)?;
    let index = args.dir.join(INDEX);
    context.info(&format!("open {} in a browser", index.display()));
    Ok(ExitCode::Done)
}

/// Refuses a directory with files that this command does not write.
fn refuse_foreign(dir: &Path) -> anyhow::Result<()> {
    let shown = dir.display();
    let failed = || format!("cannot read {shown}");
    if !dir.try_exists().with_context(failed)? {
        return Ok(());
    }
    if !dir.is_dir() {
        return Err(Refusal::Usage(format!("{shown} is not a directory")).into());
    }
    let written = web_files();
    for entry in fs::read_dir(dir).with_context(failed)? {
        let name = entry.with_context(failed)?.file_name();
        let is_written = written
            .iter()
            .any(|(path, _)| Path::new(path).starts_with(&name));
        if !is_written {
            let name = Path::new(&name).display();
            let text = format!(
                "{shown} holds {name}, which is not part of the documentation; name another directory"
            );
            return Err(Refusal::Usage(text).into());
        }
    }
    Ok(())
}
