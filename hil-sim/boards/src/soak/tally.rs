//! What is counted on the wires and pins of a long run, and what the boards' own counters must say to it.

use protocol::receiver::{Event, Receiver};
use protocol::{
    DisplayState, Message, PortCounters, ResetCause, RoleCounters, Safety, SensorCounters, Status,
};

use super::super::display::DisplayRecords;
use super::super::wire::TimedByte;
use super::{Left, Soaked};
use hil_sim_core::run::recording::{ACTUATORS, TickRecord, volts};

/// The voltages rest with the hand: so long after its last count at the latest.
const RESTS_WITHIN_NS: u64 = 20_000_000;
/// The sensor looks at what it has heard so often.
const SAMPLE_NS: u64 = 1_000_000;
/// The largest change of a channel at an edge, in V: 8 V/ms for half a ms, and a word's rounding.
const LARGEST_STEP_V: f64 = 4.001;
/// Between a status' making and its last byte the ticks go on: its 200 bytes, and what waits before it.
const TICKS_ON_THE_WIRE: u64 = 40;
/// Frames that may be lost at the end without any frame after them to show it: those on their way when
/// the link falls silent, 50 ms of 500 motions a second, and a burst of losses.
const UNSEEN_AT_THE_END: u64 = 60;

/// A condition, and whether it held.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What must be.
    pub what: String,
    /// What was seen.
    pub seen: String,
    /// Whether it was so.
    pub holds: bool,
}

/// What a board said and heard.
#[derive(Default)]
pub(super) struct Side {
    said: Receiver,
    /// A receiver beside the board's own, on the very bytes that reach it.
    heard: Receiver,
    said_estimates: u64,
    said_motions: u64,
    heard_valid: u64,
    heard_estimates: u64,
    heard_motions: u64,
    /// Samples of the sensor in which a motion came, and the last of them.
    motion_samples: u64,
    motion_sample: u64,
    statuses: u64,
    last: Option<Status>,
    /// The frames said before the last status.
    before_last: u64,
    /// The frames said before the quiet end.
    before_quiet: u64,
    /// Statuses whose count of sent frames is not that of the wire.
    miscounted_frames: u64,
    /// Statuses whose count of ticks is not that of the timer.
    miscounted_ticks: u64,
    /// Loads and updates at the first status of a display.
    first_updates: Option<(u64, u32)>,
    uptime_fell: u64,
    holds: u64,
    trips: u64,
}

/// What a display's outputs did.
#[derive(Default)]
pub(super) struct Outputs {
    ticks: u64,
    loads: u64,
    changes: u64,
    clears: u64,
    dac_frame_errors: u64,
    skewed: u64,
    words: Option<[u16; ACTUATORS]>,
    largest_step_v: f64,
    /// What the encoder counted last, and since when it has.
    still: Option<(u16, u64)>,
    standing: u64,
    /// Ticks at which the encoder had counted.
    moving: u64,
}

impl Outputs {
    /// Takes what was recorded since the last call, and the loads that a chip has counted so far.
    pub(super) fn take(&mut self, records: DisplayRecords, loads: u64) {
        self.loads = loads;
        self.clears += u64::from(records.clears);
        self.dac_frame_errors = records.dac_frame_errors;
        for output in &records.outputs {
            self.skewed += u64::from(output.skew_ns > 0);
            let before = self.words.unwrap_or([0x8000; ACTUATORS]);
            for (from, to) in before.iter().zip(&output.words) {
                self.largest_step_v = self.largest_step_v.max((volts(*to) - volts(*from)).abs());
            }
            self.changes += u64::from(before != output.words);
            self.words = Some(output.words);
        }
        for tick in &records.ticks {
            self.ticks += 1;
            self.watch_rest(tick);
        }
    }

