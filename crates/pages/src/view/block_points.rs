//! Reads a block for its correction, and stores its control points in the catalog.

use std::path::PathBuf;

use super::block_access::BlockAccess;
use crate::on_thread::{on_thread, read_on_thread};
use mocban_catalog::{BlockChange, Catalog};
use mocban_core::domain::{ContentHash, ControlPoints};
use mocban_export::block_view::{BlockCorrection, replaced_file};
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

impl BlockAccess {
    /// Reads the block for its correction. Returns a sentence if that fails.
    pub(super) async fn read_correction(&self) -> Result<BlockCorrection, String> {
        let own = self.clone();
        let read = read_on_thread(async move || own.read_block().await).await;
        read.map_err(|error| error.text(&self.location.dir))
    }

    /// Stores control points, or removes the stored ones, if these still have the hash `read`. Returns a sentence if that
    /// fails.
    pub(super) async fn save_points(
        &self,
        read: Option<ContentHash>,
        points: Option<ControlPoints>,
    ) -> Result<PointsSaved, String> {
        let own = self.clone();
        let stored = on_thread(async move || own.store_points(read, points.as_ref()).await).await;
        stored.map_err(|error| error.text(&self.location.dir))
    }

    async fn read_block(&self) -> ProjectResult<BlockCorrection> {
        let (project, catalog) = self.location.open_read_only().await?;
        let limits = self.location.settings()?.config.limits.image;
        let read = BlockCorrection::read(&catalog, &project, &self.block, limits).await;
        catalog.close().await;
        Ok(read?)
    }

    async fn store_points(
        &self,
        read: Option<ContentHash>,
        points: Option<&ControlPoints>,
    ) -> ProjectResult<PointsSaved> {
        let (project, catalog) = self.location.open().await?;
        let stored = self.store_points_in(&catalog, &project, read, points).await;
        catalog.close().await;
        stored
    }

    async fn store_points_in(
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
            BlockChange::Stored => Ok(PointsSaved::Saved),
            BlockChange::Outdated => Ok(PointsSaved::OthersSaved),
            BlockChange::NoBlock => {
                let text = format!("block {block} was removed meanwhile");
                Err(ProjectError::unexpected(text))
            }
        }
    }
}
