//! Whom a relay refuses, and what it says to whoever starts it wrongly.

use std::collections::BTreeSet;
use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use host_bridge::relay::credentials::Credentials;
use host_bridge::relay::endpoint::Endpoint;
use host_bridge::relay::envelope::{Content, Envelope};
use host_bridge::relay::name::{Channel, Name};
use host_bridge::relay::network::{Ends, Network};
use host_bridge::relay::site::bridge_hello;
use host_bridge::relay::transport::{Connection, Transport};
use protocol::{Hello, Ping, Role};
use tests::bridge;
use tests::certificates::{Authority, Kind};
use tests::fake_board::{FakeBoard, wait_until};
use tests::relay::{Relay, free_port, listen, sequences, talking_board};

/// Between two forged messages: whether they are believed is asked, not what a flood of them does.
const FORGED_EVERY: Duration = Duration::from_millis(20);
/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

fn authority(test: &str) -> Authority {
    Authority::new(Path::new(env!("CARGO_TARGET_TMPDIR")), test)
}

fn start(role: Role, board: &FakeBoard, end: [&str; 2], proofs: &[String]) -> Relay {
    Relay::bridge_with(role, board.path(), end, proofs)
}

#[test]
fn with_certificates_one_worker_both_reads_and_writes_a_connection() {
    let ours = authority("one-thread");
    let [sensor, display] = [Role::Sensor, Role::Display].map(talking_board);
    let at = format!("tls/localhost:{}", free_port());
    let proofs = |whose| ours.proofs(whose, Kind::Good, &ours);
    let listening = start(Role::Sensor, &sensor, ["--listen", &at], &proofs("sensor"));
    let connecting = start(
        Role::Display,
        &display,
        ["--connect", &at],
        &proofs("display"),
    );
    listen(&sensor, LIMIT, |heard| sequences(heard).len() >= 10);
    // zenoh's TLS spoils memory where two do.
    for bridge in [listening, connecting] {
        let threads = bridge.threads();
        let is_there = |name: &str| threads.iter().any(|thread| thread.starts_with(name));
        assert!(is_there("tx-"), "{threads:?}");
        assert!(!is_there("rx-"), "{threads:?}");
    }
}

#[test]
fn with_certificates_of_one_ca_two_sites_meet_and_nobody_else_gets_in() {
    let (ours, theirs) = (authority("ours"), authority("theirs"));
    let sensor = talking_board(Role::Sensor);
    let port = free_port();
    let [tls, quic, tcp, udp] =
        ["tls", "quic", "tcp", "udp"].map(|carrier| format!("{carrier}/localhost:{port}"));
    let good = ours.proofs("sensor", Kind::Good, &ours);
    let listening = start(Role::Sensor, &sensor, ["--listen", &quic], &good);
    listening.says("listening", LIMIT);

    // Strangers: a certificate of another CA, one that believes in another CA, and none at all.
    let stranger = theirs.proofs("display", Kind::Good, &ours);
    let distrustful = ours.proofs("distrustful-display", Kind::Good, &theirs);
    for (at, proofs, words) in [
        (&tls, stranger.clone(), "our certificate is rejected there"),
        (&quic, stranger, "our certificate is rejected there"),
        (
            &tls,
            distrustful.clone(),
            "not made by the CA given with --ca",
        ),
        (&quic, distrustful, "not made by the CA given with --ca"),
        (&tcp, Vec::new(), "nobody there speaks to us"),
        (&udp, Vec::new(), "nobody there speaks to us"),
    ] {
        let board = talking_board(Role::Display);
        let bridge = start(Role::Display, &board, ["--connect", at], &proofs);
        bridge.says(words, LIMIT);
        assert!(sequences(&board.take_heard()).is_empty());
    }
    assert!(
        sequences(&sensor.take_heard()).is_empty(),
        "{}",
        listening.words()
    );

    // Nor do they keep out who belongs there.
    let display = talking_board(Role::Display);
    let good = ours.proofs("display", Kind::Good, &ours);
    let connecting = start(Role::Display, &display, ["--connect", &tls], &good);
    connecting.says("the sensor's site: host-bridge", LIMIT);
    listen(&display, LIMIT, |heard| sequences(heard).len() >= 20);
    listen(&sensor, LIMIT, |heard| sequences(heard).len() >= 100);

    let operator = ours.proofs("operator", Kind::Good, &ours);
    let mut stop = vec!["stop", "--connect", &tls];
    stop.extend(operator.iter().map(String::as_str));
    let (status, _, words) = Relay::start(stop).wait(LIMIT);
    assert_eq!(status.code(), Some(0), "{words}");
}

