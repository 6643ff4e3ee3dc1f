//! `host-bridge bringup`.

use std::fmt::Write as _;
use std::fs;
use std::io::{self, IsTerminal, Write as _};
use std::path::{Path, PathBuf};

use crate::bench::Bench;
use crate::bringup::progress::{Outcome, Progress};
use crate::bringup::quantity::Value;
use crate::bringup::sight::{Sight, Wanted};
use crate::bringup::step::{Figure, Limit, Measure, Step, Witness};
use crate::bringup::{report, step};
use crate::doctor::{findings, json};
use crate::output_file;
use anyhow::Context;
use clap::ValueHint;

use super::desk::Desk;

pub const ABOUT: &str = "\
Brings a bench up, one step at a time: says what to wire, measures, compares, and says what to try. It begins \
where it ended the last time, by the state file, and leaves a report as HTML beside it. Both files can be sent \
to whoever helps.

No step was ever tried on hardware: only on emulated boards.";

pub const EXAMPLES: &str = "\
Examples:
  host-bridge bringup                          step by step, from where it ended
  host-bridge bringup --list                   the steps, and how far this bench is
  host-bridge bringup --from link-to-display   from this step on
  host-bridge bringup --yes                    measures all at once, asks nothing
  host-bridge bringup --yes --only drive       this one alone

Exit status: 0 if every step that was tried has passed, 1 if one has not, or the bring-up was left before its
end, 2 if it can't be done.";

/// How long the boards are listened to for a step, in s of their own clocks: two statuses, and a hand that moves.
const SPAN_S: f64 = 2.5;

/// What `bringup` is asked for.
#[derive(Debug, clap::Args)]
pub struct Bringup {
    #[command(flatten)]
    boards: super::Where,
    /// Where it is kept how far the bench is: JSON, with every figure; the report is beside it, as .html
    #[arg(long, value_name = "FILE", default_value = "bringup.json", value_hint = ValueHint::FilePath)]
    state: PathBuf,
    /// Begins at this step, whatever has been done
    #[arg(long, value_name = "STEP", value_parser = named)]
    from: Option<&'static Step>,
    /// Does this step alone
    #[arg(long, value_name = "STEP", value_parser = named, conflicts_with = "from")]
    only: Option<&'static Step>,
    /// Measures all at once and asks nothing: the bench is wired and its hand moves to the right. What needs a
    /// person is left out
    #[arg(long)]
    yes: bool,
    /// Lists the steps and how each went, and does nothing
    #[arg(long)]
    list: bool,
}

fn named(name: &str) -> Result<&'static Step, String> {
    step::named(name).ok_or_else(|| "no such step; --list names them all".to_owned())
}

impl Bringup {
    /// Does it at `desk`: the exit status.
    pub fn execute(self, desk: &mut Desk) -> anyhow::Result<u8> {
        let progress = Progress::read(&self.state)?;
        let report = report_path(&self.state);
        let is_report = |text: String| text.starts_with(report::BEGINNING);
        anyhow::ensure!(
            report != self.state
                && (!report.exists() || fs::read_to_string(&report).is_ok_and(is_report)),
            "{}: is where the report goes, and no report: give another --state, such as bringup.json",
            report.display()
        );
        if self.list {
            desk.print(&list(&progress))?;
            return Ok(0);
        }
        let bench = self.boards.find()?;
        anyhow::ensure!(
            bench.roles().len() == 2,
            "the bench names one board only: bringup needs both, name the other by --sensor or --display"
        );
        let due = self.due(&progress);
        if due.is_empty() {
            desk.print("every step is done; --from STEP does it and those after it again")?;
            return Ok(0);
        }
        let mut session = Session {
            bench,
            progress,
            path: self.state,
            desk,
            is_named: self.only.is_some(),
        };
        let is_done = if self.yes {
            session.measure_all(&due)?
        } else {
            session.converse(&due)?
        };
        session.save()?;
        let passed = due.iter().all(|step| {
            let record = session.progress.record(&step.name);
            record.is_some_and(|record| record.outcome.is_done())
        });
        session.desk.print(&format!(
            "\n{}\n{}",
            session.path.display(),
            report_path(&session.path).display()
        ))?;
        Ok(u8::from(!(passed && is_done)))
    }

