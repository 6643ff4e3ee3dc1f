//! `hil-sim serve`.

mod input;
mod screen;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use hil_sim_boards::bench::{Bench, BenchStatus, Command, Hand, Options, Pace, PortName};
use hil_sim_core::scene::{Motion, Scene};

use super::run_options::tell_notes;
use super::say::tell;
use super::{Elves, number};
use input::{Input, Keys};
use screen::Screen;

/// How often the status is told.
const TOLD: Duration = Duration::from_secs(1);
/// How often is looked whether the bench still stands.
const LOOKS: Duration = Duration::from_millis(50);
/// Where the relays meet that it advises to try.
const MEETING: &str = "tcp/127.0.0.1:7447";

const COMMANDS: &str = "\
On a terminal, keys:
  ↑ ↓      hand faster, slower        1 … 6    pull or put back a port's cable
  ← →      hand to the left, right    r d      reset the sensor board, the display board
  space    hand rests                 e        press or release the emergency stop
  q        quit                       ?        this

On standard input that is no terminal, a line each:
  pull PORT, plug PORT                PORT is sensor-console, display-console, sensor-link,
                                      display-link, sensor-rtt or display-rtt
  reset sensor, reset display
  hand SPEED                          in mm/s, −1000 to 1000
  stop, release                       the emergency stop's contact opens, closes
  wrong MISTAKE, right MISTAKE        a wire is put wrong, and right again: link-straight,
                                      sensor-tx-open, display-tx-open, no-ground, hand-swapped,
                                      hand-open, arm-swapped, arm-open, pwm-open, arm-backwards,
                                      gauge-open, gauge-short, stop-open, sdi-open, sdo-open,
                                      select-open, alarm-low, ldac-high or clr-low
  quit

A wrong baud rate garbles what goes through a console or a link, as on a wire. Boards are set as the scene
asks before their ports appear. At its end, by q, quit, Ctrl-C, SIGTERM or --for, the ports are taken away.
Exit status 0 then, 1 if a board stopped by itself, 2 if the bench can't be set up.";

#[derive(Debug, clap::Args)]
#[command(after_long_help = COMMANDS)]
pub(super) struct Serve {
    /// What is rubbed, and how: a scene's motion goes on for as long as the bench stands, a recorded one to
    /// and fro, a swinging one with a rest of half a second after five minutes. By default a hand swings at 0.83 Hz
    /// and up to 70 mm/s over specimens of 2 and 3 mm
    scene: Option<PathBuf>,
    /// Where the ports are to be found
    #[arg(long, value_name = "DIR", default_value = hil_sim_boards::bench::DEFAULT_DIR)]
    dir: PathBuf,
    /// Virtual seconds in a second, 0.01 to 100, or max: as fast as the ports are read, and nothing is lost
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = pace)]
    pace: Pace,
    /// keyboard: at rest until a key moves it; or a recording, a CSV file with the columns t_s,x_mm
    #[arg(long, value_name = "keyboard|FILE.csv")]
    hand: Option<PathBuf>,
    /// Joins the boards by nothing: each has its link port, for two bridges
    #[arg(long)]
    apart: bool,
    /// Takes the bench down after so many virtual seconds
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    until_s: Option<f64>,
    /// No status line
    #[arg(long)]
    quiet: bool,
    #[command(flatten)]
    elves: Elves,
}

fn pace(text: &str) -> Result<Pace, String> {
    match text.parse() {
        _ if text == "max" => Ok(Pace::Max),
        Ok(factor @ 0.01..=100.0) => Ok(Pace::Times(factor)),
        _ => Err("give 0.01 to 100, or max".to_owned()),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if seconds > 0.0 && seconds <= 1e9 => Ok(seconds),
        _ => Err("give a time above 0 s, 1 000 000 000 at most".to_owned()),
    }
}