    /// Counts ticks at which a voltage stands though the hand's encoder has for long enough.
    fn watch_rest(&mut self, tick: &TickRecord) {
        let since_ns = match self.still {
            Some((encoder, since_ns)) if encoder == tick.encoder => since_ns,
            before => {
                self.moving += u64::from(before.is_some());
                tick.at_ns
            }
        };
        self.still = Some((tick.encoder, since_ns));
        let silent = self.words.is_none_or(|words| words == [0x8000; ACTUATORS]);
        if tick.at_ns - since_ns > RESTS_WITHIN_NS && !silent {
            self.standing += 1;
        }
    }
}

/// Frames that ended, of every sort.
fn ended(counters: &PortCounters) -> u64 {
    let bad = [
        counters.corrupt,
        counters.overlong,
        counters.late,
        counters.duplicated,
        counters.malformed,
        counters.foreign,
        counters.unheralded,
    ];
    u64::from(counters.received) + bad.map(u64::from).iter().sum::<u64>()
}

impl Side {
    /// The board put these on the wire.
    pub(super) fn sent(&mut self, bytes: &[TimedByte], outputs: &Outputs, quiet_ns: u64) {
        for &(at_ns, byte) in bytes {
            let mut message = None;
            self.said.receive(&[byte], |event| {
                if let Event::Message(said) = event {
                    message = Some(said);
                }
            });
            if at_ns < quiet_ns {
                self.before_quiet = ended(&self.said.counters());
            }
            match message {
                Some(Message::Estimate(_)) => self.said_estimates += 1,
                Some(Message::Motion(_)) => self.said_motions += 1,
                Some(Message::Status(status)) => self.take_status(status, outputs),
                Some(Message::Safety(change)) => self.take_safety(change),
                _ => {}
            }
        }
    }

    fn take_status(&mut self, status: Status, outputs: &Outputs) {
        self.statuses += 1;
        self.before_last = ended(&self.said.counters()) - 1;
        self.miscounted_frames += u64::from(u64::from(status.peer.sent) != self.before_last);
        if let RoleCounters::Display(counters) = status.role {
            let since = outputs.ticks.wrapping_sub(counters.ticks.into());
            self.miscounted_ticks += u64::from(since > TICKS_ON_THE_WIRE);
            self.first_updates
                .get_or_insert((outputs.loads, counters.updates));
        }
        let fell = self
            .last
            .is_some_and(|last| status.uptime_us <= last.uptime_us);
        self.uptime_fell += u64::from(fell);
        self.last = Some(status);
    }

    fn take_safety(&mut self, change: Safety) {
        match change.state {
            DisplayState::Fading(_) => self.holds += 1,
            DisplayState::Stopped(_) => self.trips += 1,
            DisplayState::Boot | DisplayState::Ready | DisplayState::Driving => {}
        }
    }

    /// This byte reaches the board.
    pub(super) fn arrived(&mut self, at_ns: u64, byte: u8) {
        let mut moved = false;
        self.heard.receive(&[byte], |event| match event {
            Event::Message(Message::Estimate(estimate)) => {
                self.heard_estimates += 1;
                self.heard_valid += u64::from(estimate.valid);
            }
            Event::Message(Message::Motion(_)) => moved = true,
            _ => {}
        });
        if moved {
            self.heard_motions += 1;
            let sample = at_ns / SAMPLE_NS;
            self.motion_samples += u64::from(sample != self.motion_sample);
            self.motion_sample = sample;
        }
    }

    pub(super) fn last_status(&self) -> Option<Status> {
        self.last
    }
}

#[derive(Default)]
struct Checks(Vec<Check>);

impl Checks {
    fn add(&mut self, whose: &str, what: &str, seen: String, holds: bool) {
        let what = format!("{whose}: {what}");
        self.0.push(Check { what, seen, holds });
    }

    /// What must be as often as is due.
    fn equal(&mut self, whose: &str, what: &str, (seen, due): (u64, u64)) {
        self.add(whose, what, format!("{seen}, due {due}"), seen == due);
    }

