//! The image of a page with its boxes, which a person changes.

use std::sync::Arc;

use serde_json::{Value, json};

use super::block_error::BlockViewError;
use super::box_edits::{BoxEditError, BoxEdits};
use super::page_layers::whole_jpeg;
use super::registered_face::{outcome, stored_block};
use crate::pictures::Rgb;
use crate::source_print::SourcePrint;
use mocban_align::block::BoxesOutcome;
use mocban_catalog::{BlockDetail, Catalog};
use mocban_core::domain::{BlockName, BlockStage, ContentHash};
use mocban_core::raster::ImageLimits;
use mocban_lists::labels::{
    self, LabelBox, MAX_BYTES, PageFile, ReplacedLabels, box_names, reading_order, replaced_labels,
};
use mocban_store::{Project, read_input};

/// Longer side of the picture of the page, pixels.
const LONGEST_SIDE: usize = 3000;

/// The page of a block with its boxes: the ones of its labels, or else found ones.
#[derive(Debug)]
pub struct EditableBoxes {
    name: BlockName,
    is_aligned: bool,
    page: Arc<Rgb>,
    page_path: String,
    page_bytes: u64,
    page_hash: ContentHash,
    labels_path: Option<String>,
    boxes: Vec<LabelBox>,
    /// Whether the labels cannot be read, so that their boxes are not known.
    is_unread: bool,
    /// Warnings of the reader of labels, or why the labels cannot be read.
    warnings: Vec<String>,
    /// What the labels have replaced, if they were made on this page.
    earlier: Option<ReplacedLabels>,
}

/// Boxes of a page, and what is known of their file.
#[derive(Debug, Default)]
struct ReadBoxes {
    boxes: Vec<LabelBox>,
    is_unread: bool,
    warnings: Vec<String>,
    earlier: Option<ReplacedLabels>,
}

impl EditableBoxes {
    /// Reads a block. Labels that cannot be read have no boxes, with a warning. The image of the page is decoded only if it is
    /// not that of `known`.
    ///
    /// # Errors
    /// Returns an error if the catalog or the page cannot be read.
    pub async fn read(
        catalog: &Catalog,
        project: &Project,
        name: &BlockName,
        limits: ImageLimits,
        known: Option<Arc<Self>>,
    ) -> Result<Self, BlockViewError> {
        let detail = stored_block(catalog, name).await?;
        let (name, project) = (name.clone(), project.clone());
        let read = move || Self::read_files(name, &detail, &project, &limits, known.as_deref());
        tokio::task::spawn_blocking(read).await?
    }

    fn read_files(
        name: BlockName,
        detail: &BlockDetail,
        project: &Project,
        limits: &ImageLimits,
        known: Option<&Self>,
    ) -> Result<Self, BlockViewError> {
        let attributes = &detail.state.attributes;
        let page_path = attributes.page_path.clone();
        let file = SourcePrint::read_file(project, &page_path, limits)?;
        let (page_hash, page_bytes) = (file.version.hash, file.bytes.len() as u64);
        let page = if let Some(known) = known.filter(|known| known.page_hash == page_hash) {
            Arc::clone(&known.page)
        } else {
            let path = project.input(&page_path).path().to_owned();
            let page = SourcePrint::decoded(file, path, limits)?;
            Arc::new(page.picture.rgb.into_rgb8())
        };
        let mut own = Self {
            name,
            is_aligned: detail
                .stages
                .iter()
                .any(|one| one.stage == BlockStage::Align),
            page,
            page_path,
            page_bytes,
            page_hash,
            labels_path: attributes.labels_path.clone(),
            boxes: Vec::new(),
            is_unread: false,
            warnings: Vec::new(),
            earlier: None,
        };
        let read = match &attributes.labels_path {
            Some(path) => own.of_labels(project, path),
            None => found(detail)?,
        };
        (own.boxes, own.is_unread) = (read.boxes, read.is_unread);
        (own.warnings, own.earlier) = (read.warnings, read.earlier);
        Ok(own)
    }

