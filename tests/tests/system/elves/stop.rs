//! A Stop, said to either board by whoever it is: 0 V, the arm stands still, and the board says so.

use std::sync::{Arc, LazyLock, Mutex};

use hil_sim_boards::{QUANTUM_NS, Terminal, Terminals};
use hil_sim_core::link::impairments::BYTE_NS;
use hil_sim_core::run::recording::{Recording, volts};
use protocol::{
    DisplayState, Hello, MAX_FRAME, Message, Peer, Port, Receiver, ResetCause, Role, RoleCounters,
    Stop, StopReason, Trip, frame, receiver,
};
use tests::elves;
use tests::run::scene;

const MS: u64 = 1_000_000;
/// When somebody begins to speak: the display drives by then.
const SAID_NS: u64 = 1_200 * MS;
/// Within which outputs and drive are off.
const LIMIT_NS: u64 = 5 * MS;
/// A Stop to a board is passed on to the other one: its own 5 ms twice, a frame of 0.2 ms behind a burst of
/// 256 bytes, 2.8 ms, that is on its way already.
const PASSED_ON_NS: u64 = 2 * LIMIT_NS + 3 * MS;
const SPEED_MM_S: f64 = 60.0;
const LAG_S: f64 = 0.010;

/// What the stranger at the console says, from [`SAID_NS`] on.
#[derive(Clone, Copy, Debug)]
enum Speech {
    /// A Stop, and nothing else ever.
    StopAlone,
    /// The Hello of another version, and then a Stop.
    Foreign,
    /// Bytes at the line's full speed without an end, a Stop in their middle.
    Garbage,
    /// A person's key.
    Key,
}

const SPEECHES: [Speech; 4] = [
    Speech::StopAlone,
    Speech::Foreign,
    Speech::Garbage,
    Speech::Key,
];

/// What a Stop's frame is in every version; numbered as the first of somebody who says nothing else.
fn stop_frame() -> Vec<u8> {
    let mut out = [0; MAX_FRAME];
    let frame = frame::encode_payload(0, b"\0STOP\0", &mut out).unwrap();
    [&[0], frame].concat()
}

/// The bytes, and how many of them there are up to the Stop's last.
fn bytes(speech: Speech) -> (Vec<u8>, usize) {
    let stop = stop_frame();
    match speech {
        Speech::StopAlone => (stop.clone(), stop.len()),
        Speech::Key => (b"!".to_vec(), 1),
        Speech::Foreign => {
            let mut hello = Hello::new(Role::Host, "later", [9, 9, 9]);
            hello.protocol = 0xBEEF_u16.to_le_bytes();
            let mut port = Port::new(hello);
            port.poll(0);
            let mut said = [0; MAX_FRAME];
            let count = port.take(&mut said);
            let all = [&said[..count], &stop].concat();
            let length = all.len();
            (all, length)
        }
        Speech::Garbage => {
            let garbage = |count: u32| -> Vec<u8> {
                // Any bytes but the one that ends a frame.
                (0..count)
                    .map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8 | 1)
                    .collect()
            };
            let before = [garbage(3_000), stop].concat();
            let length = before.len();
            ([before, garbage(3_000)].concat(), length)
        }
    }
}

/// What was seen at a console.
#[derive(Default)]
struct Seen {
    /// When the last byte of the Stop was on the wire.
    stop_ns: u64,
    receiver: Receiver,
    /// The messages that anybody understands, and when they came.
    heard: Vec<(u64, Message)>,
}

/// Says its bytes at the line's speed.
struct Stranger {
    bytes: Vec<u8>,
    until_stop: usize,
    said: usize,
    seen: Arc<Mutex<Seen>>,
}

impl Terminal for Stranger {
    fn serve(&mut self, now_ns: u64, sent: &[(u64, u8)]) -> Vec<u8> {
        let mut seen = self.seen.lock().unwrap();
        for &(at_ns, byte) in sent {
            let Seen {
                receiver, heard, ..
            } = &mut *seen;
            receiver.receive(&[byte], |event| {
                if let receiver::Event::Message(message) = event {
                    heard.push((at_ns, message));
                }
            });
        }
        let due = (now_ns.saturating_sub(SAID_NS) / BYTE_NS) as usize;
        let until = due.clamp(self.said, self.bytes.len());
        let bytes = self.bytes[self.said..until].to_vec();
        if self.said < self.until_stop && until >= self.until_stop {
            seen.stop_ns = now_ns;
        }
        self.said = until;
        bytes
    }
}