/// What `proofs` are read for.
fn network(ends: Ends, proofs: &[String]) -> Network {
    let file = |at: usize| PathBuf::from(&proofs[at]);
    let credentials = Credentials {
        ca: file(1),
        certificate: file(3),
        key: file(5),
    };
    let name: Name = "bench".parse().expect("a name");
    Network::new(ends, Some(credentials), vec![name], false).expect("it can connect")
}

#[test]
fn a_certificate_of_the_right_ca_speaks_for_nobody_but_whom_it_names() {
    // A stranger has no name but the engine's, one for each connection.
    assert_forgers_are_refused("tls", "may not speak on any key", 5);
}

#[test]
fn a_certificate_of_the_right_ca_sends_datagrams_for_nobody_but_whom_it_names() {
    // A datagram has the certificate's name with it.
    assert_forgers_are_refused("quic", "REFUSED: other.display may not speak on any key", 6);
}

/// That over `carrier` nobody is believed who speaks for another, and each is named: a stranger in `words`, in
/// `refusals` lines all of them.
fn assert_forgers_are_refused(carrier: &str, stranger: &str, refusals: usize) {
    let ours = authority(&format!("roles-{carrier}"));
    let sensor = talking_board(Role::Sensor);
    let tls = format!("{carrier}/localhost:{}", free_port());
    let good = ours.proofs("sensor", Kind::Good, &ours);
    let listening = start(Role::Sensor, &sensor, ["--listen", &tls], &good);
    listening.says("listening", LIMIT);
    let name: Name = "bench".parse().expect("a name");
    let endpoint: Endpoint = tls.parse().expect("an endpoint");
    // A foreign sensor, an operator, and the display of another bench, each as if it were the display: none is
    // heard, whatever it says, a forged Stopped among it.
    let forgers: Vec<Box<dyn Connection>> = [
        ("foreign-sensor", Kind::Good),
        ("operator", Kind::Good),
        ("display", Kind::OfAnotherBench),
    ]
    .into_iter()
    .map(|(certificate, kind)| {
        let proofs = ours.proofs(certificate, kind, &ours);
        network(Ends::Connecting(vec![endpoint.clone()]), &proofs)
            .connect(&name, Role::Display, Vec::new())
            .expect("the CA lets it in")
    })
    .collect();
    let mut forged = None::<Instant>;
    let mut forge = || {
        if forged.is_some_and(|at| at.elapsed() < FORGED_EVERY) {
            return;
        }
        forged = Some(Instant::now());
        for forger in &forgers {
            forger.publish(Channel::Clock, &ping(bridge_hello(Role::Display)));
            let stopped = Content::Stopped { id: 1, trip: None };
            let content = Envelope {
                content: stopped,
                ..ping(bridge_hello(Role::Display))
            };
            forger.publish(Channel::Stop, &content);
        }
    };
    // Who belongs there is heard all the while.
    let display = talking_board(Role::Display);
    let good = ours.proofs("real-display", Kind::Good, &ours);
    let connecting = start(Role::Display, &display, ["--connect", &tls], &good);
    let mut motions = 0;
    let is_heard = wait_until(LIMIT, || {
        forge();
        motions += sequences(&sensor.take_heard()).len();
        motions >= 200
    });
    assert!(
        is_heard,
        "{motions} motions: {}\n{}\n{}\n{:?}",
        listening.words(),
        connecting.words(),
        listening.lines().join("\n"),
        connecting.lines().last()
    );
    assert!(
        !listening.words().contains("a second bridge"),
        "{}",
        listening.words()
    );
    // Each of them is named, and what it wanted, once; who belongs to no bench here by the engine's name for it.
    for words in [
        "REFUSED: bench.sensor may not speak on ridgelink/bench/display/clock",
        "REFUSED: bench.operator may not speak on ridgelink/bench/display/stop",
        stranger,
    ] {
        assert!(
            wait_until(LIMIT, || {
                forge();
                listening.words().contains(words)
            }),
            "{words}: {}",
            listening.words()
        );
    }
    // On a slow machine a minute passes, and each is named again.
    let words = listening.words();
    let told: BTreeSet<&str> = words
        .lines()
        .filter(|line| line.contains("REFUSED: ") && !line.contains("more of the last minute"))
        .collect();
    assert_eq!(told.len(), refusals, "{words}");
    // Only what the real one has said has come.
    let said = listening.words().matches("the display's site: ").count();
    assert_eq!(said, 1, "{}", listening.words());
}

