//! What the sensor's parts take in the ELF, counted as `hil-sim cost` and `hil-sim chart estimators` do.

use std::collections::BTreeMap;

use hil_sim_boards::cost::{Taken, measure_example};
use hil_sim_boards::instructions::BUDGET;
use tests::elves;

/// What a board has in a millisecond.
const GIVEN: u64 = BUDGET / 1_000;
/// The whole sensor in `filter_cost`: by each method in turn, then by the spectrum where that is hardest.
const SENSORS: std::ops::RangeInclusive<u64> = 5..=12;

fn measured(example: &str) -> BTreeMap<u64, Taken> {
    measure_example(&elves::example(example), "firmware-sensor --examples")
        .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn no_sensor_ever_takes_a_sixth_of_a_millisecond() {
    let taken = measured("filter_cost");
    for part in SENSORS {
        let Taken {
            largest, pieces, ..
        } = taken[&part];
        assert_eq!(pieces, 1_000, "part {part}");
        assert!(largest <= GIVEN / 6, "part {part}: {largest}");
    }
}

#[test]
fn every_setting_and_rival_of_the_chart_comes_to_its_end() {
    let taken = measured("estimator_cost");
    assert!(taken.len() > 20, "{taken:?}");
    assert!(taken.values().all(|taken| taken.total > 0), "{taken:?}");
}
