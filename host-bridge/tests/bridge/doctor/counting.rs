//! Counters that count what should not be.

use host_bridge::doctor::counters;
use host_bridge::link::Missed;
use protocol::{DisplayCounters, DisplayState, PortCounters, RoleCounters, SensorCounters};

use super::bench::{display_counters, display_spoiled, one, sensor_counters, sensor_spoiled};

#[test]
fn a_count_says_whether_it_grows() {
    let advice =
        "see the wires between the boards: short, with a common ground, away from the drives";
    let corrupt = |first, last: Option<u32>| {
        sensor_spoiled(|board| {
            if let Some(status) = &mut board.first {
                status.peer.corrupt = first;
            }
            match (&mut board.last, last) {
                (Some(status), Some(count)) => status.peer.corrupt = count,
                (status, _) => *status = None,
            }
        })
    };
    for (first, last, growth) in [
        (
            5,
            Some(5),
            "5 damaged frames (corrupt), none while it was looked at",
        ),
        (
            5,
            Some(9),
            "9 damaged frames (corrupt), 4 of them while it was looked at",
        ),
        (
            0,
            Some(4),
            "4 damaged frames (corrupt), all of them while it was looked at",
        ),
        (5, None, "5 damaged frames (corrupt)"),
    ] {
        let what = format!("sensor: peer link: {growth}");
        one(&corrupt(first, last), "counter", &what, advice);
    }
}

#[test]
fn every_error_counter_of_a_port_that_grows_is_a_finding_with_advice() {
    let names = [
        "dropped",
        "lost",
        "corrupt",
        "overlong",
        "malformed",
        "overruns",
        "line_errors",
        "late",
        "duplicated",
        "foreign",
        "unheralded",
    ];
    let grown = PortCounters {
        sent: 0,
        received: 0,
        dropped: 2,
        lost: 2,
        corrupt: 2,
        overlong: 2,
        late: 2,
        duplicated: 2,
        malformed: 2,
        foreign: 2,
        unheralded: 2,
        overruns: 2,
        line_errors: 2,
    };
    let zero = PortCounters::new();
    for of in [counters::of_peer, counters::of_console] {
        let all = of(&zero, Some(&grown));
        assert_eq!(
            all.iter().map(|count| count.name).collect::<Vec<_>>(),
            names
        );
        assert!(
            all.iter()
                .all(|count| (count.count, count.grown) == (2, Some(2)))
        );
        assert!(all.iter().all(|count| count.advice.len() <= 100));
        // At rest only those that tell of a fault whenever it was.
        let at_rest = of(&grown, Some(&grown));
        let at_rest: Vec<&str> = at_rest.iter().map(|count| count.name).collect();
        assert_eq!(at_rest, names[..7]);
        assert_eq!(of(&zero, Some(&zero)), []);
    }
}

#[test]
fn what_this_end_counts_while_it_looks_is_a_finding() {
    let counted = |counters| sensor_spoiled(|board| board.counters = counters);
    one(
        &counted(PortCounters {
            lost: 7,
            ..PortCounters::new()
        }),
        "counter",
        "sensor: this end of the console: 7 frames that never came (lost), all of them while it was looked at",
        "see USB cable and hub, and whether this computer is too busy",
    );
    // What was said while the port changed hands.
    let handed_over = sensor_spoiled(|board| {
        board.counters = PortCounters {
            lost: 7,
            corrupt: 2,
            ..PortCounters::new()
        };
        board.missed = Missed {
            lost: 7,
            corrupt: 1,
        };
    });
    assert_eq!(handed_over, []);
    // The frame in whose middle the line was opened, and those before the board's Hello.
    assert_eq!(
        counted(PortCounters {
            corrupt: 1,
            unheralded: 5,
            ..PortCounters::new()
        }),
        []
    );
}

#[test]
fn what_a_sensor_counts_is_a_finding() {
    let found = sensor_spoiled(|board| {
        sensor_counters(board, |counters| {
            *counters = SensorCounters {
                samples: 1,
                adc_overruns: 2,
                dma_overruns: 3,
                deadline_misses: 4,
                estimates: 5,
                motions: 6,
                stopped: None,
            };
        });
    });
    assert_eq!(
        found.iter().map(ToString::to_string).collect::<Vec<_>>(),
        [
            "sensor: board: 2 conversions lost by the ADC (adc_overruns), none while it was looked at",
            "sensor: board: 3 times that scans were lost (dma_overruns), none while it was looked at",
            "sensor: board: 4 samples that were done too late (deadline_misses), none while it was looked at",
        ]
    );
}

#[test]
fn what_a_display_counts_is_a_finding() {
    let spoil = |counters: &mut DisplayCounters| {
        *counters = DisplayCounters {
            ticks: 9,
            updates: 9,
            estimates: 9,
            fades: 9,
            changes: 9,
            deadline_misses: 1,
            spi_errors: 2,
            converter_faults: 3,
            clears: 4,
            encoder_jumps: 5,
            unheard: 6,
            flooded: 7,
            implausible: 8,
            refused_estimates: 9,
            state: DisplayState::Driving,
        };
    };
    let found = display_spoiled(|board| display_counters(board, spoil));
    let names: Vec<&str> = found
        .iter()
        .filter_map(|finding| finding.what.split(['(', ')']).nth(1))
        .collect();
    // Of the last two a specimen's edge, or an estimate that came late, makes one now and then.
    let at_rest = [
        "deadline_misses",
        "spi_errors",
        "converter_faults",
        "clears",
        "encoder_jumps",
        "unheard",
        "flooded",
    ];
    assert_eq!(names, at_rest);
    let grown = display_spoiled(|board| {
        if let Some(status) = &mut board.last
            && let RoleCounters::Display(counters) = &mut status.role
        {
            counters.implausible = 1;
            counters.refused_estimates = 1;
        }
    });
    assert_eq!(
        grown.iter().map(ToString::to_string).collect::<Vec<_>>(),
        [
            "display: board: 1 estimates that can't be true (implausible), all of them while it was looked at",
            "display: board: 1 estimates that were old or out of range (refused_estimates), \
             all of them while it was looked at",
        ]
    );
}