    /// Reads the boxes of labels. Boxes without a name get that of their place, so that the pairs of the others keep theirs.
    fn of_labels(&self, project: &Project, path: &str) -> ReadBoxes {
        let failed = |why: String| ReadBoxes {
            is_unread: true,
            warnings: vec![why],
            ..ReadBoxes::default()
        };
        let input = project.input(path);
        let file = match read_input(&input, MAX_BYTES as u64, "the limit of labels") {
            Ok(file) => file,
            Err(error) => return failed(error.to_string()),
        };
        let earlier = replaced_labels(&file.bytes);
        let mut read = match labels::read(&file.bytes, path, &self.page_file()) {
            Ok(read) => read,
            Err(error) => {
                return ReadBoxes {
                    earlier,
                    ..failed(error.to_string())
                };
            }
        };
        let bounds: Vec<[f64; 4]> = read.boxes.iter().map(LabelBox::bounds).collect();
        let names = box_names(&read.boxes, &reading_order(&bounds));
        for (label, name) in read.boxes.iter_mut().zip(names) {
            label.name = Some(name);
        }
        ReadBoxes {
            boxes: read.boxes,
            is_unread: false,
            warnings: read.warnings,
            earlier,
        }
    }

    /// Returns what the page in the browser shows, as JSON.
    pub fn to_json(&self) -> Value {
        json!({
            "block": self.name,
            "page_size": [self.page.width(), self.page.height()],
            "boxes": self.boxes_json(),
            "has_labels": self.labels_path.is_some(),
            "has_earlier": self.earlier.is_some(),
            "is_unread": self.is_unread,
            "warnings": self.warnings,
            "is_aligned": self.is_aligned,
            "shown": self.shown_hash(),
        })
    }

    /// Returns a hash of what the page shows: the page, the boxes, and where they come from.
    pub fn shown_hash(&self) -> ContentHash {
        let shown = json!([self.page_hash, self.labels_path, self.boxes_json()]);
        ContentHash::of(shown.to_string().as_bytes())
    }

    /// Returns the image of the page as JPEG.
    pub fn page_jpeg(&self) -> Vec<u8> {
        whole_jpeg(&self.page, LONGEST_SIDE)
    }

    /// Returns the warnings of the reader of labels, or why the labels cannot be read.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Returns the path of the labels, as stored.
    pub fn labels_path(&self) -> Option<&str> {
        self.labels_path.as_deref()
    }

    /// Returns what the labels have replaced, if they were made on this page.
    pub const fn earlier(&self) -> Option<&ReplacedLabels> {
        self.earlier.as_ref()
    }

    /// Returns the content of the labels after changes; `None` if nothing changes.
    ///
    /// # Errors
    /// Returns an error if an import would refuse the boxes or leave some out.
    pub fn edited(&self, edits: &BoxEdits) -> Result<Option<Vec<u8>>, BoxEditError> {
        let path = self.labels_path.clone();
        edits.labels_file(&self.boxes, &self.page_file(), &ReplacedLabels { path })
    }

    fn page_file(&self) -> PageFile<'_> {
        PageFile {
            name: &self.page_path,
            bytes: self.page_bytes,
            width: self.page.width() as u32,
            height: self.page.height() as u32,
        }
    }

    fn boxes_json(&self) -> Value {
        let boxes = self.boxes.iter();
        let boxes =
            boxes.map(|one| json!({"name": one.name, "text": one.text, "outline": one.outline}));
        boxes.collect()
    }
}

/// Returns the boxes that a run has found.
fn found(detail: &BlockDetail) -> Result<ReadBoxes, BlockViewError> {
    let mut stages = detail.stages.iter();
    let Some(stored) = stages.find(|one| one.stage == BlockStage::Boxes) else {
        return Ok(ReadBoxes::default());
    };
    let characters = outcome::<BoxesOutcome>(stored)?.characters.into_iter();
    let boxes = characters.map(|one| LabelBox {
        name: Some(one.label.name),
        text: one.label.text,
        ..LabelBox::rectangle(one.label.page_box)
    });
    Ok(ReadBoxes {
        boxes: boxes.collect(),
        ..ReadBoxes::default()
    })
}
