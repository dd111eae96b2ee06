//! Kinds of database errors, by SQLite's result codes.

use std::io;

use rustls::{CertificateError, Error as TlsError};
use sqlx::postgres::PgDatabaseError;

use crate::db::error::CatalogError;

/// `SQLITE_IOERR_SHMSIZE`: the file that processes share beside the catalog could not grow, which a full disk causes.
const IOERR_SHMSIZE: i64 = 0x130a;

/// The kind of a database error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CatalogErrorKind {
    /// The file is corrupt.
    Damaged,
    /// The file is not a database.
    NotADatabase,
    /// The file is read-only.
    ReadOnly,
    /// The file, or one next to it, cannot be opened.
    CannotOpen,
    /// The disk is full.
    Full,
    /// Another process kept the file locked for too long.
    Busy,
    /// An I/O error.
    Disk,
    /// The database server cannot be reached at the moment.
    Unavailable,
    /// A write violated a constraint, or the counters disagree with the jobs.
    Contradiction,
    /// A statement failed. All statements are tested, so a check concludes that the schema or a stored JSON text is
    /// damaged.
    Statement,
}

impl CatalogErrorKind {
    /// Returns the kind of a SQLite result code, if it has one. An extended code has the kind of its primary code, with one
    /// exception.
    pub(crate) const fn of_code(code: i64) -> Option<Self> {
        match code & 0xff {
            _ if code == IOERR_SHMSIZE => Some(Self::Full),
            1 => Some(Self::Statement),
            // SQLITE_PROTOCOL: a reader lost the race for the log's locks too often.
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
        let database = match error {
            sqlx::Error::Io(error) if refused_by_tls(error).is_some() => return None,
            sqlx::Error::Io(_) | sqlx::Error::PoolTimedOut | sqlx::Error::Protocol(_) => {
                return Some(Self::Unavailable);
            }
            error => error.as_database_error()?,
        };
        let code = database.code()?;
        match database.try_downcast_ref::<PgDatabaseError>() {
            Some(_) => Self::of_sqlstate(&code),
            None => Self::of_code(code.parse().ok()?),
        }
    }

    /// Returns the kind of an error code of PostgreSQL.
    fn of_sqlstate(code: &str) -> Option<Self> {
        Some(match code {
            // Deadlock, serialization failure, lock not available: the transaction can run again.
            "40P01" | "40001" | "55P03" => Self::Busy,
            "25006" | "42501" => Self::ReadOnly,
            "53100" => Self::Full,
            "58030" => Self::Disk,
            "57P01" | "57P02" | "57P03" | "25P03" | "53300" => Self::Unavailable,
            _ => match &code[..2] {
                "08" => Self::Unavailable,
                "23" => Self::Contradiction,
                "XX" => Self::Damaged,
                "42" | "22" => Self::Statement,
                _ => return None,
            },
        })
    }
}

impl CatalogError {
    /// Returns whether the database server cannot be reached at the moment.
    pub fn is_unavailable(&self) -> bool {
        self.kind() == Some(CatalogErrorKind::Unavailable)
    }

    /// Explains why a connection was refused for good, such as after a change of the password or of a certificate. Returns
    /// `None` for other errors.
    pub fn refused_connection(&self) -> Option<String> {
        let error = match self {
            Self::Database(error) => error,
            Self::Shared(error) => return error.refused_connection(),
            _ => return None,
        };
        if tls_reason(error).is_some() {
            return Some(connection_error(error));
        }
        let server = error.as_database_error()?;
        let server = server.try_downcast_ref::<PgDatabaseError>()?;
        server
            .code()
            .starts_with("28")
            .then(|| connection_error(error))
    }

    /// Returns whether a statement that this connection prepared is unknown, because a connection pooler has changed the
    /// connection to the server.
    pub fn is_of_pooler(&self) -> bool {
        match self {
            Self::Database(error) => {
                let code = error
                    .as_database_error()
                    .and_then(sqlx::error::DatabaseError::code);
                matches!(code.as_deref(), Some("26000" | "42P05"))
            }
            Self::Shared(error) => error.is_of_pooler(),
            _ => false,
        }
    }

    /// Returns whether a database server reported the error.
    pub fn is_of_server(&self) -> bool {
        match self {
            Self::Database(error) | Self::Migrate(sqlx::migrate::MigrateError::Execute(error)) => {
                let error = error.as_database_error();
                error.is_some_and(|error| error.try_downcast_ref::<PgDatabaseError>().is_some())
            }
            Self::Shared(error) => error.is_of_server(),
            _ => false,
        }
    }

