//! Values of columns and parameters, the same for both databases.

use std::borrow::Cow;

use serde::de::DeserializeOwned;
use sqlx::error::BoxDynError;

/// A value of a column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value<'r> {
    Null,
    Integer(i64),
    Real(f64),
    /// Text that may be invalid UTF-8 if the catalog is damaged.
    Text(Cow<'r, [u8]>),
    Blob(Cow<'r, [u8]>),
}

impl Value<'_> {
    /// Returns the name of the value's type.
    pub(crate) const fn type_name(&self) -> &'static str {
        match self {
            Self::Null => "NULL",
            Self::Integer(_) => "INTEGER",
            Self::Real(_) => "REAL",
            Self::Text(_) => "TEXT",
            Self::Blob(_) => "BLOB",
        }
    }

    /// Passes the type, the length and the bytes of the value to `add`, to hash them. They are the same in both databases.
    pub(crate) fn hash_into(&self, mut add: impl FnMut(&[u8])) {
        add(self.type_name().as_bytes());
        match self {
            Self::Null => {}
            Self::Integer(number) => add(&number.to_le_bytes()),
            Self::Real(number) => add(&number.to_le_bytes()),
            Self::Text(content) | Self::Blob(content) => {
                add(&(content.len() as u64).to_le_bytes());
                add(content);
            }
        }
    }
}

/// A type that a column can be read as.
pub(crate) trait FromValue: Sized {
    /// Reads a value.
    ///
    /// # Errors
    /// Returns an error if the value has another type or is not allowed.
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError>;
}

/// JSON text, parsed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Json<T>(pub(crate) T);

fn mismatch(wanted: &str, found: &Value<'_>) -> BoxDynError {
    format!("expected {wanted}, found {}", found.type_name()).into()
}

impl FromValue for i64 {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        match value {
            Value::Integer(number) => Ok(number),
            value => Err(mismatch("INTEGER", &value)),
        }
    }
}

impl FromValue for u64 {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        Ok(Self::try_from(i64::from_value(value)?)?)
    }
}

impl FromValue for u32 {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        Ok(Self::try_from(i64::from_value(value)?)?)
    }
}

impl FromValue for u16 {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        Ok(Self::try_from(i64::from_value(value)?)?)
    }
}

impl FromValue for bool {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        Ok(i64::from_value(value)? != 0)
    }
}

impl FromValue for f64 {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        match value {
            Value::Real(number) => Ok(number),
            value => Err(mismatch("REAL", &value)),
        }
    }
}

impl FromValue for String {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        match value {
            Value::Text(text) => Ok(Self::from_utf8(text.into_owned())?),
            value => Err(mismatch("TEXT", &value)),
        }
    }
}

impl FromValue for Vec<u8> {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        match value {
            Value::Blob(bytes) => Ok(bytes.into_owned()),
            value => Err(mismatch("BLOB", &value)),
        }
    }
}

impl<T: FromValue> FromValue for Option<T> {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        match value {
            Value::Null => Ok(None),
            value => T::from_value(value).map(Some),
        }
    }
}

impl<T: DeserializeOwned> FromValue for Json<T> {
    fn from_value(value: Value<'_>) -> Result<Self, BoxDynError> {
        match value {
            Value::Text(text) => Ok(Self(serde_json::from_slice(&text)?)),
            value => Err(mismatch("TEXT", &value)),
        }
    }
}

/// Calls `read` with a text value.
pub(crate) fn read_text<T, E: Into<BoxDynError>>(
    value: &Value<'_>,
    read: impl for<'t> FnOnce(&'t str) -> Result<T, E>,
) -> Result<T, BoxDynError> {
    match value {
        Value::Text(text) => read(std::str::from_utf8(text)?).map_err(Into::into),
        value => Err(mismatch("TEXT", value)),
    }
}

/// Calls `read` with the bytes of a BLOB value.
pub(crate) fn read_blob<T, E: Into<BoxDynError>>(
    value: &Value<'_>,
    read: impl FnOnce(&[u8]) -> Result<T, E>,
) -> Result<T, BoxDynError> {
    match value {
        Value::Blob(bytes) => read(bytes).map_err(Into::into),
        value => Err(mismatch("BLOB", value)),
    }
}

/// A parameter of a statement. `None` is NULL, with the type that PostgreSQL needs for it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Argument {
    /// NULL of any type, only for literals and SQLite.
    Null,
    Integer(Option<i64>),
    Real(Option<f64>),
    Text(Option<String>),
    Blob(Option<Vec<u8>>),
}

/// Implements `From` for arguments. Each line has a type, the variant, and a conversion of a value.
macro_rules! arguments {
    ($($type:ty: $variant:ident = $convert:expr;)+) => {$(
        impl From<$type> for Argument {
            fn from(value: $type) -> Self {
                Self::$variant(Some(($convert)(value)))
            }
        }

        impl From<Option<$type>> for Argument {
            fn from(value: Option<$type>) -> Self {
                Self::$variant(value.map($convert))
            }
        }
    )+};
}

arguments! {
    i64: Integer = |number| number;
    u32: Integer = i64::from;
    f64: Real = |number| number;
    &str: Text = str::to_owned;
    String: Text = |text| text;
    &String: Text = String::clone;
    &[u8]: Blob = <[u8]>::to_vec;
}

impl From<&Option<String>> for Argument {
    fn from(value: &Option<String>) -> Self {
        Self::Text(value.clone())
    }
}
