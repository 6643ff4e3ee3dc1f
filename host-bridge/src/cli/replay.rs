//! `host-bridge replay`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use crate::clock::SystemClock;
use crate::clock::now_us;
use crate::link::{Event, Link};
use crate::monitor::{self, Options, RecordingFeed, Source};
use crate::recording::reader::Reader;
use crate::replay::StandIn;
use crate::replay::scene;
use crate::replay::{Pace, Played, SPEEDS, holds_for, play};
use anyhow::bail;
use clap::ValueHint;
use protocol::Role;

use super::output::{self, say};
use super::signals::{self, Again};

/// What the command does.
pub const ABOUT: &str = "\
Plays a recording back: into a monitor, into a board in place of its peer, or into a scene for the simulator.

A display board is told the recorded estimates, a sensor board the recorded motions, each at its time: take \
the board's peer off, or it will hear two of them. Numbers and instants are made fresh, as of a peer that has \
just started; a hand or an arm that is played faster moves faster. A scene names the recording, \
of which the simulator reads the voltages, as they were at the ADC's pins, and the motion of the arm, which \
stands for the hand's, too: `hil-sim run` of it makes the estimates that were recorded. A recording that was cut off is played as far as \
it goes.";

/// How it is used.
pub const EXAMPLES: &str = "\
Examples:
  host-bridge replay rubbing.mcap --to monitor
  host-bridge replay rubbing.mcap --to display-board --speed 0.5
  host-bridge replay rubbing.mcap --to sensor-board --sensor /dev/ttyACM0
  host-bridge replay rubbing.mcap --to rubbing.toml --expect && hil-sim run rubbing.toml

Exit status: 0 played or made; 1 some of it could not be said to the board, or a signal ended it before; \
2 not played, or damaged before its end.";

/// How long a board is waited for.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often is looked whether the wait is to end.
const LOOK: Duration = Duration::from_millis(50);

/// What `replay` is asked for.
#[derive(Debug, clap::Args)]
pub struct Replay {
    /// The recording
    #[arg(value_name = "FILE.mcap", value_hint = ValueHint::FilePath)]
    file: PathBuf,
    /// Where it goes: monitor, sensor-board, display-board, or a scene to be made, SCENE.toml
    #[arg(long, value_name = "TARGET", value_hint = ValueHint::FilePath)]
    to: Target,
    /// How fast, 0.1 to 100 times its own time; not for a scene
    #[arg(long, value_name = "TIMES", default_value_t = 1.0, value_parser = speed, allow_negative_numbers = true)]
    speed: f64,
    /// From so many seconds after its start on
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = super::place_s, allow_negative_numbers = true)]
    from: f64,
    /// To so many seconds after its start
    #[arg(long, value_name = "SECONDS", value_parser = super::place_s, allow_negative_numbers = true)]
    to_time: Option<f64>,
    /// For a scene: the wavelength that was rubbed, in mm; without it, the median of the valid estimates
    #[arg(long, value_name = "MM")]
    wavelength: Option<f64>,
    /// For a scene: it expects the recorded λ and share of valid estimates
    #[arg(long)]
    expect: bool,
    /// For a scene: writes over a file that is there already
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    boards: super::Where,
}

/// Where a recording goes.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Target {
    Monitor,
    Board(Role),
    Scene(PathBuf),
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "monitor" => Ok(Self::Monitor),
            "sensor-board" => Ok(Self::Board(Role::Sensor)),
            "display-board" => Ok(Self::Board(Role::Display)),
            scene if scene.ends_with(".toml") => Ok(Self::Scene(scene.into())),
            _ => Err(
                "give monitor, sensor-board, display-board, or a scene's name ending in .toml"
                    .to_owned(),
            ),
        }
    }
}

/// Share of estimates of another λ from which on a person is told.
const MANY_OFF: f64 = 0.05;

fn speed(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|speed| SPEEDS.contains(speed))
        .ok_or_else(|| format!("give {} to {}", SPEEDS.start(), SPEEDS.end()))
}

