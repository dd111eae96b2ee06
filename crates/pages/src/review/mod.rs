//! The review page, on which one reviewer judges results and aligns reliefs manually.
//!
//! [`ReviewPages`] reads the queue and gives the routes for a server. An answer is acknowledged only after it is
//! on the disk. Attention checks are served like results, so they cannot be recognized.

mod alignment_editor;
mod alignment_inputs;
mod answer;
mod api_error;
mod assets;
mod cache_slots;
mod check_items;
mod examples;
mod history;
mod i18n;
mod image_cache;
mod image_error;
mod item;
mod item_images;
mod keys;
mod options;
mod order;
mod page;
mod page_dialogs;
mod picture_work;
mod planted_faults;
mod review_pages;
mod review_queue;
mod routes;
mod state;
mod summary;
mod unstored;

pub use check_items::CheckRates;
pub use i18n::Language;
pub use keys::{KeyError, key_map};
pub use options::{QueueOptions, ReviewOptions};
pub use picture_work::PictureWork;
pub use planted_faults::FaultShortage;
pub use review_pages::{QueueCounts, ReviewError, ReviewPages, origin_name};
