//! An upload of files from a browser: they are written one after another, and get their folder when all are there.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::mpsc;
use tokio::task::spawn_blocking;

use super::failure::{AppFailure, AppResult};
use super::file_in_progress::{FileInProgress, LastPiece};
use super::received_archive::take_file;
use super::received_files::{ArrivedFile, ReceivedCount, ReceivedFiles};
use super::sentence::Sentence;
use super::upload_sentence::{busy, cut, cut_with_rest, ended, incomplete, storing};
use crate::local_server::WorkFailed;
use mocban_core::domain::cancel::{CancelGuard, CancelToken};

/// A browser that has sent nothing for this long between two files is closed.
const MAX_IDLE: Duration = Duration::from_secs(30);
/// A browser of which nothing arrives for this long in a file may have lost its connection.
pub(super) const MAX_SILENT: Duration = Duration::from_secs(5);
/// How long the files of an interrupted upload are kept, so that it can be resumed.
pub(super) const MAX_KEPT: Duration = Duration::from_hours(1);
/// Pieces of a file that wait to be written. A piece has at most 64 KiB.
const WAITING_PIECES: usize = 4;

/// Files that a browser sends.
#[derive(Debug)]
pub(super) struct FileUpload {
    pub(super) name: String,
    /// Number of files and archives that the browser will send, and that have arrived.
    announced: AtomicU64,
    pub(super) arrived: AtomicU64,
    pub(super) count: Arc<ReceivedCount>,
    pub(super) last_piece: LastPiece,
    state: Mutex<UploadState>,
}

/// What becomes of an upload.
#[derive(Debug)]
pub(super) enum UploadState {
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

impl FileUpload {
    /// Waits for the first of this number of files.
    pub(super) fn new(name: String, files: u64, received: ReceivedFiles) -> Self {
        Self {
            name,
            announced: AtomicU64::new(files),
            arrived: AtomicU64::new(0),
            count: Arc::clone(&received.count),
            last_piece: LastPiece::default(),
            state: Mutex::new(UploadState::Ready(Box::new(received), Instant::now())),
        }
    }

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
    pub(super) fn resume(&self, files: u64) -> Option<Vec<ArrivedFile>> {
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
    pub(super) fn interrupt(&self, why: Sentence) {
        let mut state = self.lock();
        *state = match std::mem::replace(&mut *state, UploadState::Storing) {
            UploadState::Ready(received, _) => UploadState::Paused(received, Instant::now(), why),
            other => other,
        };
    }

    /// Takes the files for a thread that works on them, with the state of the upload meanwhile.
    pub(super) fn take(&self, meanwhile: UploadState) -> AppResult<Box<ReceivedFiles>> {
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

    pub(super) fn is_over(&self) -> bool {
        match &*self.lock() {
            UploadState::Ready(_, since) => since.elapsed() > MAX_IDLE,
            UploadState::Paused(_, since, _) => since.elapsed() > MAX_KEPT,
            UploadState::Busy(_) | UploadState::Storing => false,
            UploadState::Ended(_) => true,
        }
    }

    pub(super) fn paused_since(&self) -> Option<Instant> {
        match *self.lock() {
            UploadState::Paused(_, since, _) => Some(since),
            _ => None,
        }
    }

    /// Returns whether a file stopped arriving after others had arrived.
    pub(super) fn is_silent(&self, now: Instant) -> bool {
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

    pub(super) fn lock(&self) -> MutexGuard<'_, UploadState> {
        // Each change is a single assignment.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Stores what became of the files of an upload when it is dropped, also after a panic.
pub(super) struct UploadEnding {
    upload: Arc<FileUpload>,
    next: UploadState,
}

impl UploadEnding {
    pub(super) const fn of(upload: Arc<FileUpload>) -> Self {
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
