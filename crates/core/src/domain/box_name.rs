//! Names of boxes by column and row.

use std::fmt;

/// Place of a box in the reading order. Displayed as `c03-r12`, and as `c03-r12a` for one of two notes side by side.
/// The order is by column, row and part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BoxName {
    /// Number of the column, from 1 at the right.
    pub column: u32,
    /// Number of the row within its column, from 1 at the top.
    pub row: u32,
    /// Right or left half of the row, for notes.
    pub part: Option<NotePart>,
}

/// Half of a row of notes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum NotePart {
    /// The right half, which is read first. Displayed as `a`.
    Right,
    /// The left half. Displayed as `b`.
    Left,
}

impl fmt::Display for BoxName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = match self.part {
            None => "",
            Some(NotePart::Right) => "a",
            Some(NotePart::Left) => "b",
        };
        write!(f, "c{:02}-r{:02}{part}", self.column, self.row)
    }
}
