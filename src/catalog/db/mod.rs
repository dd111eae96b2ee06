//! Access to the database file: opening, the writer task, errors, and decoding of columns.

pub(crate) mod batch_collector;
pub(crate) mod busy_retry;
pub(crate) mod commit_delay;
pub(crate) mod conn;
pub(crate) mod copy;
pub(crate) mod dialect;
pub(crate) mod error;
pub(crate) mod error_kind;
pub(crate) mod group_commit;
pub(crate) mod known_leases;
pub(crate) mod lock_owner;
pub(crate) mod log_watch;
pub(crate) mod network_fs;
pub(crate) mod open;
pub(crate) mod postgres;
pub(crate) mod query;
pub(crate) mod request;
pub(crate) mod retry_wait;
pub(crate) mod roles;
pub(crate) mod row;
pub(crate) mod rows;
pub(crate) mod script;
pub(crate) mod unplaced;
pub(crate) mod value;
pub(crate) mod write_connection;
pub(crate) mod writer;
