//! Group roles of a catalog in PostgreSQL: owner, worker, reviewer and viewer. The database enforces what each may do.

use sqlx::{AssertSqlSafe, Connection as _, PgConnection};

use crate::db::error::{CatalogError, Result};
use crate::db::postgres_address::{PostgresAddress, SCHEMA};

/// SQL that creates the roles and gives them their rights, with `{schema}` for the schema of the catalog.
const SQL: &str = include_str!("../../../../migrations/roles/postgres.sql");

/// Names of the roles.
pub const ROLES: [&str; 4] = [
    "mocban_owner",
    "mocban_worker",
    "mocban_reviewer",
    "mocban_viewer",
];

/// Returns the user, and whether it must create roles but may not.
const MAY_NOT_CREATE: &str = "
SELECT quote_ident(current_user),
    NOT (me.rolsuper OR me.rolcreaterole) AND (SELECT count(*) FROM pg_roles WHERE rolname = ANY ($1)) < cardinality($1)
FROM pg_roles AS me WHERE me.rolname = current_user";

/// Creates the catalog at a URL of PostgreSQL if it is missing, and its roles if `with_roles` is set, in one transaction.
/// Returns whether the catalog was created.
///
/// # Errors
/// Returns an error if the URL is invalid, if the server does not answer or refuses, if the user may not create roles, or
/// if the catalog has another version.
pub async fn initialize_database(url: &str, with_roles: bool) -> Result<bool> {
    let address = PostgresAddress::parse(url)?;
    let mut conn = address.connect_to_database().await?;
    if with_roles {
        require_may_create(&mut conn).await?;
    }
    let mut transaction = conn.begin().await?;
    let is_new = address.create_schema_in(&mut transaction).await?;
    address.require_current(&mut transaction).await?;
    if with_roles {
        // Lower-case letters, digits and `_` only.
        let sql = AssertSqlSafe(of_schema(address.schema()));
        sqlx::raw_sql(sql).execute(&mut *transaction).await?;
    }
    transaction.commit().await?;
    conn.close().await?;
    Ok(is_new)
}

/// Returns the SQL with which an administrator creates the roles of a catalog, which must exist. Does not connect; the URL
/// only names the schema, if it is not the default one.
///
/// # Errors
/// Returns an error if the URL is invalid.
pub fn roles_sql(url: Option<&str>) -> Result<String> {
    let address = url.map(PostgresAddress::parse).transpose()?;
    let schema = address.as_ref().map_or(SCHEMA, PostgresAddress::schema);
    let body = of_schema(schema);
    Ok(format!(
        "BEGIN;\nSET LOCAL search_path = {schema};\n\n{body}\nCOMMIT;\n"
    ))
}

fn of_schema(schema: &str) -> String {
    SQL.replace("{schema}", schema)
}

async fn require_may_create(conn: &mut PgConnection) -> Result<()> {
    let query = sqlx::query_as(MAY_NOT_CREATE).bind(ROLES.map(str::to_owned).to_vec());
    match query.fetch_one(conn).await? {
        (user, true) => Err(CatalogError::MayNotCreateRoles(user)),
        (_, false) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::{ROLES, roles_sql};

    #[test]
    fn printed_sql_is_for_the_schema_of_the_address() {
        let sql = roles_sql(None).expect("the default schema");
        for role in ROLES {
            assert!(sql.contains(role), "{role}");
        }
        assert!(sql.contains("IN SCHEMA mocban "), "{sql}");
        let url = "postgres://me@localhost/lab";
        assert_eq!(roles_sql(Some(url)).expect("an address"), sql);
        let other = format!("{url}?options[search_path]=other");
        let other = roles_sql(Some(&other)).expect("an address");
        for place in ["search_path = other;", "IN SCHEMA other ", "'other'"] {
            assert!(other.contains(place), "{place}: {other}");
        }
        assert!(!other.contains("SCHEMA mocban "), "{other}");
        roles_sql(Some("not a URL")).expect_err("no address");
    }
}
