//! A headless Chromium that a test drives: opens a file, listens to its console and its requests, asks it
//! questions, takes pictures.
//!
//! Speaks the DevTools protocol over two pipes (`--remote-debugging-pipe`: messages of JSON ended by a zero
//! byte, commands read from descriptor 3, answers written to descriptor 4), so that no port is opened.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A browser that says nothing for so long is taken to hang.
const PATIENCE: Duration = Duration::from_secs(120);
/// Whether the page has drawn itself, asked at every frame of the screen until it has or a minute is over.
const DRAWN: &str = "new Promise(done => {
    let frames = 3600;
    const look = () => {
        const ready = document.documentElement.dataset.ready;
        if (ready || --frames < 0) done(ready || 'never');
        else requestAnimationFrame(look);
    };
    look();
})";
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// A running browser with one page; it ends with its value.
pub(crate) struct Browser {
    child: Child,
    commands: ChildStdin,
    answers: Receiver<Value>,
    session: String,
    last: u64,
    loaded: bool,
    /// Errors on the console and requests made since the start, in order.
    pub(crate) complaints: Vec<String>,
    pub(crate) requests: Vec<String>,
    _profile: tempfile::TempDir,
}

/// Starts a browser whose window shows `width` × `height` CSS pixels; `None` when no Chromium is installed.
pub(crate) fn start(width: u32, height: u32) -> Option<Browser> {
    let path = std::env::var_os("PATH")?;
    let name = NAMES.iter().find(|name| std::env::split_paths(&path).any(|f| f.join(name).is_file()))?;
    let profile = tempfile::tempdir().expect("a folder for the profile");
    let mut child = Command::new("sh")
        .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 >/dev/null", name])
        .args(["--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--no-first-run"])
        .args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .arg("--hide-scrollbars")
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg("about:blank")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("a browser");
    let commands = child.stdin.take().expect("a pipe");
    let output = BufReader::new(child.stdout.take().expect("a pipe"));
    let (sender, answers) = channel();
    std::thread::spawn(move || {
        for message in output.split(0).map_while(Result::ok) {
            let message = serde_json::from_slice(&message).expect("JSON from the browser");
            if sender.send(message).is_err() {
                return;
            }
        }
    });
    let mut browser = Browser {
        child,
        commands,
        answers,
        session: String::new(),
        last: 0,
        loaded: false,
        complaints: Vec::new(),
        requests: Vec::new(),
        _profile: profile,
    };
    browser.attach(width, height);
    Some(browser)
}

impl Browser {
    fn attach(&mut self, width: u32, height: u32) {
        let target = self.ask("Target.createTarget", json!({"url": "about:blank"}))["targetId"].clone();
        let attached = self.ask("Target.attachToTarget", json!({"targetId": target, "flatten": true}));
        self.session = attached["sessionId"].as_str().expect("a session").to_owned();
        for domain in ["Page", "Runtime", "Log", "Network"] {
            self.ask(&format!("{domain}.enable"), json!({}));
        }
        let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
        self.ask("Emulation.setDeviceMetricsOverride", size);
    }

    /// Sends a command and waits for its answer, noting what else the browser says.
    pub(crate) fn ask(&mut self, method: &str, parameters: Value) -> Value {
        self.last += 1;
        let mut message = json!({"id": self.last, "method": method, "params": parameters});
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        let mut bytes = message.to_string().into_bytes();
        bytes.push(0);
        self.commands.write_all(&bytes).expect("a listening browser");
        self.commands.flush().expect("a listening browser");
        loop {
            let answer = self.answers.recv_timeout(PATIENCE).expect("an answer from the browser");
            if answer["id"] == self.last {
                assert!(answer.get("error").is_none(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.note(&answer);
        }
    }

    fn note(&mut self, event: &Value) {
        let parameters = &event["params"];
        match event["method"].as_str() {
            Some("Page.loadEventFired") => self.loaded = true,
            Some("Network.requestWillBeSent") => {
                self.requests.push(parameters["request"]["url"].as_str().unwrap_or_default().to_owned());
            }
            Some("Runtime.exceptionThrown") => {
                self.complaints.push(parameters["exceptionDetails"].to_string());
            }
            Some("Runtime.consoleAPICalled")
                if matches!(parameters["type"].as_str(), Some("error" | "assert")) =>
            {
                self.complaints.push(parameters["args"].to_string());
            }
            Some("Log.entryAdded") if parameters["entry"]["level"] == "error" => {
                self.complaints.push(parameters["entry"].to_string());
            }
            _ => {}
        }
    }

    /// Opens a file and waits until the page says that it is drawn.
    pub(crate) fn open(&mut self, file: &Path) {
        self.loaded = false;
        self.ask("Page.navigate", json!({"url": format!("file://{}", file.display())}));
        while !self.loaded {
            let event = self.answers.recv_timeout(PATIENCE).expect("a loaded page");
            self.note(&event);
        }
        let drawn = self.evaluate(DRAWN);
        assert_eq!(drawn, "yes", "the page did not draw itself: {:?}", self.complaints);
    }

    /// The value of an expression, awaited.
    pub(crate) fn evaluate(&mut self, expression: &str) -> Value {
        let parameters = json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let answer = self.ask("Runtime.evaluate", parameters);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// A picture of the window, or of the whole page, as PNG.
    pub(crate) fn picture(&mut self, whole: bool) -> Vec<u8> {
        let mut parameters = json!({"format": "png", "captureBeyondViewport": whole});
        if whole {
            let size = self.ask("Page.getLayoutMetrics", json!({}))["cssContentSize"].clone();
            parameters["clip"] =
                json!({"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1});
        }
        let answer = self.ask("Page.captureScreenshot", parameters);
        STANDARD.decode(answer["data"].as_str().expect("a picture")).expect("base64")
    }

    /// The page as it is printed, PDF.
    pub(crate) fn print(&mut self) -> Vec<u8> {
        let answer = self.ask("Page.printToPDF", json!({"preferCSSPageSize": true}));
        STANDARD.decode(answer["data"].as_str().expect("a document")).expect("base64")
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
