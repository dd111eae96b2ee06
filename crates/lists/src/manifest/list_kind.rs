//! Whether a list names pairs or whole blocks: by its columns, and by its first rows if the columns fit both.

use std::collections::BTreeSet;
use std::path::Path;

use super::block_columns;
use super::csv::column_names;
use super::folders::is_named_like_print;
use super::json_rows::rows_while;
use super::row;
use super::row_reader::row_reader;
use super::text::{CsvText, trimmed};
use crate::columns::KnownColumns;
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{PairName, sanitize, value_text};

/// Maximum number of rows that are read to decide.
const MAX_ROWS: usize = 1000;
/// Maximum number of attempts at a header, each with one more repeated column left out.
const MAX_REPEATED: usize = 8;
/// Longest name of a block or column in a message, in characters.
const MAX_SHOWN: usize = 48;

/// Whether a list names pairs or whole blocks.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ListKind {
    /// Whether it names blocks.
    pub is_of_blocks: bool,
    /// Says what was decided and why, if the columns fit both kinds.
    pub note: Option<String>,
}

impl ListKind {
    /// Finds the kind of a list in CSV. One that cannot be read counts as a list of pairs.
    pub fn of_csv(bytes: &[u8]) -> Self {
        let Ok(text) = CsvText::new(bytes) else {
            return Self::default();
        };
        let mut reader = row_reader(&text.bytes, text.delimiter);
        let mut header = ::csv::ByteRecord::new();
        if !matches!(reader.read_byte_record(&mut header), Ok(true)) {
            return Self::default();
        }
        let Ok(names) = column_names(1, &header, "") else {
            return Self::default();
        };
        let columns = KindColumns::of(&names);
        let mut signs = PairSigns::default();
        let mut record = ::csv::ByteRecord::new();
        for _ in 0..MAX_ROWS {
            reader.get_mut().begin_row();
            if columns.is_clear() || !matches!(reader.read_byte_record(&mut record), Ok(true)) {
                break;
            }
            signs.add(&columns, |at| {
                let cell = record.get(at).unwrap_or_default();
                String::from_utf8_lossy(cell).into_owned()
            });
        }
        columns.kind(&names, &signs)
    }

    /// Finds the kind of a list in JSON. Its columns are the keys of the first row that can be read.
    pub fn of_json(bytes: &[u8]) -> Self {
        let mut first: Option<(KindColumns, Vec<String>)> = None;
        let (mut signs, mut count) = (PairSigns::default(), 0);
        rows_while(bytes, |row| {
            let (columns, keys) = first.get_or_insert_with(|| {
                let keys: Vec<String> = row.iter().map(|(key, _)| key.clone()).collect();
                let names: Vec<&str> = keys.iter().map(|key| key.trim()).collect();
                (KindColumns::of(&names), keys)
            });
            if columns.is_clear() {
                return false;
            }
            signs.add(columns, |at| {
                let mut entries = row.iter();
                let entry = entries.find(|(key, value)| *key == keys[at] && !value.is_null());
                entry.map_or_else(String::new, |(_, value)| value_text(value).into_owned())
            });
            count += 1;
            count < MAX_ROWS
        });
        let Some((columns, keys)) = first else {
            return Self::default();
        };
        let names: Vec<&str> = keys.iter().map(|key| key.trim()).collect();
        columns.kind(&names, &signs)
    }
}

/// Positions of the columns by which a list of pairs differs from a list of blocks.
struct KindColumns {
    id: Option<usize>,
    /// The id of a pair, unless the same column is also the id of a block.
    own_id: Option<usize>,
    print: Option<usize>,
    character: Option<usize>,
    block: Option<usize>,
    page: Option<usize>,
    /// Whether there are labels or sides.
    has_others_of_blocks: bool,
}

impl KindColumns {
    fn of(names: &[&str]) -> Self {
        let blocks = first_columns(&block_columns::COLUMNS, names);
        let pairs = first_columns(&row::COLUMNS, names);
        let at = |columns: &[Option<&str>], name: &str| {
            columns.iter().position(|known| *known == Some(name))
        };
        let [id, print, character] = ["id", "print", "character"].map(|name| at(&pairs, name));
        let [block, page] = ["block", "page"].map(|name| at(&blocks, name));
        let mut others = ["labels", "side"].iter();
        Self {
            id,
            own_id: id.filter(|at| Some(*at) != block),
            print,
            character,
            block,
            page,
            has_others_of_blocks: others.any(|name| at(&blocks, name).is_some()),
        }
    }

