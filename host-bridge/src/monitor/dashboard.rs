//! Everything that a monitor shows, fed by events alone: the same from boards and from a recording.

use std::collections::VecDeque;

use protocol::{
    ACTUATORS, DisplayState, Estimate, GAUGES, Gauges, Message, Motion, PortCounters, Role,
    RoleCounters, Trip,
};

use super::board::Board;
use super::fingertip::Fingertip;
use super::log_entry::{LogEntry, LogEvent};
use super::orders::{Change, Outcome, taken};
use super::settings;
use super::settings::Setting;
use super::trace::Trace;
use crate::link::{Clocks, Event, NotSent, by_hand, not_stopped};

const LOG_ENTRIES: usize = 500;
/// A message to the person who watches stands for so long, in µs.
const NOTICE_US: u64 = 6_000_000;
/// A sample is so many sixteenths of an ADC step.
const CODES_PER_LSB: f32 = 16.0;
/// µs between two samples of a gauge.
const SAMPLE_US: u64 = 1_000;
/// A board answers a Stop within milliseconds; after so long, in µs, whoever said it is told that it did not.
const STOP_US: u64 = 500_000;

/// A value that is older than this, in µs, is not told as the present.
pub(crate) const FRESH_US: u64 = 500_000;

/// The last seconds of everything that is traced.
#[derive(Clone, Debug, Default)]
pub struct Traces {
    /// λ in mm while the sensor stands by it.
    pub wavelength_mm: Trace,
    /// λ in mm while it does not.
    pub unsure_mm: Trace,
    /// λ in mm by the paper's count.
    pub counted_mm: Trace,
    /// The arm's velocity in mm/s.
    pub arm_mm_s: Trace,
    /// The hand's velocity in mm/s.
    pub hand_mm_s: Trace,
    /// Each gauge in ADC steps.
    pub gauges_lsb: [Trace; GAUGES],
}

/// A message to the person who watches.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// When it was made, in µs.
    pub at_us: u64,
    /// Whether something did not happen that was asked for.
    pub is_bad: bool,
    /// What it says.
    pub text: String,
}

/// All that a monitor knows.
#[derive(Clone, Debug, Default)]
pub struct Dashboard {
    /// The present, in µs of [`crate::clock::now_us`].
    pub now_us: u64,
    /// The sensor board.
    pub sensor: Board,
    /// The display board.
    pub display: Board,
    /// The last estimate, and when it came.
    pub estimate: Option<(u64, Estimate)>,
    /// The last motion, and when it came.
    pub motion: Option<(u64, Motion)>,
    /// When gauges came last.
    pub gauges_us: Option<u64>,
    /// The supervisor's state, and since when; none while the display is not heard.
    pub safety: Option<(u64, DisplayState)>,
    /// The traces.
    pub traces: Traces,
    /// The actuators.
    pub fingertip: Fingertip,
    /// What has happened, the oldest first.
    pub log_entries: VecDeque<LogEntry>,
    /// Whether the gauges are to be streamed for who watches.
    pub streams: bool,
    /// What came of the last change that was asked for.
    pub outcome: Option<Outcome>,
    /// The boards to which there is a way: none where a recording is watched.
    pub linked: Vec<Role>,
    /// The boards that have not answered a Stop, and since when.
    stopping: Option<(u64, Vec<Role>)>,
    notice: Option<Notice>,
    fresh: Vec<LogEntry>,
}

impl Dashboard {
    /// The board of `role`; a host counts as the display.
    pub const fn board(&self, role: Role) -> &Board {
        match role {
            Role::Sensor => &self.sensor,
            Role::Display | Role::Host => &self.display,
        }
    }

    const fn board_mut(&mut self, role: Role) -> &mut Board {
        match role {
            Role::Sensor => &mut self.sensor,
            Role::Display | Role::Host => &mut self.display,
        }
    }

