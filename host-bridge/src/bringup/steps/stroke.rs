//! The arm's drive, the first stroke, and the whole bench.

use protocol::{DisplayCounters, DisplayState, Trip};

use super::converters;
use crate::bringup::sight::Sight;
use crate::bringup::step::{Advice, Limit, Measure, Source, Step, Witness};
use crate::doctor::findings;

/// These steps.
pub const STEPS: [Step; 9] = [
    Step {
        name: "arm-drive",
        section: 5,
        title: "the arm follows the hand",
        to_do: "Wire the arm's drive to the sensor board: PWM D6 (PE9), direction D7 (PF13), ground. Keep clear of the \
                arm, and its power within reach. Power on. While it is measured, move the hand slowly to the right.",
        witness: Witness::Boards,
        needs: &["link-rate", "hand-encoder", "arm-encoder"],
        measures: &[Measure {
            what: "the arm's speed over the hand's",
            unit: "",
            source: Source::Number(follows),
            limit: Limit::Within(0.8, 1.2),
            advice: Advice::Seen(|sight| {
                match follows(sight) {
                    Some(ratio) if ratio < -0.05 => {
                        "it goes backwards: power off, then invert the direction D7 (PF13) or exchange the motor's wires"
                    }
                    Some(ratio) if ratio < 0.2 => {
                        "it stands: see the PWM's wire D6 (PE9), the drive's supply and its enable input"
                    }
                    Some(_) => "see the drive's scale: full duty is arm_full_scale_um_s of the configuration",
                    None => "move the hand while it is measured",
                }
                .to_owned()
            }),
        }],
    },
    Step {
        name: "amplitude",
        section: 6,
        title: "the display takes a configuration: 1 V",
        to_do: "Nothing. The amplitude is set to 1 V, and stays so until the display board is reset.",
        witness: Witness::Boards,
        needs: &["display-board"],
        measures: &[Measure {
            what: "amplitude in force",
            unit: "mV",
            source: Source::Number(|sight| sight.amplitude.clone()?.ok().map(f64::from)),
            limit: Limit::Within(1_000.0, 1_000.0),
            advice: Advice::Seen(|sight| {
                match &sight.amplitude {
                Some(Err(refusal)) => format!("it was refused: {refusal}"),
                _ => "measure again; if it stays so, see whether another program configures the board".to_owned(),
            }
            }),
        }],
    },
    Step {
        name: "surface",
        section: 5,
        title: "the sensor finds the 2 mm of the specimen",
        to_do: "Lay the 2 mm specimen under the fingertip, the arm resting on it. While it is measured, move the hand to \
                the right at some 30 to 50 mm/s.",
        witness: Witness::Boards,
        needs: &["gauges-alive", "arm-drive"],
        measures: &[
            Measure {
                what: "estimates that are valid",
                unit: "%",
                source: Source::Number(|sight| sight.surface.valid_percent()),
                limit: Limit::AtLeast(50.0),
                advice: Advice::Fixed(
                    "move on for longer, without a turn; see the gauges (host-bridge monitor)",
                ),
            },
            Measure {
                what: "mean λ of those",
                unit: "mm",
                source: Source::Number(|sight| sight.surface.wavelength_mm()),
                limit: Limit::Within(1.9, 2.1),
                advice: Advice::Fixed(
                    "see that the specimen is the one of 2 mm, and that a count of the arm is 5 µm",
                ),
            },
        ],
    },
    Step {
        name: "drive",
        section: 5,
        title: "the stimulus reaches the converters, and they hold it",
        to_do: "No actuator is connected. While it is measured, move the hand to the right at some 30 to 50 mm/s.",
        witness: Witness::Boards,
        needs: &[
            "surface",
            "link-rate",
            "emergency-stop",
            "converters-start",
            "alarm",
        ],
        measures: &[
            Measure {
                what: "words to the converters",
                unit: "",
                source: Source::Word(|sight| {
                    word(sight, Trip::Transfer, "not loaded", "loaded in time")
                }),
                limit: Limit::Word("loaded in time"),
                advice: Advice::Fixed(
                    "see LDAC's wire (D16, PC6): it is held at a level; then press the display board's reset button",
                ),
            },
            Measure {
                what: "what the converters hold",
                unit: "",
                source: Source::Word(|sight| {
                    word(
                        sight,
                        Trip::Converter,
                        "not what they were given",
                        "what they were given",
                    )
                }),
                limit: Limit::Word("what they were given"),
                advice: Advice::Fixed(
                    "see CLR's wire (D6, PE9): it is at ground, or open at the board; else a converter lost its supply; \
                     then press the display board's reset button",
                ),
            },
            Measure {
                what: "supervisor",
                unit: "",
                source: Source::Word(converters::supervisor),
                limit: Limit::Word("driving"),
                advice: Advice::Fixed(
                    "host-bridge doctor says why there is no stimulus, and what to do",
                ),
            },
        ],
    },
    Step {
        name: "frequency",
        section: 5,
        title: "a channel plays the surface",
        to_do: "A scope at the channel of actuator 0. Move the hand evenly at 50 mm/s (host-bridge monitor shows it) over \
                the 2 mm specimen.",
        witness: Witness::Person,
        needs: &["drive"],
        measures: &[
            Measure {
                what: "frequency at the channel",
                unit: "Hz",
                source: Source::Asked,
                limit: Limit::Within(22.5, 27.5),
                advice: Advice::Fixed(
                    "it is speed over λ, 25 Hz: see that a count of the hand is 5 µm; if there is no signal, see LDAC's \
                     wire (D16) at each chip",
                ),
            },
            Measure {
                what: "from a sudden stop of the hand to 0 V",
                unit: "ms",
                source: Source::Asked,
                limit: Limit::AtMost(20.0),
                advice: Advice::Fixed(
                    "see that the hand was at rest; keep a recording of it (host-bridge record) and report it",
                ),
            },
        ],
    },
    Step {
        name: "places",
        section: 5,
        title: "each actuator's channel is where it should be",
        to_do: "Power off. Follow each channel to its actuator by the table of wiring, and each chip select to its chip: \
                the boards can't tell two chips that are exchanged.",
        witness: Witness::Person,
        needs: &["drive"],
        measures: &[Measure {
            what: "actuator i at chip i/13, channel i mod 13, for all fifty (yes or no)",
            unit: "",
            source: Source::Asked,
            limit: Limit::Word("yes"),
            advice: Advice::Fixed(
                "put the chip selects D10 D9 D8 D7, or the channels, into their order",
            ),
        }],
    },
    Step {
        name: "finger",
        section: 5,
        title: "a finger feels it",
        to_do: "Power off, actuators on, power on, the finger on the array, the same stroke at 1 V.",
        witness: Witness::Person,
        needs: &["frequency", "places", "zero-volt", "emergency-press"],
        measures: &[Measure {
            what: "the ridges are felt, and nothing at rest (yes or no)",
            unit: "",
            source: Source::Asked,
            limit: Limit::Word("yes"),
            advice: Advice::Fixed(
                "finger off; see the actuators' supply and film, and a channel with the actuators on",
            ),
        }],
    },
    Step {
        name: "specimens",
        section: 5,
        title: "the other specimens, without a change of any setting",
        to_do: "Lay the specimens of 1, 3 and 4 mm under the fingertip, one after the other, move the hand over each by \
                some centimetres, and read λ off host-bridge monitor.",
        witness: Witness::Person,
        needs: &["surface"],
        measures: &[
            specimen("λ of the 1 mm specimen", Limit::Within(0.95, 1.05)),
            specimen("λ of the 3 mm specimen", Limit::Within(2.85, 3.15)),
            specimen("λ of the 4 mm specimen", Limit::Within(3.8, 4.2)),
        ],
    },
    Step {
        name: "health",
        section: 4,
        title: "the doctor finds nothing",
        to_do: "While it is measured, move the hand to the right.",
        witness: Witness::Boards,
        needs: &["drive"],
        measures: &[Measure {
            what: "findings of host-bridge doctor",
            unit: "",
            source: Source::Number(|sight| {
                let has_boards = !sight.examination.boards.is_empty();
                has_boards.then(|| findings::of(&sight.examination).len() as f64)
            }),
            limit: Limit::AtMost(0.0),
            advice: Advice::Seen(|sight| {
                let all = findings::of(&sight.examination);
                let each: Vec<String> = all
                    .iter()
                    .map(|finding| format!("{finding}: {}", finding.advice))
                    .collect();
                if each.is_empty() {
                    "measure again: no board was looked at".to_owned()
                } else {
                    each.join("\n")
                }
            }),
        }],
    },
];

const fn specimen(what: &'static str, limit: Limit) -> Measure {
    Measure {
        what,
        unit: "mm",
        source: Source::Asked,
        limit,
        advice: Advice::Fixed(
            "move on for longer, without a turn; keep a recording (host-bridge record) and report it",
        ),
    }
}

/// The arm's speed over the hand's; none if the hand rests.
fn follows(sight: &Sight) -> Option<f64> {
    let hand_mm_s = sight.hand.speed_mm_s().filter(|speed| speed.abs() > 1.0)?;
    Some(sight.arm.speed_mm_s()? / hand_mm_s)
}

/// `wrong` if the display was stopped by `trip`, `right` if not.
fn word(sight: &Sight, trip: Trip, wrong: &str, right: &str) -> Option<String> {
    let DisplayCounters { state, .. } = sight.display()?;
    let is_wrong = state == DisplayState::Stopped(trip);
    Some(if is_wrong { wrong } else { right }.to_owned())
}