impl Replay {
    /// Plays it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        if self.to_time.is_some_and(|to_s| to_s <= self.from) {
            bail!(
                "--to-time {}: give a time after --from",
                self.to_time.unwrap_or(0.0)
            );
        }
        if self.speed != 1.0 && matches!(self.to, Target::Scene(_)) {
            bail!(
                "--speed {}: a scene has its own time: leave it out",
                self.speed
            );
        }
        if !matches!(self.to, Target::Scene(_)) {
            let of_scene = [
                ("--wavelength", self.wavelength.is_some()),
                ("--expect", self.expect),
                ("--force", self.force),
            ];
            if let Some((name, _)) = of_scene.into_iter().find(|&(_, is_given)| is_given) {
                bail!("{name}: is for a scene: leave it out");
            }
        }
        if let Some(wavelength_mm) = self.wavelength
            && !(0.01..=100.0).contains(&wavelength_mm)
        {
            bail!("--wavelength {wavelength_mm}: give 0.01 to 100 mm");
        }
        let recording = Reader::open(&self.file)?;
        match &self.to {
            Target::Monitor => self.watch(recording),
            Target::Board(role) => self.play_to(recording, *role),
            Target::Scene(path) => self.make(recording, path.clone()),
        }
    }

    fn make(&self, recording: Reader, path: PathBuf) -> anyhow::Result<ExitCode> {
        let settings = scene::Settings {
            path,
            from_s: self.from,
            to_s: self.to_time,
            wavelength_mm: self.wavelength,
            expect: self.expect,
            force: self.force,
        };
        let made = scene::write(recording, &settings)?;
        let scene = made.path.display();
        let (valid, all) = made.estimates;
        output::print(&format!(
            "{scene}: {:.2} s, λ = {:.3} mm, {valid} of {all} recorded estimates valid{}{}\n\
             run it: hil-sim run {scene}",
            made.duration_s,
            made.wavelength_mm,
            cut(made.cut),
            passed_over(made.passed_over),
        ))?;
        if made.off_share > MANY_OFF {
            say(&format!(
                "{:.0} % of the valid estimates are more than a tenth off that λ: if the surface changes on the way, give --from and --to-time of a part where it does not",
                100.0 * made.off_share
            ));
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Plays it into a monitor, which shows its end until a key ends it.
    fn watch(&self, recording: Reader) -> anyhow::Result<ExitCode> {
        let ended = signals::flag_set_by(&signals::USUAL, Again::IsIgnored)?;
        let pace = self.pace();
        let (events, told) = crossbeam_channel::unbounded();
        let their_end = Arc::clone(&ended);
        let feed = RecordingFeed::default();
        let feeds = feed.clone();
        let player = thread::spawn(move || {
            play(
                &SystemClock,
                recording,
                &pace,
                &their_end,
                |role, mut event| {
                    // Read ahead of its time.
                    if let Event::Heard { at_us, .. } = &mut event {
                        *at_us = now_us();
                    }
                    feeds.on_event(role, &event);
                    // A monitor that has ended listens no more.
                    let _ = events.send((role, event));
                },
            )
        });
        let source = Source {
            events: told,
            stops: crossbeam_channel::never(),
            links: Vec::new(),
            logs: None,
            feed,
        };
        let watched = monitor::run(source, &Options::default(), &ended);
        // Not by a key, but by a signal.
        let is_interrupted = ended.swap(true, Ordering::Relaxed);
        let played = player.join();
        watched?;
        let played = played.map_err(|_| anyhow::anyhow!("the player died"))??;
        if played.cut {
            say(&format!(
                "{}: was cut off at {:.1} s",
                self.file.display(),
                self.from + played.recorded_s
            ));
        }
        Ok(ExitCode::from(u8::from(is_interrupted)))
    }

    const fn pace(&self) -> Pace {
        Pace {
            speed: self.speed,
            from_s: self.from,
            to_s: self.to_time,
        }
    }

    fn play_to(&self, recording: Reader, role: Role) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        let pace = self.pace();
        let what = said_to(role);
        // Else it is played to its end first. What comes out of a pipe comes once, and is not looked through before.
        if self.file.is_file() && !holds_for(Reader::open(&self.file)?, role, &pace)? {
            bail!(
                "{}: holds no {what} there, and a {} board is told nothing else: give a recording, or a part of it, that does",
                self.file.display(),
                role.name(),
            );
        }
        let ended = signals::flag_set_by(&signals::USUAL, Again::IsIgnored)?;
        let place = bench.seat(role).map(crate::bench::Seat::place);
        let (states, turned) = channel();
        let link = Link::open(role, place.unwrap_or_default(), move |event| {
            if let Event::StateChanged(state) = event {
                // Nobody waits for it once the board is there.
                let _ = states.send(state);
            }
        });
        let end = Instant::now() + PATIENCE;
        while !link.state().is_known() {
            if ended.load(Ordering::Relaxed) {
                return Ok(ExitCode::FAILURE);
            }
            if Instant::now() >= end {
                let state = link.state();
                let advice = state.advice().unwrap_or("try again");
                bail!("{state}: {advice}");
            }
            match turned.recv_timeout(LOOK) {
                Ok(_) | Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
            }
        }
        if self.speed > 4.0 && role == Role::Display {
            eprintln!(
                "a display board takes no more than four times a sensor's estimates: at {} times it will fade \
                 out, and say why",
                self.speed
            );
        }
        let mut peer = StandIn::new(role, self.speed);
        let (mut said, mut unsaid) = (0_u64, 0_u64);
        let played = play(&SystemClock, recording, &pace, &ended, |from, event| {
            if let Some(message) = peer.say(from, &event, now_us()) {
                match link.post(&message) {
                    Ok(()) => said += 1,
                    Err(_) => unsaid += 1,
                }
            }
        })?;
        let status = report(role, &played, said, unsaid)?;
        // Not to its end.
        let is_ended = ended.load(Ordering::Relaxed);
        Ok(if is_ended { ExitCode::FAILURE } else { status })
    }
}

const fn cut(is_cut: bool) -> &'static str {
    if is_cut {
        "; the recording was cut off there"
    } else {
        ""
    }
}

/// What an older recording holds that is not played, in words; empty if nothing is.
fn passed_over(count: u64) -> String {
    match count {
        0 => String::new(),
        count => format!("; {count} rows of an older protocol say nothing in this version's"),
    }
}

/// What a board is told of its peer.
const fn said_to(role: Role) -> &'static str {
    match role {
        Role::Display => "estimates",
        Role::Sensor | Role::Host => "motions",
    }
}

fn report(role: Role, played: &Played, said: u64, unsaid: u64) -> anyhow::Result<ExitCode> {
    let what = said_to(role);
    let missed = match unsaid {
        0 => String::new(),
        unsaid => format!(", {unsaid} could not be said"),
    };
    output::print(&format!(
        "{said} {what} said to the {} board{missed}; {:.1} s of the recording, the latest {:.1} ms late{}{}",
        role.name(),
        played.recorded_s,
        played.latest.as_secs_f64() * 1e3,
        cut(played.cut),
        passed_over(played.passed_over),
    ))?;
    Ok(ExitCode::from(u8::from(unsaid > 0)))
}
