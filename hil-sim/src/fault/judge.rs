//! What became of a fault: seen or not, and when the outputs were at 0 V.

use firmware_display::ZERO_VOLT;
use protocol::{
    DisplayCounters, DisplayState, Estimate, GaugeHealth, Message, PortCounters, Role,
    RoleCounters, SensorCounters, Status,
};

use super::{Class, Fault, Kind, Signs};
use crate::listener::Said;
use crate::recording::{ACTUATORS, OutputRecord, Recording};

/// Longest time in ns that an output may stand at one voltage that is not 0: as long as any fault's
/// outputs have to be at 0 V.
const STANDING_NS: u64 = 20_000_000;
/// How long before a fault an output has to have been driven for the stimulus to be called on: half a
/// cycle of 25 Hz passes 0 V once.
const DRIVEN_NS: u64 = 20_000_000;
/// All outputs at 0 V for so long, in ns, is no wave's passing: ten ticks.
const SILENCE_NS: u64 = 5_000_000;

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
    let end_ns = (recording.duration_s * 1e9) as u64;
    faults
        .iter()
        .map(|fault| {
            let next_ns = faults
                .iter()
                .filter(|next| next.kind == Kind::PowerCycle)
                .map(Fault::begins_ns)
                .filter(|&at_ns| at_ns > fault.begins_ns())
                .min();
            finding(fault, next_ns.unwrap_or(end_ns).min(end_ns), recording)
        })
        .collect()
}

/// Judges one fault of a recording by what came before `until_ns`.
pub fn finding(fault: &Fault, until_ns: u64, recording: &Recording) -> Finding {
    let from_ns = fault.begins_ns();
    let outputs = &recording.outputs;
    let rest_ns = fault.ends_ns().unwrap_or(until_ns);
    let rest_ns = match fault.kind.row().class {
        // What is over stays answered.
        Class::Stops => until_ns,
        _ => rest_ns.min(until_ns),
    };
    let safe_ns = silent_from(outputs, from_ns, rest_ns);
    let sign = first_sign(fault, until_ns, &recording.signs);
    let resets =
        recording.signs.resets.iter().filter(|reset| {
            reset.role == Role::Display && (from_ns..until_ns).contains(&reset.at_ns)
        });
    let answered_ns = answered(outputs, from_ns, until_ns).unwrap_or(until_ns);
    Finding {
        fault: *fault,
        was_driving: is_driven(outputs, from_ns.saturating_sub(DRIVEN_NS), from_ns),
        detected_ns: sign.as_ref().map(|(at_ns, _)| at_ns - from_ns),
        sign: sign.map(|(_, sign)| sign).unwrap_or_default(),
        safe_ns: safe_ns.map(|at_ns| at_ns - from_ns),
        stuck: stuck(fault, outputs, rest_ns, until_ns),
        drives_again: is_driven(outputs, answered_ns + 1, until_ns),
        resets: resets.count(),
    }
}

fn is_silent(output: &OutputRecord) -> bool {
    output.words.iter().all(|&word| word == ZERO_VOLT)
}

/// The outputs from `from_ns` on: what holds then, and every change before `until_ns`.
fn within(outputs: &[OutputRecord], from_ns: u64, until_ns: u64) -> &[OutputRecord] {
    let first = outputs.partition_point(|output| output.at_ns <= from_ns);
    let last = outputs.partition_point(|output| output.at_ns < until_ns);
    &outputs[first.saturating_sub(1)..last.max(first)]
}

fn is_driven(outputs: &[OutputRecord], from_ns: u64, until_ns: u64) -> bool {
    from_ns < until_ns
        && within(outputs, from_ns, until_ns)
            .iter()
            .any(|output| !is_silent(output))
}

/// From when on, `from_ns` at the earliest, all outputs stay at 0 V until `until_ns`.
fn silent_from(outputs: &[OutputRecord], from_ns: u64, until_ns: u64) -> Option<u64> {
    let held = within(outputs, from_ns, until_ns);
    match held.iter().rposition(|output| !is_silent(output)) {
        None => Some(from_ns),
        Some(last) => held.get(last + 1).map(|output| output.at_ns),
    }
}

