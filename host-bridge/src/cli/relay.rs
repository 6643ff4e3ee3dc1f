//! `host-bridge relay`.

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use crate::hand::Hand;
use crate::link::OPERATOR_STOP;
use crate::monitor::firmware_log::Logs;
use crate::relay::credentials::Credentials;
use crate::relay::endpoint::{Endpoint, Reach};
use crate::relay::name::{Name, common_name, common_name_of_router};
use crate::relay::network::{Ends, Network};
use crate::relay::operator::{self, Progress};
use crate::relay::refused;
use crate::relay::remote::site;
use crate::relay::report::{Notice, Report, cause};
use crate::relay::site::{Settings, Site, opposite};
use crate::relay::transport::Transport;
use crate::system::System;
use anyhow::{Context, bail};
use clap::{Args, Subcommand, ValueHint};
use protocol::Role;
use signal_hook::consts::SIGUSR2;

use super::output::{self, say};
use super::signals::{self, Again, Orders};

/// Between two looks whether the bridge is to end.
const LOOK: Duration = Duration::from_millis(50);
/// Between two lines of statistics.
const REPORT: Duration = Duration::from_secs(1);
/// How long an operator's connection takes to close, and its outcome to be told.
const CLOSES: Duration = Duration::from_millis(500);

/// How the parts play together.
pub const EXAMPLES: &str = "\
At one site:    host-bridge relay sensor --listen tls/0.0.0.0:7447 --ca FILE --certificate FILE --key FILE
At the other:   host-bridge relay display --connect tls/ADDRESS:7447 --ca FILE --certificate FILE --key FILE

With a router in between, both connect to it:
                host-bridge relay router --listen tls/0.0.0.0:7447 --ca FILE --certificate FILE --key FILE

Where the network itself lets nobody in:
                host-bridge relay sensor --listen tcp/0.0.0.0:7447 --insecure

udp/ in place of tcp/, and quic/ in place of tls/, sends estimates and motions as datagrams, at the same port: on a \
network that loses, nothing waits for what is lost.

With tls/ or quic/, all of them want --ca, --certificate and --key. Whoever has no certificate of that CA \
is refused, and the certificate's common name decides for whom it may speak: NAME.sensor, NAME.display, \
NAME.router, or NAME.operator for `relay stop`, where NAME is what --name says. Without TLS, listening beyond this \
computer wants --insecure.

Ctrl-C ends a bridge. `relay stop`, or SIGUSR1 to a bridge, says Stop to the boards until the display says \
that it has stopped. SIGUSR2 to a bridge that holds the bench hands it over to one of its site that waits. Who \
watches the board from the other site has its log, if the bench file names its firmware (`elf`) and the log's source (`rtt`). Once a second a bridge \
says on standard error how it goes; --json says it on standard output, and leaves nothing out.";

/// What `relay` is asked for.
#[derive(Debug, Args)]
pub struct Relay {
    #[command(subcommand)]
    part: Part,
}

#[derive(Debug, Subcommand)]
enum Part {
    /// The bridge at the sensor's site
    Sensor(Bridge),
    /// The bridge at the display's site
    Display(Bridge),
    /// Carries on what bridges say, where neither site can be reached from the other
    Router(Router),
    /// Says Stop to the boards; exit status 0 as soon as the display's board itself says that it has
    /// stopped, 1 if it does not: then press the emergency stop, or cut the display's power;
    /// and cut the power of the arm's drive, of which nothing is known
    Stop(Stopping),
}

