//! The emergency stop and the four converters, at 0 V.

use protocol::{DisplayCounters, DisplayState, Trip};

use crate::bringup::sight::Sight;
use crate::bringup::step::{Advice, Limit, Measure, Source, Step, Witness};

/// Changes of state of a board whose converters did not start: it stops out of its first state.
const NEVER_STARTED: u32 = 1;
/// The same if it stopped while it had nothing to play: it became ready in between.
const STOPPED_AT_REST: u32 = 2;

/// These steps.
pub const STEPS: [Step; 5] = [
    Step {
        name: "emergency-stop",
        section: 3,
        title: "the emergency stop is closed",
        to_do: "Power off. Wire the emergency stop, normally closed, from D4 (PF14) of the display board to ground. Power \
                on.",
        witness: Witness::Boards,
        needs: &["display-board"],
        measures: &[Measure {
            what: "emergency stop",
            unit: "",
            source: Source::Word(|sight| {
                let is_open = sight.display()?.state == DisplayState::Stopped(Trip::EmergencyStop);
                Some(if is_open { "open" } else { "closed" }.to_owned())
            }),
            limit: Limit::Word("closed"),
            advice: Advice::Fixed(
                "release it, or see its wire: D4 (PF14) to ground, normally closed; then press the display board's reset \
                 button",
            ),
        }],
    },
    Step {
        name: "converters-start",
        section: 3,
        title: "all four converters answer",
        to_do: "Power off. JP6 of the display board is off, no actuator is connected. Wire the converters: SCK D13 (PA5), \
                SDI D11 (PA7), SDO D12 (PA6), CS D10 D9 D8 D7, LDAC D16 (PC6), CLR D6 (PE9) with a pull-down, ALMOUT of \
                all four to D3 (PE13), grounds. Power on: first their supplies, then the board.",
        witness: Witness::Boards,
        needs: &["display-board"],
        measures: &[Measure {
            what: "converters",
            unit: "",
            source: Source::Word(|sight| Some(start(&sight.display()?).to_owned())),
            limit: Limit::Word("started"),
            advice: Advice::Seen(|sight| {
                match sight.display().as_ref().map(start) {
                Some("not tried") => "press the display board's reset button: it was stopped before it started".to_owned(),
                _ => "a converter does not hold what it was given: see SDI D11 (JP6 off), SDO D12, SCK D13, CS D10 D9 D8 \
                      D7, and the supply of each; then press the display board's reset button"
                    .to_owned(),
            }
            }),
        }],
    },
    Step {
        name: "alarm",
        section: 3,
        title: "no converter raises its alarm",
        to_do: "Nothing.",
        witness: Witness::Boards,
        needs: &["converters-start"],
        measures: &[Measure {
            what: "ALMOUT (D3) at rest",
            unit: "",
            source: Source::Word(|sight| {
                let counters = sight.display()?;
                let is_low = counters.state == DisplayState::Stopped(Trip::Converter)
                    && counters.changes == STOPPED_AT_REST;
                Some(if is_low { "low" } else { "high" }.to_owned())
            }),
            limit: Limit::Word("high"),
            advice: Advice::Fixed(
                "see ALMOUT's wire (D3, PE13): at ground, or a converter is too hot; then press the display board's reset \
                 button",
            ),
        }],
    },
    Step {
        name: "zero-volt",
        section: 3,
        title: "every channel is at 0 V",
        to_do: "The hand rests. Go over the fifty channels with a meter.",
        witness: Witness::Person,
        needs: &["converters-start", "alarm"],
        measures: &[Measure {
            what: "the largest voltage of a channel, either way",
            unit: "mV",
            source: Source::Asked,
            limit: Limit::AtMost(10.0),
            advice: Advice::Fixed(
                "see the supplies and the reference, and CLR's pull-down; take the channel's load off",
            ),
        }],
    },
    Step {
        name: "emergency-press",
        section: 5,
        title: "the emergency stop stops",
        to_do: "Press the emergency stop, and leave it pressed. Press the reset button after it was measured.",
        witness: Witness::Person,
        needs: &["emergency-stop", "converters-start", "alarm"],
        measures: &[Measure {
            what: "supervisor",
            unit: "",
            source: Source::Word(supervisor),
            limit: Limit::Word("stopped: emergency stop"),
            advice: Advice::Fixed(
                "see that the button opens its contact, and that D4 (PF14) goes to nothing else",
            ),
        }],
    },
];

/// The supervisor's state in words.
pub fn supervisor(sight: &Sight) -> Option<String> {
    Some(sight.display()?.state.to_string())
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
