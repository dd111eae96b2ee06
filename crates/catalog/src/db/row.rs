//! Rows of either database, and the types that are read from them.

use std::borrow::Cow;
use std::fmt;

use sqlx::error::BoxDynError;
use sqlx::postgres::{PgRow, PgValueRef};
use sqlx::sqlite::{SqliteRow, SqliteValueRef};
use sqlx::{Column as _, Decode, Postgres, Row as _, Sqlite, TypeInfo as _, ValueRef as _};

use crate::db::error::{CatalogError, Result};
use crate::db::value::{FromValue, Value};

/// A row of a result.
pub(crate) enum Row {
    Sqlite(SqliteRow),
    Postgres(PgRow),
}

/// A column by name or index.
pub(crate) trait Column: fmt::Display + Copy {
    fn of_sqlite(self, row: &SqliteRow) -> Result<Value<'_>, BoxDynError>;
    fn of_postgres(self, row: &PgRow) -> Result<Value<'_>, BoxDynError>;
}

impl Column for &str {
    fn of_sqlite(self, row: &SqliteRow) -> Result<Value<'_>, BoxDynError> {
        sqlite_value(row.try_get_raw(self)?)
    }

    fn of_postgres(self, row: &PgRow) -> Result<Value<'_>, BoxDynError> {
        postgres_value(row.try_get_raw(self)?)
    }
}

impl Column for usize {
    fn of_sqlite(self, row: &SqliteRow) -> Result<Value<'_>, BoxDynError> {
        sqlite_value(row.try_get_raw(self)?)
    }

    fn of_postgres(self, row: &PgRow) -> Result<Value<'_>, BoxDynError> {
        postgres_value(row.try_get_raw(self)?)
    }
}

fn sqlite_value(value: SqliteValueRef<'_>) -> Result<Value<'_>, BoxDynError> {
    if value.is_null() {
        return Ok(Value::Null);
    }
    let kind = value.type_info();
    Ok(match kind.name() {
        "INTEGER" => Value::Integer(<i64 as Decode<Sqlite>>::decode(value)?),
        "REAL" => Value::Real(<f64 as Decode<Sqlite>>::decode(value)?),
        "TEXT" => Value::Text(Cow::Borrowed(<&[u8] as Decode<Sqlite>>::decode(value)?)),
        _ => Value::Blob(Cow::Borrowed(<&[u8] as Decode<Sqlite>>::decode(value)?)),
    })
}

/// Converts a value of PostgreSQL. Truth values become 0 or 1, as in SQLite.
fn postgres_value(value: PgValueRef<'_>) -> Result<Value<'_>, BoxDynError> {
    if value.is_null() {
        return Ok(Value::Null);
    }
    let kind = value.type_info().into_owned();
    Ok(match kind.name() {
        "INT8" => Value::Integer(<i64 as Decode<Postgres>>::decode(value)?),
        "INT4" => Value::Integer(<i32 as Decode<Postgres>>::decode(value)?.into()),
        "BOOL" => Value::Integer(<bool as Decode<Postgres>>::decode(value)?.into()),
        "FLOAT8" => Value::Real(<f64 as Decode<Postgres>>::decode(value)?),
        "BYTEA" => Value::Blob(Cow::Owned(<Vec<u8> as Decode<Postgres>>::decode(value)?)),
        _ => Value::Text(Cow::Borrowed(value.as_bytes()?)),
    })
}

impl Row {
    /// Returns the number of columns.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Sqlite(row) => row.len(),
            Self::Postgres(row) => row.len(),
        }
    }

    /// Returns the name of a column.
    pub(crate) fn name(&self, column: usize) -> &str {
        match self {
            Self::Sqlite(row) => row.columns()[column].name(),
            Self::Postgres(row) => row.columns()[column].name(),
        }
    }

    /// Returns the value of a column.
    ///
    /// # Errors
    /// Returns an error if there is no such column, or if the database stores another type than it declares.
    pub(crate) fn value(&self, column: impl Column) -> Result<Value<'_>> {
        let value = match self {
            Self::Sqlite(row) => column.of_sqlite(row),
            Self::Postgres(row) => column.of_postgres(row),
        };
        value.map_err(|error| invalid(column, &error))
    }

    /// Reads a column.
    ///
    /// # Errors
    /// Returns an error if the value cannot be read as a `T`.
    pub(crate) fn get<T: FromValue>(&self, column: impl Column) -> Result<T> {
        T::from_value(self.value(column)?).map_err(|error| invalid(column, &error))
    }
}

