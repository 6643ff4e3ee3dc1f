//! `host-bridge live` with the boards' own firmwares at the far side: what Foxglove and a browser see.
#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command};
use std::time::Duration;

use hil_sim_boards::bench::Command as Order;
use protocol::{Arm, ArmState, Message, Role, Trip};
use serde_json::Value;
use tests::bench::{ExclusiveBench, bench, until};
use tests::bridge;
use tests::browser::Browser;
use tests::fake_board::FakeBoard;
use tests::relay::{Relay, free_port};

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

/// The program, and where it shows things.
struct Live {
    child: Child,
    foxglove: String,
    page: String,
}

impl Live {
    fn start(alone: &ExclusiveBench, port: &str) -> Self {
        Self::try_start(alone, port).expect("it says where")
    }

    /// The same; none if one of its ports is taken.
    fn try_start(alone: &ExclusiveBench, port: &str) -> Option<Self> {
        let file = alone.bench.bench_file();
        let file = file.to_str().expect("UTF-8");
        Self::of(&["--port", port, "--bench", file])
    }

    fn of(words: &[&str]) -> Option<Self> {
        let mut child = bridge::command()
            .arg("live")
            .args(words)
            .spawn()
            .expect("the program can be started");
        let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        let mut after = |start: &str| {
            let line = lines.next()?.expect("text");
            let rest = line.strip_prefix(start);
            Some(rest.unwrap_or_else(|| panic!("{line}")).to_owned())
        };
        let (Some(foxglove), Some(page)) = (after("Foxglove: ws://"), after("page: http://"))
        else {
            assert_eq!(child.wait().expect("it ends").code(), Some(2));
            return None;
        };
        Some(Self {
            child,
            foxglove,
            page: page.trim_end_matches('/').to_owned(),
        })
    }

