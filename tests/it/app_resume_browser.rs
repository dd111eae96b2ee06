//! Uploads of a browser that are interrupted: the same files are chosen again, on the same page or on another one.

use std::path::{Path, PathBuf};

use rustix::process::{Signal, kill_process};
use serde_json::{Value, json};

use crate::app::app;
use crate::app_browser::enter;
use crate::browser::{Browser, Tab};
use crate::page::Page;
use crate::waiting::wait_until;

/// The page of imports can take files.
const READY: &str = "document.getElementById('upload')?.dataset.ready";
/// The files got their folder, and the page shows them.
const STORED: &str = "location.search.includes('path=') && document.body?.dataset.ready";
/// Keeps the names of the files that are sent, also when another page follows, and how many are said to have arrived before.
const RECORD: &str = "(() => {
    const open = XMLHttpRequest.prototype.open;
    const keep = (name, value) => sessionStorage.setItem(name, JSON.stringify(value));
    XMLHttpRequest.prototype.open = function (method, address, ...rest) {
        const [file] = address.split('/')[2].split('?');
        keep('sent', [...JSON.parse(sessionStorage.getItem('sent') ?? '[]'), decodeURIComponent(file)]);
        keep('arrived', document.querySelector('#upload-arrived').textContent);
        window.sending = this;
        open.call(this, method, address, ...rest);
    };
})(), null";

/// Writes two small files and a large one.
fn files(dir: &Path) -> [PathBuf; 3] {
    [("1.stl", 10), ("1.png", 10), ("2.stl", 20_000_000)].map(|(name, bytes)| {
        let file = dir.join(name);
        std::fs::write(&file, "x".repeat(bytes)).expect("written");
        file
    })
}

/// Opens the page of imports.
fn open_import(tab: &Tab<'_>, home: &str) {
    tab.open(&format!("{home}import"));
    tab.wait(READY);
    tab.eval(RECORD);
}

/// Returns how many bytes of an upload have arrived, or nothing if it was interrupted.
fn arrived(tab: &Tab<'_>, upload: u64) -> Option<u64> {
    let asked = format!(
        "fetch('uploads/{upload}', {{ headers: {{ accept: 'application/json' }} }}).then((reply) => reply.json())"
    );
    tab.eval(&asked)["bytes"].as_u64()
}

/// Sends files slowly until the third one is on its way.
fn send_slowly(tab: &Tab<'_>, files: &[PathBuf]) {
    tab.limit_sending(100_000);
    tab.choose_files("#upload-files", files);
    tab.wait("document.querySelector('#upload-done').textContent.startsWith('2 / 3 files')");
    wait_until("the third file arrives", || arrived(tab, 1) > Some(20));
}

fn kept(tab: &Tab<'_>, name: &str) -> Value {
    tab.eval(&format!("JSON.parse(sessionStorage.getItem('{name}'))"))
}

/// Checks that the files are in their folder.
fn are_stored(dir: &Path, files: &[PathBuf]) {
    for file in files {
        let name = file.file_name().expect("a name");
        let copy = std::fs::read(dir.join("uploads/files 1").join(name)).expect("a file");
        assert!(
            copy == std::fs::read(file).expect("a file"),
            "{}",
            name.display()
        );
    }
    let folders = std::fs::read_dir(dir.join("uploads")).expect("a folder");
    assert_eq!(folders.count(), 1, "nothing unfinished is left");
}

#[test]
fn only_the_missing_files_are_sent_when_the_same_are_chosen_again() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let source = tempfile::tempdir().expect("a temporary directory");
    let files = files(source.path());
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    open_import(&tab, &home);
    send_slowly(&tab, &files);
    tab.eval("window.sending.abort(), null");
    tab.wait("!document.querySelector('#upload-problem').hidden");
    wait_until("the program notices", || arrived(&tab, 1).is_none());
    assert_eq!(kept(&tab, "sent"), json!(["1.stl", "1.png", "2.stl"]));
    tab.limit_sending(-1);
    tab.choose_files("#upload-files", &files);
    tab.wait(STORED);
    let sent = json!(["1.stl", "1.png", "2.stl", "2.stl"]);
    assert_eq!(kept(&tab, "sent"), sent);
    let said = "Files that had arrived before and are not sent again: 2";
    assert_eq!(kept(&tab, "arrived"), said);
    are_stored(dir.path(), &files);
}

