//! What a command does, without the terminal: the same for the command line, a Python package and a page.
//!
//! - [`location`]: a project folder with the settings that say where its catalog and its files are; opens both
//! - [`align`]: one scan with one print, without a project
//! - [`import_pairs`], [`import_blocks`]: add pairs and blocks from lists, folders or single files
//! - [`import_plan`]: what an import of pairs would store; [`pair_choices`]: what a person changes in it;
//!   [`file_headers`]: what the files say of themselves
//! - [`run`]: prepares, plans and does a run; [`retry`] lets failed pairs run again
//! - [`retire`]: takes pairs out of every count, and brings them back
//! - [`status`], [`pair_table`], [`hosts`], [`details`], [`input_warnings`], [`check`]: the state of all pairs, of workers and of one
//!   pair or block, and whether scans, files and rows are sound
//! - [`verdicts`]: records, imports, lists and undoes what people say about results
//! - [`change_setting`]: changes a setting, after saying what that costs
//! - [`report`], [`export`], [`sheets`]: results as a table, as files for other tools, and as pictures; [`export_forecast`]: how large
//!   such files will be
//! - [`backup`], [`restore`], [`copy`]: copy a project to one file, make a project of it, copy a catalog to another database;
//!   [`backup_content`]: what such a file holds; [`backup_inputs`], [`input_list`]: scans and prints beside it
//! - [`missing_inputs`], [`input_places`]: inputs that are no longer where they were
//! - [`block_labels`]: labels that were made on the page of a block
//! - [`verdict_file`], [`truth_file`], [`manifest_file`]: files that people write
//! - [`demo_folder`], [`generated_folder`]: what may be replaced
//! - [`events`]: what a function reports while it works
//! - [`error`], [`exit`]: the code of an error, one sentence that says what was seen and what to do, and the exit code
//!
//! A function that needs the catalog, the disk or the settings fails if they do. `# Errors` says what else it refuses.
//!
//! **Invariant:** a function checks everything that can refuse it before it writes, and prints nothing.

#![expect(
    clippy::missing_errors_doc,
    reason = "the page of the crate says what can fail in all functions"
)]

pub mod align;
pub mod backup;
pub mod backup_checks;
pub mod backup_content;
pub mod backup_inputs;
mod block_files;
pub mod block_labels;
mod block_scale;
pub mod block_status;
pub mod blocking;
pub mod byte_size;
pub mod change_setting;
pub mod check;
pub mod closing;
pub mod column_hashes;
pub mod copy;
pub mod demo_folder;
pub mod details;
mod empty_import;
pub mod error;
pub mod events;
pub mod exit;
pub mod export;
pub mod export_forecast;
pub mod failures;
pub mod file_headers;
pub mod files;
pub mod folder_files;
pub mod generated_folder;
mod growing_list;
pub mod hosts;
pub mod import_blocks;
pub mod import_command;
pub mod import_pairs;
pub mod import_plan;
mod input_copy;
mod input_finder;
pub mod input_list;
mod input_names;
pub mod input_paths;
pub mod input_places;
pub mod input_warnings;
pub mod location;
mod lost_values;
pub mod manifest_file;
pub mod missing_files;
mod missing_folders;
pub mod missing_inputs;
mod named_inputs;
pub mod new_project;
pub mod own_files;
pub mod pair_choices;
pub mod pair_table;
pub mod renamed_columns;
mod repeated_files;
pub mod report;
pub mod restore;
mod restore_inputs;
pub mod retire;
pub mod retry;
pub mod reviewers;
mod row_spool;
pub mod run;
pub mod scan_corrections;
pub mod script_checksum;
pub mod selection;
pub mod sheets;
pub mod status;
pub mod truth_file;
mod unread_files;
mod unusable_files;
mod verdict_columns;
pub mod verdict_file;
mod verdict_json;
pub mod verdict_row;
pub mod verdict_words;
pub mod verdicts;
mod wanted_inputs;
pub mod worker_totals;

pub use error::{ProjectError, ProjectResult};
pub use exit::{ExitCode, Refusal};
