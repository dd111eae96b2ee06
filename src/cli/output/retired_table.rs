//! The list of retired pairs that `status --retired` prints.

use super::screen::{Palette, Tone};
use super::table::columns;
use mocban_catalog::RetiredPair;
use mocban_core::domain::RetireCause;
use mocban_system::time_text::local;

/// Formats a line for each pair, or one that says that there are none.
pub(crate) fn retired_table(pairs: &[RetiredPair], palette: Palette) -> String {
    if pairs.is_empty() {
        return "no pair is retired\n".to_owned();
    }
    let head = ["retired", "since", "why"].map(|name| palette.paint(Tone::Strong, name));
    let rows = pairs.iter().map(|pair| {
        let why = match pair.cause {
            RetireCause::Person => "by a person; `retire --undo` brings it back",
            RetireCause::List => {
                "not in a list that replaced the others; `retire --undo` or a list with it brings it back"
            }
            RetireCause::Labels => "its box is gone from the labels of its block",
        };
        vec![pair.name.to_string(), local(pair.at), why.to_owned()]
    });
    columns(std::iter::once(head.to_vec()).chain(rows), "<<<")
}
