//! `host-bridge monitor`.

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::channel;
use std::time::Duration;

use anyhow::Context;
use host_bridge::bench::Bench;
use host_bridge::link::Link;
use host_bridge::monitor::desk::Desk;
use host_bridge::monitor::firmware_log::{Logs, Origin};
use host_bridge::monitor::plain::{self, Format};
use host_bridge::monitor::{Source, screen};
use protocol::Role;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

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
    #[arg(long, value_name = "SECONDS", default_value = "1", value_parser = seconds)]
    every: Duration,
    /// Ends by itself after so long
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    limit: Option<Duration>,
    /// The sensor board's firmware, to read its log
    #[arg(long, value_name = "ELF")]
    sensor_elf: Option<PathBuf>,
    /// The display board's firmware, to read its log
    #[arg(long, value_name = "ELF")]
    display_elf: Option<PathBuf>,
    /// Reads the logs by the boards' probes, where the bench names no other way (`rtt`)
    #[arg(long)]
    probe_log: bool,
}

/// A time above 0.
fn seconds(text: &str) -> Result<Duration, String> {
    text.parse::<f64>()
        .ok()
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .filter(|duration| !duration.is_zero())
        .ok_or_else(|| "give a number of seconds above 0".to_owned())
}

impl Monitor {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let mut bench = self.boards.find()?;
        if let Some(elf) = &self.sensor_elf {
            bench.sensor.elf = Some(elf.clone());
        }
        if let Some(elf) = &self.display_elf {
            bench.display.elf = Some(elf.clone());
        }
        let ended = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, Arc::clone(&ended))
                .context("can't listen to signals")?;
        }
        let (logs, lines) = Logs::new();
        self.follow_logs(&bench, &logs)?;
        let mut source = open(&bench);
        source.logs = Some(lines);
        let desk = Desk::new(source, None);
        if self.plain || self.json || !io::stdout().is_terminal() {
            let format = Format {
                is_json: self.json,
                every: self.every,
                limit: self.limit,
            };
            plain::run(desk, &format, &ended, &mut io::stdout().lock()).context("can't write")?;
        } else {
            screen::run(desk, self.limit, &ended).context("can't use the terminal")?;
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Reads the logs of the boards whose ELF and whose bytes are known.
    fn follow_logs(&self, bench: &Bench, logs: &Logs) -> anyhow::Result<()> {
        for role in [Role::Sensor, Role::Display] {
            let Some(seat) = bench.seat(role) else {
                continue;
            };
            let origin = match &seat.rtt {
                Some(rtt) => Some(Origin::of(rtt)),
                None if self.probe_log => Some(Origin::Probe(seat.usb.clone())),
                None => None,
            };
            match (&seat.elf, origin) {
                (Some(elf), Some(origin)) => logs.follow(role, elf, origin)?,
                (None, Some(_)) => anyhow::bail!(
                    "the {role}'s log can't be read without its firmware: give --{role}-elf",
                    role = role.name()
                ),
                (_, None) => {}
            }
        }
        Ok(())
    }
}

/// Both boards' links.
fn open(bench: &Bench) -> Source {
    let (events, told) = channel();
    let links = [Role::Sensor, Role::Display]
        .into_iter()
        .filter_map(|role| {
            let place = bench.seat(role)?.place();
            let events = events.clone();
            let link = Link::open(role, place, move |event| {
                // A monitor that has ended listens no more.
                let _ = events.send((role, event));
            });
            Some((role, link))
        })
        .collect();
    Source {
        events: told,
        links,
        logs: None,
    }
}
