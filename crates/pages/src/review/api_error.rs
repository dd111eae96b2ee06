//! Why a request of the page fails, and what the page shows then.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::extract::rejection::JsonRejection;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;

use super::answer::InvalidInput;
use super::image_error::ImageError;
use super::planted_faults::QueueError;
use super::state::ServerState;
use super::unstored::Unconfirmed;
use crate::messages::vietnamese;
use mocban_catalog::{CatalogError, CatalogErrorKind};
use mocban_project::error::without_error_numbers;
use mocban_results::pair_artifacts::PairArtifactsError;

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
    Unconfirmed(#[from] Unconfirmed),
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
            Self::NoItem => StatusCode::NOT_FOUND,
            Self::Unconfirmed(error) if !error.is_temporary() => StatusCode::NOT_FOUND,
            Self::NotAnswered | Self::NotFinished => StatusCode::FORBIDDEN,
            Self::Body(rejection) => rejection.status(),
            Self::Input(_) => StatusCode::UNPROCESSABLE_ENTITY,
            Self::Image(ImageError::Gone) => StatusCode::GONE,
            // The page resends what the server could not store.
            Self::Unconfirmed(_)
            | Self::Catalog(_)
            | Self::Queue(_)
            | Self::Image(_)
            | Self::PairArtifacts(_) => StatusCode::SERVICE_UNAVAILABLE,
        }
    }

    fn catalog_error(&self) -> Option<&CatalogError> {
        match self {
            Self::Catalog(error)
            | Self::Unconfirmed(Unconfirmed::Catalog(error))
            | Self::Queue(QueueError::Catalog(error))
            | Self::Image(ImageError::Catalog(error)) => Some(error),
            _ => None,
        }
    }

    /// Returns the message that the page shows. Errors of the catalog are explained as in commands, except where a page
    /// is used otherwise.
    fn text(&self, state: &ServerState) -> String {
        let Some(error) = self.catalog_error() else {
            return self.to_string();
        };
        match error.kind() {
            Some(CatalogErrorKind::Full) => {
                "the disk with the catalog is full; free some space there".to_owned()
            }
            Some(CatalogErrorKind::Unavailable) if state.catalog.is_shared() => {
                "the database server of the catalog is not available; check that it runs, then try again: nothing stored is lost".to_owned()
            }
            // SQLite has no server: all its connections of this process are in use.
            Some(CatalogErrorKind::Unavailable) => {
                "too many requests use the catalog at the moment; try again".to_owned()
            }
            _ => (state.options.explain)(error, state.project.dir()),
        }
    }
}

impl IntoResponse for ApiError {
    /// Returns a response whose text [`explain`] writes.
    fn into_response(self) -> Response {
        let mut response = self.status().into_response();
        response.extensions_mut().insert(Arc::new(self));
        response
    }
}

/// Writes the text of a failed request into its response.
pub(super) async fn explain(
    State(state): State<Arc<ServerState>>,
    mut response: Response,
) -> Response {
    let Some(error) = response.extensions_mut().remove::<Arc<ApiError>>() else {
        return response;
    };
    let status = error.status();
    if status.is_server_error() {
        tracing::warn!(%error, "a request of the review page failed");
    }
    let text = without_error_numbers(&error.text(&state));
    let vietnamese = vietnamese(&text);
    (
        status,
        Json(json!({ "error": text, "error_vi": vietnamese })),
    )
        .into_response()
}
