//! Why a request of the page fails.

use axum::Json;
use axum::extract::rejection::JsonRejection;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;

use super::answer::InvalidInput;
use super::image_error::ImageError;
use super::planted_faults::QueueError;
use mocban_catalog::{CatalogError, CatalogErrorKind};
use mocban_report::pair_artifacts::PairArtifactsError;

/// Why a request fails.
#[derive(Debug, thiserror::Error)]
pub(super) enum ApiError {
    #[error("there is no such item")]
    NoItem,
    #[error("answer it first")]
    NotAnswered,
    #[error("answer every image first")]
    NotFinished,
    #[error("{0}")]
    Body(#[from] JsonRejection),
    #[error(transparent)]
    Input(#[from] InvalidInput),
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    #[error(transparent)]
    Queue(#[from] QueueError),
    #[error(transparent)]
    Image(#[from] ImageError),
    #[error(transparent)]
    PairArtifacts(#[from] PairArtifactsError),
}

impl ApiError {
    fn status(&self) -> StatusCode {
        match self {
            Self::NoItem | Self::Catalog(CatalogError::NothingToUndo(_)) => StatusCode::NOT_FOUND,
            Self::NotAnswered | Self::NotFinished => StatusCode::FORBIDDEN,
            Self::Body(rejection) => rejection.status(),
            Self::Input(_) => StatusCode::UNPROCESSABLE_ENTITY,
            Self::Image(ImageError::Gone) => StatusCode::GONE,
            // The page resends what the server could not store.
            Self::Catalog(_) | Self::Queue(_) | Self::Image(_) | Self::PairArtifacts(_) => {
                StatusCode::SERVICE_UNAVAILABLE
            }
        }
    }

    /// Returns the message for the page, which shows it and sends the request again.
    fn text(&self) -> String {
        match self {
            Self::Catalog(error) if error.kind() == Some(CatalogErrorKind::Full) => {
                "the disk with the catalog is full; free some space there".to_owned()
            }
            error => error.to_string(),
        }
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let status = self.status();
        if status.is_server_error() {
            tracing::warn!(error = %self, "a request of the review page failed");
        }
        (status, Json(json!({ "error": self.text() }))).into_response()
    }
}