    /// What must not be.
    fn none(&mut self, whose: &str, seen: &[(&str, u64)]) {
        for &(what, seen) in seen {
            self.add(whose, what, seen.to_string(), seen == 0);
        }
    }

    /// What must be so often.
    fn within(&mut self, whose: &str, what: &str, seen: u64, (low, high): (u64, u64)) {
        let holds = (low..=high).contains(&seen);
        self.add(whose, what, format!("{seen}, due {low} to {high}"), holds);
    }
}

/// Holds both boards' last counters against what was seen, on a link that loses a share of `loss`.
pub(super) fn judge(sensor: Left, display: Left, crossed: u64, loss: f64) -> Soaked {
    let mut checks = Checks::default();
    for (board, peer) in [(&sensor, &display), (&display, &sensor)] {
        of_board(&mut checks, board);
        of_link(&mut checks, board, peer);
        let heard = board.side.heard.counters();
        let damaged = u64::from(heard.corrupt) + u64::from(heard.overlong);
        let (sent, lost) = (peer.side.before_quiet, u64::from(heard.lost));
        let due = lost_within(sent, damaged, loss);
        checks.within(board.name, "of the peer's frames lost", lost, due);
    }
    if let Some(RoleCounters::Sensor(counters)) = sensor.status().map(|status| status.role) {
        of_sensor(&mut checks, &sensor, &counters);
    }
    of_display(&mut checks, &display);
    let (said, outputs) = (&display.side, &display.outputs);
    let heard = said.heard.counters();
    let counts = vec![
        ("boundaries that the hand went over", crossed),
        ("ticks of the display", outputs.ticks),
        ("LDAC edges", outputs.loads),
        ("changes of the outputs", outputs.changes),
        ("estimates sent", sensor.side.said_estimates),
        ("of them heard", said.heard_estimates),
        ("of those valid", said.heard_valid),
        ("motions sent", said.said_motions),
        ("of them heard", sensor.side.heard_motions),
        ("frames lost on the way to the display", heard.lost.into()),
        ("frames corrupt there", heard.corrupt.into()),
        ("frames late there", heard.late.into()),
        ("times that the stimulus was held", said.holds),
    ];
    Soaked {
        checks: checks.0,
        counts,
    }
}

fn of_board(checks: &mut Checks, board: &Left) {
    let (name, side) = (board.name, &board.side);
    let before = [
        ("panics in its log", board.panics.len() as u64),
        ("resets", board.resets as u64),
        ("times its uptime fell", side.uptime_fell),
        ("configurations without an answer", u64::from(!board.told)),
        ("statuses missing", u64::from(side.statuses < 2)),
    ];
    checks.none(name, &before);
    let Some(status) = side.last_status() else {
        return;
    };
    let bitten = u64::from(status.reset == ResetCause::Watchdog);
    let of_status = [
        (
            "watchdog resets",
            u64::from(status.watchdog_resets) + bitten,
        ),
        (
            "statuses whose sent frames are not the wire's",
            side.miscounted_frames,
        ),
    ];
    checks.none(name, &of_status);
    for (port, counters) in [("peer", status.peer), ("console", status.console)] {
        let of_port = [
            ("frames dropped", counters.dropped.into()),
            ("overruns", counters.overruns.into()),
            ("line errors", counters.line_errors.into()),
        ];
        checks.none(&format!("{name}, {port}"), &of_port);
    }
}

