//! The typed columns of Parquet tables of pairs, and their cells.
//!
//! The paths of mesh and print are `mesh_path` and `print_path`, because `print` is the column of the picture.

use serde_json::Value;

use super::parquet_columns::{CellValue, ColumnType};
use super::record_fields::{METRIC_FIELDS, PAIR_FIELDS};
use super::sample::PICTURES;

/// Columns that are named unlike their fields: column and field.
const RENAMED: [(&str, &str); 2] = [("mesh_path", "mesh"), ("print_path", "print")];

/// Returns the columns of the fields that a schema has, in the order of the fields. The user's columns become the fields
/// of the column `meta`.
pub(super) fn field_columns(schema: &Value, meta_columns: &[String]) -> Vec<(String, ColumnType)> {
    let listed = PAIR_FIELDS.iter().chain(&METRIC_FIELDS);
    let names = listed.map(|field| field.name).chain(["metrics"]);
    let mut columns = Vec::new();
    for name in names {
        let Some(property) = schema["properties"].get(name) else {
            continue;
        };
        let kind = if name == "meta" {
            let fields = meta_columns
                .iter()
                .map(|key| (key.clone(), ColumnType::Text));
            ColumnType::Group(fields.collect())
        } else {
            ColumnType::of_schema(property)
        };
        // Parquet has no groups without fields.
        if kind != ColumnType::Group(Vec::new()) {
            let renamed = RENAMED.iter().find(|(_, field)| *field == name);
            let name = renamed.map_or(name, |(column, _)| column);
            columns.push((name.to_owned(), kind));
        }
    }
    columns
}

/// Returns the columns of the pictures of a sample.
pub(super) fn picture_columns() -> impl Iterator<Item = (String, ColumnType)> {
    PICTURES
        .iter()
        .map(|name| ((*name).to_owned(), ColumnType::Image))
}

/// Returns the cells of the columns of [`field_columns`].
pub(super) fn field_cells(mut row: Value, columns: &[(String, ColumnType)]) -> Vec<CellValue> {
    let mut cell = |(name, _): &(String, ColumnType)| {
        let renamed = RENAMED.iter().find(|(column, _)| column == name);
        let field = renamed.map_or(name.as_str(), |(_, field)| field);
        CellValue::Json(row[field].take())
    };
    columns.iter().map(&mut cell).collect()
}

/// Returns the cells of the columns of [`picture_columns`]: from file names and contents in turn, or null.
pub(super) fn picture_cells(files: &mut impl Iterator<Item = Vec<u8>>) -> Vec<CellValue> {
    let cells = PICTURES.iter().map(|_| match (files.next(), files.next()) {
        (Some(name), Some(bytes)) => {
            CellValue::Image(String::from_utf8_lossy(&name).into_owned(), bytes)
        }
        _ => CellValue::Json(Value::Null),
    });
    cells.collect()
}
