//! The desk at which a dashboard is watched: where events come from, and where orders go to.

use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError};

use protocol::Role;

use super::dashboard::Dashboard;
use super::happening::What;
use crate::host_clock::now_us;
use crate::link::{Event, Link};

/// How often the links' own counters are looked at, in µs.
const LINES_US: u64 = 200_000;

/// Where a monitor hears from.
pub struct Source {
    /// What the boards say, as it comes. When its senders are gone the monitor has seen all.
    pub events: Receiver<(Role, Event)>,
    /// The ways to the boards; none where a recording is watched.
    pub links: Vec<(Role, Link)>,
    /// The boards' logs, if they are read.
    pub logs: Option<Receiver<(Role, What)>>,
}

/// Keeps what comes, while it is asked to.
pub trait Keeper {
    /// Begins a recording, and says where it is.
    ///
    /// # Errors
    /// If nothing can be written there.
    fn begin(&mut self) -> io::Result<PathBuf>;

    /// Keeps an event.
    ///
    /// # Errors
    /// If it can't be written: the recording is then over.
    fn keep(&mut self, role: Role, event: &Event) -> io::Result<()>;

    /// Ends the recording.
    ///
    /// # Errors
    /// If the last of it can't be written.
    fn end(&mut self) -> io::Result<()>;
}

/// A dashboard with its source.
pub struct Desk {
    /// What is known.
    pub dashboard: Dashboard,
    source: Source,
    keeper: Option<Box<dyn Keeper>>,
    keeps: bool,
    lines_us: Option<u64>,
    is_over: bool,
}

impl Desk {
    /// Nothing has come yet.
    pub fn new(source: Source, keeper: Option<Box<dyn Keeper>>) -> Self {
        Self {
            dashboard: Dashboard::default(),
            source,
            keeper,
            keeps: false,
            lines_us: None,
            is_over: false,
        }
    }

    /// Takes all that has come, and says what is due. Whether anything has come.
    pub fn take(&mut self) -> bool {
        let mut came = false;
        loop {
            match self.source.events.try_recv() {
                Ok((role, event)) => {
                    came = true;
                    self.on(role, event);
                }
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    self.is_over = true;
                    break;
                }
            }
        }
        let now_us = now_us();
        self.dashboard.elapse(now_us);
        if let Some(logs) = &self.source.logs {
            for (role, what) in logs.try_iter() {
                came = true;
                self.dashboard.happen(role, what);
            }
        }
        let due = |at_us: u64| now_us.saturating_sub(at_us) >= LINES_US;
        if self.lines_us.is_none_or(due) {
            self.lines_us = Some(now_us);
            for (role, link) in &self.source.links {
                self.dashboard
                    .on_line(*role, link.counters(), link.clocks());
            }
        }
        self.say();
        came
    }

    /// Says what the dashboard has to say, at once.
    pub fn say(&mut self) {
        for role in [Role::Sensor, Role::Display] {
            for message in self.dashboard.take_outbox(role) {
                let link = self.source.links.iter().find(|(of, _)| *of == role);
                let Some((_, link)) = link else {
                    let words = "a recording is watched: nothing reaches a board from here";
                    self.dashboard.notify(true, words.to_owned());
                    continue;
                };
                if let Err(why) = link.post(&message) {
                    self.dashboard.on_not_sent(role, &message, why);
                }
            }
        }
    }

    /// Waits for something to come, for `limit` at most, and takes it.
    pub fn wait(&mut self, limit: std::time::Duration) {
        match self.source.events.recv_timeout(limit) {
            Ok((role, event)) => self.on(role, event),
            Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {}
            Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => self.is_over = true,
        }
    }

    /// Whether nothing more will come.
    pub const fn is_over(&self) -> bool {
        self.is_over
    }

    /// Begins a recording, and says where it is; or ends it.
    ///
    /// # Errors
    /// If it can't be written.
    pub fn toggle_keeping(&mut self) -> io::Result<Option<PathBuf>> {
        let Some(keeper) = &mut self.keeper else {
            return Err(io::Error::other("nothing can be recorded here"));
        };
        if self.keeps {
            self.keeps = false;
            return keeper.end().map(|()| None);
        }
        let path = keeper.begin()?;
        self.keeps = true;
        Ok(Some(path))
    }

    /// Whether a recording is being made.
    pub const fn keeps(&self) -> bool {
        self.keeps
    }

    /// Ends what is under way.
    ///
    /// # Errors
    /// If the last of a recording can't be written.
    pub fn close(mut self) -> io::Result<()> {
        match &mut self.keeper {
            Some(keeper) if self.keeps => keeper.end(),
            _ => Ok(()),
        }
    }

    fn on(&mut self, role: Role, event: Event) {
        if let Some(keeper) = self.keeper.as_mut().filter(|_| self.keeps)
            && let Err(error) = keeper.keep(role, &event)
        {
            self.keeps = false;
            self.dashboard
                .notify(true, format!("RECORDING ENDED: {error}"));
        }
        self.dashboard.on(now_us(), role, event);
    }
}