/// A run in which a stranger at the console of `told` stops the pair.
struct Stopped {
    speech: Speech,
    told: Role,
    recording: Recording,
    stop_ns: u64,
    heard: Vec<(u64, Message)>,
    peer: Peer,
}

impl Stopped {
    fn by(speech: Speech, told: Role) -> Self {
        Self::amid(speech, told, 1.8, "")
    }

    /// The same in a run with `faults`, in a scene's words.
    fn amid(speech: Speech, told: Role, duration_s: f64, faults: &str) -> Self {
        let scene = scene(&format!(
            r#"
            duration_s = {duration_s}

            [surface]
            specimens = [{{ wavelength_mm = 2.0 }}]

            [motion]
            kind = "constant"
            speed_mm_s = {SPEED_MM_S}

            [arm]
            follows = "link"
            lag_ms = {}

            {faults}
            "#,
            LAG_S * 1e3
        ));
        let seen = Arc::new(Mutex::new(Seen::default()));
        let (bytes, until_stop) = bytes(speech);
        let stranger: Box<dyn Terminal> = Box::new(Stranger {
            bytes,
            until_stop,
            said: 0,
            seen: Arc::clone(&seen),
        });
        let terminals = match told {
            Role::Sensor => Terminals {
                sensor: Some(stranger),
                ..Terminals::default()
            },
            _ => Terminals {
                display: Some(stranger),
                ..Terminals::default()
            },
        };
        let (recording, _) = hil_sim_boards::run_at(&scene, elves::both(), terminals)
            .unwrap_or_else(|error| panic!("{error}"));
        let seen = std::mem::take(&mut *seen.lock().unwrap());
        Self {
            speech,
            told,
            recording,
            stop_ns: seen.stop_ns,
            heard: seen.heard,
            peer: seen.receiver.peer(),
        }
    }

    /// How long the board of `role` may take. A key is one only when the line has been quiet for 50 ms, and is
    /// looked for every 50 ms.
    fn limit_ns(&self, role: Role) -> u64 {
        let own = if self.told == role {
            LIMIT_NS
        } else {
            PASSED_ON_NS
        };
        match self.speech {
            Speech::Key => own + 100 * MS,
            _ => own + QUANTUM_NS,
        }
    }

    fn position_mm(&self, at_ns: u64) -> f64 {
        let scans = &self.recording.scans;
        let scan = scans.iter().find(|scan| scan.at_ns >= at_ns);
        scan.or(scans.last()).unwrap().position_mm
    }
}

static RUNS: LazyLock<Vec<Stopped>> = LazyLock::new(|| {
    let mut runs = Vec::new();
    for told in [Role::Display, Role::Sensor] {
        runs.extend(SPEECHES.map(|speech| Stopped::by(speech, told)));
    }
    runs
});

#[test]
fn the_outputs_are_at_0_v_within_5_ms_of_the_stops_last_byte_and_stay_there() {
    for run in &*RUNS {
        let what = (run.speech, run.told);
        assert!(run.stop_ns >= SAID_NS, "{what:?}: not said");
        let outputs = &run.recording.outputs;
        let sounding = |ns: std::ops::Range<u64>| {
            let mut within = outputs.iter().filter(|output| ns.contains(&output.at_ns));
            within.any(|output| output.words.iter().any(|&word| volts(word) != 0.0))
        };
        assert!(
            sounding(run.stop_ns - 50 * MS..run.stop_ns),
            "{what:?}: it drives before"
        );
        let by_ns = run.stop_ns + run.limit_ns(Role::Display);
        let last = outputs.iter().rfind(|output| output.at_ns <= by_ns);
        let last = last.unwrap();
        assert!(
            last.words.iter().all(|&word| volts(word) == 0.0),
            "{what:?}: {last:?}"
        );
        assert!(!sounding(by_ns..u64::MAX), "{what:?}");
        let Some(RoleCounters::Display(display)) =
            run.recording.display_status.map(|status| status.role)
        else {
            panic!("{what:?}: no status");
        };
        // The last status may be of the second before.
        assert!(matches!(
            display.state,
            DisplayState::Driving | DisplayState::Stopped(Trip::Operator)
        ));
    }
}