    /// Takes an event of the link to the board of `role`, at `now_us`.
    pub fn on(&mut self, now_us: u64, role: Role, event: Event) {
        self.now_us = self.now_us.max(now_us);
        match event {
            Event::Heard { at_us, message } => {
                self.now_us = self.now_us.max(at_us);
                self.hear(role, at_us, &message);
            }
            Event::Restarted => {
                let board = self.board_mut(role);
                board.clocks = None;
                board.arm_stopped = None;
                self.fingertip.restart();
                self.board_mut(role).orders.read();
                self.log(role, LogEvent::Restarted);
            }
            Event::StateChanged(state) => {
                if state.is_known() {
                    self.board_mut(role).orders.read();
                } else {
                    self.lose(role);
                }
                self.board_mut(role).state = Some(state.clone());
                self.log(role, LogEvent::Link(state));
            }
        }
    }

    /// Takes note of something that is no event of a link.
    pub fn log(&mut self, role: Role, what: LogEvent) {
        let log_entry = LogEntry {
            at_us: self.now_us,
            role,
            what,
        };
        if self.log_entries.len() == LOG_ENTRIES {
            self.log_entries.pop_front();
        }
        self.log_entries.push_back(log_entry.clone());
        self.fresh.push(log_entry);
    }

    /// What has happened since the last call, which is to come now and then.
    pub fn take_log_entries(&mut self) -> Vec<LogEntry> {
        std::mem::take(&mut self.fresh)
    }

    /// What this program's end of a line knows.
    pub fn on_line(&mut self, role: Role, counters: PortCounters, clocks: Option<Clocks>) {
        let board = self.board_mut(role);
        board.counters = Some(counters);
        board.clocks = clocks;
    }

    /// It is `now_us`. What is due is put into the outbox.
    pub fn elapse(&mut self, now_us: u64) {
        self.now_us = self.now_us.max(now_us);
        self.sensor.rate.elapse(now_us);
        self.display.rate.elapse(now_us);
        for role in [Role::Sensor, Role::Display] {
            let is_known = self.board(role).is_known();
            if let Some(outcome) = self.board_mut(role).orders.elapse(now_us, is_known) {
                self.conclude(role, outcome);
            }
        }
        if let Some((since_us, boards)) = &self.stopping
            && now_us.saturating_sub(*since_us) >= STOP_US
        {
            let words = not_stopped(boards, "no answer, told again");
            self.notify(true, words);
        }
        let is_over = |notice: &mut Notice| now_us.saturating_sub(notice.at_us) > NOTICE_US;
        self.notice.take_if(is_over);
    }

    /// What is to be said to the board of `role` now.
    pub fn take_outbox(&mut self, role: Role) -> Vec<Message> {
        self.board_mut(role).orders.take()
    }

    /// Something could not be said.
    pub fn on_not_sent(&mut self, role: Role, why: NotSent) {
        self.notify(true, format!("{}: {why}", role.name()));
    }

    /// Stop was said on every way there is: shows who has answered.
    pub fn stop(&mut self) {
        if self.linked.is_empty() {
            let by_hand = by_hand(&[Role::Sensor, Role::Display]);
            let words = format!("NOT STOPPED: there is no way to the boards from here: {by_hand}");
            return self.notify(true, words);
        }
        self.stopping = Some((self.now_us, self.linked.clone()));
        self.notify(false, "stop: sent, not confirmed yet".to_owned());
    }

    /// A board says that it has stopped, on the way to that of `role`.
    fn on_stopped(&mut self, role: Role) {
        let state = self.board(role).state.as_ref();
        let who = state.map_or(Some(role), |state| state.who(role));
        let (Some((_, boards)), Some(who)) = (&mut self.stopping, who) else {
            return;
        };
        if !self.linked.contains(&who) {
            return;
        }
        boards.retain(|board| *board != who);
        let waits = boards.clone();
        if waits.is_empty() {
            self.stopping = None;
        }
        let confirmed = self.linked.iter().filter(|board| !waits.contains(board));
        let names: Vec<&str> = confirmed.map(|board| board.name()).collect();
        let names = names.join(" and the ");
        self.notify(false, format!("stop: confirmed by the {names}"));
    }

    /// Reads both configurations anew.
    pub fn read_configurations(&mut self) {
        for role in [Role::Sensor, Role::Display] {
            self.board_mut(role).orders.read();
        }
    }

    /// Changes one setting of the board of `role`, and keeps all others.
    pub fn change(&mut self, role: Role, setting: &'static Setting, text: &str) {
        if !self.board(role).is_known() {
            return self.on_not_sent(role, NotSent::NotKnown);
        }
        let now_us = self.now_us;
        self.outcome = None;
        let change = Change {
            settings: vec![(setting, text.to_owned())],
            actuators: None,
        };
        self.board_mut(role).orders.change(change, now_us);
    }

