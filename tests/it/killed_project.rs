//! An action of `mocban app`, and a copy of the shared project in which it is killed.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::app::{act, open_app, text, token};
use crate::app_choice::chosen;
use crate::app_kills::{HeldApp, LOG, UNTIL_KILLED};
use crate::cli::{mocban, status};
use crate::fault::Fault;
use crate::made_once::copy_folder;
use crate::page::{Page, read_project};
use crate::project_dump::ProjectDump;
use crate::waiting::{run_ends, wait_until};

/// An action that is killed.
pub(crate) struct KilledAction {
    /// Changes the project before.
    pub(crate) prepare: fn(&Path),
    /// Address below that of the session.
    pub(crate) action: &'static str,
    /// Returns what the page sends for a project.
    pub(crate) body: fn(&Page, &Path) -> Value,
    /// The system call at which it is killed, and the file.
    pub(crate) at: [&'static str; 2],
    /// Returns what the action changes in a project.
    pub(crate) state: fn(&Path) -> Value,
    /// The page that says of long work that it was killed, and what it says.
    pub(crate) said: Option<[&'static str; 2]>,
    /// The pair of which the first transaction makes the results stale, so that only a run completes the action.
    pub(crate) makes_stale: Option<&'static str>,
}

impl KilledAction {
    /// Returns an action that changes the catalog in one transaction.
    pub(crate) const fn in_catalog(
        action: &'static str,
        body: fn(&Page, &Path) -> Value,
        state: fn(&Path) -> Value,
    ) -> Self {
        Self {
            prepare: |_| {},
            action,
            body,
            at: ["write", LOG],
            state,
            said: None,
            makes_stale: None,
        }
    }

    /// Returns an action that replaces a file.
    pub(crate) const fn in_file(
        action: &'static str,
        body: fn(&Page, &Path) -> Value,
        file: &'static str,
        state: fn(&Path) -> Value,
    ) -> Self {
        Self {
            at: ["rename", file],
            ..Self::in_catalog(action, body, state)
        }
    }

    /// Returns the action, which makes the results of a pair stale and computes them again.
    pub(crate) const fn computing_again(self, pair: &'static str) -> Self {
        Self {
            makes_stale: Some(pair),
            ..self
        }
    }

    /// Returns the action after a change of the project.
    pub(crate) const fn after(self, prepare: fn(&Path)) -> Self {
        Self { prepare, ..self }
    }
}

/// Makes the project as it is before an action from a copy of the shared one.
fn prepared(action: &KilledAction) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let project = dir.path().canonicalize().expect("a path").join("p");
    mocban(&project, &["retire", "upright-0007"]).expect(0);
    (action.prepare)(&project);
    dir
}

/// A copy of a prepared project in which an action is killed.
struct KilledProject<'a> {
    action: &'a KilledAction,
    dir: tempfile::TempDir,
    /// The state before the action.
    before: Value,
}

impl<'a> KilledProject<'a> {
    fn of(action: &'a KilledAction, prepared: &Path) -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        copy_folder(prepared, dir.path());
        let project = dir.path().canonicalize().expect("a path").join("p");
        let before = (action.state)(&project);
        Self {
            action,
            dir,
            before,
        }
    }

    fn root(&self) -> PathBuf {
        self.dir.path().canonicalize().expect("a path")
    }

    fn state(&self) -> Value {
        (self.action.state)(&self.root().join("p"))
    }

    fn body(&self, page: &Page) -> Value {
        (self.action.body)(page, &self.root().join("p"))
    }

    /// Sends the action, and kills the app at the n-th of some calls. No damage is left.
    fn kill_at(&self, call: &'static str, nth: usize) {
        let held = Fault::slow(call, self.action.at[1], UNTIL_KILLED);
        let held = HeldApp::start(&self.root(), held, nth);
        let body = self.body(&held.page);
        let token = token(&held.page);
        held.kill_in(self.action.action, token, &body);
        mocban(&self.root().join("p"), &["check"]).expect(0);
    }

