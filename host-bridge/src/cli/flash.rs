//! `host-bridge flash`.

use std::io::{self, BufRead, IsTerminal};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::bench::Seat;
use crate::doctor::json::identity;
use crate::flash::console;
use crate::flash::firmware::{self, Firmware};
use crate::flash::plan::Plan;
use crate::flash::probes::{self, Attached, ProbeRequest, Selector, Undecided};
use crate::flash::programmer::Trouble;
use crate::flash::programmer::{Programmer, Progress};
use crate::place::{self, Place};
use crate::state::{Named, State};
use crate::system::System;
use anyhow::Context;
use clap::{ValueEnum, ValueHint};
use indicatif::{ProgressBar, ProgressStyle};
use protocol::{Hello, Role};
use serde_json::json;

use super::output;
use super::signals::{self, Again};

/// What the command does.
pub const ABOUT: &str = "\
Writes a firmware to a board, verifies it, starts it and waits for its Hello.

Before anything is erased, the ELF is looked at (whole, of Ridgelink, this board's, this chip's, this \
protocol's, within the flash, able to start), then the console (not the other board's, not taken by another \
program), then the chip behind the probe (the right one, not locked). While the flash is being written, \
Ctrl-C waits for the end; a second one does not.";

/// How it is used.
pub const EXAMPLES: &str = "\
Examples:
  host-bridge flash sensor --dry-run     what would be done, without a probe
  host-bridge flash sensor               the only board that is plugged in
  host-bridge flash display --probe 0483:374b:066CFF555185754867161530
  host-bridge flash display other.elf --bench lab.toml

The quick way, without these checks but with the board's log, is cargo's:
  cargo run --release --target thumbv7em-none-eabihf -p firmware-sensor

Exit status: 0 done; 1 something was begun and failed, or the board does not say Hello; 2 refused, and \
nothing was changed.";

/// What `flash` is asked for.
#[derive(Debug, clap::Args)]
pub struct Flash {
    /// The board that gets it
    #[arg(value_enum)]
    board: Board,
    /// The firmware; without it, the bench file's `elf`, or what the build left in
    /// target/thumbv7em-none-eabihf/release
    #[arg(value_name = "ELF", value_hint = ValueHint::FilePath)]
    elf: Option<PathBuf>,
    /// The probe, if several are plugged in and the bench file does not name the board's
    #[arg(long, value_name = "VID:PID[:SERIAL]")]
    probe: Option<Selector>,
    /// Only says what would be done; needs no probe
    #[arg(long)]
    dry_run: bool,
    /// Lets a board become the other one: without it, a board that says it is the other is left alone
    #[arg(long)]
    change_role: bool,
    /// Does not look at the board's console, neither before nor after
    #[arg(long)]
    no_hello: bool,
    /// Prints one JSON object for scripts
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    boards: super::Where,
}

/// The two boards.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Board {
    /// The one with the gauges
    Sensor,
    /// The one with the actuators
    Display,
}

impl Board {
    const fn role(self) -> Role {
        match self {
            Self::Sensor => Role::Sensor,
            Self::Display => Role::Display,
        }
    }
}

