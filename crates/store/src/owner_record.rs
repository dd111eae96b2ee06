//! The note in a place of artifacts that says which catalog it belongs to, and what follows from it for another catalog.

use std::ffi::OsStr;

use serde::{Deserialize, Serialize};

use mocban_core::domain::CatalogIdentity;

/// Name of the note: a file in a folder, an object in a store.
pub(super) const OWNER: &str = "owner.json";
/// Version of its format.
const SCHEMA: u32 = 1;
/// Longest note that is read, in bytes.
pub(super) const MAX_BYTES: u64 = 1 << 16;

/// Returns whether a file of this name holds the note, or is a new one that is being written.
pub(super) fn is_owner_record(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    name == OWNER || name.starts_with(&format!(".{OWNER}."))
}

/// The owner of a place of artifacts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct OwnerRecord {
    schema: u32,
    pub(super) catalog: CatalogIdentity,
    /// What distinguishes the folder from its copies. `None` in an object store.
    folder: Option<String>,
}

/// What an owner says about the place for this catalog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standing {
    /// It is this catalog's.
    Own,
    /// It is this catalog's, but the note names an earlier path or file of it.
    Renamed,
    /// It was that of this catalog at a path where there is none any more.
    Moved,
    /// The note came here with a copy of the folder.
    CopiedFolder,
    /// It belonged to an earlier catalog at the path of this one.
    Replaced,
    /// It belonged to a catalog that no longer uses this folder.
    Left,
    /// It belongs to a catalog of which this one is a copy, or which is a copy of this one.
    OfCopy,
    /// It belongs to another catalog.
    Other,
}

/// What can be found out about the owner on this computer.
pub(super) trait OwnerTraces {
    /// Returns whether there may be a catalog at a path.
    fn may_exist(&self, catalog: &str) -> bool;

    /// Returns whether the folder is reached through a link, so that other projects may use it too.
    fn is_link(&self) -> bool;

    /// Returns whether this folder may be the artifacts folder of the catalog at a path. `false` for an object store.
    fn may_use_this_folder(&self, catalog: &str) -> bool;
}

impl OwnerRecord {
    pub(super) const fn new(catalog: CatalogIdentity, folder: Option<String>) -> Self {
        Self {
            schema: SCHEMA,
            catalog,
            folder,
        }
    }

    /// Reads a note. Returns `None` if it is none of this program.
    pub(super) fn parse(bytes: &[u8]) -> Option<Self> {
        let record: Self = serde_json::from_slice(bytes).ok()?;
        (record.schema == SCHEMA).then_some(record)
    }

