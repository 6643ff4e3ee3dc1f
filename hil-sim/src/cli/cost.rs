//! `hil-sim cost`.

use std::process::ExitCode;

use hil_sim_boards::cost::{measure, meter};
use hil_sim_boards::cycles::CLOCK_HZ;
use hil_sim_studies::study::Table;

use super::Cost;
use super::say::say;

/// Milliseconds of samples that each part works through.
const MILLISECONDS: u64 = 1_000;
/// What a board has in a millisecond, in cycles.
const GIVEN: u64 = CLOCK_HZ / 1_000;
/// The parts from this one on are the whole sensor.
const WHOLE: u64 = 5;
/// The parts, by number.
const PARTS: [(u64, &str); 13] = [
    (1, "band-pass and crossings of five gauges"),
    (2, "the same with the crate biquad"),
    (3, "the same with the crate idsp"),
    (0, "of each of these, crossings and loop"),
    (4, "anti-aliasing, six channels, 4 kHz to 1 kHz"),
    (5, "the whole sensor, counting"),
    (6, "the whole sensor, adapted counting"),
    (7, "the whole sensor, crossings"),
    (8, "the whole sensor, spectrum"),
    (9, "the same, 1 mm at 70 mm/s"),
    (10, "that, noise as strong as the signal"),
    (11, "that at 20 dB, hum as large as the signal"),
    (12, "the same, 4 mm at 30 mm/s, two waves"),
];

impl Cost {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let taken = if self.cycles {
            meter(&self.elf, WHOLE)?
        } else {
            measure(&self.elf)?
        };
        let mut heads = vec![
            "part",
            "instructions a millisecond:",
            "the longest millisecond:",
        ];
        if self.cycles {
            heads.extend(["cycles:", "the longest:", "of a millisecond:"]);
        }
        let mut table = Table::new(&heads);
        let or_dash =
            |count: Option<u64>| count.map_or("–".to_owned(), |count| count.to_string());
        for (part, name) in PARTS {
            let taken = taken.get(&part);
            let mean = taken.map(|taken| taken.total.div_ceil(MILLISECONDS));
            // A part that is measured in one piece has no longest one.
            let largest = taken
                .filter(|taken| taken.pieces > 1)
                .map(|taken| taken.largest);
            let mut row = vec![name.to_owned(), or_dash(mean), or_dash(largest)];
            if self.cycles {
                let metered = taken.filter(|taken| taken.cycles > 0);
                row.push(or_dash(
                    metered.map(|taken| taken.cycles.div_ceil(MILLISECONDS)),
                ));
                row.push(or_dash(metered.map(|taken| taken.largest_cycles)));
                row.push(metered.map_or("–".to_owned(), |taken| {
                    let share = taken.largest_cycles as f64 / GIVEN as f64;
                    format!("{:.1} %", 100.0 * share)
                }));
            }
            table.row(row);
        }
        say!("{table}");
        Ok(ExitCode::SUCCESS)
    }
}
