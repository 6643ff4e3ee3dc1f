//! The command line.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use host_bridge::bench::{Bench, BenchError, Seat};
use host_bridge::place::Place;

mod completions;
mod doctor;
mod flash;
mod man;
mod monitor;
mod record;
mod relay;
mod replay;
mod stdout;

/// Ridgelink's bridge: flashes, watches, records and replays the boards, and carries their link over
/// networks.
#[derive(Debug, Parser)]
#[command(name = "host-bridge", version, about)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Writes a firmware to a board, verifies it and waits for the board's Hello
    Flash(flash::Flash),
    /// Shows what the boards say, in the terminal or line by line
    Monitor(monitor::Monitor),
    /// Writes everything that the boards say to MCAP or CSV
    Record(record::Record),
    /// Plays a recording into a monitor, a board or the simulator
    Replay(replay::Replay),
    /// Carries the link between two sites over a network
    Relay(relay::Relay),
    /// Looks at what is attached, and says what is wrong and what to do
    Doctor(doctor::Doctor),
    /// Prints completions for a shell
    Completions(completions::Completions),
    /// Writes the man pages
    Man(man::Man),
}

/// Where the boards are.
#[derive(Clone, Debug, Args)]
struct Where {
    /// The bench file; without it, ridgelink.toml in this folder, or ridgelink/bench.toml in the user's
    /// settings, if there is one
    #[arg(long, value_name = "FILE", env = "RIDGELINK_BENCH")]
    bench: Option<PathBuf>,
    /// The sensor board's console: a port, or usb:SERIAL of its ST-LINK
    #[arg(long, value_name = "PORT")]
    sensor: Option<Place>,
    /// The display board's console
    #[arg(long, value_name = "PORT")]
    display: Option<Place>,
}

impl Where {
    /// The bench, with what the command line says put over what the file says.
    fn find(&self) -> Result<Bench, BenchError> {
        let mut bench = Bench::find(self.bench.as_deref())?;
        put(&mut bench.sensor, self.sensor.as_ref());
        put(&mut bench.display, self.display.as_ref());
        bench.checked()
    }
}

fn put(seat: &mut Seat, place: Option<&Place>) {
    match place {
        Some(Place::Port(port)) => seat.port = Some(port.clone()),
        Some(Place::Usb(serial)) => {
            seat.port = None;
            seat.usb = Some(serial.clone());
        }
        Some(Place::Among(_) | Place::Anywhere) | None => {}
    }
}

impl Arguments {
    /// Does what was asked for.
    ///
    /// # Errors
    /// If it can't be done.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        match self.command {
            Command::Flash(flash) => flash.execute(),
            Command::Monitor(monitor) => monitor.execute(),
            Command::Record(record) => record.execute(),
            Command::Replay(replay) => replay.execute(),
            Command::Relay(relay) => relay.execute(),
            Command::Doctor(doctor) => doctor.execute(),
            Command::Completions(completions) => completions.execute(),
            Command::Man(man) => man.execute(),
        }
    }
}
