//! A block of a project: its import, and its results.

use mocban_project::details::{self, Details};
use mocban_project::events::Listener;
use mocban_project::import_blocks::{BlockSource, ImportedBlock, import_blocks};
use mocban_project::import_pairs::AllowedChanges;
use mocban_project::location::Location;
use mocban_project::{ProjectResult, Refusal};
use serde_json::json;

/// Imports a block. Returns what changed, in JSON.
pub(crate) async fn import(
    block: ImportedBlock,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<String> {
    let source = BlockSource::One(block);
    let outcome = import_blocks(&source, AllowedChanges::default(), location, listener).await?;
    let summary = outcome.summary;
    let changed = summary.changed.iter().map(|(name, _fields)| name);
    let counts = json!({
        "added": summary.added,
        "changed": changed.collect::<Vec<_>>(),
        "unchanged": summary.unchanged,
        "warnings": outcome.warnings,
    });
    Ok(counts.to_string())
}

/// Reads everything about a block, and its characters, in JSON.
pub(crate) async fn detail(id: &str, location: &Location) -> ProjectResult<String> {
    let (_project, catalog) = location.open_read_only().await?;
    let found = details::read(id, &catalog, location).await;
    catalog.close().await;
    match found? {
        Details::Block(block, characters) => {
            let mut value = serde_json::to_value(*block)?;
            value["character_list"] = serde_json::to_value(characters)?;
            Ok(value.to_string())
        }
        Details::ListedBlock(_) => {
            let text = format!("{id} is a block of a list of pairs, which has no page");
            Err(Refusal::NothingSelected(text).into())
        }
        Details::Pair(_) => {
            let text = format!("{id} is a pair, not a block; `pair` returns it");
            Err(Refusal::NothingSelected(text).into())
        }
    }
}
