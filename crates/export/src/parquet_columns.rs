//! The columns of a Parquet table, made from a JSON Schema, and the conversion of JSON rows to them.
//!
//! Nested values are stored by definition and repetition levels (Melnik et al. 2010, "Dremel"). Every value is optional,
//! and a list is a group with a repeated group `list` of one `element`, as the Parquet format prescribes.

use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::ByteArray;
use parquet::errors::Result;
use parquet::schema::types::{Type, TypePtr};
use serde_json::Value;

use mocban_core::domain::value_text;

/// Type of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ColumnType {
    /// UTF-8 text.
    Text,
    /// True or false.
    Bool,
    /// Integer of 64 bits.
    Int,
    /// Floating-point number of 64 bits.
    Real,
    /// A list of values of one type.
    List(Box<ColumnType>),
    /// Named values.
    Group(Vec<(String, ColumnType)>),
    /// An image file: a group of `bytes` and `path`, as Hugging Face stores it.
    Image,
}

/// A value of a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum CellValue {
    /// A JSON value of the column's type, or null.
    Json(Value),
    /// An image file and its name.
    Image(String, Vec<u8>),
}

/// The values of a leaf column, with their levels.
#[derive(Debug)]
pub(super) struct LeafColumn {
    pub(super) definition: Vec<i16>,
    pub(super) repetition: Vec<i16>,
    /// Whether the column is within a list.
    pub(super) is_repeated: bool,
    pub(super) values: LeafValues,
}

/// The values of a leaf column that are not null.
#[derive(Debug)]
pub(super) enum LeafValues {
    Bytes(Vec<ByteArray>),
    Bools(Vec<bool>),
    Ints(Vec<i64>),
    Reals(Vec<f64>),
}

impl ColumnType {
    /// Returns the type of the values that a JSON Schema without references allows.
    pub(super) fn of_schema(schema: &Value) -> Self {
        if let Some(alternatives) = schema.get("anyOf").and_then(Value::as_array) {
            let is_value = |schema: &&Value| schema["type"] != "null";
            return alternatives
                .iter()
                .find(is_value)
                .map_or(Self::Text, Self::of_schema);
        }
        let name = match &schema["type"] {
            Value::Array(names) => names.iter().find(|name| *name != "null"),
            name => Some(name),
        };
        match name.and_then(Value::as_str) {
            Some("boolean") => Self::Bool,
            Some("integer") => Self::Int,
            Some("number") => Self::Real,
            Some("array") => Self::List(Box::new(Self::of_schema(&schema["items"]))),
            Some("object") => match schema["properties"].as_object() {
                Some(fields) => {
                    let field =
                        |(name, schema): (&String, &Value)| (name.clone(), Self::of_schema(schema));
                    Self::Group(fields.iter().map(field).collect())
                }
                None => Self::Text,
            },
            _ => Self::Text,
        }
    }

    /// Adds the empty leaf columns of this column, from left to right.
    pub(super) fn add_leaves(&self, is_repeated: bool, leaves: &mut Vec<LeafColumn>) {
        let mut leaf = |values| {
            leaves.push(LeafColumn {
                definition: Vec::new(),
                repetition: Vec::new(),
                is_repeated,
                values,
            });
        };
        match self {
            Self::Text => leaf(LeafValues::Bytes(Vec::new())),
            Self::Bool => leaf(LeafValues::Bools(Vec::new())),
            Self::Int => leaf(LeafValues::Ints(Vec::new())),
            Self::Real => leaf(LeafValues::Reals(Vec::new())),
            Self::Image => {
                leaf(LeafValues::Bytes(Vec::new()));
                leaf(LeafValues::Bytes(Vec::new()));
            }
            Self::List(element) => element.add_leaves(true, leaves),
            Self::Group(fields) => {
                for (_, field) in fields {
                    field.add_leaves(is_repeated, leaves);
                }
            }
        }
    }

