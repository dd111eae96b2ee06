//! The table of all fields of a record, with unit and frame. Types and meanings come from the JSON Schema.

use std::fmt::Write as _;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value;

/// A field of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RecordField {
    /// Name in JSON.
    pub(super) name: &'static str,
    /// Unit, or empty.
    pub(super) unit: &'static str,
    /// Frame of coordinates, or empty.
    pub(super) frame: &'static str,
}

const fn field(name: &'static str, unit: &'static str, frame: &'static str) -> RecordField {
    RecordField { name, unit, frame }
}

/// The fields of a pair, in their order.
pub(super) const PAIR_FIELDS: [RecordField; 37] = [
    field("id", "", ""),
    field("character", "", ""),
    field("block", "", ""),
    field("label", "", ""),
    field("box", "px", "page"),
    field("unit", "", ""),
    field("scanned_face_down", "", ""),
    field("mesh", "", ""),
    field("print", "", ""),
    field("meta", "", ""),
    field("split", "", ""),
    field("status", "", ""),
    field("error_class", "", ""),
    field("error", "", ""),
    field("plane_from_mesh", "mesh unit", "mesh to plane"),
    field("depth_from_plane", "px per mesh unit", "plane to depth map"),
    field("height_from_mesh", "mesh unit", "mesh to fitted surface"),
    field("height_min", "mesh unit", "fitted surface"),
    field("height_per_level", "mesh unit", "fitted surface"),
    field("mesh_unit_per_px", "mesh unit", "depth map"),
    field("mm_per_mesh_unit", "mm", ""),
    field("depth_size_px", "px", "depth map"),
    field("threshold_print", "level 0-65535", "print"),
    field("light_on_dark", "", "print"),
    field("print_orientation", "", "print"),
    field("canvas_px", "px", "canvas"),
    field("canvas_from_print", "px", "print to canvas"),
    field("picture_from_print", "px", "print to pictures"),
    field("page_from_crop", "px", "print to page"),
    field("page_from_mesh", "px; mesh unit", "mesh to page and tops"),
    field("manual_alignment", "", ""),
    field("displaced", "px", "print"),
    field("mesh_hash", "", ""),
    field("print_hash", "", ""),
    field("config_hash", "", ""),
    field("seconds", "s", ""),
    field("metric", "", ""),
];

/// The fields of a metric after its name, in their order.
pub(super) const METRIC_FIELDS: [RecordField; 23] = [
    field("threshold_level", "level 1-65535", "depth map"),
    field("threshold_depth", "mesh unit", "fitted surface"),
    field("angle_deg", "degree", "depth map to print"),
    field("scale", "px per px", "depth map to print"),
    field("shift_px", "px", "print"),
    field("ssim", "", "canvas"),
    field("nl_ssim", "", "canvas"),
    field("iou", "0-1", "canvas"),
    field("iou_box", "0-1", "canvas"),
    field("dice", "0-1", "canvas"),
    field("density_print", "0-1", "canvas"),
    field("density_depth", "0-1", "canvas"),
    field("disagreements", "", "canvas"),
    field("missing_ink", "0-1", "canvas"),
    field("missing_wood", "0-1", "canvas"),
    field("confidence", "0-1", ""),
    field("margin", "", ""),
    field("at_bound", "", ""),
    field(
        "print_from_mesh",
        "px; mesh unit",
        "mesh to print and plane",
    ),
    field("print_from_depth", "px", "depth map to print"),
    field("verdict", "", ""),
    field("verdicts", "", ""),
    field("result_hash", "", ""),
];

/// The fields of a whole block, in their order.
pub(super) const BLOCK_FIELDS: [RecordField; 14] = [
    field("block", "", ""),
    field("mesh", "", ""),
    field("page", "", ""),
    field("labels", "", ""),
    field("unit", "", ""),
    field("meta", "", ""),
    field("status", "", ""),
    field("error_class", "", ""),
    field("error", "", ""),
    field("side", "", ""),
    field("accepted", "", ""),
    field("agreement", "0-1", ""),
    field("characters", "", ""),
    field("map", "mesh unit; px", "mesh and page"),
];

/// The pictures of a pair.
pub(super) const FILE_FIELDS: [RecordField; 10] = [
    field("print", "", "pictures"),
    field("print_mask", "255 = ink", "pictures"),
    field("depth", "level", "depth map"),
    field("depth_mask", "255 = stroke", "depth map"),
    field("aligned_depth", "level", "pictures"),
    field("aligned_mask", "255 = stroke", "pictures"),
    field("canvas_depth_mask", "255 = stroke", "canvas"),
    field("canvas_print_mask", "255 = ink", "canvas"),
    field("stroke_map", "0, 128, 255", "canvas"),
    field("overlay", "", ""),
];

/// Returns the JSON Schema of a type, without references.
pub(super) fn schema_of<T: JsonSchema>() -> Value {
    let settings =
        SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    settings.into_generator().into_root_schema_for::<T>().into()
}

/// Returns tables of fields as Markdown, each with its heading. Fields that the schema lacks are left out.
pub(super) fn markdown_table(schema: &Value, tables: &[(&str, &[RecordField])]) -> String {
    let mut text = String::new();
    for (heading, fields) in tables {
        if !heading.is_empty() {
            let _ = write!(
                text,
                "## {heading}\n\n| field | type | unit | frame | meaning |\n|---|---|---|---|---|\n"
            );
        }
        for field in *fields {
            let Some(property) = property(schema, field) else {
                continue;
            };
            let meaning = property["description"].as_str().unwrap_or_default();
            let meaning = meaning.split("\n\n").next().unwrap_or_default();
            let meaning = meaning.split_whitespace().collect::<Vec<_>>().join(" ");
            let _ = writeln!(
                text,
                "| `{}` | {} | {} | {} | {meaning} |",
                field.name,
                type_text(property),
                field.unit,
                field.frame
            );
        }
    }
    text
}