#[test]
fn listening_beyond_this_computer_without_tls_is_to_be_asked_for() {
    let sensor = talking_board(Role::Sensor);
    let path = sensor.path().to_string_lossy();
    let port = free_port();
    let [at, datagrams] = ["tcp", "udp"].map(|carrier| format!("{carrier}/0.0.0.0:{port}"));
    for (at, safe) in [(&at, "tls/0.0.0.0"), (&datagrams, "quic/0.0.0.0")] {
        assert_refused(
            &["sensor", "--sensor", &path, "--listen", at],
            &[
                "would let anybody who reaches it move the arm",
                safe,
                "--insecure",
            ],
        );
    }
    let bridge = Relay::bridge(
        Role::Sensor,
        sensor.path(),
        &["--listen", &at, "--insecure"],
    );
    bridge.says("INSECURE: whoever reaches", LIMIT);
    bridge.says("listening", LIMIT);
}

#[test]
fn a_router_refuses_strangers_as_well() {
    let (ours, theirs) = (authority("router"), authority("router-theirs"));
    let tls = format!("tls/localhost:{}", free_port());
    let proofs = ours.proofs("router", Kind::Good, &ours);
    let mut arguments = vec!["router", "--listen", &tls];
    arguments.extend(proofs.iter().map(String::as_str));
    let _router = Relay::start(arguments);
    let (sensor, display) = (talking_board(Role::Sensor), talking_board(Role::Display));
    let good = ours.proofs("sensor", Kind::Good, &ours);
    let _inside = start(Role::Sensor, &sensor, ["--connect", &tls], &good);
    let stranger = theirs.proofs("display", Kind::Good, &ours);
    let outside = start(Role::Display, &display, ["--connect", &tls], &stranger);
    outside.says("our certificate is rejected there", LIMIT);
    assert!(sequences(&sensor.take_heard()).is_empty());
    let good = ours.proofs("display", Kind::Good, &ours);
    drop(outside);
    let _inside = start(Role::Display, &display, ["--connect", &tls], &good);
    listen(&sensor, LIMIT, |heard| sequences(heard).len() >= 100);
}

#[test]
fn a_listener_of_another_name_or_without_tls_is_not_believed() {
    let ours = authority("names");
    let board = talking_board(Role::Display);
    let good = ours.proofs("display", Kind::Good, &ours);
    let tls = format!("tls/localhost:{}", free_port());
    let other = ours.proofs("other-sensor", Kind::OfAnotherHost, &ours);
    let sensor = talking_board(Role::Sensor);
    let listening = start(Role::Sensor, &sensor, ["--listen", &tls], &other);
    listening.says("listening", LIMIT);
    let bridge = start(Role::Display, &board, ["--connect", &tls], &good);
    bridge.says("its certificate is not believed", LIMIT);
    assert!(sequences(&sensor.take_heard()).is_empty());
    drop((listening, bridge));

    let tcp = tls.replace("tls", "tcp");
    let listening = start(Role::Sensor, &sensor, ["--listen", &tcp], &[]);
    listening.says("listening", LIMIT);
    let bridge = start(Role::Display, &board, ["--connect", &tls], &good);
    bridge.says("without TLS", LIMIT);
    assert!(sequences(&sensor.take_heard()).is_empty());
}

