//! Write transactions: their first statement, and a macro that runs an `async` block in one.

use crate::db::dialect::Sql;

/// Begins a transaction.
pub(crate) const BEGIN: Sql = Sql::pair("BEGIN IMMEDIATE", "BEGIN");

/// Runs a block with a connection in a write transaction of its own: see [`Catalog::in_transaction`](crate::Catalog).
macro_rules! in_transaction {
    ($catalog:expr, |$conn:ident| $work:block) => {
        $catalog
            .in_transaction(move |$conn| Box::pin(async move $work))
            .await
    };
}
pub(crate) use in_transaction;
