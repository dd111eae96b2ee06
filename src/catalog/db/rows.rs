//! Converts columns to domain types; a value that is not allowed is an error.

use serde_json::Value;

use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::domain::{ContentHash, JobStatus, PairName, Stage};

/// Converts a status code.
pub(crate) fn status(code: i64) -> Result<JobStatus> {
    JobStatus::from_code(code)
        .ok_or_else(|| CatalogError::Corrupt(format!("job status {code} is unknown")))
}

/// Converts a cursor to its next stage; `None` at the end.
pub(crate) fn next_stage(cursor: i64) -> Result<Option<Stage>> {
    let index = usize::try_from(cursor)
        .ok()
        .filter(|index| *index <= Stage::ALL.len());
    match index {
        Some(index) => Ok(Stage::from_index(index)),
        None => Err(CatalogError::Corrupt(format!("stage {cursor} is unknown"))),
    }
}

/// Converts the number of a stage.
pub(crate) fn stage(index: i64) -> Result<Stage> {
    next_stage(index)?
        .ok_or_else(|| CatalogError::Corrupt(format!("stage {index} is past the last")))
}

/// Converts a hash.
pub(crate) fn hash(bytes: &[u8]) -> Result<ContentHash> {
    match <[u8; 32]>::try_from(bytes) {
        Ok(bytes) => Ok(ContentHash::from_bytes(bytes)),
        Err(_) => Err(CatalogError::Corrupt(format!(
            "a hash of {} bytes",
            bytes.len()
        ))),
    }
}

/// Converts a nullable hash.
pub(crate) fn hash_option(bytes: Option<&[u8]>) -> Result<Option<ContentHash>> {
    bytes.map(hash).transpose()
}

/// Converts the name of an enum value.
pub(crate) fn name<T: std::str::FromStr<Err = String>>(text: &str) -> Result<T> {
    text.parse().map_err(CatalogError::Corrupt)
}

/// Converts a pair's name.
pub(crate) fn pair_name(text: &str) -> Result<PairName> {
    PairName::new(text).map_err(|error| CatalogError::Corrupt(error.to_string()))
}

/// Builds a JSON array of names for `json_each`.
pub(crate) fn names_json(names: &[PairName]) -> String {
    array(names.iter().map(PairName::as_str)).to_string()
}

/// Builds a JSON array for `json_each`.
pub(crate) fn array<T: Into<Value>>(items: impl IntoIterator<Item = T>) -> Value {
    Value::Array(items.into_iter().map(Into::into).collect())
}
