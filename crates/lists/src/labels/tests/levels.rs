//! PAGE-XML whose elements are divided unevenly.

use super::samples::PAGE;
use crate::labels::model::Labels;
use crate::labels::read;

/// Returns an element with an id, a square outline and content.
fn element(name: &str, id: &str, [x, y, side]: [usize; 3], inside: &str) -> String {
    let (x1, y1) = (x + side, y + side);
    format!(
        "<{name} id=\"{id}\"><Coords points=\"{x},{y} {x1},{y} {x1},{y1} {x},{y1}\"/>{inside}</{name}>"
    )
}

fn labels(content: &str) -> Labels {
    let text = format!("<PcGts><Page imageFilename=\"page-03.jpg\">{content}</Page></PcGts>");
    read(text.as_bytes(), "p.xml", &PAGE).expect("valid")
}

fn names(labels: &Labels) -> Vec<&str> {
    let names = labels.boxes.iter().map(|label| label.name.as_deref());
    names.map(Option::unwrap_or_default).collect()
}

#[test]
fn an_element_that_is_divided_drops_no_others() {
    for (large, small) in [
        ("Word", "Glyph"),
        ("TextLine", "Word"),
        ("TextRegion", "Glyph"),
    ] {
        let glyph = element(small, "g", [105, 105, 80], "");
        let one = |k: usize| {
            let inside = if k == 3 { glyph.as_str() } else { "" };
            element(large, &format!("w{k}"), [100, 100 * k, 90], inside)
        };
        let found = labels(&(1..=8).map(one).collect::<String>());
        assert_eq!(
            names(&found),
            ["w1", "w2", "g", "w4", "w5", "w6", "w7", "w8"]
        );
        let warning = format!(
            "p.xml: 7 elements are not divided as others are, and taken as characters: {large} box 1 \"w1\""
        );
        assert!(
            found.warnings[0].starts_with(&warning),
            "{:?}",
            found.warnings
        );
        assert_eq!(found.warnings.len(), 1);
    }
}

#[test]
fn large_elements_beside_characters_are_left_out_by_name() {
    let glyph = |k: usize| element("Glyph", &format!("g{k}"), [100, 100 * k, 90], "");
    let glyphs: String = (1..=4).map(glyph).collect();
    let content = element("TextRegion", "r1", [50, 50, 600], &glyphs)
        + &element(
            "TextRegion",
            "r2",
            [900, 50, 600],
            &element("TextLine", "l1", [900, 60, 500], ""),
        )
        + &element("TextRegion", "r3", [700, 50, 190], "");
    let found = labels(&content);
    assert_eq!(names(&found), ["g1", "g2", "g3", "g4"]);
    assert_eq!(
        found.warnings,
        [
            "p.xml: 2 elements are not divided as others are, and left out, because they hold several characters: \
          TextLine box 5 \"l1\", TextRegion box 6 \"r3\""
        ]
    );
}

#[test]
fn an_element_whose_parts_have_no_outline_stands_for_itself() {
    let words = element("Word", "w1", [100, 100, 90], "<Glyph id=\"g\"/>")
        + &element("Word", "w2", [100, 200, 90], "");
    assert_eq!(names(&labels(&words)), ["w1", "w2"]);
}
