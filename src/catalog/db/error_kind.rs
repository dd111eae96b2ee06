//! What an error of the database means for the file it lies in.

use crate::catalog::db::error::CatalogError;

/// What is wrong with the catalog's file, in place of the database's own words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CatalogErrorKind {
    /// Its pages contradict each other.
    Damaged,
    /// It is no database at all.
    NotADatabase,
    /// It cannot be written to.
    ReadOnly,
    /// It, or a file beside it, cannot be opened.
    CannotOpen,
    /// The disk is full.
    Full,
    /// Another process kept it locked for too long.
    Busy,
    /// The disk refused to read or write.
    Disk,
    /// A write broke a rule of the schema: rows or counters contradict each other already.
    Contradiction,
}

impl CatalogErrorKind {
    /// By SQLite's result code, extended ones included.
    pub(crate) const fn of_code(code: i64) -> Option<Self> {
        match code & 0xff {
            // The last is of a reader that others kept out while the log was looked through.
            5 | 6 | 15 => Some(Self::Busy),
            8 => Some(Self::ReadOnly),
            10 => Some(Self::Disk),
            11 => Some(Self::Damaged),
            13 => Some(Self::Full),
            14 => Some(Self::CannotOpen),
            19 => Some(Self::Contradiction),
            26 => Some(Self::NotADatabase),
            _ => None,
        }
    }

    pub(crate) fn of(error: &sqlx::Error) -> Option<Self> {
        let code = error.as_database_error()?.code()?;
        Self::of_code(code.parse().ok()?)
    }
}

impl CatalogError {
    /// What it means for the file; `None` when the file is not to blame or the error says so itself.
    pub fn kind(&self) -> Option<CatalogErrorKind> {
        match self {
            Self::Database(error) | Self::Migrate(sqlx::migrate::MigrateError::Execute(error)) => {
                CatalogErrorKind::of(error)
            }
            Self::Shared(error) => error.kind(),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::CatalogErrorKind;

    #[test]
    fn extended_codes_mean_what_their_base_means() {
        // SQLITE_CORRUPT_INDEX, SQLITE_READONLY_DIRECTORY, SQLITE_IOERR_FSYNC.
        assert_eq!(
            CatalogErrorKind::of_code(779),
            Some(CatalogErrorKind::Damaged)
        );
        assert_eq!(
            CatalogErrorKind::of_code(1544),
            Some(CatalogErrorKind::ReadOnly)
        );
        assert_eq!(
            CatalogErrorKind::of_code(1034),
            Some(CatalogErrorKind::Disk)
        );
        assert_eq!(CatalogErrorKind::of_code(1), None);
    }
}
