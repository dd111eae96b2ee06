//! A project whose catalog is on a server, with roles and users, for tests.

use std::path::Path;
use std::process::Command;

use sqlx::{AssertSqlSafe, Connection as _, PgConnection, Row as _};

use crate::cli::{Call, binary, call, empty, mocban};
use crate::page::Page;
use crate::postgres_server::Server;
use crate::resume::project;
use crate::waiting::{PATIENT, PATIENT_CONNECT};

/// The code of PostgreSQL for a missing right, also by row-level security.
pub(crate) const NOT_PERMITTED: &str = "42501";
/// The code of PostgreSQL for a foreign key without its row.
pub(crate) const NO_SUCH_ROW: &str = "23503";
/// The code with which the schema refuses a change of an append-only table.
pub(crate) const APPEND_ONLY: &str = "23000";

/// A project whose catalog is on a server.
pub(crate) struct Lab {
    dir: tempfile::TempDir,
    pub(crate) server: Server,
}

impl Lab {
    /// Returns `None` if no server is installed.
    pub(crate) fn new(pairs: &str) -> Option<Self> {
        let server = Server::start()?;
        let dir = empty();
        project(dir.path(), "lab", pairs);
        mocban(dir.path(), &["copy", "lab", server.url()]).expect(0);
        std::fs::remove_file(dir.path().join("lab/catalog.sqlite")).expect("removed");
        Some(Self { dir, server })
    }

    /// Returns a project that has been run, whose catalog has roles and a user of each role.
    pub(crate) fn with_roles(pairs: &str) -> Option<Self> {
        let lab = Self::new(pairs)?;
        lab.call("mocban", "run").expect(0);
        lab.call("mocban", "db init --roles").expect(0);
        for (user, role) in [
            ("chief", "owner"),
            ("grid", "worker"),
            ("lan", "reviewer"),
            ("mai", "reviewer"),
            ("guest", "viewer"),
        ] {
            lab.add_user(user, role);
        }
        Some(lab)
    }

    pub(crate) fn add_user(&self, user: &str, role: &str) {
        let sql = format!("CREATE ROLE {user} LOGIN IN ROLE mocban_{role}");
        self.sql("mocban", &sql).expect("a new user");
    }

    pub(crate) fn path(&self) -> &Path {
        self.dir.path()
    }

    /// Returns the address for a user of the database.
    pub(crate) fn url(&self, user: &str) -> String {
        self.server.url().replace("mocban@", &format!("{user}@"))
    }

    /// Returns a command on the project as a user of the database. The words are separated by spaces.
    pub(crate) fn command(&self, user: &str, words: &str) -> Command {
        let mut command = binary();
        command.current_dir(self.path());
        command.args(["-C", "lab", "--catalog", &self.url(user)]);
        command.args(words.split(' '));
        command
    }

    /// Calls a command on the project as a user of the database.
    pub(crate) fn call(&self, user: &str, words: &str) -> Call {
        call(self.command(user, words).envs([PATIENT_CONNECT]))
    }

    /// Asserts that a command is refused in one sentence with a text, and with exit code 2.
    #[track_caller]
    pub(crate) fn assert_refused(&self, user: &str, words: &str, text: &str) {
        let refused = self.call(user, words).expect(2);
        let lines = refused.err.lines();
        let errors: Vec<_> = lines.filter(|line| line.starts_with("error:")).collect();
        assert_eq!(errors.len(), 1, "{}", refused.err);
        assert!(errors[0].contains(text), "{text}: {}", refused.err);
    }

    /// Opens a connection of a user.
    pub(crate) fn session(&self, user: &str) -> Session {
        let options = "&options=-c%20search_path%3Dmocban";
        let url = format!("{}{options}", self.url(user));
        let runtime = tokio::runtime::Runtime::new().expect("a runtime");
        let conn = runtime.block_on(PgConnection::connect(&url));
        Session {
            conn: conn.expect("a connection"),
            runtime,
        }
    }

    /// Runs SQL statements as a user. Returns the rows as text, or the code of the error.
    pub(crate) fn sql(&self, user: &str, sql: &str) -> Result<Vec<Vec<String>>, String> {
        self.session(user).sql(sql)
    }

    /// Asserts that the database refuses statements of a user with an error code.
    #[track_caller]
    pub(crate) fn assert_database_refuses(&self, user: &str, sql: &str, code: &str) {
        assert_eq!(self.sql(user, sql), Err(code.to_owned()), "{user}: {sql}");
    }

    /// Asserts that a check finds nothing, and that the counters equal a recount.
    pub(crate) fn assert_whole(&self) {
        let checked = self.call("guest", "check").expect(0);
        assert!(checked.out.contains("no problems found"), "{}", checked.out);
        let differences = self.sql(
            "guest",
            "WITH counted AS (
                SELECT stage, status, coalesce(fingerprint, 0) AS fingerprint, count(*) AS n FROM job GROUP BY 1, 2, 3),
            kept AS (SELECT stage, status, fingerprint, n FROM counter WHERE n <> 0)
            (TABLE counted EXCEPT TABLE kept) UNION ALL (TABLE kept EXCEPT TABLE counted)",
        );
        assert_eq!(differences, Ok(Vec::new()));
    }

    /// Opens the review page of a user of the database.
    pub(crate) fn review(&self, user: &str, options: &str) -> Page {
        let words = format!("--json review --no-open --reviewer {user} {options}");
        // Many pages at the same time may need long for a request.
        Page::of(self.command(user, &words).envs([PATIENT])).with_session()
    }
}

/// A connection to the server of a [`Lab`].
pub(crate) struct Session {
    conn: PgConnection,
    runtime: tokio::runtime::Runtime,
}

impl Session {
    /// Runs SQL statements. Returns the rows as text, or the code of the error.
    pub(crate) fn sql(&mut self, sql: &str) -> Result<Vec<Vec<String>>, String> {
        let rows = sqlx::raw_sql(AssertSqlSafe(sql.to_owned())).fetch_all(&mut self.conn);
        let rows = self.runtime.block_on(rows).map_err(|error| code(&error))?;
        let text = |row: &sqlx::postgres::PgRow| {
            let columns = 0..row.len();
            let column = |index| row.try_get_unchecked::<Option<String>, _>(index);
            columns
                .map(|index| column(index).expect("text").unwrap_or_default())
                .collect()
        };
        Ok(rows.iter().map(text).collect())
    }
}

/// Returns the code of an error of the server.
fn code(error: &sqlx::Error) -> String {
    let error = error.as_database_error().expect("an error of the server");
    error.code().expect("a code").into_owned()
}
