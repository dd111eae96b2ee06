//! `docs DIR`: writes the documentation as web pages.

use std::path::PathBuf;

use clap::Args;

use crate::cli::output::context::Context;
use crate::documentation::web_files;
use mocban_project::generated_folder::GeneratedFolder;
use mocban_project::{ExitCode, ProjectResult};

/// The first page.
const INDEX: &str = "index.html";
/// The directory that is written if none is named.
const DEFAULT_DIR: &str = "mocban-docs";

/// Arguments of `docs`.
#[derive(Debug, Args)]
pub(crate) struct DocsArgs {
    /// The directory to write; pages that this command wrote there earlier are replaced [default: mocban-docs]
    pub(crate) dir: Option<PathBuf>,
    /// The same as DIR
    #[arg(short, long, value_name = "DIR", conflicts_with = "dir")]
    pub(crate) output: Option<PathBuf>,
}

pub(crate) fn docs(args: DocsArgs, context: &Context) -> ProjectResult<ExitCode> {
    let dir = args.dir.or(args.output);
    let dir = dir.unwrap_or_else(|| PathBuf::from(DEFAULT_DIR));
    let folder = GeneratedFolder {
        dir: &dir,
        content: "documentation",
        marker: (INDEX, "content=\"mocban docs\""),
        keeps_changes: false,
    };
    if let Some((path, error)) = folder.write(&web_files())? {
        let path = path.display();
        context.warn(&format!(
            "the earlier documentation was replaced but could not be removed from {path}: {error}"
        ));
    }
    context.info(&format!("open {} in a browser", dir.join(INDEX).display()));
    Ok(ExitCode::Done)
}
