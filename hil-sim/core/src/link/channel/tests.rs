//! What arrives of a sensor's frames under each fault of the link.

use protocol::{Event, Hello, MAX_FRAME, Message, Receiver, Role, Sender, StopReason};

use super::*;

/// Frames are 10 ms apart; the fault lasts from 100 to 200 ms.
const PERIOD_NS: u64 = 10_000_000;
const FRAMES: u64 = 40;
const FROM_S: f64 = 0.1;
const FOR_S: f64 = 0.1;

/// What reached the display: messages with their instants, and the counters.
struct Arrived {
    messages: Vec<(u64, Message)>,
    receiver: Receiver,
}

fn arrive(fault: Fault) -> Arrived {
    arrive_during(vec![fault])
}

fn arrive_during(faults: Vec<Fault>) -> Arrived {
    let mut scene = Scene::constant(2.0, 50.0);
    scene.faults = faults;
    let mut way = LinkChannel::new(&scene, Role::Display);
    let mut sender = Sender::new(Hello::new(Role::Sensor, "test", [0, 0, 0]));
    let hello = sender.hello_due(0).unwrap();
    sender.on_greeting(false);
    let forger = Forger::new();
    for n in 0..FRAMES {
        let mut out = [0; MAX_FRAME];
        let message = if n == 0 {
            hello.clone()
        } else {
            Message::Estimate(protocol::Estimate {
                sequence: n as u32,
                ..forger.estimate()
            })
        };
        let frame = sender.encode(&message, &mut out).unwrap();
        for (place, &byte) in frame.iter().enumerate() {
            way.push(n * PERIOD_NS + (place as u64 + 1) * BYTE_NS, byte);
        }
    }
    let mut arrived = Arrived {
        messages: Vec::new(),
        receiver: Receiver::new(),
    };
    let mut last_ns = 0;
    // As an engine does: in steps, and never back.
    for now_ns in (0..=FRAMES * PERIOD_NS + 1_000_000_000).step_by(250_000) {
        while let Some((at_ns, byte)) = way.pop(now_ns) {
            assert!(
                at_ns >= last_ns + BYTE_NS || last_ns == 0,
                "{last_ns} {at_ns}"
            );
            last_ns = at_ns;
            arrived.receiver.receive(&[byte], |event| {
                if let Event::Message(message) = event {
                    arrived.messages.push((at_ns, message));
                }
            });
        }
    }
    arrived
}

fn fault(kind: Kind) -> Fault {
    let mut fault = Fault::new(kind, FROM_S);
    fault.for_s = fault.for_s.map(|_| FOR_S);
    fault
}

fn estimates(arrived: &Arrived) -> Vec<protocol::Estimate> {
    arrived
        .messages
        .iter()
        .filter_map(|(_, message)| match message {
            Message::Estimate(estimate) => Some(*estimate),
            _ => None,
        })
        .collect()
}

#[test]
fn a_link_without_a_fault_of_its_own_carries_everything() {
    let arrived = arrive(fault(Kind::Panic));
    assert_eq!(estimates(&arrived).len() as u64, FRAMES - 1);
}

#[test]
fn a_link_that_is_down_carries_nothing_and_then_everything() {
    let arrived = arrive(fault(Kind::LinkDown));
    assert_eq!(estimates(&arrived).len() as u64, FRAMES - 1 - 10);
    assert_eq!(arrived.receiver.counters().lost, 10);
}

#[test]
fn garbage_is_counted_and_never_taken_for_a_message() {
    let arrived = arrive(fault(Kind::LinkGarbage));
    let counters = arrived.receiver.counters();
    assert!(counters.corrupt + counters.overlong > 20, "{counters:?}");
    assert_eq!(counters.malformed, 0);
    // The frame that the noise ran into may be spoiled, too.
    assert!(estimates(&arrived).len() as u64 >= FRAMES - 1 - 11);
}

#[test]
fn corruption_spoils_frames() {
    let arrived = arrive(fault(Kind::LinkCorrupt));
    assert!(arrived.receiver.counters().corrupt > 3);
    assert!(
        estimates(&arrived)
            .iter()
            .all(|e| e.wavelength_mm == Some(2.0))
    );
}

#[test]
fn corruption_spoils_frames_that_are_numbered_anew_as_well() {
    for renumbers in [Kind::LinkFlood, Kind::SensorSilent, Kind::StopFromPeer] {
        let corrupt = Fault {
            at_s: FROM_S + 1.5 * FOR_S,
            ..fault(Kind::LinkCorrupt)
        };
        let arrived = arrive_during(vec![fault(renumbers), corrupt]);
        let counters = arrived.receiver.counters();
        assert!(counters.corrupt > 3, "{renumbers:?}: {counters:?}");
    }
}

#[test]
fn a_flood_is_of_good_frames_at_line_rate_and_leaves_no_gap_in_their_numbers() {
    let arrived = arrive(fault(Kind::LinkFlood));
    let counters = arrived.receiver.counters();
    let estimates = estimates(&arrived);
    // A frame of an estimate has some 40 bytes: 2 300 a second.
    assert!(estimates.len() > 200, "{}", estimates.len());
    assert!(
        estimates
            .windows(2)
            .all(|two| two[1].sequence > two[0].sequence)
    );
    assert_eq!((counters.late, counters.duplicated), (0, 0), "{counters:?}");
    assert!(counters.lost <= 10, "{counters:?}");
}

