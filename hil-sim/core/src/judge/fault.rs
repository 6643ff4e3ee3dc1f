//! What became of a fault: seen or not, and when the outputs were at 0 V.

mod outputs;
#[cfg(test)]
mod tests;

use std::ops::Range;

use protocol::{
    DisplayCounters, DisplayState, Estimate, GaugeHealth, Message, PortCounters, Role,
    RoleCounters, SensorCounters, Status,
};

use crate::judge::fault::outputs::Outputs;
use crate::run::decoder::TimedMessage;
use crate::run::fault_evidence::Reset;
use crate::run::observer::{RunObserver, retell_signs};
use crate::run::recording::{OutputRecord, Recording};
use crate::scene::fault::{Fault, Kind};

/// What became of one fault.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The fault.
    pub fault: Fault,
    /// Whether the stimulus was on when it began.
    pub was_driving: bool,
    /// From its beginning to the first sign of it, in ns.
    pub detected_ns: Option<u64>,
    /// What the sign was; empty if there was none.
    pub sign: String,
    /// From its beginning until all outputs were at 0 V and stayed there for the rest of it, in ns.
    pub safe_ns: Option<u64>,
    /// Outputs that were not at 0 V when they had to be, or stood at another voltage.
    pub stuck: usize,
    /// Whether any output was driven after the fault had been answered by 0 V.
    pub drives_again: bool,
    /// Resets of the display board that came of it.
    pub resets: usize,
}

impl Finding {
    /// What is not as the table of kinds has it.
    pub fn unmet(&self) -> Vec<String> {
        let row = self.fault.kind.row();
        let mut unmet = Vec::new();
        if row.is_to_be_seen && self.detected_ns.is_none() {
            unmet.push("no sign of it".to_owned());
        }
        if !row.is_to_be_seen && self.detected_ns.is_some() {
            unmet.push(format!("a sign of what is no fault: {}", self.sign));
        }
        if let Some(within_ms) = row.safe_within_ms {
            match self.safe_ms() {
                None => unmet.push("outputs not at 0 V".to_owned()),
                Some(ms) if ms > within_ms => {
                    unmet.push(format!("0 V after {ms:.2} ms of {within_ms}"));
                }
                Some(_) => {}
            }
        }
        if self.stuck > 0 {
            unmet.push(format!("{} outputs stuck", self.stuck));
        }
        if self.is_restart_against_the_table() {
            unmet.push(format!(
                "restarted against the table: {} resets{}",
                self.resets,
                if self.drives_again {
                    ", drives again"
                } else {
                    ""
                }
            ));
        }
        unmet
    }

    /// [`Finding::detected_ns`] in ms.
    pub fn detected_ms(&self) -> Option<f64> {
        self.detected_ns.map(|ns| ns as f64 * 1e-6)
    }

    /// [`Finding::safe_ns`] in ms.
    pub fn safe_ms(&self) -> Option<f64> {
        self.safe_ns.map(|ns| ns as f64 * 1e-6)
    }

    /// Whether the display drove again where it must not, or was reset more often than it may.
    pub fn is_restart_against_the_table(&self) -> bool {
        let row = self.fault.kind.row();
        self.resets > row.resets || (self.drives_again && !row.class.may_drive_again())
    }
}

/// Judges every fault of a recording, each until the next one that takes the display's power, or else
/// until the end.
pub fn judge(faults: &[Fault], recording: &Recording) -> Vec<Finding> {
    let mut judge = Judge::new(faults, recording.duration_s);
    for watch in &mut judge.watches {
        watch.review(recording);
    }
    judge.finish()
}

/// Judges one fault of a recording by what came before `until_ns`.
pub fn finding(fault: &Fault, until_ns: u64, recording: &Recording) -> Finding {
    let mut watch = FaultMonitor::new(fault, until_ns);
    watch.review(recording);
    watch.finish()
}

/// Judges the faults of a run as it goes on: what is kept of each does not grow.
#[derive(Clone, Debug)]
pub struct Judge {
    watches: Vec<FaultMonitor>,
}

