//! JSON of labelme: one page per file.

use serde_json::{Map, Value};

use crate::labels::error::LabelsProblem;
use crate::labels::region::{
    Corners, LabelRegion, PageRegions, box_around, box_between, class_text, coordinate, object,
    polygon, shown,
};

/// Reads the regions of a page. The label of a shape is its character.
pub(in crate::labels) fn read(
    file: &Map<String, Value>,
    shapes: &[Value],
) -> Result<PageRegions, LabelsProblem> {
    let side = |key: &str| {
        file.get(key)
            .and_then(Value::as_f64)
            .filter(|side| *side >= 1.0)
    };
    let size = side("imageWidth").zip(side("imageHeight"));
    let read_shape = |(k, value): (usize, &Value)| {
        let place = || format!("box {}", k + 1);
        let shape = object(value, place)?;
        let label = shape.get("label").and_then(Value::as_str);
        Ok(LabelRegion {
            number: k + 1,
            name: None,
            text: label.and_then(class_text),
            corners: corners(shape).map_err(|reason| LabelsProblem::at(place(), reason))?,
        })
    };
    let regions = shapes.iter().enumerate().map(read_shape);
    Ok(PageRegions {
        file_name: file
            .get("imagePath")
            .and_then(Value::as_str)
            .map(str::to_owned),
        size: size.map(|(width, height)| [width, height]),
        regions: regions.collect::<Result<_, _>>()?,
        ..PageRegions::default()
    })
}

/// Returns the corners of a shape. `None` for points and lines.
fn corners(shape: &Map<String, Value>) -> Result<Option<Corners>, String> {
    // Old versions know only polygons, and write no type.
    let kind = match shape.get("shape_type") {
        None | Some(Value::Null) => "polygon",
        Some(Value::String(kind)) => kind,
        Some(other) => return Err(format!("shape_type is {}, not a text", shown(other))),
    };
    let points = points(shape)?;
    match (kind, points.as_slice()) {
        // A mask has the corners of its box, too.
        ("rectangle" | "mask" | "linestrip", points) => Ok(box_around(points)),
        ("circle", [centre, edge]) => {
            let r = (edge[0] - centre[0]).hypot(edge[1] - centre[1]);
            let [x, y] = *centre;
            Ok(Some(box_between([x - r, y - r], [x + r, y + r])))
        }
        ("circle", points) => Err(format!("a circle has {} points, not 2", points.len())),
        ("polygon" | "rotation", _) => Ok(polygon(points)),
        ("point" | "points" | "line", _) => Ok(None),
        _ => Err(format!(
            "{} is not a shape of labelme",
            shown(&shape["shape_type"])
        )),
    }
}

fn points(shape: &Map<String, Value>) -> Result<Corners, String> {
    let Some(Value::Array(points)) = shape.get("points") else {
        return Err("points are missing".to_owned());
    };
    let point = |value: &Value| match value.as_array().map(Vec::as_slice) {
        Some([x, y]) => Ok([coordinate(Some(x), "x")?, coordinate(Some(y), "y")?]),
        _ => Err(format!("{} is not a point [x, y]", shown(value))),
    };
    points.iter().map(point).collect()
}
