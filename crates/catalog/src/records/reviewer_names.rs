//! Spellings of reviewers' names. A name has one spelling where it is used; older rows, and logins of PostgreSQL, may have
//! another one, such as with decomposed letters.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::json;

use crate::db::conn::Conn;
use crate::db::query::{query_as, query_scalar};
use crate::db::row::{FromRow, Row};
use crate::db::rows::json_array;
use crate::db::value::Value;
use crate::{Catalog, Result};
use mocban_core::domain::is_hidden;
use mocban_core::domain::spelling::composed;

const NAMES: &str = "
SELECT reviewer FROM review_act UNION SELECT reviewer FROM attention_check_answer UNION SELECT reviewer FROM manual_alignment";

/// Reviewers whose verdicts are not all undone.
const JUDGES: &str = "
SELECT DISTINCT v.reviewer FROM verdict AS v WHERE NOT EXISTS (SELECT 1 FROM verdict_undo AS u WHERE u.act = v.act)";

const LOGIN: &str = "SELECT CAST(session_user AS text)";

/// Returns the one spelling of a person's name: with composed letters, and single blanks only between words. macOS and some
/// keyboards decompose accented letters, which look the same.
pub fn person_name(name: &str) -> String {
    let composed = composed(name.trim());
    let is_blank = |c: char| c.is_whitespace() && !is_hidden(c);
    let words = composed.split(is_blank).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join(" ")
}

/// A stored name, or `None` if it is damaged.
struct StoredName(Option<String>);

impl FromRow for StoredName {
    fn from_row(row: &Row) -> Result<Self> {
        Ok(Self(match row.value(0)? {
            Value::Text(text) => String::from_utf8(text.into_owned()).ok(),
            _ => None,
        }))
    }
}

/// Reads the column `reviewer` in the one spelling of the name.
pub(crate) fn of_row(row: &Row) -> Result<String> {
    let stored: String = row.get("reviewer")?;
    Ok(person_name(&stored))
}

/// The stored spellings of every reviewer's name.
#[derive(Debug)]
pub(crate) struct Spellings(BTreeMap<String, BTreeSet<String>>);

impl Spellings {
    /// Reads all names.
    pub(crate) async fn read(conn: &mut Conn) -> Result<Self> {
        let stored: Vec<StoredName> = query_as(NAMES).fetch_all(conn).await?;
        let stored: Vec<String> = stored.into_iter().filter_map(|name| name.0).collect();
        let mut spellings = Self(BTreeMap::new());
        spellings.add(&stored);
        Ok(spellings)
    }

    /// Adds stored spellings.
    pub(crate) fn add<'a>(&mut self, stored: impl IntoIterator<Item = &'a String>) {
        for stored in stored {
            let of_name = self.0.entry(person_name(stored)).or_default();
            of_name.insert(stored.clone());
        }
    }

    /// Returns the stored spellings of a name.
    pub(crate) fn of(&self, name: &str) -> impl Iterator<Item = &str> {
        let found = self.0.get(&person_name(name));
        found.into_iter().flatten().map(String::as_str)
    }

    /// Returns the stored spellings of a name as a JSON array.
    pub(crate) fn json(&self, name: &str) -> String {
        json_array(self.of(name))
    }

    /// Returns a JSON array of `[stored, name]` for the names that are stored in another spelling than theirs.
    pub(crate) fn renamed(&self) -> String {
        let all = self.0.iter();
        let all = all.flat_map(|(name, stored)| stored.iter().map(move |stored| (stored, name)));
        let renamed = all.filter(|(stored, name)| stored != name);
        json_array(renamed.map(|(stored, name)| json!([stored, name])))
    }
}

/// Returns the spelling in which a name is stored: that of the login if it is the user's own, because reviewers' rows must
/// have the name of the login, or else the one spelling of the name.
pub(crate) async fn to_store(conn: &mut Conn, name: &str) -> Result<String> {
    let name = person_name(name);
    if matches!(conn, Conn::Sqlite(_)) {
        return Ok(name);
    }
    let login: String = query_scalar(LOGIN).fetch_one(conn).await?;
    Ok(if person_name(&login) == name {
        login
    } else {
        name
    })
}

impl Catalog {
    /// Returns the names of all who answered anything, also if they took it back.
    pub async fn reviewer_names(&self) -> Result<BTreeSet<String>> {
        let mut conn = self.read_conn().await?;
        let Spellings(spellings) = Spellings::read(&mut conn).await?;
        Ok(spellings.into_keys().collect())
    }

    /// Returns the names of those who have a verdict that is not undone.
    pub async fn reviewers_with_verdicts(&self) -> Result<BTreeSet<String>> {
        let mut conn = self.read_conn().await?;
        let stored: Vec<StoredName> = query_as(JUDGES).fetch_all(&mut conn).await?;
        let stored = stored.into_iter().filter_map(|StoredName(stored)| stored);
        Ok(stored.map(|stored| person_name(&stored)).collect())
    }
}
