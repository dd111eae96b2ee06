//! What a page has read of its block.

use std::sync::Arc;

use tokio::sync::Mutex;

/// What a page shows, which is read when the page is opened and kept for its later requests.
#[derive(Debug)]
pub(super) struct ReadOnce<T>(Mutex<Option<Arc<T>>>);

impl<T> Default for ReadOnce<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> ReadOnce<T> {
    /// Keeps what was read.
    pub(super) fn of(read: T) -> Self {
        Self(Mutex::new(Some(Arc::new(read))))
    }

    /// Returns what is kept, if it was read.
    pub(super) async fn known(&self) -> Option<Arc<T>> {
        self.0.lock().await.clone()
    }

    /// Returns what is kept. Reads it if it was not yet. Returns a sentence if that fails.
    pub(super) async fn get<F>(&self, read: impl FnOnce() -> F) -> Result<Arc<T>, String>
    where
        F: Future<Output = Result<T, String>>,
    {
        let mut kept = self.0.lock().await;
        if let Some(known) = &*kept {
            return Ok(Arc::clone(known));
        }
        let read = Arc::new(read().await?);
        *kept = Some(Arc::clone(&read));
        Ok(read)
    }

    /// Reads it again; `read` gets what was kept. Returns a sentence if that fails, and then keeps nothing.
    pub(super) async fn refresh<F>(
        &self,
        read: impl FnOnce(Option<Arc<T>>) -> F,
    ) -> Result<Arc<T>, String>
    where
        F: Future<Output = Result<T, String>>,
    {
        let mut kept = self.0.lock().await;
        let read = Arc::new(read(kept.take()).await?);
        *kept = Some(Arc::clone(&read));
        Ok(read)
    }

    /// Forgets what is kept, so that it is read again.
    pub(super) async fn forget(&self) {
        *self.0.lock().await = None;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::ReadOnce;

    #[tokio::test]
    async fn it_is_read_once_and_then_again_with_what_was_known() {
        let kept = ReadOnce::default();
        let first = kept.get(|| async { Ok(1) }).await;
        assert_eq!(first.as_deref(), Ok(&1));
        let same = kept.get(|| async { Err("read twice".to_owned()) }).await;
        assert_eq!(same.as_deref(), Ok(&1));
        let next =
            kept.refresh(|known| async move { Ok(known.map_or(0, |known: Arc<i32>| *known) + 1) });
        assert_eq!(next.await.as_deref(), Ok(&2));
        let failed = kept.refresh(|_| async { Err("gone".to_owned()) }).await;
        assert_eq!(failed, Err("gone".to_owned()));
        assert_eq!(kept.known().await, None);
    }
}
