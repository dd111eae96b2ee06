//! The app: the projects of a folder in the browser, from their import to their report.
//!
//! [`app_pages`] returns the routes for a server. The pages show the catalog and start commands, so a run that was started in
//! a terminal or on another computer looks the same. A run is a process of its own, which goes on when the page or the app
//! is closed.

mod action_body;
mod address;
mod assets;
mod attachment;
mod block_page;
mod blocks_page;
mod child_run;
mod choice_bar;
mod chosen_pairs;
mod chosen_sets;
mod components;
mod export_page;
mod export_zip;
mod exports;
mod failed_runs;
mod failure;
mod failure_page;
mod file_in_progress;
mod file_upload;
mod folder_picker;
mod health_page;
mod home;
mod import_choice;
mod import_columns;
mod import_page;
mod import_partners;
mod import_preview;
mod invitation_cards;
mod invitations;
mod last_import;
mod number_text;
mod open_pages;
mod opened_review;
mod pair_history;
mod pair_numbers;
mod pair_page;
mod pair_query;
mod pairs_page;
mod pass_on;
mod pictures;
mod plan_cache;
mod projects;
mod qr_code;
mod read_only;
mod received_archive;
mod received_files;
mod report_page;
mod report_sentences;
mod retired_pairs;
mod review_agreement;
mod review_page;
mod routes;
mod run_actions;
mod run_blocks;
mod run_page;
mod sentence;
mod setting_words;
mod settings_page;
mod state;
mod task_part;
mod tasks;
mod thumb_cache;
mod upload_actions;
mod upload_form;
mod upload_sentence;
mod uploads;
mod visit;
mod words;
mod zip_sizes;

pub use routes::app_pages;
pub use state::AppOptions;