#[test]
fn the_arm_stands_still_within_5_ms_of_the_stops_last_byte_and_stays_there() {
    for run in &*RUNS {
        let what = (run.speech, run.told);
        let before_mm = run.position_mm(run.stop_ns - 50 * MS);
        let at_mm = run.position_mm(run.stop_ns);
        assert!(
            at_mm - before_mm > 0.8 * SPEED_MM_S * 0.05,
            "{what:?}: it moves before"
        );
        // What it does with the drive on, and what its lag makes of the speed that it had, at most a fifth
        // above the hand's while it catches up.
        let limit_s = run.limit_ns(Role::Sensor) as f64 * 1e-9;
        let end_mm = run.position_mm(u64::MAX);
        let most_mm = 1.2 * SPEED_MM_S * (limit_s + LAG_S);
        assert!(
            (0.0..=most_mm).contains(&(end_mm - at_mm)),
            "{what:?}: {} mm after the Stop, bound {most_mm} mm",
            end_mm - at_mm
        );
        // Ten lags later nothing moves, though the hand does for another 0.3 s.
        let settled_ns = run.stop_ns + run.limit_ns(Role::Sensor) + (10e9 * LAG_S) as u64;
        let crept_mm = end_mm - run.position_mm(settled_ns);
        assert!(crept_mm.abs() < 0.01, "{what:?}: {crept_mm} mm");
        let estimates = run.recording.estimates.iter();
        let after = estimates.filter(|estimate| estimate.made_ns > run.stop_ns);
        assert!(after.count() >= 30, "{what:?}: estimates go on");
    }
}

#[test]
fn the_board_answers_on_the_port_that_the_stop_came_by_whoever_said_it() {
    for run in &*RUNS {
        let what = (run.speech, run.told);
        let mut stopped = run
            .heard
            .iter()
            .filter_map(|(at_ns, message)| match message {
                Message::Stopped(stopped) => Some((*at_ns, stopped.trip())),
                _ => None,
            });
        if matches!(run.speech, Speech::Key) {
            // A person is told in words.
            assert_eq!(stopped.next(), None);
            continue;
        }
        let (at_ns, trip) = stopped.next().expect("an answer");
        assert_eq!(trip, Some(Trip::Operator), "{what:?}");
        // Not before the outputs are off: the next tick, or the next millisecond; and what is said before
        // it takes its time.
        let since_ns = at_ns - run.stop_ns;
        assert!(
            since_ns <= run.limit_ns(run.told) + 5 * MS,
            "{what:?}: {since_ns}"
        );
        assert_eq!(stopped.next(), None, "{what:?}: one answer to one Stop");
        if matches!(run.speech, Speech::StopAlone) {
            // Nobody has said Hello but, at the most, the board.
            assert!(!matches!(run.peer, Peer::Foreign(_)));
        }
    }
}

#[test]
fn a_stop_is_the_same_bytes_whoever_makes_it() {
    let mut port = Port::new(Hello::new(Role::Host, "test", [0, 0, 0]));
    port.post(&Message::Stop(Stop {
        reason: StopReason::Operator,
    }));
    let mut said = [0; MAX_FRAME];
    let count = port.take(&mut said);
    assert_eq!(said[..count], stop_frame());
}

#[test]
fn a_stop_that_the_link_loses_is_said_again_until_the_other_board_has_stopped_too() {
    const BACK_NS: u64 = 1_400 * MS;
    const AGAIN_NS: u64 = 50 * MS;
    let down = "[[fault]]\nat_s = 1.19\nkind = \"link-down\"\nfor_s = 0.21";
    let by_ns = BACK_NS + AGAIN_NS + PASSED_ON_NS;
    for told in [Role::Display, Role::Sensor] {
        let run = Stopped::amid(Speech::StopAlone, told, 2.6, down);
        let outputs = &run.recording.outputs;
        let sounding = |ns: std::ops::Range<u64>| {
            let mut within = outputs.iter().filter(|output| ns.contains(&output.at_ns));
            within.any(|output| output.words.iter().any(|&word| volts(word) != 0.0))
        };
        // The link is down for less time than an estimate is held: only the Stop ends the stimulus.
        let is_lost = sounding(run.stop_ns + LIMIT_NS + QUANTUM_NS..BACK_NS);
        assert_eq!(is_lost, told == Role::Sensor, "{told:?}: lost on its way");
        assert!(!sounding(by_ns..u64::MAX), "{told:?}: 0 V for good");
        let end_mm = run.position_mm(u64::MAX);
        let crept_mm = end_mm - run.position_mm(by_ns + (10e9 * LAG_S) as u64);
        assert!(crept_mm.abs() < 0.01, "{told:?}: {crept_mm} mm");
        let [sensor, display] = [run.recording.sensor_status, run.recording.display_status]
            .map(|status| status.map(|status| status.role));
        assert!(
            matches!(sensor, Some(RoleCounters::Sensor(sensor)) if sensor.stopped == Some(Trip::Operator)),
            "{told:?}: {sensor:?}"
        );
        assert!(
            matches!(display, Some(RoleCounters::Display(display))
                if display.state == DisplayState::Stopped(Trip::Operator)),
            "{told:?}: {display:?}"
        );
    }
}

