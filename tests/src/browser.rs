//! A browser without a screen, as its user sees it: Debian's Chromium, driven by its own driver (W3C WebDriver).

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

/// A browser with one page. Dropping it ends it.
pub struct Browser {
    driver: Child,
    port: u16,
    session: String,
}

impl Browser {
    /// Starts one with a window of so many points; none if there is no `chromedriver` on this machine.
    ///
    /// # Panics
    /// If there is one, and it does not start.
    pub fn start(width: u32, height: u32, is_dark: bool) -> Option<Self> {
        let mut driver = Command::new("chromedriver")
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let out = BufReader::new(driver.stdout.take().expect("it is piped"));
        let port = out
            .lines()
            .map_while(Result::ok)
            .find_map(|line| {
                let port = line.split("successfully on port ").nth(1)?;
                port.trim_end_matches('.').parse().ok()
            })
            .expect("chromedriver says its port");
        let mut browser = Self {
            driver,
            port,
            session: String::new(),
        };
        let mut words = vec![
            "--headless=new".to_owned(),
            "--no-sandbox".to_owned(),
            "--disable-gpu".to_owned(),
            "--disable-dev-shm-usage".to_owned(),
            "--hide-scrollbars".to_owned(),
            // Nothing but the page is to be asked for.
            "--no-proxy-server".to_owned(),
            format!("--window-size={width},{height}"),
        ];
        if is_dark {
            words.push("--force-dark-mode".to_owned());
        }
        let wanted = json!({"capabilities": {"alwaysMatch": {
            "browserName": "chrome",
            "goog:chromeOptions": {"args": words},
        }}});
        let begun = browser.ask("POST", "/session", Some(&wanted));
        let session = begun["sessionId"].as_str().expect("a session");
        browser.session = session.to_owned();
        Some(browser)
    }

    /// Opens a page.
    pub fn open(&self, address: &str) {
        self.within("POST", "/url", Some(&json!({"url": address})));
    }

    /// What a function's body gives, in the page.
    pub fn run(&self, script: &str) -> Value {
        let call = json!({"script": script, "args": []});
        self.within("POST", "/execute/sync", Some(&call))
    }

    /// What an element says.
    pub fn text(&self, id: &str) -> String {
        let text = self.run(&format!("return document.getElementById('{id}').innerText"));
        text.as_str().unwrap_or_default().to_owned()
    }

    /// Clicks in the middle of an element, as a hand does.
    pub fn click(&self, css: &str) {
        let found = json!({"using": "css selector", "value": css});
        let found = self.within("POST", "/element", Some(&found));
        let element = found
            .as_object()
            .and_then(|element| element.values().next())
            .and_then(Value::as_str)
            .expect("it is on the page");
        self.within(
            "POST",
            &format!("/element/{element}/click"),
            Some(&json!({})),
        );
    }

    /// What it shows, as PNG.
    ///
    /// # Panics
    /// If it can't be kept there.
    pub fn keep(&self, path: &Path) {
        let picture = self.within("GET", "/screenshot", None);
        let bytes = base64(picture.as_str().unwrap_or_default());
        fs::write(path, bytes).expect("the picture can be written");
    }

    fn within(&self, method: &str, path: &str, body: Option<&Value>) -> Value {
        self.ask(method, &format!("/session/{}{path}", self.session), body)
    }

    fn ask(&self, method: &str, path: &str, body: Option<&Value>) -> Value {
        let body = body.map_or(String::new(), Value::to_string);
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("the driver listens");
        stream.set_read_timeout(Some(LIMIT)).expect("above 0");
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\nConnection: close\r\n\r\n{body}",
            self.port,
            body.len()
        )
        .expect("the driver reads");
        let mut reader = BufReader::new(stream);
        let mut length = 0;
        let mut line = String::new();
        while reader.read_line(&mut line).expect("the driver answers") > 2 {
            let header = line.to_ascii_lowercase();
            if let Some(said) = header.strip_prefix("content-length:") {
                length = said.trim().parse().expect("a length");
            }
            line.clear();
        }
        let mut answer = vec![0; length];
        reader.read_exact(&mut answer).expect("the whole answer");
        let answer: Value = serde_json::from_slice(&answer).expect("JSON");
        let value = answer["value"].clone();
        assert!(value["error"].is_null(), "{method} {path}: {value}");
        value
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        if !self.session.is_empty() && !std::thread::panicking() {
            self.within("DELETE", "", None);
        }
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

/// RFC 4648, section 4.
fn base64(text: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(text.len() * 3 / 4);
    let (mut bits, mut count) = (0_u32, 0);
    for letter in text.bytes() {
        let six = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => continue,
        };
        bits = bits << 6 | u32::from(six);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    bytes
}
