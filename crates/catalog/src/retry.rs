//! Retries operations while the database server is unavailable.

use crate::{Catalog, CatalogError, Result};

impl Catalog {
    /// Calls `operation` again while the database server is unavailable. The operation must be idempotent, because an
    /// earlier call may have been stored although its reply was lost.
    ///
    /// # Errors
    /// Returns the error of the operation. After [`Catalog::stop_waiting`], also returns the error of a server that is
    /// unavailable or does not reply.
    pub async fn retry_while_unavailable<T>(
        &self,
        operation: impl AsyncFn() -> Result<T>,
    ) -> Result<T> {
        let mut attempt = 0;
        loop {
            let outcome = if self.is_shared() {
                self.retry_wait.limit(operation()).await
            } else {
                operation().await
            };
            match outcome {
                Err(error)
                    if error.is_unavailable() && self.retry_wait.wait(attempt, &error).await =>
                {
                    attempt += 1;
                }
                outcome => return outcome,
            }
        }
    }

    /// Returns whether an idempotent operation is to be called again after this error: waits while the database server is
    /// unavailable. For tasks that cannot use [`Catalog::retry_while_unavailable`], because their futures must be `Send`.
    pub async fn may_retry(&self, attempt: u32, error: &CatalogError) -> bool {
        error.is_unavailable() && self.retry_wait.wait(attempt, error).await
    }

    /// Ends all waits for an unavailable database server. Operations then fail while it is unavailable, or after a few
    /// seconds without a reply.
    pub fn stop_waiting(&self) {
        self.retry_wait.stop();
    }
}