    /// Has the gauges streamed for who watches, or no longer.
    pub fn toggle_gauges(&mut self) {
        if !self.board(Role::Sensor).is_known() {
            return self.on_not_sent(Role::Sensor, NotSent::NotKnown);
        }
        self.streams = !self.streams;
        let text = if self.streams {
            "the gauges are streamed from now on"
        } else {
            "the gauges are asked for no longer"
        };
        self.notify(false, text.to_owned());
    }

    /// Says something to the person who watches.
    pub fn notify(&mut self, is_bad: bool, text: String) {
        self.notice = Some(Notice {
            at_us: self.now_us,
            is_bad,
            text,
        });
    }

    /// What is to be said to the person who watches at the moment.
    pub const fn notice(&self) -> Option<&Notice> {
        self.notice.as_ref()
    }

    /// Whether something that the board of `role` said at `at_us` tells of the present.
    fn is_present(&self, role: Role, at_us: u64) -> bool {
        !self.board(role).is_lost() && self.now_us.saturating_sub(at_us) < FRESH_US
    }

    /// The last estimate, while it tells of the present.
    pub fn present_estimate(&self) -> Option<&Estimate> {
        let (at_us, estimate) = self.estimate.as_ref()?;
        self.is_present(Role::Sensor, *at_us).then_some(estimate)
    }

    /// The last motion, while it tells of the present.
    pub fn present_motion(&self) -> Option<&Motion> {
        let (at_us, motion) = self.motion.as_ref()?;
        self.is_present(Role::Display, *at_us).then_some(motion)
    }

    /// Time since the last estimate, in ms.
    pub fn estimate_age_ms(&self) -> Option<u64> {
        let (at_us, _) = self.estimate.as_ref()?;
        Some(self.now_us.saturating_sub(*at_us) / 1_000)
    }

    /// Time since the last motion, in ms.
    pub fn motion_age_ms(&self) -> Option<u64> {
        let (at_us, _) = self.motion.as_ref()?;
        Some(self.now_us.saturating_sub(*at_us) / 1_000)
    }

    /// The largest voltage of each actuator in the last tenth of a second, in V; none if the display is
    /// not heard, or its array is not known.
    pub fn peaks_v(&self) -> Option<[f32; ACTUATORS]> {
        (self.safety.is_some() && self.fingertip.is_known()).then(|| self.fingertip.peaks_v())
    }

    /// The voltage of each actuator now, in V; none as above.
    pub fn volts(&self) -> Option<[f32; ACTUATORS]> {
        (self.safety.is_some() && self.fingertip.is_known()).then(|| self.fingertip.volts())
    }

