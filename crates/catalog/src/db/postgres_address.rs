//! Where a catalog in a PostgreSQL database is, and its text without the password.

use sqlx::postgres::{PgConnectOptions, PgSslMode};

use crate::db::error::{CatalogError, Result};
use mocban_core::domain::without_password;

/// Schema of the tables, unless the URL sets another `search_path`.
pub(crate) const SCHEMA: &str = "mocban";

/// Where a catalog is: a server, a database and a schema.
#[derive(Debug, Clone)]
pub(crate) struct PostgresAddress {
    pub(super) options: PgConnectOptions,
    pub(super) schema: String,
}

impl PostgresAddress {
    /// Parses a URL such as `postgres://user@host/database`. The password may also come from the environment variable
    /// `PGPASSWORD` or the file `.pgpass`.
    ///
    /// # Errors
    /// Returns an error if the URL is invalid, or allows a connection without encryption to another machine.
    pub(crate) fn parse(url: &str) -> Result<Self> {
        let options: PgConnectOptions = url.parse().map_err(|error| {
            let shown = without_password(url);
            CatalogError::CatalogUrl(format!("{shown} is not a URL of PostgreSQL: {error}"))
        })?;
        let is_local = options.get_socket().is_some()
            || options.get_host().starts_with('/')
            || ["localhost", "127.0.0.1", "::1", "[::1]"].contains(&options.get_host());
        let has_mode = url.contains("sslmode=");
        let options = match options.get_ssl_mode() {
            PgSslMode::Prefer if !is_local && !has_mode => options.ssl_mode(PgSslMode::VerifyFull),
            PgSslMode::Disable | PgSslMode::Allow | PgSslMode::Prefer if !is_local => {
                let shown = without_password(url);
                return Err(CatalogError::CatalogUrl(format!(
                    "{shown} allows a connection without encryption; use sslmode=verify-full, or require in a network you trust"
                )));
            }
            _ => options,
        };
        let given = options.get_options().unwrap_or_default();
        let given = given.split("search_path=").nth(1);
        let schema = given.and_then(|rest| rest.split_whitespace().next());
        let schema = schema.unwrap_or(SCHEMA).to_owned();
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        if !schema.chars().all(is_plain) {
            return Err(CatalogError::CatalogUrl(format!(
                "the schema {schema} is not allowed; use lower-case letters, digits and _"
            )));
        }
        // Since PostgreSQL 12, floating-point numbers have all digits anyway, and PgBouncer refuses this parameter.
        let options = options.application_name("mocban").extra_float_digits(None);
        Ok(Self { options, schema })
    }

    /// Returns the schema of the tables.
    pub(crate) fn schema(&self) -> &str {
        &self.schema
    }

    /// Returns the address as text, without the password.
    pub(crate) fn text(&self) -> String {
        let options = &self.options;
        let database = options.get_database().unwrap_or_default();
        format!(
            "postgres://{}@{}:{}/{database}?schema={}",
            options.get_username(),
            options.get_host(),
            options.get_port(),
            self.schema
        )
    }
}

#[cfg(test)]
mod tests {
    use super::PostgresAddress;

    #[test]
    fn a_password_is_not_part_of_the_text() {
        let address =
            PostgresAddress::parse("postgres://me:secret@localhost/lab").expect("an address");
        assert_eq!(
            address.text(),
            "postgres://me@localhost:5432/lab?schema=mocban"
        );
    }

    #[test]
    fn connections_to_other_machines_are_encrypted() {
        let refused = PostgresAddress::parse("postgres://me@db.example/lab?sslmode=disable");
        assert!(
            refused
                .expect_err("no encryption")
                .to_string()
                .contains("verify-full")
        );
        PostgresAddress::parse("postgres://me@db.example/lab?sslmode=require").expect("encrypted");
        PostgresAddress::parse("postgres://me@localhost/lab?sslmode=disable").expect("local");
    }
}
