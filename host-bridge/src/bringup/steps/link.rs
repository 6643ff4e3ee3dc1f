//! The link between the boards, wire by wire.

use protocol::Role;

use crate::bringup::step::{Advice, Limit, Measure, Source, Step, Witness};

/// These steps.
pub const STEPS: [Step; 3] = [
    Step {
        name: "link-to-display",
        section: 3,
        title: "the display hears the sensor",
        to_do: "Power off. Join the boards' grounds, and the sensor's TX, PD5 (D53), to the display's RX, PD6 (D52). \
                Power on.",
        witness: Witness::Boards,
        needs: &["one-build"],
        measures: &[
            Measure {
                what: "good frames that the display heard",
                unit: "",
                source: Source::Number(|sight| sight.heard(Role::Display)),
                limit: Limit::AtLeast(1.0),
                advice: Advice::Fixed(
                    "see the wire from the sensor's PD5 (D53) to the display's PD6 (D52): crossed, TX to RX, not TX to TX",
                ),
            },
            damage(
                "framing errors, noise and damaged frames at the display",
                Source::Number(|sight| sight.damage(Role::Display)),
            ),
        ],
    },
    Step {
        name: "link-to-sensor",
        section: 3,
        title: "the sensor hears the display",
        to_do: "Power off. Join the display's TX, PD5 (D53), to the sensor's RX, PD6 (D52). Power on.",
        witness: Witness::Boards,
        needs: &["one-build"],
        measures: &[
            Measure {
                what: "good frames that the sensor heard",
                unit: "",
                source: Source::Number(|sight| sight.heard(Role::Sensor)),
                limit: Limit::AtLeast(1.0),
                advice: Advice::Fixed(
                    "see the wire from the display's PD5 (D53) to the sensor's PD6 (D52): crossed, TX to RX, not TX to TX",
                ),
            },
            damage(
                "framing errors, noise and damaged frames at the sensor",
                Source::Number(|sight| sight.damage(Role::Sensor)),
            ),
        ],
    },
    Step {
        name: "link-rate",
        section: 4,
        title: "nothing is lost between them",
        to_do: "Nothing. LD1 of both boards is on.",
        witness: Witness::Boards,
        needs: &["link-to-display", "link-to-sensor"],
        measures: &[
            Measure {
                what: "frames that the display hears in a second",
                unit: "Hz",
                source: Source::Number(|sight| sight.heard_hz(Role::Display)),
                limit: Limit::AtLeast(95.0),
                advice: Advice::Fixed(
                    "see the wires between the boards: short, with a ground beside them",
                ),
            },
            Measure {
                what: "frames that the sensor hears in a second",
                unit: "Hz",
                source: Source::Number(|sight| sight.heard_hz(Role::Sensor)),
                limit: Limit::AtLeast(475.0),
                advice: Advice::Fixed(
                    "see the wires between the boards: short, with a ground beside them",
                ),
            },
            Measure {
                what: "frames lost on the way to the display",
                unit: "",
                source: Source::Number(|sight| sight.lost(Role::Display)),
                limit: Limit::AtMost(0.0),
                advice: Advice::Fixed(
                    "see the wires between the boards: short, away from the drives",
                ),
            },
            Measure {
                what: "frames lost on the way to the sensor",
                unit: "",
                source: Source::Number(|sight| sight.lost(Role::Sensor)),
                limit: Limit::AtMost(0.0),
                advice: Advice::Fixed(
                    "see the wires between the boards: short, away from the drives",
                ),
            },
        ],
    },
];

const fn damage(what: &'static str, source: Source) -> Measure {
    Measure {
        what,
        unit: "",
        source,
        limit: Limit::AtMost(0.0),
        advice: Advice::Fixed(
            "join the grounds of the two boards, beside the two wires; see that nothing else drives PD6",
        ),
    }
}
