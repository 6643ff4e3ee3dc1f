//! What a board's messages tell of a fault.

use protocol::{
    DisplayState, Estimate, GaugeHealth, Message, PortCounters, Role, RoleCounters, Status, Trip,
};

use crate::run::decoder::TimedMessage;
use crate::scene::fault::{Fault, Kind, Sign};

/// So many messages between two `Status` are more than anybody says who is well.
const FLOOD: u32 = 100;

/// What a board has said.
#[derive(Clone, Debug)]
pub(super) struct Voice {
    role: Role,
    /// The last counters that the board has not forgotten.
    before: Option<Status>,
}

impl Voice {
    pub fn new(role: Role) -> Self {
        Self { role, before: None }
    }

    /// Takes what was said before the fault.
    pub fn note(&mut self, said: &TimedMessage) {
        match &said.message {
            Message::Status(counted) => self.before = Some(*counted),
            Message::Hello(hello) if hello.asks != 0 => self.before = None,
            _ => {}
        }
    }

    /// What a message tells of `fault`, and in words.
    pub fn signs(&mut self, fault: &Fault, message: &Message) -> Vec<(Sign, String)> {
        let role = self.role;
        let one = |sign: Option<(Sign, String)>| sign.into_iter().collect();
        match message {
            Message::Safety(safety) => one(state_sign(safety.state)),
            Message::Status(status) => {
                let last = self.before.filter(|last| last.uptime_us < status.uptime_us);
                self.before = Some(*status);
                let mut signs = counted(role, fault, status, last);
                match status.role {
                    RoleCounters::Display(counters) => signs.extend(state_sign(counters.state)),
                    RoleCounters::Sensor(counters) => signs.extend(arm_sign(counters.stopped)),
                }
                signs
            }
            Message::Arm(arm) => one(arm_sign(arm.state.trip())),
            Message::Estimate(estimate) if role == Role::Sensor => {
                one(estimate_sign(fault, estimate))
            }
            Message::Configuration(report) => one(report
                .refused
                .map(|refusal| (Sign::Refuses, format!("refuses {:?}", refusal.setting)))),
            Message::Hello(hello) if hello.asks != 0 => {
                vec![(Sign::Greets(role), "greets anew".to_owned())]
            }
            _ => Vec::new(),
        }
    }
}

fn state_sign(state: DisplayState) -> Option<(Sign, String)> {
    match state {
        DisplayState::Fading(hold) => Some((Sign::Fading(hold), format!("fading, {hold:?}"))),
        DisplayState::Stopped(trip) => Some((Sign::Stopped(trip), format!("stopped, {trip:?}"))),
        DisplayState::Boot | DisplayState::Ready | DisplayState::Driving => None,
    }
}

/// An arm that somebody has stopped is no sign of a fault.
fn arm_sign(trip: Option<Trip>) -> Option<(Sign, String)> {
    let trip = trip.filter(|trip| matches!(trip, Trip::ArmEncoder | Trip::ArmStall))?;
    Some((Sign::ArmStopped(trip), format!("arm stopped, {trip:?}")))
}

/// A gauge that is broken shows in its health, a converter in what is valid; else estimates tell
/// nothing of faults.
fn estimate_sign(fault: &Fault, estimate: &Estimate) -> Option<(Sign, String)> {
    let gauge = fault.values[0] as usize;
    match fault.kind {
        Kind::GaugeOpen | Kind::GaugeShort => {
            (estimate.health[gauge] != GaugeHealth::Good).then(|| {
                let words = format!("gauge {gauge} is {:?}", estimate.health[gauge]);
                (Sign::GaugeNotGood, words)
            })
        }
        Kind::AdcStuck => {
            (!estimate.valid).then(|| (Sign::NoValidEstimate, "no valid estimate".to_owned()))
        }
        _ => None,
    }
}

/// The counters of what must not happen that have gone up. Before the first counters after a start, they
/// went up from 0.
fn counted(
    role: Role,
    fault: &Fault,
    status: &Status,
    before: Option<Status>,
) -> Vec<(Sign, String)> {
    let now = counters(status);
    let then = before.map(|status| counters(&status));
    let mut signs: Vec<(Sign, String)> = now
        .into_iter()
        .enumerate()
        .filter(|&(place, (_, count))| count > then.as_ref().map_or(0, |then| then[place].1))
        .map(|(_, (name, count))| (Sign::Counted(role, name), format!("{name} {count}")))
        .collect();
    let since = |count: fn(&Status) -> u32| {
        let before = before.as_ref().map_or(0, count);
        count(status).wrapping_sub(before)
    };
    // Pings are no fault of theirs: that so many came is what there is to see.
    let heard = since(|status| status.console.received);
    if fault.kind == Kind::ConsoleFlood && heard > FLOOD {
        signs.push((Sign::Counted(role, "received"), format!("received {heard}")));
    }
    // Whole frames that nobody took leave nothing but the gap.
    let lost = since(|status| status.peer.lost);
    if fault.kind == Kind::UartOverrun && lost > 0 {
        signs.push((Sign::Counted(role, "lost"), format!("lost {lost}")));
    }
    signs
}

fn counters(status: &Status) -> Vec<(&'static str, u32)> {
    let mut all = port(&status.peer);
    all.extend(port(&status.console));
    all.extend(board(&status.role));
    all
}

/// Counters of a port that only faults raise. Gaps and strangers are there at every start.
fn port(counters: &PortCounters) -> Vec<(&'static str, u32)> {
    vec![
        ("dropped", counters.dropped),
        ("corrupt", counters.corrupt),
        ("overlong", counters.overlong),
        ("late", counters.late),
        ("duplicated", counters.duplicated),
        ("malformed", counters.malformed),
        ("overruns", counters.overruns),
        ("line_errors", counters.line_errors),
    ]
}

fn board(counters: &RoleCounters) -> Vec<(&'static str, u32)> {
    match counters {
        RoleCounters::Display(counters) => vec![
            ("deadline_misses", counters.deadline_misses),
            ("refused_estimates", counters.refused_estimates),
            ("fades", counters.fades),
            ("spi_errors", counters.spi_errors),
            ("implausible", counters.implausible),
            ("flooded", counters.flooded),
            ("encoder_jumps", counters.encoder_jumps),
            ("converter_faults", counters.converter_faults),
            ("clears", counters.clears),
            ("unheard", counters.unheard),
        ],
        RoleCounters::Sensor(counters) => vec![
            ("adc_overruns", counters.adc_overruns),
            ("dma_overruns", counters.dma_overruns),
            ("deadline_misses", counters.deadline_misses),
        ],
    }
}
