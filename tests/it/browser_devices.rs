//! The devices at a browser: a keyboard, a screen for fingers, and a slow network.

use serde_json::json;

use crate::browser::{SHIFT, Tab};

impl Tab<'_> {
    /// Presses and releases a key of the keyboard as a person does, with Shift or without, so that controls react to it.
    pub(crate) fn press(&self, code: &str, with_shift: bool) {
        let (key, number) = match code {
            "Tab" => (code, 9),
            "Space" => (" ", 32),
            "ArrowLeft" => (code, 37),
            "ArrowUp" => (code, 38),
            "ArrowRight" => (code, 39),
            "ArrowDown" => (code, 40),
            other => unreachable!("no test presses {other}"),
        };
        for kind in ["rawKeyDown", "keyUp"] {
            let event = json!({
                "type": kind, "code": code, "key": key, "windowsVirtualKeyCode": number,
                "modifiers": SHIFT * u8::from(with_shift),
            });
            self.call("Input.dispatchKeyEvent", &event);
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
