//! Messages of the program in Vietnamese, for all pages.

mod block_messages;
mod message_table;
mod message_words;

pub(crate) use message_words::{vietnamese, with_more};