#[test]
fn an_upload_says_that_the_app_ended_and_the_next_app_takes_the_same_files() {
    let Some(browser) = Browser::start() else {
        return;
    };
    for (signal, said) in [
        (Signal::TERM, "hoose them again"),
        (Signal::KILL, "The program does not answer"),
    ] {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let source = tempfile::tempdir().expect("a temporary directory");
        let files = files(source.path());
        let mut page = Page::of(app(dir.path()).args(["--lang", "en"]));
        let (tab, home) = enter(&browser, &page, [1366, 660]);
        open_import(&tab, &home);
        send_slowly(&tab, &files);
        kill_process(page.pid(), signal).expect("stopped");
        page.exit_code();
        tab.wait("!document.querySelector('#upload-problem').hidden");
        let shown = tab.eval("document.querySelector('#upload-problem').textContent");
        assert!(shown.to_string().contains(said), "{shown}");
        let next = Page::of(app(dir.path()).args(["--lang", "en"]));
        let (tab, home) = enter(&browser, &next, [1366, 660]);
        // On SIGTERM, the app removes the files that have arrived.
        if signal == Signal::KILL {
            let shown = tab.eval("document.querySelector('#upload-last').textContent");
            let said = "the program ended before the last upload was stored";
            assert!(shown.to_string().contains(said), "{shown}");
        }
        open_import(&tab, &home);
        tab.choose_files("#upload-files", &files);
        tab.wait(STORED);
        are_stored(dir.path(), &files);
        tab.open(&home);
        tab.wait("document.body?.dataset.ready && !document.querySelector('#upload-last')");
    }
}

#[test]
fn the_files_of_a_tab_that_was_closed_are_not_sent_again() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let source = tempfile::tempdir().expect("a temporary directory");
    let files = files(source.path());
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (first, home) = enter(&browser, &page, [1366, 660]);
    open_import(&first, &home);
    send_slowly(&first, &files);
    first.open("about:blank");
    let second = browser.tab(1366, 660);
    wait_until("the page says that files are missing", || {
        second.open(&format!("{home}import"));
        second.wait(READY);
        let last = second.eval("document.querySelector('#upload-last')?.textContent");
        last.to_string().contains("2 of them have arrived")
    });
    second.eval(RECORD);
    second.choose_files("#upload-files", &files);
    second.wait(STORED);
    assert_eq!(kept(&second, "sent"), json!(["2.stl"]));
    are_stored(dir.path(), &files);
}

#[test]
fn another_tab_takes_over_an_upload_of_which_nothing_arrives() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let source = tempfile::tempdir().expect("a temporary directory");
    let files = files(source.path());
    // An upload is silent after 15 s instead of 5 s, in which a busy machine sends something.
    let mut command = app(dir.path());
    command
        .args(["--lang", "en"])
        .env("MOCBAN_LIMIT_FACTOR", "3");
    let page = Page::of(&mut command);
    let (first, home) = enter(&browser, &page, [1366, 660]);
    open_import(&first, &home);
    send_slowly(&first, &files);
    let second = browser.tab(1366, 660);
    open_import(&second, &home);
    let problem = "document.querySelector('#upload-problem').textContent";
    let choose = || {
        second.choose_files("#upload-files", &files);
        second.wait("!document.querySelector('#upload-problem').hidden && !document.querySelector('#upload').ariaBusy");
        second.eval("document.querySelector('#upload-take-over').hidden") == false
    };
    assert!(!choose(), "files are arriving");
    let said = second.eval(problem);
    assert!(
        said.to_string().contains("another page is sending"),
        "{said}"
    );
    first.limit_sending(1);
    wait_until("the other page can take over", choose);
    second.screenshot("app_take_over");
    second.eval("document.querySelector('#upload-take-over').focus(), null");
    second.press("Space", false);
    second.wait(STORED);
    // The browser may have sent the third file from the first page after all.
    let sent = kept(&second, "sent");
    assert!(sent.is_null() || sent == json!(["2.stl"]), "{sent}");
    are_stored(dir.path(), &files);
    first.limit_sending(-1);
    first.wait(&format!(
        "{problem}.includes('another page has taken over')"
    ));
}
