//! What a browser asks for to send files: an upload, each of its files, and its end.

use std::path::Path as FilePath;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use axum::Json;
use axum::extract::{Path, Request, State};
use futures_util::StreamExt as _;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::task::spawn_blocking;

use super::action_body::ActionBody;
use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::file_upload::AnnouncedFiles;
use super::folder_picker::PickerRoots;
use super::received_files::FilePiece;
use super::sentence::Sentence;
use super::state::AppState;
use crate::local_server::WorkFailed;
use mocban_lists::relative_path::RelativePath;
use mocban_project::location::now;
use mocban_system::time_text::file_time;

/// Longest time in which a browser sends nothing of a file.
const MAX_PAUSE: Duration = Duration::from_mins(1);
/// Time between two looks at whether an upload was left.
const CLEANING_INTERVAL: Duration = Duration::from_mins(10);
/// Longest name of the folder of an upload, characters.
const MAX_NAME: usize = 60;

/// Begins an upload, or resumes an interrupted one. Replies with the files that need not be sent again. The status 409 means
/// that the page can take over from another one.
pub(super) async fn begin(
    State(state): State<Arc<AppState>>,
    ActionBody(body): ActionBody<AnnouncedFiles>,
) -> AppResult<Json<Value>> {
    let files = AnnouncedFiles {
        name: folder_name(&body.name),
        ..body
    };
    if files.take_over {
        state.uploads.interrupt_silent(&files).await;
    }
    let shared = Arc::clone(&state);
    let begun = spawn_blocking(move || {
        let folder = &shared.options.folder;
        // Otherwise the files could not be imported.
        utf8(&PickerRoots::new(folder).allowed(folder)?)?;
        shared.uploads.begin(&files)
    });
    let begun = begun.await;
    let (id, arrived) = begun.map_err(|_panicked| WorkFailed)??;
    tokio::spawn(remove_if_left(Arc::downgrade(&state), id));
    Ok(Json(json!({ "upload": id, "arrived": arrived })))
}

/// Removes the files of an upload that is interrupted and not resumed. Returns when the upload has ended.
async fn remove_if_left(state: Weak<AppState>, id: u64) {
    loop {
        tokio::time::sleep(CLEANING_INTERVAL).await;
        let Some(Ok(upload)) = state.upgrade().map(|state| state.uploads.find(id)) else {
            return;
        };
        let ended = spawn_blocking(move || upload.end_if_left(Instant::now()));
        if ended.await.unwrap_or(true) {
            return;
        }
    }
}

/// Returns the name of the folder for an upload: the chosen one, or the time if it cannot be the name of a folder.
fn folder_name(chosen: &str) -> String {
    let name = RelativePath::new(chosen.trim()).ok();
    let is_name = |name: &RelativePath| {
        let text = name.as_str();
        !text.contains('/') && !name.is_of_system() && text.chars().count() <= MAX_NAME
    };
    let name = name.filter(is_name);
    name.map_or_else(
        || format!("files {}", file_time(now())),
        |name| name.as_str().to_owned(),
    )
}

/// Receives a file. Its body is written as it arrives.
pub(super) async fn receive(
    State(state): State<Arc<AppState>>,
    Path((id, path)): Path<(u64, String)>,
    request: Request,
) -> AppResult<Json<Value>> {
    let query = PageQuery::parse(request.uri().query().unwrap_or_default());
    let upload = state.uploads.find(id)?;
    let mut file = upload.start(&path, query.parsed("modified"))?;
    let mut body = request.into_body().into_data_stream();
    loop {
        let next = tokio::select! {
            next = tokio::time::timeout(MAX_PAUSE, body.next()) => next,
            _ = &mut file.interrupted => break,
        };
        // Without an end, the file counts as cut off.
        let piece = match next {
            Ok(Some(Ok(bytes))) => FilePiece::Bytes(bytes),
            Ok(None) => FilePiece::End,
            // The connection was cut, or nothing came for long.
            Ok(Some(Err(_))) | Err(_) => break,
        };
        if !file.pass(piece).await {
            break;
        }
    }
    file.finish().await?;
    Ok(Json(json!({})))
}

