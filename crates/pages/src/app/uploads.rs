//! Uploads of files from a browser: their files are written one after another, and get their folder when all are there.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::mpsc;
use tokio::task::spawn_blocking;

use super::failure::{AppFailure, AppResult};
use super::file_in_progress::{FileInProgress, LastPiece};
use super::received_archive::take_file;
use super::received_files::{ArrivedFile, ReceivedCount, ReceivedFiles, check_room};
use super::sentence::Sentence;
use super::upload_sentence::{
    MAX_FILES, busy, cut, cut_with_rest, ended, incomplete, left_over, not_written, nothing,
    silent, storing, too_many, too_many_uploads,
};
use crate::local_server::WorkFailed;
use mocban_core::domain::cancel::{CancelGuard, CancelToken};
use mocban_store::NewFolder;

/// Folder of uploads in the folder of the app.
pub(super) const FOLDER: &str = "uploads";
/// Most uploads that are open at the same time.
const MAX_OPEN: usize = 4;
/// A browser that has sent nothing for this long between two files is closed.
const MAX_IDLE: Duration = Duration::from_secs(30);
/// A browser of which nothing arrives for this long in a file may have lost its connection.
const MAX_SILENT: Duration = Duration::from_secs(5);
/// How long the files of an interrupted upload are kept, so that it can be resumed.
const MAX_KEPT: Duration = Duration::from_hours(1);
/// Pieces of a file that wait to be written. A piece has at most 64 KiB.
const WAITING_PIECES: usize = 4;

/// The uploads of this process.
#[derive(Debug)]
pub(super) struct Uploads {
    folder: PathBuf,
    open: Mutex<BTreeMap<u64, Arc<FileUpload>>>,
    next: AtomicU64,
    /// Whether an earlier process left an upload.
    has_left_over: bool,
}

/// Files that a browser sends.
#[derive(Debug)]
pub(super) struct FileUpload {
    name: String,
    /// Number of files and archives that the browser will send, and that have arrived.
    announced: AtomicU64,
    arrived: AtomicU64,
    pub(super) count: Arc<ReceivedCount>,
    last_piece: LastPiece,
    state: Mutex<UploadState>,
}

#[derive(Debug)]
enum UploadState {
    /// Waits for the next file since then.
    Ready(Box<ReceivedFiles>, Instant),
    /// A thread has the files.
    Busy(CancelToken),
    /// A thread gives the files their folder, which cannot be cancelled.
    Storing,
    /// It was interrupted at that time, for this reason. It can be resumed with the files that have not arrived.
    Paused(Box<ReceivedFiles>, Instant, Sentence),
    /// Nothing is kept, or all has its folder. Says why if it failed.
    Ended(Option<Sentence>),
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
        let received = Box::new(ReceivedFiles::new(folder, Arc::clone(&count)));
        let upload = FileUpload {
            name,
            announced: AtomicU64::new(files),
            arrived: AtomicU64::new(0),
            count,
            last_piece: LastPiece::default(),
            state: Mutex::new(UploadState::Ready(received, Instant::now())),
        };
        let upload = Arc::new(upload);
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

impl FileUpload {
    /// Starts to write a file on a thread of its own.
    ///
    /// # Errors
    /// Refuses a file whose path is not safe, or while another file of the upload is arriving. After a refused path, nothing
    /// of the upload is kept.
    pub(super) fn start(
        self: &Arc<Self>,
        path: &str,
        modified: Option<i64>,
    ) -> AppResult<FileInProgress> {
        let token = CancelToken::default();
        let received = self.take(UploadState::Busy(token.clone()))?;
        self.last_piece.set(Some(Instant::now()));
        let (pieces, arriving) = mpsc::channel(WAITING_PIECES);
        let cancels = CancelGuard(token.clone());
        let (upload, path) = (Arc::clone(self), path.to_owned());
        let written = spawn_blocking(move || {
            let mut ending = UploadEnding::of(upload);
            let work = token.run(|| {
                let mut received = received;
                match take_file(&mut received, &path, modified, arriving) {
                    Ok(()) => Ok(received),
                    Err(why) if why == cut() && !received.arrived().is_empty() => {
                        let why = cut_with_rest(received.arrived().len() as u64);
                        Err((why, Some(received)))
                    }
                    Err(why) => Err((why, None)),
                }
            });
            // What is not kept was removed before this.
            let (next, outcome) = match work {
                Ok(Ok(received)) => {
                    ending.upload.arrived.fetch_add(1, Ordering::Relaxed);
                    (UploadState::Ready(received, Instant::now()), Ok(()))
                }
                Ok(Err((why, Some(received)))) => {
                    let next = UploadState::Paused(received, Instant::now(), why.clone());
                    (next, Err(why))
                }
                Ok(Err((why, None))) => (UploadState::Ended(Some(why.clone())), Err(why)),
                Err(_cancelled) => (UploadState::Ended(Some(cut())), Err(cut())),
            };
            ending.next = next;
            outcome
        });
        Ok(FileInProgress {
            pieces,
            written,
            last_piece: self.last_piece.clone(),
            cancels,
        })
    }

    /// Gives the files their folder. Returns its path.
    ///
    /// # Errors
    /// Refuses an upload of which files are missing. Nothing of it is kept then.
    pub(super) async fn finish(self: &Arc<Self>) -> AppResult<PathBuf> {
        let received = self.take(UploadState::Storing)?;
        let upload = Arc::clone(self);
        let placed = spawn_blocking(move || {
            let mut ending = UploadEnding::of(Arc::clone(&upload));
            let arrived = upload.arrived.load(Ordering::Relaxed);
            let announced = upload.announced.load(Ordering::Relaxed);
            let placed = if arrived == announced {
                received.place(&upload.name)
            } else {
                drop(received);
                Err(incomplete(arrived, announced))
            };
            ending.next = UploadState::Ended(placed.as_ref().err().cloned());
            placed
        });
        let placed = placed.await.map_err(|_panicked| WorkFailed)?;
        placed.map_err(AppFailure::refused)
    }

