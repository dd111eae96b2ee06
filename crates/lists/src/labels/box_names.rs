//! Names of boxes: those of the file, and those of their places.

use std::collections::HashSet;

use super::model::LabelBox;
use mocban_core::domain::BoxName;

/// Returns a name for each box: its own, or that of its place in the reading order. A place whose name another box has gets
/// the number of the box, too. `places` are those of the boxes, in the order of the boxes.
pub fn box_names(boxes: &[LabelBox], places: &[BoxName]) -> Vec<String> {
    let given: HashSet<String> = boxes
        .iter()
        .filter_map(|label| Some(label.name.as_deref()?.to_lowercase()))
        .collect();
    let name = |(number, (label, place)): (usize, (&LabelBox, &BoxName))| {
        label.name.clone().unwrap_or_else(|| {
            let name = place.to_string();
            // A name from the file may look like a place.
            if given.contains(&name) {
                format!("{name}-{number}")
            } else {
                name
            }
        })
    };
    boxes.iter().zip(places).enumerate().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::box_names;
    use crate::labels::{LabelBox, reading_order};

    #[test]
    fn boxes_without_a_name_get_that_of_their_place() {
        let mut boxes = [10.0, 30.0, 50.0].map(|y| LabelBox::rectangle([5.0, y, 20.0, y + 15.0]));
        boxes[0].name = Some("C01-R02".to_owned());
        let places = reading_order(&boxes.each_ref().map(LabelBox::bounds));
        let names = box_names(&boxes, &places);
        assert_eq!(names, ["C01-R02", "c01-r02-1", "c01-r03"]);
    }
}
