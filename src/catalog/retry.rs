//! Operations that wait for a database server that is away.

use crate::catalog::{Catalog, Result};

impl Catalog {
    /// Calls `operation` again while the database server is away. The operation must have the same effect if an earlier
    /// call was stored although its answer was lost.
    ///
    /// # Errors
    /// Returns the error of the operation, also that the server is away after [`Catalog::stop_waiting`].
    pub async fn retry_while_unavailable<T>(
        &self,
        operation: impl AsyncFn() -> Result<T>,
    ) -> Result<T> {
        let mut attempt = 0;
        loop {
            match operation().await {
                Err(error) if error.is_unavailable() => {
                    if attempt == 0 {
                        tracing::warn!(%error, "the database server is away, waiting for it");
                    }
                    if !self.retry_wait.wait(attempt).await {
                        return Err(error);
                    }
                    attempt += 1;
                }
                outcome => return outcome,
            }
        }
    }

    /// Ends all waits for a database server that is away. Operations then fail while it is.
    pub fn stop_waiting(&self) {
        self.retry_wait.give_up();
    }
}
