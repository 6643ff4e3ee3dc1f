//! The command line.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use crate::bench::{Bench, BenchError, Seat};
use crate::link::{Event, Link};
use crate::monitor::firmware_log::{LogError, Logs, Origin};
use crate::place::Place;
use clap::{Args, Parser, Subcommand, ValueHint};
use crossbeam_channel::{Receiver, Sender, unbounded};
use protocol::{Message, Role};

pub use desk::Desk;

mod bringup;
mod completions;
mod configure;
mod desk;
mod doctor;
mod export;
mod flash;
mod live;
mod man;
mod monitor;
mod output;
mod record;
mod relay;
mod replay;
mod signals;
mod stop;

/// Ridgelink's bridge: flashes, watches, records and replays the boards, and carries their link over
/// networks.
#[derive(Debug, Parser)]
#[command(
    name = "host-bridge",
    version,
    about,
    after_long_help = "\
Boards are found by themselves: every ST-LINK that is plugged in is asked who is behind it. Where there are \
several benches, or ports that are none of an ST-LINK's, --sensor and --display say where, or a bench file \
does, which also names firmwares and probes.

A first session:
  host-bridge doctor                 what is attached, and what is wrong
  host-bridge flash sensor           the boards' firmwares, one after the other
  host-bridge flash display
  host-bridge monitor                what they say, as it comes
  host-bridge record                 the same, kept
  host-bridge replay                 and played again

Results go to standard output; progress, complaints and what became of a Stop to standard error. Exit status 0 \
means done, 2 that what was asked for can't be done; what 1 means, each command's own --help says."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Writes a firmware to a board, verifies it and waits for the board's Hello
    #[command(long_about = flash::ABOUT, after_long_help = flash::EXAMPLES)]
    Flash(flash::Flash),
    /// Shows what the boards say, in the terminal or line by line
    #[command(long_about = monitor::ABOUT, after_long_help = monitor::EXAMPLES)]
    Monitor(monitor::Monitor),
    /// Shows what the boards say to Foxglove, and on a page with a Stop
    #[command(long_about = live::ABOUT, after_long_help = live::EXAMPLES)]
    Live(live::Live),
    /// Writes everything that the boards say to MCAP or CSV
    #[command(long_about = record::ABOUT, after_long_help = record::EXAMPLES)]
    Record(record::Record),
    /// Plays a recording into a monitor, a board or the simulator
    #[command(long_about = replay::ABOUT, after_long_help = replay::EXAMPLES)]
    Replay(replay::Replay),
    /// Takes a recording or a scene out to .hjif (ISO/IEC 23090-31) or WAV
    #[command(long_about = export::ABOUT, after_long_help = export::EXAMPLES)]
    Export(export::Export),
    /// Carries the link between two sites over a network
    #[command(after_long_help = relay::EXAMPLES)]
    Relay(relay::Relay),
    /// Shows the boards' settings, or changes some of them
    #[command(long_about = configure::ABOUT, after_long_help = configure::EXAMPLES)]
    Configure(configure::ConfigureBoards),
    /// Stops the boards, now
    #[command(after_long_help = stop::EXAMPLES)]
    Stop(stop::StopBoards),
    /// Looks at what is attached, and says what is wrong and what to do
    Doctor(doctor::Doctor),
    /// Brings a bench up, step by step: what to wire, what is measured, what to try
    #[command(long_about = bringup::ABOUT, after_long_help = bringup::EXAMPLES)]
    Bringup(bringup::Bringup),
    /// Prints completions for a shell
    #[command(after_long_help = completions::EXAMPLES)]
    Completions(completions::Completions),
    /// Writes the man pages
    #[command(after_long_help = man::EXAMPLES)]
    Man(man::Man),
}

/// Where the boards are.
#[derive(Clone, Debug, Args)]
struct Where {
    /// The bench file; without it, ridgelink.toml in this folder, or ridgelink/bench.toml in the user's
    /// settings, if there is one
    #[arg(long, value_name = "FILE", env = "RIDGELINK_BENCH", value_hint = ValueHint::FilePath)]
    bench: Option<PathBuf>,
    /// The sensor board's console: a port, or usb:SERIAL of its ST-LINK
    #[arg(long, value_name = "PORT", value_hint = ValueHint::FilePath)]
    sensor: Option<Place>,
    /// The display board's console
    #[arg(long, value_name = "PORT", value_hint = ValueHint::FilePath)]
    display: Option<Place>,
}

impl Where {
    /// The bench, with what the command line says put over what the file says.
    fn find(&self) -> Result<Bench, BenchError> {
        self.named()?.checked()
    }

    /// The same, even if both boards are at one place.
    fn named(&self) -> Result<Bench, BenchError> {
        let mut bench = Bench::find(self.bench.as_deref())?;
        put(&mut bench.sensor, self.sensor.as_ref());
        put(&mut bench.display, self.display.as_ref());
        Ok(bench)
    }
}

/// The links to the boards that the bench has, which look for them at once. `tell` is called from their
/// threads with what happens.
fn links(
    bench: &Bench,
    tell: impl FnMut(Role, Event) + Clone + Send + 'static,
) -> Vec<(Role, Link)> {
    let open = |role| {
        let mut tell = tell.clone();
        Some((role, link(bench, role, move |event| tell(role, event))?))
    };
    bench.roles().into_iter().filter_map(open).collect()
}

