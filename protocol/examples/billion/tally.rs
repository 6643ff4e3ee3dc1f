//! What was run so far: a file that each run adds to.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The first line of the file.
const COLUMNS: &str = "experiment,seeds,runs,refused,low_8,low_16,low_24,bad";
/// A judge says no if chance would do as badly less often than this.
const UNLIKELY: f64 = 1e-6;
/// And if a count is further from what is due than so many standard deviations.
const SIGMAS: f64 = 6.0;

/// What an experiment came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Seeds used so far, from 0 on: the next run begins with this one.
    pub seeds: u64,
    /// Executions of the decoder, or corrupted frames that reached the CRC.
    pub runs: u64,
    /// Corrupted frames that were turned away before the CRC: no COBS, or too short.
    pub refused: u64,
    /// Frames whose carried and computed CRC agree in the lowest 8 bits.
    pub low_8: u64,
    /// In the lowest 16 bits.
    pub low_16: u64,
    /// In the lowest 24 bits.
    pub low_24: u64,
    /// Executions after which something did not hold, or corrupted frames that were let through.
    pub bad: u64,
}

impl Count {
    /// Adds another run's.
    pub const fn add(&mut self, other: &Self) {
        self.seeds += other.seeds;
        self.runs += other.runs;
        self.refused += other.refused;
        self.low_8 += other.low_8;
        self.low_16 += other.low_16;
        self.low_24 += other.low_24;
        self.bad += other.bad;
    }

    const fn cells(&self) -> [u64; 7] {
        [
            self.seeds,
            self.runs,
            self.refused,
            self.low_8,
            self.low_16,
            self.low_24,
            self.bad,
        ]
    }
}

/// Experiments by name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally(BTreeMap<String, Count>);

impl Tally {
    /// Reads a tally. The error names the line, counted from 1, and what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut lines = (1..).zip(text.lines());
        if lines.next().map(|(_, line)| line) != Some(COLUMNS) {
            return Err(format!("line 1 has to be {COLUMNS}"));
        }
        let mut tally = Self::default();
        for (number, line) in lines {
            let (name, cells) = line.split_once(',').unwrap_or((line, ""));
            let cells: Result<Vec<u64>, _> = cells.split(',').map(str::parse).collect();
            let cells: Option<[u64; 7]> = cells.ok().and_then(|cells| cells.try_into().ok());
            let Some([seeds, runs, refused, low_8, low_16, low_24, bad]) = cells else {
                return Err(format!("line {number} is not a name and seven counts"));
            };
            let count = Count {
                seeds,
                runs,
                refused,
                low_8,
                low_16,
                low_24,
                bad,
            };
            if tally.0.insert(name.to_owned(), count).is_some() {
                return Err(format!("line {number}: {name} stands twice"));
            }
        }
        Ok(tally)
    }

    /// Reads the file; one that is not there is empty.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = match fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Ok(Self::default());
            }
            Err(error) => return Err(format!("{}: {error}", path.display())),
        };
        Self::parse(&text).map_err(|error| format!("{}: {error}", path.display()))
    }

    /// Writes the file, in one step: whoever stops the run loses what is not yet in it, and nothing else.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let beside = path.with_extension("new");
        fs::write(&beside, self.text())
            .and_then(|()| fs::rename(&beside, path))
            .map_err(|error| format!("{}: {error}", path.display()))
    }

    /// The file's text.
    fn text(&self) -> String {
        let mut text = format!("{COLUMNS}\n");
        for (name, count) in &self.0 {
            let cells = count.cells().map(|cell| cell.to_string()).join(",");
            let _ = writeln!(text, "{name},{cells}");
        }
        text
    }

    /// What an experiment came to so far.
    pub fn of(&self, experiment: &str) -> Count {
        self.0.get(experiment).copied().unwrap_or_default()
    }

    /// Adds a run to an experiment.
    pub fn add(&mut self, experiment: &str, run: &Count) {
        self.0.entry(experiment.to_owned()).or_default().add(run);
    }

    /// All experiments whose frames went against the CRC, added up.
    pub fn frames(&self) -> Count {
        let mut sum = Count::default();
        for (name, count) in &self.0 {
            if name != "decoder" {
                sum.add(count);
            }
        }
        sum
    }

    /// What speaks against the decoder and its CRC; nothing if all is as it should be.
    pub fn objections(&self) -> Vec<String> {
        let mut objections = Vec::new();
        let decoder = self.of("decoder");
        if decoder.bad > 0 {
            objections.push(format!("{} executions of the decoder failed", decoder.bad));
        }
        let frames = self.frames();
        let due = frames.runs as f64 / 2_f64.powi(32);
        if at_least(frames.bad, due) < UNLIKELY {
            objections.push(format!(
                "{} corrupted frames were let through, where chance lets {due:.2} through",
                frames.bad
            ));
        }
        // Of any bytes the CRC agrees by chance alone, so that the counters can be judged too.
        let any = self.of("content");
        for (bits, seen) in [(8, any.low_8), (16, any.low_16), (24, any.low_24)] {
            let due = any.runs as f64 / 2_f64.powi(bits);
            if (seen as f64 - due).abs() > SIGMAS * due.sqrt().max(1.0) {
                objections.push(format!(
                    "of any bytes, {seen} agree in the lowest {bits} bits of the CRC, where chance makes it {due:.0}"
                ));
            }
        }
        objections
    }

    /// The tables of the documents.
    pub fn tables(&self) -> String {
        let mut out =
            "| frames spoiled by | reached the CRC | turned away before it | let through | due by 2⁻³² |\n\
             | --- | ---: | ---: | ---: | ---: |\n"
                .to_owned();
        let mut row = |name: &str, count: &Count| {
            let due = count.runs as f64 / 2_f64.powi(32);
            let (runs, refused, bad) = (count.runs, count.refused, count.bad);
            let _ = writeln!(out, "| {name} | {runs} | {refused} | {bad} | {due:.3} |");
        };
        for (name, count) in &self.0 {
            if name != "decoder" {
                row(name, count);
            }
        }
        row("all of these", &self.frames());
        out += "\n| the CRC of any bytes agrees in | frames | due |\n| ---: | ---: | ---: |\n";
        let any = self.of("content");
        for (bits, seen) in [(8, any.low_8), (16, any.low_16), (24, any.low_24)] {
            let due = any.runs as f64 / 2_f64.powi(bits);
            let _ = writeln!(out, "| {bits} bits | {seen} | {due:.0} |");
        }
        let decoder = self.of("decoder");
        out += "\n| executions of the decoder | failed |\n| ---: | ---: |\n";
        let _ = writeln!(out, "| {} | {} |", decoder.runs, decoder.bad);
        out
    }
}

/// How likely chance makes it `seen` or more where `due` are due (Poisson).
fn at_least(seen: u64, due: f64) -> f64 {
    let mut term = (-due).exp();
    let mut below = 0.0;
    for n in 0..seen {
        below += term;
        term *= due / (n + 1) as f64;
    }
    // Of small ones the difference to one would be lost in rounding: the first term bounds the rest.
    if seen as f64 > due {
        (1.0 - below).max(term)
    } else {
        1.0 - below
    }
}
