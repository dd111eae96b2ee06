//! An export as one ZIP archive: its size before the download, and the download as a stream.

use std::io::{self, BufWriter};
use std::path::Path as FilePath;
use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use futures_util::stream;
use maud::{Markup, html};
use tokio::sync::mpsc;

use super::attachment::{disposition, safe_name};
use super::exports::{exports_dir, is_export};
use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use super::zip_sizes::{ZipSize, ZipSizes};
use mocban_export::{FolderZip, FolderZipError};

/// Bytes that are sent at a time.
const CHUNK: usize = 256 * 1024;
/// Chunks that wait for a slow browser.
const WAITING: usize = 4;

/// Bytes of an archive, or the error that ends it.
type ArchiveChunk = io::Result<Vec<u8>>;

/// Returns the name of the archive of an export, and of the folder in it, without its extension. Every file system stores it.
fn archive_name(key: &str, name: &str) -> String {
    safe_name(&format!("{key}-{name}"))
}

/// Returns the link to the archive of an export with its size, or says that there is none.
pub(super) fn zip_link(
    visit: &Visit,
    sizes: &ZipSizes,
    key: &str,
    dir: &FilePath,
    name: &str,
) -> Markup {
    let size = sizes.get(dir, &archive_name(key, name));
    let size = match size {
        ZipSize::InWork => visit
            .t("The size is being worked out…", "Đang tính dung lượng…")
            .to_owned(),
        ZipSize::Bytes(bytes) => visit.file_size(bytes),
        ZipSize::NoArchive => {
            let text = visit.t(
                "This folder cannot be downloaded as one ZIP. Export again.",
                "Không thể tải thư mục này về thành một tệp ZIP. Hãy xuất lại.",
            );
            return html! { p.muted { (text) } };
        }
    };
    html! {
        p.row {
            a.button.zip href={ "exports/" (name) ".zip" } download { (visit.t("Download as one ZIP", "Tải về thành một tệp ZIP")) }
            span.muted { (size) }
        }
    }
}

/// Responds with the archive of an export. `archive` is its name with `.zip`. If a file changes meanwhile, the response ends
/// before its announced length, which a browser shows as a failed download.
pub(super) async fn download(
    State(state): State<Arc<AppState>>,
    Path((key, archive)): Path<(String, String)>,
) -> AppResult<Response> {
    let open = state.open(&key).await?;
    let name = archive.strip_suffix(".zip").filter(|name| is_export(name));
    let name = name.ok_or_else(AppFailure::not_found)?;
    let (dir, archive) = (exports_dir(&open.dir).join(name), archive_name(&key, name));
    let folder = archive.clone();
    let begun = tokio::task::spawn_blocking(move || FolderZip::begin(&dir, &folder)).await;
    let begun = begun.map_err(|_stopped| AppFailure::not_found())?;
    let zip = begun.map_err(|error| refused(&error))?;
    let headers = [
        (header::CONTENT_TYPE, "application/zip".to_owned()),
        (header::CONTENT_LENGTH, zip.size().to_string()),
        (
            header::CONTENT_DISPOSITION,
            disposition(&format!("{archive}.zip")),
        ),
    ];
    let (sender, chunks) = mpsc::channel::<ArchiveChunk>(WAITING);
    tokio::task::spawn_blocking(move || {
        let mut out = BufWriter::with_capacity(CHUNK, ChunkSender(sender.clone()));
        if let Err(error) = zip.write(&mut out) {
            // The browser may end a download at any time.
            if !matches!(error, FolderZipError::Output(_)) {
                tracing::warn!("the download of an export ended: {error}");
            }
            // What is still in the buffer is of no use.
            let _ = out.into_parts();
            let _ = sender.blocking_send(Err(io::Error::other(error)));
        }
    });
    let chunks = stream::unfold(chunks, |mut chunks| async move {
        let chunk: ArchiveChunk = chunks.recv().await?;
        Some((chunk, chunks))
    });
    Ok((headers, Body::from_stream(chunks)).into_response())
}

fn refused(error: &FolderZipError) -> AppFailure {
    match error {
        FolderZipError::NoExport(_) => AppFailure::not_found(),
        error => AppFailure::refused(Sentence::of_program(&error.to_string())),
    }
}

/// Sends what is written to a response, and waits while the browser is slower.
#[derive(Debug)]
struct ChunkSender(mpsc::Sender<ArchiveChunk>);

impl io::Write for ChunkSender {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let length = bytes.len().min(CHUNK);
        let sent = self.0.blocking_send(Ok(bytes[..length].to_vec()));
        sent.map_err(|_closed| io::Error::from(io::ErrorKind::BrokenPipe))?;
        Ok(length)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
