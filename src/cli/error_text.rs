//! What to say of an error of the catalog in place of the database's own words.

use std::error::Error;
use std::path::Path;

use crate::catalog::{CatalogError, Holder, Trouble, holder};
use crate::check::CheckError;
use crate::export::{DrawError, ExportError};
use crate::report::ReportError;
use crate::runner::RunError;
use crate::store::CATALOG_FILE;

/// The catalog's error at the root of a cause, however it is wrapped.
pub(super) fn of_catalog<'a>(cause: &'a (dyn Error + 'static)) -> Option<&'a CatalogError> {
    if let Some(RunError::Catalog(error)) = cause.downcast_ref() {
        return Some(error);
    }
    if let Some(ExportError::Catalog(error)) = cause.downcast_ref() {
        return Some(error);
    }
    if let Some(DrawError::Catalog(error)) = cause.downcast_ref() {
        return Some(error);
    }
    if let Some(ReportError::Catalog(error)) = cause.downcast_ref() {
        return Some(error);
    }
    if let Some(CheckError::Catalog(error)) = cause.downcast_ref() {
        return Some(error);
    }
    cause.downcast_ref()
}

/// Whether the error says that the catalog's file is not what it was.
pub(super) fn is_damage(error: &CatalogError) -> bool {
    let told = matches!(
        error,
        CatalogError::Empty(_)
            | CatalogError::Foreign { .. }
            | CatalogError::Corrupt(_)
            | CatalogError::Json(_)
    );
    told || is_damaged_file(error)
}

/// Whether the pages of the catalog's file contradict each other.
pub(super) fn is_damaged_file(error: &CatalogError) -> bool {
    matches!(error, CatalogError::Damaged(_))
        || matches!(
            error.trouble(),
            Some(Trouble::Damaged | Trouble::NotADatabase)
        )
}

/// The catalog's file as it is shown.
pub(super) fn file(dir: &Path) -> String {
    dir.join(CATALOG_FILE).display().to_string()
}

/// A sentence with the file and what to do; `None` where the error says so itself.
pub(super) fn sentence(error: &CatalogError, dir: &Path) -> Option<String> {
    let shown = file(dir);
    Some(match error.trouble() {
        Some(Trouble::Damaged | Trouble::NotADatabase) => {
            CatalogError::Damaged(shown.into()).to_string()
        }
        Some(Trouble::ReadOnly | Trouble::CannotOpen) => {
            CatalogError::NotWritable(shown.into()).to_string()
        }
        Some(Trouble::Full) => format!(
            "{shown} cannot grow: the disk is full; make room and call again, what was stored is safe"
        ),
        Some(Trouble::Busy) => locked(&shown, holder(Path::new(&shown))),
        Some(Trouble::Disk) => format!(
            "{shown}: the disk refused ({}); look after the disk and call again, what was stored is safe",
            root(error)
        ),
        Some(Trouble::Contradiction) => format!(
            "{shown} holds rows or counters that contradict each other; `check` tells which, `check --repair` mends them"
        ),
        None => match error {
            CatalogError::Corrupt(_) | CatalogError::Json(_) => {
                format!("{shown} holds what it must not: {error}; `check` tells more")
            }
            _ => return None,
        },
    })
}

/// That somebody else kept the catalog locked.
fn locked(shown: &str, by: Option<Holder>) -> String {
    match by {
        Some(holder) => {
            format!(
                "{shown} was kept locked by {holder} for too long; call again when it is done or has ended"
            )
        }
        None => format!("{shown} was kept locked by another process for too long; call again"),
    }
}

/// The last cause, in its own words.
fn root(error: &CatalogError) -> String {
    let mut last: &dyn Error = error;
    while let Some(next) = last.source() {
        last = next;
    }
    last.to_string()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{is_damage, locked, of_catalog, sentence};
    use crate::catalog::{CatalogError, Holder};
    use crate::export::ExportError;

    #[test]
    fn a_wrapped_error_is_found_and_explained() {
        let error = ExportError::Catalog(CatalogError::Corrupt("stage 9 is unknown".into()));
        let found = of_catalog(&error).expect("the catalog's error");
        assert!(is_damage(found));
        let said = sentence(found, Path::new("nowhere")).expect("a sentence");
        assert!(
            said.contains("nowhere/catalog.sqlite") && said.contains("`check`"),
            "{said}"
        );
        let plain = CatalogError::Missing("p/catalog.sqlite".into());
        assert_eq!(sentence(&plain, Path::new("p")), None);
        assert!(!is_damage(&plain));
    }

    #[test]
    fn who_keeps_the_catalog_locked_is_named_with_what_frees_it() {
        let (pid, is_stopped) = (12, true);
        let said = locked("p/catalog.sqlite", Some(Holder { pid, is_stopped }));
        assert!(
            said.contains("pid 12, which is stopped") && said.contains("kill -CONT 12"),
            "{said}"
        );
        let is_stopped = false;
        let said = locked("p/catalog.sqlite", Some(Holder { pid, is_stopped }));
        assert!(
            said.contains("by pid 12 for too long") && !said.contains("CONT"),
            "{said}"
        );
    }
}
