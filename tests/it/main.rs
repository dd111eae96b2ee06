//! Integration tests in one binary.

mod accessible;
mod advice;
mod agreement;
mod align_command;
mod alignment_editor;
mod all_pages;
mod app;
mod app_actions_browser;
mod app_agreement;
#[cfg(target_os = "linux")]
mod app_backup;
mod app_blocks;
mod app_browser;
mod app_choice;
mod app_choice_browser;
mod app_controls;
mod app_corrections;
mod app_curator;
mod app_devices;
mod app_export_size;
mod app_export_zip;
mod app_guests;
mod app_guide;
mod app_import;
mod app_import_files;
mod app_invitations;
#[cfg(target_os = "linux")]
mod app_killed_actions;
#[cfg(target_os = "linux")]
mod app_kills;
mod app_language;
mod app_lists;
#[cfg(target_os = "linux")]
mod app_load;
mod app_paper;
mod app_phone;
#[cfg(target_os = "linux")]
mod app_print;
#[cfg(unix)]
mod app_read_only;
#[cfg(target_os = "linux")]
mod app_read_only_actions;
mod app_report;
mod app_restore;
mod app_resume_browser;
mod app_routes;
mod app_sentences;
#[cfg(unix)]
mod app_shared;
#[cfg(unix)]
mod app_states;
mod app_upload_archives;
mod app_upload_browser;
mod app_upload_resume;
mod app_uploads;
#[cfg(target_os = "linux")]
mod attacks;
mod backup;
#[cfg(target_os = "linux")]
mod backup_inputs;
mod bit_flips;
mod block_boxes;
mod block_correction;
mod block_demo;
mod block_export;
mod block_metadata;
#[cfg(unix)]
mod block_outage;
mod block_touch;
mod block_view;
mod blocks;
mod browser;
mod browser_devices;
mod check;
mod check_files;
mod cli;
mod colour_profiles;
#[cfg(unix)]
mod copies;
mod corruption;
mod creation;
#[cfg(target_os = "linux")]
mod crowd;
mod css_colours;
#[path = "../support/decoy.rs"]
mod decoy;
mod decoys;
mod demo;
mod docs;
mod error_snapshots;
#[cfg(target_os = "linux")]
mod every_call;
mod examples;
mod export_agreement;
mod export_formats;
mod export_heights;
#[cfg(target_os = "linux")]
mod export_interrupted;
mod export_readback;
mod export_tools;
#[cfg(target_os = "linux")]
mod fault;
#[cfg(target_os = "linux")]
mod fault_scenario;
#[cfg(target_os = "linux")]
mod faults;
#[cfg(unix)]
mod fleet;
mod foreign_schema;
#[cfg(target_os = "linux")]
mod grid_print;
mod hanging;
mod hostile;
#[cfg(target_os = "linux")]
mod hostile_pairs;
mod image_pages;
mod import_graph;
mod import_snapshots;
mod invariance;
mod kill;
#[cfg(target_os = "linux")]
mod killed_project;
#[cfg(unix)]
mod lab;
#[cfg(target_os = "linux")]
mod large_lists;
mod layers;
mod like_plain;
mod limits;
mod made_once;
#[cfg(unix)]
mod manners;
#[cfg(unix)]
mod many_reviewers;
#[cfg(target_os = "linux")]
mod memory;
mod mesh_forms;
mod method_change;
mod moved_inputs;
mod names;
mod object_store;
mod object_store_blocks;
mod object_store_owner;
mod odd;
#[cfg(unix)]
mod old_snapshots;
mod one_pair;
#[cfg(unix)]
mod outputs;
mod own_port;
mod page;
mod parsers;
mod place_owner;
#[cfg(unix)]
mod pooler;
#[cfg(unix)]
#[path = "../support/postgres_server.rs"]
mod postgres_server;
mod power;
mod print_forms;
mod processes;
#[cfg(target_os = "linux")]
mod project_dump;
mod qr_decoder;
mod queue;
mod readers;
#[cfg(unix)]
mod refused_writes;
mod release_files;
mod renamed;
mod report;
mod resume;
mod retire;
mod review_alignment;
mod review_browser;
#[cfg(unix)]
mod review_closing;
mod review_data;
mod review_guard;
mod review_guide;
mod review_kill;
#[cfg(target_os = "linux")]
mod review_load;
mod review_page;
#[cfg(unix)]
mod roles;
#[cfg(unix)]
mod roles_in_sql;
mod run_log;
#[path = "../support/s3_server.rs"]
mod s3_server;
mod same_output;
mod sample_files;
mod scan_viewer;
mod semi_real;
#[cfg(target_os = "linux")]
mod session_browser;
mod shim;
mod show_low;
#[cfg(target_os = "linux")]
mod silent_review;
#[cfg(unix)]
mod silent_server;
mod skipped;
mod small_block;
mod snapshots;
mod source_text;
mod stock_sqlite;
mod stroke_map;
mod style;
mod terminal;
mod test_size;
mod tiff_file;
mod tiff_kinds;
#[cfg(unix)]
mod tls_to_server;
mod uninterrupted;
mod unusual_prints;
mod unusual_scans;
mod verdict_files;
mod waiting;
#[cfg(unix)]
mod watch_workers;
