//! Each place of artifacts belongs to one catalog: a note in it names the owner. Another catalog that removed what it
//! does not know would remove the owner's results.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::artifact_error::ArtifactError;
use super::atomic_write::{write_atomic, write_synced};
use super::open_file::read_file_or_pipe;
use super::owner_record::{MAX_BYTES, OWNER, OwnerRecord, OwnerTraces, Standing};
use super::parent_folder::sync_folder;
use super::referenced::{ReferencedArtifacts, UnreferencedKind};
use super::remote::{Bucket, BucketError, PACKS};
use super::{Project, ProjectStorage, StagingFolder};
use mocban_core::domain::{ARTIFACTS, ArtifactRef, CATALOG_FILE, CatalogIdentity};
use mocban_system::platform::{generation, stat};

/// Why a catalog may not use a place of artifacts.
#[derive(Debug, thiserror::Error)]
pub enum PlaceError {
    /// It belongs to another catalog.
    #[error(
        "{place} holds the results of {}another catalog ({owner}), which would lose files; nothing was changed there. Give this catalog a place of its own ({}), or, if the other one will not be used with this place any more, run `check --take-over`",
        if *.is_copy { "the original or a copy of this catalog, " } else { "" },
        own_place(.place)
    )]
    Taken {
        /// The folder or address.
        place: PathBuf,
        /// The owner and where it is.
        owner: Box<CatalogIdentity>,
        /// Whether one of both is a copy of the other.
        is_copy: bool,
    },
    /// It holds results without the name of an owner, and none that this catalog names.
    #[error(
        "{place} holds results, but none of this catalog, and not the name of the catalog that they belong to (owner.json); nothing was changed there. Give this catalog a place of its own ({}), or, if no other catalog uses this place, run `check --take-over`",
        own_place(.0),
        place = .0.display()
    )]
    Unknown(PathBuf),
    /// The note about the owner is not one of this program.
    #[error(
        "{} does not name the catalog that the results there belong to; correct it, or, if no other catalog uses this place, run `check --take-over`", .0.display()
    )]
    Unreadable(PathBuf),
    /// A file operation or a request failed.
    #[error("{0}")]
    Failed(#[from] ArtifactError),
}

/// Returns how to choose another place.
fn own_place(place: &Path) -> &'static str {
    if place.to_string_lossy().contains("://") {
        "another folder in storage.artifacts"
    } else {
        "an `artifacts` folder of its own"
    }
}

/// A place of artifacts.
enum Place<'a> {
    Folder(PathBuf),
    Bucket(&'a Bucket),
}

impl Project {
    /// Makes a catalog the owner of the places of its artifacts, if they have no other owner: of the object store, or
    /// else of the folder `artifacts`, which is also claimed if it exists. `known` are artifacts that the catalog names: if a
    /// place holds artifacts and no owner, one of these must be there. With `take_over`, replaces any owner. Returns
    /// messages about places whose owner changed. May block.
    ///
    /// # Errors
    /// Returns an error if a place belongs to another catalog, or cannot be read or written.
    pub fn claim_places(
        &self,
        catalog: &CatalogIdentity,
        known: &[ArtifactRef],
        take_over: bool,
    ) -> Result<Vec<String>, PlaceError> {
        let mut messages = Vec::new();
        for place in self.places()? {
            messages.extend(self.claim(&place, catalog, known, take_over)?);
        }
        Ok(messages)
    }

    /// Checks that no place of artifacts belongs to another catalog. Changes nothing. May block.
    ///
    /// # Errors
    /// Returns an error if a place belongs to another catalog, or cannot be read.
    pub fn check_places(&self, catalog: &CatalogIdentity) -> Result<(), PlaceError> {
        for place in self.places()? {
            if let Some(owner) = place.owner()? {
                place.standing(&owner, &place.record(catalog)?)?;
            }
        }
        Ok(())
    }

