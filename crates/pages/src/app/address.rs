//! Parts of addresses: percent-encoded segments, and the values of a query.

use std::fmt::Write as _;

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};

/// Characters that stay as they are in a segment and in a value.
const ENCODED: &AsciiSet = &NON_ALPHANUMERIC
    .remove(b'-')
    .remove(b'_')
    .remove(b'.')
    .remove(b'~');

/// Returns a text as one segment of a path or one value of a query.
pub(super) fn encoded(text: &str) -> String {
    utf8_percent_encode(text, ENCODED).to_string()
}

/// The names and values of a query, in their order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct PageQuery(Vec<(String, String)>);

impl PageQuery {
    /// Parses a query such as `state=failed&block=b+04`. Values that are not UTF-8 are left out.
    pub(super) fn parse(text: &str) -> Self {
        let decode = |part: &str| {
            let part = part.replace('+', " ");
            let decoded = percent_decode_str(&part).decode_utf8();
            decoded.ok().map(std::borrow::Cow::into_owned)
        };
        let parts = text.split('&').filter(|part| !part.is_empty());
        let pairs = parts.filter_map(|part| {
            let (name, value) = part.split_once('=').unwrap_or((part, ""));
            Some((decode(name)?, decode(value)?))
        });
        Self(pairs.collect())
    }

    /// Returns a value that is not empty.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.given(name).filter(|value| !value.is_empty())
    }

    /// Returns a value, which is empty if a field of a form was left empty.
    pub(super) fn given(&self, name: &str) -> Option<&str> {
        let mut values = self.0.iter().filter(|(known, _)| known == name);
        values.next().map(|(_, value)| value.as_str())
    }

    /// Parses a value. `None` if it is missing or not valid.
    pub(super) fn parsed<T: std::str::FromStr>(&self, name: &str) -> Option<T> {
        self.get(name)?.parse().ok()
    }

    /// Returns the query with another value, or without it if the value is empty.
    #[must_use]
    pub(super) fn with(&self, name: &str, value: &str) -> Self {
        let others = self.0.iter().filter(|(known, _)| known != name);
        let mut pairs: Vec<_> = others.cloned().collect();
        if !value.is_empty() {
            pairs.push((name.to_owned(), value.to_owned()));
        }
        Self(pairs)
    }

    /// Returns the names and values that are not empty.
    pub(super) fn pairs(&self) -> impl Iterator<Item = &(String, String)> {
        self.0.iter().filter(|(_, value)| !value.is_empty())
    }

    /// Returns the query as text that begins with `?`, or nothing if it is empty.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for (index, (name, value)) in self.0.iter().enumerate() {
            let join = if index > 0 { '&' } else { '?' };
            // Writing to a string never fails.
            let _ = write!(text, "{join}{}={}", encoded(name), encoded(value));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::{PageQuery, encoded};

    #[test]
    fn queries_are_read_and_written() {
        let query = PageQuery::parse("block=b%2004&state=&character=%E6%98%8E&a+b=c&bad=%FF");
        assert_eq!(query.get("block"), Some("b 04"));
        assert_eq!((query.get("state"), query.given("state")), (None, Some("")));
        assert_eq!(query.get("character"), Some("明"));
        assert_eq!(query.get("bad"), None);
        let other = query.with("block", "").with("page", "1/2");
        assert_eq!(other.get("block"), None);
        assert_eq!(PageQuery::parse(&other.text()[1..]), other);
        assert_eq!(PageQuery::default().text(), "");
        assert_eq!(encoded("chữ số/1"), "ch%E1%BB%AF%20s%E1%BB%91%2F1");
    }
}
