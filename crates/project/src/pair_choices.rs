//! What a person chose on the page that shows the pairs of an import before they are stored.

use std::path::Path;

use mocban_core::domain::ContentHash;
use mocban_lists::manifest::{ChosenColumns, ManifestRow, PairingChanges};

/// Choices for an import of pairs.
#[derive(Debug, Clone, Default)]
pub struct PairChoices {
    /// Columns of a list.
    pub columns: ChosenColumns,
    /// Pairs that are left out; files of folders that are joined.
    pub changes: PairingChanges,
    /// Hash of the pairs that were shown. Others are refused.
    pub shown: Option<ContentHash>,
    /// The block of the pairs for which the list or the folders name none.
    pub block: Option<String>,
}

impl PairChoices {
    /// Gives a pair the chosen block, unless it has one.
    pub(crate) fn add_block(&self, row: &mut ManifestRow) {
        if row.block.is_none() {
            row.block.clone_from(&self.block);
        }
    }
}

/// Hashes the pairs of an import in their order, as they are listed: the project does not matter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowsHash(ContentHash);

impl RowsHash {
    /// Begins with the folder of a list.
    pub(crate) fn new(folder: &Path) -> Self {
        Self(ContentHash::of(folder.as_os_str().as_encoded_bytes()))
    }

    /// Adds a pair. The unit counts unless it is chosen with the import, as a block for all pairs is.
    pub(crate) fn add(&mut self, row: &ManifestRow, has_unit: bool) {
        let attributes = (&row.character, &row.block, row.scanned_face_down, &row.meta);
        let unit = row.unit.filter(|_| has_unit);
        let row = (&row.name, &row.mesh, &row.print, attributes, unit);
        let row = format!("{row:?}");
        self.0 = ContentHash::of(&[self.0.as_bytes(), row.as_bytes()].concat());
    }

    pub(crate) const fn value(self) -> ContentHash {
        self.0
    }
}