    /// Returns whether the columns fit one kind only: every pair has an id and a print, every block an id and a page.
    const fn is_clear(&self) -> bool {
        let is_pair = self.id.is_some() && self.print.is_some();
        let is_like_pair =
            self.own_id.is_some() || self.print.is_some() || self.character.is_some();
        self.page.is_none() || is_pair || !is_like_pair && self.block.is_some()
    }

    fn kind(&self, names: &[&str], signs: &PairSigns) -> ListKind {
        let (has_id, has_print) = (self.id.is_some(), self.print.is_some());
        if self.is_clear() {
            let has_page = self.page.is_some() && !(has_id && has_print);
            let is_misspelt = self.block.is_some() && self.has_others_of_blocks;
            return ListKind {
                is_of_blocks: has_page || is_misspelt && !has_id && !has_print,
                note: None,
            };
        }
        if let Some(sign) = signs.text() {
            let note = format!(
                "this is read as a list of pairs, because {sign}; a list of blocks has one row for each block, with the columns block, mesh and page"
            );
            return ListKind {
                is_of_blocks: false,
                note: Some(note),
            };
        }
        let missing = match (has_id, has_print) {
            (true, _) => "print",
            (false, true) => "id",
            (false, false) => "id or print",
        };
        let kept = [self.own_id, self.print, self.character].into_iter();
        let kept: Vec<String> = kept
            .flatten()
            .map(|at| quoted(&sanitize(names[at], MAX_SHOWN)))
            .collect();
        let kept = match kept.as_slice() {
            [] => String::new(),
            [one] => format!("; column {one} is kept as metadata"),
            several => format!("; columns {} are kept as metadata", several.join(", ")),
        };
        let note = format!(
            "this is read as a list of blocks, because it has the column page and no column {missing}{kept}"
        );
        ListKind {
            is_of_blocks: true,
            note: Some(note),
        }
    }
}

/// Returns what the columns of a header are, without repeated ones. Their list is refused later, with the message of its kind.
fn first_columns(known: &KnownColumns, names: &[&str]) -> Vec<Option<&'static str>> {
    let mut names = names.to_vec();
    for _ in 0..MAX_REPEATED {
        match known.assign(&names) {
            Ok(found) => return found.columns,
            Err(same) => names[same.second - 1] = "",
        }
    }
    Vec::new()
}

/// Evidence for pairs in the rows of a list whose columns fit both kinds.
#[derive(Debug, Default)]
struct PairSigns {
    blocks: BTreeSet<String>,
    /// A block that several rows have.
    repeated: Option<String>,
    /// Whether a print is named like an image.
    has_print: bool,
    /// Whether a row has a page.
    has_page: bool,
    /// Whether a page is named like an image.
    has_page_image: bool,
}

impl PairSigns {
    /// Adds a row by the texts at the positions of its columns.
    fn add(&mut self, columns: &KindColumns, text: impl Fn(usize) -> String) {
        let text = |at: Option<usize>| {
            let text = at.map(&text).unwrap_or_default();
            trimmed(&text).to_owned()
        };
        let [block, print, page] = [columns.block, columns.print, columns.page].map(text);
        self.has_print |= is_named_like_print(Path::new(&print));
        self.has_page |= !page.is_empty();
        self.has_page_image |= is_named_like_print(Path::new(&page));
        let is_id = (1..=PairName::MAX_BYTES).contains(&block.len());
        if is_id && self.repeated.is_none() && !self.blocks.insert(block.clone()) {
            self.repeated = Some(block);
        }
    }

