//! Packs: the artifacts of a pair in one object of a store. A pack is an uncompressed tar archive, so that other
//! programs can open it, and an artifact can be read at its offset.

use std::io;

use rand::TryRng as _;
use rand::rngs::SysRng;

use super::bucket::Bucket;
use super::bucket_error::BucketError;
use mocban_core::domain::{ArtifactRef, ContentHash, PackLocation};

/// Folder of the packs.
pub(crate) const PACKS: &str = "packs";
/// Length of the header of a file in a tar archive, in bytes.
const HEADER: u64 = 512;
/// Longest pack that is read, in bytes.
const MAX_BYTES: u64 = 1 << 30;

/// A pack that is not stored yet.
#[derive(Debug)]
pub(crate) struct Pack {
    name: String,
    bytes: Vec<u8>,
    locations: Vec<PackLocation>,
}

impl Pack {
    /// Packs artifacts. Equal artifacts give equal bytes.
    ///
    /// The name ends with a random number, so that it is never used again: a pack that no row names may then be removed
    /// without regard to workers that compute the same results.
    pub(crate) fn of<'a>(
        files: impl Iterator<Item = (&'a ArtifactRef, &'a [u8])>,
    ) -> io::Result<Self> {
        let mut archive = tar::Builder::new(Vec::new());
        let mut offsets = Vec::new();
        for (artifact, bytes) in files {
            offsets.push(archive.get_ref().len() as u64 + HEADER);
            let mut header = tar::Header::new_ustar();
            header.set_size(bytes.len() as u64);
            header.set_mode(0o644);
            let name = format!("{}.{}", artifact.hash.to_hex(), artifact.ext);
            archive.append_data(&mut header, name, bytes)?;
        }
        let bytes = archive.into_inner()?;
        let hex = ContentHash::of(&bytes).to_hex();
        let number = SysRng.try_next_u64().map_err(io::Error::other)?;
        let name = format!("{hex}-{number:016x}");
        let located = offsets.into_iter().map(|offset| PackLocation {
            name: name.clone(),
            offset,
        });
        Ok(Self {
            locations: located.collect(),
            name,
            bytes,
        })
    }

    /// Returns where the artifacts are, in the order in which they were given.
    pub(crate) fn locations(&self) -> &[PackLocation] {
        &self.locations
    }

    /// Stores the pack.
    pub(crate) fn store(self, bucket: &Bucket) -> Result<(), BucketError> {
        bucket.write(&key(&self.name), self.bytes)
    }
}

/// Returns the key of a pack.
pub(crate) fn key(name: &str) -> String {
    let folder = name.get(..2).unwrap_or("00");
    format!("{PACKS}/{folder}/{name}.tar")
}

/// Returns the random number in the name of a pack, or `None` if this is no name of a pack. A folder and an extension may
/// surround the name.
pub(crate) fn number_of(name: &str) -> Option<u64> {
    let name = name.rsplit_once('/').map_or(name, |(_, name)| name);
    let (hash, number) = name.strip_suffix(".tar").unwrap_or(name).split_once('-')?;
    let is_hash = hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
    (is_hash && number.len() == 16).then(|| u64::from_str_radix(number, 16).ok())?
}

/// Reads a whole pack.
pub(super) fn read_pack(bucket: &Bucket, name: &str) -> Result<Vec<u8>, BucketError> {
    bucket.read(&key(name), MAX_BYTES)
}

/// Returns the bytes of an artifact, or `None` if the pack is too short for it or holds other bytes.
pub(crate) fn read_from_pack<'a>(
    pack: &'a [u8],
    offset: u64,
    artifact: &ArtifactRef,
) -> Option<&'a [u8]> {
    let start = usize::try_from(offset).ok()?;
    let end = start.checked_add(usize::try_from(artifact.bytes).ok()?)?;
    let bytes = pack.get(start..end)?;
    (ContentHash::of(bytes) == artifact.hash).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::{Pack, key, number_of, read_from_pack, read_pack};
    use crate::NewArtifact;
    use crate::remote::bucket::Bucket;

    #[test]
    fn artifacts_are_read_back_from_a_pack_which_tar_can_open() {
        let files = [&b"depth"[..], b"", b"mask of 600 bytes"]
            .map(|bytes| NewArtifact::new("any", "png", bytes.repeat(40)));
        let pairs = || files.iter().map(|file| (file.reference(), file.bytes()));
        let pack = Pack::of(pairs()).expect("a pack");
        let again = Pack::of(pairs()).expect("a pack");
        assert_eq!(pack.bytes, again.bytes);
        assert_ne!(pack.name, again.name, "names are never used again");
        assert!(number_of(&pack.name).is_some());
        assert_eq!(number_of(&key(&pack.name)), number_of(&pack.name));
        assert_eq!(number_of("packs/ab/notes.tar"), None);
        let locations = pack.locations().to_vec();
        let (bucket, name) = (Bucket::in_memory(), pack.name.clone());
        pack.store(&bucket).expect("stored");
        let bytes = read_pack(&bucket, &name).expect("read");
        for ((artifact, content), location) in pairs().zip(&locations) {
            assert_eq!(
                read_from_pack(&bytes, location.offset, artifact),
                Some(content)
            );
            let moved = read_from_pack(&bytes, location.offset + 1, artifact);
            assert_eq!(moved.is_some(), content.is_empty());
        }
        let mut archive = tar::Archive::new(&bytes[..]);
        let sizes = archive
            .entries()
            .expect("an archive")
            .map(|entry| entry.expect("a file").size());
        assert_eq!(sizes.collect::<Vec<_>>(), [200, 0, 680]);
    }
}
