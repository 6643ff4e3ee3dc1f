//! The thread of a bridge that does what is due from time to time.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use protocol::Ping;

use super::Shared;
use crate::clock::is_due;
use crate::lock::locked;
use crate::relay::endpoint::Endpoint;
use crate::relay::envelope::Content;
use crate::relay::hand::Due;
use crate::relay::name::Channel;
use crate::relay::refused;
use crate::relay::report::Notice;

/// How often the keeper looks round, in µs; also the time between two pings while they are answered.
const LOOK_US: u64 = 25_000;
/// Between two pings while they are not, in µs: how soon a stream goes on when the network is back.
const KNOCK_US: u64 = 100_000;
/// Between two repetitions of a Stop that the other site has not answered or the board has not been told, in µs.
const STOP_US: u64 = 100_000;
/// Between two times that the other site is told that its board is watched, in µs.
const WATCH_US: u64 = 500_000;
/// Between two tries to show the other site's board to programs here, in µs.
const SHOW_AGAIN_US: u64 = 500_000;
/// How long nobody is heard before it is found out why, in µs.
const UNHEARD_US: u64 = 3_000_000;
/// Between two such looks, in µs.
const LOOK_AGAIN_US: u64 = 10_000_000;

/// The thread that does what is due from time to time.
pub struct Keeper {
    shared: Arc<Shared>,
    pinged_us: Option<u64>,
    stopped_us: Option<u64>,
    watched_us: Option<u64>,
    /// When the other site was last heard, or the bridge started.
    heard_us: u64,
    looked_us: Option<u64>,
    /// What was found last, so that it is said once.
    found: Arc<Mutex<Vec<Notice>>>,
}

impl Keeper {
    pub fn new(shared: Arc<Shared>) -> Self {
        Self {
            heard_us: shared.started_us,
            shared,
            pinged_us: None,
            stopped_us: None,
            watched_us: None,
            looked_us: None,
            found: Arc::default(),
        }
    }

    pub fn run(mut self) {
        let woken = Arc::clone(&self.shared.keeper_woken);
        loop {
            woken.wait_until(self.shared.now_us().saturating_add(LOOK_US));
            if self.shared.is_ended.load(Ordering::Acquire) {
                return;
            }
            let at_us = self.shared.now_us();
            self.ping(at_us);
            self.repeat_stops(at_us);
            self.tell_unstopped(at_us);
            self.hand_over(at_us);
            self.watch(at_us);
            self.look(at_us);
            self.tell_refused();
        }
    }

    fn ping(&mut self, at_us: u64) {
        let mut inward = locked(&self.shared.inward);
        inward.elapse(at_us, |notice| self.shared.tell(notice));
        if inward.remote().state().word() != "known" {
            locked(&self.shared.hand).on_silence();
        }
        drop(inward);
        if locked(&self.shared.rival).elapse(at_us) {
            self.shared
                .tell(Notice::RivalGone(self.shared.settings.role));
        }
        let is_answered = locked(&self.shared.outward).flow.is_answered(at_us);
        if is_answered || is_due(self.pinged_us, KNOCK_US, at_us) {
            self.pinged_us = Some(at_us);
            let ping = Ping {
                sent_us: self.shared.now_us(),
            };
            self.shared.say(Channel::Clock, Content::Ping(ping));
        }
    }

    fn repeat_stops(&mut self, at_us: u64) {
        if !is_due(self.stopped_us, STOP_US, at_us) {
            return;
        }
        let stops = locked(&self.shared.stops);
        let (unheard, untold) = (stops.unheard(), stops.untold());
        drop(stops);
        if !unheard.is_empty() || !untold.is_empty() {
            self.stopped_us = Some(at_us);
        }
        for (id, stop) in untold {
            self.shared.tell_board(id, stop);
        }
        for (id, stop) in unheard {
            self.shared.say(Channel::Stop, Content::Stop { id, stop });
        }
    }

    fn tell_unstopped(&self, at_us: u64) {
        let overdue = locked(&self.shared.stops).overdue(at_us);
        for notice in self.shared.not_stopped(overdue) {
            self.shared.tell(notice);
        }
    }

    fn hand_over(&self, at_us: u64) {
        let due = locked(&self.shared.hand).due(at_us);
        match due {
            Due::Nothing => {}
            Due::Say => {
                self.shared.say(Channel::Stop, Content::HandOver);
            }
            Due::Tell(notice) => self.shared.tell(notice),
        }
    }

    fn tell_refused(&self) {
        for refused in refused::take() {
            self.shared.tell(Notice::Refused(refused));
        }
    }

    /// Keeps the other site's board in view, if somebody here watches it.
    fn watch(&mut self, at_us: u64) {
        let Some(far_board) = self.shared.far_board.get() else {
            if self.shared.settings.shows_far_board && is_due(self.watched_us, SHOW_AGAIN_US, at_us)
            {
                self.watched_us = Some(at_us);
                self.shared.show_far_board();
            }
            return;
        };
        far_board.elapse();
        if far_board.is_watched() && is_due(self.watched_us, WATCH_US, at_us) {
            self.watched_us = Some(at_us);
            self.shared.say(Channel::Clock, Content::Watch);
        }
    }

    /// Finds out why nobody is heard, in a thread of its own: it takes a while.
    fn look(&mut self, at_us: u64) {
        if matches!(
            locked(&self.shared.inward).remote().state().word(),
            "known" | "foreign"
        ) {
            self.heard_us = at_us;
            locked(&self.found).clear();
        }
        let is_unheard = at_us.saturating_sub(self.heard_us) > UNHEARD_US;
        if !is_unheard || !is_due(self.looked_us, LOOK_AGAIN_US, at_us) {
            return;
        }
        self.looked_us = Some(at_us);
        let (shared, found) = (Arc::clone(&self.shared), Arc::clone(&self.found));
        let clock = Arc::clone(&shared.settings.system.clock);
        clock.spawn(Box::new(move || {
            let notices = shared.diagnose();
            let mut found = locked(&found);
            for notice in &notices {
                if !found.contains(notice) {
                    shared.tell(notice.clone());
                }
            }
            *found = notices;
        }));
    }
}

impl Shared {
    /// Why the other site is not heard.
    fn diagnose(&self) -> Vec<Notice> {
        let endpoints = self.settings.network.endpoints();
        if endpoints.is_empty() {
            return vec![Notice::Unvisited(self.other_role)];
        }
        if self.wire.get().is_some_and(|wire| wire.neighbours() > 0) {
            return vec![Notice::Alone(self.other_role)];
        }
        let reach = |endpoint: &Endpoint| {
            Notice::Unreached(endpoint.clone(), self.settings.network.reach(endpoint))
        };
        endpoints.iter().map(reach).collect()
    }
}
