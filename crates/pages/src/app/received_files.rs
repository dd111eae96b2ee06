//! The files of an upload: their names, their number, and room for them on the disk.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::body::Bytes;
use serde::Serialize;
use tokio::sync::mpsc;

use super::folder_picker::LISTS;
use super::sentence::Sentence;
use super::upload_sentence::{
    MAX_FILES, RESERVE_BYTES, cut, no_room, not_written, nothing, other_file, refused_path,
    too_many_names,
};
use mocban_core::domain::FileKind;
use mocban_core::domain::cancel::poll;
use mocban_lists::manifest::{MESH_EXTENSIONS, PRINT_EXTENSIONS};
use mocban_lists::relative_path::{RelativePath, TakenPaths, extension_of, is_of_system};
use mocban_store::NewFolder;
use mocban_system::failpoint::{self, Point};
use mocban_system::platform;

/// Extensions of boxes of characters on a page.
const BOX_EXTENSIONS: [&str; 3] = ["json", "xml", "txt"];
/// Extension of archives, which are unpacked.
pub(super) const ARCHIVE: &str = "zip";
/// Bytes that are written between two looks at the room on the disk.
const BYTES_PER_LOOK: u64 = 16 << 20;
/// An archive in the folder of files that do not stay.
const ARCHIVE_FILE: &str = "archive";

/// Returns the extensions of files that an import reads, or names as unread.
pub(super) fn importable_extensions() -> impl Iterator<Item = &'static str> {
    MESH_EXTENSIONS
        .into_iter()
        .chain(PRINT_EXTENSIONS)
        .chain(LISTS)
        .chain(BOX_EXTENSIONS)
        .chain(FileKind::unread_extensions())
}

/// A piece of a file as it arrives, or its end.
#[derive(Debug)]
pub(super) enum FilePiece {
    Bytes(Bytes),
    End,
}

/// What has arrived, for the page.
#[derive(Debug, Default)]
pub(super) struct ReceivedCount {
    pub(super) files: AtomicU64,
    pub(super) bytes: AtomicU64,
    pub(super) left_out: AtomicU64,
}

/// A file that has arrived whole, as the browser knows it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct ArrivedFile {
    path: String,
    /// Bytes.
    pub(super) size: u64,
    /// Time of its last change in the browser, in milliseconds since the Unix epoch.
    modified: i64,
}

/// The files of an upload under a hidden name. They are removed if this is dropped before it has its name.
#[derive(Debug)]
pub(super) struct ReceivedFiles {
    folder: NewFolder,
    taken: TakenPaths,
    /// Files and archives that need not be sent again.
    arrived: Vec<ArrivedFile>,
    /// Whether a file has arrived whose time in the browser is not known, so that it would have to be sent again.
    has_unknown: bool,
    /// Names of files that were cut off, which may come again.
    cut_off: BTreeSet<String>,
    unlooked_bytes: u64,
    /// Returns how many bytes the disk of a folder has room for.
    pub(super) free_bytes: fn(&Path) -> Option<u64>,
    pub(super) count: Arc<ReceivedCount>,
}

impl ReceivedFiles {
    /// Starts without files.
    pub(super) fn new(folder: NewFolder, count: Arc<ReceivedCount>) -> Self {
        Self {
            folder,
            taken: TakenPaths::default(),
            arrived: Vec::new(),
            has_unknown: false,
            cut_off: BTreeSet::new(),
            unlooked_bytes: 0,
            free_bytes: platform::free_bytes,
            count,
        }
    }

    /// Returns the files and archives that need not be sent again, or none if some are not known.
    pub(super) fn arrived(&self) -> &[ArrivedFile] {
        if self.has_unknown { &[] } else { &self.arrived }
    }

    /// Notes a file or an archive that has arrived whole, with its size in bytes.
    pub(super) fn note_arrived(&mut self, path: &RelativePath, size: u64, modified: Option<i64>) {
        let Some(modified) = modified else {
            self.has_unknown = true;
            return;
        };
        self.arrived.push(ArrivedFile {
            path: path.as_str().to_owned(),
            size,
            modified,
        });
    }

    /// Writes a file as it arrives. `modified` is when it was last changed in the browser, if that is known. A file that does
    /// not arrive whole is removed, and may come again.
    ///
    /// # Errors
    /// Returns the reason if the path is refused, the disk is full, or the file does not arrive whole.
    pub(super) fn receive(
        &mut self,
        path: &RelativePath,
        modified: Option<i64>,
        pieces: mpsc::Receiver<FilePiece>,
    ) -> Result<(), Sentence> {
        if !is_importable(path.as_str()) {
            return Err(other_file(path.as_str()));
        }
        if !self.cut_off.remove(path.as_str()) {
            self.add(path)?;
        }
        let before = self.count.bytes.load(Ordering::Relaxed);
        let file = self.create(path).map_err(|error| not_written(&error))?;
        if let Err(why) = self.write(file, pieces) {
            let _ = std::fs::remove_file(path.below(self.folder.path()));
            self.count.bytes.store(before, Ordering::Relaxed);
            self.cut_off.insert(path.as_str().to_owned());
            return Err(why);
        }
        let size = self.count.bytes.load(Ordering::Relaxed) - before;
        self.note_arrived(path, size, modified);
        self.finish_file(path);
        Ok(())
    }

