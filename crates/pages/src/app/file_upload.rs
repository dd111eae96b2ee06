//! An upload of files from a browser: they are written one after another, and get their folder when all are there.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use serde::Deserialize;
use tokio::sync::{Notify, mpsc, oneshot};
use tokio::task::spawn_blocking;

use super::failure::{AppFailure, AppResult};
use super::file_in_progress::{FileInProgress, LastPiece};
use super::received_archive::take_file;
use super::received_files::{ReceivedCount, ReceivedFiles};
use super::sentence::Sentence;
use super::upload_sentence::{busy, cut, cut_with_rest, ended, incomplete, storing, taken_over};
use crate::local_server::WorkFailed;
use mocban_core::domain::cancel::CancelToken;
use mocban_core::locked;
use mocban_system::failpoint::time_scale;

/// A browser that has sent nothing for this long between two files is closed.
const MAX_IDLE: Duration = Duration::from_secs(30);
/// A browser of which nothing arrives for this long in a file may have lost its connection.
pub(super) const MAX_SILENT: Duration = Duration::from_secs(5);
/// How long the files of an interrupted upload are kept, so that it can be resumed.
pub(super) const MAX_KEPT: Duration = Duration::from_hours(1);
/// How long a file that is interrupted may take to be removed.
const MAX_SETTLING: Duration = Duration::from_secs(10);
/// Pieces of a file that wait to be written. A piece has at most 64 KiB.
const WAITING_PIECES: usize = 4;

/// What a browser will send.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AnnouncedFiles {
    /// Name of the folder that the files get.
    pub(super) name: String,
    /// Hash of the paths, sizes and times of all files. Empty if it is not known: then the upload cannot be resumed.
    #[serde(default)]
    pub(super) content: String,
    /// Number of files and archives.
    pub(super) files: u64,
    /// Total size of the files and archives, bytes.
    pub(super) bytes: u64,
    /// The project for which the page sends them; empty for a new one.
    #[serde(default)]
    pub(super) project: String,
    /// Whether the upload of the same files by another page is interrupted first, if nothing more of it arrives.
    #[serde(default)]
    pub(super) take_over: bool,
}

/// Whether files of an upload arrive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UploadActivity {
    /// Files are arriving.
    Arriving,
    /// Files have arrived, and then nothing for a while.
    Silent,
}

/// Files that a browser sends.
#[derive(Debug)]
pub(super) struct FileUpload {
    announced: AnnouncedFiles,
    /// Number of files and archives that have arrived.
    pub(super) arrived: AtomicU64,
    pub(super) count: Arc<ReceivedCount>,
    pub(super) last_piece: LastPiece,
    /// Whether another page takes over.
    is_taken: AtomicBool,
    /// Whether the page was closed, so that the upload is interrupted after the file that a thread has.
    is_left: AtomicBool,
    /// Notifies when a thread has put back the files.
    pub(super) settled: Notify,
    state: Mutex<UploadState>,
}

/// State of an upload.
#[derive(Debug)]
pub(super) enum UploadState {
    /// Waits for the next file since then.
    Ready(Box<ReceivedFiles>, Instant),
    /// A thread has the files. The file that arrives is interrupted when the sender is dropped.
    Busy(CancelToken, Option<oneshot::Sender<()>>),
    /// A thread gives the files their folder, which cannot be cancelled.
    Storing,
    /// It was interrupted at that time, for this reason. It can be resumed with the files that have not arrived.
    Paused(Box<ReceivedFiles>, Instant, Sentence),
    /// Nothing is kept, or all has its folder. Says why if it failed.
    Ended(Option<Sentence>),
}

impl FileUpload {
    /// Waits for the first of these files that has not arrived.
    pub(super) fn new(announced: AnnouncedFiles, received: Box<ReceivedFiles>) -> Self {
        Self {
            announced,
            arrived: AtomicU64::new(received.arrived().len() as u64),
            count: Arc::clone(&received.count),
            last_piece: LastPiece::default(),
            is_taken: AtomicBool::new(false),
            is_left: AtomicBool::new(false),
            settled: Notify::new(),
            state: Mutex::new(UploadState::Ready(received, Instant::now())),
        }
    }

