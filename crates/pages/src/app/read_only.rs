//! Places in which nothing can be stored, so that pages say it before anybody types.

use std::path::Path;
use std::sync::Arc;

use axum::extract::{FromRequestParts as _, RawPathParams, Request, State};
use axum::http::StatusCode;
use axum::http::request::Parts;
use axum::middleware::Next;
use axum::response::Response;

use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use super::state::AppState;
use mocban_store::CATALOG_FILE;
use mocban_system::platform;

/// A place in which nothing can be stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ReadOnlyPlace {
    /// The folder of the projects.
    Folder,
    /// The folder of a project, or its catalog.
    Project,
    /// The database of a project, for this user or for everybody, such as a standby.
    Database,
}

/// Refuses an action in a project, or in the folder of all projects, if nothing can be stored there.
pub(super) async fn refuse_read_only(state: &AppState, project: Option<&str>) -> AppResult<()> {
    match ReadOnlyPlace::find(state, project).await {
        Some(place) => Err(AppFailure::refused(place.sentence())),
        None => Ok(()),
    }
}

/// Refuses the actions behind it in a project in which nothing can be stored.
pub(super) async fn guard_writing(
    State(state): State<Arc<AppState>>,
    request: Request,
    next: Next,
) -> AppResult<Response> {
    let (mut head, body) = request.into_parts();
    let project = project_of(&mut head, &state).await;
    refuse_read_only(&state, project.as_deref()).await?;
    Ok(next.run(Request::from_parts(head, body)).await)
}

/// Returns the name of the project in the address of a request.
pub(super) async fn project_of(head: &mut Parts, state: &Arc<AppState>) -> Option<String> {
    let segments = RawPathParams::from_request_parts(head, state).await.ok()?;
    let mut segments = segments.iter();
    let project = segments.find(|(name, _)| *name == "project");
    project.map(|(_, key)| key.to_owned())
}

/// Refuses to write an output to a folder of a project, which need not exist yet, if nothing can be stored there. A database of
/// the project that takes no changes does not matter.
pub(super) fn refuse_read_only_output(folder: &Path) -> AppResult<()> {
    let mut places = folder.ancestors();
    let existing = places.find(|place| place.exists());
    if existing.is_none_or(platform::may_write) {
        return Ok(());
    }
    Err(AppFailure::refused(Sentence::new(
        "This project is read-only, so no export and no backup can be stored in its folder: change the rights of the folder, or copy it to a place where you may write.",
        "Dự án này chỉ đọc được nên không thể lưu bản xuất hay bản sao lưu nào trong thư mục dự án: hãy đổi quyền của thư mục, hoặc sao chép thư mục đến nơi bạn có quyền ghi.",
    )))
}

impl ReadOnlyPlace {
    /// Finds out whether a project, or the folder of all projects, is such a place. Also returns `None` if the project cannot
    /// be opened: then its page says why.
    pub(super) async fn find(state: &AppState, project: Option<&str>) -> Option<Self> {
        let Some(key) = project else {
            return Self::of_folder(state);
        };
        match state.open(key).await {
            Ok(open) if open.catalog.is_shared() => (!open.may_store).then_some(Self::Database),
            Ok(open) => {
                let catalog = open.dir.join(CATALOG_FILE);
                let may_write = platform::may_write(&catalog) && platform::may_write(&open.dir);
                (!may_write).then_some(Self::Project)
            }
            // An import may make a project of this name.
            Err(failure) if failure.status() == StatusCode::NOT_FOUND => Self::of_folder(state),
            Err(_) => None,
        }
    }

    fn of_folder(state: &AppState) -> Option<Self> {
        (!platform::may_write(&state.options.folder)).then_some(Self::Folder)
    }

    /// Says what cannot be done, and what to do.
    pub(super) fn sentence(self) -> Sentence {
        match self {
            Self::Folder => Sentence::new(
                "This folder is read-only, so no project and no file can be added to it: change its rights, or start the program in a folder where you may write.",
                "Thư mục này chỉ đọc được nên không thể thêm dự án hay tệp nào: hãy đổi quyền của thư mục, hoặc mở chương trình trong một thư mục mà bạn có quyền ghi.",
            ),
            Self::Project => Sentence::new(
                "This project is read-only, so no answer and no change can be stored: change the rights of its folder, or copy the folder to a place where you may write.",
                "Dự án này chỉ đọc được nên không thể lưu câu trả lời hay thay đổi nào: hãy đổi quyền của thư mục dự án, hoặc sao chép thư mục đến nơi bạn có quyền ghi.",
            ),
            Self::Database => Sentence::new(
                "You may only read the database of this project, so no answer and no change can be stored: ask its administrator for the right to write.",
                "Bạn chỉ được đọc cơ sở dữ liệu của dự án này nên không thể lưu câu trả lời hay thay đổi nào: hãy xin người quản trị quyền ghi.",
            ),
        }
    }
}
