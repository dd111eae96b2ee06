//! The writer task: it collects the requests of callers and commits them in groups over the only write connection.

pub(crate) mod group_commit;
pub(crate) mod write_connection;
pub(crate) mod writer;