#[test]
fn of_two_faults_that_exclude_each_other_the_one_that_began_last_is_done() {
    let later = |kind| Fault {
        at_s: FROM_S + 0.5 * FOR_S,
        ..fault(kind)
    };
    let arrived = arrive_during(vec![fault(Kind::LinkGarbage), later(Kind::LinkFlood)]);
    let flooded_ms = arrived.messages.iter().map(|(at_ns, _)| at_ns / 1_000_000);
    let at_once = flooded_ms.filter(|ms| (150..200).contains(ms)).count();
    assert!(at_once > 80, "{at_once}");
    let arrived = arrive_during(vec![
        fault(Kind::EstimateOutOfRange),
        later(Kind::EstimateNan),
    ]);
    let estimates = estimates(&arrived);
    let are_none = |e: &&protocol::Estimate| e.wavelength_mm.is_some_and(f32::is_nan);
    assert_eq!(estimates.iter().filter(are_none).count(), 10);
}

#[test]
fn replayed_frames_have_been_there_before() {
    let mut replay = fault(Kind::LinkReplay);
    replay.values[0] = 50.0;
    let arrived = arrive(replay);
    let counters = arrived.receiver.counters();
    assert_eq!(counters.late + counters.duplicated, 10, "{counters:?}");
}

#[test]
fn late_frames_come_late_and_are_overtaken() {
    let mut late = fault(Kind::LinkLate);
    late.values[0] = 150.0;
    let arrived = arrive(late);
    let counters = arrived.receiver.counters();
    assert!(counters.late >= 5, "{counters:?}");
    assert_eq!(counters.corrupt, 0, "{counters:?}");
}

#[test]
fn a_break_is_zeros_that_are_no_frames() {
    let arrived = arrive(fault(Kind::WireStuckLow));
    let counters = arrived.receiver.counters();
    assert!(
        counters.corrupt <= 1 && counters.overlong == 0,
        "{counters:?}"
    );
    assert!(estimates(&arrived).len() as u64 >= FRAMES - 1 - 11);
}

#[test]
fn forged_estimates_have_the_right_crc_and_the_wrong_content() {
    for (kind, is_forged) in [
        (
            Kind::EstimateOutOfRange,
            (|e| e.valid && e.wavelength_mm == Some(1_000.0)) as fn(&protocol::Estimate) -> bool,
        ),
        (Kind::EstimateNan, |e| {
            e.wavelength_mm.is_some_and(f32::is_nan) && e.confidence.is_nan()
        }),
        (Kind::EstimateJumping, |e| e.wavelength_mm != Some(2.0)),
        (Kind::EstimateContradictory, |e| {
            e.valid && e.wavelength_mm.is_none() && e.gauges_used == 0
        }),
    ] {
        let arrived = arrive(fault(kind));
        let estimates = estimates(&arrived);
        assert_eq!(estimates.len() as u64, FRAMES - 1, "{kind:?}");
        let forged = estimates.iter().filter(|estimate| is_forged(estimate));
        assert_eq!(forged.count(), 10, "{kind:?}");
        assert_eq!(arrived.receiver.counters().corrupt, 0);
    }
}

#[test]
fn a_jumping_wavelength_is_never_confirmed_by_the_next() {
    let arrived = arrive(fault(Kind::EstimateJumping));
    let jumped: Vec<f32> = estimates(&arrived)
        .iter()
        .filter_map(|estimate| estimate.wavelength_mm)
        .filter(|&mm| mm != 2.0)
        .collect();
    assert!(
        jumped
            .windows(2)
            .all(|two| (two[1] / two[0]).ln().abs() > 2.0)
    );
}

#[test]
fn a_silent_sensor_leaves_no_gap() {
    let arrived = arrive(fault(Kind::SensorSilent));
    assert_eq!(estimates(&arrived).len() as u64, FRAMES - 1 - 10);
    assert_eq!(arrived.receiver.counters().lost, 0);
}

#[test]
fn a_stop_comes_between_two_frames_and_none_is_lost() {
    // In the middle of a frame.
    let mut stop = fault(Kind::StopFromPeer);
    stop.at_s = FROM_S + 10.0 * BYTE_NS as f64 * 1e-9;
    let arrived = arrive(stop);
    let stops: Vec<u64> = arrived
        .messages
        .iter()
        .filter(|(_, message)| {
            matches!(message, Message::Stop(stop) if stop.reason == StopReason::Host)
        })
        .map(|&(at_ns, _)| at_ns)
        .collect();
    assert_eq!(stops.len(), 1);
    assert!(stops[0].abs_diff(stop.begins_ns()) < 1_000_000, "{stops:?}");
    let counters = arrived.receiver.counters();
    assert_eq!((counters.lost, counters.corrupt, counters.late), (0, 0, 0));
    assert_eq!(estimates(&arrived).len() as u64, FRAMES - 1);
}

/// A Stop at 150 ms, in the middle of a fault: when it has come, in ms.
fn stop_during(kind: Kind) -> Option<u64> {
    let stop = Fault::new(Kind::StopFromPeer, 0.15);
    let messages = arrive_during(vec![fault(kind), stop]).messages;
    let is_stop = |(_, message): &&(u64, Message)| matches!(message, Message::Stop(_));
    messages
        .iter()
        .find(is_stop)
        .map(|(at_ns, _)| at_ns / 1_000_000)
}

#[test]
fn a_stop_is_heard_between_what_else_is_said_and_not_where_nothing_arrives() {
    for kind in [Kind::LinkFlood, Kind::LinkGarbage] {
        let stopped_ms = stop_during(kind).unwrap_or_else(|| panic!("{kind:?}"));
        assert!(
            (150..155).contains(&stopped_ms),
            "{kind:?}: {stopped_ms} ms"
        );
    }
    assert_eq!(stop_during(Kind::LinkDown), None);
    assert_eq!(stop_during(Kind::WireStuckLow), None);
}
