//! `hil-sim cost`.

use std::process::ExitCode;

use hil_sim::elf::cost::count;

use super::Cost;

/// Milliseconds of samples that each part works through.
const MILLISECONDS: u64 = 1_000;
/// The part that only loops.
const EMPTY: u64 = 0;
/// The other parts: number, name, and whether its loop is the empty part's.
const PARTS: [(u64, &str, bool); 5] = [
    (1, "band-pass and crossings of five gauges", true),
    (2, "the same with the crate biquad", true),
    (3, "the same with the crate idsp", true),
    (4, "anti-aliasing, six channels, 4 kHz to 1 kHz", false),
    (5, "the whole sensor: both, counting, arm", false),
];

impl Cost {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let taken = count(&self.elf)?;
        let empty = taken.get(&EMPTY).copied().unwrap_or(0);
        println!("| part | instructions a millisecond |");
        println!("| --- | ---: |");
        for (part, name, in_empty_loop) in PARTS {
            let loop_of_its_own = if in_empty_loop { empty } else { 0 };
            let count = taken.get(&part).map(|&count| count.saturating_sub(loop_of_its_own));
            let count = count.map_or("–".to_owned(), |count| (count / MILLISECONDS).to_string());
            println!("| {name} | {count} |");
        }
        Ok(ExitCode::SUCCESS)
    }
}
