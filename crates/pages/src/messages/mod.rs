//! Messages of the program in Vietnamese, for all pages.

mod block_messages;
mod left_out_words;
mod list_messages;
mod message_table;
mod message_words;
mod report_answers;
mod report_captions;
mod report_html;
mod report_table;
mod report_words;

pub(crate) use left_out_words::left_out_reasons;
pub(crate) use message_words::{vietnamese, with_more};
pub use report_html::report_page;
pub(crate) use report_words::report_text;