fn invalid(column: impl Column, error: &BoxDynError) -> CatalogError {
    CatalogError::Corrupt(format!("column {column}: {error}"))
}

/// A type that is read from a row.
pub(crate) trait FromRow: Sized {
    fn from_row(row: &Row) -> Result<Self>;
}

/// Implements [`FromRow`] for a struct. Lists every field, with the name of its column if that is not the field's name.
/// `field in row` reads the field from the same row, `field by function` calls a function with the row, `field as Json`
/// parses JSON text, `field as JsonOrNull` parses it if there is any, and `field = value` sets the field.
macro_rules! from_row {
    ($type:ty { $($field:ident $(: $column:literal)? $(in $row:ident)? $(by $read:path)? $(as $json:ident)? $(= $value:expr)?),+ $(,)? }) => {
        impl $crate::db::row::FromRow for $type {
            fn from_row(row: &$crate::db::row::Row) -> $crate::Result<Self> {
                Ok(Self {
                    $($field: $crate::db::row::field!(row, $field $(: $column)? $(in $row)? $(by $read)? $(as $json)? $(= $value)?)),+
                })
            }
        }
    };
}
pub(crate) use from_row;

/// Reads one field: see [`from_row`].
macro_rules! field {
    ($row:ident, $field:ident) => {
        $row.get(stringify!($field))?
    };
    ($row:ident, $field:ident: $column:literal) => {
        $row.get($column)?
    };
    ($row:ident, $field:ident in row) => {
        $crate::db::row::FromRow::from_row($row)?
    };
    ($row:ident, $field:ident by $read:path) => {
        $read($row)?
    };
    ($row:ident, $field:ident as $json:ident) => {
        $crate::db::row::json!($row, stringify!($field), $json)
    };
    ($row:ident, $field:ident: $column:literal as $json:ident) => {
        $crate::db::row::json!($row, $column, $json)
    };
    ($row:ident, $field:ident = $value:expr) => {
        $value
    };
}
pub(crate) use field;

/// Parses a column as JSON: see [`from_row`].
macro_rules! json {
    ($row:ident, $column:expr, Json) => {{
        let $crate::db::value::Json(value) = $row.get($column)?;
        value
    }};
    ($row:ident, $column:expr, JsonOrNull) => {{
        let value: Option<$crate::db::value::Json<_>> = $row.get($column)?;
        value.map(|$crate::db::value::Json(value)| value)
    }};
}
pub(crate) use json;

/// Implements [`FromRow`] for tuples, in the order of the columns.
macro_rules! tuples {
    ($(($($type:ident $index:tt),+))+) => {$(
        impl<$($type: FromValue),+> FromRow for ($($type,)+) {
            fn from_row(row: &Row) -> Result<Self> {
                Ok(($(row.get::<$type>($index)?,)+))
            }
        }
    )+};
}

tuples! {
    (A 0)
    (A 0, B 1)
    (A 0, B 1, C 2)
    (A 0, B 1, C 2, D 3)
    (A 0, B 1, C 2, D 3, E 4)
}

impl FromRow for () {
    fn from_row(_: &Row) -> Result<Self> {
        Ok(())
    }
}

impl fmt::Debug for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let values = (0..self.len()).map(|column| self.value(column));
        f.debug_list().entries(values).finish()
    }
}
