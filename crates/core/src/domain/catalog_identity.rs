//! Which catalog this is, and where: the owner of a place of artifacts.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Name of the catalog file in a project.
pub const CATALOG_FILE: &str = "catalog.sqlite";

/// Identifies a catalog and the file or schema that holds it. A copy of the file has the same `id`, and another
/// `instance`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CatalogIdentity {
    /// Random number in hexadecimal digits, made with the catalog. Copies by this program have one of their own.
    pub id: String,
    /// Absolute path of the file, or address of the schema on its server.
    pub at: String,
    /// Computer that the path is on. `None` for a catalog on a server.
    pub host: Option<String>,
    /// Differs between a file or schema and its copies. Stays the same if a file is renamed.
    pub instance: String,
}

impl CatalogIdentity {
    /// Returns whether both are the same file or schema. The address of a server may be written in several ways, so
    /// that only the instance is compared. A file that was restored at its old path may have another instance.
    pub fn is_same_place(&self, other: &Self) -> bool {
        match (&self.host, &other.host) {
            (Some(_), Some(_)) => {
                (&self.host, &self.at) == (&other.host, &other.at)
                    || self.instance == other.instance
            }
            (None, None) => is_same_schema(&self.instance, &other.instance),
            _ => false,
        }
    }
}

/// In place of the identity of a server that the user may not ask for it.
pub const UNKNOWN_SERVER: &str = "?";

/// Compares two instances `SERVER/SCHEMA`.
fn is_same_schema(one: &str, other: &str) -> bool {
    let (Some((server, schema)), Some((other_server, other_schema))) =
        (one.split_once('/'), other.split_once('/'))
    else {
        return one == other;
    };
    let is_unknown = [server, other_server].contains(&UNKNOWN_SERVER);
    schema == other_schema && (is_unknown || server == other_server)
}

impl fmt::Display for CatalogIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.host {
            Some(host) => write!(f, "{} on {host}", self.at),
            None => write!(f, "{}", self.at),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::is_same_schema;

    #[test]
    fn a_server_that_may_not_be_asked_is_no_other_server() {
        assert!(is_same_schema("7/16/99", "7/16/99") && is_same_schema("?/16/99", "7/16/99"));
        assert!(!is_same_schema("7/16/99", "8/16/99") && !is_same_schema("?/16/99", "7/16/98"));
    }
}
