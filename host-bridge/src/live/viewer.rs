//! Both servers, fed by the links to the boards, and what the page shows.

use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError};
use protocol::{DisplayState, Role, Trip};
use serde_json::{Value, json};

use super::foxglove_server::{FoxgloveServer, LiveError};
use super::page::{self, Newest};
use crate::clock::now_us;
use crate::hand;
use crate::link::{Event, Link, stop_all};
use crate::monitor::dashboard::{Dashboard, FRESH_US};
use crate::monitor::log_entry::LogEvent;
use crate::recording::gauge_stream::GaugeStream;

/// Between two pictures for the page.
const PICTURE: Duration = Duration::from_millis(50);

/// Between two looks at who moves the arm.
const HANDS: Duration = Duration::from_millis(500);
/// The port for Foxglove unless another is asked for.
pub const PORT: u16 = 8_765;
/// Pairs of ports that are tried then: each program that shows a bench takes one.
const PAIRS: u16 = 16;

/// Where it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    pub address: IpAddr,
    /// The port for Foxglove; the page has the next one. 0: any that are free; none: [`PORT`], or the next pair
    /// that is free.
    pub port: Option<u16>,
    /// Whether the sensor board is asked for its gauges meanwhile.
    pub gauges: bool,
}

pub struct Viewer {
    foxglove: FoxgloveServer,
    page: SocketAddr,
    newest: Arc<Newest>,
    dashboard: Dashboard,
    stream: GaugeStream,
    links: Vec<(Role, Link)>,
    told: Receiver<(Role, Event)>,
    lines: mpsc::Receiver<(Role, LogEvent)>,
}

impl Viewer {
    /// Begins to listen. What the links tell comes from `told`, what the boards log from `lines`. Fails if a port can't
    /// be had.
    pub fn start(
        settings: Settings,
        links: Vec<(Role, Link)>,
        told: Receiver<(Role, Event)>,
        lines: mpsc::Receiver<(Role, LogEvent)>,
    ) -> Result<Self, LiveError> {
        let (foxglove, (listener, page)) = take_ports(settings.address, settings.port)?;
        let newest = Arc::<Newest>::default();
        let boards: Vec<_> = links.iter().map(|(_, link)| link.sender()).collect();
        let stop = move || stop_all(&boards);
        page::serve(listener, Arc::clone(&newest), Box::new(stop));
        let mut dashboard = Dashboard::default();
        dashboard.linked = links.iter().map(|(role, _)| *role).collect();
        Ok(Self {
            foxglove,
            page,
            newest,
            dashboard,
            stream: GaugeStream::new(settings.gauges),
            links,
            told,
            lines,
        })
    }

    pub fn foxglove_port(&self) -> u16 {
        self.foxglove.port()
    }

    pub const fn page(&self) -> SocketAddr {
        self.page
    }