    /// Returns whether the upload has these files.
    pub(super) fn is_of(&self, files: &AnnouncedFiles) -> bool {
        let content = &self.announced.content;
        !content.is_empty() && *content == files.content
    }

    /// Returns whether files arrive or have stopped arriving. `None` if the upload was interrupted or has ended,
    /// or seems to be lost before a file had arrived.
    pub(super) fn activity(&self, now: Instant) -> Option<UploadActivity> {
        let last = match *self.lock() {
            UploadState::Ready(_, since) => since,
            // While an archive is unpacked, no piece is the last one.
            UploadState::Busy(..) => self.last_piece.get().unwrap_or(now),
            UploadState::Storing => now,
            UploadState::Paused(..) | UploadState::Ended(_) => return None,
        };
        if now.duration_since(last) <= MAX_SILENT * time_scale("MOCBAN_LIMIT_FACTOR") {
            return Some(UploadActivity::Arriving);
        }
        (self.arrived.load(Ordering::Relaxed) > 0).then_some(UploadActivity::Silent)
    }

    /// Interrupts the upload, so that another page can resume it. Returns when its files are released, or after 10 s.
    pub(super) async fn cut_off(&self) {
        let settled = self.settled.notified();
        tokio::pin!(settled);
        // A thread may put the files back before they are waited for.
        settled.as_mut().enable();
        let interrupt = match &mut *self.lock() {
            UploadState::Busy(_, interrupt) => interrupt.take(),
            _ => None,
        };
        if interrupt.is_none() {
            self.interrupt(taken_over());
            return;
        }
        self.is_taken.store(true, Ordering::Relaxed);
        drop(interrupt);
        // After a timeout the files are still in use, and the next request to begin the upload is refused.
        let _ = tokio::time::timeout(MAX_SETTLING, settled).await;
    }

