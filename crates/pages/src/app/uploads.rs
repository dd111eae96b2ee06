//! The uploads of files from browsers: how they begin, are resumed, and make place for others.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::failure::{AppFailure, AppResult};
use super::file_upload::FileUpload;
use super::received_files::{ArrivedFile, ReceivedCount, ReceivedFiles, check_room};
use super::sentence::Sentence;
use super::upload_sentence::{
    MAX_FILES, ended, left_over, not_written, nothing, silent, too_many, too_many_uploads,
};
use mocban_store::NewFolder;

/// Folder of uploads in the folder of the app.
pub(super) const FOLDER: &str = "uploads";
/// Most uploads that are open at the same time.
const MAX_OPEN: usize = 4;

/// The uploads of this process.
#[derive(Debug)]
pub(super) struct Uploads {
    folder: PathBuf,
    open: Mutex<BTreeMap<u64, Arc<FileUpload>>>,
    next: AtomicU64,
    /// Whether an earlier process left an upload.
    has_left_over: bool,
}

impl Uploads {
    /// Returns the uploads for an app of a folder. Removes what an earlier process left.
    pub(super) fn new(folder: &Path) -> Self {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let folder = folder.join(FOLDER);
        let has_left_over = NewFolder::remove_unfinished(&folder) > 0;
        Self {
            folder,
            open: Mutex::default(),
            next: AtomicU64::new(1),
            has_left_over,
        }
    }

    /// Returns the folder in which the folders of uploads are.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Begins an upload, or resumes an interrupted one of this name. Removes uploads that ended or were abandoned. Returns the
    /// number of the upload, and the files that need not be sent again. Waits for the disk.
    ///
    /// # Errors
    /// Refuses too many files, more bytes than the disk has room for, and files whose connection seems to be cut.
    pub(super) fn begin(
        &self,
        name: String,
        files: u64,
        bytes: u64,
    ) -> AppResult<(u64, Vec<ArrivedFile>)> {
        let refuse = |sentence| Err(AppFailure::refused(sentence));
        if files == 0 {
            return refuse(nothing());
        }
        if files > MAX_FILES {
            return refuse(too_many());
        }
        let resumed = self.resume(&name, files);
        let arrived = resumed.iter().flat_map(|(_, arrived)| arrived);
        let bytes = bytes.saturating_sub(arrived.map(|file| file.size).sum());
        if let Some(parent) = self.folder.parent()
            && let Err(why) = check_room(parent, bytes)
        {
            if let Some((id, _)) = resumed {
                self.find(id)?.interrupt(why.clone());
            }
            return refuse(why);
        }
        if let Some(resumed) = resumed {
            return Ok(resumed);
        }
        if self.has_silent(&name) {
            return refuse(silent());
        }
        if !self.make_place() {
            return refuse(too_many_uploads());
        }
        let folder = NewFolder::begin(&self.folder);
        let folder = folder.map_err(|error| AppFailure::refused(not_written(&error)))?;
        let count = Arc::<ReceivedCount>::default();
        let received = ReceivedFiles::new(folder, count);
        let upload = Arc::new(FileUpload::new(name, files, received));
        let mut open = self.lock();
        // Others may have begun meanwhile. The files are removed after the lock.
        if open.len() >= MAX_OPEN {
            return refuse(too_many_uploads());
        }
        let id = self.next.fetch_add(1, Ordering::Relaxed);
        open.insert(id, Arc::clone(&upload));
        Ok((id, Vec::new()))
    }

    /// Resumes an interrupted upload of this name, which then has this number of files.
    fn resume(&self, name: &str, files: u64) -> Option<(u64, Vec<ArrivedFile>)> {
        let open = self.lock();
        let mut named = open.iter().filter(|(_, upload)| upload.name == name);
        named.find_map(|(id, upload)| Some((*id, upload.resume(files)?)))
    }

    /// Returns whether an upload of this name seems to have lost its connection after files had arrived.
    fn has_silent(&self, name: &str) -> bool {
        let now = Instant::now();
        let open = self.lock();
        let mut named = open.values().filter(|upload| upload.name == name);
        named.any(|upload| upload.is_silent(now))
    }

    /// Removes uploads that ended, and those whose browser is closed. Interrupted ones stay for a while, except for the
    /// oldest if there is no place. Returns whether there is place for another.
    fn make_place(&self) -> bool {
        let removed: Vec<_> = {
            let mut open = self.lock();
            let is_over = |_: &u64, upload: &mut Arc<FileUpload>| upload.is_over();
            let mut removed: Vec<_> = open.extract_if(.., is_over).collect();
            if open.len() >= MAX_OPEN {
                let paused = open.iter();
                let paused = paused.filter_map(|(id, upload)| Some((upload.paused_since()?, *id)));
                let oldest = paused.min();
                removed.extend(oldest.and_then(|(_, id)| open.remove_entry(&id)));
            }
            removed
        };
        // Their files are removed without the lock.
        drop(removed);
        self.lock().len() < MAX_OPEN
    }

    /// Returns an upload.
    ///
    /// # Errors
    /// Returns an error if there is none any more.
    pub(super) fn find(&self, id: u64) -> AppResult<Arc<FileUpload>> {
        let found = self.lock().get(&id).cloned();
        found.ok_or_else(|| AppFailure::refused(ended()))
    }

    /// Says why the last upload failed, until the next one begins.
    pub(super) fn problem(&self) -> Option<Sentence> {
        let open = self.lock();
        let last = open.last_key_value();
        let last = last.and_then(|(_, upload)| upload.problem());
        let is_first = open.is_empty() && self.next.load(Ordering::Relaxed) == 1;
        last.or_else(|| (self.has_left_over && is_first).then(left_over))
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<u64, Arc<FileUpload>>> {
        // Each change is a single insertion or removal.
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;
