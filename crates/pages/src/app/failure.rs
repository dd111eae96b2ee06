//! Why a page or an action fails.

use std::path::Path;

use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};

use super::sentence::Sentence;
use crate::local_server::WorkFailed;
use crate::review::Language;
use mocban_catalog::CatalogError;
use mocban_core::domain::{ErrorCode, PairName};
use mocban_project::ProjectError;

/// Result of a handler.
pub(super) type AppResult<T> = Result<T, AppFailure>;

/// Why a page or an action fails.
#[derive(Debug, Clone)]
pub(super) struct AppFailure {
    status: StatusCode,
    /// What failed. `None` if there is no such page.
    sentence: Option<Sentence>,
    /// Chosen pairs that are retired, which the page then no longer chooses.
    retired: Vec<PairName>,
}

impl AppFailure {
    /// There is no such page.
    pub(super) const fn not_found() -> Self {
        Self {
            status: StatusCode::NOT_FOUND,
            sentence: None,
            retired: Vec::new(),
        }
    }

    /// There is no such page any more, for a reason.
    pub(super) const fn missing(sentence: Sentence) -> Self {
        Self {
            status: StatusCode::NOT_FOUND,
            sentence: Some(sentence),
            retired: Vec::new(),
        }
    }

    /// A request that cannot be done as asked.
    pub(super) const fn refused(sentence: Sentence) -> Self {
        Self {
            status: StatusCode::UNPROCESSABLE_ENTITY,
            sentence: Some(sentence),
            retired: Vec::new(),
        }
    }

    /// A request against another one, which the user may end for it.
    pub(super) const fn conflict(sentence: Sentence) -> Self {
        Self {
            status: StatusCode::CONFLICT,
            sentence: Some(sentence),
            retired: Vec::new(),
        }
    }

    /// Explains an error of the project in a folder.
    pub(super) fn of(error: impl Into<ProjectError>, dir: &Path) -> Self {
        let error = error.into();
        let status = match error.code() {
            ErrorCode::Usage | ErrorCode::NothingSelected | ErrorCode::ProjectInUse => {
                StatusCode::UNPROCESSABLE_ENTITY
            }
            _ => StatusCode::SERVICE_UNAVAILABLE,
        };
        Self {
            status,
            sentence: Some(Sentence::of_error(&error, dir)),
            retired: Vec::new(),
        }
    }

    /// Returns the failure for a page that keeps what it sent, and sends it again later.
    #[must_use]
    pub(super) fn for_later(self) -> Self {
        Self {
            status: StatusCode::SERVICE_UNAVAILABLE,
            ..self
        }
    }

    /// Names the chosen pairs that are retired.
    #[must_use]
    pub(super) fn with_retired(self, retired: Vec<PairName>) -> Self {
        Self { retired, ..self }
    }

    /// Returns the body of the response to a script.
    pub(super) fn json(&self, language: Language) -> Value {
        let mut body = json!({ "error": self.text(language) });
        if !self.retired.is_empty() {
            body["retired"] = json!(self.retired);
        }
        body
    }

    /// Returns the status of the response.
    pub(super) const fn status(&self) -> StatusCode {
        self.status
    }

    /// Returns what failed, as a part of something else.
    pub(super) fn into_sentence(self) -> Sentence {
        let texts = Language::ALL.map(|language| self.text(language).to_owned());
        let [english, vietnamese] = texts;
        self.sentence
            .unwrap_or_else(|| Sentence::new(english, vietnamese))
    }

    /// Returns what failed.
    pub(super) fn text(&self, language: Language) -> &str {
        match (&self.sentence, language) {
            (Some(sentence), _) => sentence.text(language),
            (None, Language::English) => "There is no such page.",
            (None, Language::Vietnamese) => "Không có trang này.",
        }
    }
}

impl From<ProjectError> for AppFailure {
    fn from(error: ProjectError) -> Self {
        Self::of(error, Path::new(Sentence::UNKNOWN_FOLDER))
    }
}

impl From<CatalogError> for AppFailure {
    fn from(error: CatalogError) -> Self {
        ProjectError::from(error).into()
    }
}

impl From<WorkFailed> for AppFailure {
    fn from(error: WorkFailed) -> Self {
        Self {
            status: StatusCode::INTERNAL_SERVER_ERROR,
            sentence: Some(Sentence::of_program(&error.to_string())),
            retired: Vec::new(),
        }
    }
}

impl IntoResponse for AppFailure {
    fn into_response(self) -> Response {
        let mut response = self.status.into_response();
        response.extensions_mut().insert(self);
        response
    }
}
