//! Names of cells, such as `AB12`.

/// Largest sheet: rows and columns of Excel.
pub(super) const MAX_ROWS: usize = 1 << 20;
pub(super) const MAX_COLUMNS: usize = 1 << 14;

/// Returns the column of a cell such as `AB12`, from 0.
pub(super) fn column(place: &str) -> Option<usize> {
    let letters = place.bytes().take_while(u8::is_ascii_alphabetic);
    let number = letters.take(4).fold(0, |number, letter| {
        number * 26 + usize::from(letter.to_ascii_uppercase() - b'A') + 1
    });
    number.checked_sub(1)
}

/// Returns the letters of a column.
fn letters(column: usize) -> String {
    let mut letters = Vec::new();
    let mut rest = column + 1;
    while rest > 0 {
        rest -= 1;
        letters.insert(0, b'A' + (rest % 26) as u8);
        rest /= 26;
    }
    String::from_utf8_lossy(&letters).into_owned()
}

/// Returns the name of a cell such as `AB12` from its column, from 0, and its row, from 1.
pub(super) fn cell_name(column: usize, row: usize) -> String {
    format!("{}{row}", letters(column))
}

/// Returns the row of a cell such as `AB12`, from 1, and its column, from 0.
pub(super) fn place(name: &str) -> Option<(usize, usize)> {
    let digits = name.trim_start_matches(|c: char| c.is_ascii_alphabetic());
    Some((digits.parse().ok()?, column(name)?))
}

#[cfg(test)]
mod tests {
    use super::{column, letters, place};

    #[test]
    fn columns_have_letters() {
        for (name, number) in [("A1", 0), ("Z9", 25), ("AA1", 26), ("xfd1048576", 16_383)] {
            assert_eq!(column(name), Some(number));
            let upper = name
                .trim_end_matches(|c: char| c.is_ascii_digit())
                .to_uppercase();
            assert_eq!(letters(number), upper);
        }
        assert_eq!(column("12"), None);
        assert_eq!(place("AB12"), Some((12, 27)));
        assert_eq!([place("12"), place("B"), place("B0x")], [None; 3]);
        assert!(column("ZZZZZZZZZZZZZZZZ1").is_some_and(|column| column > 16_383));
    }
}
