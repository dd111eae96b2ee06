//! Uploads of files from browsers: begins, resumes and evicts them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::failure::{AppFailure, AppResult};
use super::file_upload::{AnnouncedFiles, FileUpload, UploadActivity};
use super::received_files::{ArrivedFile, ReceivedFiles, check_room};
use super::sentence::Sentence;
use super::upload_sentence::{
    MAX_FILES, ended, left_over, not_written, nothing, same_files, silent, too_many,
    too_many_uploads,
};
use mocban_core::locked;
use mocban_store::NewFolder;
use mocban_system::platform;

/// Folder of uploads in the folder of the app.
pub(super) const FOLDER: &str = "uploads";
/// Most uploads that are open at the same time.
const MAX_OPEN: usize = 4;

/// Uploads by their number.
type OpenUploads = BTreeMap<u64, Arc<FileUpload>>;

/// The uploads of this process.
#[derive(Debug)]
pub(super) struct Uploads {
    folder: PathBuf,
    open: Mutex<OpenUploads>,
    next: AtomicU64,
    /// Whether an earlier process left an upload.
    has_left_over: bool,
    /// Returns how many bytes the disk of a folder has room for.
    free_bytes: fn(&Path) -> Option<u64>,
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
            free_bytes: platform::free_bytes,
        }
    }

    /// Returns the folder in which the folders of uploads are.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns whether files can be added to the folder, or the folder to that of the app.
    pub(super) fn may_write(&self) -> bool {
        let made = self.folder.ancestors().find(|folder| folder.is_dir());
        made.is_none_or(platform::may_write)
    }

    /// Begins an upload, or resumes an interrupted one of the same files. Removes uploads that ended or were abandoned, and
    /// interrupted ones if the disk has no room without that. Returns the number of the upload, and the files that need not be
    /// sent again. Waits for the disk.
    ///
    /// # Errors
    /// Refuses too many files, more bytes than the disk has room for, and files that another page is sending.
    pub(super) fn begin(&self, files: &AnnouncedFiles) -> AppResult<(u64, Vec<ArrivedFile>)> {
        let refuse = |sentence| Err(AppFailure::refused(sentence));
        if files.files == 0 {
            return refuse(nothing());
        }
        if files.files > MAX_FILES {
            return refuse(too_many());
        }
        let resumed = self.resume(files);
        let arrived = resumed.iter().flat_map(|(_, arrived)| arrived);
        let bytes = files.bytes;
        let bytes = bytes.saturating_sub(arrived.map(|file| file.size).sum());
        if let Err(why) = self.make_room(bytes) {
            if let Some((id, _)) = resumed {
                self.find(id)?.interrupt(why.clone());
            }
            return refuse(why);
        }
        if let Some(resumed) = resumed {
            return Ok(resumed);
        }
        refuse_same(&locked(&self.open), files)?;
        if !self.make_place(&files.project) {
            return refuse(too_many_uploads());
        }
        let folder = NewFolder::begin(&self.folder);
        let folder = folder.map_err(|error| AppFailure::refused(not_written(&error)))?;
        let received = Box::new(ReceivedFiles::new(folder, Arc::default()));
        let upload = Arc::new(FileUpload::new(files.clone(), received));
        let mut open = locked(&self.open);
        // Others may have begun meanwhile. The files are removed after the lock.
        refuse_same(&open, files)?;
        if open.len() >= MAX_OPEN {
            return refuse(too_many_uploads());
        }
        let id = self.next.fetch_add(1, Ordering::Relaxed);
        open.insert(id, Arc::clone(&upload));
        Ok((id, Vec::new()))
    }

    /// Checks that the disk has room for these bytes. If it has not, removes interrupted uploads, the oldest first, unless all
    /// of them would not be enough.
    ///
    /// # Errors
    /// Returns the reason if less than the reserve would stay free.
    fn make_room(&self, bytes: u64) -> Result<(), Sentence> {
        let Some(parent) = self.folder.parent() else {
            return Ok(());
        };
        loop {
            let free = (self.free_bytes)(parent);
            let checked = check_room(free, bytes);
            let Err(why) = checked else {
                return Ok(());
            };
            let oldest = {
                let mut open = locked(&self.open);
                let paused = paused(&open);
                let kept = paused.iter().map(|(_, id)| open[id].kept_bytes()).sum();
                if check_room(free.map(|free| free.saturating_add(kept)), bytes).is_err() {
                    return Err(why);
                }
                let oldest = paused.into_iter().min();
                oldest.and_then(|(_, id)| open.remove(&id))
            };
            // Its files are removed without the lock.
            drop(oldest.ok_or(why)?);
        }
    }

    /// Resumes an interrupted upload of the same files under a new number, so that the page that sent them before cannot go on
    /// too.
    fn resume(&self, files: &AnnouncedFiles) -> Option<(u64, Vec<ArrivedFile>)> {
        let mut open = locked(&self.open);
        let mut same = open.values().filter(|upload| upload.is_of(files));
        let received = same.find_map(|upload| upload.give_up())?;
        let arrived = received.arrived().to_vec();
        let id = self.next.fetch_add(1, Ordering::Relaxed);
        let upload = FileUpload::new(files.clone(), received);
        open.insert(id, Arc::new(upload));
        Some((id, arrived))
    }

    /// Interrupts the upload of the same files by another page, if nothing more of it arrives. Then it can be resumed.
    pub(super) async fn interrupt_silent(&self, files: &AnnouncedFiles) {
        let silent = {
            let (open, now) = (locked(&self.open), Instant::now());
            let mut same = open.values().filter(|upload| upload.is_of(files));
            let silent = same.find(|upload| upload.activity(now) == Some(UploadActivity::Silent));
            silent.cloned()
        };
        if let Some(silent) = silent {
            silent.cut_off().await;
        }
    }

    /// Removes uploads that ended, and those of closed browsers of which nothing has arrived, but keeps those of other projects
    /// that say why they failed while there is room. Keeps interrupted ones for an hour, but evicts the oldest if the limit is
    /// reached. Returns whether another upload may begin.
    fn make_place(&self, project: &str) -> bool {
        let removed: Vec<_> = {
            let mut open = locked(&self.open);
            let is_useless = |_: &u64, upload: &mut Arc<FileUpload>| {
                upload.is_over() && (upload.is_for(project) || upload.problem().is_none())
            };
            let mut removed: Vec<_> = open.extract_if(.., is_useless).collect();
            if open.len() >= MAX_OPEN {
                removed.extend(open.extract_if(.., |_, upload| upload.is_over()));
            }
            if open.len() >= MAX_OPEN {
                let oldest = paused(&open).into_iter().min();
                removed.extend(oldest.and_then(|(_, id)| open.remove_entry(&id)));
            }
            removed
        };
        // Their files are removed without the lock.
        drop(removed);
        locked(&self.open).len() < MAX_OPEN
    }

    /// Returns an upload.
    ///
    /// # Errors
    /// Returns an error if there is none any more.
    pub(super) fn find(&self, id: u64) -> AppResult<Arc<FileUpload>> {
        let found = locked(&self.open).get(&id).cloned();
        found.ok_or_else(|| AppFailure::refused(ended()))
    }

    /// Says why the last upload of a project failed, until the next one of the project begins.
    pub(super) fn problem(&self, project: &str) -> Option<Sentence> {
        let open = locked(&self.open);
        let last = open.values().rfind(|upload| upload.is_for(project));
        let problem = last.and_then(|upload| upload.problem());
        problem.or_else(|| self.left_over())
    }

    /// Says that an earlier process left an upload, until the next one begins.
    pub(super) fn left_over(&self) -> Option<Sentence> {
        let is_first = self.next.load(Ordering::Relaxed) == 1;
        (self.has_left_over && is_first).then(left_over)
    }
}

/// Returns since when uploads are interrupted, with their numbers.
fn paused(open: &OpenUploads) -> Vec<(Instant, u64)> {
    let uploads = open.iter();
    let paused = uploads.filter_map(|(id, upload)| Some((upload.paused_since()?, *id)));
    paused.collect()
}

/// Refuses files that another page is sending.
///
/// # Errors
/// The failure says whether this page can take over.
fn refuse_same(open: &OpenUploads, files: &AnnouncedFiles) -> AppResult<()> {
    let now = Instant::now();
    let mut same = open.values().filter(|upload| upload.is_of(files));
    match same.find_map(|upload| upload.activity(now)) {
        None => Ok(()),
        Some(UploadActivity::Arriving) => Err(AppFailure::refused(same_files())),
        Some(UploadActivity::Silent) => Err(AppFailure::conflict(silent())),
    }
}

#[cfg(test)]
mod tests;
