//! Chromium without a window, spoken to through a pair of pipes in its own debugging protocol: JSON objects, each
//! ended by a zero byte. Where there is no Chromium, tests say so in a line and are skipped.

use std::cell::RefCell;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use base64::prelude::{BASE64_STANDARD, Engine as _};
use serde_json::{Value, json};

/// Names under which it is installed.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
/// How long a page may take until something is as it should be.
const PATIENCE_MS: u32 = 60_000;

/// A browser that is running.
pub(crate) struct Browser {
    child: Child,
    pipes: RefCell<Pipes>,
    _dir: tempfile::TempDir,
}

struct Pipes {
    to: File,
    from: BufReader<File>,
    calls: u64,
    /// Errors of scripts.
    troubles: Vec<String>,
}

/// Where Chromium is: `CHROME`, or by its names on the path.
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

impl Browser {
    /// Starts one; `None` where there is none, which is said.
    #[expect(
        clippy::print_stderr,
        reason = "the one line that says why a test was skipped"
    )]
    pub(crate) fn start() -> Option<Self> {
        let Some(program) = program() else {
            eprintln!("skipped: no Chromium on the path and none in CHROME");
            return None;
        };
        let dir = tempfile::tempdir().expect("a temporary directory");
        let [to, from] = ["to", "from"].map(|name| dir.path().join(name));
        let made = Command::new("mkfifo").args([&to, &from]).status();
        assert!(made.expect("mkfifo starts").success());
        // The shell opens the pipes as 3 and 4, where the browser looks for them.
        let child = Command::new("sh")
            .arg("-c")
            .arg("exec 3<\"$0\" 4>\"$1\"; shift; exec \"$@\"")
            .args([&to, &from, &program])
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
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
        // Each waits for the other end, in the order of the shell.
        let to = File::options().write(true).open(to).expect("a pipe");
        let from = BufReader::new(File::open(from).expect("a pipe"));
        Some(Self {
            child,
            pipes: RefCell::new(Pipes {
                to,
                from,
                calls: 0,
                troubles: Vec::new(),
            }),
            _dir: dir,
        })
    }

    /// Calls a method, of a tab or of the browser itself.
    fn call(&self, tab: Option<&str>, method: &str, params: &Value) -> Value {
        let told = self.ask(tab, method, params);
        assert!(told["error"].is_null(), "{method}: {told}");
        told["result"].clone()
    }

    /// The same with whatever is answered.
    fn ask(&self, tab: Option<&str>, method: &str, params: &Value) -> Value {
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
            let mut bytes = Vec::new();
            pipes
                .from
                .read_until(0, &mut bytes)
                .expect("the browser speaks");
            assert_eq!(bytes.pop(), Some(0), "the browser is gone");
            let told: Value = serde_json::from_slice(&bytes).expect("JSON");
            if told["method"] == "Runtime.exceptionThrown" {
                pipes.troubles.push(told["params"].to_string());
            }
            if told["id"] == id {
                return told;
            }
        }
    }

    /// A new tab of a size.
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
        tab.call("Runtime.enable", &json!({}));
        let size =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        tab.call("Emulation.setDeviceMetricsOverride", &size);
        tab
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if !std::thread::panicking() {
            let troubles = &self.pipes.borrow().troubles;
            assert!(troubles.is_empty(), "errors in scripts: {troubles:?}");
        }
    }
}

/// A tab of a browser.
pub(crate) struct Tab<'a> {
    browser: &'a Browser,
    session: String,
}

impl Tab<'_> {
    fn call(&self, method: &str, params: &Value) -> Value {
        self.browser.call(Some(&self.session), method, params)
    }

    /// Goes to an address.
    pub(crate) fn open(&self, url: &str) {
        self.call("Page.navigate", &json!({ "url": url }));
    }

    /// Loads the page anew.
    pub(crate) fn reload(&self) {
        // What the old page told must not pass for the new one's.
        self.eval("delete document.body.dataset.ready, delete document.body.dataset.shown");
        self.call("Page.reload", &json!({}));
    }

    /// Asks for dark pages or light ones.
    pub(crate) fn dark(&self, dark: bool) {
        let scheme = if dark { "dark" } else { "light" };
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.call(
            "Emulation.setEmulatedMedia",
            &json!({ "features": features }),
        );
    }

    /// The value of an expression; what is promised is waited for.
    pub(crate) fn eval(&self, expression: &str) -> Value {
        let params =
            json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let told = self.call("Runtime.evaluate", &params);
        assert!(told["exceptionDetails"].is_null(), "{expression}: {told}");
        told["result"]["value"].clone()
    }

    /// Waits until an expression is true, over loads of other pages.
    #[track_caller]
    pub(crate) fn wait(&self, condition: &str) {
        let look = format!(
            "new Promise((done) => {{
                const end = Date.now() + {PATIENCE_MS};
                const look = () => {{
                    const found = Boolean({condition});
                    if (found || Date.now() > end) done(found);
                    else setTimeout(look, 5);
                }};
                look();
            }})"
        );
        let params = json!({ "expression": look, "awaitPromise": true, "returnByValue": true });
        for _ in 0..200 {
            let told = self
                .browser
                .ask(Some(&self.session), "Runtime.evaluate", &params);
            let result = &told["result"];
            // An error: the page went away while it was asked.
            if told["error"].is_null() && result["exceptionDetails"].is_null() {
                assert_eq!(
                    result["result"]["value"],
                    true,
                    "never: {condition}; the page says {}",
                    self.eval("[document.activeElement?.id, document.body.innerText]"),
                );
                return;
            }
        }
        unreachable!("no page stays: {condition}");
    }

    /// Presses and lets go a key by its place.
    pub(crate) fn key(&self, code: &str) {
        self.key_down(code);
        self.key_up(code);
    }

    pub(crate) fn key_down(&self, code: &str) {
        self.dispatch("rawKeyDown", code);
    }

    pub(crate) fn key_up(&self, code: &str) {
        self.dispatch("keyUp", code);
    }

    fn dispatch(&self, kind: &str, code: &str) {
        let letter = code.strip_prefix("Key").or(code.strip_prefix("Digit"));
        let key = letter.unwrap_or(code).to_lowercase();
        let named = matches!(code, "Enter" | "Escape" | "Backspace" | "Tab");
        let key = if named { code } else { &key };
        let mut event = json!({ "type": kind, "code": code, "key": key });
        if code == "Escape" {
            // A dialog goes by the old number.
            event["windowsVirtualKeyCode"] = json!(27);
        }
        self.call("Input.dispatchKeyEvent", &event);
    }

    /// Types text into what has the focus.
    pub(crate) fn text(&self, text: &str) {
        self.call("Input.insertText", &json!({ "text": text }));
    }

    /// Drags with the left button.
    pub(crate) fn drag(&self, from: [f64; 2], to: [f64; 2]) {
        for (kind, [x, y], buttons) in [
            ("mousePressed", from, 1),
            ("mouseMoved", to, 1),
            ("mouseReleased", to, 0),
        ] {
            let params = json!({
                "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1,
            });
            self.call("Input.dispatchMouseEvent", &params);
        }
    }

    /// A picture of the page into a folder, where `MOCBAN_SCREENSHOTS` names one.
    pub(crate) fn shot(&self, name: &str) {
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