    /// The counters of every port, by its name, as far as they are known: both of each board, and this
    /// program's ends of their consoles.
    pub fn ports(&self) -> [(&'static str, Option<PortCounters>); 6] {
        let sensor = self.sensor.status.map(|(_, status)| status);
        let display = self.display.status.map(|(_, status)| status);
        [
            ("sensor peer", sensor.map(|status| status.peer)),
            ("display peer", display.map(|status| status.peer)),
            ("sensor console", sensor.map(|status| status.console)),
            ("display console", display.map(|status| status.console)),
            ("here, sensor", self.sensor.counters),
            ("here, display", self.display.counters),
        ]
    }

    fn hear(&mut self, role: Role, at_us: u64, message: &Message) {
        match (role, message) {
            (Role::Sensor, Message::Estimate(estimate)) => self.on_estimate(at_us, estimate),
            (Role::Sensor, Message::Gauges(gauges)) => self.on_gauges(at_us, gauges),
            (Role::Display, Message::Motion(motion)) => self.on_motion(at_us, motion),
            (Role::Display, Message::Safety(safety)) => self.turn(safety.state),
            (Role::Sensor, Message::Arm(arm)) => self.on_arm(arm.state.trip()),
            (_, Message::Stopped(_)) => self.on_stopped(role),
            (_, Message::Status(status)) => {
                self.board_mut(role).status = Some((at_us, *status));
                match (role, &status.role) {
                    (Role::Display, RoleCounters::Display(counters)) => self.turn(counters.state),
                    (Role::Sensor, RoleCounters::Sensor(counters)) => self.on_arm(counters.stopped),
                    _ => {}
                }
            }
            (_, Message::Configuration(report)) => {
                let configuration = report.configuration;
                if settings::role_of(&configuration) == role {
                    self.board_mut(role).configuration = Some(configuration);
                }
                if let protocol::Configuration::Display(display) = &configuration {
                    self.fingertip.configure(display);
                }
                if let Some(outcome) = self.board_mut(role).orders.on_report(at_us, report) {
                    self.conclude(role, outcome);
                }
            }
            _ => {}
        }
    }

    fn on_estimate(&mut self, at_us: u64, estimate: &Estimate) {
        let own_us = self.sensor.own_us(estimate.instant_us, at_us);
        self.sensor.rate.count();
        self.estimate = Some((at_us, *estimate));
        self.fingertip.hear(estimate);
        let traces = &mut self.traces;
        if let Some(wavelength_mm) = estimate.wavelength_mm {
            let trace = if estimate.valid {
                &mut traces.wavelength_mm
            } else {
                &mut traces.unsure_mm
            };
            trace.put(own_us, wavelength_mm);
        }
        if let Some(counted_mm) = estimate.counted_mm {
            traces.counted_mm.put(own_us, counted_mm);
        }
        traces.arm_mm_s.put(own_us, mm_s(estimate.velocity_um_s));
    }

    fn on_motion(&mut self, at_us: u64, motion: &Motion) {
        let own_us = self.display.own_us(motion.instant_us, at_us);
        self.display.rate.count();
        self.motion = Some((at_us, *motion));
        self.fingertip.follow(motion);
        self.traces
            .hand_mm_s
            .put(own_us, mm_s(motion.velocity_um_s));
    }

    fn on_gauges(&mut self, at_us: u64, block: &Gauges) {
        self.gauges_us = Some(at_us);
        // The block is sent when it is full.
        let begun_us = at_us.saturating_sub(block.samples.len() as u64 * SAMPLE_US);
        let mut own_us = self.sensor.own_us(block.instant_us, begun_us);
        for sample in &block.samples {
            for (trace, code) in self.traces.gauges_lsb.iter_mut().zip(sample.codes) {
                trace.put(own_us, f32::from(code) / CODES_PER_LSB);
            }
            own_us += SAMPLE_US;
        }
    }

    /// The supervisor is in a state, be it a new one or not.
    fn turn(&mut self, state: DisplayState) {
        if self.safety.is_some_and(|(_, before)| before == state) {
            return;
        }
        self.safety = Some((self.now_us, state));
        self.fingertip.turn(Some(state));
        self.log(Role::Display, LogEvent::Safety(state));
    }

    /// The sensor board says what has stopped its arm, be it news or not.
    fn on_arm(&mut self, stopped: Option<Trip>) {
        let before = std::mem::replace(&mut self.sensor.arm_stopped, stopped);
        if let Some(trip) = stopped.filter(|_| stopped != before) {
            self.log(Role::Sensor, LogEvent::ArmStopped(trip));
        }
    }

    /// The board is not there, or not understood.
    fn lose(&mut self, role: Role) {
        let board = self.board_mut(role);
        board.clocks = None;
        board.arm_stopped = None;
        board.configuration = None;
        self.board_mut(role).orders.lost();
        if role == Role::Display {
            self.safety = None;
            self.fingertip.turn(None);
        }
    }

    fn conclude(&mut self, role: Role, outcome: Outcome) {
        let name = role.name();
        let (is_bad, text) = match &outcome {
            Outcome::Taken(values) => (false, format!("{name}: {}", taken(values))),
            Outcome::Refused(refusal) => (true, format!("{name}: refused: {refusal}")),
            Outcome::Misread(misread) => (true, misread.to_string()),
            Outcome::Unanswered => (
                true,
                format!("{name}: no answer, nothing is known to have changed"),
            ),
        };
        self.notify(is_bad, text);
        self.outcome = Some(outcome);
    }
}

fn mm_s(um_s: i32) -> f32 {
    um_s as f32 / 1_000.0
}
