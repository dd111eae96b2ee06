//! The fields that an action sends.

use axum::Json;
use axum::extract::{FromRequest, Request};
use serde::de::DeserializeOwned;

use super::failure::AppFailure;
use super::sentence::Sentence;

/// The fields of a form, as JSON. Others are refused with the reason.
#[derive(Debug)]
pub(super) struct ActionBody<T>(pub(super) T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for ActionBody<T> {
    type Rejection = AppFailure;

    async fn from_request(request: Request, state: &S) -> Result<Self, AppFailure> {
        let read = Json::from_request(request, state).await;
        let Json(fields) = read
            .map_err(|invalid| AppFailure::refused(Sentence::of_program(&invalid.to_string())))?;
        Ok(Self(fields))
    }
}
