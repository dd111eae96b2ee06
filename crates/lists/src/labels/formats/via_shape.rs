//! Shapes of VIA, which its JSON and CSV files share.

use serde_json::{Map, Value};

use crate::labels::error::LabelsProblem;
use crate::labels::region::{
    Corners, LabelRegion, box_around, box_between, coordinate, coordinates, name_attribute,
    polygon, shown, sized_box, text_attribute,
};

/// Reads a region from its shape and its attributes.
pub(super) fn region(
    number: usize,
    shape: &Map<String, Value>,
    attributes: &Map<String, Value>,
) -> Result<LabelRegion, LabelsProblem> {
    let problem = |reason| LabelsProblem::at(format!("box {number}"), reason);
    Ok(LabelRegion {
        number,
        corners: corners(shape).map_err(problem)?,
        name: name_attribute(attributes).map_err(problem)?,
        text: text_attribute(attributes),
    })
}

/// Returns the corners of a shape: those of a rectangle or polygon, or of the box around another shape. `None` for a
/// point and for a polygon of fewer than three points.
fn corners(shape: &Map<String, Value>) -> Result<Option<Corners>, String> {
    let Some(Value::String(name)) = shape.get("name") else {
        return Err("the shape has no name".to_owned());
    };
    match name.as_str() {
        "rect" => {
            let sides = coordinates(shape, ["x", "y", "width", "height"])?;
            Ok(Some(sized_box(sides)))
        }
        "circle" => {
            let [cx, cy, r] = coordinates(shape, ["cx", "cy", "r"])?;
            Ok(Some(box_between([cx - r, cy - r], [cx + r, cy + r])))
        }
        "ellipse" => {
            let [cx, cy, rx, ry] = coordinates(shape, ["cx", "cy", "rx", "ry"])?;
            // Radians; missing in VIA 1.
            let theta = match shape.get("theta") {
                None => 0.0,
                value => coordinate(value, "theta")?,
            };
            let (sin, cos) = theta.sin_cos();
            let (dx, dy) = ((rx * cos).hypot(ry * sin), (rx * sin).hypot(ry * cos));
            Ok(Some(box_between([cx - dx, cy - dy], [cx + dx, cy + dy])))
        }
        "polygon" => Ok(polygon(points(shape)?)),
        "polyline" => Ok(box_around(&points(shape)?)),
        "point" => Ok(None),
        _ => Err(format!("{} is not a shape of VIA", shown(&shape["name"]))),
    }
}

/// Reads the points of a polygon or polyline.
fn points(shape: &Map<String, Value>) -> Result<Corners, String> {
    let list = |key: &'static str| {
        let values = shape.get(key).and_then(Value::as_array);
        values.ok_or_else(|| format!("{key} is not a list"))
    };
    let (xs, ys) = (list("all_points_x")?, list("all_points_y")?);
    if xs.len() != ys.len() {
        let (x, y) = (xs.len(), ys.len());
        return Err(format!(
            "{x} values in all_points_x, but {y} in all_points_y"
        ));
    }
    let point = |(x, y)| {
        let x = coordinate(Some(x), "a value of all_points_x")?;
        Ok([x, coordinate(Some(y), "a value of all_points_y")?])
    };
    xs.iter().zip(ys).map(point).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::{Map, Value, json};

    use super::corners;
    use crate::labels::model::bounds;

    fn map(value: Value) -> Map<String, Value> {
        let Value::Object(map) = value else {
            unreachable!("the tests pass objects")
        };
        map
    }

    #[test]
    fn round_shapes_and_lines_give_the_box_around_them() {
        for (shape, expected) in [
            (
                json!({"name": "circle", "cx": 10, "cy": 20, "r": 5}),
                [5.0, 15.0, 15.0, 25.0],
            ),
            (
                json!({"name": "ellipse", "cx": 10, "cy": 20, "rx": 4, "ry": 2}),
                [6.0, 18.0, 14.0, 22.0],
            ),
            (
                json!({"name": "ellipse", "cx": 10, "cy": 20, "rx": 4, "ry": 2, "theta": std::f64::consts::FRAC_PI_2}),
                [8.0, 16.0, 12.0, 24.0],
            ),
            (
                json!({"name": "polyline", "all_points_x": [3, 9, 5], "all_points_y": [1, 2, 8]}),
                [3.0, 1.0, 9.0, 8.0],
            ),
            (
                json!({"name": "rect", "x": 9, "y": 8, "width": -6, "height": -7}),
                [3.0, 1.0, 9.0, 8.0],
            ),
        ] {
            let corners = corners(&map(shape.clone()))
                .expect("valid")
                .expect("an area");
            let found = bounds(&corners);
            let close = found
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-9);
            assert!(close, "{shape}: {found:?}");
        }
    }

    #[test]
    fn points_have_no_area() {
        for shape in [
            json!({"name": "point", "cx": 3, "cy": 4}),
            json!({"name": "polygon", "all_points_x": [1, 5, 1], "all_points_y": [1, 5, 1]}),
            json!({"name": "polyline", "all_points_x": [], "all_points_y": []}),
        ] {
            assert_eq!(corners(&map(shape.clone())), Ok(None), "{shape}");
        }
    }
}