#[test]
fn an_arm_that_was_stopped_stays_so_when_the_watchdog_restarts_its_board() {
    let hang = "[[fault]]\nat_s = 1.4\nkind = \"sensor-hang\"";
    // Told by the display alone, the sensor's board is stopped by its word, and keeps that as well.
    for told in [Role::Sensor, Role::Display] {
        let run = Stopped::amid(Speech::StopAlone, told, 3.4, hang);
        let [reset] = run.recording.signs.resets[..] else {
            panic!("one reset, not {:?}", run.recording.signs.resets);
        };
        assert!(reset.at_ns > 1_400 * MS, "{reset:?}");
        let settled_ns = run.stop_ns + run.limit_ns(Role::Sensor) + (10e9 * LAG_S) as u64;
        let crept_mm = run.position_mm(u64::MAX) - run.position_mm(settled_ns);
        assert!(crept_mm.abs() < 0.01, "{told:?}: {crept_mm} mm");
        // It is up again, hears the hand, and knows why it does not follow.
        let status = run.recording.sensor_status.expect("it says how it is");
        assert_eq!(status.reset, ResetCause::Watchdog, "{told:?}");
        assert!(status.peer.received > 0, "{told:?}: it hears the display");
        assert!(
            matches!(status.role, RoleCounters::Sensor(sensor) if sensor.stopped == Some(Trip::Operator)),
            "{told:?}: {:?}",
            status.role
        );
    }
}

#[test]
fn the_arm_is_stopped_also_while_no_scans_come_and_stays_so_after_the_restart() {
    const STOPPED_NS: u64 = 1_150 * MS;
    let adc = "[[fault]]\nat_s = 1.15\nkind = \"adc-stopped\"";
    for (speech, told) in [
        (Speech::StopAlone, Role::Sensor),
        (Speech::Key, Role::Sensor),
        (Speech::StopAlone, Role::Display),
    ] {
        let what = (speech, told);
        let run = Stopped::amid(speech, told, 3.0, adc);
        let [reset] = run.recording.signs.resets[..] else {
            panic!("{what:?}: one reset, not {:?}", run.recording.signs.resets);
        };
        assert!(
            reset.at_ns > run.stop_ns + run.limit_ns(Role::Sensor),
            "{what:?}: the Stop is heard before the watchdog acts, {reset:?}"
        );
        // Where the arm goes while nothing is sampled shows in where it is afterwards.
        let scans = &run.recording.scans;
        let last = scans.iter().rfind(|scan| scan.at_ns < STOPPED_NS).unwrap();
        let driven_ns = run.stop_ns + run.limit_ns(Role::Sensor) - last.at_ns;
        let most_mm = 1.2 * SPEED_MM_S * (driven_ns as f64 * 1e-9 + LAG_S);
        let gone_mm = run.position_mm(u64::MAX) - last.position_mm;
        assert!(
            (0.0..=most_mm).contains(&gone_mm),
            "{what:?}: {gone_mm} mm, bound {most_mm} mm"
        );
        let status = run.recording.sensor_status.expect("it says how it is");
        assert_eq!(status.reset, ResetCause::Watchdog, "{what:?}");
        assert!(
            matches!(status.role, RoleCounters::Sensor(sensor) if sensor.stopped == Some(Trip::Operator)),
            "{what:?}: {:?}",
            status.role
        );
        // Whoever says a Stop is told at once, not by the restarted board.
        let mut stopped = run.heard.iter().filter_map(|(at_ns, message)| {
            matches!(message, Message::Stopped(_)).then_some(*at_ns)
        });
        match speech {
            Speech::Key => assert_eq!(stopped.next(), None, "{what:?}: told in words"),
            _ => {
                let at_ns = stopped.next().expect("an answer");
                let since_ns = at_ns - run.stop_ns;
                assert!(
                    since_ns <= run.limit_ns(told) + 5 * MS,
                    "{what:?}: {since_ns}"
                );
            }
        }
    }
}
