//! Statements for SQLite and PostgreSQL.
//!
//! Most statements have one text for both databases, in the SQL that they share: see [`postgres_text`]. PostgreSQL has
//! the functions of SQLite that these texts use, created by its migration. Where one text would be slow or impossible,
//! a statement has two.

use std::borrow::Cow;
use std::fmt::Write as _;

use crate::db::error::{CatalogError, Result};
use crate::db::value::Argument;

/// A statement for both databases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sql {
    pub(crate) sqlite: &'static str,
    /// `None` if the text for SQLite is also for PostgreSQL.
    postgres: Option<&'static str>,
}

impl Sql {
    /// Makes a statement with a text for each database.
    pub(crate) const fn pair(sqlite: &'static str, postgres: &'static str) -> Self {
        Self {
            sqlite,
            postgres: Some(postgres),
        }
    }

    /// Makes a statement with one text for both databases.
    pub(crate) const fn both(text: &'static str) -> Self {
        Self {
            sqlite: text,
            postgres: None,
        }
    }

    /// Returns the text for PostgreSQL, with parameters written as `?` or `?1`.
    fn postgres(self) -> Cow<'static, str> {
        match self.postgres {
            Some(text) => Cow::Borrowed(text),
            None => Cow::Owned(postgres_text(self.sqlite)),
        }
    }

    /// Returns the text for PostgreSQL, with parameters written as `$1`.
    pub(crate) fn postgres_query(self) -> String {
        self.postgres().replace('?', "$")
    }

    /// Appends the text for PostgreSQL to a script, with each `?` replaced by the next of `arguments`. Without
    /// parameters, a script of several statements is sent in one message.
    pub(crate) fn add_postgres(self, script: &mut String, arguments: &[Argument]) -> Result<()> {
        let text = self.postgres();
        let mut arguments = arguments.iter();
        let mut parts = text.split('?');
        script.push_str(parts.next().unwrap_or_default());
        for part in parts {
            if let Some(argument) = arguments.next() {
                add_literal(script, argument)?;
            }
            script.push_str(part);
        }
        script.push_str(";\n");
        Ok(())
    }
}

impl From<&'static str> for Sql {
    fn from(both: &'static str) -> Self {
        Self::both(both)
    }
}

/// Translates a text for both databases. In SQLite, `CROSS JOIN` keeps the order of two tables; PostgreSQL has the
/// join, but no such hint, and no condition after it. SQLite also has a faster `jsonb_each` with the same result.
pub(crate) fn postgres_text(both: &str) -> String {
    both.replace("CROSS JOIN", "JOIN")
        .replace("jsonb_each(", "json_each(")
}

/// Appends a value as SQL of PostgreSQL. The connection must have the setting `standard_conforming_strings`, with which
/// a quote is the only character of a text that has a meaning.
pub(crate) fn add_literal(script: &mut String, argument: &Argument) -> Result<()> {
    // Writing to a string does not fail.
    let _ = match argument {
        Argument::Null => write!(script, "NULL"),
        Argument::Integer(Some(number)) => write!(script, "bigint '{number}'"),
        Argument::Integer(None) => write!(script, "CAST(NULL AS bigint)"),
        Argument::Real(Some(number)) => write!(script, "double precision '{number}'"),
        Argument::Real(None) => write!(script, "CAST(NULL AS double precision)"),
        Argument::Text(Some(text)) if text.contains('\0') => {
            return Err(CatalogError::Corrupt(
                "text with the character NUL".to_owned(),
            ));
        }
        Argument::Text(Some(text)) => write!(script, "text '{}'", text.replace('\'', "''")),
        Argument::Text(None) => write!(script, "CAST(NULL AS text)"),
        Argument::Blob(Some(bytes)) => {
            let digits = bytes.iter().map(|byte| format!("{byte:02x}"));
            write!(script, "decode('{}', 'hex')", digits.collect::<String>())
        }
        Argument::Blob(None) => write!(script, "CAST(NULL AS bytea)"),
    };
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::Sql;
    use crate::db::value::Argument;

    #[test]
    fn texts_are_quoted() {
        let mut script = String::new();
        let arguments = ["a'b", r"\'; DROP TABLE pair; --", "?"].map(Argument::from);
        Sql::from("SELECT ?, ?, ?")
            .add_postgres(&mut script, &arguments)
            .expect("no NUL");
        assert_eq!(
            script,
            "SELECT text 'a''b', text '\\''; DROP TABLE pair; --', text '?';\n"
        );
        let nul = [Argument::from("a\0")];
        let refused = Sql::from("SELECT ?").add_postgres(&mut script, &nul);
        assert!(refused.is_err());
    }

    #[test]
    fn one_text_is_translated_for_both() {
        let sql = Sql::from("SELECT 1 FROM jsonb_each(?1) AS i CROSS JOIN t ON t.a = i.key AND ?2");
        let wanted = "SELECT 1 FROM json_each($1) AS i JOIN t ON t.a = i.key AND $2";
        assert_eq!(sql.postgres_query(), wanted);
    }
}
