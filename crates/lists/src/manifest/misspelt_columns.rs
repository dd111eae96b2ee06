//! Misspelt names of optional columns, which are kept as metadata, and swapped ones.

use super::row::{ManifestRow, OPTIONAL};
use super::similar_columns::SimilarColumns;

/// Finds columns of pairs that are kept as metadata although their names are similar to that of an optional column, and
/// swapped ones.
#[derive(Debug, Default)]
pub struct MisspeltColumns {
    similar: SimilarColumns,
    /// Rows whose block is one Han character, and rows whose character is.
    han_blocks: usize,
    han_characters: usize,
}

impl MisspeltColumns {
    /// Adds the columns of a row.
    pub fn add(&mut self, row: &ManifestRow) {
        let [character, block, unit, face_down] = OPTIONAL;
        let optional = [
            (character, row.character.is_some()),
            (block, row.block.is_some()),
            (unit, row.unit.is_some()),
            (face_down, row.scanned_face_down.is_some()),
        ];
        self.similar.add(&optional, row.meta.keys());
        self.han_blocks += usize::from(is_han_character(row.block.as_deref()));
        self.han_characters += usize::from(is_han_character(row.character.as_deref()));
    }

    /// Returns a warning for each column.
    pub fn warnings(&self) -> Vec<String> {
        let has_characters = self.similar.is_used("character");
        let is_swapped = self.han_blocks > 0 && self.han_characters == 0 && has_characters;
        let swapped = is_swapped.then(|| {
            "column \"block\" has single characters and column \"character\" has none; swap their names if they are mixed \
             up, and import again"
                .to_owned()
        });
        self.similar.warnings().chain(swapped).collect()
    }
}

/// Returns whether a text is one Han character.
fn is_han_character(text: Option<&str>) -> bool {
    let mut chars = text.unwrap_or_default().chars();
    let is_han = |c| matches!(c, '\u{3400}'..='\u{9fff}' | '\u{f900}'..='\u{faff}' | '\u{20000}'..='\u{3ffff}');
    chars.next().is_some_and(is_han) && chars.next().is_none()
}

#[cfg(test)]
mod tests {
    use super::MisspeltColumns;

    fn warnings(list: &str) -> Vec<String> {
        let mut columns = MisspeltColumns::default();
        for row in super::super::parse_csv(list.as_bytes()).expect("a list") {
            columns.add(&row);
        }
        columns.warnings()
    }

    #[test]
    fn misspelt_and_abbreviated_columns_are_reported() {
        let found =
            warnings("id,mesh,print,charactr,Units,blk,folio\na,m,p,x,mm,b,2\nb,m,p,y,mm,b,3\n");
        assert_eq!(found.len(), 3, "{found:?}");
        assert_eq!(
            found[2],
            "column \"Units\" is kept as metadata; rename it to \"unit\" if it is meant, and import again"
        );
        assert_eq!(warnings("id,mesh,print,char\na,m,p,x\n").len(), 1);
        let found = warnings("id,mesh,print,character name,block id,face down\na,m,p,x,b,no\n");
        assert_eq!(found.len(), 3, "{found:?}");
        let found = warnings("id,mesh,print,Chữ,ván,đơn vị\na,m,p,天,b,mm\n");
        assert_eq!(found.len(), 0, "{found:?}");
    }

    #[test]
    fn swapped_characters_and_blocks_are_reported() {
        let found = warnings("id,mesh,print,character,block\na,m,p,b1,天\nb,m,p,b1,地\n");
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].contains("swap their names"), "{found:?}");
        for rows in ["a,m,p,天,b1", "a,m,p,天,地", "a,m,p,,地", "a,m,p,b,天地"] {
            let list = format!("id,mesh,print,character,block\n{rows}\n");
            assert_eq!(warnings(&list), Vec::<String>::new());
        }
    }

    #[test]
    fn a_column_beside_the_known_one_and_other_names_are_not_reported() {
        let list = "id,mesh,print,unit,units,note,book,scan,kind,page,side,row\na,m,p,mm,x,x,x,x,x,x,x,x\n";
        assert_eq!(warnings(list), Vec::<String>::new());
    }
}