#[derive(Debug, Args)]
struct Bridge {
    #[command(flatten)]
    boards: super::Where,
    #[command(flatten)]
    meeting: Meeting,
    #[command(flatten)]
    ends: EitherEnd,
    /// What comes from the other site older than this is not played; at most as long as the display holds
    /// an estimate, 500 ms unless configured
    #[arg(long, value_name = "MS", default_value_t = 400, value_parser = clap::value_parser!(u32).range(1..=60_000))]
    max_age: u32,
    /// Prints the statistics as lines of JSON on standard output
    #[arg(long)]
    json: bool,
    /// Listens beyond this computer without TLS: whoever reaches it may move the arm
    #[arg(long)]
    insecure: bool,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct EitherEnd {
    /// Where to wait for the other site to connect, e.g. tcp/0.0.0.0:7447; several may be given
    #[arg(long, value_name = "ENDPOINT")]
    listen: Vec<Endpoint>,
    /// Where the other site or a router listens, e.g. tcp/192.168.1.20:7447; of several, the first that
    /// answers is taken, and another one when it is lost
    #[arg(long, value_name = "ENDPOINT")]
    connect: Vec<Endpoint>,
}

#[derive(Debug, Args)]
struct Router {
    #[command(flatten)]
    proofs: Proofs,
    /// The bench that it carries, by what its sites call it: the one that its certificate is for. Without certificates
    /// it carries all
    #[arg(long = "name", value_name = "NAME", default_value = "bench")]
    names: Vec<Name>,
    /// Listens beyond this computer without TLS: whoever reaches it may move the arm
    #[arg(long)]
    insecure: bool,
    /// Where to wait for bridges, e.g. tcp/0.0.0.0:7447; several may be given
    #[arg(long, value_name = "ENDPOINT", required = true)]
    listen: Vec<Endpoint>,
}

#[derive(Debug, Args)]
struct Stopping {
    #[command(flatten)]
    meeting: Meeting,
    /// Where a bridge or a router listens; of several, all are told at once
    #[arg(long, value_name = "ENDPOINT", required = true)]
    connect: Vec<Endpoint>,
    /// How long to say so and to wait for the board's word
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=3_600))]
    within: u32,
}

/// Who meets whom, and how they know each other.
#[derive(Debug, Args)]
struct Meeting {
    /// What both sites call the bench: several benches may share a router
    #[arg(long, default_value = "bench")]
    name: Name,
    #[command(flatten)]
    proofs: Proofs,
}

#[derive(Debug, Args)]
struct Proofs {
    /// The certificate of the CA whose certificates are believed, in PEM
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, requires_all = ["certificate", "key"])]
    ca: Option<PathBuf>,
    /// One's own certificate, in PEM
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, requires_all = ["ca", "key"])]
    certificate: Option<PathBuf>,
    /// Its private key, in PEM, without a password
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, requires_all = ["ca", "certificate"])]
    key: Option<PathBuf>,
}

impl Proofs {
    fn credentials(self) -> Option<Credentials> {
        Some(Credentials {
            ca: self.ca?,
            certificate: self.certificate?,
            key: self.key?,
        })
    }
}

impl Relay {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let proofs = match &self.part {
            Part::Sensor(bridge) | Part::Display(bridge) => &bridge.meeting.proofs,
            Part::Router(router) => &router.proofs,
            Part::Stop(stopping) => &stopping.meeting.proofs,
        };
        if proofs.ca.is_some() {
            read_and_write_by_one_worker();
        }
        match self.part {
            Part::Sensor(bridge) => bridge.execute(Role::Sensor),
            Part::Display(bridge) => bridge.execute(Role::Display),
            Part::Router(router) => router.execute(),
            Part::Stop(stopping) => stopping.execute(),
        }
    }
}

