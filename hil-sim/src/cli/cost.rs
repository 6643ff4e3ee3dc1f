//! `hil-sim cost`.

use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_boards::cost::{measure, meter};
use hil_sim_boards::cycles::CLOCK_HZ;
use hil_sim_studies::study::{Record, Table};

use super::say::say;

#[derive(Debug, clap::Args)]
pub(super) struct Cost {
    /// The ELF that exercises the filters: the example filter_cost of firmware-sensor
    #[arg(
        long,
        value_name = "ELF",
        default_value = "target/thumbv7em-none-eabihf/release/examples/filter_cost"
    )]
    elf: PathBuf,
    /// Estimates the processor's cycles of the whole sensor as well, instruction by instruction: some minutes
    #[arg(long)]
    cycles: bool,
}

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
        let or_dash = |count: Option<u64>| count.map_or("–".to_owned(), |of| of.to_string());
        let rows = PARTS.map(|(part, name)| {
            let taken = taken.get(&part);
            let mean = taken.map(|taken| taken.total.div_ceil(MILLISECONDS));
            // A part that is measured in one piece has no longest one.
            let in_pieces = taken.filter(|taken| taken.pieces > 1);
            let row = Record::default()
                .with("part", name)
                .with("instructions a millisecond:", or_dash(mean))
                .with(
                    "the longest millisecond:",
                    or_dash(in_pieces.map(|of| of.largest)),
                );
            if !self.cycles {
                return row;
            }
            let metered = taken.filter(|taken| taken.cycles > 0);
            let mean = metered.map(|taken| taken.cycles.div_ceil(MILLISECONDS));
            let longest = metered.map(|taken| taken.largest_cycles);
            let share = longest.map(|longest| 100.0 * longest as f64 / GIVEN as f64);
            let share = share.map_or("–".to_owned(), |share| format!("{share:.1} %"));
            row.with("cycles:", or_dash(mean))
                .with("the longest:", or_dash(longest))
                .with("of a millisecond:", share)
        });
        say!("{}", Table::from_iter(rows));
        Ok(ExitCode::SUCCESS)
    }
}
