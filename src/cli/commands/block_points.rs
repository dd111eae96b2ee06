//! Reads a block for its correction, and stores its control points in the catalog.

use tokio::runtime::Handle;

use crate::cli::output::context::Context;
use mocban_catalog::{Catalog, ControlPointsChange};
use mocban_core::domain::{BlockName, ContentHash, ControlPoints};
use mocban_export::block_view::{BlockCorrection, replaced_file};
use mocban_pages::view::{CorrectionStore, PointsSaved};
use mocban_project::error::TaskStopped;
use mocban_project::{ProjectError, ProjectResult};
use mocban_store::Project;

/// The control points of a block of the project. The catalog is open only while it is used, so that a page that stays
/// open does not hold it.
#[derive(Clone)]
pub(crate) struct BlockPoints {
    context: Context,
    block: BlockName,
}

impl BlockPoints {
    /// Creates the access to the control points of a block.
    pub(crate) fn new(context: &Context, block: &BlockName) -> Self {
        Self {
            context: context.clone(),
            block: block.clone(),
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
        done.map_err(|error| error.text(&self.context.location.dir))
    }

    async fn read_block(&self) -> ProjectResult<BlockCorrection> {
        let (project, catalog) = self.context.location.open_read_only().await?;
        let limits = self.context.location.settings()?.config.limits.image;
        let read = BlockCorrection::read(&catalog, &project, &self.block, limits).await;
        catalog.close().await;
        Ok(read?)
    }

    async fn store(
        &self,
        read: Option<ContentHash>,
        points: Option<&ControlPoints>,
    ) -> ProjectResult<PointsSaved> {
        let (project, catalog) = self.context.location.open().await?;
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

    fn next_command(&self) -> String {
        self.context.command("run")
    }
}
