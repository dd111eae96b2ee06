//! Controls headless Chromium by the `DevTools` protocol. JSON objects, each ended by a zero byte, go through two
//! pipes. If there is no Chromium, tests are skipped with a line on stderr that names them.

use std::cell::RefCell;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use base64::prelude::{BASE64_STANDARD, Engine as _};
use serde_json::{Value, json};

use crate::skipped::say_skipped;
use crate::waiting::{LONGEST, pause};

/// Names of the executable, the one that starts fastest first.
const NAMES: [&str; 5] = [
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
    "chrome",
];

/// A running browser.
pub(crate) struct Browser {
    child: Child,
    pipes: RefCell<Pipes>,
    _dir: tempfile::TempDir,
}

struct Pipes {
    to: File,
    from: Receiver<Vec<u8>>,
    calls: u64,
    /// Errors of scripts.
    script_errors: Vec<String>,
    /// Errors on the console, and requests that failed.
    problems: Vec<String>,
}

impl Pipes {
    /// Records what an event says is wrong. The status of a page itself is not wrong: a page that is not open says why.
    fn record(&mut self, event: &Value) {
        let params = &event["params"];
        let is_wrong = match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => {
                self.script_errors.push(params.to_string());
                true
            }
            Some("Runtime.consoleAPICalled") => params["type"] == "error",
            Some("Log.entryAdded") => {
                params["entry"]["level"] == "error" && params["entry"]["source"] != "network"
            }
            Some("Network.loadingFailed") => params["canceled"] != true,
            Some("Network.responseReceived") => {
                params["type"] != "Document" && params["response"]["status"].as_u64() >= Some(400)
            }
            _ => false,
        };
        if is_wrong {
            self.problems.push(event.to_string());
        }
    }
}

/// Finds Chromium: `CHROME`, or one of its names on `PATH`.
fn program() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("CHROME") {
        return Some(named.into());
    }
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let places = NAMES
        .iter()
        .flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    places.into_iter().find(|place| place.is_file())
}

/// Reads the messages of a browser, which each end in a zero, until it ends.
fn messages(from: File) -> Receiver<Vec<u8>> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let messages = BufReader::new(from).split(0);
        for message in messages.map_while(Result::ok) {
            if sender.send(message).is_err() {
                return;
            }
        }
    });
    receiver
}

impl Browser {
    /// Starts a browser; `None` if there is none, with a line on stderr.
    pub(crate) fn start() -> Option<Self> {
        let Some(program) = program() else {
            say_skipped("no Chromium on the path and none in CHROME");
            return None;
        };
        let dir = tempfile::tempdir().expect("a temporary directory");
        let [to, from] = ["to", "from"].map(|name| dir.path().join(name));
        let made = Command::new("mkfifo").args([&to, &from]).status();
        assert!(made.expect("mkfifo starts").success());
        // The shell opens the pipes as file descriptors 3 and 4, as `--remote-debugging-pipe` expects.
        let child = Command::new("sh")
            .arg("-c")
            .arg("exec 3<\"$0\" 4>\"$1\"; shift; exec \"$@\"")
            .args([&to, &from, &program])
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-background-networking",
                // WebGL without a graphics card.
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--disable-dev-shm-usage",
                "--no-first-run",
                "--remote-debugging-pipe",
            ])
            .arg(format!(
                "--user-data-dir={}",
                dir.path().join("profile").display()
            ))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("a shell");
        // Opening a pipe blocks until the other end is open. The pipes are therefore opened in the shell's order.
        let to = File::options().write(true).open(to).expect("a pipe");
        let from = messages(File::open(from).expect("a pipe"));
        Some(Self {
            child,
            pipes: RefCell::new(Pipes {
                to,
                from,
                calls: 0,
                script_errors: Vec::new(),
                problems: Vec::new(),
            }),
            _dir: dir,
        })
    }

    /// Calls a method of a tab or of the browser; panics on an error.
    fn call(&self, tab: Option<&str>, method: &str, params: &Value) -> Value {
        let response = self.request(tab, method, params);
        assert!(response["error"].is_null(), "{method}: {response}");
        response["result"].clone()
    }

    /// Calls a method and returns the response.
    fn request(&self, tab: Option<&str>, method: &str, params: &Value) -> Value {
        let mut pipes = self.pipes.borrow_mut();
        pipes.calls += 1;
        let id = pipes.calls;
        let mut call = json!({ "id": id, "method": method, "params": params });
        if let Some(tab) = tab {
            call["sessionId"] = json!(tab);
        }
        let text = format!("{call}\0");
        pipes
            .to
            .write_all(text.as_bytes())
            .expect("the browser listens");
        loop {
            // Longer than a condition may take that a page waits for.
            let received = pipes.from.recv_timeout(2 * LONGEST);
            let bytes =
                received.unwrap_or_else(|error| unreachable!("{error}: no reply to {call}"));
            let response: Value = serde_json::from_slice(&bytes).expect("JSON");
            pipes.record(&response);
            if response["id"] == id {
                return response;
            }
        }
    }

    /// Returns errors on the console and requests that failed since the last call.
    pub(crate) fn take_problems(&self) -> Vec<String> {
        std::mem::take(&mut self.pipes.borrow_mut().problems)
    }

    /// Opens a tab of the given size.
    pub(crate) fn tab(&self, width: u32, height: u32) -> Tab<'_> {
        let target = self.call(
            None,
            "Target.createTarget",
            &json!({ "url": "about:blank" }),
        );
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let session = self.call(None, "Target.attachToTarget", &attach);
        let tab = Tab {
            browser: self,
            session: session["sessionId"].as_str().expect("a session").to_owned(),
        };
        tab.call("Page.enable", &json!({}));
        for domain in ["Runtime", "Log", "Network"] {
            tab.call(&format!("{domain}.enable"), &json!({}));
        }
        tab.resize([width, height]);
        tab
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if !std::thread::panicking() {
            let script_errors = &self.pipes.borrow().script_errors;
            assert!(
                script_errors.is_empty(),
                "errors in scripts: {script_errors:?}"
            );
        }
    }
}

