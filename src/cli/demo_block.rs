//! `demo --block`: creates a whole block with its page.

use std::path::Path;

use super::busy::Busy;
use super::context::{Context, shell_quoted};
use super::demo_folder::{DemoContent, STOPPED, check_directory, replace_data};
use super::exit::ExitCode;
use super::table::count;
use crate::demo::block::{BlockFiles, BlockOptions, find_block, write_block};
use crate::runner::{Stop, StopLevel};

/// Which block is created, and what is imported of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockDemo {
    pub(super) options: BlockOptions,
    /// Whether the boxes of the characters are imported.
    pub(super) has_labels: bool,
}

/// Creates a block below `DIR/data` unless it exists.
pub(super) async fn create(
    dir: &Path,
    demo: BlockDemo,
    context: &Context,
) -> anyhow::Result<ExitCode> {
    let Some(files) = create_files(dir, demo.options, context).await? else {
        context.info(STOPPED);
        return Ok(ExitCode::Stopped);
    };
    context.info(&format!("true alignment: {}", files.truth.display()));
    context.next(&import_command(&files, demo.has_labels));
    Ok(ExitCode::Done)
}

/// Returns the command that imports a block.
fn import_command(files: &BlockFiles, has_labels: bool) -> String {
    let quoted = |path: &Path| shell_quoted(&path.to_string_lossy());
    let labels = if has_labels {
        format!(" --labels {}", quoted(&files.labels))
    } else {
        String::new()
    };
    let (mesh, page) = (quoted(&files.mesh), quoted(&files.page));
    format!("import --block {mesh} --page {page}{labels}")
}

/// Returns the files of the block, which are created unless they exist. Returns `None` if a signal stopped the command.
async fn create_files(
    dir: &Path,
    options: BlockOptions,
    context: &Context,
) -> anyhow::Result<Option<BlockFiles>> {
    let data = dir.join("data");
    check_directory(dir, &data, &DemoContent::Block(options))?;
    let files = match find_block(&data, &options) {
        Some(files) => files,
        None => match replace_block(&data, options, context).await? {
            Some(files) => files,
            None => return Ok(None),
        },
    };
    let BlockOptions { kind, seed, .. } = options;
    let action = ["created", "found"][usize::from(files.already_existed)];
    let characters = count(files.characters as u64, "character");
    let triangles = count(files.triangles as u64, "triangle");
    let data = data.display();
    context.info(&format!(
        "{action} a {kind} block of {characters} and {triangles}, seed {seed}, in {data}"
    ));
    Ok(Some(files))
}

/// Writes the block next to `data` and then replaces `data`. Returns `None` if a signal stopped the command.
async fn replace_block(
    data: &Path,
    options: BlockOptions,
    context: &Context,
) -> anyhow::Result<Option<BlockFiles>> {
    let busy = Busy::start(context, "creating a block");
    let write = move |folder: &Path, stop: &Stop| {
        let is_stopped = || stop.level() != StopLevel::Go;
        write_block(folder, &options, &is_stopped)
    };
    let written = replace_data(data, context, write).await?;
    drop(busy);
    Ok(written.map(|files| files.moved_to(data)))
}
