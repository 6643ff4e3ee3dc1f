//! Both servers, fed by the links to the boards.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use protocol::{Role, Stop, StopReason};

use super::foxglove_server::{FoxgloveServer, LiveError};
use super::page::{self, Newest};
use super::picture::Picture;
use crate::host_clock::now_us;
use crate::link::{Event, Link};
use crate::monitor::dashboard::Dashboard;
use crate::recording::gauge_stream::GaugeStream;

/// Between two pictures for the page.
const PICTURE: Duration = Duration::from_millis(50);

/// Where it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The address to listen on.
    pub address: IpAddr,
    /// The port for Foxglove; the page has the next one. 0: any that are free.
    pub port: u16,
    /// Whether the sensor board is asked for its gauges meanwhile.
    pub gauges: bool,
}

/// Shows what the boards say.
pub struct Viewer {
    foxglove: FoxgloveServer,
    page: SocketAddr,
    newest: Arc<Newest>,
    dashboard: Dashboard,
    stream: GaugeStream,
    links: Vec<(Role, Link)>,
    told: Receiver<(Role, Event)>,
}

impl Viewer {
    /// Begins to listen. What the links tell comes from `told`.
    ///
    /// # Errors
    /// If a port can't be had.
    pub fn start(
        settings: Settings,
        links: Vec<(Role, Link)>,
        told: Receiver<(Role, Event)>,
    ) -> Result<Self, LiveError> {
        let Settings {
            address,
            port,
            gauges,
        } = settings;
        let foxglove = FoxgloveServer::start(address, port)?;
        let newest = Arc::<Newest>::default();
        let boards: Vec<_> = links.iter().map(|(_, link)| link.sender()).collect();
        let stop = move || {
            for board in &boards {
                // What can't be said yet is said as soon as it can, and again until the board answers.
                let _ = board.stop(Stop {
                    reason: StopReason::Operator,
                });
            }
        };
        let beside = if port == 0 { 0 } else { port.saturating_add(1) };
        let page = page::serve(address, beside, Arc::clone(&newest), Box::new(stop))?;
        Ok(Self {
            foxglove,
            page,
            newest,
            dashboard: Dashboard::default(),
            stream: GaugeStream::new(gauges),
            links,
            told,
        })
    }

    /// The port for Foxglove.
    pub fn foxglove_port(&self) -> u16 {
        self.foxglove.port()
    }

    /// Where the page is.
    pub const fn page(&self) -> SocketAddr {
        self.page
    }

    /// Shows until `ended`.
    pub fn run(mut self, ended: &AtomicBool) {
        let mut due = Instant::now();
        while !ended.load(Ordering::Relaxed) {
            match self
                .told
                .recv_timeout(due.saturating_duration_since(Instant::now()))
            {
                Ok((role, event)) => self.take(role, event),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            while let Some((role, message)) = self.stream.due(now_us()) {
                if let Some((_, link)) = self.links.iter().find(|(of, _)| *of == role) {
                    // Asked again if it is not answered.
                    let _ = link.post(&message);
                }
            }
            if Instant::now() >= due {
                due = Instant::now() + PICTURE;
                self.dashboard.elapse(now_us());
                if let Ok(json) = serde_json::to_string(&Picture::of(&self.dashboard)) {
                    self.newest.put(json);
                }
            }
        }
        self.foxglove.stop();
    }

    fn take(&mut self, role: Role, event: Event) {
        self.stream.on_event(role, &event);
        let now_us = now_us();
        let at_us = match &event {
            Event::Heard { at_us, .. } => *at_us,
            _ => now_us,
        };
        self.foxglove.on_event(role, &event, at_us);
        self.dashboard.on(now_us, role, event);
    }
}