/// A tab of a browser.
pub(crate) struct Tab<'a> {
    browser: &'a Browser,
    session: String,
}

impl Tab<'_> {
    /// Calls a method; panics on an error.
    pub(crate) fn call(&self, method: &str, params: &Value) -> Value {
        self.browser.call(Some(&self.session), method, params)
    }

    /// Changes the size of the window.
    pub(crate) fn resize(&self, [width, height]: [u32; 2]) {
        let size =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", &size);
    }

    /// Navigates to a URL.
    pub(crate) fn open(&self, url: &str) {
        self.call("Page.navigate", &json!({ "url": url }));
    }

    /// Runs a script before those of every page that is opened from now on.
    pub(crate) fn before_scripts(&self, source: &str) {
        self.call(
            "Page.addScriptToEvaluateOnNewDocument",
            &json!({ "source": source }),
        );
    }

    /// Reloads the page.
    pub(crate) fn reload(&self) {
        // The marks of the old page must not be taken for those of the new one.
        self.eval("delete document.body.dataset.ready, delete document.body.dataset.shown");
        self.call("Page.reload", &json!({}));
    }

    /// Sets the preferred colour scheme.
    pub(crate) fn dark(&self, dark: bool) {
        let scheme = if dark { "dark" } else { "light" };
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.call(
            "Emulation.setEmulatedMedia",
            &json!({ "features": features }),
        );
    }

    /// Evaluates an expression and awaits a promise.
    pub(crate) fn eval(&self, expression: &str) -> Value {
        let params =
            json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let response = self.call("Runtime.evaluate", &params);
        assert!(
            response["exceptionDetails"].is_null(),
            "{expression}: {response}"
        );
        response["result"]["value"].clone()
    }

    /// Evaluates an expression that gives x and y.
    #[track_caller]
    pub(crate) fn point(&self, expression: &str) -> [f64; 2] {
        let point = self.eval(expression);
        [0, 1].map(|axis: usize| point[axis].as_f64().expect("a number"))
    }

    /// Evaluates an expression that gives x and y, after two frames: a sentence of another length resizes the pictures, and
    /// positions in them follow in the next frame.
    #[track_caller]
    pub(crate) fn point_after_layout(&self, expression: &str) -> [f64; 2] {
        let frame = "new Promise((done) => requestAnimationFrame(() => setTimeout(done)))";
        self.point(&format!(
            "{frame}.then(() => {frame}).then(() => {expression})"
        ))
    }

    /// Chooses files in an input, as a person does in the dialog of the browser.
    pub(crate) fn choose_files(&self, query: &str, files: &[PathBuf]) {
        let element = json!({ "expression": format!("document.querySelector('{query}')") });
        let element = self.call("Runtime.evaluate", &element);
        let params = json!({ "files": files, "objectId": element["result"]["objectId"] });
        self.call("DOM.setFileInputFiles", &params);
    }

    /// Waits until an expression is true, also across navigation. An expression that fails is not true yet: what it asks for
    /// may be missing while the page loads.
    #[track_caller]
    pub(crate) fn wait(&self, condition: &str) {
        let poll = format!(
            "new Promise((done) => {{
                const end = Date.now() + {};
                const poll = () => {{
                    let found = false;
                    try {{
                        found = Boolean({condition});
                    }} catch (error) {{
                        if (Date.now() > end) done(String(error));
                    }}
                    if (found || Date.now() > end) done(found);
                    else setTimeout(poll, 20);
                }};
                poll();
            }})",
            LONGEST.as_millis()
        );
        let params = json!({ "expression": poll, "awaitPromise": true, "returnByValue": true });
        let deadline = Instant::now() + LONGEST;
        while Instant::now() < deadline {
            let response = self
                .browser
                .request(Some(&self.session), "Runtime.evaluate", &params);
            let result = &response["result"];
            // An error means that the page navigated away meanwhile.
            if response["error"].is_null() && result["exceptionDetails"].is_null() {
                assert_eq!(
                    result["result"]["value"],
                    true,
                    "never: {condition}; the page says {}",
                    self.eval(
                        "[location.href, document.activeElement?.id, document.body.innerText]"
                    ),
                );
                return;
            }
            // The next page needs the processor, too.
            pause();
        }
        unreachable!("no page stays: {condition}");
    }

    /// Saves a screenshot to the folder `MOCBAN_SCREENSHOTS`, if set.
    pub(crate) fn screenshot(&self, name: &str) {
        let Some(folder) = std::env::var_os("MOCBAN_SCREENSHOTS") else {
            return;
        };
        let taken = self.call("Page.captureScreenshot", &json!({}));
        let text = taken["data"].as_str().expect("a picture");
        let path = PathBuf::from(folder).join(format!("{name}.png"));
        let bytes = BASE64_STANDARD.decode(text).expect("base 64");
        std::fs::write(path, bytes).expect("written");
    }
}
