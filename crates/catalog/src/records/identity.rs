//! The identity of the catalog, and some of its artifacts: what decides whether a place of artifacts belongs to it.

use std::fmt::Write as _;
use std::path::Path;

use crate::Catalog;
use crate::db::conn::Conn;
use crate::db::error::{CatalogError, Result};
use crate::db::query::query_scalar;
use mocban_core::domain::{ArtifactRef, ArtifactSet, CatalogIdentity, UNKNOWN_SERVER};
use mocban_system::platform::{canonicalize, generation, host_name};

const ID: &str = "SELECT id FROM catalog_identity";

/// Whether the user may ask the server for its identity.
const MAY_ASK: &str =
    "SELECT CAST(has_function_privilege('pg_control_system()', 'EXECUTE') AS int)";

/// Identity of the server, which the copy of a dump does not have.
const SERVER: &str = "SELECT CAST(system_identifier AS text) FROM pg_control_system()";

/// Database and table, which differ between copies on the same server.
const TABLE: &str = "
SELECT CAST(oid AS text) || '/' || CAST(CAST(CAST('catalog_identity' AS regclass) AS oid) AS text)
FROM pg_database WHERE datname = current_database()";

/// Files of results that a run may have computed first.
const FIRST_FILES: [&str; 2] = [
    "SELECT files FROM stage_result WHERE files <> '{}' ORDER BY pair, stage LIMIT ?1",
    "SELECT files FROM block_result WHERE files <> '{}' ORDER BY block, stage LIMIT ?1",
];

impl Catalog {
    /// Returns which catalog this is, and where.
    pub async fn identity(&self) -> Result<CatalogIdentity> {
        let mut conn = self.read_conn().await?;
        let id: Vec<u8> = query_scalar(ID).fetch_one(&mut conn).await?;
        let id = id.iter().fold(String::new(), |mut hex, byte| {
            // Writing to a string does not fail.
            let _ = write!(hex, "{byte:02x}");
            hex
        });
        if self.is_shared() {
            let address = self.path.display().to_string();
            // The user's name says nothing about the place.
            let at = match address.split_once('@') {
                Some((_, place)) => format!("postgres://{place}"),
                None => address,
            };
            return Ok(CatalogIdentity {
                id,
                at,
                host: None,
                instance: server_instance(&mut conn).await?,
            });
        }
        let (at, instance) = file_instance(&self.path).map_err(|source| CatalogError::Io {
            path: self.path.to_path_buf(),
            source,
        })?;
        Ok(CatalogIdentity {
            id,
            at,
            host: Some(host_name()),
            instance,
        })
    }

    /// Returns artifacts of at most `limit` results of pairs, and of as many of blocks.
    pub async fn first_artifacts(&self, limit: usize) -> Result<Vec<ArtifactRef>> {
        let mut conn = self.read_conn().await?;
        let mut artifacts = Vec::new();
        for sql in FIRST_FILES {
            let query = query_scalar(sql).bind(limit as i64);
            let found: Vec<String> = query.fetch_all(&mut conn).await?;
            let sets = found.iter().map(|files| serde_json::from_str(files));
            // A result whose files cannot be read is damaged; `check` reports it.
            let sets = sets.filter_map(|files: serde_json::Result<ArtifactSet>| files.ok());
            artifacts.extend(sets.flat_map(ArtifactSet::into_values));
        }
        Ok(artifacts)
    }
}

/// Returns what distinguishes this schema of a server from its copies.
async fn server_instance(conn: &mut Conn) -> Result<String> {
    let table: String = query_scalar(TABLE).fetch_one(conn).await?;
    let may_ask: bool = query_scalar(MAY_ASK).fetch_one(conn).await?;
    let server = if may_ask {
        query_scalar(SERVER).fetch_one(conn).await?
    } else {
        UNKNOWN_SERVER.to_owned()
    };
    Ok(format!("{server}/{table}"))
}

/// Returns the absolute path of a file, and what distinguishes it from its copies.
fn file_instance(path: &Path) -> std::io::Result<(String, String)> {
    let at = canonicalize(path)?;
    let instance = generation(&std::fs::metadata(&at)?);
    Ok((at.display().to_string(), instance.to_string()))
}
