//! A billion executions of the decoder and a billion corrupted frames against its CRC, as far as time goes: each
//! call adds to the tally and uses seeds that no call used before.
//!
//! ```sh
//! cargo run --release --example billion -- decoder 1000000000
//! cargo run --release --example billion -- crc 1000000000
//! cargo run --release --example billion                        # the tables
//! ```
//!
//! The status is 1 if the tally speaks against decoder or CRC, and 2 if it can't be used.

mod corrupted;
mod draw;
mod inputs;
mod receiver;
mod tally;
/// The tests' messages.
#[path = "../../tests/protocol"]
mod tests {
    pub mod messages;
}

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::ExitCode;
use std::thread;

use protocol::{Message, Receiver, frame};

use corrupted::{Corruptor, Spoiling};
use draw::Draw;
use inputs::Inputs;
use receiver::Judge;
use tally::{Count, Tally};

/// The tally, which is committed.
const TALLY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/billion/tally.csv");
/// Executions, or frames of each kind that reach the CRC, of one seed.
const RUNS_A_SEED: u64 = 1_000_000;

const USAGE: &str = "billion: say 'decoder EXECUTIONS' or 'crc FRAMES', or nothing for the tables";

fn main() -> ExitCode {
    match run() {
        Ok(objections) if objections.is_empty() => ExitCode::SUCCESS,
        Ok(objections) => {
            for objection in objections {
                eprintln!("billion: {objection}");
            }
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("billion: {error}");
            ExitCode::from(2)
        }
    }
}

/// Does what the command line says. What the tally then speaks against.
fn run() -> Result<Vec<String>, String> {
    let path = Path::new(TALLY);
    let mut tally = Tally::read(path)?;
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (experiments, runs) = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => (Vec::new(), "0"),
        ["decoder", runs] => (vec![None], runs),
        ["crc", runs] => (Spoiling::ALL.map(Some).to_vec(), runs),
        _ => return Err(USAGE.to_owned()),
    };
    let runs: u64 = runs.parse().map_err(|_| USAGE.to_owned())?;
    for &experiment in &experiments {
        let name = experiment.map_or("decoder", Spoiling::name);
        let seeds = runs.div_ceil(RUNS_A_SEED * experiments.len() as u64);
        let mut done = 0;
        while done < seeds {
            let first = tally.of(name).seeds;
            // A round on all cores; the tally knows of whole rounds only, so that no seed is left out.
            let cores = thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
            let round = (seeds - done).min(4 * cores);
            tally.add(name, &on_all_cores(first..first + round, cores, experiment));
            tally.write(path)?;
            done += round;
        }
    }
    print!("{}", tally.tables());
    Ok(tally.objections())
}

/// The seeds of a round, shared by `cores` threads.
fn on_all_cores(seeds: std::ops::Range<u64>, cores: u64, experiment: Option<Spoiling>) -> Count {
    let mut sum = Count::default();
    thread::scope(|scope| {
        let threads: Vec<_> = (0..cores)
            .map(|nth| {
                let seeds = seeds.clone().skip(nth as usize).step_by(cores as usize);
                scope.spawn(move || {
                    let mut own = Count::default();
                    for seed in seeds {
                        own.add(&match experiment {
                            None => decoder(seed),
                            Some(spoiling) => crc(seed, spoiling),
                        });
                    }
                    own
                })
            })
            .collect();
        for thread in threads {
            sum.add(&thread.join().expect("what panics is caught in the thread"));
        }
    });
    sum
}

fn samples() -> Vec<Message> {
    let samples = tests::messages::samples().into_iter();
    samples.map(|(_, message)| message).collect()
}

/// Executions of the decoder, by one seed. Those that fail are printed.
fn decoder(seed: u64) -> Count {
    let mut draw = Draw::new(seed);
    let mut inputs = Inputs::new(&samples());
    let mut judge = Judge::new();
    let mut count = Count {
        seeds: 1,
        runs: RUNS_A_SEED,
        ..Count::default()
    };
    for _ in 0..RUNS_A_SEED {
        let input = inputs.next(&mut draw);
        let verdict = catch_unwind(AssertUnwindSafe(|| judge.judge::<Receiver>(input)));
        if let Err(why) = verdict.unwrap_or(Err("it panics")) {
            count.bad += 1;
            eprintln!("billion: seed {seed}: {why}: {input:02x?}");
        }
    }
    count
}

/// Corrupted frames against the CRC, by one seed.
fn crc(seed: u64, spoiling: Spoiling) -> Count {
    // Each spoiling has seeds of its own.
    let mut draw = Draw::new(seed << 8 | 0x80 | spoiling as u64);
    let mut corruptor = Corruptor::new(&samples());
    Count {
        seeds: 1,
        ..corruptor.run(spoiling, RUNS_A_SEED, &mut draw, frame::decode)
    }
}
