//! JSON in which no object has a key twice.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

use super::cancel::poll;
use super::spelling::quoted;

/// End of the message about a key that an object has twice.
pub const KEY_TWICE: &str = "is given twice";

/// A JSON value in which no object has the same key twice. A plain [`Value`] would silently keep only the last.
///
/// ```
/// use mocban_core::domain::UniqueKeys;
///
/// let twice = serde_json::from_str::<UniqueKeys>(r#"{"a": {"b": 1, "b": 2}}"#);
/// assert!(twice.is_err_and(|error| error.to_string().starts_with("the key \"b\" is given twice")));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct UniqueKeys(pub Value);

impl<'de> Deserialize<'de> for UniqueKeys {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        poll();
        deserializer.deserialize_any(ValueVisitor).map(Self)
    }
}

struct ValueVisitor;

impl<'de> Visitor<'de> for ValueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E: Error>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        Ok(Number::from_f64(value).map_or(Value::Null, Value::Number))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_string<E: Error>(self, value: String) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut array = Vec::new();
        while let Some(UniqueKeys(item)) = items.next_element()? {
            array.push(item);
        }
        Ok(Value::Array(array))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some((key, UniqueKeys(value))) = entries.next_entry::<String, _>()? {
            if object.contains_key(&key) {
                let key = quoted(&key);
                return Err(A::Error::custom(format!("the key {key} {KEY_TWICE}")));
            }
            object.insert(key, value);
        }
        Ok(Value::Object(object))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::UniqueKeys;
    use crate::domain::cancel::{CancelToken, Cancelled};

    #[test]
    fn parsing_is_cancelled() {
        let text = format!("[{}0]", "[0],".repeat(99));
        let parse = || serde_json::from_str::<UniqueKeys>(&text).is_ok();
        assert_eq!(CancelToken::default().run(parse), Ok(true));
        assert_eq!(CancelToken::cancelled_at(50).run(parse), Err(Cancelled));
    }

    #[test]
    fn values_equal_those_of_the_plain_parser() {
        let text =
            r#"{"a":[1,-2,3.5,1e300,null,true,"x\u0007",18446744073709551615],"b":{"a":{}}}"#;
        let UniqueKeys(value) = serde_json::from_str(text).expect("valid");
        assert_eq!(value, serde_json::from_str::<Value>(text).expect("valid"));
    }

    #[test]
    fn a_key_given_twice_is_refused_at_any_depth() {
        for text in [
            r#"{"a":1,"a":1}"#,
            r#"[{"b":{"a":1,"c":2,"a":3}}]"#,
            r#"{"a":1,"\u0061":2}"#,
        ] {
            let refused = serde_json::from_str::<UniqueKeys>(text).expect_err("refused");
            let refused = refused.to_string();
            assert!(
                refused.starts_with("the key \"a\" is given twice"),
                "{refused}"
            );
        }
    }
}