    pub(super) fn to_bytes(&self) -> serde_json::Result<Vec<u8>> {
        let mut bytes = serde_json::to_vec_pretty(self)?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    /// Compares the owner with the catalog in `own`, which uses the place in the same way.
    pub(super) fn standing_of(&self, own: &Self, traces: &impl OwnerTraces) -> Standing {
        let (owner, me) = (&self.catalog, &own.catalog);
        let is_same = owner.id == me.id;
        let is_at_same_place = owner.is_same_place(me);
        if is_same && is_at_same_place {
            let is_unchanged = self == own || owner.host.is_none();
            return if is_unchanged {
                Standing::Own
            } else {
                Standing::Renamed
            };
        }
        let is_local_path = owner.host.is_some() && owner.host == me.host;
        if self.folder != own.folder && (is_same || !traces.is_link()) {
            return Standing::CopiedFolder;
        }
        if is_local_path && owner.at == me.at {
            return Standing::Replaced;
        }
        if is_same && is_local_path && !traces.may_exist(&owner.at) {
            return Standing::Moved;
        }
        if own.folder.is_some() && is_local_path && !traces.may_use_this_folder(&owner.at) {
            return Standing::Left;
        }
        if is_same {
            Standing::OfCopy
        } else {
            Standing::Other
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{OwnerRecord, OwnerTraces, Standing};
    use mocban_core::domain::CatalogIdentity;

    /// Paths of all catalogs, and of the catalogs that use the folder.
    struct KnownCatalogs<'a>(&'a [&'a str], &'a [&'a str]);

    impl OwnerTraces for KnownCatalogs<'_> {
        fn may_exist(&self, catalog: &str) -> bool {
            self.0.contains(&catalog)
        }

        fn is_link(&self) -> bool {
            false
        }

        fn may_use_this_folder(&self, catalog: &str) -> bool {
            self.1.contains(&catalog)
        }
    }

    fn file(id: &str, host: &str, at: &str, instance: &str) -> CatalogIdentity {
        CatalogIdentity {
            id: id.to_owned(),
            at: at.to_owned(),
            host: Some(host.to_owned()),
            instance: instance.to_owned(),
        }
    }

    fn server(id: &str, at: &str, instance: &str) -> CatalogIdentity {
        CatalogIdentity {
            id: id.to_owned(),
            at: at.to_owned(),
            host: None,
            instance: instance.to_owned(),
        }
    }

    fn bucket(owner: &CatalogIdentity, me: CatalogIdentity, known: &[&str]) -> Standing {
        let owner = OwnerRecord::new(owner.clone(), None);
        owner.standing_of(&OwnerRecord::new(me, None), &KnownCatalogs(known, &[]))
    }

    #[test]
    fn a_bucket_belongs_to_one_file_also_after_it_was_moved() {
        let owner = file("a", "h", "/old", "7");
        let standing = |me, known: &[&str]| bucket(&owner, me, known);
        assert_eq!(standing(owner.clone(), &["/old"]), Standing::Own);
        // Renamed, and moved to another disk.
        assert_eq!(
            standing(file("a", "h", "/new", "7"), &["/new"]),
            Standing::Renamed
        );
        assert_eq!(
            standing(file("a", "h", "/new", "8"), &["/new"]),
            Standing::Moved
        );
        // The container has another name each time.
        assert_eq!(
            standing(file("a", "i", "/old", "7"), &[]),
            Standing::Renamed
        );
        let copy = file("a", "h", "/copy", "8");
        assert_eq!(standing(copy, &["/old", "/copy"]), Standing::OfCopy);
        // Whether the catalog is still on the other computer is unknown.
        assert_eq!(
            standing(file("a", "i", "/old", "8"), &["/old"]),
            Standing::OfCopy
        );
        // A backup was restored beside the original, and at its path.
        assert_eq!(
            standing(file("b", "h", "/copy", "8"), &["/copy"]),
            Standing::Other
        );
        assert_eq!(
            standing(file("b", "h", "/old", "8"), &["/old"]),
            Standing::Replaced
        );
        assert_eq!(standing(server("a", "db", "1/2"), &[]), Standing::OfCopy);
        assert_eq!(standing(server("b", "db", "7"), &[]), Standing::Other);
    }

    #[test]
    fn a_bucket_belongs_to_one_schema_whatever_its_address() {
        let owner = server("a", "postgres://db/lab", "1/2/3");
        let standing = |me| bucket(&owner, me, &[]);
        assert_eq!(
            standing(server("a", "postgres://10.0.0.7/lab", "1/2/3")),
            Standing::Own
        );
        assert_eq!(
            standing(server("a", "postgres://db/lab", "1/2/4")),
            Standing::OfCopy
        );
        assert_eq!(
            standing(server("b", "postgres://db/lab", "1/2/4")),
            Standing::Other
        );
        assert_eq!(standing(file("b", "h", "/old", "1/2/3")), Standing::Other);
    }

    #[test]
    fn a_copied_folder_is_free_and_a_shared_one_is_not() {
        let owner = OwnerRecord::new(file("a", "h", "/old", "7"), Some("1".to_owned()));
        let standing = |me, folder: &str, users: &[&str]| {
            let own = OwnerRecord::new(me, Some(folder.to_owned()));
            owner.standing_of(&own, &KnownCatalogs(&["/old"], users))
        };
        let copy = || file("a", "h", "/copy", "8");
        assert_eq!(standing(copy(), "2", &[]), Standing::CopiedFolder);
        assert_eq!(standing(copy(), "1", &["/old"]), Standing::OfCopy);
        let restored = || file("b", "h", "/new", "8");
        assert_eq!(standing(restored(), "1", &["/old"]), Standing::Other);
        // The folder itself was moved to another project.
        assert_eq!(standing(restored(), "1", &[]), Standing::Left);
        assert_eq!(
            standing(file("b", "i", "/new", "8"), "1", &[]),
            Standing::Other
        );
    }
}