impl Serve {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let firmwares = self.elves.read()?;
        let has_keys = input::has_terminal();
        let defaults = Options::new(&self.dir);
        let options = Options {
            scene: match &self.scene {
                Some(path) => {
                    let scene = Scene::load(path)?;
                    tell_notes(&scene);
                    scene
                }
                None => defaults.scene,
            },
            hand: match &self.hand {
                None => Hand::Scene,
                Some(name) if name == Path::new("keyboard") => {
                    anyhow::ensure!(
                        has_keys,
                        "--hand keyboard needs a terminal: start it in one, in the foreground, or move \
                         the hand by lines such as \"hand 40\" on standard input"
                    );
                    Hand::Told
                }
                Some(path) => Hand::Recorded(Motion::load(path)?),
            },
            pace: self.pace,
            is_apart: self.apart,
            until_s: self.until_s,
            ..defaults
        };
        let name = options.scene.name.clone();
        let (events, inputs) = channel();
        input::on_signals(events.clone())?;
        let bench = Bench::start(options, &firmwares)?;
        greet(&bench, &name, has_keys);
        // Until it is dropped the terminal hands on keys, not lines.
        let raw = has_keys.then(input::Raw::enter).transpose()?;
        if has_keys {
            input::on_keys(events);
        } else {
            input::on_lines(events);
        }
        let mut screen = Screen::new(raw.is_some());
        let mut keys = Keys::default();
        let mut last = (Instant::now(), bench.standing());
        while !bench.is_over() {
            let input = match inputs.recv_timeout(LOOKS) {
                Ok(input) => Some(input),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => Some(Input::Quit),
            };
            let asked = match input {
                Some(Input::Quit) => Ok(Some(Command::Quit)),
                Some(Input::Line(line)) => line.parse().map(Some).map_err(anyhow::Error::from),
                Some(Input::Key(key)) => {
                    let command = keys.command(key, &bench);
                    // The hand's shows in the status.
                    let told = command.filter(|command| !matches!(command, Command::Hand { .. }));
                    if let Some(command) = told {
                        screen.tell(&command.to_string());
                    }
                    Ok(command)
                }
                Some(Input::Help) => {
                    screen.tell(COMMANDS);
                    Ok(None)
                }
                None => Ok(None),
            };
            let done = asked.and_then(|command| match command {
                Some(command) => Ok(bench.command(command)?),
                None => Ok(()),
            });
            if let Err(error) = done {
                screen.tell(&format!("{error:#}"));
            }
            if !self.quiet && last.0.elapsed() >= TOLD {
                let now = (Instant::now(), bench.standing());
                screen.show(&status(&bench, last, now));
                last = now;
            }
        }
        drop(screen);
        drop(raw);
        match bench.stop() {
            Ok(()) => Ok(ExitCode::SUCCESS),
            Err(error) => {
                tell!("{error}");
                Ok(ExitCode::from(1))
            }
        }
    }
}

/// Tells where the ports are, and what to try. That nobody may be listening is no reason to stop.
fn greet(bench: &Bench, scene: &str, has_keys: bool) {
    let mut text = format!("bench of scene {scene}, ports:\n");
    for name in PortName::ALL {
        if bench.is_plugged(name) {
            text += &format!("  {:<16} {}\n", name.name(), bench.path(name).display());
        }
    }
    text += &format!(
        "try:\n  host-bridge monitor --bench {}\n  tio -b 921600 {}\n",
        bench.bench_file().display(),
        bench.path(PortName::SensorConsole).display()
    );
    if bench.is_plugged(PortName::SensorLink) {
        text += &format!(
            "  host-bridge relay sensor --sensor {} --listen {MEETING}\n  host-bridge relay display --display {} --connect {MEETING}\n",
            bench.path(PortName::SensorLink).display(),
            bench.path(PortName::DisplayLink).display()
        );
    }
    if has_keys {
        text +=
            "keys: ↑ ↓ ← → space hand, 1–6 cables, r d reset, e emergency stop, q quit, ? help\n";
    }
    let mut out = std::io::stdout();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

fn status(bench: &Bench, last: (Instant, BenchStatus), now: (Instant, BenchStatus)) -> String {
    let wall_s = (now.0 - last.0).as_secs_f64();
    let (before, standing) = (last.1, now.1);
    let sensed = &standing.sensed;
    let valid = sensed.estimate.filter(|estimate| estimate.valid);
    let wavelength_mm = valid
        .and_then(|estimate| estimate.wavelength_mm)
        .map(f64::from);
    let open: Vec<&str> = PortName::ALL
        .into_iter()
        .filter(|&name| bench.has_client(name))
        .map(PortName::name)
        .collect();
    format!(
        "{:.1} s  {:.2} ×  λ̂ {} of {:.2} mm  v {:+.1} mm/s  dropped {} B  behind {:.0} ms  open: {}",
        standing.now_s,
        (standing.now_s - before.now_s) / wall_s,
        number(wavelength_mm, 2),
        sensed.wavelength_mm,
        standing.hand_mm_s,
        standing.dropped,
        standing.behind_s * 1e3,
        if open.is_empty() {
            "none".to_owned()
        } else {
            open.join(" ")
        },
    )
}