/// Returns the schema of a field of a line, or of a file of a line. `print` is both.
fn property<'a>(schema: &'a Value, field: &RecordField) -> Option<&'a Value> {
    let of_line = schema["properties"].get(field.name);
    let of_file =
        find_properties(&schema["properties"]["files"]).and_then(|files| files.get(field.name));
    if FILE_FIELDS.contains(field) {
        of_file.or(of_line)
    } else {
        of_line.or(of_file)
    }
}

/// Returns the properties of an object, which may be one of several alternatives.
fn find_properties(schema: &Value) -> Option<&Value> {
    schema.get("properties").or_else(|| {
        let alternatives = schema.get("anyOf")?.as_array()?;
        alternatives
            .iter()
            .find_map(|schema| schema.get("properties"))
    })
}

/// Returns the type of a field as text, such as `number[3][4] or null`.
pub(super) fn type_text(schema: &Value) -> String {
    if let Some(alternatives) = schema.get("anyOf").or_else(|| schema.get("oneOf")) {
        let names = alternatives.as_array().into_iter().flatten().map(type_text);
        return joined(names);
    }
    if let Some(value) = schema.get("const") {
        return format!("`{value}`").replace('"', "");
    }
    if let Some(values) = schema.get("enum").and_then(Value::as_array) {
        let shown = |value: &Value| match value {
            Value::Null => "null".to_owned(),
            value => format!("`{value}`").replace('"', ""),
        };
        return joined(values.iter().map(shown));
    }
    match &schema["type"] {
        Value::Array(types) => joined(types.iter().map(|name| name_of(name, schema))),
        name => name_of(name, schema),
    }
}

fn joined(names: impl Iterator<Item = String>) -> String {
    names.collect::<Vec<_>>().join(" or ")
}

/// Returns the name of a JSON type; arrays with their lengths, where these are fixed.
fn name_of(name: &Value, schema: &Value) -> String {
    match name.as_str() {
        Some("array") => {
            let length = schema
                .get("maxItems")
                .map(Value::to_string)
                .unwrap_or_default();
            let items = type_text(&schema["items"]);
            match items.split_once('[') {
                Some((kind, inner)) => format!("{kind}[{length}][{inner}"),
                None => format!("{items}[{length}]"),
            }
        }
        Some(name) => name.to_owned(),
        None => "any".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use serde_json::Value;

    use super::{
        FILE_FIELDS, METRIC_FIELDS, PAIR_FIELDS, RecordField, find_properties, markdown_table,
        property, schema_of,
    };
    use crate::pair_files::Files;
    use crate::record::{MetricFields, PairFields, PairRecord};

    fn names(properties: &Value) -> BTreeSet<String> {
        properties
            .as_object()
            .expect("properties")
            .keys()
            .cloned()
            .collect()
    }

    fn listed(fields: &[&[RecordField]]) -> BTreeSet<String> {
        let fields = fields.iter().flat_map(|fields| fields.iter());
        fields.map(|field| field.name.to_owned()).collect()
    }

    #[test]
    fn the_table_lists_exactly_the_fields_of_the_schema() {
        #[derive(schemars::JsonSchema)]
        struct Line {
            #[serde(flatten)]
            _pair: PairFields,
            #[serde(flatten)]
            _metric: MetricFields,
        }
        let schema = schema_of::<Line>();
        assert_eq!(
            listed(&[&PAIR_FIELDS, &METRIC_FIELDS]),
            names(&schema["properties"])
        );
        let files = schema_of::<Files>();
        assert_eq!(
            listed(&[&FILE_FIELDS]),
            names(find_properties(&files).expect("fields"))
        );
        for field in PAIR_FIELDS.iter().chain(&METRIC_FIELDS) {
            let described = property(&schema, field).expect(field.name);
            assert!(described["description"].is_string(), "{}", field.name);
        }
    }

    #[test]
    fn descriptions_contain_no_links_or_examples_of_the_code() {
        for schema in [schema_of::<PairRecord>(), schema_of::<Files>()] {
            let text = schema.to_string();
            assert!(!text.contains("[`") && !text.contains("```"), "{text}");
        }
    }

    #[test]
    fn matrices_and_choices_are_named_in_the_table() {
        let schema = schema_of::<PairRecord>();
        let table = markdown_table(&schema, &[("Fields", &PAIR_FIELDS)]);
        assert!(
            table.contains(
                "| `plane_from_mesh` | number[4][4] or null | mesh unit | mesh to plane |"
            ),
            "{table}"
        );
        assert!(
            table.contains("| `status` | `done` or `failed` or `pending` |"),
            "{table}"
        );
    }

    #[test]
    fn the_documentation_holds_the_same_table() {
        let schema = schema_of::<crate::formats::ExportLine<'_>>();
        let tables = [
            ("", &PAIR_FIELDS[..]),
            ("", &METRIC_FIELDS[..]),
            ("", &FILE_FIELDS[..]),
        ];
        let docs = include_str!("../../../docs/reference/data.md");
        for row in markdown_table(&schema, &tables).lines() {
            assert!(
                docs.contains(row),
                "docs/reference/data.md lacks the line\n{row}"
            );
        }
    }
}