    /// Ends the upload, and removes its files.
    ///
    /// # Errors
    /// Refuses an upload whose files get their folder.
    pub(super) fn cancel(&self) -> AppResult<()> {
        let before = {
            let mut state = self.lock();
            if matches!(*state, UploadState::Storing) {
                return Err(AppFailure::refused(storing()));
            }
            std::mem::replace(&mut *state, UploadState::Ended(None))
        };
        if let UploadState::Busy(token) = &before {
            token.cancel();
        }
        Ok(())
    }

    /// Says why the upload failed.
    pub(super) fn problem(&self) -> Option<Sentence> {
        match &*self.lock() {
            UploadState::Ended(why) => why.clone(),
            UploadState::Paused(.., why) => Some(why.clone()),
            UploadState::Ready(..) | UploadState::Busy(_) | UploadState::Storing => None,
        }
    }

    /// Resumes the upload with this number of files, if it was interrupted or its browser is closed. Returns the files that
    /// need not be sent again.
    fn resume(&self, files: u64) -> Option<Vec<ArrivedFile>> {
        let mut state = self.lock();
        let received = match std::mem::replace(&mut *state, UploadState::Storing) {
            UploadState::Paused(received, ..) => received,
            UploadState::Ready(received, since)
                if since.elapsed() > MAX_IDLE && !received.arrived().is_empty() =>
            {
                received
            }
            other => {
                *state = other;
                return None;
            }
        };
        let arrived = received.arrived().to_vec();
        self.announced.store(files, Ordering::Relaxed);
        self.arrived.store(arrived.len() as u64, Ordering::Relaxed);
        *state = UploadState::Ready(received, Instant::now());
        Some(arrived)
    }

    /// Keeps the files of an upload that cannot be continued now.
    fn interrupt(&self, why: Sentence) {
        let mut state = self.lock();
        *state = match std::mem::replace(&mut *state, UploadState::Storing) {
            UploadState::Ready(received, _) => UploadState::Paused(received, Instant::now(), why),
            other => other,
        };
    }

    /// Takes the files for a thread that works on them, with the state of the upload meanwhile.
    fn take(&self, meanwhile: UploadState) -> AppResult<Box<ReceivedFiles>> {
        let mut state = self.lock();
        match std::mem::replace(&mut *state, meanwhile) {
            UploadState::Ready(received, _) => Ok(received),
            other => {
                let why = match &other {
                    UploadState::Ended(Some(why)) | UploadState::Paused(.., why) => why.clone(),
                    UploadState::Ended(None) => ended(),
                    UploadState::Storing => storing(),
                    UploadState::Ready(..) | UploadState::Busy(_) => busy(),
                };
                *state = other;
                Err(AppFailure::refused(why))
            }
        }
    }

    /// Stores what became of the files, unless the upload was cancelled meanwhile.
    fn settle(&self, next: UploadState) {
        let mut state = self.lock();
        let unused = match &*state {
            UploadState::Busy(_) | UploadState::Storing => std::mem::replace(&mut *state, next),
            UploadState::Ready(..) | UploadState::Paused(..) | UploadState::Ended(_) => next,
        };
        drop(state);
        // Removes files of an upload that was cancelled.
        drop(unused);
    }

    fn is_over(&self) -> bool {
        match &*self.lock() {
            UploadState::Ready(_, since) => since.elapsed() > MAX_IDLE,
            UploadState::Paused(_, since, _) => since.elapsed() > MAX_KEPT,
            UploadState::Busy(_) | UploadState::Storing => false,
            UploadState::Ended(_) => true,
        }
    }

    fn paused_since(&self) -> Option<Instant> {
        match *self.lock() {
            UploadState::Paused(_, since, _) => Some(since),
            _ => None,
        }
    }

    /// Returns whether a file stopped arriving after others had arrived.
    fn is_silent(&self, now: Instant) -> bool {
        let last = self.last_piece.get();
        last.is_some_and(|last| now.duration_since(last) > MAX_SILENT)
            && matches!(*self.lock(), UploadState::Busy(_))
            && self.arrived.load(Ordering::Relaxed) > 0
    }

    /// Ends an upload that nobody has resumed for [`MAX_KEPT`], and removes its files. Returns whether it has ended.
    pub(super) fn end_if_left(&self, now: Instant) -> bool {
        let mut state = self.lock();
        let is_left = match &*state {
            UploadState::Ready(_, since) | UploadState::Paused(_, since, _) => {
                now.duration_since(*since) > MAX_KEPT
            }
            UploadState::Busy(_) | UploadState::Storing => false,
            UploadState::Ended(_) => return true,
        };
        let left = is_left.then(|| std::mem::replace(&mut *state, UploadState::Ended(None)));
        drop(state);
        // Removes the files without the lock.
        left.is_some()
    }

    fn lock(&self) -> MutexGuard<'_, UploadState> {
        // Each change is a single assignment.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Stores what became of the files of an upload when it is dropped, also after a panic.
struct UploadEnding {
    upload: Arc<FileUpload>,
    next: UploadState,
}

impl UploadEnding {
    const fn of(upload: Arc<FileUpload>) -> Self {
        Self {
            upload,
            next: UploadState::Ended(None),
        }
    }
}

impl Drop for UploadEnding {
    fn drop(&mut self) {
        let next = std::mem::replace(&mut self.next, UploadState::Ended(None));
        self.upload.settle(next);
    }
}

#[cfg(test)]
mod tests;
