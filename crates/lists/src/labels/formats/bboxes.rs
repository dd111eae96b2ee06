//! `{"bboxes": [{"x_min": 0, "y_min": 0, "x_max": 1, "y_max": 1}]}`, or the list alone.

use serde_json::Value;

use crate::labels::error::LabelsProblem;
use crate::labels::region::{
    LabelRegion, PageRegions, box_between, coordinates, name_attribute, object, text_attribute,
};

/// Returns whether the first value of a list is a box of this format.
pub(in crate::labels) fn is_list(list: &[Value]) -> bool {
    list.first()
        .is_some_and(|first| first.get("x_min").is_some())
}

/// Reads the boxes of a page. Names and characters are attributes of a box itself.
pub(in crate::labels) fn read(boxes: &[Value]) -> Result<PageRegions, LabelsProblem> {
    let read_box = |(k, value): (usize, &Value)| {
        let place = || format!("box {}", k + 1);
        let attributes = object(value, place)?;
        let edges = coordinates(attributes, ["x_min", "y_min", "x_max", "y_max"]);
        let [x0, y0, x1, y1] = edges.map_err(|reason| LabelsProblem::at(place(), reason))?;
        Ok(LabelRegion {
            number: k + 1,
            name: name_attribute(attributes)
                .map_err(|reason| LabelsProblem::at(place(), reason))?,
            text: text_attribute(attributes),
            corners: Some(box_between([x0, y0], [x1, y1])),
        })
    };
    let regions = boxes.iter().enumerate().map(read_box);
    Ok(PageRegions {
        regions: regions.collect::<Result<_, _>>()?,
        ..PageRegions::default()
    })
}