    fn places(&self) -> Result<Vec<Place<'_>>, ArtifactError> {
        self.check_artifacts_folder()?;
        let folder = self.artifacts_dir();
        let bucket = self.storage().and_then(ProjectStorage::artifacts);
        let mut places: Vec<_> = bucket.map(Place::Bucket).into_iter().collect();
        if bucket.is_none() || folder.try_exists().map_err(ArtifactError::io(&folder))? {
            places.push(Place::Folder(folder));
        }
        Ok(places)
    }

    fn claim(
        &self,
        place: &Place<'_>,
        catalog: &CatalogIdentity,
        known: &[ArtifactRef],
        take_over: bool,
    ) -> Result<Option<String>, PlaceError> {
        if let Place::Folder(folder) = place {
            self.make_folder(folder)?;
        }
        let own = place.record(catalog)?;
        let at = place.path();
        if take_over {
            place.write(&own, true)?;
            return Ok(Some(format!(
                "{} now belongs to this catalog",
                at.display()
            )));
        }
        let mut owner = place.owner()?;
        if owner.is_none() {
            if self.holds_others(place, known)? {
                return Err(PlaceError::Unknown(at));
            }
            place.write(&own, false)?;
            // Another process may have been faster.
            owner = place.owner()?;
        }
        let Some(owner) = owner else {
            return Err(PlaceError::Unreadable(place.note()));
        };
        let (at, from) = (at.display(), &owner.catalog);
        let message = match place.standing(&owner, &own)? {
            Standing::Own => return Ok(None),
            Standing::Renamed | Standing::CopiedFolder => None,
            Standing::Moved => Some(format!(
                "this catalog was {from} when it last used {at}; it is not there any more, so the catalog here goes on with it"
            )),
            Standing::Replaced => Some(format!(
                "{at} belonged to an earlier catalog at the path of this one ({from}); it belongs to this one now"
            )),
            Standing::Left | Standing::OfCopy | Standing::Other => Some(format!(
                "{at} belonged to {from}, which does not use it any more; it belongs to this catalog now"
            )),
        };
        place.write(&own, true)?;
        Ok(message)
    }

    /// Returns whether a place without an owner holds artifacts, but none that the catalog names.
    fn holds_others(
        &self,
        place: &Place<'_>,
        known: &[ArtifactRef],
    ) -> Result<bool, ArtifactError> {
        let is_empty = match place {
            Place::Folder(folder) => {
                let mut found = 0;
                let listed = ReferencedArtifacts::default().for_each_unreferenced(self, |file| {
                    found += u64::from(file.kind == UnreferencedKind::Orphan);
                });
                listed.map_err(ArtifactError::io(folder))?;
                found == 0
            }
            Place::Bucket(bucket) => {
                let is_empty = |folder| bucket.is_empty(folder).map_err(ArtifactError::Bucket);
                is_empty(PACKS)? && is_empty(ARTIFACTS)?
            }
        };
        if is_empty {
            return Ok(false);
        }
        for artifact in known {
            match self.check_artifact(artifact, true) {
                Ok(()) | Err(ArtifactError::Changed(_)) => return Ok(false),
                Err(error) if error.concerns_one_file() => {}
                Err(error) => return Err(error),
            }
        }
        Ok(true)
    }
}

