//! A project on disk: its directory, its input files, its artifacts, and the lock of its run.

mod artifacts;
mod atomic_write;
mod inputs;
mod lock;
mod project;
mod referenced;

pub use artifacts::{ArtifactError, NewArtifact};
pub use atomic_write::{partial_path, rename_into_place, write_atomic, write_synced};
pub use inputs::{
    InputDigest, InputError, InputFile, InputReader, hash_input, open_input, read_input, stat_input,
};
pub use lock::{LockError, RunLock};
pub use project::{CATALOG_FILE, Project, SETTINGS_FILE, StoreError};
pub use referenced::{ReferencedArtifacts, UnreferencedFile, UnreferencedKind};