    pub fn run(mut self, ended: &AtomicBool) {
        let mut due = Instant::now();
        let (mut hands, mut hands_due) = (Vec::new(), due);
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
                self.take_lines();
                if Instant::now() >= hands_due {
                    hands_due = Instant::now() + HANDS;
                    hands = hand::hands();
                }
                self.show(&hands);
            }
        }
        self.foxglove.stop();
    }

    /// Draws another picture for the page.
    fn show(&mut self, hands: &[String]) {
        self.dashboard.elapse(now_us());
        // Shown already, with the last ones.
        self.dashboard.take_log_entries();
        self.newest.put(picture(&self.dashboard, hands).to_string());
    }

    fn take_lines(&mut self) {
        while let Ok((role, what)) = self.lines.try_recv() {
            if let Some((level, text)) = what.line() {
                self.foxglove.on_log(role, level, text, now_us());
            }
            self.dashboard.log(role, what);
        }
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

type Taken = (FoxgloveServer, (TcpListener, SocketAddr));

/// Takes the pair of ports that is asked for, or the first one that is free.
fn take_ports(address: IpAddr, port: Option<u16>) -> Result<Taken, LiveError> {
    let take = |port: u16| {
        let beside = if port == 0 { 0 } else { port.saturating_add(1) };
        let page = page::listen(address, beside)?;
        Ok((FoxgloveServer::start(address, port)?, page))
    };
    let first = take(port.unwrap_or(PORT));
    if first.is_ok() || port.is_some() {
        return first;
    }
    let mut next = (1..PAIRS).map(|pair| take(PORT + 2 * pair));
    next.find(Result::is_ok).unwrap_or(first)
}

/// One moment of a dashboard, and of what the relays here say of who moves the arm.
pub fn picture(dashboard: &Dashboard, hands: &[String]) -> Value {
    let now_us = dashboard.now_us;
    let is_fresh = |at_us: u64| now_us.saturating_sub(at_us) < FRESH_US;
    let mm_s = |um_s: i32| um_s as f32 / 1e3;
    let safety = dashboard.safety.map(|(_, state)| state);
    let board = |role: Role| {
        let board = dashboard.board(role);
        let state = board.state.as_ref();
        let stopped = match (role, safety) {
            (Role::Sensor, _) => board.arm_stopped,
            (_, Some(DisplayState::Stopped(trip))) => Some(trip),
            _ => None,
        };
        json!({
            "name": role.name(),
            "state": state.map_or_else(|| "not looked for".to_owned(), ToString::to_string),
            "known": board.is_known(),
            // Whether this program may say anything to it.
            "linked": dashboard.linked.contains(&role),
            "stopped": stopped.map(Trip::name),
        })
    };
    let estimate = dashboard.present_estimate();
    let motion = dashboard.present_motion();
    let has_gauges = dashboard.gauges_us.is_some_and(is_fresh);
    // In ADC steps (3.3 V / 4096).
    let gauges_lsb = dashboard.traces.gauges_lsb.each_ref().map(|trace| {
        let extent = trace.extent(now_us.saturating_sub(FRESH_US), now_us);
        extent.filter(|_| has_gauges).map(|extent| extent.last)
    });
    // Each one's place in mm, and its largest voltage of the last 50 to 100 ms.
    let fingertip = &dashboard.fingertip;
    let actuators = fingertip
        .actuators()
        .into_iter()
        .flatten()
        .zip(fingertip.peaks_v());
    let mm = |um: i16| f32::from(um) / 1e3;
    let log = dashboard.log_entries.iter().rev().take(8);
    json!({
        "now_ms": now_us / 1_000,
        "boards": [board(Role::Sensor), board(Role::Display)],
        "estimate": estimate.map(|estimate| json!({
            "wavelength_mm": estimate.wavelength_mm,
            "valid": estimate.valid,
            "confidence": estimate.confidence,
            "counted_mm": estimate.counted_mm,
            "arm_mm_s": mm_s(estimate.velocity_um_s),
        })),
        "hand_mm_s": motion.map(|motion| mm_s(motion.velocity_um_s)),
        "gauges_lsb": gauges_lsb,
        "supervisor": safety.map(|state| state.to_string()),
        "stopped": matches!(safety, Some(DisplayState::Stopped(_))),
        "actuators": actuators
            .map(|(actuator, peak_v)| [mm(actuator.x_um), mm(actuator.y_um), peak_v])
            .collect::<Vec<_>>(),
        "hands": hands,
        // The newest first.
        "log": log
            .map(|entry| format!("{}: {}", entry.role.name(), entry.what))
            .collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use protocol::{Arm, ArmState, Message};

    use super::*;
    use crate::state::State;

    #[test]
    fn the_picture_tells_which_boards_are_linked_and_stopped() {
        let mut dashboard = Dashboard::default();
        dashboard.linked = vec![Role::Sensor];
        let stopped = |dashboard: &Dashboard| {
            let boards = picture(dashboard, &[])["boards"].take();
            let each = |at: usize| [boards[at]["linked"].clone(), boards[at]["stopped"].clone()];
            [each(0), each(1)]
        };
        let none = [json!(false), json!(null)];
        assert_eq!(
            stopped(&dashboard),
            [[json!(true), json!(null)], none.clone()]
        );
        let arm = Message::Arm(Arm {
            instant_us: 1,
            state: ArmState::Stopped(Trip::Operator),
        });
        let heard = Event::Heard {
            at_us: 1,
            message: arm,
        };
        dashboard.on(1, Role::Sensor, heard);
        let by = json!("by the operator");
        assert_eq!(stopped(&dashboard), [[json!(true), by], none]);
    }

    #[test]
    fn what_has_happened_is_kept_no_longer_than_it_is_shown() {
        let settings = Settings {
            address: IpAddr::from([127, 0, 0, 1]),
            port: Some(0),
            gauges: false,
        };
        let (_events, told) = crossbeam_channel::unbounded();
        let (logs, lines) = mpsc::channel();
        let viewer = Viewer::start(settings, Vec::new(), told, lines);
        let mut viewer = viewer.expect("any port will do");
        let port = PathBuf::from("/dev/null/sensor");
        viewer.take(Role::Sensor, Event::StateChanged(State::Silent(port)));
        let line = LogEvent::Log {
            level: Some("info"),
            text: "scan 1 of 4".to_owned(),
        };
        logs.send((Role::Display, line)).expect("it is there");
        viewer.take_lines();
        viewer.show(&[]);
        assert_eq!(viewer.dashboard.take_log_entries(), []);
        assert_eq!(viewer.dashboard.log_entries.len(), 2);
        let log = picture(&viewer.dashboard, &[])["log"].take();
        assert_eq!(log[0], json!("display: info: scan 1 of 4"));
    }

    #[test]
    fn a_second_program_takes_other_ports_unless_these_are_asked_for() {
        let here = IpAddr::from([127, 0, 0, 1]);
        // Another program may have it already: all the better.
        let taken = TcpListener::bind((here, PORT + 1));
        let (foxglove, (_, page)) = take_ports(here, None).expect("others are free");
        assert_ne!(foxglove.port(), PORT);
        assert_eq!(page.port(), foxglove.port() + 1);
        let refused = take_ports(here, Some(PORT)).map(|_| ());
        let words = refused.expect_err("it is taken").to_string();
        assert!(words.contains("give another one with --port"), "{words}");
        drop(taken);
    }
}
