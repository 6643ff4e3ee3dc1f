//! `host-bridge live`.

use std::net::{IpAddr, Ipv4Addr};
use std::process::ExitCode;

use crate::live::{PORT, Settings, Viewer};
use crate::monitor::firmware_log::Logs;
use anyhow::bail;
use crossbeam_channel::unbounded;

use super::output;
use super::signals::{self, Again, Orders};
use super::stop::Teller;

/// What the command does.
pub const ABOUT: &str = "\
Shows what both boards say, as it comes: to Foxglove, by its own WebSocket protocol, with the topics and schemas of \
a recording; and on a page for any browser, with a Stop for both boards. Foxglove can't say anything to the boards. \
The page is on the port beside Foxglove's, for the server of Foxglove's own library answers nothing else.

Both are for this computer alone; --listen lets others in, who may then watch and stop. There is neither password \
nor encryption, so that it asks for --insecure. The sensor board is asked for its gauges meanwhile. A board's log is \
shown if the bench file names its firmware (`elf`) and the log's source (`rtt`).";

/// How it is used.
pub const EXAMPLES: &str = "\
Examples:
  host-bridge live                      Foxglove: ws://127.0.0.1:8765; the page: http://127.0.0.1:8766
  host-bridge live --port 9000
  host-bridge live --listen 192.168.0.7 --insecure     for a tablet

Exit status: 0 ended by a signal; 2 it can't show anything.";

/// What `live` is asked for.
#[derive(Debug, clap::Args)]
pub struct Live {
    /// The port for Foxglove; the page has the next one. 0: any that are free; without it 8765, or 8767 and so
    /// on if another program has that
    #[arg(long, value_parser = clap::value_parser!(u16).range(..65_535))]
    port: Option<u16>,
    /// The address to listen on
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    listen: IpAddr,
    /// Listens beyond this computer, without password or encryption
    #[arg(long)]
    insecure: bool,
    /// Asks for no samples of the gauges: there are some if somebody else does
    #[arg(long)]
    no_gauges: bool,
    #[command(flatten)]
    boards: super::Where,
}

impl Live {
    /// Shows.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        if !self.listen.is_loopback() && !self.insecure {
            bail!(
                "--listen {}: anybody who reaches it may watch and stop: say --insecure if that is meant",
                self.listen
            );
        }
        let orders = Orders::to_stop()?;
        let bench = self.boards.find()?;
        let (logs, lines) = Logs::new();
        super::follow_logs(&bench, &bench.roles(), &logs)?;
        let ended = signals::flag_set_by(&signals::USUAL, Again::EndsAtOnce)?;
        let teller = Teller::start(bench.roles());
        let (events, told) = unbounded();
        let hears = teller.clone();
        let links = super::links(&bench, move |role, event| {
            hears.on_event(role, &event);
            super::tell(&events, role, event);
        });
        let begins = teller.clone();
        orders.stop_boards(&links, move || begins.begin());
        let settings = Settings {
            address: self.listen,
            port: self.port,
            gauges: !self.no_gauges,
        };
        let viewer = Viewer::start(settings, links, told, lines)?;
        if self.port.is_none() && viewer.foxglove_port() != PORT {
            eprintln!(
                "host-bridge: another program has port {PORT} or {}: this one is shown on others",
                PORT + 1
            );
        }
        output::print(&format!(
            "Foxglove: ws://{}\npage: http://{}/",
            std::net::SocketAddr::new(self.listen, viewer.foxglove_port()),
            viewer.page(),
        ))?;
        viewer.run(&ended);
        teller.end();
        Ok(ExitCode::SUCCESS)
    }
}
