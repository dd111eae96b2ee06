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

/// Returns the unit that follows the word `unit` or `units` of a line. The word `in` is one only at the end.
fn unit_of(line: &[u8]) -> Option<LengthUnit> {
    let line = String::from_utf8_lossy(line).to_ascii_lowercase();
    let (_, rest) = line.split_once("unit")?;
    let words = rest.split(|c: char| !c.is_ascii_alphabetic());
    let mut words = words.filter(|word| !["", "s", "is", "are"].contains(word));
    match words.next()? {
        "in" => words.next().map_or(Some(LengthUnit::In), named_unit),
        word => named_unit(word),
    }
}

fn named_unit(name: &str) -> Option<LengthUnit> {
    LengthUnit::named(name).ok()
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
        ] {
            assert_eq!(unit_of(line.as_bytes()), unit, "{line}");
        }
        let xyz = b"# a scan\n# units: m\n0 0 0\n";
        assert_eq!(stated_unit(xyz), Some(LengthUnit::M));
        assert_eq!(stated_unit(b"0 0 0\nunits: m\n"), None);
    }
}
