//! The blocks of an import, as their list or their files name them.

use std::collections::BTreeMap;

use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use mocban_core::domain::BlockName;
use mocban_lists::manifest::{BlockRow, ReadBlocks};
use mocban_project::import_blocks::{BlockSource, listed_blocks};

/// Returns the blocks of a source, as their list has them, with warnings about the list.
///
/// # Errors
/// Refuses a list with problems, and a scan whose name cannot be that of a block.
pub(super) fn named_blocks(source: &BlockSource) -> AppResult<ReadBlocks> {
    let refused = |why: String| AppFailure::refused(Sentence::of_program(&why));
    match source {
        BlockSource::List { file, bytes } => listed_blocks(file, bytes).map_err(AppFailure::from),
        BlockSource::One(block) => {
            let shown = block.mesh.display();
            let stem = block.mesh.file_stem().unwrap_or_default().to_string_lossy();
            let typed = block.name.as_deref();
            let name = BlockName::new(typed.unwrap_or(&stem)).map_err(|error| {
                let why = match typed {
                    Some(_) => error.to_string(),
                    None => format!("{shown}: {error}; rename the file"),
                };
                refused(why)
            })?;
            let row = BlockRow {
                line: 1,
                name,
                mesh: block.mesh.clone(),
                page: block.page.clone(),
                labels: block.labels.clone(),
                unit: block.unit,
                side: block.side,
                meta: BTreeMap::new(),
            };
            Ok(ReadBlocks {
                rows: vec![row],
                ..ReadBlocks::default()
            })
        }
    }
}
