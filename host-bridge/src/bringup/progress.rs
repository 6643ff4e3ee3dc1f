//! How far a bench has been brought up: the state file, which is also the report for scripts.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use protocol::{PROTOCOL_VERSION, SCHEMA_HASH};
use serde::{Deserialize, Serialize};

use super::step;
use super::step::{Figure, Step};
use crate::output_file;

const FORMAT: u32 = 1;

/// How a step went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Every figure is within its limit.
    Passed,
    /// One is not.
    Failed,
    /// It was not tried: [`Record::note`] says why.
    LeftOut,
    /// It was not tried, because a step that it needs has not passed.
    Blocked,
}

impl Outcome {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "FAILED",
            Self::LeftOut => "left out",
            Self::Blocked => "blocked",
        }
    }

    /// Whether nothing speaks against what comes after it.
    pub const fn is_done(self) -> bool {
        matches!(self, Self::Passed | Self::LeftOut)
    }
}

/// What became of a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// [`Step::name`]
    pub step: String,
    pub outcome: Outcome,
    /// Why it was not tried.
    pub note: Option<String>,
    /// When, in s since 1970.
    pub at_unix_s: u64,
    /// How long the boards were listened to, in s.
    pub looked_s: f64,
    pub figures: Vec<Figure>,
}

/// Everything that is known of a bench that is being brought up. Fields are only ever added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    format: u32,
    pub program: String,
    pub protocol: u16,
    /// Its schema, 16 hexadecimal digits.
    pub schema: String,
    /// What was tried, in the steps' order.
    pub steps: Vec<Record>,
    /// What `host-bridge doctor --json` would have said at the last look: the boards' versions, ports and counters,
    /// and the serial numbers of the ST-LINKs.
    pub doctor: serde_json::Value,
}

/// Why the state file can't be used.
#[derive(Debug, thiserror::Error)]
pub enum ProgressError {
    #[error("{0}: can't be used as the state of a bring-up: {1}: give another by --state")]
    File(PathBuf, #[source] io::Error),
    #[error("{0}: is no state of a bring-up ({1}): give another by --state, or remove it")]
    Malformed(PathBuf, #[source] serde_json::Error),
    #[error("{0}: is of format {1}, this program writes {FORMAT}: give another by --state")]
    Format(PathBuf, u32),
}

impl Default for Progress {
    fn default() -> Self {
        Self {
            format: FORMAT,
            program: crate::PROGRAM.to_owned(),
            protocol: PROTOCOL_VERSION,
            schema: format!("{SCHEMA_HASH:016x}"),
            steps: Vec::new(),
            doctor: serde_json::Value::Null,
        }
    }
}

impl Progress {
    /// What `path` holds; nothing tried yet if it is not there. Fails if it can't be read, or is something else.
    pub fn read(path: &Path) -> Result<Self, ProgressError> {
        let text = match fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Self::default()),
            Err(source) => {
                return Err(ProgressError::File(path.to_owned(), source));
            }
        };
        let kept: Self = serde_json::from_str(&text)
            .map_err(|source| ProgressError::Malformed(path.to_owned(), source))?;
        if kept.format != FORMAT {
            return Err(ProgressError::Format(path.to_owned(), kept.format));
        }
        Ok(Self {
            steps: kept.steps,
            doctor: kept.doctor,
            ..Self::default()
        })
    }

    /// Writes it as a whole, in the place of what was there. Fails if it can't be written.
    pub fn write(&self, path: &Path) -> Result<(), ProgressError> {
        // Nothing in it can fail to be written: every key is a string.
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        output_file::replaced_by(path, |path| fs::write(path, text))
            .map_err(|source| ProgressError::File(path.to_owned(), source))
    }

    /// What became of a step, if it was tried.
    pub fn record(&self, step: &str) -> Option<&Record> {
        self.steps.iter().find(|record| record.step == step)
    }

