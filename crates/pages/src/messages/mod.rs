//! Messages of the program in Vietnamese, for all pages.

mod block_messages;
mod block_refusals;
mod count_marks;
mod foreign_messages;
mod form_messages;
mod held_messages;
mod import_messages;
mod label_messages;
mod left_out_words;
mod list_messages;
mod message_numbers;
mod message_parts;
mod message_patterns;
mod message_table;
mod message_words;
mod pair_refusals;
mod parser_messages;
mod report_answers;
mod report_captions;
mod report_html;
#[cfg(test)]
mod report_source_tests;
mod report_table;
mod report_words;
mod review_messages;
#[cfg(test)]
mod source_texts;
mod stage_words;
mod system_messages;

pub(crate) use count_marks::{marked_count, marked_parts, unmarked};
pub(crate) use left_out_words::left_out_reasons;
pub(crate) use message_parts::with_more;
pub(crate) use message_words::vietnamese;
pub(crate) use report_html::vietnamese_report;
pub(crate) use report_words::report_text;
pub(crate) use stage_words::stage_in_vietnamese;
pub(crate) use system_messages::reason_of_kind;