impl Flash {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        let role = self.board.role();
        let (seat, other) = match self.board {
            Board::Sensor => (&bench.sensor, &bench.display),
            Board::Display => (&bench.display, &bench.sensor),
        };
        let elf = self.elf.clone().or_else(|| seat.elf.clone());
        let elf = elf.unwrap_or_else(|| firmware::built(role));
        let plan = Plan::new(Firmware::read(&elf, role)?)?;
        if self.dry_run {
            self.report(&plan, None, None)?;
            return Ok(ExitCode::SUCCESS);
        }
        self.carry_out(&plan, seat, other)
    }

    fn carry_out(&self, plan: &Plan, seat: &Seat, other: &Seat) -> anyhow::Result<ExitCode> {
        let role = plan.firmware.role;
        let system = System::default();
        let links = place::st_links();
        let request = ProbeRequest::new(self.probe.clone(), seat, other, &links);
        let probe = self.choose(&request, role)?;
        let console = console::place(&seat.place(), probe.serial(), &links)?;
        // Where any console will do, what is heard first need not be this board's.
        if !self.no_hello && console != Place::Anywhere {
            let state = console::look(&system, role, console.clone());
            self.check_console(state, role, is_attended())?;
        }
        let opened = probe.open()?;
        let mut programmer = Programmer::attach(opened, plan, || probe.open().ok())?;

        let called_off = signals::flag_set_by(&signals::USUAL, Again::EndsAtOnce)?;
        let bar = Bar::new();
        let written = programmer.write(plan, |progress| bar.show(progress, &called_off));
        bar.end();
        if let Err(trouble) = written.and_then(|()| programmer.start()) {
            return failed(trouble);
        }
        if self.no_hello {
            self.report(plan, Some(&probe), None)?;
            return Ok(ExitCode::SUCCESS);
        }
        eprintln!("flashed and verified; waiting for the board's Hello");
        let (wanted, limit) = (plan.firmware.hello, console::PATIENCE);
        match console::wait(&system, role, console, wanted, limit, &called_off) {
            Ok(hello) => {
                self.report(plan, Some(&probe), Some(hello))?;
                Ok(ExitCode::SUCCESS)
            }
            Err(error) => {
                output::say(&error.to_string());
                if self.json {
                    self.report(plan, Some(&probe), None)?;
                }
                Ok(ExitCode::FAILURE)
            }
        }
    }

    /// Prints what is planned, or what was done by `probe`.
    fn report(
        &self,
        plan: &Plan,
        probe: Option<&Attached>,
        hello: Option<Hello>,
    ) -> anyhow::Result<()> {
        let text = if self.json {
            // The Hello is null if it was not waited for, or not heard.
            let report = json!({
                "plan": plan.summary(),
                "flashed": probe.is_some(),
                "probe": probe.map(Attached::selector),
                "hello": hello.as_ref().map(identity),
            });
            report.to_string()
        } else {
            match (probe, hello) {
                (None, _) => format!("{plan}\nnothing was changed: this was a dry run"),
                (Some(_), None) => format!("{plan}\nflashed and verified"),
                (Some(_), Some(hello)) => format!(
                    "flashed and verified: {}, protocol {}, schema {:016x}",
                    Named(&hello),
                    hello.protocol_version(),
                    hello.schema_hash()
                ),
            }
        };
        output::print(&text)
    }

    /// The probe that is meant; asks if that is not clear and somebody is there to be asked.
    fn choose(&self, request: &ProbeRequest, role: Role) -> anyhow::Result<Attached> {
        let found = probes::attached();
        let several = match probes::choose(&found, request) {
            Ok(probe) => return Ok(probe),
            Err(Undecided::Several(found)) => found,
            Err(other) => return Err(other.into()),
        };
        let behind = if self.no_hello {
            vec![None; several.len()]
        } else {
            who(&several, role)
        };
        let line = |(probe, state): (&Attached, &Option<State>)| match state {
            Some(state) => format!("{probe}  {state}"),
            None => probe.to_string(),
        };
        let lines: Vec<String> = several.iter().zip(&behind).map(line).collect();
        if !is_attended() {
            anyhow::bail!(
                "several probes are plugged in: name the {} board's with --probe, or its serial number as \
                 `usb` in the bench file:\n  {}",
                role.name(),
                lines.join("\n  ")
            );
        }
        for (number, line) in lines.iter().enumerate() {
            eprintln!("{:>3}  {line}", number + 1);
        }
        let count = several.len();
        let question = format!("Which is the {} board's? [1-{count}] ", role.name());
        let number = ask(&question, |answer| {
            let number = answer.parse::<usize>().ok();
            number.filter(|number| (1..=count).contains(number))
        })?;
        Ok(several[number - 1].clone())
    }

    /// Whether the console allows to go on; asks if that is somebody's to say and he is there.
    fn check_console(&self, state: State, role: Role, is_attended: bool) -> anyhow::Result<()> {
        match state {
            State::Stranger { ref hello, .. } if !state.is_echo() => {
                let is = Named(hello).to_string();
                if self.change_role {
                    return Ok(());
                }
                let question = format!(
                    "This board says that it is the {is}. Its pins are wired for that. Make it the {} board? \
                     [y/N] ",
                    role.name()
                );
                if is_attended && ask(&question, |answer| Some(answer == "y"))? {
                    return Ok(());
                }
                anyhow::bail!(
                    "this board says that it is the {is}, and its pins are wired for that: name the {} \
                     board's probe, or let this one change with --change-role; nothing was changed",
                    role.name()
                )
            }
            State::Stranger { .. }
            | State::Busy { .. }
            | State::Hung { .. }
            | State::Denied { .. }
            | State::Failed { .. }
            | State::Absent { .. } => {
                anyhow::bail!(
                    "{state}: the board's Hello could not be heard; {}, or flash it with --no-hello; nothing \
                     was changed",
                    state.advice().unwrap_or("see `host-bridge doctor`")
                )
            }
            _ => Ok(()),
        }
    }
}

