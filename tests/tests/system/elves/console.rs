//! The boards' consoles: text for a person, frames for a program, and each in its time.

use std::sync::{Arc, LazyLock, Mutex};

use hil_sim_boards::{Terminal, Terminals};
use hil_sim_core::run::recording::Recording;
use protocol::{
    DisplayState, Hello, MAX_FRAME, Message, Peer, Ping, Port, PortCounters, Role, RoleCounters,
    Trip,
};
use tests::elves;
use tests::run::scene;

const MS: u64 = 1_000_000;
const S: u64 = 1_000 * MS;
/// The boards say a line, or a status, a second after their start and then each second; they look after
/// it every 50 ms.
const LOOK_NS: u64 = 50 * MS;
/// When a board speaks first: it starts its tasks by then.
const START_NS: u64 = 100 * MS;
const PING_NS: u64 = S;

/// What is done at a console.
#[derive(Clone, Copy, Debug)]
enum Act {
    /// A person types.
    Type(&'static str),
    /// A program opens the port and says Hello.
    Come,
    /// It says nothing any more; what it hears, it still takes.
    FallSilent,
}

/// What came out of a console.
#[derive(Clone, Debug, Default)]
struct Seen {
    /// Every byte, with its instant.
    bytes: Vec<(u64, u8)>,
    /// What the program heard, and when.
    messages: Vec<(u64, Message)>,
    /// When the program knew the board first, after each time that it had not.
    known_ns: Vec<u64>,
    /// The program's port counted this.
    counters: PortCounters,
}

impl Seen {
    /// The lines of text, each with the instant of its end; frames are left out.
    fn lines(&self) -> Vec<(u64, String)> {
        let pieces = self.bytes.split_inclusive(|&(_, byte)| byte == 0);
        let lines = pieces.filter_map(|piece| {
            let (&(at_ns, _), _) = piece.split_last()?;
            let bytes: Vec<u8> = piece.iter().map(|&(_, byte)| byte).collect();
            let text = String::from_utf8(bytes).ok()?;
            let line = text.strip_suffix("\r\n\0")?;
            line.bytes()
                .all(|byte| matches!(byte, b' '..=b'~'))
                .then(|| (at_ns, line.to_owned()))
        });
        lines.collect()
    }

