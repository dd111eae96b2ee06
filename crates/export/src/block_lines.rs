//! The file `blocks.jsonl`: one line per whole block, with the map of its face to its page.

use std::collections::BTreeSet;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

use super::block_grid::{BlockGrid, face_grid};
use super::block_view::{BlockViewError, RegisteredFace};
use super::export_folder::SharedFile;
use super::export_logs::json_lines;
use super::exporter_error::ExportError;
use super::record::RecordStatus;
use super::record_fields::{BLOCK_FIELDS, markdown_table, schema_of};
use mocban_catalog::{BlockDetail, Catalog, CatalogError};
use mocban_core::domain::{BlockName, BlockSide, BlockStage, FailureClass, LengthUnit};
use mocban_store::Project;

/// The file, with its meaning.
pub(super) const BLOCKS_FILE: [&str; 2] = [
    "blocks.jsonl",
    "one line per whole block with the map from its scan to its page, if there are any",
];

/// A line of `blocks.jsonl`. A value that does not exist is null.
#[derive(Debug, PartialEq, Serialize, JsonSchema)]
struct BlockLine {
    /// Id of the block, as in the field `block` of its pairs.
    block: BlockName,
    /// Path of the scan in the catalog.
    mesh: String,
    /// Path of the image of the page in the catalog.
    page: String,
    /// Path of the labels in the catalog; null if the boxes were found.
    labels: Option<String>,
    /// Unit of the scan, as given or as it follows from the size.
    unit: Option<LengthUnit>,
    /// All other columns of the list of blocks.
    meta: Map<String, Value>,
    /// `done`, `failed` or `pending`.
    status: RecordStatus,
    /// Class of the failure.
    error_class: Option<FailureClass>,
    /// Why the block failed.
    error: Option<String>,
    /// Side of the block that the page shows.
    side: Option<BlockSide>,
    /// Whether the page was accepted as that of the block; null before it was compared.
    accepted: Option<bool>,
    /// Share of the places of the face that agree with the page.
    agreement: Option<f64>,
    /// Number of characters that were cut.
    characters: u64,
    /// Points of the scan every 5 mm (`mesh`) and their pixels of the page (`page`); null without an accepted page.
    map: Option<BlockGrid>,
}

impl BlockLine {
    /// Returns the line of a block without what its registration says.
    fn without_map(detail: &BlockDetail) -> Self {
        let (state, attributes) = (&detail.state, &detail.state.attributes);
        let stored = state.failure.as_ref();
        let failure = stored.map(|stored| &stored.failure);
        let is_refused = stored.is_some_and(|stored| {
            stored.stage == BlockStage::Align && stored.failure.class == FailureClass::NoSolution
        });
        Self {
            block: attributes.name.clone(),
            mesh: attributes.mesh_path.clone(),
            page: attributes.page_path.clone(),
            labels: attributes.labels_path.clone(),
            unit: attributes.unit,
            meta: attributes.meta.clone().unwrap_or_default(),
            status: RecordStatus::of(state.status),
            error_class: failure.map(|failure| failure.class),
            error: failure.map(|failure| failure.message.clone()),
            side: None,
            accepted: is_refused.then_some(false),
            agreement: None,
            characters: state.characters,
            map: None,
        }
    }

    /// Reads what the registration of a block says.
    fn add_map(&mut self, detail: &BlockDetail, project: &Project) -> Result<(), BlockViewError> {
        let Some(registered) = RegisteredFace::of(detail)? else {
            return Ok(());
        };
        self.unit = Some(registered.unit);
        self.side = Some(registered.side);
        self.accepted = Some(true);
        self.agreement = Some(registered.agreement);
        self.map = Some(face_grid(&registered, project)?);
        Ok(())
    }

    /// Returns the line of a block, and why its map is missing although its page was accepted.
    fn of(detail: &BlockDetail, project: &Project) -> (Self, Option<String>) {
        let mut line = Self::without_map(detail);
        let Err(error) = line.add_map(detail, project) else {
            return (line, None);
        };
        let why = error.to_string();
        line.status = RecordStatus::Failed;
        line.error_class = Some(FailureClass::Io);
        line.error = Some(why.clone());
        (line, Some(why))
    }
}

/// A block whose files cannot be read, and why.
pub(super) type UnreadableBlock = (BlockName, String);

/// Returns the names of all blocks, or of those in `only`, sorted.
pub(super) async fn chosen_blocks(
    catalog: &Catalog,
    only: Option<&BTreeSet<String>>,
) -> Result<Vec<BlockName>, CatalogError> {
    let mut names = catalog.block_names().await?;
    names.retain(|name| only.is_none_or(|only| only.contains(name.as_str())));
    Ok(names)
}

/// Writes the lines of all blocks, or of some, sorted by name. Writes no file if there are none. Returns whether there is a
/// file, and the blocks whose stored results cannot be read.
pub(super) async fn write_blocks(
    catalog: &Catalog,
    project: &Project,
    root: &Path,
    only: Option<&BTreeSet<String>>,
) -> Result<(bool, Vec<UnreadableBlock>), ExportError> {
    let names = chosen_blocks(catalog, only).await?;
    let mut unreadable = Vec::new();
    if names.is_empty() {
        return Ok((false, unreadable));
    }
    let mut file = SharedFile::create(root, BLOCKS_FILE[0])?;
    for name in names {
        // A block that was removed meanwhile has no line.
        let Some(detail) = catalog.block(&name).await? else {
            continue;
        };
        let project = project.clone();
        let read = move || BlockLine::of(&detail, &project);
        let (line, problem) = tokio::task::spawn_blocking(read).await?;
        unreadable.extend(problem.map(|why| (name, why)));
        file.append(json_lines(&[line]).as_bytes())?;
    }
    file.flush()?;
    Ok((true, unreadable))
}

/// Returns the table of the fields of a line, as Markdown.
pub(super) fn fields_table() -> String {
    let heading = format!("Fields of a line of `{}`", BLOCKS_FILE[0]);
    markdown_table(&schema_of::<BlockLine>(), &[(&heading, &BLOCK_FIELDS)])
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{BLOCK_FIELDS, BlockLine, fields_table, schema_of};

    #[test]
    fn the_table_lists_exactly_the_fields_of_a_line_and_is_in_the_documentation() {
        let schema = schema_of::<BlockLine>();
        let properties = schema["properties"].as_object().expect("properties");
        let names: BTreeSet<&str> = properties.keys().map(String::as_str).collect();
        let listed: BTreeSet<&str> = BLOCK_FIELDS.iter().map(|field| field.name).collect();
        assert_eq!(listed, names);
        let docs = include_str!("../../../docs/reference/data.md");
        let table = fields_table();
        assert!(table.lines().count() > BLOCK_FIELDS.len(), "{table}");
        for row in table.lines().filter(|row| row.starts_with('|')) {
            assert!(
                docs.contains(row),
                "docs/reference/data.md lacks the line\n{row}"
            );
        }
    }
}
