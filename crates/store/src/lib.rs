//! The files of a project: inputs, artifacts and locks, in folders and in object stores.
//!
//! - [`Project`]: a project folder; [`Input`]: a mesh, print, page or label file at a path, below a named root or in an
//!   object store
//! - artifacts: files that stages compute, named by the hash of their content (`artifacts.rs`); in an object store, those
//!   that are stored together are packed into one object (`packed.rs`), and cut meshes and prints are objects of their own
//! - [`RunLock`] shows which processes work on a project; [`TargetLock`] which write an output
//! - `owner.json` in a place of artifacts names the catalog that it belongs to (`place_owner.rs`)
//! - `remote/`: `client.rs`, `request.rs` and `bucket.rs` send requests, `cache.rs` keeps copies of inputs, `listing.rs`
//!   notices changes
//!
//! Every call fails if the disk or the object store fails. `# Errors` names other reasons, and what an error leaves behind.
//!
//! **Invariant:** a file gets its name when it is whole and on the disk, and nothing that another project may use is
//! removed. "Cannot be read" is an error, not an absent file.

mod artifact_error;
mod artifact_object;
mod artifact_writer;
mod artifacts;
mod artifacts_place;
mod atomic_write;
mod collect;
mod create_folders;
mod input_error;
mod input_place;
mod inputs;
mod lock;
mod lock_file;
mod new_folder;
mod open_file;
mod owner_record;
mod packed;
mod parent_folder;
mod place_owner;
mod project;
mod referenced;
mod remote;
mod replacement_folder;
mod staging;
mod stored_paths;
mod target_lock;

pub use artifact_error::ArtifactError;
pub use artifacts::NewArtifact;
pub use atomic_write::{place_new_file, rename_into_place, write_atomic, write_synced};
pub use create_folders::create_folders;
pub use input_error::InputError;
pub use input_place::Input;
pub use inputs::{InputFile, InputReader, hash_input, open_input, read_input, stat_input};
pub use lock::{LockError, RunLock};
pub use mocban_core::domain::CATALOG_FILE;
pub use new_folder::NewFolder;
pub use open_file::{open_regular, read_file_or_pipe, read_up_to};
pub use place_owner::PlaceError;
pub use project::{Project, SETTINGS_FILE, StoreError};
pub use referenced::{ReferencedArtifacts, UnreferencedFile, UnreferencedKind};
pub use remote::{BucketError, ProjectStorage, StorageError, StorageOptions};
pub use replacement_folder::{Leftover, ReplaceError, ReplacementFolder};
pub use staging::StagingFolder;
pub use stored_paths::StoredPaths;
pub use target_lock::{TargetLock, TargetLockError};