    /// The steps to be done.
    fn due(&self, progress: &Progress) -> Vec<&'static Step> {
        if let Some(only) = self.only {
            return vec![only];
        }
        let Some(first) = self.from.or_else(|| progress.due()) else {
            return Vec::new();
        };
        step::all()
            .skip_while(|step| step.name != first.name)
            .collect()
    }
}

fn report_path(state: &Path) -> PathBuf {
    state.with_extension("html")
}

fn list(progress: &Progress) -> String {
    let mut out = String::new();
    for step in step::all() {
        let record = progress.record(&step.name);
        let outcome = record.map_or("-", |record| record.outcome.name());
        let _ = writeln!(
            out,
            "{:<18}{outcome:<10}{} (section {})",
            step.name, step.title, step.section
        );
    }
    out
}

/// A bench that is being brought up.
struct Session<'a> {
    desk: &'a mut Desk,
    bench: Bench,
    progress: Progress,
    path: PathBuf,
    /// Whether the step was asked for by its name: then it is tried whoever it needs.
    is_named: bool,
}

/// What a person wants after a step was measured, or before.
enum Answer {
    Measure,
    Skip,
    Quit,
}

impl Session<'_> {
    /// Measures every step of `due` in one look; true if it was not interrupted.
    fn measure_all(&mut self, due: &[&'static Step]) -> anyhow::Result<bool> {
        let sets_amplitude = due.iter().any(|step| step.sets_amplitude && !step.asks());
        let sight = self.look(sets_amplitude);
        if self.desk.is_ended() {
            return Ok(false);
        }
        for step in due {
            let is_of_person = step.witness == Witness::Person && !self.is_named;
            if let Some(note) = self.reason_to_leave(step) {
                self.leave(step, Outcome::LeftOut, note)?;
            } else if is_of_person || step.asks() {
                self.leave(step, Outcome::LeftOut, "it needs a person".to_owned())?;
            } else if let Some(need) = self.progress.blocks(step).filter(|_| !self.is_named) {
                self.leave(step, Outcome::Blocked, format!("by {need}"))?;
            } else {
                let figures = step.judge(&sight, |_| None);
                self.keep(step, figures, &sight)?;
            }
        }
        Ok(true)
    }

    /// Goes through `due` with a person; true if it was not left before its end.
    fn converse(&mut self, due: &[&'static Step]) -> anyhow::Result<bool> {
        for step in due {
            if let Some(note) = self.reason_to_leave(step) {
                self.leave(step, Outcome::LeftOut, note)?;
                continue;
            }
            if let Some(guard) = self.progress.unguarded(step) {
                let note = format!("{guard} has to pass first: --from {guard}");
                self.leave(step, Outcome::Blocked, note)?;
                continue;
            }
            if let Some(need) = self.progress.blocks(step).filter(|_| !self.is_named) {
                self.leave(step, Outcome::Blocked, format!("by {need}"))?;
                continue;
            }
            self.desk.print(&format!(
                "\n{} - {} (section {})\n{}",
                step.name, step.title, step.section, step.to_do
            ))?;
            loop {
                match self.ask_what_to_do()? {
                    Answer::Quit => return Ok(false),
                    Answer::Skip => {
                        let failed = self
                            .progress
                            .record(&step.name)
                            .is_some_and(|record| record.outcome == Outcome::Failed);
                        if !failed {
                            self.leave(step, Outcome::LeftOut, "by its user".to_owned())?;
                        }
                        break;
                    }
                    Answer::Measure => {
                        if self.progress.forget(step) {
                            self.save()?;
                        }
                        let sight = self.look(step.sets_amplitude);
                        if self.desk.is_ended() {
                            return Ok(false);
                        }
                        let mut has_left = false;
                        let figures = step.judge(&sight, |measure| {
                            let answer = self.ask_for(measure).ok().flatten();
                            has_left |= answer.is_none();
                            answer
                        });
                        if has_left {
                            return Ok(false);
                        }
                        if self.keep(step, figures, &sight)? {
                            break;
                        }
                    }
                }
            }
        }
        Ok(true)
    }

    fn look(&self, sets_amplitude: bool) -> Sight {
        if io::stderr().is_terminal() {
            eprintln!("measuring …");
        }
        let wanted = Wanted {
            span_s: SPAN_S,
            amplitude_mv: sets_amplitude.then_some(step::FIRST_AMPLITUDE_MV),
        };
        Sight::of(&self.desk.system, &self.bench, wanted, &self.desk.ended)
    }

    /// Why nothing is to be seen of a step on this bench, if so.
    fn reason_to_leave(&self, step: &Step) -> Option<String> {
        let named = [&self.bench.sensor, &self.bench.display]
            .into_iter()
            .all(|seat| seat.port.is_some());
        (step.witness == Witness::Usb && named).then(|| "the bench names its ports".to_owned())
    }

    fn leave(&mut self, step: &Step, outcome: Outcome, note: String) -> anyhow::Result<()> {
        self.desk
            .print(&format!("{:<18}{}: {note}", step.name, outcome.name()))?;
        self.progress
            .put(step, outcome, Some(note), Vec::new(), 0.0);
        self.save()
    }

    /// Keeps what was measured and tells of it; true if it passed.
    fn keep(&mut self, step: &Step, figures: Vec<Figure>, sight: &Sight) -> anyhow::Result<bool> {
        let passes = figures.iter().all(|figure| figure.passes);
        let outcome = if passes {
            Outcome::Passed
        } else {
            Outcome::Failed
        };
        let mut out = format!("{:<18}{}\n", step.name, outcome.name());
        for figure in &figures {
            let _ = writeln!(out, "  {} {figure}", if figure.passes { "+" } else { "-" });
            for advice in figure.advice.iter().flat_map(|advice| advice.lines()) {
                let _ = writeln!(out, "    -> {advice}");
            }
        }
        self.desk.print(&out)?;
        let document = json::write(&sight.examination, &findings::of(&sight.examination));
        self.progress.doctor = serde_json::from_str(&document).unwrap_or_default();
        self.progress
            .put(step, outcome, None, figures, sight.examination.looked_s);
        self.save()?;
        Ok(passes)
    }

    fn save(&self) -> anyhow::Result<()> {
        self.progress.write(&self.path)?;
        let path = report_path(&self.path);
        let text = report::html(&self.progress);
        output_file::replaced_by(&path, |path| fs::write(path, text))
            .with_context(|| format!("{}: can't be written: give another --state", path.display()))
    }

    /// A line of standard input; none at its end.
    fn line(&mut self, prompt: &str) -> anyhow::Result<Option<String>> {
        eprint!("{prompt} ");
        io::stderr().flush()?;
        let mut line = String::new();
        let count = self
            .desk
            .input
            .read_line(&mut line)
            .context("standard input can't be read")?;
        Ok((count > 0).then(|| line.trim().to_owned()))
    }

    fn ask_what_to_do(&mut self) -> anyhow::Result<Answer> {
        loop {
            match self
                .line("[Enter: measure, s: leave it, q: stop here]")?
                .as_deref()
            {
                None | Some("q") => return Ok(Answer::Quit),
                Some("s") => return Ok(Answer::Skip),
                Some("") => return Ok(Answer::Measure),
                Some(_) => {}
            }
        }
    }

    fn ask_for(&mut self, measure: &Measure) -> anyhow::Result<Option<Value>> {
        loop {
            let unit = if measure.unit.is_empty() {
                String::new()
            } else {
                format!(" in {}", measure.unit)
            };
            let Some(answer) = self.line(&format!("{}{unit}?", measure.what))? else {
                return Ok(None);
            };
            match &measure.limit {
                Limit::Word(_) if !answer.is_empty() => {
                    return Ok(Some(Value::Word(answer.to_lowercase())));
                }
                Limit::Word(_) => {}
                _ => match answer.replace(',', ".").parse::<f64>() {
                    Ok(number) if number.is_finite() => return Ok(Some(Value::Number(number))),
                    _ => eprintln!("give a number"),
                },
            }
        }
    }
}
