//! What can be seen of a bench, by its name in `steps.toml`.

use std::fmt;

use protocol::{DisplayCounters, DisplayState, Trip};
use serde::{Deserialize, Serialize};

use super::sight::{Sight, Track};
use crate::doctor::findings;

/// Changes of state of a board whose converters did not start: it stops out of its first state.
const NEVER_STARTED: u32 = 1;
/// The same if it stopped while it had nothing to play: it became ready in between.
const STOPPED_AT_REST: u32 = 2;
/// Travel up to which an encoder is taken to stand, in mm.
const STANDS_MM: f64 = 0.5;

/// One of the two boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    Sensor,
    Display,
}

impl From<Role> for protocol::Role {
    fn from(role: Role) -> Self {
        match role {
            Role::Sensor => Self::Sensor,
            Role::Display => Self::Display,
        }
    }
}

/// Something that is seen of a bench: a number in its measure's unit, or a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    Consoles,
    /// Probes that this user may not use.
    DeniedProbes,
    /// The state of the link to a board, in its word.
    Console(Role),
    /// Whether both boards run one build.
    Builds,
    /// Estimates in a second of the sensor's clock.
    EstimatesHz,
    /// Motions in a second of the display's clock.
    MotionsHz,
    /// Samples lost or late on the sensor board.
    MissedSamples,
    /// Frames lost between a board and this program, and not by other programs of ours.
    LostHere(Role),
    /// How far a clock is off at least, in ppm.
    DriftPpm(Role),
    /// Round trip of a console, in ms.
    RoundTripMs(Role),
    /// Watchdog resets since power came on.
    WatchdogResets(Role),
    /// Good frames that a board has heard from the other one.
    Heard(Role),
    /// The same in a second of its clock.
    HeardHz(Role),
    /// Noise and framing errors, damaged frames and frames without an end at a board.
    Damage(Role),
    /// Frames of the other board's that never came.
    Lost(Role),
    /// Travel of the hand, in mm.
    HandMm,
    /// Travel of the arm, in mm.
    ArmMm,
    /// Jumps of the hand's encoder.
    EncoderJumps,
    /// The mean of a gauge, in V.
    GaugeV(usize),
    /// The swing of a gauge, in mV.
    GaugeMv(usize),
    /// Whether the emergency stop is open.
    EmergencyStop,
    /// What became of the converters' start.
    Converters,
    /// The level of ALMOUT at rest.
    Alarm,
    /// The supervisor's state.
    Supervisor,
    /// The arm's speed over the hand's.
    ArmOverHand,
    /// The display's amplitude in force, in mV.
    AmplitudeMv,
    /// The share of valid estimates, in percent.
    ValidPercent,
    /// The mean λ of the valid estimates, in mm.
    WavelengthMm,
    /// Whether the converters' words were loaded.
    Words,
    /// Whether the converters hold what they were given.
    Held,
    Findings,
}

/// What was measured: in JSON a number or a string.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// Not untagged: serde does not tell a number by that where a crate of the build wants numbers of any precision.
#[serde(from = "serde_json::Value", into = "serde_json::Value")]
pub enum Value {
    /// A number, in its measure's unit.
    Number(f64),
    Word(String),
}

impl From<serde_json::Value> for Value {
    fn from(value: serde_json::Value) -> Self {
        match (value.as_f64(), value.as_str()) {
            (Some(number), _) => Self::Number(number),
            (None, Some(word)) => Self::Word(word.to_owned()),
            (None, None) => Self::Word(value.to_string()),
        }
    }
}

impl From<Value> for serde_json::Value {
    fn from(value: Value) -> Self {
        match value {
            Value::Number(number) => Self::from(number),
            Value::Word(word) => Self::String(word),
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) if number.fract() == 0.0 => write!(f, "{number}"),
            Self::Number(number) => write!(f, "{number:.3}"),
            Self::Word(word) => f.write_str(word),
        }
    }
}

