//! `docs DIR`: writes the documentation as web pages.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::output::context::Context;
use crate::documentation::web_files;
use mocban_project::error::WithContext as _;
use mocban_project::{ExitCode, ProjectResult, Refusal};
use mocban_store::ReplacementFolder;

/// The first page.
const INDEX: &str = "index.html";

/// Arguments of `docs`.
#[derive(Debug, Args)]
pub(crate) struct DocsArgs {
    /// The directory to write; pages that this command wrote there earlier are replaced
    #[arg(default_value = "mocban-docs")]
    pub(crate) dir: PathBuf,
}

pub(crate) fn docs(args: &DocsArgs, context: &Context) -> ProjectResult<ExitCode> {
    let (dir, shown) = (&args.dir, args.dir.display());
    let failed = || format!("cannot write the documentation to {shown}");
    let files = web_files();
    refuse_foreign(dir, &files)?;
    let folder = ReplacementFolder::begin(dir).with_context(failed)?;
    for (path, bytes) in &files {
        let path = folder.path().join(path);
        let parent = path.parent().unwrap_or(folder.path());
        fs::create_dir_all(parent).with_context(failed)?;
        fs::write(path, bytes).with_context(failed)?;
    }
    // Somebody may have put files there in the meantime.
    refuse_foreign(dir, &files)?;
    let leftover = folder.finish().with_context(failed)?;
    if let Some((path, error)) = leftover {
        let path = path.display();
        context.warn(&format!(
            "the earlier documentation was replaced but could not be removed from {path}: {error}"
        ));
    }
    context.info(&format!("open {} in a browser", dir.join(INDEX).display()));
    Ok(ExitCode::Done)
}

/// Refuses a directory that holds anything but files of the documentation.
fn refuse_foreign(dir: &Path, files: &[(String, Vec<u8>)]) -> ProjectResult<()> {
    let shown = dir.display();
    if !dir
        .try_exists()
        .with_context(|| format!("cannot read {shown}"))?
    {
        return Ok(());
    }
    if !dir.is_dir() {
        return Err(Refusal::Usage(format!("{shown} is not a directory")).into());
    }
    let Some(foreign) = foreign_file(dir, Path::new(""), files)? else {
        return Ok(());
    };
    let foreign = foreign.display();
    let text = format!(
        "{shown} holds {foreign}, which is not part of the documentation; name another directory"
    );
    Err(Refusal::Usage(text).into())
}

/// Returns a file, link or other entry below `dir/inner` that is not part of the documentation, as a path below `dir`.
fn foreign_file(
    dir: &Path,
    inner: &Path,
    files: &[(String, Vec<u8>)],
) -> ProjectResult<Option<PathBuf>> {
    let folder = dir.join(inner);
    let failed = || format!("cannot read {}", folder.display());
    for entry in fs::read_dir(&folder).with_context(failed)? {
        let entry = entry.with_context(failed)?;
        let path = inner.join(entry.file_name());
        let kind = entry.file_type().with_context(failed)?;
        // A folder of the documentation has few levels; a foreign one is not searched.
        let is_folder = kind.is_dir()
            && files
                .iter()
                .any(|(file, _)| Path::new(file).starts_with(&path));
        let foreign = if is_folder {
            foreign_file(dir, &path, files)?
        } else if kind.is_file() && files.iter().any(|(file, _)| Path::new(file) == path) {
            None
        } else {
            Some(path)
        };
        if foreign.is_some() {
            return Ok(foreign);
        }
    }
    Ok(None)
}