impl Place<'_> {
    /// Returns the folder or the address.
    fn path(&self) -> PathBuf {
        match self {
            Self::Folder(folder) => folder.clone(),
            Self::Bucket(bucket) => bucket.address().into(),
        }
    }

    /// Returns the path or address of the note about the owner.
    fn note(&self) -> PathBuf {
        match self {
            Self::Folder(folder) => folder.join(OWNER),
            Self::Bucket(bucket) => bucket.address_of(OWNER).into(),
        }
    }

    /// Returns what the note says if the catalog is the owner.
    fn record(&self, catalog: &CatalogIdentity) -> Result<OwnerRecord, ArtifactError> {
        let folder = match self {
            Self::Folder(folder) => {
                let meta = std::fs::metadata(folder).map_err(ArtifactError::io(folder))?;
                Some(generation(&meta).to_string())
            }
            Self::Bucket(_) => None,
        };
        Ok(OwnerRecord::new(catalog.clone(), folder))
    }

    /// Returns the owner, or `None` if there is no note.
    fn owner(&self) -> Result<Option<OwnerRecord>, PlaceError> {
        let note = self.note();
        let bytes = match self {
            Self::Folder(_) => match read_file_or_pipe(&note, MAX_BYTES) {
                Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
                read => read.map_err(ArtifactError::io(&note))?,
            },
            Self::Bucket(bucket) => match bucket.read(OWNER, MAX_BYTES) {
                Err(BucketError::NotThere(_)) => return Ok(None),
                read => read.map_err(ArtifactError::Bucket)?,
            },
        };
        let record = OwnerRecord::parse(&bytes);
        record.map(Some).ok_or(PlaceError::Unreadable(note))
    }

    /// Returns what the owner says about this place for a catalog.
    ///
    /// # Errors
    /// Returns an error if the place belongs to another catalog.
    fn standing(&self, owner: &OwnerRecord, own: &OwnerRecord) -> Result<Standing, PlaceError> {
        let standing = owner.standing_of(own, self);
        if !matches!(standing, Standing::OfCopy | Standing::Other) {
            return Ok(standing);
        }
        Err(PlaceError::Taken {
            place: self.path(),
            owner: Box::new(owner.catalog.clone()),
            is_copy: standing == Standing::OfCopy,
        })
    }

    /// Writes the note. Unless `replace` is set, does nothing if there is one.
    fn write(&self, record: &OwnerRecord, replace: bool) -> Result<(), ArtifactError> {
        let note = self.note();
        let bytes = record.to_bytes();
        let bytes = bytes.map_err(|error| ArtifactError::io(&note)(error.into()))?;
        match self {
            Self::Folder(_) if replace => write_atomic(&note, &bytes),
            Self::Folder(folder) => create_file(folder, &note, &bytes),
            Self::Bucket(bucket) => {
                let written = if replace {
                    bucket.write(OWNER, bytes)
                } else {
                    bucket.create(OWNER, bytes).map(drop)
                };
                return written.map_err(ArtifactError::Bucket);
            }
        }
        .map_err(ArtifactError::io(&note))
    }
}

/// What can be found out on this computer. An error counts as a trace of the owner.
impl OwnerTraces for Place<'_> {
    fn may_exist(&self, catalog: &str) -> bool {
        Path::new(catalog).try_exists().unwrap_or(true)
    }

    fn is_link(&self) -> bool {
        match self {
            Self::Folder(folder) => folder.is_symlink(),
            Self::Bucket(_) => false,
        }
    }

    fn may_use_this_folder(&self, catalog: &str) -> bool {
        let Self::Folder(folder) = self else {
            return false;
        };
        let catalog = Path::new(catalog);
        let project = catalog.parent().filter(|_| catalog.ends_with(CATALOG_FILE));
        let Some(theirs) = project.map(|project| project.join(ARTIFACTS)) else {
            return true;
        };
        match (stat(folder), stat(&theirs)) {
            (Ok(ours), Ok(theirs)) => ours.id == theirs.id,
            (Ok(_), Err(error)) => error.kind() != ErrorKind::NotFound,
            (Err(_), _) => true,
        }
    }
}

/// Writes a file durably unless it exists. Other processes see no file or a whole one, except on a file system without
/// hard links.
fn create_file(folder: &Path, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let staging = StagingFolder::beside(path)?;
    let new = staging.path().join("new");
    write_synced(&new, bytes)?;
    let linked = match std::fs::hard_link(&new, path) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => write_synced(path, bytes),
        linked => linked,
    };
    match linked {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
        linked => linked.and_then(|()| sync_folder(folder)),
    }
}
