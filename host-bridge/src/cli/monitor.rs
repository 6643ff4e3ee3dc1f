//! `host-bridge monitor`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use crate::bench::{Bench, Seat};
use crate::monitor::firmware_log::{Logs, Origin};
use crate::monitor::line::Format;
use crate::monitor::{self, Options, RecordingFeed, Source};
use crate::place::Place;
use anyhow::Context;
use clap::ValueHint;
use crossbeam_channel::unbounded;
use protocol::Role;

use super::signals::{self, Again, Orders};
use super::stop::Teller;

/// What the command does.
pub const ABOUT: &str = "\
Shows what the boards say: λ and how sure the sensor is of it, the velocities of hand and arm, the gauges, what \
the actuators do, the supervisor's state, every counter, and the boards' logs.

On a terminal it is a dashboard with keys to stop the stimulus, to change settings, to record and more: ? tells. \
Where standard output is no terminal, or with --plain or --json, it is a line a second and one at each change. \
A board that is not there, or not understood, is named with advice, and found as soon as it is back.

A board's log is shown if its ELF is known, by the bench file or by --sensor-elf and --display-elf, and where the \
bytes of its RTT channel come from: `rtt` in the bench file, a file, a pseudo-terminal or tcp:HOST:PORT; or the \
board's probe, with --probe-log. NO_COLOR=1 has it draw without colours.";

/// How it is used.
pub const EXAMPLES: &str = "\
Examples:
  host-bridge monitor
  host-bridge monitor --plain --every 0.1 --for 60 > session.txt
  host-bridge monitor --json | jq 'select(.kind == \"second\") | .estimate.wavelength_mm'

The columns of --plain are named in its first line; lines that begin with # are changes. Exit status 0 at the end \
that was asked for, by a key, a signal or --for; 1 if lines were written and no board was ever there; 2 if it \
can't watch at all.";

/// What `monitor` is asked for.
#[derive(Debug, clap::Args)]
pub struct Monitor {
    #[command(flatten)]
    boards: super::Where,
    /// Writes lines instead of drawing a dashboard, as it also does where there is no terminal
    #[arg(long)]
    plain: bool,
    /// Writes a JSON object a line
    #[arg(long)]
    json: bool,
    /// Time between two lines
    #[arg(long, value_name = "SECONDS", default_value = "1", value_parser = super::seconds, allow_negative_numbers = true)]
    every: Duration,
    /// Ends by itself after so long
    #[arg(long = "for", value_name = "SECONDS", value_parser = super::seconds, allow_negative_numbers = true)]
    limit: Option<Duration>,
    /// The sensor board's firmware, to read its log
    #[arg(long, value_name = "ELF", value_hint = ValueHint::FilePath)]
    sensor_elf: Option<PathBuf>,
    /// The display board's firmware, to read its log
    #[arg(long, value_name = "ELF", value_hint = ValueHint::FilePath)]
    display_elf: Option<PathBuf>,
    /// Reads the logs by the boards' probes, where the bench names no other way (`rtt`)
    #[arg(long)]
    probe_log: bool,
    /// The folder for recordings that the key r begins
    #[arg(long, value_name = "FOLDER", default_value = ".", value_hint = ValueHint::DirPath)]
    record_to: PathBuf,
}

impl Monitor {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let orders = Orders::to_stop().context("can't listen to signals")?;
        let mut bench = self.boards.find()?;
        if let Some(elf) = &self.sensor_elf {
            bench.sensor.elf = Some(elf.clone());
        }
        if let Some(elf) = &self.display_elf {
            bench.display.elf = Some(elf.clone());
        }
        // The second one ends the program even where a reader of its lines stands still.
        let ended = signals::flag_set_by(&signals::USUAL, Again::EndsAtOnce)
            .context("can't listen to signals")?;
        let (logs, lines) = Logs::new();
        self.follow_logs(&bench, &logs)?;
        let (happens, events) = unbounded();
        let feed = RecordingFeed::default();
        let format = Format {
            is_json: self.json,
            every: self.every,
        };
        let options = Options {
            plain: (self.plain || self.json).then_some(format),
            limit: self.limit,
            folder: self.record_to,
        };
        // A dashboard shows it.
        let teller = options.lines().map(|_| Teller::start(bench.roles()));
        let (feeds, hears) = (feed.clone(), teller.clone());
        let links = super::links(&bench, move |role, event| {
            feeds.on_event(role, &event);
            if let Some(teller) = &hears {
                teller.on_event(role, &event);
            }
            super::tell(&happens, role, event);
        });
        let (said, stops) = unbounded();
        let begins = teller.clone();
        orders.stop_boards(&links, move || {
            // Nobody listens any more at the end.
            let _ = said.send(());
            if let Some(teller) = &begins {
                teller.begin();
            }
        });
        let source = Source {
            events,
            stops,
            links,
            logs: Some(feed.pass_on(lines)),
            feed,
        };
        let watched = monitor::run(source, &options, &ended);
        if let Some(teller) = teller {
            teller.end();
        }
        let has_met = watched?;
        Ok(ExitCode::from(u8::from(!has_met)))
    }

    /// Reads the logs of the boards whose ELF and whose bytes are known.
    fn follow_logs(&self, bench: &Bench, logs: &Logs) -> anyhow::Result<()> {
        let origin = |seat: &Seat| match &seat.rtt {
            Some(rtt) => Some(Origin::of(rtt)),
            None if self.probe_log => Some(Origin::Probe(seat.usb.clone())),
            None => None,
        };
        // One that is not named is whichever is plugged in, maybe the other board's.
        if let [Some(Origin::Probe(one)), Some(Origin::Probe(other))] =
            [&bench.sensor, &bench.display].map(origin)
            && (one.is_none() || other.is_none() || one == other)
        {
            anyhow::bail!(
                "each board's log needs a probe of its own: name both as `usb` in the bench file"
            );
        }
        for role in [Role::Sensor, Role::Display] {
            let Some(seat) = bench.seat(role) else {
                continue;
            };
            match (&seat.elf, origin(seat)) {
                (Some(elf), Some(origin)) => logs.follow(role, elf, origin)?,
                (None, Some(_)) => anyhow::bail!(
                    "the {role}'s log can't be read without its firmware: give --{role}-elf",
                    role = role.name()
                ),
                (_, None) => {
                    if let Place::Port(port) = seat.place() {
                        logs.follow_far(role, &port);
                    }
                }
            }
        }
        Ok(())
    }
}
