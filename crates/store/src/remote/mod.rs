//! Objects of an S3-compatible store: input files below named roots, and packs of artifacts.

mod bucket;
mod bucket_error;
mod cache;
mod cache_files;
mod client;
mod listing;
mod object_stat;
mod pack;
mod request;
mod small_cache;
mod storage;

pub use bucket_error::BucketError;
pub use storage::{ProjectStorage, StorageError, StorageOptions};

pub(super) use bucket::Bucket;
pub(super) use cache::CachedObject;
pub(super) use pack::{PACKS, Pack, key as pack_key, number_of as pack_number, read_from_pack};
pub(super) use storage::Root;
