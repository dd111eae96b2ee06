//! The review page: a local web server on which one reviewer judges results and aligns reliefs manually.
//!
//! [`bind`] binds the port and reads the queue. [`ReviewServer::serve`] serves until it is stopped. An answer is
//! acknowledged only after it is on the disk. Attention checks are served like results, so they cannot be recognized.

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
mod image_error;
mod item;
mod item_images;
mod keys;
mod options;
mod order;
mod page;
mod page_dialogs;
mod planted_faults;
mod review_queue;
mod routes;
mod server;
mod state;
mod summary;
mod unstored;

pub use check_items::CheckRates;
pub use i18n::Language;
pub use keys::{KeyError, key_map};
pub use options::{QueueOptions, ReviewOptions};
pub use planted_faults::FaultShortage;
pub use server::{QueueCounts, ReviewError, ReviewServer, bind};