    /// Keeps what became of a step, in the place of what was known of it.
    pub fn put(
        &mut self,
        step: &Step,
        outcome: Outcome,
        note: Option<String>,
        figures: Vec<Figure>,
        looked_s: f64,
    ) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        self.forget(step);
        self.steps.push(Record {
            step: step.name.clone(),
            outcome,
            note,
            at_unix_s: now.map_or(0, |since| since.as_secs()),
            looked_s,
            figures,
        });
        let place = |name: &str| step::all().position(|step| step.name == name);
        self.steps.sort_by_key(|record| place(&record.step));
    }

    /// Nothing is known of a step any more, nor of those that it guards: these were measured under what it found before.
    /// True if anything was.
    pub fn forget(&mut self, step: &Step) -> bool {
        let known = self.steps.len();
        let is_guarded = |record: &Record| {
            let guards = step::named(&record.step).map(|of| &of.guarded_by);
            guards.is_some_and(|guards| guards.contains(&step.name))
        };
        self.steps
            .retain(|record| record.step != step.name && !is_guarded(record));
        self.steps.len() < known
    }

    /// The step that has to pass before `step` is harmless, and has not.
    pub fn unguarded<'s>(&self, step: &'s Step) -> Option<&'s str> {
        let has_passed = |guard: &&str| {
            let record = self.record(guard);
            record.is_some_and(|record| record.outcome == Outcome::Passed)
        };
        let mut guards = step.guarded_by.iter().map(String::as_str);
        guards.find(|guard| !has_passed(guard))
    }

    /// The step that `step` needs and that was tried in vain.
    pub fn blocks<'s>(&self, step: &'s Step) -> Option<&'s str> {
        let mut needs = step.needs.iter().map(String::as_str);
        needs.find(|need| {
            let record = self.record(need);
            record.is_some_and(|record| !record.outcome.is_done())
        })
    }

    /// The first step that has not been done.
    pub fn due(&self) -> Option<&'static Step> {
        step::all().find(|step| {
            let record = self.record(&step.name);
            record.is_none_or(|record| !record.outcome.is_done())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bringup::quantity::Value;
    use crate::bringup::sight::Sight;

    fn step(name: &str) -> &'static Step {
        step::named(name).expect("a step of that name")
    }

    #[test]
    fn what_is_written_is_read_again() {
        let mut progress = Progress::default();
        for value in [None, Some(100.0), Some(-0.125)] {
            let step = step("rates");
            let mut figures = step.judge(&Sight::default(), |_| None);
            figures[0].value = value.map(Value::Number);
            figures[1].value = Some(Value::Word("the same".to_owned()));
            progress.put(step, Outcome::Failed, Some("why".to_owned()), figures, 2.5);
            let path = std::env::temp_dir().join(format!("bringup-{}.json", std::process::id()));
            progress.write(&path).expect("a file");
            let again = Progress::read(&path);
            fs::remove_file(&path).expect("a file");
            assert_eq!(again.expect("a state"), progress);
        }
    }

    #[test]
    fn what_was_done_is_not_due_and_what_failed_blocks_what_needs_it() {
        let mut progress = Progress::default();
        assert_eq!(progress.due().map(|due| due.name.as_str()), Some("usb"));
        progress.put(step("usb"), Outcome::LeftOut, None, Vec::new(), 0.0);
        progress.put(
            step("display-board"),
            Outcome::Passed,
            None,
            Vec::new(),
            1.0,
        );
        progress.put(step("sensor-board"), Outcome::Failed, None, Vec::new(), 1.0);
        assert_eq!(
            progress.due().map(|due| due.name.as_str()),
            Some("sensor-board")
        );
        assert_eq!(progress.blocks(step("rates")), Some("sensor-board"));
        // Of what was not tried nothing is known.
        assert_eq!(progress.blocks(step("link-rate")), None);
        progress.put(step("sensor-board"), Outcome::Passed, None, Vec::new(), 1.0);
        assert_eq!(progress.blocks(step("rates")), None);
        // A finger asks for more.
        let finger = step("finger");
        for (guard, next) in [
            ("zero-volt", Some("emergency-press")),
            ("emergency-press", Some("insulation")),
            ("insulation", Some("leakage")),
            ("leakage", None),
        ] {
            for outcome in [Outcome::Failed, Outcome::LeftOut, Outcome::Blocked] {
                progress.put(step(guard), outcome, None, Vec::new(), 0.0);
                assert_eq!(progress.unguarded(finger), Some(guard), "{outcome:?}");
            }
            progress.put(step(guard), Outcome::Passed, None, Vec::new(), 0.0);
            assert_eq!(progress.unguarded(finger), next);
        }
        // Another film: what leaked through the one before tells nothing.
        progress.put(step("insulation"), Outcome::Passed, None, Vec::new(), 0.0);
        assert_eq!(progress.unguarded(finger), Some("leakage"));
        progress.put(step("leakage"), Outcome::Passed, None, Vec::new(), 0.0);
        assert_eq!(progress.unguarded(finger), None);
        // Who leaves while it is measured has not measured it.
        assert!(progress.forget(step("leakage")));
        assert_eq!(progress.unguarded(finger), Some("leakage"));
        assert!(!progress.forget(step("leakage")));
        let order: Vec<&str> = progress
            .steps
            .iter()
            .map(|record| record.step.as_str())
            .collect();
        assert_eq!(order[..3], ["usb", "sensor-board", "display-board"]);
    }
}
