//! The hand's encoder, then the arm's.

use crate::bringup::sight::{Sight, Track};
use crate::bringup::step::{Advice, Limit, Measure, Source, Step, Witness};

/// Travel that is more than a trembling hand's, in mm.
const MOVED_MM: f64 = 10.0;
/// Travel up to which an encoder is taken to stand, in mm.
const STANDS_MM: f64 = 0.5;

/// These steps.
pub const STEPS: [Step; 2] = [
    Step {
        name: "hand-encoder",
        section: 4,
        title: "the hand's encoder counts, and up where the hand goes right",
        to_do: "Wire the hand's encoder to the display board: A to PD12 (D29), B to PD13 (D28), and its ground. While \
                it is measured, move the hand to the right, towards larger x, by some centimetres.",
        witness: Witness::Boards,
        needs: &["display-board"],
        measures: &[
            Measure {
                what: "travel of the hand to the right",
                unit: "mm",
                source: Source::Number(|sight| sight.hand.travel_mm()),
                limit: Limit::AtLeast(MOVED_MM),
                advice: Advice::Seen(|sight| of_encoder(&sight.hand, "hand")),
            },
            Measure {
                what: "jumps of the hand's encoder since the board's start",
                unit: "",
                source: Source::Number(|sight| Some(sight.display()?.encoder_jumps.into())),
                limit: Limit::AtMost(0.0),
                advice: Advice::Fixed(
                    "see the encoder's wires, their screen and its supply; then press the display board's reset button",
                ),
            },
        ],
    },
    Step {
        name: "arm-encoder",
        section: 4,
        title: "the arm's encoder counts, and up where the arm goes right",
        to_do: "The arm's drive is off. Wire the arm's encoder to the sensor board: A to PD12 (D29), B to PD13 (D28), \
                and its ground. While it is measured, push the arm to the right, towards larger x, by some centimetres.",
        witness: Witness::Boards,
        needs: &["sensor-board", "hand-encoder"],
        measures: &[Measure {
            what: "travel of the arm to the right",
            unit: "mm",
            source: Source::Number(|sight: &Sight| sight.arm.travel_mm()),
            limit: Limit::AtLeast(MOVED_MM),
            advice: Advice::Seen(|sight| of_encoder(&sight.arm, "arm")),
        }],
    },
];

fn of_encoder(track: &Track, whose: &str) -> String {
    match track.travel_mm() {
        Some(travel_mm) if travel_mm < -STANDS_MM => {
            format!(
                "it counts down: exchange A and B of the {whose}'s encoder (PD12, PD13), or move it to the right"
            )
        }
        Some(travel_mm) if travel_mm.abs() <= STANDS_MM => {
            format!(
                "it stands: A or B of the {whose}'s encoder (PD12, PD13) or its supply is open, or it was not moved"
            )
        }
        Some(_) => "move it further".to_owned(),
        None => "see that the board is there: its console says nothing".to_owned(),
    }
}
