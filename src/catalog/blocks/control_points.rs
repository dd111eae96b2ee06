//! Stores the control points of blocks.

use crate::catalog::{Catalog, Result};
use crate::domain::{BlockName, ControlPoints};

const UPDATE: &str = "UPDATE block SET control_points = ?2 WHERE name = ?1 RETURNING id";

impl Catalog {
    /// Stores the control points of a block, or removes them. The next run finds out which stages are stale. Returns
    /// `false` if the block does not exist.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn set_control_points(
        &self,
        block: &BlockName,
        points: Option<&ControlPoints>,
    ) -> Result<bool> {
        let text = points.map(serde_json::to_string).transpose()?;
        self.update_block(UPDATE, block, text).await
    }
}
