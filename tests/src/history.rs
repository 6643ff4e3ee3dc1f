//! Replays what a display board did with its own library, word for word.

use firmware_display::{Display, Senses, Settings};
use hil_sim_core::link::impairments::BYTE_NS;
use hil_sim_core::run::recording::{ACTUATORS, EstimateRecord, Recording};
use protocol::MAX_FRAME;

/// From an estimate's last byte at the UART until the output task could take it, in ns, if the line is
/// idle then: a byte's time (11 µs) until it counts as idle, as much of the simulator's own, and the
/// listening task, which takes some 10 µs and may be held up by an output tick of 60 µs.
const TAKEN_NS: u64 = 100_000;
/// The output task takes estimates once its words are on their way: for the tick to come.
const TICK_NS: u64 = 500_000;
/// It does so this long after the tick at the latest.
const SENT_NS: u64 = 100_000;
/// The same, if other frames follow without a gap: the port is read when the line falls idle. A
/// status follows an estimate once a second; no two frames are longer than this.
const HELD_UP_NS: u64 = TAKEN_NS + 2 * MAX_FRAME as u64 * BYTE_NS;

/// Histories followed at a time. Estimates that hardly differ while the hand hardly moves, about a
/// turning point, can be taken in any of ten ticks each, and no word tells.
const MOST_HISTORIES: usize = 200;
/// The same if the link has delays and losses, so that more than one estimate in a hundred is held up.
const MOST_HISTORIES_OF_BAD_LINK: usize = 1_000;

/// How a display board came to its words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replay {
    /// Outputs of which every word is as the library says.
    pub outputs: usize,
    /// Estimates that were taken late, the line not being idle after them.
    pub held_up: usize,
}

/// One way in which it may have been.
#[derive(Clone)]
struct History {
    display: Display,
    /// How many of the estimates that arrived have been taken.
    taken: usize,
    /// One that arrived is not taken although it could be.
    waiting: bool,
    held_up: usize,
    /// Of those that came just before one is taken: the latest that was taken then, and the earliest that was not,
    /// in ns behind that instant.
    latest_taken_ns: i64,
    earliest_left_ns: i64,
    /// How many were taken or left against these: each takes about as long as the others.
    odd: usize,
}

impl History {
    /// An estimate came `behind_ns` after the instant at which one is taken, and may just have been.
    fn came_close(&mut self, behind_ns: i64, is_taken: bool) {
        if is_taken {
            self.odd += usize::from(behind_ns > self.earliest_left_ns);
            self.latest_taken_ns = self.latest_taken_ns.max(behind_ns);
        } else {
            self.odd += usize::from(behind_ns < self.latest_taken_ns);
            self.earliest_left_ns = self.earliest_left_ns.min(behind_ns);
        }
    }

    /// How unlikely it is.
    fn oddness(&self) -> usize {
        self.held_up + self.odd
    }
}

/// Replays a display board from its encoder readings and the estimates that reached it, and compares
/// every word of every output.
///
/// An estimate that arrives just before one is taken may be taken then or a tick later: all
/// histories are followed up until the words tell, and of those that do, the likeliest counts: the one with the
/// fewest held up, in which those that came close took about as long as each other. Estimates older than one that has arrived before are never taken.
///
/// # Errors
/// The first word that no history explains.
pub fn replay(recording: &Recording, settings: &Settings) -> Result<Replay, String> {
    replay_by(recording, settings, MOST_HISTORIES)
}

/// [`replay`] of a link with delays and losses, which takes longer.
///
/// # Errors
/// The same.
pub fn replay_of_bad_link(recording: &Recording, settings: &Settings) -> Result<Replay, String> {
    replay_by(recording, settings, MOST_HISTORIES_OF_BAD_LINK)
}

