//! What the boards say of themselves: log lines by defmt, counters by Status.

use std::sync::LazyLock;

use protocol::{PortCounters, ResetCause, RoleCounters, Status};
use tests::run::{Run, scene};

static RUN: LazyLock<Run> = LazyLock::new(|| {
    Run::of(scene(
        r#"
        duration_s = 2.2

        [surface]
        specimens = [{ wavelength_mm = 2.0 }]
        "#,
    ))
});

fn lines(board: &str) -> Vec<&str> {
    let of_board = |&(_, from, ref line): &'static (u64, &str, String)| {
        (from == board).then_some(line.as_str())
    };
    RUN.recording.log.iter().filter_map(of_board).collect()
}

#[test]
fn prints() {
    println!(
        "{:#?} {:#?} {:?} {:?} {:?}",
        lines("sensor"),
        lines("display"),
        RUN.recording.sensor_status,
        RUN.recording.display_status,
        RUN.facts
    );
}