/// A program that takes part as the display's bridge and says whatever it likes.
fn impostor(port: u16) -> Box<dyn Connection> {
    let endpoint = format!("tcp/127.0.0.1:{port}")
        .parse()
        .expect("an endpoint");
    let network = Network::new(Ends::Connecting(vec![endpoint]), None, Vec::new(), false)
        .expect("it can connect");
    let name: Name = "bench".parse().expect("a name");
    network
        .connect(&name, Role::Display, Vec::new())
        .expect("somebody listens")
}

fn ping(hello: Hello) -> Envelope {
    Envelope {
        hello,
        session: 1,
        counter: 0,
        sent_us: 0,
        content: Content::Ping(Ping { sent_us: 0 }),
    }
}

#[test]
fn a_bridge_of_another_build_is_refused_by_name() {
    let sensor = talking_board(Role::Sensor);
    let port = free_port();
    let at = format!("tcp/127.0.0.1:{port}");
    let bridge = Relay::bridge(Role::Sensor, sensor.path(), &["--listen", &at]);
    bridge.says("listening", LIMIT);
    let impostor = impostor(port);
    let mut hello = bridge_hello(Role::Display);
    hello.protocol = 77_u16.to_le_bytes();
    hello.version = [9, 8, 7];
    let words = "the display's site: host-bridge 9.8.7 speaks protocol 77";
    let named = || {
        impostor.publish(Channel::Clock, &ping(hello));
        bridge.words().contains(words)
    };
    assert!(wait_until(LIMIT, named), "{}", bridge.words());
    assert!(
        bridge
            .words()
            .contains("install the same build at both sites")
    );
    let counted = || {
        bridge
            .lines()
            .iter()
            .any(|line| line.contains("\"far\":\"foreign\""))
    };
    assert!(wait_until(LIMIT, counted), "{:?}", bridge.lines());
}

#[test]
fn nobody_speaks_for_another_role_than_his_own() {
    let sensor = talking_board(Role::Sensor);
    let port = free_port();
    let at = format!("tcp/127.0.0.1:{port}");
    let bridge = Relay::bridge(Role::Sensor, sensor.path(), &["--listen", &at]);
    bridge.says("listening", LIMIT);
    let impostor = impostor(port);
    let refused = || {
        impostor.publish(Channel::Clock, &ping(bridge_hello(Role::Sensor)));
        bridge.lines().last().is_some_and(|line| {
            let report: serde_json::Value = serde_json::from_str(line).expect("JSON");
            report["incoming"]["refused"].as_u64() > Some(10)
        })
    };
    assert!(wait_until(LIMIT, refused), "{:?}", bridge.lines());
    assert!(
        !bridge.words().contains("the display's site: "),
        "{}",
        bridge.words()
    );
}

/// Runs `host-bridge relay` with arguments that can't be used, and checks what it says.
fn assert_refused(arguments: &[&str], words: &[&str]) {
    let arguments = ["relay"].iter().chain(arguments);
    let ended = bridge::run(arguments, LIMIT);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    for word in words {
        assert!(
            ended.stderr.contains(word),
            "{word:?} is not in: {}",
            ended.stderr
        );
    }
    assert!(ended.stdout.is_empty(), "{}", ended.stdout);
}

#[test]
fn whoever_starts_it_wrongly_is_told_what_and_where_and_what_to_do() {
    assert_refused(&["sensor"], &["--listen", "--connect"]);
    assert_refused(&["sensor", "--listen", "7447"], &["tcp/HOST:PORT"]);
    assert_refused(&["display", "--connect", "ws/x:1"], &["tcp/HOST:PORT"]);
    assert_refused(&["sensor", "--listen", "tcp/x:y"], &["no port"]);
    assert_refused(
        &["sensor", "--listen", "tcp/x:1", "--name", "a/b"],
        &["\"a/b\" is no name"],
    );
    for secure in ["tls/localhost:7447", "quic/localhost:7447"] {
        assert_refused(
            &["sensor", "--listen", secure],
            &["wants certificates", "--ca"],
        );
    }
    assert_refused(
        &[
            "router",
            "--listen",
            "tcp/no-such-host.invalid:7447",
            "--insecure",
        ],
        &["no-such-host.invalid", "can't listen"],
    );
    assert_refused(
        &["router", "--listen", "tcp/192.0.2.1:7447", "--insecure"],
        &["192.0.2.1:7447", "no such address", "0.0.0.0"],
    );
    let taken = TcpListener::bind("127.0.0.1:0").expect("the system has ports");
    let at = format!(
        "tcp/127.0.0.1:{}",
        taken.local_addr().expect("an address").port()
    );
    for part in ["sensor", "display", "router"] {
        assert_refused(
            &[part, "--listen", &at],
            &[&at, "another program listens there"],
        );
    }
}