/// Responds with what has arrived, and why the upload failed.
pub(super) async fn progress(
    State(state): State<Arc<AppState>>,
    Path(id): Path<u64>,
) -> AppResult<Json<Value>> {
    let upload = state.uploads.find(id)?;
    if let Some(why) = upload.problem() {
        return Err(AppFailure::refused(why));
    }
    let [files, bytes] =
        [&upload.count.files, &upload.count.bytes].map(|count| count.load(Ordering::Relaxed));
    Ok(Json(json!({ "files": files, "bytes": bytes })))
}

/// How an upload ends.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum UploadEnd {
    Finish,
    Cancel,
    /// The page was closed.
    Pause,
}

/// The end of an upload.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UploadEndBody {
    upload: u64,
    end: UploadEnd,
    /// The project into which the files will be imported; may be empty.
    project: String,
}

/// Gives the files of an upload their folder, removes them, or keeps them for another page.
pub(super) async fn end(
    State(state): State<Arc<AppState>>,
    ActionBody(body): ActionBody<UploadEndBody>,
) -> AppResult<Json<Value>> {
    let upload = state.uploads.find(body.upload)?;
    match body.end {
        UploadEnd::Cancel => {
            let cancelled = spawn_blocking(move || upload.cancel()).await;
            cancelled.map_err(|_panicked| WorkFailed)??;
            Ok(Json(json!({})))
        }
        UploadEnd::Pause => {
            upload.pause();
            Ok(Json(json!({})))
        }
        UploadEnd::Finish => {
            let placed = upload.finish().await?;
            let left_out = upload.count.left_out.load(Ordering::Relaxed);
            let query = PageQuery::default().with("project", &body.project);
            let folder = state.options.folder.clone();
            let chosen = spawn_blocking(move || chosen(&folder, &placed, &query)).await;
            let chosen = chosen.map_err(|_panicked| WorkFailed)??;
            let left_out = (left_out > 0).then(|| left_out.to_string());
            let query = chosen.with("left_out", &left_out.unwrap_or_default());
            Ok(Json(json!({ "go": format!("import{}", query.text()) })))
        }
    }
}

/// Chooses the files of a folder for an import: its list, if it has one, or else its scans and prints.
fn chosen(folder: &FilePath, placed: &FilePath, query: &PageQuery) -> AppResult<PageQuery> {
    let roots = PickerRoots::new(folder);
    let picked = roots.read(placed)?;
    let at = utf8(&picked.path)?;
    let query = query.with("path", &at);
    Ok(match picked.lists.as_slice() {
        [list] => query.with("list", &utf8(&picked.path.join(list))?),
        // The page says what is missing, and which files are not read.
        [] => query.with("meshes", &at).with("prints", &at),
        _ => query,
    })
}

/// Returns a path in the folder of the app as text.
///
/// # Errors
/// Refuses a path that is not UTF-8.
fn utf8(path: &FilePath) -> AppResult<String> {
    let text = path.to_str().map(str::to_owned);
    text.ok_or_else(|| {
        let shown = path.display();
        AppFailure::refused(Sentence::new(
            format!("{shown} is not UTF-8: rename the folder of the app"),
            format!("{shown} không phải UTF-8: hãy đổi tên thư mục của ứng dụng"),
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::folder_name;

    #[test]
    fn an_upload_is_named_like_its_folder_or_by_its_time() {
        assert_eq!(folder_name(" ván 4 "), "ván 4");
        for other in ["", "a/b", "../x", ".git", "con", "a?", &"a".repeat(61)] {
            let name = folder_name(other);
            assert!(name.starts_with("files 2"), "{name}");
            assert_eq!(name.len(), "files 2026-11-21 041003".len(), "{name}");
        }
    }
}
