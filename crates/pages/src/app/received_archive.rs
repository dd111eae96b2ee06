//! A file of an upload, or those of a ZIP archive: all are checked before the first is unpacked.

use std::fs::File;
use std::sync::atomic::Ordering;

use tokio::sync::mpsc;

use super::received_files::{ARCHIVE, FilePiece, ReceivedFiles, is_importable, skip};
use super::sentence::Sentence;
use super::upload_sentence::{
    MAX_FILES, MAX_RATIO, bomb, link, not_utf8, not_written, refused_archive, refused_path,
};
use mocban_core::domain::cancel::poll;
use mocban_lists::relative_path::{RelativePath, is_of_system};
use mocban_lists::zip::{ZipArchive, ZippedFile};

/// Archives that unpack to fewer bytes are never refused for their size.
const HARMLESS_BYTES: u64 = 64 << 20;

/// Receives a file, unpacks an archive, or leaves a file of a system out. `modified` is as for [`ReceivedFiles::receive`].
///
/// # Errors
/// Returns the reason if the file is refused, cannot be written or does not arrive whole.
pub(super) fn take_file(
    received: &mut ReceivedFiles,
    path: &str,
    modified: Option<i64>,
    arriving: mpsc::Receiver<FilePiece>,
) -> Result<(), Sentence> {
    if is_of_system(path) {
        return skip(arriving);
    }
    let safe = RelativePath::new(path).map_err(|fault| refused_path(path, &fault))?;
    if safe.extension().as_deref() == Some(ARCHIVE) {
        let (archive, size) = received.receive_archive(arriving)?;
        unpack(received, &archive, &safe)?;
        received.note_arrived(&safe, size, modified);
        return Ok(());
    }
    received.receive(&safe, modified, arriving)
}

/// Unpacks the scans, images and lists of an archive beside its own path. Polls for a cancellation.
///
/// # Errors
/// Returns the reason if the archive is damaged or too large, or a file in it is refused or cannot be written.
fn unpack(received: &mut ReceivedFiles, archive: &File, at: &RelativePath) -> Result<(), Sentence> {
    let refuse = |error| refused_archive(at.as_str(), &error);
    let zip = ZipArchive::open(archive, MAX_FILES as usize).map_err(refuse)?;
    let (mut files, mut bytes) = (Vec::new(), 0_u64);
    for file in zip.files() {
        poll();
        let name = file.shown_name();
        // The name of a file that is left out need not be safe.
        if file.is_folder() || is_of_system(&name) {
            continue;
        }
        if !is_importable(&name) {
            received.count.left_out.fetch_add(1, Ordering::Relaxed);
            continue;
        }
        let path = checked(file, at)?;
        file.check().map_err(refuse)?;
        received.add(&path)?;
        bytes = bytes.saturating_add(file.size());
        files.push((file, path));
    }
    if bytes > HARMLESS_BYTES.max(zip.packed_len().saturating_mul(MAX_RATIO)) {
        return Err(bomb(at.as_str()));
    }
    received.check_room(bytes)?;
    for (file, path) in files {
        let target = received.create(&path);
        let mut target = target.map_err(|error| not_written(&error))?;
        let unpacked = zip.unpack(file, file.size(), &mut |piece| {
            poll();
            received.append(&mut target, piece)
        });
        unpacked.map_err(refuse)?;
        received.finish_file(&path);
    }
    Ok(())
}

