//! Reads a block for its correction, and stores its control points in the catalog.

use tokio::runtime::Handle;

use super::context::Context;
use crate::domain::{BlockName, ControlPoints};
use crate::export::block_view::BlockCorrection;
use crate::view::CorrectionStore;

/// The control points of a block of the project. The catalog is open only while it is used, so that a page that stays
/// open does not hold it.
#[derive(Clone)]
pub(super) struct BlockPoints {
    context: Context,
    block: BlockName,
}

impl BlockPoints {
    /// Creates the access to the control points of a block.
    pub(super) fn new(context: &Context, block: &BlockName) -> Self {
        Self {
            context: context.clone(),
            block: block.clone(),
        }
    }

    async fn read_block(&self) -> anyhow::Result<BlockCorrection> {
        let (project, catalog) = self.context.open_read_only().await?;
        let limits = self.context.settings()?.config.limits.image;
        let read = BlockCorrection::read(&catalog, &project, &self.block, limits).await;
        catalog.close().await;
        Ok(read?)
    }

    async fn store(&self, points: Option<&ControlPoints>) -> anyhow::Result<()> {
        let (_, catalog) = self.context.open().await?;
        let stored = catalog.set_control_points(&self.block, points).await;
        catalog.close().await;
        anyhow::ensure!(stored?, "block {} was removed meanwhile", self.block);
        Ok(())
    }
}

impl CorrectionStore for BlockPoints {
    async fn read(&self) -> Result<BlockCorrection, String> {
        let own = self.clone();
        on_thread(move || Handle::current().block_on(own.read_block())).await
    }

    async fn save(&self, points: Option<ControlPoints>) -> Result<(), String> {
        let own = self.clone();
        on_thread(move || Handle::current().block_on(own.store(points.as_ref()))).await
    }

    fn next_command(&self) -> String {
        self.context.command("run")
    }
}

/// Runs work on a thread for long work, and returns the sentence of an error. Futures that open a catalog are not `Send`.
async fn on_thread<T: Send + 'static>(
    work: impl FnOnce() -> anyhow::Result<T> + Send + 'static,
) -> Result<T, String> {
    let done = tokio::task::spawn_blocking(work).await;
    let done = done.map_err(anyhow::Error::from).flatten();
    done.map_err(|error| format!("{error:#}"))
}
