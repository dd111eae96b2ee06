//! Reads the boxes of a block for their page, and stores changed ones as labels of the project.

use std::sync::Arc;

use super::block_access::BlockAccess;
use crate::on_thread::{on_thread, read_on_thread};
use mocban_catalog::{BlockChange, Catalog};
use mocban_core::domain::ContentHash;
use mocban_export::block_view::{BoxEdits, EditableBoxes};
use mocban_project::{ProjectError, ProjectResult, block_labels};
use mocban_store::{Project, hash_input};

/// What became of boxes that were to be saved.
#[derive(Debug)]
pub(super) enum BoxesSaved {
    /// They are the labels of the block.
    Saved,
    /// They are the same as before.
    Unchanged,
    /// The page, its boxes or their file have changed since they were shown.
    OthersSaved,
    /// An import would not take them as they are, or workers on other computers would not find them.
    Refused(String),
}

impl BlockAccess {
    /// Reads the page and its boxes. The image of the page that is `known` is not decoded again. Returns a sentence if that
    /// fails.
    pub(super) async fn read_boxes(
        &self,
        known: Option<Arc<EditableBoxes>>,
    ) -> Result<EditableBoxes, String> {
        let own = self.clone();
        let read = read_on_thread(async move || own.stored_boxes(known).await).await;
        read.map_err(|error| error.text(&self.location.dir))
    }

    /// Stores changed boxes, or the labels that the stored ones have replaced, if the page still has what was `shown`. Returns
    /// a sentence if that fails.
    pub(super) async fn save_boxes(
        &self,
        known: Option<Arc<EditableBoxes>>,
        shown: ContentHash,
        edits: Option<BoxEdits>,
    ) -> Result<BoxesSaved, String> {
        let own = self.clone();
        let stored =
            on_thread(async move || own.store_boxes(known, shown, edits.as_ref()).await).await;
        stored.map_err(|error| error.text(&self.location.dir))
    }

    async fn stored_boxes(
        &self,
        known: Option<Arc<EditableBoxes>>,
    ) -> ProjectResult<EditableBoxes> {
        let (project, catalog) = self.location.open_read_only().await?;
        let read = self.boxes_of(&catalog, &project, known).await;
        catalog.close().await;
        read
    }

    async fn boxes_of(
        &self,
        catalog: &Catalog,
        project: &Project,
        known: Option<Arc<EditableBoxes>>,
    ) -> ProjectResult<EditableBoxes> {
        let limits = self.location.settings()?.config.limits.image;
        Ok(EditableBoxes::read(catalog, project, &self.block, limits, known).await?)
    }

    async fn store_boxes(
        &self,
        known: Option<Arc<EditableBoxes>>,
        shown: ContentHash,
        edits: Option<&BoxEdits>,
    ) -> ProjectResult<BoxesSaved> {
        let (project, catalog) = self.location.open().await?;
        let stored = match self.boxes_of(&catalog, &project, known).await {
            Ok(boxes) if boxes.shown_hash() == shown => {
                self.store_boxes_in(&catalog, &project, &boxes, edits).await
            }
            Ok(_) => Ok(BoxesSaved::OthersSaved),
            Err(error) => Err(error),
        };
        catalog.close().await;
        stored
    }

    async fn store_boxes_in(
        &self,
        catalog: &Catalog,
        project: &Project,
        boxes: &EditableBoxes,
        edits: Option<&BoxEdits>,
    ) -> ProjectResult<BoxesSaved> {
        if edits.is_some()
            && let Some(why) = block_labels::unreachable_place(project, catalog.is_shared())?
        {
            return Ok(BoxesSaved::Refused(why));
        }
        let labels = match edits {
            Some(edits) => match boxes.edited(edits) {
                Ok(Some(bytes)) => Some(block_labels::write_new(project, &self.block, &bytes)?),
                Ok(None) => return Ok(BoxesSaved::Unchanged),
                Err(error) => return Ok(BoxesSaved::Refused(error.to_string())),
            },
            None => match boxes.earlier() {
                Some(earlier) => {
                    if let Some(path) = &earlier.path {
                        hash_input(&project.input(path))?;
                    }
                    earlier.path.clone()
                }
                None => return Ok(BoxesSaved::OthersSaved),
            },
        };
        let read = boxes.labels_path();
        let changed = catalog.set_block_labels(&self.block, read, labels.as_deref());
        match changed.await? {
            BlockChange::Stored => Ok(BoxesSaved::Saved),
            BlockChange::Outdated => Ok(BoxesSaved::OthersSaved),
            BlockChange::NoBlock => {
                let text = format!("block {} was removed meanwhile", self.block);
                Err(ProjectError::unexpected(text))
            }
        }
    }
}
