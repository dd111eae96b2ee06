//! Requests of the page that the catalog has not confirmed, so that the browser keeps them.

use std::collections::BTreeSet;
use std::sync::Mutex;
use std::time::Duration;

use mocban_catalog::CatalogError;
use mocban_core::locked;
use mocban_system::failpoint::time_scale;

/// Maximum time until the catalog confirms a request. The page then keeps it and sends it again.
const CONFIRMATION: Duration = Duration::from_secs(10);
/// Maximum number of events that are remembered. A page has at most three requests that wait.
const MAX_EVENTS: usize = 1000;

/// Returns the maximum time until the catalog confirms a request.
pub(super) fn confirmation_limit() -> Duration {
    CONFIRMATION * time_scale("MOCBAN_LIMIT_FACTOR") / time_scale("MOCBAN_TIME_SCALE")
}

/// Why a request was not confirmed.
#[derive(Debug, thiserror::Error)]
pub(super) enum Unconfirmed {
    /// The catalog may still store it.
    #[error("the catalog has not confirmed this in time; it is sent again")]
    NoReply,
    #[error(transparent)]
    Catalog(#[from] CatalogError),
}

impl Unconfirmed {
    /// Returns whether the page sends the request again.
    pub(super) const fn is_temporary(&self) -> bool {
        !matches!(self, Self::Catalog(CatalogError::NothingToUndo(_)))
    }
}

/// Events whose last request was not confirmed.
#[derive(Debug, Default)]
pub(super) struct UnstoredEvents(Mutex<BTreeSet<String>>);

impl UnstoredEvents {
    /// Waits at most [`confirmation_limit`] for an operation that stores an event, and remembers the event if a page will
    /// send it again. An operation that takes longer may still be stored. This does no harm, because an event is stored
    /// once.
    ///
    /// # Errors
    /// Returns the error of the operation, or that it took too long.
    pub(super) async fn store<T>(
        &self,
        event: &str,
        operation: impl Future<Output = Result<T, CatalogError>>,
    ) -> Result<T, Unconfirmed> {
        self.store_within(confirmation_limit(), event, operation)
            .await
    }

    async fn store_within<T>(
        &self,
        limit: Duration,
        event: &str,
        operation: impl Future<Output = Result<T, CatalogError>>,
    ) -> Result<T, Unconfirmed> {
        let stored = tokio::time::timeout(limit, operation).await;
        let stored = match stored {
            Ok(stored) => stored.map_err(Unconfirmed::from),
            Err(_elapsed) => Err(Unconfirmed::NoReply),
        };
        let mut events = locked(&self.0);
        if stored.as_ref().is_err_and(Unconfirmed::is_temporary) {
            if events.len() < MAX_EVENTS {
                events.insert(event.to_owned());
            }
        } else {
            events.remove(event);
        }
        stored
    }

    /// Returns the number of events that a browser keeps.
    pub(super) fn count(&self) -> usize {
        locked(&self.0).len()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::{Unconfirmed, UnstoredEvents};
    use mocban_catalog::CatalogError;

    #[tokio::test]
    async fn an_answer_without_confirmation_is_given_up_and_counted_until_it_is_stored() {
        let events = UnstoredEvents::default();
        let never = std::future::pending::<Result<(), CatalogError>>();
        let given_up = events.store_within(Duration::ZERO, "a", never).await;
        assert!(
            matches!(given_up, Err(Unconfirmed::NoReply)),
            "{given_up:?}"
        );
        let closed = async { Err::<(), _>(CatalogError::Closed) };
        assert!(events.store("b", closed).await.is_err());
        assert_eq!(events.count(), 2);
        events.store("a", async { Ok(()) }).await.expect("stored");
        assert_eq!(events.count(), 1);
        // The page does not send again what is refused for good.
        let refused = async { Err::<(), _>(CatalogError::NothingToUndo(None)) };
        assert!(events.store("b", refused).await.is_err());
        assert_eq!(events.count(), 0);
    }
}
