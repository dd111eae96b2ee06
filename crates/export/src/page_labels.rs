//! The pages of whole blocks with the boxes of their characters, for the format `annotations`.

use std::collections::BTreeSet;
use std::path::Path;

use super::block_lines::{UnreadableBlock, chosen_blocks};
use super::block_view::{BlockViewError, RegisteredFace};
use super::export_folder::{FolderError, write_below};
use super::exporter_error::ExportError;
use super::source_print::SourcePrint;
use mocban_catalog::{BlockDetail, Catalog, StoredCharacter};
use mocban_core::domain::BlockCharacterState;
use mocban_core::raster::ImageLimits;
use mocban_lists::labels::{LabelBox, PageFile, write_coco, write_via};
use mocban_store::Project;

/// The files with their meanings.
pub(super) const PAGE_FILES: [[&str; 2]; 3] = [
    [
        "pages/BLOCK.EXT",
        "the pages of whole blocks, upright, if there are any",
    ],
    [
        "pages/BLOCK.json",
        "VIA 2: a project with the boxes of the characters of a page, which `import --labels` reads",
    ],
    ["pages/BLOCK.coco.json", "COCO: the same boxes"],
];

/// The files of one page: the end of each name and the content.
type LabelledPage = [(String, Vec<u8>); 3];

/// Why the labels of a page were not written.
#[derive(Debug, thiserror::Error)]
enum PageLabelsError {
    #[error(transparent)]
    Block(#[from] BlockViewError),
    #[error(transparent)]
    Folder(#[from] FolderError),
}

/// What was written of the pages.
#[derive(Debug, Default)]
pub(super) struct WrittenPages {
    /// Paths of files below the folder, with `*` in place of ids.
    pub(super) files: BTreeSet<String>,
    /// Blocks whose page cannot be read.
    pub(super) unreadable: Vec<UnreadableBlock>,
}

/// Writes the pages of all finished blocks, or of some, each with the boxes of its characters as VIA 2 and COCO.
pub(super) async fn write_page_labels(
    catalog: &Catalog,
    project: &Project,
    root: &Path,
    only: Option<&BTreeSet<String>>,
    limits: ImageLimits,
) -> Result<WrittenPages, ExportError> {
    let mut written = WrittenPages::default();
    for name in chosen_blocks(catalog, only).await? {
        let Some(detail) = catalog.block(&name).await? else {
            continue;
        };
        let mut characters = catalog.block_characters(&name).await?;
        characters.retain(|one| one.state != BlockCharacterState::Retired);
        if detail.state.next_stage.is_some() || characters.is_empty() {
            continue;
        }
        let (project, root) = (project.clone(), root.to_owned());
        let write = move || write_page(&detail, &characters, &project, &root, &limits);
        match tokio::task::spawn_blocking(write).await? {
            Ok(patterns) => written.files.extend(patterns),
            Err(PageLabelsError::Folder(error)) => return Err(error.into()),
            Err(PageLabelsError::Block(error)) => {
                written.unreadable.push((name, error.to_string()));
            }
        }
    }
    Ok(written)
}

/// Writes the files of a page. Returns their patterns.
fn write_page(
    detail: &BlockDetail,
    characters: &[StoredCharacter],
    project: &Project,
    root: &Path,
    limits: &ImageLimits,
) -> Result<Vec<String>, PageLabelsError> {
    let name = detail.state.attributes.name.file_name();
    let mut patterns = Vec::new();
    let files = labelled_page(&name, detail, characters, project, limits)?;
    for (ending, bytes) in files.into_iter().flatten() {
        write_below(root, &format!("pages/{name}{ending}"), &bytes)?;
        patterns.push(format!("pages/*{ending}"));
    }
    Ok(patterns)
}

/// Encodes the files of a page. Returns `None` if the block is not registered.
fn labelled_page(
    name: &str,
    detail: &BlockDetail,
    characters: &[StoredCharacter],
    project: &Project,
    limits: &ImageLimits,
) -> Result<Option<LabelledPage>, BlockViewError> {
    let Some(registered) = RegisteredFace::of(detail)? else {
        return Ok(None);
    };
    let path = &detail.state.attributes.page_path;
    let page = SourcePrint::read_stored(project, path, registered.page_hash, limits)?;
    let ending = format!(".{}", page.extension());
    let file = page.upright_file().into_owned();
    let page_file = PageFile {
        name: &format!("{name}{ending}"),
        bytes: file.len() as u64,
        width: page.picture.rgb.width() as u32,
        height: page.picture.rgb.height() as u32,
    };
    let boxes: Vec<LabelBox> = characters.iter().map(label_box).collect();
    let via = write_via(&boxes, &page_file);
    let coco = write_coco(&boxes, &page_file);
    Ok(Some([
        (ending, file),
        (".json".to_owned(), via),
        (".coco.json".to_owned(), coco),
    ]))
}

fn label_box(one: &StoredCharacter) -> LabelBox {
    LabelBox {
        name: Some(one.label.clone()),
        text: one.character.clone(),
        ..LabelBox::rectangle(one.bounds)
    }
}
