//! `demo --block`: creates a whole block with its page, and the true alignments of the pairs that are cut from it.

use std::path::Path;

use serde_json::Value;
use tokio::sync::mpsc;

use super::demo_data::replace_data;
use crate::cli::output::busy::Busy;
use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use mocban_catalog::{Catalog, ImportChunk, ImportTerms, StoredCharacter};
use mocban_core::domain::{Affine2, BlockName, PairName};
use mocban_demo::block::{BlockFiles, BlockOptions, BlockTruth, find_block, write_block};
use mocban_project::ProjectResult;
use mocban_project::demo_folder::{DemoContent, check_directory};
use mocban_project::error::WithContext as _;
use mocban_project::files;
use mocban_project::import_blocks::{BlockSource, ImportedBlock};
use mocban_project::location::now;
use mocban_runner::{Stop, StopLevel};

/// Id of the block.
const NAME: &str = "block";

/// Returns the block to import, with the boxes of its characters if `has_labels` is set.
pub(crate) fn import_source(files: &BlockFiles, has_labels: bool) -> BlockSource {
    BlockSource::One(ImportedBlock {
        mesh: files.mesh.clone(),
        page: files.page.clone(),
        labels: has_labels.then(|| files.labels.clone()),
        side: None,
        name: Some(NAME.to_owned()),
        unit: None,
    })
}

/// Stores the true boxes of the block, and the true alignments of the pairs that were cut from it. Returns how many of these
/// there are.
pub(crate) async fn store_truths(file: &Path, catalog: &Catalog) -> ProjectResult<u64> {
    let bytes = files::read(file)?;
    let truth: BlockTruth = serde_json::from_slice(&bytes)
        .with_context(|| format!("{} is not the truth of a block", file.display()))?;
    let name = BlockName::new(NAME)?;
    let boxes = truth.true_boxes();
    if !boxes.is_empty() {
        catalog.set_true_boxes(&name, &boxes).await?;
    }
    let characters = catalog.block_characters(&name).await?;
    let truths = characters
        .iter()
        .filter_map(|found| pair_truth(&truth, found))
        .collect();
    let (sender, chunks) = mpsc::channel(1);
    // The receiver exists.
    let _ = sender.send(ImportChunk::End).await;
    let terms = ImportTerms {
        truths,
        ..ImportTerms::default()
    };
    let (_, stored) = catalog.import_all(chunks, terms, now()).await?;
    Ok(stored)
}

/// Returns the true alignment of the pair of a character, if it has one.
fn pair_truth(truth: &BlockTruth, found: &StoredCharacter) -> Option<(PairName, Value)> {
    let pair = PairName::new(found.pair.as_ref()?).ok()?;
    let map = found.maps.as_ref()?.get("page_from_crop")?;
    let [first, second, _]: [[f64; 3]; 3] = serde_json::from_value(map.clone()).ok()?;
    let character = truth.character_at(found.bounds)?;
    let record = truth.pair(pair.as_str(), character, &Affine2([first, second]))?;
    Some((pair, serde_json::to_value(record).ok()?))
}

/// Returns the files of the block, which are created unless they exist. Returns `None` if a signal stopped the command.
pub(crate) async fn create_files(
    dir: &Path,
    options: BlockOptions,
    context: &Context,
) -> ProjectResult<Option<BlockFiles>> {
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
) -> ProjectResult<Option<BlockFiles>> {
    let busy = Busy::start(context, "creating a block");
    if !busy.is_shown() {
        context.info("creating a block");
    }
    let write = move |folder: &Path, stop: &Stop| {
        let is_stopped = || stop.level() != StopLevel::Go;
        write_block(folder, &options, &is_stopped)
    };
    let written = replace_data(data, context, write).await?;
    drop(busy);
    Ok(written.map(|files| files.moved_to(data)))
}
