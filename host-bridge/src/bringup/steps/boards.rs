//! The two boards on their own: USB, firmware, clocks.

use protocol::Role;

use crate::bringup::sight::Sight;
use crate::bringup::step::{Advice, Limit, Measure, Source, Step, Witness};

/// These steps.
pub const STEPS: [Step; 7] = [
    Step {
        name: "usb",
        section: 1,
        title: "both ST-LINKs, and the right to use them",
        to_do: "Copy host-bridge/doc/70-ridgelink.rules to /etc/udev/rules.d, reload udev's rules, and plug both \
                boards in at CN1, the socket of the ST-LINK.",
        witness: Witness::Usb,
        needs: &[],
        measures: &[
            Measure {
                what: "consoles of ST-LINKs",
                unit: "",
                source: Source::Number(|sight| Some(sight.examination.st_links.len() as f64)),
                limit: Limit::AtLeast(2.0),
                advice: Advice::Fixed(
                    "see that each board is plugged in at CN1 and that its cable carries data: LD4 blinks, then glows",
                ),
            },
            Measure {
                what: "probes that this user may not use",
                unit: "",
                source: Source::Number(|sight| {
                    let probes = sight.examination.probes.iter();
                    Some(probes.filter(|probe| !probe.is_allowed).count() as f64)
                }),
                limit: Limit::AtMost(0.0),
                advice: Advice::Fixed(
                    "put the rules in place, `sudo udevadm control --reload && sudo udevadm trigger`, plug in again",
                ),
            },
        ],
    },
    Step {
        name: "sensor-board",
        section: 2,
        title: "the sensor board says Hello",
        to_do: "Leave its jumpers as they come, wire nothing, and flash it: host-bridge flash sensor.",
        witness: Witness::Boards,
        needs: &["usb"],
        measures: &[console(
            Source::Word(|sight| state(sight, Role::Sensor)),
            |sight| what_to_try(sight, Role::Sensor),
        )],
    },
    Step {
        name: "display-board",
        section: 2,
        title: "the display board says Hello",
        to_do: "Take JP6 off, leave its other jumpers, wire nothing, and flash it: host-bridge flash display.",
        witness: Witness::Boards,
        needs: &["usb"],
        measures: &[console(
            Source::Word(|sight| state(sight, Role::Display)),
            |sight| what_to_try(sight, Role::Display),
        )],
    },
    Step {
        name: "one-build",
        section: 2,
        title: "both run firmware of one version",
        to_do: "Nothing.",
        witness: Witness::Boards,
        needs: &["sensor-board", "display-board"],
        measures: &[Measure {
            what: "versions, protocols and schemas of the two",
            unit: "",
            source: Source::Word(|sight| {
                let [one, other] =
                    [Role::Sensor, Role::Display].map(|role| sight.board(role)?.hello);
                let of = |hello: protocol::Hello| (hello.version, hello.protocol, hello.schema);
                let same = of(one?) == of(other?);
                Some(if same { "the same" } else { "not the same" }.to_owned())
            }),
            limit: Limit::Word("the same"),
            advice: Advice::Fixed("flash both boards with one build: `host-bridge flash`"),
        }],
    },
    Step {
        name: "rates",
        section: 2,
        title: "each says what it has to, as often as it has to",
        to_do: "Nothing.",
        witness: Witness::Boards,
        needs: &["sensor-board", "display-board"],
        measures: &[
            Measure {
                what: "estimates in a second of the sensor's clock",
                unit: "Hz",
                source: Source::Number(|sight| sight.estimates.rate_hz()),
                limit: Limit::Within(99.0, 101.0),
                advice: Advice::Fixed(
                    "flash a release build; if it is one, keep the log and report it",
                ),
            },
            Measure {
                what: "motions in a second of the display's clock",
                unit: "Hz",
                source: Source::Number(|sight| sight.hand.rate_hz()),
                limit: Limit::Within(495.0, 505.0),
                advice: Advice::Fixed(
                    "flash a release build; if it is one, keep the log and report it",
                ),
            },
            Measure {
                what: "samples lost or late on the sensor board",
                unit: "",
                source: Source::Number(|sight| {
                    let counters = sight.sensor()?;
                    let late =
                        counters.adc_overruns + counters.dma_overruns + counters.deadline_misses;
                    Some(late.into())
                }),
                limit: Limit::AtMost(0.0),
                advice: Advice::Fixed(
                    "flash a release build; if it is one, keep the log and report it",
                ),
            },
            Measure {
                what: "frames lost on the sensor's console",
                unit: "",
                source: Source::Number(|sight| lost_here(sight, Role::Sensor)),
                limit: Limit::AtMost(0.0),
                advice: Advice::Fixed(
                    "see USB cable and hub, and whether this computer is too busy",
                ),
            },
            Measure {
                what: "frames lost on the display's console",
                unit: "",
                source: Source::Number(|sight| lost_here(sight, Role::Display)),
                limit: Limit::AtMost(0.0),
                advice: Advice::Fixed(
                    "see USB cable and hub, and whether this computer is too busy",
                ),
            },
        ],
    },
    Step {
        name: "clocks",
        section: 4,
        title: "both clocks go as crystals do, and answers come at once",
        to_do: "Nothing.",
        witness: Witness::Boards,
        needs: &["sensor-board", "display-board"],
        measures: &[
            drift(
                "the sensor's clock against this computer's, beyond what can be told",
                Source::Number(|sight| drift_ppm(sight, Role::Sensor)),
            ),
            drift(
                "the display's clock against this computer's, beyond what can be told",
                Source::Number(|sight| drift_ppm(sight, Role::Display)),
            ),
            round_trip(
                "round trip of the sensor's console",
                Source::Number(|sight| round_trip_ms(sight, Role::Sensor)),
            ),
            round_trip(
                "round trip of the display's console",
                Source::Number(|sight| round_trip_ms(sight, Role::Display)),
            ),
        ],
    },
    Step {
        name: "starts",
        section: 4,
        title: "neither was restarted by its watchdog",
        to_do: "Nothing.",
        witness: Witness::Boards,
        needs: &["sensor-board", "display-board"],
        measures: &[
            watchdog(
                "the sensor's watchdog resets since power came on",
                Source::Number(|sight| watchdog_resets(sight, Role::Sensor)),
            ),
            watchdog(
                "the display's watchdog resets since power came on",
                Source::Number(|sight| watchdog_resets(sight, Role::Display)),
            ),
        ],
    },
];