impl Quantity {
    /// What has been seen; none if it was not.
    pub fn value(self, sight: &Sight) -> Option<Value> {
        let word = |word: &str| Some(Value::Word(word.to_owned()));
        let examination = &sight.examination;
        let number = match self {
            Self::Console(role) => return word(sight.board(role.into())?.state.word()),
            Self::Builds => {
                let of = |role: Role| {
                    let hello = sight.board(role.into())?.hello?;
                    Some((hello.version, hello.protocol, hello.schema))
                };
                let is_same = of(Role::Sensor)? == of(Role::Display)?;
                return word(if is_same { "the same" } else { "not the same" });
            }
            Self::EmergencyStop => {
                return word(either(sight, Trip::EmergencyStop, "open", "closed")?);
            }
            Self::Converters => return word(start(&sight.display()?)),
            Self::Alarm => {
                let is_at_rest = sight.display()?.changes == STOPPED_AT_REST;
                let level = either(sight, Trip::Converter, "low", "high")?;
                return word(if is_at_rest { level } else { "high" });
            }
            Self::Supervisor => return word(&sight.display()?.state.to_string()),
            Self::Words => {
                return word(either(
                    sight,
                    Trip::Transfer,
                    "not loaded",
                    "loaded in time",
                )?);
            }
            Self::Held => {
                let given = "what they were given";
                return word(either(
                    sight,
                    Trip::Converter,
                    "not what they were given",
                    given,
                )?);
            }
            Self::Consoles => examination.st_links.len() as f64,
            Self::DeniedProbes => {
                let denied = examination.probes.iter().filter(|probe| !probe.is_allowed);
                denied.count() as f64
            }
            Self::EstimatesHz => sight.estimates.rate_hz()?,
            Self::MotionsHz => sight.hand.rate_hz()?,
            Self::MissedSamples => {
                let counters = sight.sensor()?;
                [
                    counters.adc_overruns,
                    counters.dma_overruns,
                    counters.deadline_misses,
                ]
                .map(f64::from)
                .into_iter()
                .sum()
            }
            Self::LostHere(role) => sight.board(role.into())?.line_counters().lost.into(),
            Self::DriftPpm(role) => {
                let drift = sight.board(role.into())?.clock?.drift?;
                (drift.ppm.abs() - drift.error_ppm).max(0.0)
            }
            Self::RoundTripMs(role) => sight.board(role.into())?.clock?.round_trip_us as f64 * 1e-3,
            Self::WatchdogResets(role) => {
                sight.board(role.into())?.status()?.watchdog_resets.into()
            }
            Self::Heard(role) => sight.heard(role.into())?,
            Self::HeardHz(role) => sight.heard_hz(role.into())?,
            Self::Damage(role) => sight.damage(role.into())?,
            Self::Lost(role) => sight.lost(role.into())?,
            Self::HandMm => sight.hand.travel_mm()?,
            Self::ArmMm => sight.arm.travel_mm()?,
            Self::EncoderJumps => sight.display()?.encoder_jumps.into(),
            Self::GaugeV(gauge) => sight.gauges[gauge].mean_v()?,
            Self::GaugeMv(gauge) => sight.gauges[gauge].swing_mv()?,
            Self::ArmOverHand => arm_over_hand(sight)?,
            Self::AmplitudeMv => sight.amplitude.clone()?.ok()?.into(),
            Self::ValidPercent => sight.surface.valid_percent()?,
            Self::WavelengthMm => sight.surface.wavelength_mm()?,
            Self::Findings if examination.boards.is_empty() => return None,
            Self::Findings => findings::of(examination).len() as f64,
        };
        Some(Value::Number(number))
    }