impl Judge {
    /// Before a run of `duration_s` with these faults.
    pub fn new(faults: &[Fault], duration_s: f64) -> Self {
        let end_ns = (duration_s * 1e9) as u64;
        let watch = |fault: &Fault| {
            let next_ns = faults
                .iter()
                .filter(|next| next.kind == Kind::PowerCycle)
                .map(Fault::begins_ns)
                .filter(|&at_ns| at_ns > fault.begins_ns())
                .min();
            FaultMonitor::new(fault, next_ns.unwrap_or(end_ns).min(end_ns))
        };
        Self {
            watches: faults.iter().map(watch).collect(),
        }
    }

    /// What became of each fault.
    pub fn finish(self) -> Vec<Finding> {
        self.watches.into_iter().map(FaultMonitor::finish).collect()
    }
}

impl RunObserver for Judge {
    fn output(&mut self, output: &OutputRecord) {
        for watch in &mut self.watches {
            watch.output(output);
        }
    }

    fn said(&mut self, role: Role, said: &TimedMessage) {
        for watch in &mut self.watches {
            watch.said(role, said);
        }
    }

    fn reset(&mut self, reset: &Reset) {
        for watch in &mut self.watches {
            watch.reset(reset);
        }
    }

    fn cleared(&mut self, at_ns: u64) {
        for watch in &mut self.watches {
            watch.cleared(at_ns);
        }
    }
}

/// Looks on a fault.
#[derive(Clone, Debug)]
struct FaultMonitor {
    fault: Fault,
    /// What concerns it is in this time, in ns.
    due_ns: Range<u64>,
    outputs: Outputs,
    /// The first clear, in ns.
    clear_ns: Option<u64>,
    /// The first reset that the scene did not bring about.
    reset: Option<Reset>,
    resets: usize,
    display: BoardReports,
    sensor: BoardReports,
}

/// What a board says.
#[derive(Clone, Debug, Default)]
struct BoardReports {
    /// The last counters that the board has not forgotten.
    before: Option<Status>,
    /// When the fault first showed, in ns, and how.
    sign: Option<(u64, String)>,
}

impl FaultMonitor {
    fn new(fault: &Fault, until_ns: u64) -> Self {
        Self {
            fault: *fault,
            due_ns: fault.begins_ns()..until_ns,
            outputs: Outputs::new(fault, until_ns),
            clear_ns: None,
            reset: None,
            resets: 0,
            display: BoardReports::default(),
            sensor: BoardReports::default(),
        }
    }

    /// Looks on a run after the fact.
    fn review(&mut self, recording: &Recording) {
        for output in &recording.outputs {
            self.output(output);
        }
        retell_signs(&recording.signs, self);
    }

    fn finish(self) -> Finding {
        let from_ns = self.due_ns.start;
        let clear = self.clear_ns.map(|at_ns| (at_ns, "CLR fell".to_owned()));
        let reset = self
            .reset
            .map(|reset| (reset.at_ns, format!("{} reset", reset.role.name())));
        let sign = [clear, reset, self.display.sign, self.sensor.sign]
            .into_iter()
            .flatten()
            .min_by_key(|&(at_ns, _)| at_ns);
        let outputs = self.outputs.finish();
        Finding {
            fault: self.fault,
            was_driving: outputs.was_driving,
            detected_ns: sign.as_ref().map(|(at_ns, _)| at_ns - from_ns),
            sign: sign.map(|(_, sign)| sign).unwrap_or_default(),
            safe_ns: outputs.safe_ns.map(|at_ns| at_ns - from_ns),
            stuck: outputs.stuck,
            drives_again: outputs.drives_again,
            resets: self.resets,
        }
    }
}

impl RunObserver for FaultMonitor {
    fn output(&mut self, output: &OutputRecord) {
        self.outputs.add(output);
    }

    fn said(&mut self, role: Role, said: &TimedMessage) {
        let voice = match role {
            Role::Display => &mut self.display,
            Role::Sensor => &mut self.sensor,
            Role::Host => return,
        };
        if said.at_ns < self.due_ns.start {
            match &said.message {
                Message::Status(counted) => voice.before = Some(*counted),
                Message::Hello(hello) if hello.asks != 0 => voice.before = None,
                _ => {}
            }
        } else if self.due_ns.contains(&said.at_ns) && voice.sign.is_none() {
            let sign = sign_of(&self.fault, &said.message, &mut voice.before);
            voice.sign = sign.map(|sign| (said.at_ns, format!("{}: {sign}", role.name())));
        }
    }

