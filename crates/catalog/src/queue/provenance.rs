//! What results and failures of pairs were made with: settings, input files and attributes.

use serde::Serialize;
use sqlx::error::BoxDynError;

use crate::db::value::{Argument, FromValue, Value as ColumnValue};
use mocban_core::domain::{ContentHash, InputVersion};

/// Row id of a fingerprint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct FingerprintId(pub i64);

impl FromValue for FingerprintId {
    fn from_value(value: ColumnValue<'_>) -> Result<Self, BoxDynError> {
        Ok(Self(i64::from_value(value)?))
    }
}

impl From<FingerprintId> for Argument {
    fn from(FingerprintId(id): FingerprintId) -> Self {
        Self::from(id)
    }
}

impl From<Option<FingerprintId>> for Argument {
    fn from(id: Option<FingerprintId>) -> Self {
        Self::from(id.map(|FingerprintId(id)| id))
    }
}

/// Versions of a pair's input files that its worker read. `None` for a file that was not read.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct InputVersions {
    /// The mesh.
    pub mesh: Option<InputVersion>,
    /// The print.
    pub print: Option<InputVersion>,
}

impl InputVersions {
    /// Returns whether neither file was read.
    pub(crate) const fn is_empty(&self) -> bool {
        self.mesh.is_none() && self.print.is_none()
    }
}

/// What a result or a failure of a pair was made with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairProvenance {
    /// Fingerprint of the settings.
    pub fingerprint: FingerprintId,
    /// Hash of the mesh. `None` in a failure before the mesh was read.
    pub mesh_hash: Option<ContentHash>,
    /// Hash of the print. `None` if the stage does not read it, or in a failure before it was read.
    pub print_hash: Option<ContentHash>,
    /// The manifest attributes that results depend on, as JSON.
    pub attributes: String,
}

impl PairProvenance {
    /// Describes a stage that was computed from these inputs.
    pub fn new(fingerprint: FingerprintId, inputs: &InputVersions, attributes: String) -> Self {
        let hash = |version: &Option<InputVersion>| version.as_ref().map(|version| version.hash);
        Self {
            fingerprint,
            mesh_hash: hash(&inputs.mesh),
            print_hash: hash(&inputs.print),
            attributes,
        }
    }
}
