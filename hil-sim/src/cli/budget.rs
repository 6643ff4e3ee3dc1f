//! `hil-sim budget`.

use std::collections::{BTreeMap, BTreeSet};
use std::process::ExitCode;

use hil_sim_boards::cycles::CLOCK_HZ;
use hil_sim_boards::display_alone::DisplayBench;
use hil_sim_boards::instructions::{self, BUDGET, Counted, Cycles};
use hil_sim_core::scene::Motion;
use hil_sim_studies::display::{RICH_TEXTURE, rendering_of_word};
use hil_sim_studies::study::{Record, Table};
use protocol::{DisplayConfiguration, Mode, Rendering, UpdateRate};

use super::say::say;
use super::{DisplayElf, status};

/// Of all instructions, the display may take this many at 2 kHz, in percent: of the sine, and of more than that.
const GOAL_PERCENT: f64 = 15.0;
const RICH_GOAL_PERCENT: f64 = 20.0;
/// The hand's speed, in mm/s, and λ, in mm: every word changes at every tick.
const SPEED_MM_S: f64 = 70.0;
const WAVELENGTH_MM: f64 = 2.0;
/// λ of what is more than a sine: of a longer wave all parts are played.
const RICH_WAVELENGTH_MM: f64 = 4.0;
/// Before the count, in s: what fades in, glides and settles has done so.
const SETTLING_S: f64 = 1.0;
/// Counted for so long, in s: ten estimates, fifty motions.
const COUNTED_S: f64 = 0.1;
/// What a place belongs to, by the beginning of its name; a file of the display's that is not here is a
/// part of its own.
const PARTS: [(&str, &str); 22] = [
    ("firmware-display/hand", "hand and phase"),
    ("firmware-display/phase", "hand and phase"),
    ("firmware-display/sine", "sines"),
    ("firmware-display/wave", "wave: partials, roll-off, glide"),
    ("firmware-display/grain", "wave: the random part"),
    ("firmware-display/skin", "wave: lanes, models"),
    ("firmware-display/order", "supervisor"),
    ("firmware-display/relief", "supervisor"),
    ("firmware-display/display.rs", "supervisor"),
    ("firmware-display/supervisor", "supervisor"),
    ("firmware-display/plausibility", "supervisor"),
    ("firmware-display/fade", "supervisor"),
    ("firmware-display/dac81416", "frames"),
    ("firmware-display/chain", "DMA, its interrupts and LDAC"),
    ("firmware-display/board", "pins and timers"),
    ("firmware-display/tasks", "tasks"),
    ("firmware-display/main", "tasks"),
    ("firmware-display/lib", "tasks"),
    ("firmware-display/settings", "settings"),
    ("protocol", "ports: frames of the link"),
    ("compiler", "memory and arithmetic routines"),
    ("core", "memory and arithmetic routines"),
];
/// Crates by which the ports speak.
const SPEECH: [&str; 5] = ["serde", "postcard", "cobs", "crc", "heapless"];

/// What is said of the processor's cycles, all of it estimated: least and most, and the most without the flash's
/// accelerator in brackets.
type Estimated = fn(&Counted, &Cycles) -> f64;
const CYCLES: [(&str, Estimated); 5] = [
    ("cycles", |counted, cycles| {
        cycles.total as f64 / counted.ticks as f64
    }),
    ("cycles, the tick with the most", |_, cycles| {
        cycles.worst_tick as f64
    }),
    ("that, in percent of a tick", |counted, cycles| {
        let tick = CLOCK_HZ as f64 * counted.counted_s / counted.ticks as f64;
        100.0 * cycles.worst_tick as f64 / tick
    }),
    ("from tick to first word, µs, the longest", |_, cycles| {
        1e6 * cycles.worst_start as f64 / CLOCK_HZ as f64
    }),
    (
        "until the words are out, µs, the longest",
        |counted, cycles| {
            1e6 * cycles.worst_start as f64 / CLOCK_HZ as f64 + counted.transfer_ns as f64 * 1e-3
        },
    ),
];

#[derive(Debug, clap::Args)]
pub(super) struct Budget {
    #[command(flatten)]
    elf: DisplayElf,
    /// A little of it only, to see that it works
    #[arg(long)]
    quick: bool,
    /// How much of the surface is played: fundamental, shape or texture; more than the fundamental may take 20 %
    #[arg(long, value_name = "RENDERING", default_value = "fundamental", value_parser = rendering_of_word)]
    rendering: Rendering,
    /// Functions as well, and files, of the last column
    #[arg(long)]
    closer: bool,
}

