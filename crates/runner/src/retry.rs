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