    fn reset(&mut self, reset: &Reset) {
        if !self.due_ns.contains(&reset.at_ns) {
            return;
        }
        self.resets += usize::from(reset.role == Role::Display);
        let is_earlier = self.reset.is_none_or(|first| reset.at_ns < first.at_ns);
        if !reset.is_injected && is_earlier {
            self.reset = Some(*reset);
        }
    }

    fn cleared(&mut self, at_ns: u64) {
        if self.due_ns.contains(&at_ns) {
            self.clear_ns = Some(self.clear_ns.map_or(at_ns, |first_ns| first_ns.min(at_ns)));
        }
    }
}

/// What a message tells of a fault.
fn sign_of(fault: &Fault, message: &Message, before: &mut Option<Status>) -> Option<String> {
    match message {
        Message::Safety(safety) => state_sign(safety.state),
        Message::Status(status) => {
            let last = before.filter(|last| last.uptime_us < status.uptime_us);
            let sign = counted(fault, status, last);
            *before = Some(*status);
            sign
        }
        Message::Estimate(estimate) => estimate_sign(fault, estimate),
        Message::Configuration(report) => report
            .refused
            .map(|refusal| format!("refuses {:?}", refusal.setting)),
        Message::Hello(hello) if hello.asks != 0 => Some("greets anew".to_owned()),
        _ => None,
    }
}

fn state_sign(state: DisplayState) -> Option<String> {
    match state {
        DisplayState::Fading(hold) => Some(format!("fading, {hold:?}")),
        DisplayState::Stopped(trip) => Some(format!("stopped, {trip:?}")),
        DisplayState::Boot | DisplayState::Ready | DisplayState::Driving => None,
    }
}

/// A gauge that is broken shows in its health, a converter in what is valid; else estimates tell
/// nothing of faults.
fn estimate_sign(fault: &Fault, estimate: &Estimate) -> Option<String> {
    let gauge = fault.values[0] as usize;
    match fault.kind {
        Kind::GaugeOpen | Kind::GaugeShort => (estimate.health[gauge] != GaugeHealth::Good)
            .then(|| format!("gauge {gauge} is {:?}", estimate.health[gauge])),
        Kind::AdcStuck => (!estimate.valid).then(|| "no valid estimate".to_owned()),
        _ => None,
    }
}

/// The first counter of what must not happen that has gone up. Before the first counters after a
/// start, it went up from 0.
fn counted(fault: &Fault, status: &Status, before: Option<Status>) -> Option<String> {
    if let RoleCounters::Display(counters) = status.role
        && let Some(sign) = state_sign(counters.state)
    {
        return Some(sign);
    }
    let ports = |status: &Status| [port(&status.peer), port(&status.console)].concat();
    let now = [ports(status), role(&status.role)].concat();
    let then = before.map(|status| [ports(&status), role(&status.role)].concat());
    let risen = now
        .iter()
        .enumerate()
        .find(|(place, (_, count))| *count > then.as_ref().map_or(0, |then| then[*place].1));
    if let Some((_, (name, count))) = risen {
        return Some(format!("{name} {count}"));
    }
    // Pings are no fault of theirs: that so many came is what there is to see.
    let heard = status.console.received - before.map_or(0, |status| status.console.received);
    (fault.kind == Kind::ConsoleFlood && heard > 100).then(|| format!("received {heard}"))
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

fn role(counters: &RoleCounters) -> Vec<(&'static str, u32)> {
    match counters {
        RoleCounters::Display(DisplayCounters {
            deadline_misses,
            refused_estimates,
            fades,
            spi_errors,
            implausible,
            flooded,
            encoder_jumps,
            converter_faults,
            clears,
            unheard,
            ..
        }) => vec![
            ("deadline_misses", *deadline_misses),
            ("refused_estimates", *refused_estimates),
            ("fades", *fades),
            ("spi_errors", *spi_errors),
            ("implausible", *implausible),
            ("flooded", *flooded),
            ("encoder_jumps", *encoder_jumps),
            ("converter_faults", *converter_faults),
            ("clears", *clears),
            ("unheard", *unheard),
        ],
        RoleCounters::Sensor(SensorCounters {
            adc_overruns,
            dma_overruns,
            deadline_misses,
            ..
        }) => vec![
            ("adc_overruns", *adc_overruns),
            ("dma_overruns", *dma_overruns),
            ("deadline_misses", *deadline_misses),
        ],
    }
}