    /// Those that tell of the surface, a second apart.
    fn statuses(&self) -> Vec<(u64, String)> {
        let mut lines = self.lines();
        lines.retain(|(_, line)| line.starts_with("lambda "));
        lines.retain(|(_, line)| line.contains(" mm/s  age "));
        lines
    }
}

/// Sits at a console and follows a script.
struct Desk {
    /// What is done from when on, in ns.
    script: Vec<(u64, Act)>,
    port: Option<Port>,
    is_silent: bool,
    next_ping_ns: u64,
    seen: Arc<Mutex<Seen>>,
}

impl Desk {
    fn following(script: &[(u64, Act)]) -> (Box<dyn Terminal>, Arc<Mutex<Seen>>) {
        let seen = Arc::new(Mutex::new(Seen::default()));
        let desk = Self {
            script: script.to_vec(),
            port: None,
            is_silent: false,
            next_ping_ns: 0,
            seen: Arc::clone(&seen),
        };
        (Box::new(desk), seen)
    }
}

impl Terminal for Desk {
    fn serve(&mut self, now_ns: u64, sent: &[(u64, u8)]) -> Vec<u8> {
        let mut said = Vec::new();
        while let Some(&(_, act)) = self.script.first().filter(|&&(at_ns, _)| at_ns <= now_ns) {
            self.script.remove(0);
            match act {
                Act::Type(keys) => said.extend_from_slice(keys.as_bytes()),
                Act::Come => {
                    self.port = Some(Port::new(Hello::new(Role::Host, "desk", [0, 1, 0])));
                    self.next_ping_ns = now_ns + PING_NS;
                }
                Act::FallSilent => self.is_silent = true,
            }
        }
        let mut seen = self.seen.lock().unwrap();
        seen.bytes.extend_from_slice(sent);
        let Some(port) = &mut self.port else {
            return said;
        };
        let bytes: Vec<u8> = sent.iter().map(|&(_, byte)| byte).collect();
        let was_known = matches!(port.peer(), Peer::Known(_));
        let messages = &mut seen.messages;
        port.receive(now_ns / 1_000, &bytes, |message| {
            messages.push((now_ns, message));
        });
        if !was_known && matches!(port.peer(), Peer::Known(_)) {
            seen.known_ns.push(now_ns);
        }
        seen.counters = port.counters();
        if now_ns >= self.next_ping_ns {
            self.next_ping_ns = now_ns + PING_NS;
            let sent_us = now_ns / 1_000;
            port.post(&Message::Ping(Ping { sent_us }));
        }
        let mut out = [0; MAX_FRAME];
        loop {
            let count = port.take(&mut out);
            if count == 0 {
                return said;
            }
            if !self.is_silent {
                said.extend_from_slice(&out[..count]);
            }
        }
    }
}

/// A run, and what was seen at the sensor board's console and at the display board's.
struct Watched {
    recording: Recording,
    sensor: Seen,
    display: Seen,
}

fn watch(toml: &str, at_sensor: &[(u64, Act)], at_display: &[(u64, Act)]) -> Watched {
    let scene = scene(&format!(
        "{toml}\n[surface]\nspecimens = [{{ wavelength_mm = 2.0 }}]\n"
    ));
    let (sensor, sensor_seen) = Desk::following(at_sensor);
    let (display, display_seen) = Desk::following(at_display);
    let terminals = Terminals {
        sensor: Some(sensor),
        display: Some(display),
    };
    let (recording, _) = hil_sim_boards::run_at(&scene, elves::both(), terminals)
        .unwrap_or_else(|error| panic!("{error}"));
    let seen = |seen: Arc<Mutex<Seen>>| seen.lock().unwrap().clone();
    Watched {
        recording,
        sensor: seen(sensor_seen),
        display: seen(display_seen),
    }
}

/// A person at each console, who asks for help and types what has no meaning, and at last stops the board.
static PERSON: LazyLock<Watched> = LazyLock::new(|| {
    let keys = [
        (1_500 * MS, Act::Type("?")),
        (1_700 * MS, Act::Type("\u{1b}[A")),
        (1_800 * MS, Act::Type("x")),
        (2_400 * MS, Act::Type("!")),
    ];
    watch("duration_s = 3.2", &keys, &keys)
});

/// The number behind `label` in a line.
fn number(line: &str, label: &str) -> f64 {
    let (_, rest) = line
        .split_once(label)
        .unwrap_or_else(|| panic!("no {label} in {line:?}"));
    let word = rest.split_whitespace().next().unwrap();
    word.parse()
        .unwrap_or_else(|_| panic!("{word} behind {label} in {line:?}"))
}

#[test]
fn a_banner_says_who_it_is_as_soon_as_the_board_is_up() {
    for (seen, role) in [(&PERSON.sensor, "sensor"), (&PERSON.display, "display")] {
        let [major, minor, patch] = elves::both().sensor.hello.version;
        let lines = seen.lines();
        let (at_ns, line) = &lines[0];
        let version = format!("ridgelink {role} {major}.{minor}.{patch}, protocol ");
        assert!(line.starts_with(&version), "{line}");
        assert!(line.ends_with(", started by power: ? for help"), "{line}");
        assert!(*at_ns < START_NS, "{at_ns}");
    }
}

#[test]
fn who_only_looks_on_reads_one_line_a_second_and_not_a_byte_else() {
    for seen in [&PERSON.sensor, &PERSON.display] {
        let text: usize = seen.lines().iter().map(|(_, line)| line.len() + 3).sum();
        assert_eq!(text, seen.bytes.len());
        let statuses = seen.statuses();
        assert_eq!(statuses.len(), 3, "{statuses:?}");
        for (second, (at_ns, line)) in (1..).zip(&statuses) {
            let due_ns = second * S..second * S + START_NS + LOOK_NS;
            assert!(due_ns.contains(at_ns), "{at_ns}: {line}");
            assert!(line.len() <= 80, "{line}");
        }
    }
}

#[test]
fn the_lines_tell_wavelength_velocity_and_age_as_they_are() {
    for (seen, youngest_ms, oldest_ms) in [
        // An estimate every 10 ms, and a motion every 2 ms: 0.5 ms on the wire, up to 3 ms behind other
        // frames, and 1 ms cut off.
        (&PERSON.display, 0.0, 14.0),
        (&PERSON.sensor, 0.0, 6.0),
    ] {
        for (_, line) in seen.statuses() {
            assert!(line.contains(" mm valid "), "{line}");
            assert!((number(&line, "lambda ") - 2.0).abs() < 0.01, "{line}");
            // A count of 5 µm in 2 ms.
            assert!((number(&line, " v ") - 50.0).abs() <= 2.5, "{line}");
            let age_ms = number(&line, " age ");
            assert!((youngest_ms..=oldest_ms).contains(&age_ms), "{line}");
            // A reason takes the counters' place.
            let counted = line.contains(" ms  lost 0 bad 0 miss 0  ");
            assert_eq!(counted, !line.contains(" stopped: "), "{line}");
        }
    }
    for (_, line) in &PERSON.sensor.statuses()[..2] {
        assert!(line.ends_with("  gauges ok"), "{line}");
    }
    let states: Vec<_> = PERSON.display.statuses();
    assert!(states[0].1.ends_with("  driving"), "{states:?}");
    assert!(states[1].1.ends_with("  driving"), "{states:?}");
}

#[test]
fn a_question_mark_gets_help_and_nonsense_a_hint() {
    for (seen, help) in [
        (&PERSON.sensor, firmware_sensor::line::HELP),
        (&PERSON.display, firmware_display::line::HELP),
    ] {
        let lines = seen.lines();
        // The key, the quiet behind it, the look, the text.
        let due_ns = 1_500 * MS..1_500 * MS + 2 * LOOK_NS + 20 * MS;
        let answer: Vec<&str> = lines
            .iter()
            .filter(|(at_ns, _)| due_ns.contains(at_ns))
            .map(|(_, line)| line.as_str())
            .collect();
        assert!(answer[0].starts_with("ridgelink "), "{answer:?}");
        assert_eq!(answer[1..], help);
        let hints = lines
            .iter()
            .filter(|(_, line)| line == "? for help")
            .count();
        assert_eq!(hints, 1, "for the x, and none for the arrow: {lines:?}");
    }
}

#[test]
fn an_exclamation_mark_stops_the_board_and_the_lines_say_so() {
    let said = |seen: &Seen, wanted: &str| {
        let lines = seen.lines();
        lines.iter().any(|(_, line)| line == wanted)
    };
    assert!(said(&PERSON.display, firmware_display::line::STOPPING));
    assert!(said(&PERSON.sensor, firmware_sensor::line::STOPPING));
    let last = PERSON.display.statuses().pop().unwrap();
    assert!(last.1.ends_with("  stopped: by the operator"), "{last:?}");
    let last = PERSON.sensor.statuses().pop().unwrap();
    let end = "  arm stopped: by the operator";
    assert!(last.1.ends_with(end), "{last:?}");
    let RoleCounters::Display(counters) = PERSON.recording.display_status.unwrap().role else {
        panic!("{:?}", PERSON.recording.display_status);
    };
    assert_eq!(counters.state, DisplayState::Stopped(Trip::Operator));
}

#[test]
fn text_and_keys_leave_no_trace_in_the_counters() {
    for status in [
        PERSON.recording.sensor_status.unwrap(),
        PERSON.recording.display_status.unwrap(),
    ] {
        assert_eq!(status.console, PortCounters::new());
    }
}

const CAME_NS: u64 = 800 * MS;
/// The program's last word is its first ping.
const LAST_WORD_NS: u64 = CAME_NS + PING_NS;
const SILENT_NS: u64 = LAST_WORD_NS + 100 * MS;

/// A key, and 20 ms behind it a program that says something for a second.
static PROGRAM: LazyLock<Watched> = LazyLock::new(|| {
    let script = [
        (CAME_NS - 20 * MS, Act::Type("x")),
        (CAME_NS, Act::Come),
        (SILENT_NS, Act::FallSilent),
    ];
    watch("duration_s = 8.2", &script, &script)
});

#[test]
fn a_hello_is_answered_within_milliseconds_although_a_key_was_typed_before() {
    for seen in [&PROGRAM.sensor, &PROGRAM.display] {
        // To the board and back: two quanta, two Hellos of 0.5 ms each, a hint on its way before.
        let took_ns = seen.known_ns[0] - CAME_NS;
        assert!(took_ns <= 5 * MS, "{took_ns}");
    }
}

#[test]
fn while_a_program_listens_the_port_speaks_frames_only() {
    // Estimates and textures; motions.
    for (seen, frames_per_s) in [(&PROGRAM.sensor, 120), (&PROGRAM.display, 500)] {
        let frames = CAME_NS + 5 * MS..LAST_WORD_NS + 5 * S;
        let lines = seen.lines();
        let line = lines.iter().find(|(at_ns, _)| frames.contains(at_ns));
        assert_eq!(line, None);
        let heard = seen
            .messages
            .iter()
            .filter(|(at_ns, _)| frames.contains(at_ns))
            .count();
        let due = frames_per_s * (frames.end - frames.start) as usize / S as usize;
        assert!((due - 10..due + 20).contains(&heard), "{heard} of {due}");
        let counters = seen.counters;
        assert_eq!(
            (counters.lost, counters.corrupt, counters.late),
            (0, 0, 0),
            "{counters:?}"
        );
        assert_eq!(counters.unheralded, 0, "{counters:?}");
    }
}

#[test]
fn five_seconds_after_the_program_fell_silent_a_line_a_second_comes_again() {
    for seen in [&PROGRAM.sensor, &PROGRAM.display] {
        let mut back = seen.statuses();
        back.retain(|&(at_ns, _)| at_ns > SILENT_NS);
        let silence_ns = LAST_WORD_NS + 5 * S;
        // The board looks after it, and speaks on its next second.
        let due_ns = silence_ns..silence_ns + LOOK_NS + S + START_NS;
        let (at_ns, line) = &back[0];
        assert!(due_ns.contains(at_ns), "{at_ns}: {line}");
        assert!(number(line, "lambda ") > 1.9, "{line}");
        let frames = seen
            .messages
            .iter()
            .filter(|(heard_ns, _)| heard_ns > at_ns);
        assert_eq!(frames.count(), 0);
        assert!(matches!(back.len(), 1 | 2), "{back:?}");
    }
}

#[test]
fn a_program_is_back_in_frames_at_once_when_the_watchdog_has_restarted_the_board() {
    let come = [(200 * MS, Act::Come)];
    let watched = watch(
        "duration_s = 2.9\n[[fault]]\nat_s = 1.0\nkind = \"panic\"\n",
        &[],
        &come,
    );
    let seen = &watched.display;
    let [reset] = watched.recording.signs.resets[..] else {
        panic!("one reset, not {:?}", watched.recording.signs.resets);
    };
    let [first_ns, again_ns] = seen.known_ns[..] else {
        panic!("known twice, not at {:?}", seen.known_ns);
    };
    assert!(first_ns < 205 * MS);
    let lines = seen.lines();
    let banner = lines.iter().find(|&&(at_ns, _)| at_ns > reset.at_ns);
    let (banner_ns, banner) = banner.expect("the board is up again");
    assert!(
        banner.ends_with(", started by watchdog, watchdog 1: ? for help"),
        "{banner}"
    );
    // The banner's end, the Hello, the answer.
    assert!(*banner_ns < reset.at_ns + START_NS, "{banner_ns}");
    assert!(
        again_ns < banner_ns + 5 * MS,
        "{again_ns} after {banner_ns}"
    );
    let state = seen
        .messages
        .iter()
        .rev()
        .find_map(|(_, message)| match message {
            Message::Status(status) => Some(status.role),
            _ => None,
        });
    let Some(RoleCounters::Display(counters)) = state else {
        panic!("no status: {state:?}");
    };
    assert_eq!(counters.state, DisplayState::Stopped(Trip::Panic));
    let counters = seen.counters;
    assert_eq!(
        (counters.lost, counters.late, counters.unheralded),
        (0, 0, 0),
        "{counters:?}"
    );
}