const fn console(source: Source, advice: fn(&Sight) -> String) -> Measure {
    Measure {
        what: "its console",
        unit: "",
        source,
        limit: Limit::Word("known"),
        advice: Advice::Seen(advice),
    }
}

const fn drift(what: &'static str, source: Source) -> Measure {
    Measure {
        what,
        unit: "ppm",
        source,
        limit: Limit::AtMost(500.0),
        advice: Advice::Fixed(
            "see the 8 MHz that the ST-LINK gives the board (MCO); an emulated board needs an idle computer",
        ),
    }
}

const fn round_trip(what: &'static str, source: Source) -> Measure {
    Measure {
        what,
        unit: "ms",
        source,
        limit: Limit::AtMost(50.0),
        advice: Advice::Fixed("see whether this computer or its USB hub is too busy"),
    }
}

const fn watchdog(what: &'static str, source: Source) -> Measure {
    Measure {
        what,
        unit: "",
        source,
        limit: Limit::AtMost(0.0),
        advice: Advice::Fixed(
            "its firmware hung or panicked: keep its log and report it; power takes the count back",
        ),
    }
}

fn state(sight: &Sight, role: Role) -> Option<String> {
    Some(sight.board(role)?.state.word().to_owned())
}

fn what_to_try(sight: &Sight, role: Role) -> String {
    let Some(board) = sight.board(role) else {
        return "plug the board in at its ST-LINK's USB socket, CN1".to_owned();
    };
    let advice = board
        .state
        .advice()
        .unwrap_or("measure again: it has not answered yet");
    format!("{}: {advice}", board.state)
}

/// Frames that were lost between a board and this program, and not by other programs of ours.
fn lost_here(sight: &Sight, role: Role) -> Option<f64> {
    Some(sight.board(role)?.line_counters().lost.into())
}

/// How far a clock is off at least.
fn drift_ppm(sight: &Sight, role: Role) -> Option<f64> {
    let drift = sight.board(role)?.clock?.drift?;
    Some((drift.ppm.abs() - drift.error_ppm).max(0.0))
}

fn round_trip_ms(sight: &Sight, role: Role) -> Option<f64> {
    Some(sight.board(role)?.clock?.round_trip_us as f64 * 1e-3)
}

fn watchdog_resets(sight: &Sight, role: Role) -> Option<f64> {
    Some(sight.board(role)?.status()?.watchdog_resets.into())
}