/// Who says Hello behind each of the probes; none where there is no console.
fn who(probes: &[Attached], role: Role) -> Vec<Option<State>> {
    let places = probes
        .iter()
        .map(|probe| Place::Usb(probe.serial().unwrap_or_default().to_owned()))
        .collect();
    console::look_at_all(&System::default(), role, places)
        .into_iter()
        .map(|state| (!matches!(state, State::Absent { .. })).then_some(state))
        .collect()
}

/// Whether somebody is there to be asked.
fn is_attended() -> bool {
    io::stdin().is_terminal() && io::stderr().is_terminal()
}

/// Asks until the answer is one; none is one if the input ends.
fn ask<T>(question: &str, read: impl Fn(&str) -> Option<T>) -> anyhow::Result<T> {
    let mut lines = io::stdin().lock().lines();
    loop {
        eprint!("{question}");
        let answer = lines.next().context("no answer; nothing was changed")??;
        if let Some(answer) = read(answer.trim()) {
            return Ok(answer);
        }
    }
}

/// What went wrong at the chip: harmless refusals are the caller's, the rest leaves its mark in the status.
fn failed(trouble: Trouble) -> anyhow::Result<ExitCode> {
    if trouble.is_harmless() {
        return Err(trouble.into());
    }
    output::say(&trouble.to_string());
    Ok(ExitCode::FAILURE)
}

/// How far it has come, on standard error.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Self {
        let bar = ProgressBar::new(0);
        if let Ok(style) =
            ProgressStyle::with_template("{msg:<10} {bar:40} {bytes:>10} of {total_bytes}")
        {
            bar.set_style(style);
        }
        Self(bar)
    }

    fn show(&self, progress: Progress, called_off: &AtomicBool) {
        self.0.set_length(progress.total_bytes);
        self.0.set_position(progress.done_bytes);
        self.0.set_message(if called_off.load(Ordering::Relaxed) {
            "finishing: half a firmware does not start"
        } else {
            progress.stage.name()
        });
    }

    fn end(&self) {
        self.0.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::{Arguments, Command};

    #[test]
    fn a_board_of_the_other_role_is_left_alone_unless_it_is_to_change() {
        let flash = |more: &[&str]| {
            let words = ["host-bridge", "flash", "sensor"].iter().chain(more);
            match Arguments::parse_from(words).command {
                Command::Flash(flash) => flash,
                other => panic!("{other:?}"),
            }
        };
        let state = || State::Stranger {
            port: "/dev/ttyACM0".into(),
            hello: Hello::new(Role::Display, "stm32f429zi", [0, 1, 0]),
            wanted: Role::Sensor,
        };
        let refused = flash(&[]).check_console(state(), Role::Sensor, false);
        let words = refused.expect_err("it is the display").to_string();
        assert!(words.contains("--change-role"), "{words}");
        let allowed = flash(&["--change-role"]).check_console(state(), Role::Sensor, false);
        allowed.expect("it is to change");
    }
}
