//! Columns that are kept as metadata although they have another name of a column that is read already.

use std::collections::BTreeSet;

use super::column_names::shown_column;

/// Largest number of such columns that are named: each row of JSON may write them differently.
const MAX_NAMED: usize = 12;

/// Such columns as written, each with the column that is read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct UnreadColumns(BTreeSet<(String, &'static str)>);

impl UnreadColumns {
    /// Adds columns.
    pub(super) fn add(&mut self, columns: impl IntoIterator<Item = (String, &'static str)>) {
        let free = MAX_NAMED.saturating_sub(self.0.len());
        self.0.extend(columns.into_iter().take(free));
    }

    /// Returns a warning for each.
    pub fn warnings(&self) -> impl Iterator<Item = String> + '_ {
        self.0.iter().map(|(written, name)| {
            let written = shown_column(written);
            format!(
                "column {written} is kept as metadata, because another column is read as {name}"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ReadRows, read_blocks, read_csv, read_jsonl};

    fn warnings(read: &ReadRows) -> Vec<String> {
        read.unread_columns.warnings().collect()
    }

    #[test]
    fn a_second_column_of_the_same_meaning_is_named() {
        let kept = |column: &str, name: &str| {
            format!(
                "column \"{column}\" is kept as metadata, because another column is read as {name}"
            )
        };
        let pairs = |header: &str| {
            let list = format!("{header}\na,m,p,1,2\n");
            warnings(&read_csv(list.as_bytes(), &mut drop).expect(header))
        };
        assert_eq!(
            pairs("id,mesh,print,Khối,Số hiệu ván"),
            [kept("Khối", "block")]
        );
        assert_eq!(pairs("id,mesh,print,Block,Khối"), [kept("Khối", "block")]);
        assert_eq!(pairs("id,mesh,print,lưới,chữ"), [kept("lưới", "mesh")]);
        assert_eq!(pairs("id,mesh,print,block,folio"), [""; 0]);
        let blocks = "block,mesh,page,khối\nb,m,p,1\n";
        let read = read_blocks(blocks.as_bytes()).expect("a list");
        assert_eq!(read.warnings, [kept("khối", "block")]);
        let row = "{\"id\":\"1\",\"mesh\":\"m\",\"print\":\"p\",\"block\":\"b\",\"Khối\":\"c\"}";
        let json = format!("{row}\n{}", row.replace("\"1\"", "\"2\""));
        let read = read_jsonl(json.as_bytes(), &mut drop).expect("a list");
        assert_eq!(warnings(&read), [kept("Khối", "block")]);
    }
}
