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