    /// Returns the number of leaf columns.
    pub(super) fn leaf_count(&self) -> usize {
        match self {
            Self::Text | Self::Bool | Self::Int | Self::Real => 1,
            Self::Image => 2,
            Self::List(element) => element.leaf_count(),
            Self::Group(fields) => fields.iter().map(|(_, field)| field.leaf_count()).sum(),
        }
    }

    /// Returns the Parquet type of a column.
    pub(super) fn parquet_type(&self, name: &str) -> Result<TypePtr> {
        let leaf = |kind, logical| {
            Type::primitive_type_builder(name, kind)
                .with_repetition(Repetition::OPTIONAL)
                .with_logical_type(logical)
                .build()
        };
        let group = |fields, logical| {
            Type::group_type_builder(name)
                .with_repetition(Repetition::OPTIONAL)
                .with_logical_type(logical)
                .with_fields(fields)
                .build()
        };
        let built = match self {
            Self::Text => leaf(PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
            Self::Bool => leaf(PhysicalType::BOOLEAN, None),
            Self::Int => leaf(PhysicalType::INT64, None),
            Self::Real => leaf(PhysicalType::DOUBLE, None),
            Self::List(element) => {
                let list = Type::group_type_builder("list")
                    .with_repetition(Repetition::REPEATED)
                    .with_fields(vec![element.parquet_type("element")?])
                    .build()?;
                group(vec![Arc::new(list)], Some(LogicalType::List))
            }
            Self::Group(fields) => {
                let fields = fields.iter().map(|(name, field)| field.parquet_type(name));
                group(fields.collect::<Result<_>>()?, None)
            }
            Self::Image => {
                let bytes = Type::primitive_type_builder("bytes", PhysicalType::BYTE_ARRAY)
                    .with_repetition(Repetition::OPTIONAL)
                    .build()?;
                group(
                    vec![Arc::new(bytes), Self::Text.parquet_type("path")?],
                    None,
                )
            }
        };
        Ok(Arc::new(built?))
    }

    /// Appends a cell to the leaf columns of this column.
    pub(super) fn append(&self, cell: CellValue, leaves: &mut [LeafColumn]) {
        match cell {
            CellValue::Json(value) => self.append_json(&value, Levels::default(), leaves),
            CellValue::Image(path, bytes) => {
                for (leaf, bytes) in leaves.iter_mut().zip([bytes, path.into_bytes()]) {
                    leaf.push(2, 0);
                    if let LeafValues::Bytes(values) = &mut leaf.values {
                        values.push(ByteArray::from(bytes));
                    }
                }
            }
        }
    }

    fn append_json(&self, value: &Value, at: Levels, leaves: &mut [LeafColumn]) {
        match (self, value) {
            (_, Value::Null) => push_each(leaves, at.defined, at.repeated),
            (Self::Group(fields), _) => {
                let mut rest = leaves;
                for (name, field) in fields {
                    let (own, others) = rest.split_at_mut(field.leaf_count());
                    let value = value.get(name).unwrap_or(&Value::Null);
                    field.append_json(value, at.defined(1), own);
                    rest = others;
                }
            }
            (Self::List(element), Value::Array(items)) => {
                if items.is_empty() {
                    push_each(leaves, at.defined + 1, at.repeated);
                }
                let depth = at.depth + 1;
                for (i, item) in items.iter().enumerate() {
                    let repeated = if i == 0 { at.repeated } else { depth };
                    let at = Levels {
                        repeated,
                        depth,
                        ..at.defined(2)
                    };
                    element.append_json(item, at, leaves);
                }
            }
            _ => {
                let leaf = &mut leaves[0];
                let is_stored = leaf.values.push(value);
                leaf.push(at.defined + i16::from(is_stored), at.repeated);
            }
        }
    }
}

/// Appends the same levels without a value to each column.
fn push_each(leaves: &mut [LeafColumn], definition: i16, repetition: i16) {
    for leaf in leaves {
        leaf.push(definition, repetition);
    }
}

/// Levels of a value of which all outer groups are known.
#[derive(Debug, Clone, Copy, Default)]
struct Levels {
    /// Definition level if the value is null.
    defined: i16,
    /// Repetition level of the value.
    repeated: i16,
    /// Number of lists around the value.
    depth: i16,
}

impl Levels {
    const fn defined(self, more: i16) -> Self {
        Self {
            defined: self.defined + more,
            ..self
        }
    }
}

impl LeafColumn {
    fn push(&mut self, definition: i16, repetition: i16) {
        self.definition.push(definition);
        self.repetition.push(repetition);
    }
}

impl LeafValues {
    /// Appends a value. Returns `false` if it is not of the column's type, so that it counts as null.
    fn push(&mut self, value: &Value) -> bool {
        match self {
            Self::Bytes(values) => {
                let text = value_text(value).into_owned();
                values.push(ByteArray::from(text.into_bytes()));
                true
            }
            Self::Bools(values) => push_to(values, value.as_bool()),
            Self::Ints(values) => push_to(values, value.as_i64()),
            Self::Reals(values) => push_to(values, value.as_f64()),
        }
    }
}

/// Appends a value if there is one, and returns whether there is.
fn push_to<T>(values: &mut Vec<T>, value: Option<T>) -> bool {
    let is_value = value.is_some();
    values.extend(value);
    is_value
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{CellValue, ColumnType, LeafValues};

    /// Returns definition and repetition levels and values of a column of numbers.
    fn levels(kind: &ColumnType, rows: &[serde_json::Value]) -> (Vec<i16>, Vec<i16>, Vec<f64>) {
        let mut leaves = Vec::new();
        kind.add_leaves(false, &mut leaves);
        for row in rows {
            kind.append(CellValue::Json(row.clone()), &mut leaves);
        }
        let leaf = leaves.remove(0);
        let values = match leaf.values {
            LeafValues::Reals(values) => values,
            _ => Vec::new(),
        };
        (leaf.definition, leaf.repetition, values)
    }

    #[test]
    fn nulls_empty_lists_and_rows_of_matrices_have_their_levels() {
        let matrix = ColumnType::List(Box::new(ColumnType::List(Box::new(ColumnType::Real))));
        let rows = [
            json!([[1.0, 2.0], [3.0]]),
            json!(null),
            json!([]),
            json!([[], [null]]),
        ];
        let (definition, repetition, values) = levels(&matrix, &rows);
        assert_eq!(definition, [5, 5, 5, 0, 1, 3, 4]);
        assert_eq!(repetition, [0, 2, 1, 0, 0, 0, 1]);
        assert_eq!(values, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn types_follow_the_json_schema() {
        let schema = json!({"anyOf": [{"type": "object", "properties": {
            "a": {"type": ["integer", "null"]},
            "b": {"type": "array", "items": {"type": "number"}},
            "c": {"oneOf": [{"const": "pass"}]},
        }}, {"type": "null"}]});
        let list = ColumnType::List(Box::new(ColumnType::Real));
        let fields = [("a", ColumnType::Int), ("b", list), ("c", ColumnType::Text)];
        let fields = fields.map(|(name, kind)| (name.to_owned(), kind));
        assert_eq!(
            ColumnType::of_schema(&schema),
            ColumnType::Group(fields.to_vec())
        );
    }

    #[test]
    fn a_missing_group_is_null_in_each_of_its_columns() {
        let kind = ColumnType::Group(vec![
            ("a".to_owned(), ColumnType::Real),
            ("b".to_owned(), ColumnType::Real),
        ]);
        let mut leaves = Vec::new();
        kind.add_leaves(false, &mut leaves);
        kind.append(CellValue::Json(json!(null)), &mut leaves);
        kind.append(CellValue::Json(json!({"b": 2.5})), &mut leaves);
        assert_eq!(leaves[0].definition, [0, 1]);
        assert_eq!(leaves[1].definition, [0, 2]);
    }
}
