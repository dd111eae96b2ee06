//! The session of the local pages in a browser: what another port receives, and every way back to the page.

use std::io::{Read as _, Write as _};
use std::net::TcpListener;
use std::sync::mpsc;

use crate::browser::{Browser, Tab};
use crate::own_port::own_port;
use crate::page::{Page, read_project};
use crate::review_browser::{PLAIN, enter};

/// Starts another local service. Returns its address and the heads of the requests that it receives.
fn other_service() -> (String, mpsc::Receiver<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("http://{}", listener.local_addr().expect("an address"));
    let (seen, heads) = mpsc::channel();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (mut stream, mut bytes) = (stream, [0; 8192]);
            let count = stream.read(&mut bytes).unwrap_or(0);
            let head = String::from_utf8_lossy(&bytes[..count]).into_owned();
            let page = "<title>other</title><p>another service";
            let reply = format!(
                "HTTP/1.1 200 OK\r\ncontent-type: text/html\r\nconnection: close\r\ncontent-length: {}\r\n\r\n{page}",
                page.len()
            );
            // The browser may have closed a connection that it opened in advance.
            let _ = stream.write_all(reply.as_bytes());
            if seen.send(head).is_err() {
                return;
            }
        }
    });
    (address, heads)
}

fn ready(tab: &Tab<'_>) {
    tab.wait("document.body?.dataset.ready && document.body.dataset.shown");
}

#[test]
fn a_page_of_another_port_gets_no_cookie_and_reads_nothing() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let page = Page::start(&read_project(&dir), "lan", &PLAIN);
    let tab = enter(&browser, &page, [1024, 768]);
    let session = tab.eval("location.href");
    let (other, heads) = other_service();
    tab.open(&other);
    tab.wait("document.title === 'other'");
    let head = heads.recv().expect("a request");
    assert!(head.starts_with("GET / "), "{head}");
    assert!(!head.to_lowercase().contains("cookie:"), "{head}");
    assert!(!head.to_lowercase().contains("referer:"), "{head}");
    // Even a page that knew the path could not read an answer, or show the page inside its own.
    for path in ["/", session.as_str().expect("a URL")] {
        let read = tab.eval(&format!(
            "fetch(new URL('{path}', 'http://{}'), {{ credentials: 'include' }}).then((reply) => reply.text(), () => 'refused')",
            page.host
        ));
        assert_eq!(read, "refused", "{path}");
    }
}

#[test]
fn every_way_back_to_the_page_opens_it_in_the_same_browser() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let page = Page::start(&read_project(&dir), "lan", &PLAIN);
    let tab = enter(&browser, &page, [1024, 768]);
    let session = tab.eval("location.href");
    let session = session.as_str().expect("a URL");
    tab.reload();
    ready(&tab);
    let (other, _heads) = other_service();
    tab.open(&other);
    tab.wait("document.title === 'other'");
    tab.eval("history.back(), null");
    ready(&tab);
    // A second tab: the bookmark, the bare address, and the link that was used before.
    for address in [session, &format!("http://{}/", page.host), &page.url] {
        let second = browser.tab(1024, 768);
        second.open(address);
        ready(&second);
        assert_eq!(second.eval("location.href"), session, "{address}");
    }
}

#[test]
fn a_session_that_has_ended_is_explained_and_followed_by_the_next() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let port = own_port().to_string();
    let on_port = [&PLAIN[..], &["--port", &port]].concat();
    let mut page = Page::start(&project, "lan", &on_port);
    let tab = enter(&browser, &page, [1024, 768]);
    page.kill();
    let next = Page::start(&project, "lan", &on_port);
    tab.reload();
    tab.wait("document.querySelector('[lang=vi] h1')?.textContent.startsWith('Trang này')");
    let _other = enter(&browser, &next, [1024, 768]);
    tab.reload();
    // A tab in the background paints nothing, so it never has the marks of a page that is shown.
    tab.wait("document.getElementById('pair')?.textContent.startsWith('upright')");
}