    /// What to try where that follows from what has been seen.
    pub fn advice(self, sight: &Sight) -> String {
        let fixed = match self {
            Self::Console(role) => {
                let Some(board) = sight.board(role.into()) else {
                    return "plug the board in at its ST-LINK's USB socket, CN1".to_owned();
                };
                let advice = board.state.advice();
                let advice = advice.unwrap_or("measure again: it has not answered yet");
                return format!("{}: {advice}", board.state);
            }
            Self::Converters => match sight.display().as_ref().map(start) {
                Some("not tried") => {
                    "press the display board's reset button: it was stopped before it started"
                }
                _ => {
                    "a converter does not hold what it was given: see SDI D11 (JP6 off), SDO D12, SCK D13, CS D10 D9 D8 \
                     D7, and the supply of each; then press the display board's reset button"
                }
            },
            Self::HandMm => return of_encoder(&sight.hand, "hand"),
            Self::ArmMm => return of_encoder(&sight.arm, "arm"),
            Self::ArmOverHand => match arm_over_hand(sight) {
                Some(ratio) if ratio < -0.05 => {
                    "it goes backwards: power off, then invert the direction D7 (PF13) or exchange the motor's wires"
                }
                Some(ratio) if ratio < 0.2 => {
                    "it stands: see the PWM's wire D6 (PE9), the drive's supply and its enable input; then press the sensor board's reset button"
                }
                Some(_) => {
                    "see the drive's scale: full duty is arm_full_scale_um_s of the configuration"
                }
                None => "move the hand while it is measured",
            },
            Self::AmplitudeMv => match &sight.amplitude {
                Some(Err(refusal)) => return format!("it was refused: {refusal}"),
                _ => {
                    "measure again; if it stays so, see whether another program configures the board"
                }
            },
            Self::Findings => {
                let all = findings::of(&sight.examination);
                let each = all
                    .iter()
                    .map(|finding| format!("{finding}: {}", finding.advice));
                match each.collect::<Vec<_>>() {
                    each if each.is_empty() => "measure again: no board was looked at",
                    each => return each.join("\n"),
                }
            }
            _ => "",
        };
        fixed.to_owned()
    }
}

/// `wrong` if the display was stopped by `trip`, `right` if not.
fn either<'w>(sight: &Sight, trip: Trip, wrong: &'w str, right: &'w str) -> Option<&'w str> {
    let is_wrong = sight.display()?.state == DisplayState::Stopped(trip);
    Some(if is_wrong { wrong } else { right })
}

/// What became of the converters' start.
fn start(counters: &DisplayCounters) -> &'static str {
    match counters.state {
        DisplayState::Boot => "starting",
        DisplayState::Stopped(trip) if counters.changes == NEVER_STARTED => match trip {
            Trip::Converter => "not started",
            _ => "not tried",
        },
        _ => "started",
    }
}

fn of_encoder(track: &Track, whose: &str) -> String {
    match track.travel_mm() {
        Some(travel_mm) if travel_mm < -STANDS_MM => format!(
            "it counts down: exchange A and B of the {whose}'s encoder (PD12, PD13), or move it to the right"
        ),
        Some(travel_mm) if travel_mm.abs() <= STANDS_MM => format!(
            "it stands: A or B of the {whose}'s encoder (PD12, PD13) or its supply is open, or it was not moved"
        ),
        Some(_) => "move it further".to_owned(),
        None => "see that the board is there: its console says nothing".to_owned(),
    }
}

/// The arm's speed over the hand's; none if the hand rests.
fn arm_over_hand(sight: &Sight) -> Option<f64> {
    let hand_mm_s = sight.hand.speed_mm_s().filter(|speed| speed.abs() > 1.0)?;
    Some(sight.arm.speed_mm_s()? / hand_mm_s)
}

#[cfg(test)]
mod tests {
    use protocol::{PortCounters, ResetCause, RoleCounters, SensorCounters, Status};

    use super::*;
    use crate::doctor::examination::BoardFacts;
    use crate::state::State;

    #[test]
    fn more_missed_samples_than_a_counter_holds_are_counted_all_the_same() {
        let counters = SensorCounters {
            adc_overruns: u32::MAX,
            deadline_misses: 2,
            ..SensorCounters::ZERO
        };
        let absent = State::Absent(String::new());
        let mut board = BoardFacts::new(protocol::Role::Sensor, absent);
        board.first = Some(Status {
            uptime_us: 0,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            peer: PortCounters::new(),
            console: PortCounters::new(),
            role: RoleCounters::Sensor(counters),
            stack_free_bytes: 0,
        });
        let mut sight = Sight::default();
        sight.examination.boards.push(board);
        let missed = Quantity::MissedSamples.value(&sight);
        assert_eq!(missed, Some(Value::Number(4_294_967_297.0)));
    }
}