/// `board`'s receiving counters against a receiver on the same bytes, and against what `peer` sent.
fn of_link(checks: &mut Checks, board: &Left, peer: &Left) {
    let Some(status) = board.status() else { return };
    let (name, twin) = (board.name, board.side.heard.counters());
    let [seen, due] = [status.peer, twin].map(|counters| {
        [
            ("frames received", counters.received),
            ("frames lost", counters.lost),
            ("frames corrupt", counters.corrupt),
            ("frames overlong", counters.overlong),
            ("frames late", counters.late),
            ("frames duplicated", counters.duplicated),
            ("frames malformed", counters.malformed),
            ("frames foreign", counters.foreign),
            ("frames unheralded", counters.unheralded),
        ]
    });
    for ((what, seen), (_, due)) in seen.into_iter().zip(due) {
        checks.equal(name, what, (seen.into(), due.into()));
    }
    // What was sent came, came late, or left a gap; after silence nothing more shows a gap.
    let sent = peer.side.before_quiet;
    let accounted = [twin.received, twin.late, twin.lost, twin.unheralded];
    checks.within(
        name,
        "of the peer's frames received, late, lost or unheralded",
        accounted.map(u64::from).iter().sum(),
        (sent.saturating_sub(UNSEEN_AT_THE_END), sent),
    );
}

/// How many of the frames that were sent may leave a gap: those that the link loses, by six deviations of chance and those
/// [`UNSEEN_AT_THE_END`], and those that it damages. A damaged end takes the next frame with it, and what comes late after all
/// is no gap.
fn lost_within(sent: u64, damaged: u64, loss: f64) -> (u64, u64) {
    let expected = loss * sent as f64;
    let chance = 6.0 * (expected * (1.0 - loss)).sqrt();
    let low = (expected - chance).max(0.0) as u64;
    let high = (expected + chance).ceil() as u64 + 2 * damaged;
    (low.saturating_sub(UNSEEN_AT_THE_END), high)
}

fn of_sensor(checks: &mut Checks, sensor: &Left, counters: &SensorCounters) {
    let none = [
        ("deadline misses", counters.deadline_misses.into()),
        ("ADC overruns", counters.adc_overruns.into()),
        ("DMA overruns", counters.dma_overruns.into()),
    ];
    checks.none("sensor", &none);
    // Those before the peer has greeted are counted and not sent.
    let said = sensor.side.said_estimates;
    let due = (said.saturating_sub(110), said + 110);
    checks.within(
        "sensor",
        "estimates counted",
        counters.estimates.into(),
        due,
    );
    // The latest of those that come within a sample is used; of a burst without a gap, which DMA hands on
    // at its end, the latest of all.
    let due = (sensor.side.motion_samples / 2, sensor.side.heard_motions);
    let what = "motions that reached the drive";
    checks.within("sensor", what, counters.motions.into(), due);
}

