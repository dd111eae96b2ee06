//! A project on disk: its directory, its input files, its artifacts, and the lock of its run.

mod artifact_error;
mod artifact_object;
mod artifacts;
mod artifacts_place;
mod atomic_write;
mod collect;
mod input_error;
mod input_place;
mod inputs;
mod lock;
mod lock_file;
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
mod target_lock;

pub use artifact_error::ArtifactError;
pub use artifacts::NewArtifact;
pub use atomic_write::{place_new_file, rename_into_place, write_atomic, write_synced};
pub use input_error::InputError;
pub use input_place::Input;
pub use inputs::{
    InputDigest, InputFile, InputReader, hash_input, open_input, read_input, stat_input,
};
pub use lock::{LockError, RunLock};
pub use open_file::{open_regular, read_file_or_pipe};
pub use place_owner::PlaceError;
pub use project::{CATALOG_FILE, Project, SETTINGS_FILE, StoreError};
pub use referenced::{ReferencedArtifacts, UnreferencedFile, UnreferencedKind};
pub use remote::{BucketError, ProjectStorage, StorageError, StorageOptions};
pub use replacement_folder::{Leftover, ReplaceError, ReplacementFolder};
pub use staging::StagingFolder;
pub use target_lock::{TargetLock, TargetLockError};
