//! The unit that a mesh file names in a comment. Formats of meshes have none.

use super::text;
use crate::domain::LengthUnit;

/// Bytes at the beginning of a file in which it may name its unit.
const UNIT_BYTES: usize = 4096;
/// Beginnings of lines that may name the unit.
const COMMENTS: [&[u8]; 5] = [b"#", b"//", b"comment", b"obj_info", b"solid"];

/// Returns the unit that a comment at the beginning of a file names.
pub(super) fn stated_unit(head: &[u8]) -> Option<LengthUnit> {
    let head = &head[..head.len().min(UNIT_BYTES)];
    let mut lines = text::lines(head).map(|(_, line)| line);
    lines.find_map(|line| {
        let is_comment = COMMENTS.iter().any(|start| line.starts_with(start));
        is_comment.then(|| unit_of(line)).flatten()
    })
}

/// Words of other languages that are units in a list, but rarely in a comment.
const OTHER_WORDS: [&str; 3] = ["met", "metro", "metros"];

/// Returns the unit that follows the word `unit` or `units` of a line. The word `in` is one only at the end. A unit behind a
/// number other than 1, as in `0.1 mm`, is none.
fn unit_of(line: &[u8]) -> Option<LengthUnit> {
    let line = text_of(line).to_lowercase();
    let (_, rest) = line.split_once("unit")?;
    // A decimal comma.
    let rest = rest.replace(",0 ", ".0 ");
    let words = rest.split(|c: char| !c.is_alphanumeric() && !".㎜㎝㎛".contains(c));
    let words = words.map(|word| word.trim_matches('.'));
    let mut words =
        words.filter(|word| !["", "s", "is", "are"].contains(word) && number_of(word) != Some(1.0));
    match words.next()? {
        "in" => words.next().map_or(Some(LengthUnit::In), named_unit),
        word => named_unit(word),
    }
}

/// Returns a line as text. The letter µ of Windows-1252 is kept.
fn text_of(line: &[u8]) -> String {
    let of_bytes = || line.iter().map(|byte| char::from(*byte)).collect();
    String::from_utf8(line.to_vec()).unwrap_or_else(|_not_utf8| of_bytes())
}

/// Returns the unit that a word is, which 1 may precede.
fn named_unit(word: &str) -> Option<LengthUnit> {
    let is_of_number = |c: char| c.is_ascii_digit() || c == '.';
    let (number, name) = word.split_at(word.len() - word.trim_start_matches(is_of_number).len());
    let is_one = number.is_empty() || number_of(number) == Some(1.0);
    let is_unit = is_one && !OTHER_WORDS.contains(&name);
    is_unit.then(|| LengthUnit::named(name).ok()).flatten()
}

fn number_of(word: &str) -> Option<f64> {
    word.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::{stated_unit, unit_of};
    use crate::domain::LengthUnit;

    #[test]
    fn a_unit_is_read_in_a_comment() {
        for (line, unit) in [
            ("# units: mm", Some(LengthUnit::Mm)),
            ("comment Unit = Meters", Some(LengthUnit::M)),
            ("# all units are in inches", Some(LengthUnit::In)),
            ("# units: in", Some(LengthUnit::In)),
            ("# units: in (inches)", Some(LengthUnit::In)),
            ("solid plate UNITS=cm", Some(LengthUnit::Cm)),
            ("# units are in the manual", None),
            ("# unit vectors", None),
            ("# mm", None),
            ("# units: µm", None),
            ("# unit = 0.1 mm", None),
            ("# unit = 1 mm", Some(LengthUnit::Mm)),
            ("# unit: 10mm", None),
            ("# unit: 1mm.", Some(LengthUnit::Mm)),
            ("# unit = 1,0 mm", Some(LengthUnit::Mm)),
            ("# units met the specification", None),
            ("# 1 unit = 1.0 mm", Some(LengthUnit::Mm)),
            ("# 1 unit = 0.001 m", None),
            ("# Units: milimét", Some(LengthUnit::Mm)),
            ("# units: [mm]", Some(LengthUnit::Mm)),
            ("comment unit \"mm\"", Some(LengthUnit::Mm)),
        ] {
            assert_eq!(unit_of(line.as_bytes()), unit, "{line}");
        }
        assert_eq!(unit_of(b"# units: \xb5m"), None);
        let xyz = b"# a scan\n# units: m\n0 0 0\n";
        assert_eq!(stated_unit(xyz), Some(LengthUnit::M));
        assert_eq!(stated_unit(b"0 0 0\nunits: m\n"), None);
    }
}
