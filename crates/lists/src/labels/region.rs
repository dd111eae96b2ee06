//! Regions as the formats give them: shapes and attributes, before they are fitted to the page.

use serde_json::{Map, Number, Value};

use super::error::LabelsProblem;
use super::message::quoted;
use super::model::{bounds, rectangle};
use crate::json_numbers::number_text;

/// Attributes that name a box, in order of preference. Upper and lower case are equal.
pub const NAME_ATTRIBUTES: &[&str] = &["id", "name"];

/// Attributes that hold the character of a box, in order of preference. Upper and lower case are equal.
pub const TEXT_ATTRIBUTES: &[&str] = &[
    "character",
    "char",
    "text",
    "transcription",
    "unicode",
    "label",
];

/// Names of classes that say what kind of thing a box holds, not which character.
const KINDS: &[&str] = &[
    "box",
    "char",
    "character",
    "class",
    "column",
    "default",
    "glyph",
    "item",
    "label",
    "line",
    "object",
    "none",
    "page",
    "region",
    "stroke",
    "symbol",
    "text",
    "textline",
    "textregion",
    "undefined",
    "unknown",
    "word",
];

/// Largest coordinate in pixels that is read.
const MAX_COORDINATE: f64 = 1e9;

/// Corners of a shape, in the frame of the file.
pub(super) type Corners = Vec<[f64; 2]>;

/// A region of a file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LabelRegion {
    /// Number of the region on its page, from 1 in the order of the file.
    pub(super) number: usize,
    pub(super) name: Option<String>,
    pub(super) text: Option<String>,
    /// Corners; (0, 0) is the outer corner of the top-left pixel. `None` for points and lines.
    pub(super) corners: Option<Corners>,
}

impl LabelRegion {
    /// Returns the number and the name for a message.
    pub(super) fn shown(&self) -> String {
        match &self.name {
            Some(name) => format!("box {} {}", self.number, quoted(name)),
            None => format!("box {}", self.number),
        }
    }
}

/// The regions of one page, and what the file says about this page.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PageRegions {
    /// File name of the page.
    pub(super) file_name: Option<String>,
    /// Size of the page's file in bytes.
    pub(super) bytes: Option<u64>,
    /// Width and height of the image in pixels.
    pub(super) size: Option<[f64; 2]>,
    pub(super) regions: Vec<LabelRegion>,
    /// What was assumed or left out.
    pub(super) warnings: Vec<String>,
}

/// Returns the first attribute in the order of `keys` that is a text, or also a whole number if `numbers`.
fn attribute<'a>(
    attributes: &'a Map<String, Value>,
    keys: &[&str],
    numbers: bool,
) -> Option<&'a Value> {
    let found = attributes.iter().filter_map(|(name, value)| {
        let rank = keys.iter().position(|key| name.eq_ignore_ascii_case(key))?;
        let is_taken = match value {
            Value::String(text) => filled(text).is_some(),
            Value::Number(number) => numbers && is_whole(number),
            _ => false,
        };
        is_taken.then_some((rank, value))
    });
    found.min_by_key(|(rank, _)| *rank).map(|(_, value)| value)
}

/// Returns whether a number has no decimals, or only `.0`, as Python writes those of a column with gaps.
fn is_whole(number: &Number) -> bool {
    !number.is_f64() || number.as_f64().is_some_and(|whole| whole.fract() == 0.0)
}

/// Returns a text without spaces at its ends, or `None` if nothing is left.
pub(super) fn filled(text: &str) -> Option<String> {
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

/// Returns the name of a region: a text, or a whole number.
///
/// # Errors
/// Returns an error if the number is too large to be exact.
pub(super) fn name_attribute(attributes: &Map<String, Value>) -> Result<Option<String>, String> {
    match attribute(attributes, NAME_ATTRIBUTES, true) {
        Some(Value::String(text)) => Ok(filled(text)),
        Some(Value::Number(number)) => {
            let text = number_text(number).map_err(|error| error.to_string())?;
            Ok(Some(text))
        }
        _ => Ok(None),
    }
}

/// Returns the character of a region if it is a text.
pub(super) fn text_attribute(attributes: &Map<String, Value>) -> Option<String> {
    let value = attribute(attributes, TEXT_ATTRIBUTES, false)?;
    value.as_str().and_then(filled)
}

/// Returns the name of a class as the character, unless it names a kind of thing, such as `character`.
pub(super) fn class_text(name: &str) -> Option<String> {
    filled(name).filter(|text| !KINDS.contains(&text.to_lowercase().as_str()))
}

/// Returns a value as an object.
pub(super) fn object(
    value: &Value,
    place: impl FnOnce() -> String,
) -> Result<&Map<String, Value>, LabelsProblem> {
    let problem = || LabelsProblem::at(place(), format!("{} is not an object", shown(value)));
    value.as_object().ok_or_else(problem)
}

/// Returns a JSON value for a message.
pub(super) fn shown(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => quoted(text),
        Value::Array(values) => format!("a list of {}", values.len()),
        Value::Object(_) => "an object".to_owned(),
    }
}

/// Checks that a number is a coordinate.
pub(super) fn checked(number: f64, what: &str) -> Result<f64, String> {
    if number.abs() <= MAX_COORDINATE {
        Ok(number)
    } else {
        Err(format!("{what} is {number:?}, not a coordinate in pixels"))
    }
}

/// Returns a coordinate from JSON.
pub(super) fn coordinate(value: Option<&Value>, what: &str) -> Result<f64, String> {
    match value {
        None => Err(format!("{what} is missing")),
        Some(Value::Number(number)) => checked(number.as_f64().unwrap_or(f64::NAN), what),
        Some(other) => Err(format!("{what} is {}, not a number", shown(other))),
    }
}

/// Reads several coordinates of an object.
pub(super) fn coordinates<const N: usize>(
    object: &Map<String, Value>,
    keys: [&str; N],
) -> Result<[f64; N], String> {
    let mut all = [0.0; N];
    for (to, key) in all.iter_mut().zip(keys) {
        *to = coordinate(object.get(key), key)?;
    }
    Ok(all)
}

/// Returns the corners of a box from its corner, width and height. A negative width or height extends to the other side.
pub(super) fn sized_box([x, y, width, height]: [f64; 4]) -> Corners {
    box_between([x, y], [x + width, y + height])
}

/// Returns the corners of the box between two opposite corners in any order.
pub(super) fn box_between(a: [f64; 2], b: [f64; 2]) -> Corners {
    rectangle(bounds(&[a, b]))
}

/// Returns the corners of the box around points, or `None` without points.
pub(super) fn box_around(points: &[[f64; 2]]) -> Option<Corners> {
    (!points.is_empty()).then(|| rectangle(bounds(points)))
}

/// Returns the corners of a polygon without a repeated first corner, or `None` for fewer than three. Rectangles get the
/// same order of corners as boxes.
pub(super) fn polygon(mut points: Corners) -> Option<Corners> {
    while points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    points.dedup();
    if points.len() < 3 {
        return None;
    }
    let upright = rectangle(bounds(&points));
    // Neighbouring corners of a rectangle share one coordinate; a bow tie has diagonals.
    let is_upright = points.len() == 4
        && points.iter().all(|point| upright.contains(point))
        && points
            .iter()
            .zip(points.iter().cycle().skip(1))
            .all(|(a, b)| (a[0] == b[0]) != (a[1] == b[1]));
    Some(if is_upright { upright } else { points })
}