fn of_display(checks: &mut Checks, display: &Left) {
    let (side, outputs) = (&display.side, &display.outputs);
    let none = [
        (
            "statuses whose ticks are not the timer's",
            side.miscounted_ticks,
        ),
        (
            "edges at which channels did not change together",
            outputs.skewed,
        ),
        (
            "frames that a converter did not understand",
            outputs.dac_frame_errors,
        ),
        ("times that CLR fell", outputs.clears),
        ("trips", side.trips),
        (
            "ticks with a voltage though the hand rests",
            outputs.standing,
        ),
    ];
    checks.none("display", &none);
    let step_v = outputs.largest_step_v;
    let seen = format!("{step_v:.3}, at most {LARGEST_STEP_V}");
    let what = "largest step of a channel, V";
    checks.add("display", what, seen, step_v <= LARGEST_STEP_V);
    // Not at once, since λ has to be known, and not while a hold lasts; a display at 0 V changes nothing.
    checks.within(
        "display",
        "changes of the outputs, for the ticks at which the hand had moved",
        outputs.changes,
        (outputs.moving / 2, outputs.ticks),
    );
    let Some(RoleCounters::Display(counters)) = display.status().map(|status| status.role) else {
        return;
    };
    let is_stopped = matches!(counters.state, DisplayState::Stopped(_));
    let none = [
        ("missed updates", counters.deadline_misses.into()),
        ("SPI errors", counters.spi_errors.into()),
        ("converter faults", counters.converter_faults.into()),
        ("CLR seen fallen", counters.clears.into()),
        ("encoder jumps", counters.encoder_jumps.into()),
        ("motions without room", counters.unheard.into()),
        ("estimates called a flood", counters.flooded.into()),
        ("stopped at the end", is_stopped.into()),
    ];
    checks.none("display", &none);
    if let Some((loads, updates)) = side.first_updates {
        let due = u64::from(counters.updates - updates);
        checks.equal(
            "display",
            "LDAC edges for its updates",
            (outputs.loads - loads, due),
        );
    }
    // Two that come within a tick are one to the stimulus: the later.
    let used = [
        counters.estimates,
        counters.refused_estimates,
        counters.implausible,
    ];
    let due = (
        side.heard_valid - side.heard_valid / 20,
        side.heard_estimates,
    );
    let what = "valid estimates followed, refused or implausible";
    checks.within("display", what, used.map(u64::from).iter().sum(), due);
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::run::recording::OutputRecord;

    fn records(at_ms: u64, encoder: u16, word: u16) -> DisplayRecords {
        let mut words = [0x8000; ACTUATORS];
        words[9] = word;
        DisplayRecords {
            ticks: vec![TickRecord {
                at_ns: at_ms * 1_000_000,
                encoder,
                position_mm: 0.0,
            }],
            outputs: vec![OutputRecord {
                at_ns: at_ms * 1_000_000,
                words,
                skew_ns: 0,
            }],
            ..DisplayRecords::default()
        }
    }

    #[test]
    fn a_voltage_that_stands_while_the_hand_rests_is_counted_and_one_in_motion_is_not() {
        let mut outputs = Outputs::default();
        for ms in 0..100 {
            outputs.take(records(ms, ms as u16, 0x9000), ms);
        }
        assert_eq!(outputs.standing, 0);
        // The encoder stands from 99 ms on: silent in time, then not.
        for ms in 100..200 {
            let word = if (115..160).contains(&ms) {
                0x8000
            } else {
                0x9000
            };
            outputs.take(records(ms, 99, word), ms);
        }
        assert_eq!(outputs.standing, 40);
        assert_eq!((outputs.ticks, outputs.loads), (200, 199));
        assert!((outputs.largest_step_v - 0.625).abs() < 1e-9);
    }

    #[test]
    fn outputs_that_do_not_follow_the_hand_are_not_as_they_must_be() {
        for (follows, holds) in [(100, true), (50, true), (49, false), (0, false)] {
            let mut outputs = Outputs::default();
            for ms in 0..=200 {
                let moved = ms.min(100);
                let word = 0x8000 + moved.min(follows) as u16;
                outputs.take(records(ms, moved as u16, word), 0);
            }
            let mut checks = Checks::default();
            let display = Left {
                name: "display",
                side: Side::default(),
                outputs,
                resets: 0,
                panics: Vec::new(),
                told: true,
            };
            of_display(&mut checks, &display);
            let check = checks
                .0
                .iter()
                .find(|check| check.what.contains("the hand had moved"));
            let check = check.unwrap();
            assert_eq!(check.holds, holds, "{follows}: {}", check.seen);
        }
    }

    #[test]
    fn a_link_that_loses_a_third_does_not_pass_for_one_that_loses_a_twentieth() {
        let (sent, damaged) = (100_000, 1_200);
        let (low, high) = lost_within(sent, damaged, 0.05);
        for (share, holds) in [
            (0.05, true),
            (0.062, true),
            (0.33, false),
            (0.1, false),
            (0.04, false),
        ] {
            let lost = (share * sent as f64) as u64;
            assert_eq!(
                (low..=high).contains(&lost),
                holds,
                "{share}: {low} to {high}"
            );
        }
        assert_eq!(lost_within(0, 0, 0.05), (0, 0));
    }

    #[test]
    fn every_frame_that_ends_is_counted_once() {
        let counters = PortCounters {
            sent: 1_000,
            received: 10,
            lost: 500,
            corrupt: 3,
            late: 2,
            unheralded: 1,
            ..PortCounters::default()
        };
        assert_eq!(ended(&counters), 16);
    }
}