    /// Returns the first evidence as a clause of a sentence, if there is any.
    fn text(&self) -> Option<String> {
        if let Some(block) = &self.repeated {
            let block = quoted(&sanitize(block, MAX_SHOWN));
            Some(format!("several rows have the block {block}"))
        } else if self.has_print {
            Some("its prints have names of images".to_owned())
        } else if self.has_page && !self.has_page_image {
            Some("its pages have no names of images".to_owned())
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::ListKind;
    use crate::manifest::read_blocks;

    #[test]
    fn rows_decide_if_columns_fit_pairs_and_blocks() {
        for (list, is_of_blocks, expected) in [
            (
                "Nr,Ván,Bản quét,Bản in,Trang in\n1,b1,1.stl,1.png,b1.jpg\n",
                false,
                "this is read as a list of pairs, because its prints have names of images",
            ),
            (
                "Mã số;Ván;Bản quét;Ảnh;Trang in\n1;b1;1.stl;1.png;b1.jpg\n;;;;\n2;b1;2.stl;2.png;b1.jpg\n",
                false,
                "this is read as a list of pairs, because several rows have the block \"b1\"",
            ),
            (
                "block,mesh,page,character\nb1,1.stl,3a,天\n",
                false,
                "this is read as a list of pairs, because its pages have no names of images",
            ),
            (
                "Nr,Model,Image,Page\n1,1.stl,1.png,3a\n",
                false,
                "this is read as a list of pairs, because its pages have no names of images",
            ),
            (
                "id,block,mesh,page\n1,b1,1.stl,1.jpg\n2,b2,2.stl,2.jpg\n",
                true,
                "this is read as a list of blocks, because it has the column page and no column print; column \"id\" is kept as metadata",
            ),
            (
                "Ván,Bản quét,Trang in,Bản in,Chữ\nb1,1.stl,1.jpg,1872,112\n",
                true,
                "this is read as a list of blocks, because it has the column page and no column id; columns \"Bản in\", \"Chữ\" are kept as metadata",
            ),
        ] {
            let found = ListKind::of_csv(list.as_bytes());
            let note = found.note.expect(list);
            assert_eq!(found.is_of_blocks, is_of_blocks, "{note}");
            assert!(note.starts_with(expected), "{note}");
            let separator = if list.contains(';') { ';' } else { ',' };
            let mut lines = list.lines().map(|line| line.split(separator));
            let names: Vec<&str> = lines.next().expect("a header").collect();
            let rows = lines.map(|cells| {
                let entries = names.iter().zip(cells);
                let entries = entries.map(|(name, cell)| format!("{name:?}:{cell:?}"));
                format!("{{{}}}", entries.collect::<Vec<_>>().join(","))
            });
            let json = rows.collect::<Vec<_>>().join("\n");
            let same = ListKind::of_json(json.as_bytes());
            assert_eq!((same.is_of_blocks, same.note), (is_of_blocks, Some(note)));
        }
    }

    #[test]
    fn columns_of_one_kind_need_no_note() {
        for (list, is_of_blocks) in [
            ("id,mesh,print,block,page\n1,m,p,b,3\n2,m,p,b,3\n", false),
            ("block,mesh,page,labels,side\nb,m,p,l,front\n", true),
            ("Mã hiện vật,Bản quét,Trang in\nb,m,p\n", true),
            ("Mã hiện vật,Bản quét,Bản in,Trang in\nb,m,p,p.jpg\n", false),
            ("block,mesh,page\nb,m,3\nb,m,3\n", true),
        ] {
            let note = None;
            let expected = ListKind { is_of_blocks, note };
            assert_eq!(ListKind::of_csv(list.as_bytes()), expected, "{list}");
        }
    }

    #[test]
    fn a_list_of_blocks_with_two_same_columns_is_refused_as_one_of_blocks() {
        let list = "Ván,Bản quét,Trang in,Nhãn,Nhan\nb,m.stl,p.png,l.json,l.json\n".as_bytes();
        assert!(ListKind::of_csv(list).is_of_blocks);
        let refused = read_blocks(list).expect_err("two labels").to_string();
        let reason = "columns 4 and 5, \"Nhãn\" and \"Nhan\", have the same name (";
        assert!(refused.contains(reason), "{refused}");
        let list = "block,mesh,page,labels,Labels\nb,m.stl,p.png,l.json,l.json\n".as_bytes();
        let refused = read_blocks(list).expect_err("two labels").to_string();
        let reason = "columns 4 and 5, \"labels\" and \"Labels\", have the same name (";
        assert!(refused.contains(reason), "{refused}");
        let pairs = "Mã,Bản quét,Bản in,ma\n1,m.stl,p.png,1\n";
        assert!(!ListKind::of_csv(pairs.as_bytes()).is_of_blocks);
    }
}
