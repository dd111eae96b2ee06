//! What commands print: text, tables, progress, and the context that all commands have.

pub(crate) mod block_progress;
pub(crate) mod block_status;
pub(crate) mod busy;
pub(crate) mod completion_script;
pub(crate) mod context;
pub(crate) mod digits;
pub(crate) mod equal_warnings;
pub(crate) mod failures;
pub(crate) mod logging;
pub(crate) mod missing_results;
pub(crate) mod page_address;
pub(crate) mod pair_table;
pub(crate) mod panics;
pub(crate) mod progress;
pub(crate) mod retired_table;
pub(crate) mod run_progress;
pub(crate) mod screen;
pub(crate) mod served_pages;
pub(crate) mod show_text;
pub(crate) mod status_screen;
pub(crate) mod streams;
pub(crate) mod table;
pub(crate) mod terminal;
