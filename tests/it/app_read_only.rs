//! The app on a project whose catalog is in a database that its user may only read.

use crate::app::{app, text};
use crate::lab::Lab;
use crate::page::Page;
use crate::waiting::PATIENT_CONNECT;

/// What every page says.
const READ_ONLY: &str = "You may only read the database of this project";

#[test]
fn pages_say_that_the_database_can_only_be_read() {
    let Some(lab) = Lab::with_roles("2") else {
        return;
    };
    // A server that takes no changes, as a standby.
    lab.add_user("mirror", "worker");
    lab.sql(
        "mocban",
        "ALTER ROLE mirror SET default_transaction_read_only = on",
    )
    .expect("set");
    for (user, is_read_only) in [
        ("guest", true),
        ("mirror", true),
        ("lan", false),
        ("grid", false),
    ] {
        let settings = format!("[storage]\ncatalog = \"{}\"\n", lab.url(user));
        std::fs::write(lab.path().join("lab/mocban.toml"), settings).expect("written");
        let mut command = app(lab.path());
        command.args(["--lang", "en"]).envs([PATIENT_CONNECT]);
        let page = Page::of(&mut command).entered();
        for path in ["/p/lab/", "/p/lab/review", "/p/lab/health"] {
            let reply = page.get(path);
            let shown = text(&reply);
            assert_eq!(reply.status, 200, "{user}, {path}: {shown}");
            assert_eq!(
                shown.contains(READ_ONLY),
                is_read_only,
                "{user}, {path}: {shown}"
            );
        }
    }
}