    /// Sends an action to the next app, and returns what it has changed in the end.
    fn change(&self, next: &Page, path: &str, body: &Value) -> ActionOutcome {
        let (what, project) = (self.action.action, self.root().join("p"));
        let stages = self.stages_of_stale();
        let reply = act(next, path, body, |_| {});
        assert_eq!(reply.status, 200, "{what}: {}", text(&reply));
        wait_until(what, || self.state() != self.before);
        // The run of a stale pair may begin later.
        if stages.is_some() {
            wait_until(what, || self.stages_of_stale() != stages);
        }
        run_ends(&project);
        if let Some([page, _]) = self.action.said {
            let is_done = || {
                let html = text(&next.get(&format!("/p/p/{page}")));
                !html.contains("data-task=\"running\"")
            };
            wait_until("the page says that it is done", is_done);
        }
        mocban(&project, &["check"]).expect(0);
        self.outcome()
    }

    /// Returns the results of the stages of the pair that the action makes stale.
    fn stages_of_stale(&self) -> Option<Value> {
        let pair = self.action.makes_stale?;
        let shown = mocban(&self.root().join("p"), &["show", pair, "--json"]).expect(0);
        Some(shown.json()["stages"].clone())
    }

    fn outcome(&self) -> ActionOutcome {
        ActionOutcome {
            state: self.state(),
            dump: ProjectDump::of(&self.root()),
        }
    }

    /// Does the action with an app that is not killed.
    fn not_killed(&self) -> ActionOutcome {
        let page = open_app(&self.root());
        self.change(&page, self.action.action, &self.body(&page))
    }

    /// Kills the app before anything is stored, and does the action with the next app. Returns what it has changed.
    fn kill_before(&self) -> ActionOutcome {
        let what = format!("{} at {:?}", self.action.action, self.action.at);
        self.kill_at(self.action.at[0], 1);
        assert_eq!(self.state(), self.before, "{what}");
        let next = open_app(&self.root());
        if let Some([page, part]) = self.action.said {
            let html = text(&next.get(&format!("/p/p/{page}")));
            assert!(html.contains(part), "{what}: {html}");
        }
        self.change(&next, self.action.action, &self.body(&next))
    }

    /// Kills the app as soon as its first transaction is in the log. If the action needs more than that, the next app does it.
    fn kill_after_transaction(&self, after: &ActionOutcome) {
        // The beginning of an empty log is synced before its first transaction.
        let log = std::fs::metadata(self.root().join(LOG));
        let has_log = log.is_ok_and(|log| log.len() > 0);
        self.kill_at("sync", if has_log { 1 } else { 2 });
        let mut found = self.outcome();
        let is_stored = found.state != self.before;
        if !is_stored || self.action.makes_stale.is_some() {
            let next = open_app(&self.root());
            let jobs = status(&self.root().join("p"))["jobs"].clone();
            found = if is_stored || jobs["ready"].as_u64() > Some(0) {
                // Its pairs wait for a run.
                self.run(&next)
            } else {
                self.change(&next, self.action.action, &self.body(&next))
            };
        }
        found.must_equal(after, &format!("{} is half done", self.action.action));
    }

    /// Runs the pairs that wait, or the only one whose results are stale, as the action does.
    fn run(&self, next: &Page) -> ActionOutcome {
        match self.action.makes_stale {
            None => self.change(next, "/p/p/actions/run", &json!({"which": "all"})),
            Some(pair) => self.change(next, "/p/p/actions/chosen", &chosen("resume", &[pair])),
        }
    }
}

/// What an action has left.
struct ActionOutcome {
    state: Value,
    dump: ProjectDump,
}

impl ActionOutcome {
    /// Fails if an action that was killed has left anything else than one that was not.
    fn must_equal(&self, not_killed: &Self, what: &str) {
        assert_eq!(self.state, not_killed.state, "{what}");
        self.dump.must_equal(&not_killed.dump, what);
    }
}

/// Kills an app in each of the actions, and does them with the next app. The rows and files are then those of an app that was
/// not killed.
pub(crate) fn kill_each(actions: &[KilledAction]) {
    for action in actions {
        let prepared = prepared(action);
        let project = || KilledProject::of(action, prepared.path());
        let after = project().not_killed();
        let found = project().kill_before();
        found.must_equal(&after, action.action);
        if action.at[1] == LOG {
            project().kill_after_transaction(&after);
        }
    }
}
