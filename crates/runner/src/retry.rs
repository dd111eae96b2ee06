//! Calls idempotent operations of the catalog again while the database server is unavailable. The arguments are
//! evaluated for each call.

/// Calls an operation with [`mocban_catalog::Catalog::retry_while_unavailable`].
macro_rules! retried {
    ($catalog:ident.$operation:ident($($argument:expr),*)) => {
        $catalog
            .retry_while_unavailable(async || $catalog.$operation($($argument),*).await)
            .await
    };
}
pub(crate) use retried;

/// Calls an operation that stores what a block's task has computed. It may take any time, even after a stop request, and
/// its future is `Send`.
macro_rules! stored {
    ($catalog:ident.$operation:ident($($argument:expr),*)) => {{
        let mut attempt = 0;
        loop {
            match $catalog.$operation($($argument),*).await {
                Err(error) if $catalog.may_retry(attempt, &error).await => attempt += 1,
                outcome => break outcome,
            }
        }
    }};
}
pub(crate) use stored;