    /// Writes an archive as it arrives, to a file that does not stay. Returns it with its size in bytes. One that does not
    /// arrive whole may come again.
    ///
    /// # Errors
    /// Returns the reason if the disk is full, or the file does not arrive whole.
    pub(super) fn receive_archive(
        &mut self,
        pieces: mpsc::Receiver<FilePiece>,
    ) -> Result<(File, u64), Sentence> {
        let before = self.count.bytes.load(Ordering::Relaxed);
        let path = self.folder.scratch().join(ARCHIVE_FILE);
        let mut options = OpenOptions::new();
        options.create(true).truncate(true).read(true).write(true);
        let file = options.open(path).map_err(|error| not_written(&error))?;
        let written = self.write(file, pieces);
        if written.is_err() {
            self.count.bytes.store(before, Ordering::Relaxed);
        }
        let size = self.count.bytes.load(Ordering::Relaxed) - before;
        Ok((written?, size))
    }

    fn write(
        &mut self,
        mut file: File,
        mut pieces: mpsc::Receiver<FilePiece>,
    ) -> Result<File, Sentence> {
        loop {
            poll();
            match pieces.blocking_recv() {
                Some(FilePiece::Bytes(bytes)) => self
                    .append(&mut file, &bytes)
                    .map_err(|error| not_written(&error))?,
                Some(FilePiece::End) => return Ok(file),
                None => return Err(cut()),
            }
        }
    }

    /// Adds the name of a file that will be written.
    ///
    /// # Errors
    /// Returns the reason if there are too many files and folders, or there is such a name already.
    pub(super) fn add(&mut self, path: &RelativePath) -> Result<(), Sentence> {
        let added = self.taken.insert(path);
        added.map_err(|fault| refused_path(path.as_str(), &fault))?;
        if self.taken.count() as u64 > MAX_FILES {
            return Err(too_many_names());
        }
        Ok(())
    }

    /// Creates a file and its folders.
    pub(super) fn create(&self, path: &RelativePath) -> io::Result<File> {
        let path = path.below(self.folder.path());
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        File::create_new(path)
    }

    /// Appends bytes to a file.
    ///
    /// # Errors
    /// Returns an error if the disk is full or will be soon.
    pub(super) fn append(&mut self, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        file.write_all(bytes)?;
        let len = bytes.len() as u64;
        self.count.bytes.fetch_add(len, Ordering::Relaxed);
        self.unlooked_bytes += len;
        if self.unlooked_bytes < BYTES_PER_LOOK {
            return Ok(());
        }
        self.unlooked_bytes = 0;
        match (self.free_bytes)(self.folder.path()) {
            Some(free) if free < RESERVE_BYTES => Err(ErrorKind::StorageFull.into()),
            _ => Ok(()),
        }
    }

    /// Counts a file that is whole.
    pub(super) fn finish_file(&self, path: &RelativePath) {
        self.count.files.fetch_add(1, Ordering::Relaxed);
        failpoint::hit("upload", Point::Written, Some(&path.as_str()));
    }

    /// Refuses files for which the disk has no room.
    ///
    /// # Errors
    /// Returns the reason if less than the reserve would stay free.
    pub(super) fn check_room(&self, bytes: u64) -> Result<(), Sentence> {
        check_room((self.free_bytes)(self.folder.path()), bytes)
    }

    /// Gives the files their folder, and returns its path.
    ///
    /// # Errors
    /// Returns the reason if there are no files, or the folder cannot be renamed.
    pub(super) fn place(self, name: &str) -> Result<PathBuf, Sentence> {
        if self.count.files.load(Ordering::Relaxed) == 0 {
            return Err(nothing());
        }
        let _ = std::fs::remove_file(self.folder.scratch().join(ARCHIVE_FILE));
        failpoint::hit("upload", Point::Synced, None);
        self.folder.place(name).map_err(|error| not_written(&error))
    }
}

/// Refuses files for which a disk has no room. `free` is the room, if it is known.
///
/// # Errors
/// Returns the reason if less than the reserve would stay free.
pub(super) fn check_room(free: Option<u64>, bytes: u64) -> Result<(), Sentence> {
    match free {
        Some(free) if free < bytes.saturating_add(RESERVE_BYTES) => Err(no_room(bytes, free)),
        _ => Ok(()),
    }
}

/// Takes the pieces of a file that is left out, up to its end. Polls for a cancellation.
///
/// # Errors
/// Returns the reason if the file does not arrive whole.
pub(super) fn skip(mut pieces: mpsc::Receiver<FilePiece>) -> Result<(), Sentence> {
    loop {
        poll();
        match pieces.blocking_recv() {
            Some(FilePiece::Bytes(_)) => {}
            Some(FilePiece::End) => return Ok(()),
            None => return Err(cut()),
        }
    }
}

/// Returns whether an import reads a file, or names it as unread. Its path may be one that is refused.
pub(super) fn is_importable(path: &str) -> bool {
    let is_known = |extension: String| importable_extensions().any(|known| known == extension);
    !is_of_system(path) && extension_of(path).is_some_and(is_known)
}
