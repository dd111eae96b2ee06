//! The documentation as web pages, for an installed program without the files of `docs/`.

mod files;
mod html;
mod search;

pub use files::web_files;
pub use html::anchor;
