//! What a command does, without the terminal: the same for the command line, a Python package and a page.
//!
//! - [`location`]: a project folder with the settings that say where its catalog and its files are; opens both
//! - [`import_pairs`], [`import_blocks`]: add pairs and blocks from lists, folders or single files
//! - [`backup`], [`restore`]: copy a project to one file, and make a project of it
//! - [`verdict_file`], [`truth_file`], [`manifest_file`]: files that people write
//! - [`demo_folder`]: what a demo may replace
//! - [`exit`], [`error_text`]: the code of an error, and one sentence that says what was seen and what to do
//!
//! **Invariant:** a function checks everything that can refuse it before it writes, and prints nothing.

pub mod backup;
pub mod demo_folder;
pub mod error_text;
pub mod exit;
pub mod files;
pub mod import_blocks;
pub mod import_pairs;
pub mod input_paths;
pub mod location;
pub mod manifest_file;
pub mod missing_files;
pub mod new_project;
pub mod restore;
pub mod shell;
pub mod time_text;
pub mod truth_file;
mod unread_meshes;
pub mod verdict_file;
