//! Ids that differ from another one only by the decimals `.0` or `,0`, such as `117.0` beside `117`.

use mocban_core::domain::PairName;
use mocban_core::domain::spelling::quoted;

use super::row::RowIds;
use super::whole_numbers::{whole_and_decimals, whole_part};

/// Largest number of ids that are compared with the others.
const MAX_IDS: usize = 10_000;

/// The first ids that are whole numbers with `.0` or `,0`, each with its line.
#[derive(Debug, Default)]
pub struct DecimalIds(Vec<(usize, String)>);

impl DecimalIds {
    /// Adds the id of a row.
    pub fn add(&mut self, line: usize, id: &str) {
        if whole_part(id).is_some() && self.0.len() < MAX_IDS {
            self.0.push((line, id.to_owned()));
        }
    }

    /// Returns a warning if the list also has some of them without these decimals.
    pub fn warning(&self, ids: &RowIds) -> Option<String> {
        let is_doubled = |id: &str| {
            let whole = PairName::new(whole_part(id)?).ok()?;
            Some(ids.contains(&whole))
        };
        let mut doubled = self.0.iter().filter(|(_, id)| is_doubled(id) == Some(true));
        let (line, id) = doubled.next()?;
        let (_, decimals) = whole_and_decimals(id)?;
        let count = 1 + doubled.filter(|(_, id)| id.ends_with(decimals)).count();
        Some(format!(
            "ids that differ from another one only by {decimals}: {count}, the first {} on line {line}; correct them if both mean one",
            quoted(id)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{read_block_json, read_blocks, read_csv};
    use super::DecimalIds;

    #[test]
    fn a_number_with_and_without_decimals_is_named() {
        let expected = "ids that differ from another one only by .0: 1, the first \"117.0\" on line 2; correct them if both \
            mean one";
        for (list, warning) in [
            (
                "id,mesh,print\n117.0,a,a\n117,b,b\n118.0,c,c\n",
                Some(expected),
            ),
            (
                "id;mesh;print\n117,0;a;a\n117;b;b\n118,0;c;c\n",
                Some(&*expected.replace("117.0", "117,0").replace(".0:", ",0:")),
            ),
            ("id,mesh,print\n117.0,a,a\nb,b,b\n", None),
            ("id,mesh,print\n117.0,a,a\n117.00,b,b\n", None),
        ] {
            let mut ids = DecimalIds::default();
            let read = read_csv(list.as_bytes(), &mut |row| {
                ids.add(row.line, row.name.as_str());
            });
            let read = read.expect(list);
            assert_eq!(ids.warning(&read.ids).as_deref(), warning, "{list}");
        }
        let blocks = read_blocks(b"block,mesh,page\n117.0,a,a\n117,b,b\n").expect("a list");
        assert_eq!(blocks.warnings, [expected]);
        let json = r#"
{"block":"117.0","mesh":"a","page":"a"}
{"block":"117","mesh":"b","page":"b"}"#;
        let blocks = read_block_json(json.as_bytes()).expect("a list");
        assert_eq!(blocks.warnings, [expected]);
    }
}
