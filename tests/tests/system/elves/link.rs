//! What the link does to frames, and what the counters of both ends say of it.

use std::sync::LazyLock;

use protocol::{MAX_FRAME, PortCounters, RoleCounters, Status};
use tests::history;
use tests::run::{Run, scene};

use super::PLAIN;

/// Frames a second: a hundred estimates and a status; 500 motions and a status.
const SENSOR_FRAMES_PER_S: f64 = 101.0;
const DISPLAY_FRAMES_PER_S: f64 = 501.0;

const DELAY_MS: f64 = 40.0;
const JITTER_MS: f64 = 10.0;
const LOSS: f64 = 0.1;
const CORRUPT: f64 = 0.0005;

static WEATHER: LazyLock<Run> = LazyLock::new(|| {
    Run::of(scene(&format!(
        r#"
        seed = 13
        duration_s = 3.2

        [surface]
        specimens = [{{ wavelength_mm = 2.0 }}]

        [motion]
        kind = "sinusoid"
        amplitude_mm_s = 70.0
        frequency_hz = 0.83

        [link]
        delay_ms = {DELAY_MS}
        jitter_ms = {JITTER_MS}
        loss = {LOSS}
        reorder = 0.05
        corrupt = {CORRUPT}
        "#
    )))
});

/// The last statuses of sensor and display.
fn statuses(run: &Run) -> (Status, Status) {
    let recording = &run.recording;
    (
        recording.sensor_status.unwrap(),
        recording.display_status.unwrap(),
    )
}

/// Frame numbers of the other end that a receiver has accounted for: come or missed. A corrupt frame
/// leaves a gap and is among the lost ones.
fn accounted(counters: &PortCounters) -> u32 {
    counters.received + counters.late + counters.malformed + counters.unheralded + counters.lost
}

/// What a receiver's account is short of the sender's, in frames, once both are taken to the same
/// instant.
fn short(sender: &Status, receiver: &Status, frames_per_s: f64) -> f64 {
    let later_s = (receiver.uptime_us as f64 - sender.uptime_us as f64) * 1e-6;
    f64::from(sender.peer.sent) + frames_per_s * later_s - f64::from(accounted(&receiver.peer))
}

fn errors(counters: &PortCounters) -> PortCounters {
    PortCounters {
        sent: 0,
        received: 0,
        ..*counters
    }
}

#[test]
fn a_clean_link_counts_no_error_at_either_end() {
    let (sensor, display) = statuses(&PLAIN);
    assert_eq!(errors(&sensor.peer), PortCounters::default(), "sensor");
    assert_eq!(errors(&display.peer), PortCounters::default(), "display");
    let RoleCounters::Display(counters) = display.role else {
        panic!("{display:?}");
    };
    assert_eq!(counters.refused_estimates, 0);
}

#[test]
fn on_a_clean_link_each_end_receives_what_the_other_sends() {
    let (sensor, display) = statuses(&PLAIN);
    for (from, to, frames_per_s) in [
        (&sensor, &display, SENSOR_FRAMES_PER_S),
        (&display, &sensor, DISPLAY_FRAMES_PER_S),
    ] {
        let short = short(from, to, frames_per_s);
        // In flight: what is sent in the 0.5 ms of the cable, two longest frames before it, and one
        // that begins; the statuses themselves and the instants within a frame's period, either way.
        let flight_s = 0.5e-3 + 2.0 * MAX_FRAME as f64 * 10.0 / 921_600.0;
        let most = frames_per_s * flight_s + 1.0 + 2.0;
        assert!(
            (-2.0..=most).contains(&short),
            "{short} frames, {from:?} {to:?}"
        );
    }
}

#[test]
fn the_counters_of_both_ends_add_up_in_bad_weather() {
    let (sensor, display) = statuses(&WEATHER);
    for (from, to, frames_per_s) in [
        (&sensor, &display, SENSOR_FRAMES_PER_S),
        (&display, &sensor, DISPLAY_FRAMES_PER_S),
    ] {
        let short = short(from, to, frames_per_s);
        // As on a clean link, and: the weather's delay; the frame that one held back waits for; those
        // lost since the last that came, more than 6 of them one time in 10⁶ or so; and as many
        // before the first that came.
        let flight_s =
            0.5e-3 + 2.0 * MAX_FRAME as f64 * 10.0 / 921_600.0 + (DELAY_MS + JITTER_MS) * 1e-3;
        let most = frames_per_s * flight_s + 1.0 + 2.0 + 1.0 + 2.0 * 6.0;
        assert!(
            (-2.0..=most).contains(&short),
            "{short} frames, {from:?} {to:?}"
        );
    }
}

#[test]
fn each_end_counts_the_weathers_losses_by_kind() {
    let (sensor, display) = statuses(&WEATHER);
    for to in [&sensor, &display] {
        let counters = &to.peer;
        let frames = f64::from(accounted(counters));
        let share = f64::from(counters.lost) / frames;
        // Lost on the way, or corrupt in one of at most MAX_FRAME bytes, which may take the frame
        // behind along; 5 σ of the binomial.
        let sigma = (LOSS * (1.0 - LOSS) / frames).sqrt();
        let low = LOSS - 5.0 * sigma;
        let high = LOSS + 2.0 * CORRUPT * MAX_FRAME as f64 + 5.0 * sigma;
        assert!((low..=high).contains(&share), "{share} lost, {counters:?}");
        assert!(counters.corrupt > 0 && counters.late > 0, "{counters:?}");
        assert!(counters.lost > counters.corrupt, "{counters:?}");
        // What the weather does not do.
        assert_eq!(
            (
                counters.dropped,
                counters.malformed,
                counters.foreign,
                counters.overruns
            ),
            (0, 0, 0, 0),
            "{counters:?}"
        );
    }
}

#[test]
fn no_estimate_is_used_that_is_older_than_one_used_before() {
    let recording = &WEATHER.recording;
    let mut by_arrival: Vec<_> = recording
        .estimates
        .iter()
        .filter_map(|record| Some((record.received_ns?, record.estimate.sequence)))
        .collect();
    by_arrival.sort();
    assert!(!by_arrival.is_empty());
    let (_, display) = statuses(&WEATHER);
    assert!(display.peer.late > 0, "nothing came out of order");
    // The replay uses none that is older than one before it, and explains every word.
    let settings = WEATHER.scene.display_settings().unwrap();
    let replay = history::replay_of_bad_link(recording, &settings).unwrap();
    assert_eq!(replay.outputs, recording.outputs.len());
    // The hand rests at no time, the stimulus until the first valid estimate.
    assert!(replay.outputs > recording.ticks.len() / 2, "{replay:?}");
}