/// From when on all outputs were at 0 V for longer than a wave that passes it.
fn answered(outputs: &[OutputRecord], from_ns: u64, until_ns: u64) -> Option<u64> {
    let held = within(outputs, from_ns, until_ns);
    let ends_ns = held.iter().skip(1).map(|next| next.at_ns).chain([until_ns]);
    let silent = held
        .iter()
        .zip(ends_ns)
        .filter(|(output, _)| is_silent(output))
        .map(|(output, end_ns)| (output.at_ns.max(from_ns), end_ns));
    let mut long = silent.filter(|(at_ns, end_ns)| end_ns - at_ns >= SILENCE_NS);
    long.next().map(|(at_ns, _)| at_ns)
}

/// Outputs that are driven 20 ms after a fault that can put out a wrong voltage, or that stand at a
/// voltage for longer than that.
fn stuck(fault: &Fault, outputs: &[OutputRecord], rest_ns: u64, until_ns: u64) -> usize {
    let from_ns = fault.begins_ns();
    let is_dangerous = fault.kind.row().safe_within_ms.is_some();
    let late_ns = from_ns + STANDING_NS;
    (0..ACTUATORS)
        .filter(|&actuator| {
            let word = |output: &OutputRecord| output.words[actuator];
            let is_late = is_dangerous
                && late_ns < rest_ns
                && within(outputs, late_ns, late_ns)
                    .iter()
                    .any(|output| word(output) != ZERO_VOLT);
            is_late || longest_standing_ns(outputs, from_ns, until_ns, word) > STANDING_NS
        })
        .count()
}

/// The longest time at one voltage that is not 0.
fn longest_standing_ns(
    outputs: &[OutputRecord],
    from_ns: u64,
    until_ns: u64,
    word: impl Fn(&OutputRecord) -> u16,
) -> u64 {
    let mut longest_ns = 0;
    let mut held: Option<(u64, u16)> = None;
    for output in within(outputs, from_ns, until_ns) {
        let now = word(output);
        if held.is_some_and(|(_, word)| word == now) {
            continue;
        }
        if let Some((since_ns, word)) = held.replace((output.at_ns.max(from_ns), now))
            && word != ZERO_VOLT
        {
            longest_ns = longest_ns.max(output.at_ns.saturating_sub(since_ns));
        }
    }
    match held {
        Some((since_ns, word)) if word != ZERO_VOLT => longest_ns.max(until_ns - since_ns),
        _ => longest_ns,
    }
}

/// The first sign of a fault, and when it could be seen.
fn first_sign(fault: &Fault, until_ns: u64, signs: &Signs) -> Option<(u64, String)> {
    let from_ns = fault.begins_ns();
    let is_due = |at_ns: u64| (from_ns..until_ns).contains(&at_ns);
    let clear = signs
        .clears_ns
        .iter()
        .copied()
        .filter(|&at_ns| is_due(at_ns));
    let resets = signs
        .resets
        .iter()
        .filter(|reset| !reset.is_injected && is_due(reset.at_ns));
    let mut found: Vec<(u64, String)> = clear
        .map(|at_ns| (at_ns, "CLR fell".to_owned()))
        .chain(resets.map(|reset| (reset.at_ns, format!("{} reset", reset.role.name()))))
        .collect();
    for (said, role) in [
        (&signs.display, Role::Display),
        (&signs.sensor, Role::Sensor),
    ] {
        let mut before = before(said, from_ns);
        let first = said
            .iter()
            .filter(|said| is_due(said.at_ns))
            .find_map(|said| {
                let sign = sign_of(fault, &said.message, &mut before)?;
                Some((said.at_ns, format!("{}: {sign}", role.name())))
            });
        found.extend(first);
    }
    found.into_iter().min_by_key(|&(at_ns, _)| at_ns)
}

/// The last counters before a fault that the board has not forgotten.
fn before(said: &[Said], from_ns: u64) -> Option<Status> {
    let before = said.iter().take_while(|said| said.at_ns < from_ns);
    let mut status = None;
    for said in before {
        match &said.message {
            Message::Status(counted) => status = Some(*counted),
            Message::Hello(hello) if hello.asks != 0 => status = None,
            _ => {}
        }
    }
    status
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

#[cfg(test)]
mod tests;
