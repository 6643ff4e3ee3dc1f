//! The five gauges.

use crate::bringup::sight::Sight;
use crate::bringup::step::{Advice, Limit, Measure, Source, Step, Witness};

/// These steps.
pub const STEPS: [Step; 2] = [
    Step {
        name: "gauges-level",
        section: 4,
        title: "each gauge is at mid-rail",
        to_do: "Wire the gauges' amplifiers to the sensor board: A0 to A4, 0 to 3.3 V, and their ground.",
        witness: Witness::Boards,
        needs: &["sensor-board"],
        measures: &[
            level("mean of gauge 0 (A0)", |sight| mean_v(sight, 0)),
            level("mean of gauge 1 (A1)", |sight| mean_v(sight, 1)),
            level("mean of gauge 2 (A2)", |sight| mean_v(sight, 2)),
            level("mean of gauge 3 (A3)", |sight| mean_v(sight, 3)),
            level("mean of gauge 4 (A4)", |sight| mean_v(sight, 4)),
        ],
    },
    Step {
        name: "gauges-alive",
        section: 4,
        title: "each gauge feels the surface",
        to_do: "Lay the 2 mm specimen under the fingertip. While it is measured, push the arm over it to the right.",
        witness: Witness::Boards,
        needs: &["gauges-level", "arm-encoder"],
        measures: &[
            alive("swing of gauge 0 (A0)", |sight| swing_mv(sight, 0)),
            alive("swing of gauge 1 (A1)", |sight| swing_mv(sight, 1)),
            alive("swing of gauge 2 (A2)", |sight| swing_mv(sight, 2)),
            alive("swing of gauge 3 (A3)", |sight| swing_mv(sight, 3)),
            alive("swing of gauge 4 (A4)", |sight| swing_mv(sight, 4)),
        ],
    },
];

const fn level(what: &'static str, number: fn(&Sight) -> Option<f64>) -> Measure {
    Measure {
        what,
        unit: "V",
        source: Source::Number(number),
        limit: Limit::Within(1.15, 2.15),
        advice: Advice::Fixed(
            "see the amplifier's supply and its wire, and balance the bridge to mid-rail, 1.65 V: at 0 or 3.3 V a wire \
             of the bridge is open",
        ),
    }
}

const fn alive(what: &'static str, number: fn(&Sight) -> Option<f64>) -> Measure {
    Measure {
        what,
        unit: "mV",
        source: Source::Number(number),
        limit: Limit::AtLeast(20.0),
        advice: Advice::Fixed(
            "see the gauge and the wire from its amplifier: shorted, or not connected, or not pushed over ridges",
        ),
    }
}

fn mean_v(sight: &Sight, gauge: usize) -> Option<f64> {
    sight.gauges[gauge].mean_v()
}

fn swing_mv(sight: &Sight, gauge: usize) -> Option<f64> {
    sight.gauges[gauge].swing_mv()
}