fn replay_by(
    recording: &Recording,
    settings: &Settings,
    most_histories: usize,
) -> Result<Replay, String> {
    let arrived = arrived(recording);
    let mut display = Display::new(settings, None);
    display.started(Ok(()));
    let mut histories = vec![History {
        display,
        taken: 0,
        waiting: false,
        held_up: 0,
        latest_taken_ns: i64::MIN,
        earliest_left_ns: i64::MAX,
        odd: 0,
    }];
    let mut outputs = recording.outputs.iter().peekable();
    let mut compared = 0;
    for (index, tick) in recording.ticks.iter().enumerate() {
        let end_ns = recording.ticks.get(index + 1).map(|next| next.at_ns);
        let output = outputs.next_if(|output| {
            output.at_ns >= tick.at_ns && end_ns.is_none_or(|end_ns| output.at_ns < end_ns)
        });
        let taken_ns = tick.at_ns.saturating_sub(TICK_NS);
        let may = arrived.partition_point(|&(at_ns, _)| at_ns <= taken_ns + SENT_NS);
        let usual = arrived.partition_point(|&(at_ns, _)| at_ns + TAKEN_NS <= taken_ns);
        let must = arrived.partition_point(|&(at_ns, _)| at_ns + HELD_UP_NS <= taken_ns);
        let mut next = Vec::new();
        let mut differences = Vec::new();
        for history in &histories {
            for taken in must.max(history.taken)..=may {
                let mut history = history.clone();
                for (_, record) in &arrived[history.taken..taken] {
                    history.display.on_estimate(&record.estimate);
                }
                for (index, &(at_ns, _)) in arrived.iter().enumerate().take(may).skip(usual) {
                    let behind_ns = at_ns as i64 - taken_ns as i64;
                    history.came_close(behind_ns, index < taken);
                }
                history.taken = taken;
                if history.waiting != (usual > taken) {
                    history.waiting = usual > taken;
                    history.held_up += usize::from(history.waiting);
                }
                let sent = history.display.tick(tick.encoder, &Senses::default()).send;
                let wanted = output.map(|output| &output.words);
                match difference(sent.then(|| history.display.words()), wanted) {
                    // The run may end between a tick and its edge.
                    Some(_) if end_ns.is_none() && wanted.is_none() => next.push(history),
                    Some(difference) => differences.push(difference),
                    None => next.push(history),
                }
            }
        }
        if next.is_empty() {
            return Err(format!(
                "tick {index} at {} ns, encoder {}, after {compared} equal outputs: {}",
                tick.at_ns,
                tick.encoder,
                differences.join("; or, with another history: ")
            ));
        }
        merge(&mut next, most_histories);
        histories = next;
        compared += usize::from(output.is_some());
    }
    match outputs.next() {
        None => Ok(Replay {
            outputs: compared,
            held_up: histories.iter().map(|h| h.held_up).min().unwrap_or(0),
        }),
        Some(output) => Err(format!(
            "the output at {} ns belongs to no tick",
            output.at_ns
        )),
    }
}

/// The estimates that the display's port hands on, by arrival.
fn arrived(recording: &Recording) -> Vec<(u64, &EstimateRecord)> {
    let mut arrived: Vec<_> = recording
        .estimates
        .iter()
        .filter_map(|record| Some((record.received_ns?, record)))
        .collect();
    arrived.sort_by_key(|&(at_ns, _)| at_ns);
    let mut newest = None;
    arrived.retain(|(_, record)| {
        let sequence = Some(record.estimate.sequence);
        let news = sequence > newest;
        newest = newest.max(sequence);
        news
    });
    arrived
}

/// The first difference between what the library would send and what came out.
fn difference(due: Option<&[u16; ACTUATORS]>, seen: Option<&[u16; ACTUATORS]>) -> Option<String> {
    match (due, seen) {
        (None, None) => None,
        (Some(_), None) => Some("an output is due and none came".to_owned()),
        (None, Some(_)) => Some("an output came and none is due".to_owned()),
        (Some(due), Some(seen)) => {
            let actuator = due.iter().zip(seen).position(|(due, seen)| due != seen)?;
            Some(format!(
                "actuator {actuator}: {:#06x} is due, {:#06x} came",
                due[actuator], seen[actuator]
            ))
        }
    }
}

/// Of those histories that have become equal, keeps the likeliest; of the others the `most` that are.
fn merge(histories: &mut Vec<History>, most: usize) {
    if histories.len() < 2 {
        return;
    }
    histories.sort_by_key(History::oddness);
    let mut kept: Vec<History> = Vec::new();
    for history in histories.drain(..) {
        let is_known = |other: &History| {
            (other.taken, other.waiting) == (history.taken, history.waiting)
                && other.display == history.display
        };
        if kept.len() < most && !kept.iter().any(is_known) {
            kept.push(history);
        }
    }
    *histories = kept;
}