    /// Starts to write a file on a thread of its own, which goes on if the page is closed after all of the file has arrived.
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
        let (interrupt, interrupted) = oneshot::channel();
        let received = self.take(UploadState::Busy(token.clone(), Some(interrupt)))?;
        for ended in [&self.is_taken, &self.is_left] {
            ended.store(false, Ordering::Relaxed);
        }
        self.last_piece.set(Some(Instant::now()));
        let (pieces, arriving) = mpsc::channel(WAITING_PIECES);
        let (upload, path) = (Arc::clone(self), path.to_owned());
        let written = spawn_blocking(move || {
            let mut ending = UploadEnding::of(upload);
            let work = token.run(|| {
                let mut received = received;
                match take_file(&mut received, &path, modified, arriving) {
                    Ok(()) => Ok(received),
                    Err(why) if why == cut() && !received.arrived().is_empty() => {
                        let why = if ending.upload.is_taken.load(Ordering::Relaxed) {
                            taken_over()
                        } else {
                            cut_with_rest(received.arrived().len() as u64)
                        };
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
            interrupted,
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
            let announced = &upload.announced;
            let placed = if arrived == announced.files {
                received.place(&announced.name)
            } else {
                drop(received);
                Err(incomplete(arrived, announced.files))
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
        if let UploadState::Busy(token, _) = &before {
            token.cancel();
        }
        Ok(())
    }

    /// Returns whether the page of a project has begun the upload.
    pub(super) fn is_for(&self, project: &str) -> bool {
        self.announced.project == project
    }

    /// Says why the upload failed.
    pub(super) fn problem(&self) -> Option<Sentence> {
        match &*self.lock() {
            UploadState::Ended(why) => why.clone(),
            UploadState::Paused(.., why) => Some(why.clone()),
            UploadState::Ready(..) | UploadState::Busy(..) | UploadState::Storing => None,
        }
    }

    /// Returns the files of an upload that was interrupted or whose browser is closed, and ends it, so that another page can
    /// resume it. The first page, if it is still open, can send nothing more.
    pub(super) fn give_up(&self) -> Option<Box<ReceivedFiles>> {
        let mut state = self.lock();
        match std::mem::replace(&mut *state, UploadState::Ended(Some(taken_over()))) {
            UploadState::Paused(received, ..) => Some(received),
            UploadState::Ready(received, since)
                if since.elapsed() > MAX_IDLE && !received.arrived().is_empty() =>
            {
                Some(received)
            }
            other => {
                *state = other;
                None
            }
        }
    }

    /// Interrupts the upload because its page was closed, so that another page can resume it. A file that a thread
    /// writes is finished first. Without files that could be resumed, the upload stays as it is.
    pub(super) fn pause(&self) {
        let mut state = self.lock();
        self.is_left.store(true, Ordering::Relaxed);
        let before = std::mem::replace(&mut *state, UploadState::Storing);
        *state = self.paused_if_left(before);
    }

    /// Returns the state in which an upload waits for another page if its page was closed while it waited for the next file.
    fn paused_if_left(&self, state: UploadState) -> UploadState {
        match state {
            UploadState::Ready(received, _)
                if self.is_left.load(Ordering::Relaxed) && !received.arrived().is_empty() =>
            {
                let why = cut_with_rest(received.arrived().len() as u64);
                UploadState::Paused(received, Instant::now(), why)
            }
            other => other,
        }
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
                    UploadState::Ready(..) | UploadState::Busy(..) => busy(),
                };
                *state = other;
                Err(AppFailure::refused(why))
            }
        }
    }

    /// Stores the next state of the upload, unless the upload was cancelled meanwhile.
    fn settle(&self, next: UploadState) {
        let mut state = self.lock();
        let next = self.paused_if_left(next);
        let unused = match &*state {
            UploadState::Busy(..) | UploadState::Storing => std::mem::replace(&mut *state, next),
            UploadState::Ready(..) | UploadState::Paused(..) | UploadState::Ended(_) => next,
        };
        drop(state);
        // Removes files of an upload that was cancelled.
        drop(unused);
        self.settled.notify_waiters();
    }

    pub(super) fn is_over(&self) -> bool {
        match &*self.lock() {
            UploadState::Ready(received, since) if received.arrived().is_empty() => {
                since.elapsed() > MAX_IDLE
            }
            UploadState::Ready(_, since) | UploadState::Paused(_, since, _) => {
                since.elapsed() > MAX_KEPT
            }
            UploadState::Busy(..) | UploadState::Storing => false,
            UploadState::Ended(_) => true,
        }
    }

    /// Returns since when the upload is interrupted, or its browser closed.
    pub(super) fn paused_since(&self) -> Option<Instant> {
        match *self.lock() {
            UploadState::Paused(_, since, _) => Some(since),
            UploadState::Ready(_, since) if since.elapsed() > MAX_IDLE => Some(since),
            _ => None,
        }
    }

    /// Returns about how many bytes the files that have arrived take on the disk.
    pub(super) fn kept_bytes(&self) -> u64 {
        self.count.bytes.load(Ordering::Relaxed)
    }

    /// Ends an upload that nobody has resumed for [`MAX_KEPT`], and removes its files. Returns whether it has ended.
    pub(super) fn end_if_left(&self, now: Instant) -> bool {
        let mut state = self.lock();
        let is_left = match &*state {
            UploadState::Ready(_, since) | UploadState::Paused(_, since, _) => {
                now.duration_since(*since) > MAX_KEPT
            }
            UploadState::Busy(..) | UploadState::Storing => false,
            UploadState::Ended(_) => return true,
        };
        let left = is_left.then(|| std::mem::replace(&mut *state, UploadState::Ended(None)));
        drop(state);
        // Removes the files without the lock.
        left.is_some()
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, UploadState> {
        // Each change is a single assignment.
        locked(&self.state)
    }
}

/// Stores the next state of an upload when it is dropped, also after a panic.
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
