//! The routes of the app.

use std::sync::Arc;

use axum::routing::{any, get, post};
use axum::{Router, middleware};

use super::state::{AppOptions, AppState};
use super::{
    assets, failure, home, pair_page, pairs_page, pictures, review_page, run_actions, run_page,
};
use crate::view::scan_asset;

/// Returns the routes of the app, for a server.
pub fn app_pages(options: AppOptions) -> Router {
    let state = Arc::new(AppState::new(options));
    let pair = "/p/{project}/pair/{pair}";
    let review = "/p/{project}/review/{reviewer}/{choice}";
    Router::new()
        .route("/", get(home::page))
        .route("/assets/{name}", get(assets::asset))
        .route("/p/{project}/", get(run_page::page))
        .route("/p/{project}/pairs", get(pairs_page::page))
        .route(&format!("{pair}/"), get(pair_page::page))
        .route(&format!("{pair}/picture/{{name}}"), get(pictures::picture))
        .route(&format!("{pair}/3d/"), get(pair_page::scan_view))
        .route(&format!("{pair}/3d/scan"), get(pictures::scan))
        .route(&format!("{pair}/3d/assets/{{name}}"), get(scan_asset))
        .route("/p/{project}/review", get(review_page::page))
        .route("/p/{project}/actions/run", post(run_actions::run))
        .route("/p/{project}/actions/stop", post(run_actions::stop))
        .route("/p/{project}/actions/retry", post(run_actions::retry))
        .route("/p/{project}/actions/retire", post(run_actions::retire))
        .route("/p/{project}/actions/review", post(review_page::start))
        .layer(middleware::from_fn_with_state(
            Arc::clone(&state),
            failure::explain,
        ))
        // The pages of a review explain their failures themselves.
        .route(&format!("{review}/"), any(review_page::pages))
        .route(&format!("{review}/{{*rest}}"), any(review_page::pages))
        .with_state(state)
}