impl Bridge {
    fn execute(self, role: Role) -> anyhow::Result<ExitCode> {
        let stops = Orders::to_stop()?;
        let hand_overs = Orders::of(SIGUSR2)?;
        let bench = self.boards.find()?;
        let seat = bench.seat(role).context("a host has no seat")?;
        let ends = if self.ends.listen.is_empty() {
            Ends::Connecting(self.ends.connect)
        } else {
            Ends::Listening(self.ends.listen)
        };
        let names = vec![self.meeting.name.clone()];
        let credentials = self.meeting.proofs.credentials();
        let network = Network::new(ends, credentials.clone(), names, self.insecure)?;
        if let Some(credentials) = credentials {
            credentials.check_owner(&common_name(&self.meeting.name, role))?;
        }
        let words = in_words(network.ends());
        warn_of(network.ends(), self.insecure);
        // Leaving a network that is stuck may take a while.
        let ended = signals::flag_set_by(&signals::USUAL, Again::EndsAtOnce)?;
        let mut hand = Hand::new(self.meeting.name.clone(), role);
        let (bridge, notices) = Site::open(Settings {
            role,
            place: seat.place(),
            name: self.meeting.name,
            network: Arc::new(network),
            max_age: Duration::from_millis(self.max_age.into()),
            shows_far_board: true,
            system: System::default(),
        })?;
        let (logs, lines) = Logs::new();
        super::follow_logs(&bench, &[role], &logs)?;
        let tell_log = bridge.log_teller();
        thread::spawn(move || lines.iter().for_each(|(_, line)| tell_log(line)));
        let stop = bridge.stopper();
        stops.obey(move || stop(OPERATOR_STOP));
        hand_overs.obey(bridge.hander_over());
        let far = opposite(role).map_or("the other site", site);
        say(&format!("{words}, waiting for {far}"));
        let mut before = None;
        let mut due = Instant::now() + REPORT;
        while !ended.load(Ordering::Relaxed) {
            match notices.recv_timeout(LOOK.min(due.saturating_duration_since(Instant::now()))) {
                Ok(notice) => {
                    hand.on_notice(&notice);
                    say(&notice.to_string());
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => bail!("the bridge has ended by itself"),
            }
            if Instant::now() >= due {
                due += REPORT;
                let report = bridge.report(false);
                if !print(&report, before.as_ref(), self.json)? {
                    break;
                }
                before = Some(report);
            }
        }
        // Nobody tells the boards again.
        for notice in notices.try_iter().chain(bridge.unstopped()) {
            say(&notice.to_string());
        }
        print(&bridge.report(true), None, self.json)?;
        Ok(ExitCode::SUCCESS)
    }
}

impl Router {
    fn execute(self) -> anyhow::Result<ExitCode> {
        let ends = Ends::Listening(self.listen);
        let credentials = self.proofs.credentials();
        let network = Network::new(ends, credentials.clone(), self.names.clone(), self.insecure)?;
        if let Some(credentials) = credentials {
            for name in &self.names {
                credentials.check_owner(&common_name_of_router(name))?;
            }
        }
        let words = in_words(network.ends());
        warn_of(network.ends(), self.insecure);
        let wait_for_end = signals::wait_for(&signals::USUAL)?;
        let session = network.open_router()?;
        say(&format!("router, {words}"));
        thread::spawn(|| {
            loop {
                thread::sleep(LOOK);
                for refused in refused::take() {
                    say(&Notice::Refused(refused).to_string());
                }
            }
        });
        wait_for_end();
        // Dropped, it leaves the network; whoever is connected sees it at once.
        drop(session);
        Ok(ExitCode::SUCCESS)
    }
}

impl Stopping {
    fn execute(self) -> anyhow::Result<ExitCode> {
        let within = Duration::from_secs(self.within.into());
        let name = self.meeting.name;
        let credentials = self.meeting.proofs.credentials();
        let (mut networks, mut refusals) = (Vec::new(), Vec::new());
        for endpoint in self.connect {
            let ends = Ends::Connecting(vec![endpoint.clone()]);
            match Network::new(ends, credentials.clone(), vec![name.clone()], false) {
                Ok(network) => networks.push((endpoint, network)),
                Err(refusal) => refusals.push(refusal),
            }
        }
        let nobody_can_be_told = networks.is_empty();
        let (outcomes, told) = channel();
        // All at once: one that is dead must not hold up the others, nor one that can't be used.
        for (endpoint, network) in networks {
            let (outcomes, name) = (outcomes.clone(), name.clone());
            thread::spawn(move || {
                let clock = System::default().clock;
                // Nobody waits any more once one has come through.
                let outcome = operator::stop(&network, &clock, &name, OPERATOR_STOP, within);
                let _ = outcomes.send(outcome.map_err(|error| match network.reach(&endpoint) {
                    Reach::Reached => format!("{endpoint}: {error}"),
                    reach => format!("{endpoint}: {reach}"),
                }));
            });
        }
        drop(outcomes);
        for refusal in refusals {
            if nobody_can_be_told {
                return Err(refusal.into());
            }
            say(&refusal.to_string());
        }
        // Tried all the same: a Stop is not kept back for what is only known here.
        let operator = common_name(&name, Role::Host);
        if let Some(Err(refusal)) = credentials.map(|own| own.check_owner(&operator)) {
            say(&refusal.to_string());
        }
        let mut progress = Progress::Unheard;
        let mut errors = Vec::new();
        // Those that were never reached may take longer to say why: nobody waits for that to hear that nothing stopped.
        let end = Instant::now() + within + CLOSES;
        while let Ok(outcome) = told.recv_timeout(end.saturating_duration_since(Instant::now())) {
            match outcome {
                Ok(stopping) if stopping.progress == Progress::Stopped => {
                    let cause = cause(stopping.trip);
                    say(&format!("Stop: the display has stopped: {cause}"));
                    return Ok(ExitCode::SUCCESS);
                }
                Ok(stopping) => progress = progress.max(stopping.progress),
                Err(error) => errors.push(error),
            }
        }
        let so_far = match progress {
            Progress::Unheard => "no word from the display's bridge",
            Progress::Heard => {
                "the display's bridge has heard it, but its board is not there or takes nothing"
            }
            Progress::Told | Progress::Stopped => {
                "the display's board was told, but does not say that it has stopped"
            }
        };
        say(&format!(
            "NOT STOPPED as far as is known: {so_far}, in {} s: press the emergency stop, or cut the display's power; and cut the power of the arm's drive, of which nothing is known",
            self.within
        ));
        let late = told.into_iter().filter_map(Result::err);
        for error in errors.into_iter().chain(late) {
            say(&error);
        }
        Ok(ExitCode::from(1))
    }
}

/// Has zenoh read where it writes, by one worker. By two it does both at once to one TLS connection, whose owner
/// forbids that: memory is spoiled, and the program crashes (eclipse-zenoh/zenoh#2557). Where zenoh blocks while it
/// reads, as when a session comes or goes, another thread takes the worker's place, and for a moment the two may still
/// meet. To be called before there is another thread.
#[expect(unsafe_code, reason = "zenoh takes this from the environment alone")]
fn read_and_write_by_one_worker() {
    // SAFETY: no other thread looks at the environment, for there is none.
    unsafe { std::env::set_var("ZENOH_RUNTIME", "(rx:(handover:tx),tx:(worker_threads:1))") };
}

/// Says what an open end means.
fn warn_of(ends: &Ends, is_insecure: bool) {
    if let Ends::Listening(endpoints) = ends
        && is_insecure
    {
        for endpoint in endpoints {
            say(&format!(
                "INSECURE: whoever reaches {endpoint} may move the arm"
            ));
        }
    }
}

fn in_words(ends: &Ends) -> String {
    let (what, endpoints) = match ends {
        Ends::Listening(endpoints) => ("listening on", endpoints),
        Ends::Connecting(endpoints) => ("connecting to", endpoints),
    };
    let endpoints: Vec<String> = endpoints.iter().map(Endpoint::to_string).collect();
    format!("{what} {}", endpoints.join(", "))
}

/// Prints a report; false if nobody reads any more.
fn print(report: &Report, before: Option<&Report>, json: bool) -> anyhow::Result<bool> {
    if json {
        output::print_on(&serde_json::to_string(report)?)
    } else if report.total {
        output::print_on(&report.to_string())
    } else {
        // Whether anybody reads it or not.
        let _ = writeln!(io::stderr(), "{}", report.line(before));
        Ok(true)
    }
}
