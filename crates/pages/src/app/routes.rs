//! The routes of the app.

use std::sync::Arc;

use axum::routing::{any, get, post};
use axum::{Router, middleware};

use super::failure::AppFailure;
use super::read_only::guard_writing;
use super::state::{AppOptions, AppState};
use super::{
    assets, backup_card, block_page, blocks_page, chosen_pairs, export_page, export_size,
    export_zip, failure_page, health_page, home, import_files, import_page, import_pictures,
    invitation_cards, last_import, pair_page, pairs_page, paper_page, pictures, report_page,
    restore_action, restore_content, restore_page, review_agreement, review_page, run_actions,
    run_page, scan_correction, settings_page, upload_actions, view_bar,
};

/// Returns the routes of the app, for a server.
pub fn app_pages(options: AppOptions) -> Router {
    let state = Arc::new(AppState::new(options));
    let action = "/p/{project}/actions";
    let pair = "/p/{project}/pair/{pair}";
    let block = "/p/{project}/block/{block}";
    let review = "/p/{project}/review/{reviewer}/{choice}";
    let guard = middleware::from_fn_with_state(Arc::clone(&state), guard_writing);
    Router::new()
        .route(&format!("{action}/last-import"), post(last_import::change))
        .route(&format!("{action}/setting"), post(settings_page::store))
        .route(&format!("{action}/run"), post(run_actions::run))
        .route(&format!("{action}/view"), post(view_bar::change))
        .route(&format!("{action}/restore"), post(chosen_pairs::restore))
        .route(&format!("{action}/retry"), post(run_actions::retry))
        .route(&format!("{action}/retire"), post(run_actions::retire))
        .route(&format!("{action}/correct"), post(scan_correction::correct))
        .route(&format!("{action}/review"), post(review_page::start))
        // Guards the actions above, which change a project. Others only write files, or may change nothing, and check it
        // themselves.
        .route_layer(guard)
        .route("/", get(home::page))
        .route("/assets/{name}", get(assets::asset))
        .route("/p/{project}/", get(run_page::page))
        .route("/p/{project}/pairs", get(pairs_page::page))
        .route(&format!("{pair}/"), get(pair_page::page))
        .route(&format!("{pair}/picture/{{name}}"), get(pictures::picture))
        .route(&format!("{pair}/paper-method"), get(paper_page::part))
        .route(
            &format!("{pair}/paper-method/{{name}}"),
            get(paper_page::picture),
        )
        .route(&format!("{pair}/3d/"), get(pair_page::scan_view))
        .route(&format!("{pair}/3d/scan"), get(pictures::scan))
        .route(
            &format!("{pair}/3d/assets/{{name}}"),
            get(pair_page::scan_view_asset),
        )
        .route("/p/{project}/blocks", get(blocks_page::page))
        .route(&format!("{block}/"), get(block_page::page))
        .route("/p/{project}/review", get(review_page::page))
        .route("/p/{project}/review/agreement", get(review_agreement::part))
        .route("/restore", get(restore_page::page))
        .route("/restore/content", get(restore_content::part))
        .route("/actions/restore", post(restore_action::start))
        .route("/import", get(import_page::page))
        .route("/import/files", get(import_files::part))
        .route("/import/picture/{picture}", get(import_pictures::draw))
        .route("/import/problems", get(import_files::problems))
        .route("/actions/import", post(import_page::import))
        .route("/actions/upload", post(upload_actions::begin))
        .route("/actions/upload-end", post(upload_actions::end))
        .route("/uploads/{upload}", get(upload_actions::progress))
        .route("/uploads/{upload}/{path}", post(upload_actions::receive))
        .route("/p/{project}/last-import", get(last_import::part))
        .route("/actions/demo", post(run_actions::demo))
        .route("/p/{project}/report", get(report_page::page))
        .route("/p/{project}/report/numbers", get(report_page::numbers))
        .route(
            "/p/{project}/report/file/{file}",
            get(report_page::download),
        )
        .route("/p/{project}/export", get(export_page::page))
        .route("/p/{project}/export/size", get(export_size::part))
        .route("/p/{project}/actions/export", post(export_page::start))
        .route("/p/{project}/exports/{archive}", get(export_zip::download))
        .route(
            "/p/{project}/exports/{name}/{file}",
            get(export_page::download),
        )
        .route("/p/{project}/settings", get(settings_page::page))
        .route("/p/{project}/health", get(health_page::page))
        .route("/p/{project}/actions/check", post(health_page::start_check))
        .route("/p/{project}/actions/backup", post(backup_card::start))
        .route("/p/{project}/backup.sqlite", get(backup_card::download))
        .route("/p/{project}/health/inputs", get(backup_card::size_part))
        .route("/p/{project}/pairs/listed", get(chosen_pairs::listed))
        .route("/p/{project}/pairs/view/{name}", get(view_bar::view))
        .route("/p/{project}/actions/chosen", post(chosen_pairs::change))
        .route("/p/{project}/actions/stop", post(run_actions::stop))
        .route("/p/{project}/correct", get(scan_correction::page))
        .route(
            "/p/{project}/actions/invitation",
            post(invitation_cards::change),
        )
        .route(&format!("{block}/view/"), any(block_page::pages))
        .route(&format!("{block}/view/{{*rest}}"), any(block_page::pages))
        .route(&format!("{review}/"), any(review_page::pages))
        .route(&format!("{review}/{{*rest}}"), any(review_page::pages))
        .fallback(async || AppFailure::not_found())
        // Replies of the pages of a review or a block pass unchanged.
        .layer(middleware::from_fn_with_state(
            Arc::clone(&state),
            failure_page::explain,
        ))
        .with_state(state)
}