#[test]
fn a_certificate_for_something_else_is_named_where_it_is_given() {
    let ours = authority("owners");
    let tls = format!("tls/localhost:{}", free_port());
    let [sensor, router] = ["sensor", "router"].map(|role| ours.proofs(role, Kind::Good, &ours));
    let other = ours.proofs("other-display", Kind::OfAnotherBench, &ours);
    for (arguments, proofs, words) in [
        (
            &["display", "--connect", &tls][..],
            &sensor,
            ["sensor.pem", "of bench.sensor", "give bench.display's"],
        ),
        (
            &["display", "--connect", &tls],
            &other,
            ["of other.display", "give bench.display's", "--name"],
        ),
        (
            &["router", "--listen", &tls],
            &sensor,
            ["of bench.sensor", "give bench.router's", "--name"],
        ),
        (
            &[
                "router", "--listen", &tls, "--name", "bench", "--name", "lab",
            ],
            &router,
            ["router.pem", "of bench.router", "give lab.router's"],
        ),
    ] {
        let mut arguments = arguments.to_vec();
        arguments.extend(proofs.iter().map(String::as_str));
        assert_refused(&arguments, &words);
    }
    // A Stop is tried all the same.
    let mut stop = vec!["stop", "--connect", &tls, "--within", "1"];
    stop.extend(sensor.iter().map(String::as_str));
    let (status, _, words) = Relay::start(stop).wait(LIMIT);
    assert_eq!(status.code(), Some(1), "{words}");
    for said in ["of bench.sensor", "give bench.operator's", "NOT STOPPED"] {
        assert!(words.contains(said), "{said}: {words}");
    }
}

#[test]
fn credentials_that_cannot_be_used_are_named() {
    let ours = authority("credentials");
    let tls = format!("tls/localhost:{}", free_port());
    let refused = |proofs: &[String], words: &[&str]| {
        let mut arguments = vec!["router", "--listen", &tls];
        arguments.extend(proofs.iter().map(String::as_str));
        assert_refused(&arguments, words);
    };
    let good = ours.proofs("good", Kind::Good, &ours);
    let with = |at: usize, file: &str| {
        let mut proofs = good.clone();
        proofs[at] = ours.file(file);
        proofs
    };
    ours.proofs("other", Kind::Good, &ours);
    fs::write(ours.file("text"), "no PEM\n").expect("it can be written");

    refused(&with(1, "no-such-file"), &["no-such-file", "can't be read"]);
    refused(&with(3, "no-such-file"), &["no-such-file", "can't be read"]);
    refused(&with(5, "no-such-file"), &["no-such-file", "can't be read"]);
    refused(&with(1, "text"), &["text", "BEGIN CERTIFICATE"]);
    refused(&with(3, "good.key"), &["good.key", "BEGIN CERTIFICATE"]);
    refused(&with(5, "good.pem"), &["good.pem", "BEGIN PRIVATE KEY"]);
    refused(
        &with(5, "other.key"),
        &["other.key", "not the key of", "good.pem"],
    );
    let expired = ours.proofs("expired", Kind::Expired, &ours);
    refused(&expired, &["expired.pem", "has expired"]);
    let servers = ours.proofs("servers", Kind::ForServersOnly, &ours);
    refused(&servers, &["servers.pem", "clientAuth"]);

    for (open, safe) in [("tcp", "tls"), ("udp", "quic")] {
        let [open, safe] = [open, safe].map(|carrier| format!("{carrier}/localhost:7447"));
        let mut arguments = vec!["router", "--listen", &open];
        arguments.extend(good.iter().map(String::as_str));
        assert_refused(&arguments, &["let anybody in", &safe]);
    }
}
