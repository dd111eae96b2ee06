//! Access to the database file: opening, connections, statements for both databases, errors, and decoding of columns.

pub(crate) mod busy_retry;
pub(crate) mod checksummed_table;
pub(crate) mod column_arrays;
pub(crate) mod conn;
pub(crate) mod dialect;
pub(crate) mod error;
pub(crate) mod error_kind;
mod explained;
pub(crate) mod left_out;
pub(crate) mod lock_owner;
pub(crate) mod log_watch;
pub(crate) mod network_fs;
pub(crate) mod open;
pub(crate) mod pending_catalog;
pub(crate) mod postgres;
pub(crate) mod postgres_address;
pub(crate) mod query;
pub(crate) mod retry_wait;
pub(crate) mod roles;
pub(crate) mod row;
pub(crate) mod rows;
pub(crate) mod schema;
pub(crate) mod script;
pub(crate) mod transaction;
pub(crate) mod value;