    fn end(mut self) {
        let interrupted = Command::new("kill")
            .args(["-INT", &self.child.id().to_string()])
            .status();
        assert!(interrupted.is_ok_and(|status| status.success()));
        assert_eq!(self.child.wait().expect("it ends").code(), Some(0));
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn steady(name: &str) -> ExclusiveBench {
    bench(name, |options| {
        options.scene = hil_sim_core::scene::Scene::constant(2.0, 50.0);
    })
}

/// What a server answers.
fn answer(address: &str, request: &str) -> String {
    let mut stream = TcpStream::connect(address).expect("it listens");
    stream.set_read_timeout(Some(LIMIT)).expect("above 0");
    stream.write_all(request.as_bytes()).expect("it reads");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("it answers");
    answer
}

/// One frame of a server that masks nothing (RFC 6455, section 5.2): whether it is text, and what it holds.
fn frame(stream: &mut impl Read) -> (bool, Vec<u8>) {
    let mut take = |count: usize| {
        let mut bytes = vec![0; count];
        stream.read_exact(&mut bytes).expect("a whole frame");
        bytes
    };
    let head = take(2);
    let length = match head[1] & 0x7f {
        126 => take(2),
        127 => take(8),
        short => vec![short],
    };
    let length = length
        .into_iter()
        .fold(0_usize, |sum, byte| sum << 8 | usize::from(byte));
    (head[0] & 0x0f == 1, take(length))
}

#[test]
fn foxglove_gets_the_topics_and_the_bytes_of_a_recording() {
    let alone = steady("live-foxglove");
    let live = Live::start(&alone, "0");
    let mut stream = TcpStream::connect(&live.foxglove).expect("it listens");
    stream.set_read_timeout(Some(LIMIT)).expect("above 0");
    let hello = format!(
        "GET / HTTP/1.1\r\nHost: {}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n",
        live.foxglove
    );
    stream.write_all(hello.as_bytes()).expect("it reads");
    let mut reader = BufReader::new(stream.try_clone().expect("a second handle"));
    let mut line = String::new();
    reader.read_line(&mut line).expect("it answers");
    assert!(line.starts_with("HTTP/1.1 101 "), "{line}");
    while reader.read_line(&mut line).expect("headers") > 2 {}
    // It says what there is.
    let mut channels = Vec::new();
    while channels.is_empty() {
        let (is_text, bytes) = frame(&mut reader);
        if is_text {
            let said: Value = serde_json::from_slice(&bytes).expect("JSON");
            if said["op"] == "serverInfo" {
                // Nobody can publish, set or call anything.
                assert_eq!(said["capabilities"], serde_json::json!([]), "{said}");
            }
            if said["op"] == "advertise" {
                channels = said["channels"].as_array().expect("a list").clone();
            }
        }
    }
    let estimate = channels
        .iter()
        .find(|channel| channel["topic"] == "/sensor/estimate")
        .unwrap_or_else(|| panic!("{channels:?}"));
    assert_eq!(estimate["encoding"], "cdr");
    assert_eq!(estimate["schemaName"], "ridgelink_msgs/msg/Estimate");
    let text = estimate["schema"].as_str().expect("a text");
    let definition =
        ros2msg::Definition::parse("ridgelink_msgs/msg/Estimate", text).expect("a definition");
    // It says what is asked for: masked, as a client has to, here with zeros.
    let ask = serde_json::json!({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": estimate["id"]}]});
    let ask = ask.to_string().into_bytes();
    assert!(ask.len() < 126);
    let mut framed = vec![0x81, 0x80 | ask.len() as u8, 0, 0, 0, 0];
    framed.extend(ask);
    stream.write_all(&framed).expect("it reads");
    until("an estimate of 2 mm", || {
        let (is_text, bytes) = frame(&mut reader);
        if is_text || bytes.first() != Some(&1) || bytes[1..5] != 7_u32.to_le_bytes() {
            return None;
        }
        let value = ros2msg::decode(&definition, &bytes[13..]).expect("an estimate");
        let wavelength_mm = value["wavelength_mm"].as_f64()?;
        (value["valid"] == true && (wavelength_mm - 2.0).abs() < 0.05).then_some(())
    });
    live.end();
}

#[test]
fn others_pages_are_not_answered() {
    let alone = steady("live-others");
    let live = Live::start(&alone, "0");
    let of = |first: &str, host: &str, more: &str| {
        let request = format!("{first} HTTP/1.1\r\nHost: {host}\r\n{more}\r\n");
        let answer = answer(&live.page, &request);
        answer.lines().next().unwrap_or_default().to_owned()
    };
    until("outputs that may be driven", || {
        (!alone.bench.outputs().is_clear).then_some(())
    });
    let here = live.page.clone();
    assert_eq!(of("GET /", &here, ""), "HTTP/1.1 200 OK");
    assert_eq!(of("GET /", "evil.example", ""), "HTTP/1.1 403 Forbidden");
    assert_eq!(of("POST /stop", &here, ""), "HTTP/1.1 403 Forbidden");
    assert_eq!(of("GET /stop", &here, ""), "HTTP/1.1 404 Not Found");
    assert_eq!(of("OPTIONS /stop", &here, ""), "HTTP/1.1 404 Not Found");
    // None of that was a Stop.
    assert!(!alone.bench.outputs().is_clear);
    let stop = of("POST /stop", &here, "X-Ridgelink-Stop: 1\r\n");
    assert_eq!(stop, "HTTP/1.1 200 OK");
    until("outputs at 0 V", || {
        alone.bench.outputs().is_clear.then_some(())
    });
    live.end();
}

#[test]
fn the_page_says_who_moves_the_arm() {
    let boards = [Role::Sensor, Role::Display].map(FakeBoard::new);
    let name = format!("live-{}", std::process::id());
    let at = format!("tcp/127.0.0.1:{}", free_port());
    let relay = |role, board: &FakeBoard, end| {
        Relay::bridge(role, board.path(), &[end, &at, "--name", &name])
    };
    let sensor = relay(Role::Sensor, &boards[0], "--listen");
    let display = relay(Role::Display, &boards[1], "--connect");
    let words = [
        "--port",
        "0",
        "--sensor",
        "/dev/null/sensor",
        "--display",
        "/dev/null/display",
    ];
    let live = Live::of(&words).expect("it says where");
    let mut last = 0;
    let mut pictures = std::iter::repeat_with(|| {
        let request = format!(
            "GET /picture/{last} HTTP/1.1\r\nHost: {}\r\n\r\n",
            live.page
        );
        let answer = answer(&live.page, &request);
        let (_, body) = answer.split_once("\r\n\r\n").expect("a body");
        let mut newest: Value = serde_json::from_str(body).expect("JSON");
        last = newest["number"].as_u64().expect("a number");
        newest["picture"].take()
    });
    let mut told = |wanted: &[&str]| {
        let begin = format!("relay of bench {name}: ");
        let is_told = pictures.by_ref().take(2_000).any(|picture| {
            let hands = picture["hands"].as_array().expect("a list");
            let hands = hands
                .iter()
                .filter_map(|hand| hand.as_str()?.strip_prefix(&begin));
            hands.eq(wanted.iter().copied())
        });
        assert!(is_told, "{wanted:?}");
    };
    told(&[
        "the hand here moves the arm at the sensor's site",
        "the hand at the display's site moves the arm here",
    ]);
    drop(sensor);
    told(&["nobody moves the arm by it: the sensor's site: silent"]);
    drop(display);
    told(&[]);
    live.end();
}

#[test]
fn beyond_this_computer_it_listens_only_if_that_is_said() {
    let refused = bridge::run(["live", "--listen", "0.0.0.0"], LIMIT);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        refused.stderr.contains("say --insecure"),
        "{}",
        refused.stderr
    );
}

#[test]
fn the_page_of_one_board_tells_of_its_stop() {
    let Some(browser) = Browser::start(1_024, 1_366, false) else {
        eprintln!("skipped: needs Debian's chromium and chromium-driver");
        return;
    };
    let board = FakeBoard::new(Role::Sensor);
    let port = board.path().to_str().expect("UTF-8");
    let live = Live::of(&["--port", "0", "--sensor", port]).expect("it says where");
    browser.open(&format!("http://{}/", live.page));
    until("the board", || {
        browser
            .text("boards")
            .contains("sensor 0.1.0")
            .then_some(())
    });
    browser.click("#stop");
    until("word of it", || {
        let words = "Stop was said to the sensor";
        browser.text("said").contains(words).then_some(())
    });
    board.say(Message::Arm(Arm {
        instant_us: 1,
        state: ArmState::Stopped(Trip::Operator),
    }));
    until("its end", || {
        let words = "The sensor has stopped: by the operator";
        browser.text("said").contains(words).then_some(())
    });
    live.end();
}

#[test]
fn a_stop_is_said_however_many_tabs_of_one_browser_look_on() {
    let Some(browser) = Browser::start(1_024, 1_366, false) else {
        eprintln!("skipped: needs Debian's chromium and chromium-driver");
        return;
    };
    let board = FakeBoard::new(Role::Sensor);
    let port = board.path().to_str().expect("UTF-8");
    let live = Live::of(&["--port", "0", "--sensor", port]).expect("it says where");
    browser.open(&format!("http://{}/", live.page));
    // More than the connections that a browser has for one place.
    browser.run("window.tabs = Array.from({ length: 9 }, () => window.open(location.href))");
    let looks =
        "return tabs.filter(tab => tab.document.getElementById('boards')?.children.length).length";
    until("six tabs that look on, this one as well", || {
        (browser.run(looks).as_u64() >= Some(5)).then_some(())
    });
    browser.click("#stop");
    until("word of it", || {
        let words = "Stop was said to the sensor";
        browser.text("said").contains(words).then_some(())
    });
    live.end();
}

#[test]
fn the_page_moves_stops_the_boards_and_comes_back() {
    let Some(browser) = Browser::start(1_024, 1_366, false) else {
        eprintln!("skipped: needs Debian's chromium and chromium-driver");
        return;
    };
    let alone = steady("live-page");
    let live = Live::start(&alone, "0");
    browser.open(&format!("http://{}/", live.page));
    // What is seen of the surface, of both velocities, the gauges and the fifty actuators.
    let number = |id: &str| browser.text(id).parse::<f64>().ok();
    until("λ", || {
        let is_right = number("lambda").is_some_and(|mm| (mm - 2.0).abs() < 0.05);
        (is_right && browser.text("valid") == "valid").then_some(())
    });
    until("velocities", || {
        let close = |id| number(id).is_some_and(|mm_s| (mm_s.abs() - 50.0).abs() < 5.0);
        (close("hand") && close("arm")).then_some(())
    });
    until("gauges that move", || {
        let before = browser.text("gauges");
        let moves = before.matches("gauge ").count() == 5 && !before.contains('–');
        (moves && browser.text("gauges") != before).then_some(())
    });
    let circles = browser.run("return document.querySelectorAll('#actuators circle').length");
    assert_eq!(circles, 50);
    until("driving", || {
        browser.text("supervisor").contains("driving").then_some(())
    });
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bridge_live");
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    browser.keep(&folder.join("live-light.png"));
    // Nothing lies beside the window's edge.
    let width = "return document.documentElement.scrollWidth <= window.innerWidth";
    assert_eq!(browser.run(width), true);
    if let Some(dark) = Browser::start(1_024, 1_366, true) {
        dark.open(&format!("http://{}/", live.page));
        until("λ in the dark", || {
            dark.text("valid").eq("valid").then_some(())
        });
        let ground = "return getComputedStyle(document.body).backgroundColor";
        assert_ne!(dark.run(ground), browser.run(ground));
        // Some of the traces are to be seen.
        until("ten seconds", || {
            (dark.run("return seen.length > 150") == true).then_some(())
        });
        dark.keep(&folder.join("live-dark.png"));
    }
    browser.keep(&folder.join("live-light.png"));
    // The boards go and return.
    let order = |order| alone.bench.command(order).expect("it can be done");
    order(Order::Reset(Role::Sensor));
    until("word of it", || {
        browser
            .text("log")
            .contains("has started anew")
            .then_some(())
    });
    until("λ again", || {
        browser.text("valid").eq("valid").then_some(())
    });
    // So does the program.
    live.end();
    until("word of it", || {
        browser.text("said").contains("No connection").then_some(())
    });
    assert_eq!(browser.text("lambda"), "–");
    // The ports beside each other: as a user has them. Another program may just have taken one.
    let live = (0..100)
        .find_map(|_| Live::try_start(&alone, &free_port().to_string()))
        .expect("two ports beside each other are free");
    browser.open(&format!("http://{}/", live.page));
    until("λ again", || {
        browser.text("valid").eq("valid").then_some(())
    });
    assert!(!alone.bench.outputs().is_clear);
    browser.click("#stop");
    until("outputs at 0 V", || {
        alone.bench.outputs().is_clear.then_some(())
    });
    until("word of it", || {
        browser.text("said").contains("has stopped").then_some(())
    });
    until("the reason", || {
        let supervisor = browser.text("supervisor");
        supervisor.contains("by the operator").then_some(())
    });
    live.end();
}
