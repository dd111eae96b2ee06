//! The devices at a browser: a keyboard, a mouse, a screen for fingers, and a slow network.

use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::json;

use crate::browser::Tab;

/// The key Shift in events.
const SHIFT: u8 = 8;
/// Most times that a person presses Tab to reach a control.
const MOST_TABS: usize = 200;

impl Tab<'_> {
    /// Presses and releases a key of the keyboard as a person does, with Shift or without, so that controls react to it.
    pub(crate) fn press(&self, code: &str, with_shift: bool) {
        let (key, number) = match code {
            "Tab" => (code, 9),
            "Enter" => (code, 13),
            "Space" => (" ", 32),
            "ArrowLeft" => (code, 37),
            "ArrowUp" => (code, 38),
            "ArrowRight" => (code, 39),
            "ArrowDown" => (code, 40),
            other => unreachable!("no test presses {other}"),
        };
        // Buttons react to the character of Enter.
        let down = if code == "Enter" {
            "keyDown"
        } else {
            "rawKeyDown"
        };
        for kind in [down, "keyUp"] {
            let mut event = json!({
                "type": kind, "code": code, "key": key, "windowsVirtualKeyCode": number,
                "modifiers": SHIFT * u8::from(with_shift),
            });
            if kind == "keyDown" {
                event["text"] = json!("\r");
            }
            self.call("Input.dispatchKeyEvent", &event);
        }
    }

    /// Presses Tab until a control has the focus.
    #[track_caller]
    pub(crate) fn tab_to(&self, control: &str) {
        let is_there = format!("Boolean(document.activeElement?.matches(`{control}`))");
        for _ in 0..MOST_TABS {
            if self.eval(&is_there) == true {
                return;
            }
            self.press("Tab", false);
        }
        unreachable!("{control} is not reached with the key Tab");
    }

    /// Moves to a control with Tab, and presses Enter.
    #[track_caller]
    pub(crate) fn press_enter_on(&self, control: &str) {
        self.tab_to(control);
        self.press("Enter", false);
    }

    /// Presses and releases a physical key.
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
        let prefixes = ["Key", "Digit", "Numpad"];
        let letter = prefixes.iter().find_map(|prefix| code.strip_prefix(prefix));
        let key = letter.unwrap_or(code).to_lowercase();
        let named = matches!(
            code,
            "Enter" | "NumpadEnter" | "Escape" | "Backspace" | "Tab"
        );
        let key = if named { code } else { &key };
        let mut event = json!({ "type": kind, "code": code, "key": key });
        if code == "Escape" {
            // Dialogs react to the legacy key code.
            event["windowsVirtualKeyCode"] = json!(27);
        }
        self.call("Input.dispatchKeyEvent", &event);
    }

    /// Clicks into the middle of an element, with Shift or without.
    pub(crate) fn click(&self, element: &str, with_shift: bool) {
        let [x, y] = self.middle(element);
        for kind in ["mousePressed", "mouseReleased"] {
            let params = json!({
                "type": kind, "x": x, "y": y, "button": "left", "clickCount": 1,
                "modifiers": SHIFT * u8::from(with_shift),
            });
            self.call("Input.dispatchMouseEvent", &params);
        }
    }

    /// Taps on the middle of an element.
    pub(crate) fn tap(&self, element: &str) {
        let middle = [self.middle(element)];
        self.touch(&middle, &middle);
    }

    /// Returns the middle of an element after it was scrolled into the middle of the window.
    fn middle(&self, element: &str) -> [f64; 2] {
        self.point(&format!(
            "(() => {{
                const element = document.querySelector(`{element}`);
                element.scrollIntoView({{ block: 'center' }});
                const bounds = element.getBoundingClientRect();
                return [bounds.x + bounds.width / 2, bounds.y + bounds.height / 2];
            }})()"
        ))
    }

    /// Types text into the focused element.
    pub(crate) fn text(&self, text: &str) {
        self.call("Input.insertText", &json!({ "text": text }));
    }

    /// Drags files of the computer onto the middle of an element, and drops them there.
    pub(crate) fn drop_files(&self, element: &str, files: &[PathBuf]) {
        let [x, y] = self.middle(element);
        let data = json!({ "items": [], "files": files, "dragOperationsMask": 1 });
        for kind in ["dragEnter", "dragOver", "drop"] {
            let event = json!({ "type": kind, "x": x, "y": y, "data": data });
            self.call("Input.dispatchDragEvent", &event);
        }
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

    /// Puts fingers on the screen at the first points, moves them to the second, and lifts them. By its timestamps, a
    /// movement takes a second: the browser takes a tap after a fast one for the end of a fling.
    pub(crate) fn touch(&self, from: &[[f64; 2]], to: &[[f64; 2]]) {
        let points = |places: &[[f64; 2]]| {
            let places = places.iter().enumerate();
            let points = places.map(|(id, [x, y])| json!({ "x": x, "y": y, "id": id }));
            points.collect::<Vec<_>>()
        };
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let now = now.expect("a time after 1970").as_secs_f64();
        for (kind, places, seconds_ago) in [
            ("touchStart", from, 1.0),
            ("touchMove", to, 0.5),
            ("touchEnd", &[], 0.0),
        ] {
            let mut params = json!({ "type": kind, "touchPoints": points(places) });
            if from != to {
                params["timestamp"] = json!(now - seconds_ago);
            }
            self.call("Input.dispatchTouchEvent", &params);
        }
    }

    /// Makes the tab that of a phone or tablet of this size, which is used with fingers.
    pub(crate) fn use_fingers(&self, [width, height]: [u32; 2]) {
        let size =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": true });
        self.call("Emulation.setDeviceMetricsOverride", &size);
        let touch = json!({ "enabled": true, "maxTouchPoints": 5 });
        self.call("Emulation.setTouchEmulationEnabled", &touch);
        self.wait("matchMedia('(pointer: coarse)').matches");
    }

    /// Limits how many bytes the tab sends in a second; -1 for no limit.
    pub(crate) fn limit_sending(&self, bytes: i64) {
        let conditions = json!({
            "offline": false, "latency": 0, "downloadThroughput": -1, "uploadThroughput": bytes,
        });
        self.call("Network.emulateNetworkConditions", &conditions);
    }
}
