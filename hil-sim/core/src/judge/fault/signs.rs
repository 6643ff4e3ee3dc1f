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

#[cfg(test)]
mod tests {
    use protocol::{
        Arm, ArmState, DisplayCounters, Hello, Hold, ResetCause, Safety, SensorCounters,
    };

    use super::*;
    use crate::judge::synthetic::Run;

    fn status(uptime_us: u64, role: RoleCounters) -> Status {
        Status {
            uptime_us,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            peer: PortCounters::default(),
            console: PortCounters::default(),
            role,
            stack_free_bytes: 0,
        }
    }

    fn said(voice: &mut Voice, kind: Kind, message: Message) -> Vec<Sign> {
        let signs = voice.signs(&Fault::new(kind, 0.5), &message);
        signs.into_iter().map(|(sign, _)| sign).collect()
    }

    fn greeting(role: Role, asks: bool) -> Message {
        Message::Hello(Hello::new(role, "chip", [0, 1, 0]).asking(asks))
    }

    #[test]
    fn a_broken_gauge_shows_in_its_own_health_and_a_dead_converter_in_what_is_valid() {
        let sound = Estimate {
            health: [GaugeHealth::Good; protocol::GAUGES],
            ..Run::steady(50.0, 2.0).record().estimates[0].estimate
        };
        let heard = |role, kind, gauge: u8, estimate| {
            let mut fault = Fault::new(kind, 0.5);
            fault.values[0] = gauge.into();
            let signs = Voice::new(role).signs(&fault, &Message::Estimate(estimate));
            signs.into_iter().map(|(sign, _)| sign).collect::<Vec<_>>()
        };
        let mut broken = sound;
        broken.health[3] = GaugeHealth::Stuck;
        for kind in [Kind::GaugeOpen, Kind::GaugeShort] {
            assert_eq!(heard(Role::Sensor, kind, 3, broken), [Sign::GaugeNotGood]);
            assert_eq!(heard(Role::Sensor, kind, 2, broken), []);
            assert_eq!(heard(Role::Sensor, kind, 3, sound), []);
            // A display only passes on what it heard.
            assert_eq!(heard(Role::Display, kind, 3, broken), []);
        }
        let doubtful = Estimate {
            valid: false,
            ..sound
        };
        let silent = [Sign::NoValidEstimate];
        assert_eq!(heard(Role::Sensor, Kind::AdcStuck, 0, doubtful), silent);
        assert_eq!(heard(Role::Sensor, Kind::AdcStuck, 0, sound), []);
        assert_eq!(heard(Role::Sensor, Kind::Nothing, 0, doubtful), []);
    }

    #[test]
    fn states_greetings_and_an_arm_that_a_trip_has_stopped_are_signs() {
        let mut voice = Voice::new(Role::Display);
        let mut says = |message| said(&mut voice, Kind::Nothing, message);
        let instant_us = 0;
        let arm = |trip| {
            Message::Arm(Arm {
                instant_us,
                state: ArmState::Stopped(trip),
            })
        };
        for trip in [Trip::ArmEncoder, Trip::ArmStall] {
            assert_eq!(says(arm(trip)), [Sign::ArmStopped(trip)]);
        }
        assert_eq!(says(arm(Trip::Host)), []);
        let state = |state| Message::Safety(Safety { instant_us, state });
        let stopped = DisplayState::Stopped(Trip::Converter);
        let fading = DisplayState::Fading(Hold::Stale);
        assert_eq!(says(state(stopped)), [Sign::Stopped(Trip::Converter)]);
        assert_eq!(says(state(fading)), [Sign::Fading(Hold::Stale)]);
        assert_eq!(says(state(DisplayState::Driving)), []);
        for (asks, signs) in [(false, &[][..]), (true, &[Sign::Greets(Role::Display)])] {
            assert_eq!(says(greeting(Role::Display, asks)), signs);
        }
    }

    #[test]
    fn counters_are_signs_where_they_have_gone_up_since_the_last_that_are_not_forgotten() {
        let mut voice = Voice::new(Role::Display);
        let mut says = |kind, status| said(&mut voice, kind, Message::Status(status));
        let told = |uptime_us, fades| {
            let counters = DisplayCounters {
                fades,
                ..DisplayCounters::default()
            };
            status(uptime_us, RoleCounters::Display(counters))
        };
        let faded = [Sign::Counted(Role::Display, "fades")];
        assert_eq!(says(Kind::Nothing, told(1, 2)), faded);
        assert_eq!(says(Kind::Nothing, told(2, 2)), []);
        assert_eq!(says(Kind::Nothing, told(3, 3)), faded);
        // A board that has started anew counts from 0.
        assert_eq!(says(Kind::Nothing, told(1, 3)), faded);
        assert_eq!(says(Kind::Nothing, told(2, 3)), []);
        // Pings and gaps are signs of what makes them alone.
        let mut heard = |kind, uptime_us, received, lost| {
            let mut status = told(uptime_us, 3);
            (status.console.received, status.peer.lost) = (received, lost);
            says(kind, status)
        };
        let received = [Sign::Counted(Role::Display, "received")];
        assert_eq!(heard(Kind::ConsoleFlood, 3, FLOOD, 1), []);
        assert_eq!(heard(Kind::ConsoleFlood, 4, 2 * FLOOD + 1, 1), received);
        let lost = [Sign::Counted(Role::Display, "lost")];
        assert_eq!(heard(Kind::UartOverrun, 5, 4 * FLOOD, 2), lost);
        assert_eq!(heard(Kind::UartOverrun, 6, 4 * FLOOD, 2), []);
    }

    #[test]
    fn what_was_said_before_the_fault_is_what_counters_are_held_against() {
        let counted = |uptime_us, adc_overruns| {
            let counters = SensorCounters {
                adc_overruns,
                ..SensorCounters::ZERO
            };
            Message::Status(status(uptime_us, RoleCounters::Sensor(counters)))
        };
        let note = |voice: &mut Voice, message| voice.note(&TimedMessage { at_ns: 0, message });
        let mut voice = Voice::new(Role::Sensor);
        note(&mut voice, counted(7, 1));
        assert_eq!(said(&mut voice, Kind::Nothing, counted(8, 1)), []);
        // One that has greeted anew has forgotten what it had counted.
        note(&mut voice, greeting(Role::Sensor, true));
        assert_eq!(
            said(&mut voice, Kind::Nothing, counted(8, 1)),
            [Sign::Counted(Role::Sensor, "adc_overruns")]
        );
    }
}
