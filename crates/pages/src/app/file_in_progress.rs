//! A file of an upload while it arrives.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinHandle;

use super::failure::{AppFailure, AppResult};
use super::received_files::FilePiece;
use super::sentence::Sentence;
use crate::local_server::WorkFailed;
use mocban_core::locked;

/// When the last piece of a file arrived. `None` if no file is arriving, as while an archive is unpacked.
#[derive(Debug, Clone, Default)]
pub(super) struct LastPiece(Arc<Mutex<Option<Instant>>>);

impl LastPiece {
    pub(super) fn get(&self) -> Option<Instant> {
        *locked(&self.0)
    }

    pub(super) fn set(&self, at: Option<Instant>) {
        // A single assignment.
        *locked(&self.0) = at;
    }
}

/// A file that is being received. If it is dropped after its end was passed on, such as when the page is closed while an archive
/// is unpacked, the thread finishes it; before its end, it counts as cut off.
#[derive(Debug)]
pub(super) struct FileInProgress {
    pub(super) pieces: mpsc::Sender<FilePiece>,
    pub(super) written: JoinHandle<Result<(), Sentence>>,
    pub(super) last_piece: LastPiece,
    /// Completes when the upload of this file must stop, such as when another page takes over the upload.
    pub(super) interrupted: oneshot::Receiver<()>,
}

impl FileInProgress {
    /// Passes a piece on. Returns whether more pieces are wanted.
    pub(super) async fn pass(&self, piece: FilePiece) -> bool {
        let is_end = matches!(piece, FilePiece::End);
        self.last_piece.set((!is_end).then(Instant::now));
        // Nobody receives if the file was refused; `finish` has the reason.
        self.pieces.send(piece).await.is_ok() && !is_end
    }

    /// Waits until the file is written.
    ///
    /// # Errors
    /// Returns why the file is refused. Nothing of the upload is kept then.
    pub(super) async fn finish(self) -> AppResult<()> {
        let Self {
            pieces, written, ..
        } = self;
        drop(pieces);
        let written = written.await;
        let written = written.map_err(|_panicked| WorkFailed)?;
        written.map_err(AppFailure::refused)
    }
}
