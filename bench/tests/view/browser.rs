//! Headless Chromium by its own protocol.

#[path = "../shared/chromium.rs"]
mod shared;

use serde_json::{Value, json};
use std::fs;
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// A browser that is gone when it is dropped.
pub(crate) struct Browser {
    child: Child,
    socket: WebSocket<TcpStream>,
    calls: u64,
}

pub(crate) struct Page(String);

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Browser {
    /// One with a profile in this folder, where there is Chromium.
    pub(crate) fn open(folder: &Path) -> Option<Self> {
        let profile = folder.join("profile");
        let child = shared::chromium(&profile)?
            .args([
                "--window-size=1000,900",
                "--remote-debugging-port=0",
                "about:blank",
            ])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("a browser that starts");
        let begun = Instant::now();
        let (port, path) = loop {
            assert!(begun.elapsed() < Duration::from_secs(60), "no port");
            let told = fs::read_to_string(profile.join("DevToolsActivePort")).unwrap_or_default();
            if let Some((port, path)) = told.trim().split_once('\n') {
                break (port.parse::<u16>().expect("a port"), path.to_owned());
            }
            std::thread::sleep(Duration::from_millis(50));
        };
        let stream = TcpStream::connect(("127.0.0.1", port)).expect("listens");
        let address = format!("ws://127.0.0.1:{port}{path}");
        let (socket, _) = tungstenite::client(address, stream).expect("a socket");
        Some(Self {
            child,
            socket,
            calls: 0,
        })
    }

    fn call(&mut self, page: Option<&Page>, method: &str, params: &Value) -> Value {
        self.calls += 1;
        let mut call = json!({ "id": self.calls, "method": method, "params": params });
        if let Some(Page(session)) = page {
            call["sessionId"] = session.as_str().into();
        }
        let message = Message::Text(call.to_string().into());
        self.socket.send(message).expect("sent");
        loop {
            let message = self.socket.read().expect("an answer");
            let Message::Text(text) = message else {
                continue;
            };
            let mut answer: Value = serde_json::from_str(&text).expect("JSON");
            if answer["id"] == self.calls {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].take();
            }
        }
    }

    /// Opens an address.
    pub(crate) fn page(&mut self, address: &str) -> Page {
        let target = self.call(None, "Target.createTarget", &json!({ "url": address }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let session = self.call(None, "Target.attachToTarget", &attach);
        Page(session["sessionId"].as_str().expect("a session").to_owned())
    }

    pub(crate) fn close(&mut self, page: &Page) {
        self.call(Some(page), "Page.close", &json!({}));
    }

    /// The value of a script in a page, awaited.
    pub(crate) fn value(&mut self, page: &Page, script: &str) -> Value {
        let params = json!({
            "expression": script,
            "awaitPromise": true,
            "returnByValue": true,
        });
        let mut result = self.call(Some(page), "Runtime.evaluate", &params);
        let holds = result.get("exceptionDetails").is_none();
        assert!(holds, "{script}: {result}");
        result["result"]["value"].take()
    }

    /// Waits until a script is true in a page.
    pub(crate) fn until(&mut self, page: &Page, script: &str) {
        let begun = Instant::now();
        while self.value(page, script) != Value::Bool(true) {
            assert!(begun.elapsed() < Duration::from_secs(30), "{script}");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Presses a key, or lets it go.
    pub(crate) fn key(&mut self, page: &Page, key: &str, down: bool) {
        let kind = if down { "keyDown" } else { "keyUp" };
        let params = json!({ "type": kind, "key": key });
        self.call(Some(page), "Input.dispatchKeyEvent", &params);
    }

    /// Makes a page 400 pixels wide.
    pub(crate) fn narrow(&mut self, page: &Page) {
        let size = json!({ "width": 400, "height": 800, "deviceScaleFactor": 1, "mobile": false });
        self.call(Some(page), "Emulation.setDeviceMetricsOverride", &size);
    }
}
