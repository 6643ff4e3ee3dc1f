//! `hil-sim cost`.

use std::process::ExitCode;

use hil_sim::elf::cost::count;

use super::Cost;

/// Milliseconds of samples that each part works through.
const MILLISECONDS: u64 = 1_000;
/// The parts, by number.
const PARTS: [(u64, &str); 6] = [
    (1, "band-pass and crossings of five gauges"),
    (2, "the same with the crate biquad"),
    (3, "the same with the crate idsp"),
    (0, "of each of these, crossings and loop"),
    (4, "anti-aliasing, six channels, 4 kHz to 1 kHz"),
    (5, "the whole sensor: both, counting, arm"),
];

impl Cost {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let taken = count(&self.elf)?;
        println!("| part | instructions a millisecond |");
        println!("| --- | ---: |");
        for (part, name) in PARTS {
            let count = taken.get(&part).map(|count| count.div_ceil(MILLISECONDS));
            println!(
                "| {name} | {} |",
                count.map_or("–".to_owned(), |count| count.to_string())
            );
        }
        Ok(ExitCode::SUCCESS)
    }
}