impl Budget {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let firmware = self.elf.read()?;
        let is_rich = self.rendering != Rendering::Fundamental;
        let (wavelength_mm, goal, words) = if is_rich {
            let word = self.rendering.name();
            (RICH_WAVELENGTH_MM, RICH_GOAL_PERCENT, format!(" {word}"))
        } else {
            (WAVELENGTH_MM, GOAL_PERCENT, String::new())
        };
        let rates = [UpdateRate::Hz2000, UpdateRate::Hz4000];
        let mut columns: Vec<Column> = Vec::new();
        for &update_rate in &rates[..if self.quick { 1 } else { 2 }] {
            for mode in [Mode::Uniform, Mode::Travelling] {
                let motion = Motion::Constant {
                    speed_mm_s: SPEED_MM_S,
                };
                let alone = DisplayBench {
                    configuration: DisplayConfiguration {
                        mode,
                        rendering: self.rendering,
                        update_rate,
                        ..DisplayConfiguration::DEFAULT
                    },
                    texture: is_rich.then_some(RICH_TEXTURE),
                    ..DisplayBench::new(motion, wavelength_mm, SETTLING_S + COUNTED_S)
                };
                let counted = instructions::count(alone, &firmware, COUNTED_S)?;
                let head = format!("{} Hz {}{words}:", update_rate.hz(), mode.name());
                columns.push((head, counted));
            }
        }
        print(&columns);
        if self.closer
            && let Some((_, counted)) = columns.last()
        {
            say!("");
            let places = counted.by_place.iter().chain(&counted.by_function);
            let mut places: Vec<(&String, &u64)> = places.collect();
            places.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
            for (place, count) in places {
                say!("{:10.1} {place}", *count as f64 / counted.ticks as f64);
            }
        }
        let mut judged = columns.iter().filter(|(head, _)| head.starts_with("2000"));
        Ok(status(judged.all(|(_, counted)| percent(counted) <= goal)))
    }
}

type Column = (String, Counted);

fn print(columns: &[Column]) {
    let row = |name: String, value: &dyn Fn(usize, &Counted) -> String| {
        let row = Record::default().with("instructions an update", name);
        columns
            .iter()
            .enumerate()
            .fold(row, |row, (index, (head, counted))| {
                row.with(head.clone(), value(index, counted))
            })
    };
    let an_update =
        |count: u64, counted: &Counted| format!("{:.1}", count as f64 / counted.ticks as f64);
    let mut parts: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (index, (_, counted)) in columns.iter().enumerate() {
        for (place, &count) in &counted.by_place {
            let part = parts.entry(part_of(place));
            let counts = part.or_insert_with(|| vec![0.0; columns.len()]);
            counts[index] += count as f64 / counted.ticks as f64;
        }
    }
    let mut parts: Vec<(String, Vec<f64>)> = parts.into_iter().collect();
    let whole = |counts: &[f64]| counts.iter().sum::<f64>();
    parts.sort_by(|one, other| whole(&other.1).total_cmp(&whole(&one.1)));
    let parts = parts.into_iter();
    let mut rows: Vec<Record> = parts
        .map(|(part, counts)| row(part, &|index, _| format!("{:.1}", counts[index])))
        .collect();
    rows.push(row("**in all**".to_owned(), &|_, counted| {
        an_update(counted.total, counted)
    }));
    for (name, of) in CYCLES {
        rows.push(row(name.to_owned(), &|_, counted| {
            let told = counted
                .cycles
                .map(|cycles| format!("{:.1}", of(counted, &cycles)));
            let [least, most, bare] = told;
            format!("{least} to {most} ({bare})")
        }));
    }
    let budget = format!("**% of {} M instructions a second**", BUDGET / 1_000_000);
    rows.push(row(budget, &|_, counted| {
        format!("{:.2}", percent(counted))
    }));
    let peripherals = columns
        .iter()
        .flat_map(|(_, counted)| counted.accesses.keys().copied());
    let peripherals: BTreeSet<&str> = peripherals.collect();
    for of in peripherals.into_iter().map(Some).chain([None]) {
        let name = format!("accesses to registers: {}", of.unwrap_or("in all"));
        rows.push(row(name, &|_, counted| {
            let accesses = counted.accesses.iter();
            let counts = accesses.filter(|(name, _)| of.is_none_or(|of| of == **name));
            an_update(counts.map(|(_, count)| count).sum(), counted)
        }));
    }
    say!("{}", Table::from_iter(rows));
}

fn percent(counted: &Counted) -> f64 {
    100.0 * counted.total as f64 / counted.counted_s / BUDGET as f64
}

fn part_of(place: &str) -> String {
    if let Some((_, part)) = PARTS.iter().find(|(start, _)| place.starts_with(start)) {
        return (*part).to_owned();
    }
    if let Some(file) = place.strip_prefix("firmware-display/") {
        return file.trim_end_matches(".rs").to_owned();
    }
    if SPEECH.iter().any(|start| place.starts_with(start)) {
        return "ports: frames of the link".to_owned();
    }
    "executor and hardware abstraction".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_file_of_the_display_is_a_part_of_its_own() {
        assert_eq!(part_of("firmware-display/balance.rs"), "balance");
        assert_eq!(part_of("firmware-display/sine.rs"), "sines");
        assert_eq!(
            part_of("protocol/nucleo/ports.rs"),
            "ports: frames of the link"
        );
        assert_eq!(part_of("serde_core"), "ports: frames of the link");
        assert_eq!(
            part_of("embassy-executor"),
            "executor and hardware abstraction"
        );
        assert_eq!(
            part_of("compiler-builtins"),
            "memory and arithmetic routines"
        );
    }
}