/// Returns the path of a file in an archive.
fn checked(file: &ZippedFile, at: &RelativePath) -> Result<RelativePath, Sentence> {
    let name = file.name();
    let name = name.ok_or_else(|| not_utf8(at.as_str(), &file.shown_name()))?;
    let path = at.beside(name);
    let path = path.map_err(|fault| refused_path(name, &fault))?;
    if file.is_link() {
        return Err(link(at.as_str(), name));
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind;
    use std::path::Path;
    use std::sync::Arc;
    use std::sync::atomic::Ordering;

    use axum::body::Bytes;
    use tokio::sync::mpsc;

    use super::take_file;
    use crate::app::received_files::{FilePiece, ReceivedFiles, check_room};
    use crate::app::sentence::Sentence;
    use crate::app::upload_sentence::{RESERVE_BYTES, no_room, not_written};
    use mocban_lists::workbook::test_helpers::archive;
    use mocban_store::NewFolder;

    /// Bytes of a piece. The disk is looked at after 16 of them.
    const PIECE: usize = 1 << 20;

    /// Starts without files on a disk with this room.
    fn on_disk(dir: &Path, free_bytes: fn(&Path) -> Option<u64>) -> ReceivedFiles {
        let folder = NewFolder::begin(dir).expect("a folder");
        let mut received = ReceivedFiles::new(folder, Arc::default());
        received.free_bytes = free_bytes;
        received
    }

    /// Takes a file that arrives whole, as a piece that comes this many times.
    fn take(
        received: &mut ReceivedFiles,
        path: &str,
        piece: &Bytes,
        times: usize,
    ) -> Result<(), Sentence> {
        let (sender, arriving) = mpsc::channel(times + 1);
        let pieces = (0..times).map(|_| FilePiece::Bytes(piece.clone()));
        for piece in pieces.chain([FilePiece::End]) {
            sender.try_send(piece).expect("room for all pieces");
        }
        take_file(received, path, Some(1), arriving)
    }

    #[test]
    fn a_file_that_needs_the_reserve_is_removed_and_may_come_again() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let mut received = on_disk(dir.path(), |_| Some(RESERVE_BYTES - 1));
        let piece = Bytes::from(vec![b'x'; PIECE]);
        take(&mut received, "a.stl", &piece, 1).expect("the disk is not looked at");
        let full = take(&mut received, "b.stl", &piece, 16).expect_err("the disk is nearly full");
        let expected = not_written(&ErrorKind::StorageFull.into());
        assert_eq!(full, expected);
        assert_eq!(received.count.files.load(Ordering::Relaxed), 1);
        assert_eq!(received.count.bytes.load(Ordering::Relaxed), PIECE as u64);
        received.free_bytes = |_| Some(RESERVE_BYTES);
        take(&mut received, "b.stl", &piece, 16).expect("there is room again");
        let stored = received.place("x").expect("stored");
        let sizes = ["a.stl", "b.stl"].map(|file| {
            let file = std::fs::metadata(stored.join(file)).expect("a file");
            file.len()
        });
        assert_eq!(sizes, [PIECE as u64, 16 * PIECE as u64]);
    }

    #[test]
    fn an_archive_whose_files_need_the_reserve_is_not_unpacked() {
        let files = [("a.stl", "solid a"), ("b.stl", "solid b")];
        let zip = Bytes::from(archive(&files, true));
        let dir = tempfile::tempdir().expect("a temporary directory");
        let mut received = on_disk(dir.path(), |_| Some(RESERVE_BYTES + 13));
        let why = take(&mut received, "x.zip", &zip, 1).expect_err("a byte is missing");
        assert_eq!(why, no_room(14, RESERVE_BYTES + 13));
        assert_eq!(received.count.files.load(Ordering::Relaxed), 0);
        let mut received = on_disk(dir.path(), |_| Some(RESERVE_BYTES + 14));
        take(&mut received, "x.zip", &zip, 1).expect("there is room");
        assert_eq!(received.count.files.load(Ordering::Relaxed), 2);
    }

    #[test]
    fn files_of_ten_gigabytes_are_refused_before_they_are_sent() {
        const FILES: u64 = 10_000_000_000;
        let why = check_room(Some(FILES), FILES).expect_err("nothing would stay free");
        assert_eq!(why, no_room(FILES, FILES));
        check_room(Some(FILES), u64::MAX).expect_err("no disk is so large");
        check_room(Some(FILES + RESERVE_BYTES), FILES).expect("the reserve stays free");
        check_room(None, FILES).expect("the room is not known");
    }
}
