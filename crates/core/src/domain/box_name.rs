//! Names of boxes by column and row.

use std::fmt;
use std::str::FromStr;

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

/// The text is not the name of a box by column and row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not a name by column and row")]
pub struct NotABoxName;

impl FromStr for BoxName {
    type Err = NotABoxName;

    /// Reads what [`fmt::Display`] writes.
    ///
    /// ```
    /// use mocban_core::domain::BoxName;
    ///
    /// let name: BoxName = "c03-r112b".parse()?;
    /// assert_eq!((name.column, name.row), (3, 112));
    /// assert_eq!(name.to_string(), "c03-r112b");
    /// assert!("c3-r1".parse::<BoxName>().is_err());
    /// # Ok::<(), mocban_core::domain::NotABoxName>(())
    /// ```
    fn from_str(text: &str) -> Result<Self, NotABoxName> {
        let numbers = text
            .strip_prefix('c')
            .and_then(|rest| rest.split_once("-r"));
        let (column, row) = numbers.ok_or(NotABoxName)?;
        let (row, part) = match (row.strip_suffix('a'), row.strip_suffix('b')) {
            (Some(row), _) => (row, Some(NotePart::Right)),
            (_, Some(row)) => (row, Some(NotePart::Left)),
            (None, None) => (row, None),
        };
        let number = |digits: &str| digits.parse().map_err(|_not_digits| NotABoxName);
        let name = Self {
            column: number(column)?,
            row: number(row)?,
            part,
        };
        if name.to_string() == text {
            Ok(name)
        } else {
            Err(NotABoxName)
        }
    }
}
