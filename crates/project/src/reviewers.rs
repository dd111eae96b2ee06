//! Names of reviewers: one person must not become two by a typing error.

use std::collections::BTreeSet;

use crate::error::ProjectResult;
use crate::exit::Refusal;
use mocban_catalog::{Catalog, ReviewRights};
use mocban_core::domain::spelling::{plain_form, quoted};

/// Refuses a new reviewer who has one of [`similar_names`].
///
/// # Errors
/// Returns an error that names both, or the error of the catalog.
pub async fn refuse_similar(
    catalog: &Catalog,
    rights: &ReviewRights,
    names: &BTreeSet<String>,
) -> ProjectResult<()> {
    match similar_names(catalog, rights, names).await? {
        Some((new, known)) => {
            let [new, known] = [new, known].map(|name| quoted(&name));
            let text = format!(
                "the reviewers {known} and {new} have nearly the same name; if they are one person, write {known}, or else \
                 add --new-reviewer"
            );
            Err(Refusal::Usage(text).into())
        }
        None => Ok(()),
    }
}

/// Returns the first new name that differs from a known one only in case, accents, blanks or zeros, and that one. A user of
/// PostgreSQL who judges only under the own name has none.
pub async fn similar_names(
    catalog: &Catalog,
    rights: &ReviewRights,
    names: &BTreeSet<String>,
) -> ProjectResult<Option<(String, String)>> {
    if rights.only_reviewer().is_some() {
        return Ok(None);
    }
    Ok(similar(catalog.reviewer_names().await?, names))
}

/// Returns the first new name that is similar to a known one or to an earlier new one, and that one.
fn similar(mut known: BTreeSet<String>, names: &BTreeSet<String>) -> Option<(String, String)> {
    let plain = |name: &str| plain_form(name).replace(char::is_whitespace, "");
    for new in names {
        if known.contains(new) {
            continue;
        }
        let form = plain(new);
        if let Some(other) = known.iter().find(|other| plain(other) == form) {
            return Some((new.clone(), other.clone()));
        }
        known.insert(new.clone());
    }
    None
}

/// Refuses to undo the newest verdict of anyone if there are verdicts of several reviewers.
///
/// # Errors
/// Returns an error that names them, or the error of the catalog.
pub(crate) async fn refuse_several(catalog: &Catalog) -> ProjectResult<()> {
    const MAX_NAMES: usize = 10;
    let names = catalog.reviewers_with_verdicts().await?;
    if names.len() < 2 {
        return Ok(());
    }
    let mut shown: Vec<String> = names.iter().take(MAX_NAMES).cloned().collect();
    if names.len() > MAX_NAMES {
        shown.push(format!("{} more", names.len() - MAX_NAMES));
    }
    let shown = shown.join(", ");
    let text = format!(
        "there are verdicts of several reviewers ({shown}); say whose newest verdict to undo with --reviewer"
    );
    Err(Refusal::Usage(text).into())
}

#[cfg(test)]
mod tests {
    use super::similar;

    #[test]
    fn a_new_name_that_looks_like_another_is_found() {
        let found = |known: &[&str], names: &[&str]| {
            let set = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
            similar(set(known), &set(names))
        };
        let both = |new: &str, known: &str| Some((new.to_owned(), known.to_owned()));
        assert_eq!(found(&["lan"], &["Lan"]), both("Lan", "lan"));
        assert_eq!(found(&["lan"], &["Lân"]), both("Lân", "lan"));
        assert_eq!(found(&["Đỗ An"], &["do an"]), both("do an", "Đỗ An"));
        assert_eq!(found(&["Lê An"], &["LêAn"]), both("LêAn", "Lê An"));
        assert_eq!(found(&[], &["Minh", "minh"]), both("minh", "Minh"));
        assert_eq!(found(&["lan", "Lan"], &["Lan", "lan", "minh"]), None);
    }
}
