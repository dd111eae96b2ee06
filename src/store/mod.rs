//! A project on disk: its directory, its input files, its artifacts, and the lock of its run.

mod artifacts;
mod inputs;
mod lock;
mod named;
mod project;
mod whole;

pub use artifacts::{ArtifactError, NewArtifact};
pub use inputs::{
    FileStat, InputError, InputFile, InputReader, Seen, hash_input, open_input, read_input,
    stat_input,
};
pub use lock::{LockError, RunLock};
pub use named::{NamedArtifacts, Unnamed, UnnamedKind};
pub use project::{CATALOG_FILE, Project, SETTINGS_FILE, StoreError};
pub use whole::{finish_whole, partial_of, write_synced, write_whole};