    /// Returns the kind of a SQLite error or of wrong counters, or `None` for any other error.
    pub fn kind(&self) -> Option<CatalogErrorKind> {
        match self {
            Self::Database(error) | Self::Migrate(sqlx::migrate::MigrateError::Execute(error)) => {
                CatalogErrorKind::of(error)
            }
            Self::WrongCounters { .. } => Some(CatalogErrorKind::Contradiction),
            Self::NotConnected {
                is_unavailable: true,
                ..
            } => Some(CatalogErrorKind::Unavailable),
            Self::Shared(error) => error.kind(),
            _ => None,
        }
    }
}

/// Returns the error of TLS that ended a handshake for good. A broken record of an open connection is not one.
fn refused_by_tls(error: &io::Error) -> Option<&TlsError> {
    let error = error.get_ref()?.downcast_ref::<TlsError>()?;
    let is_for_good = matches!(
        error,
        TlsError::InvalidCertificate(_)
            | TlsError::NoCertificatesPresented
            | TlsError::PeerIncompatible(_)
            | TlsError::AlertReceived(_)
    );
    is_for_good.then_some(error)
}

/// Describes why an encrypted connection was refused, with what to do. Returns `None` for other errors.
fn tls_reason(error: &sqlx::Error) -> Option<String> {
    let error = match error {
        sqlx::Error::Tls(error) => {
            return Some(format!(
                "{error}; set `ssl = on` in postgresql.conf of the server, and check the files of sslrootcert, sslcert and sslkey"
            ));
        }
        sqlx::Error::Io(error) => refused_by_tls(error)?,
        _ => return None,
    };
    let TlsError::InvalidCertificate(reason) = error else {
        return Some(format!(
            "{error}; check sslcert and sslkey in the address, and the settings of TLS on the server"
        ));
    };
    Some(match reason {
        CertificateError::Expired | CertificateError::ExpiredContext { .. } => {
            "the certificate of the server has expired; renew it there, and check the clock of this computer".to_owned()
        }
        CertificateError::NotValidYet | CertificateError::NotValidYetContext { .. } => {
            "the certificate of the server is not valid yet; check the clocks of both computers".to_owned()
        }
        CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. } => {
            "the certificate of the server is for another host name; use that name in the address, or give the server a certificate for this one".to_owned()
        }
        CertificateError::UnknownIssuer => {
            "this computer does not know who signed the certificate of the server; name the certificate of that authority, or a self-signed one, with sslrootcert=FILE in the address".to_owned()
        }
        _ => format!(
            "the certificate of the server cannot be used ({error}); give the server one that an authority signed, and name the certificate of the authority with sslrootcert=FILE in the address"
        ),
    })
}

/// Describes why a connection failed, with what to do.
pub(crate) fn connection_error(error: &sqlx::Error) -> String {
    if let Some(reason) = tls_reason(error) {
        return reason;
    }
    let Some(refused) = error.as_database_error() else {
        return match CatalogErrorKind::of(error) {
            Some(CatalogErrorKind::Unavailable) => {
                format!("{error}; check the host, the port and that PostgreSQL runs")
            }
            _ => error.to_string(),
        };
    };
    let text = refused.message();
    match refused.code().as_deref() {
        Some("28P01" | "28000") => {
            format!(
                "{text}; check the user, the password in ~/.pgpass or PGPASSWORD, and pg_hba.conf of the server"
            )
        }
        Some("3D000") => format!("{text}; create it with `createdb`, or correct the address"),
        Some("53300") => format!("{text}; close other programs, or raise max_connections"),
        _ if text.contains("unsupported startup parameter") => {
            format!("{text}; PgBouncer permits it with `ignore_startup_parameters`")
        }
        _ => text.to_owned(),
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
        assert_eq!(
            CatalogErrorKind::of_code(1),
            Some(CatalogErrorKind::Statement)
        );
        assert_eq!(CatalogErrorKind::of_code(2), None);
    }

    #[test]
    fn a_shared_file_that_cannot_grow_means_a_full_disk() {
        assert_eq!(
            CatalogErrorKind::of_code(4874),
            Some(CatalogErrorKind::Full)
        );
    }
}
