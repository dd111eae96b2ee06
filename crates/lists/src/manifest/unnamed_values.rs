//! Values in columns without a name, which no list keeps.

/// The values of a list in columns without a name, which are left out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct UnnamedValues {
    count: usize,
    /// Line of the first one.
    first_line: usize,
}

impl UnnamedValues {
    /// Adds values of a line.
    pub(crate) const fn add(&mut self, line: usize, count: usize) {
        if self.count == 0 {
            self.first_line = line;
        }
        self.count += count;
    }

    /// Returns a warning, if there are any.
    pub fn warning(&self) -> Option<String> {
        let Self { count, first_line } = *self;
        match count {
            0 => None,
            1 => Some(format!(
                "a value in a column without a name is left out, on line {first_line}; name the column to keep it"
            )),
            _ => Some(format!(
                "{count} values in columns without a name are left out, the first on line {first_line}; name the columns to keep them"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{read_block_json, read_blocks, read_csv, read_jsonl};

    #[test]
    fn values_in_columns_without_a_name_are_counted() {
        let csv = "id,mesh,print,,folio,\na,m,p,,3,\nb,m,p,x,,\nc,m,p,y,,z\n";
        let read = read_csv(csv.as_bytes(), &mut drop).expect("a list");
        let warning = read.unnamed.warning();
        assert_eq!(
            warning.as_deref(),
            Some(
                "3 values in columns without a name are left out, the first on line 3; name the columns to keep them"
            )
        );
        let json = "{\"id\":\"a\",\"mesh\":\"m\",\"print\":\"p\",\"\":\"x\"}\n{\"id\":\"b\",\"mesh\":\"m\",\"print\":\"p\",\" \":\"\"}";
        let mut rows = Vec::new();
        let read = read_jsonl(json.as_bytes(), &mut |row| rows.push(row)).expect("a list");
        let warning = read.unnamed.warning();
        let one = "a value in a column without a name is left out, on line ";
        assert!(warning.is_some_and(|text| text.starts_with(&format!("{one}1;"))));
        assert!(rows.iter().all(|row| row.meta.is_empty()));
        let blocks = "block,mesh,page,\na,m,p,\nb,m,p,x\n";
        let read = read_blocks(blocks.as_bytes()).expect("a list");
        assert!(read.warnings[0].starts_with(&format!("{one}3;")));
        let blocks = "[{\"block\":\"a\",\"mesh\":\"m\",\"page\":\"p\",\"\":1}]";
        let read = read_block_json(blocks.as_bytes()).expect("a list");
        assert!(read.warnings[0].starts_with(&format!("{one}1;")));
        let none = read_csv(b"id,mesh,print,\na,m,p,\n", &mut drop).expect("a list");
        assert_eq!(none.unnamed.warning(), None);
    }
}
