//! Reads a block for its correction, and stores its control points in the catalog.

use tokio::runtime::Handle;

use super::correction_page::{CorrectionStore, PointsSaved};
use mocban_catalog::{Catalog, ControlPointsChange};
use mocban_core::domain::{BlockName, ContentHash, ControlPoints};
use mocban_export::block_view::{BlockCorrection, replaced_file};
use mocban_project::error::TaskStopped;
use mocban_project::location::Location;
use mocban_project::{ProjectError, ProjectResult};
use mocban_store::Project;

/// The control points of a block of the project. The catalog is open only while it is used, so that a page that stays
/// open does not hold it.
#[derive(Debug, Clone)]
pub struct BlockPoints {
    location: Location,
    block: BlockName,
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

    /// Runs work on a thread for long work, and returns the sentence that explains an error. Futures that open a catalog are
    /// not `Send`.
    async fn on_thread<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> ProjectResult<T> + Send + 'static,
    ) -> Result<T, String> {
        let done = tokio::task::spawn_blocking(work).await;
        let done = done.map_err(|error| TaskStopped(error).into()).flatten();
        done.map_err(|error| error.text(&self.location.dir))
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

impl CorrectionStore for BlockPoints {
    async fn read(&self) -> Result<BlockCorrection, String> {
        let own = self.clone();
        self.on_thread(move || Handle::current().block_on(own.read_block()))
            .await
    }

    async fn save(
        &self,
        read: Option<ContentHash>,
        points: Option<ControlPoints>,
    ) -> Result<PointsSaved, String> {
        let own = self.clone();
        self.on_thread(move || Handle::current().block_on(own.store(read, points.as_ref())))
            .await
    }

    fn next_command(&self) -> Option<String> {
        self.next_command.clone()
    }
}
