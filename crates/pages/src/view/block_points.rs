//! Reads a block for its correction, and stores its control points in the catalog.

use std::path::PathBuf;

use crate::on_thread::{on_thread, read_on_thread};
use mocban_catalog::{Catalog, ControlPointsChange};
use mocban_core::domain::{BlockName, ContentHash, ControlPoints};
use mocban_export::block_view::{BlockCorrection, replaced_file};
use mocban_project::location::Location;
use mocban_project::{ProjectError, ProjectResult};
use mocban_store::Project;

/// What became of points that were to be saved.
#[derive(Debug)]
pub(super) enum PointsSaved {
    /// They are saved.
    Saved,
    /// Another page, which may belong to another process, has saved points since this one was opened.
    OthersSaved,
    /// The block has another file than the one on which the points were tried.
    FileReplaced(PathBuf),
}

/// The control points of a block of the project. The catalog is open only while it is used, so that a page that stays
/// open does not hold it.
#[derive(Debug, Clone)]
pub struct BlockPoints {
    pub(super) location: Location,
    pub(super) block: BlockName,
    next_command: Option<String>,
}

impl BlockPoints {
    /// Creates the access to the control points of a block. `next_command` aligns the block again.
    pub fn new(location: &Location, block: &BlockName, next_command: Option<String>) -> Self {
        Self {
            location: location.clone(),
            block: block.clone(),
            next_command,
        }
    }

    /// Reads the block. Returns a sentence if that fails.
    pub(super) async fn read(&self) -> Result<BlockCorrection, String> {
        let own = self.clone();
        let read = read_on_thread(async move || own.read_block().await).await;
        read.map_err(|error| error.text(&self.location.dir))
    }

    /// Stores control points, or removes the stored ones, if these still have the hash `read`. Returns a sentence if that
    /// fails.
    pub(super) async fn save(
        &self,
        read: Option<ContentHash>,
        points: Option<ControlPoints>,
    ) -> Result<PointsSaved, String> {
        let own = self.clone();
        let stored = on_thread(async move || own.store(read, points.as_ref()).await).await;
        stored.map_err(|error| error.text(&self.location.dir))
    }

    /// Returns the command that aligns the block again; `None` if a page has a button for it.
    pub(super) fn next_command(&self) -> Option<String> {
        self.next_command.clone()
    }

    /// Returns the relative address of the page of the block. Only the app has one, and it has no command.
    pub(super) fn back(&self) -> Option<&'static str> {
        self.next_command.is_none().then_some("../")
    }

    async fn read_block(&self) -> ProjectResult<BlockCorrection> {
        let (project, catalog) = self.location.open_read_only().await?;
        let limits = self.location.settings()?.config.limits.image;
        let read = BlockCorrection::read(&catalog, &project, &self.block, limits).await;
        catalog.close().await;
        Ok(read?)
    }

    async fn store(
        &self,
        read: Option<ContentHash>,
        points: Option<&ControlPoints>,
    ) -> ProjectResult<PointsSaved> {
        let (project, catalog) = self.location.open().await?;
        let stored = self.store_in(&catalog, &project, read, points).await;
        catalog.close().await;
        stored
    }

    async fn store_in(
        &self,
        catalog: &Catalog,
        project: &Project,
        read: Option<ContentHash>,
        points: Option<&ControlPoints>,
    ) -> ProjectResult<PointsSaved> {
        let block = &self.block;
        if let Some(points) = points
            && let Some(path) = replaced_file(catalog, project, block, points).await?
        {
            return Ok(PointsSaved::FileReplaced(path));
        }
        match catalog.set_control_points(block, read, points).await? {
            ControlPointsChange::Stored => Ok(PointsSaved::Saved),
            ControlPointsChange::Outdated => Ok(PointsSaved::OthersSaved),
            ControlPointsChange::NoBlock => {
                let text = format!("block {block} was removed meanwhile");
                Err(ProjectError::unexpected(text))
            }
        }
    }
}
