//! What a store says about an object without its content.

use object_store::ObjectMeta;

/// Length, version and time of an object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ObjectStat {
    /// Length in bytes.
    pub(crate) bytes: u64,
    /// Changes if the content changes: the length and the entity tag, or the time of the last change.
    pub(crate) version: String,
    /// The entity tag, if the store has one.
    pub(super) tag: Option<String>,
    /// Time of the last change by the clock of the store, in milliseconds since 1970.
    pub(crate) modified: i64,
}

impl From<&ObjectMeta> for ObjectStat {
    fn from(meta: &ObjectMeta) -> Self {
        let modified = meta.last_modified.timestamp_millis();
        let id = match &meta.e_tag {
            Some(tag) => tag.trim_matches('"').to_owned(),
            None => modified.to_string(),
        };
        Self {
            bytes: meta.size,
            version: format!("{}:{id}", meta.size),
            tag: meta.e_tag.clone(),
            modified,
        }
    }
}