/// The link to the board of `role`, if the bench has a seat for it.
fn link(bench: &Bench, role: Role, tell: impl FnMut(Event) + Send + 'static) -> Option<Link> {
    Some(Link::open(role, bench.seat(role)?.place(), tell))
}

/// Reads the logs of these boards: of those at another site, and of those whose ELF and whose bytes the bench names.
fn follow_logs(bench: &Bench, roles: &[Role], logs: &Logs) -> Result<(), LogError> {
    for &role in roles {
        let Some(seat) = bench.seat(role) else {
            continue;
        };
        if let (Some(elf), Some(rtt)) = (&seat.elf, &seat.rtt) {
            logs.follow(role, elf, Origin::of(rtt))?;
        } else if let Place::Port(port) = seat.place() {
            logs.follow_far(role, &port);
        }
    }
    Ok(())
}

/// A place in a recording, in s after its start.
fn place_s(text: &str) -> Result<f64, String> {
    let place_s = text.parse().ok();
    place_s
        .filter(|place_s| (0.0..f64::INFINITY).contains(place_s))
        .ok_or_else(|| "give a number of seconds, 0 or more".to_owned())
}

/// A time above 0 s, and short enough to be waited for: a hundred years.
fn seconds(text: &str) -> Result<Duration, String> {
    const LONGEST_S: f64 = 100.0 * 365.0 * 86_400.0;
    text.parse::<f64>()
        .ok()
        .filter(|seconds| (f64::MIN_POSITIVE..=LONGEST_S).contains(seconds))
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .filter(|time| !time.is_zero())
        .ok_or_else(|| "give a number of seconds above 0, and at most a hundred years".to_owned())
}

/// Some ten seconds of all that two boards say.
const WAITING: usize = 10_000;

/// What happens to links, as it comes.
type Told = Receiver<(Role, Event)>;

/// The same, and what happens.
fn told_links(bench: &Bench) -> (Vec<(Role, Link)>, Told) {
    let (events, told) = unbounded();
    let links = links(bench, move |role, event| tell(&events, role, event));
    (links, told)
}

/// Tells what happens. While whoever is told stands still, as a terminal may for hours, what is said hundreds of times
/// a second goes once there are [`WAITING`]: the next one says as much.
fn tell(events: &Sender<(Role, Event)>, role: Role, event: Event) {
    let is_often = matches!(
        &event,
        Event::Heard {
            message: Message::Motion(_)
                | Message::Estimate(_)
                | Message::Gauges(_)
                | Message::Texture(_),
            ..
        }
    );
    if !(is_often && events.len() >= WAITING) {
        // Nobody listens any more at the end.
        let _ = events.send((role, event));
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

/// Does what the command line asks for.
pub fn run() -> ExitCode {
    match Arguments::parse().execute() {
        Ok(status) => status,
        Err(error) => {
            output::say(&words(&error));
            ExitCode::from(2)
        }
    }
}

/// Does what these words of a command line ask for at `desk`: the exit status. For `doctor` and `bringup`, which go by
/// nothing else.
///
/// # Errors
/// If it can't be done, or is another command.
pub fn run_at(
    desk: &mut Desk,
    words: impl IntoIterator<Item = impl Into<OsString> + Clone>,
) -> anyhow::Result<u8> {
    match Arguments::try_parse_from(words)?.command {
        Command::Doctor(doctor) => doctor.execute(desk),
        Command::Bringup(bringup) => bringup.execute(desk),
        _ => anyhow::bail!("it goes by this computer's own clock and ports"),
    }
}

/// An error and its causes, each said once: many errors name their cause themselves.
fn words(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

impl Arguments {
    /// Does what was asked for. Fails if it can't be done.
    fn execute(self) -> anyhow::Result<ExitCode> {
        signals::guard_halt()?;
        match self.command {
            Command::Flash(flash) => flash.execute(),
            Command::Monitor(monitor) => monitor.execute(),
            Command::Live(live) => live.execute(),
            Command::Record(record) => record.execute(),
            Command::Replay(replay) => replay.execute(),
            Command::Export(export) => export.execute(),
            Command::Relay(relay) => relay.execute(),
            Command::Configure(configure) => configure.execute(),
            Command::Stop(stop) => stop.execute(),
            Command::Doctor(doctor) => Ok(doctor.execute(&mut Desk::own()?)?.into()),
            Command::Bringup(bringup) => Ok(bringup.execute(&mut Desk::own()?)?.into()),
            Command::Completions(completions) => completions.execute(),
            Command::Man(man) => man.execute(),
        }
    }
}

#[cfg(test)]
mod tests {
    use protocol::{Motion, Ping};

    use super::*;

    #[test]
    fn whoever_stands_still_is_told_no_more_than_fits_and_all_that_is_rare() {
        let (events, told) = unbounded();
        let heard = |message| Event::Heard { at_us: 0, message };
        let motion = Motion {
            sequence: 0,
            instant_us: 0,
            position_um: 0,
            velocity_um_s: 0,
        };
        for _ in 0..WAITING + 1_000 {
            tell(&events, Role::Display, heard(Message::Motion(motion)));
        }
        let ping = Message::Ping(Ping { sent_us: 1 });
        tell(&events, Role::Display, heard(ping));
        assert_eq!(told.len(), WAITING + 1);
        let last = told.try_iter().last();
        assert!(matches!(
            last,
            Some((
                _,
                Event::Heard {
                    message: Message::Ping(_),
                    ..
                }
            ))
        ));
    }
}
