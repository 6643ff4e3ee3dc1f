//! The way of one direction of the link: its weather, and the faults on it.

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};

use protocol::Role;
use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::link::forger::Forger;
use crate::link::impairments::{BYTE_NS, Impairments};
use crate::scene::Scene;
use crate::scene::fault::{Fault, Kind, nanoseconds};

/// Frames kept to be replayed, in time.
const HISTORY_NS: u64 = 1_100_000_000;

/// Takes bytes in and hands on what arrives, each with its instant, in order.
#[derive(Clone, Debug)]
pub struct LinkChannel {
    weather: Impairments,
    faults: Vec<Fault>,
    draws: Xoshiro256PlusPlus,
    forger: Forger,
    /// When the sender's power goes: it numbers from 0 again, and what was on its way is gone.
    restarts_ns: VecDeque<u64>,
    /// Whether any fault makes it necessary to know what went by.
    listens: bool,
    frame: Vec<u8>,
    /// The bits of each of its bytes that a fault turns.
    turned: Vec<u8>,
    /// Whether it is held until it is whole.
    holds_frame: bool,
    /// Frames gone by, for replays.
    history: VecDeque<(u64, Vec<u8>)>,
    /// Frames to be handed on later, by instant and number.
    held: BTreeMap<(u64, u64), Vec<u8>>,
    held_count: u64,
    /// When a fault that talks by itself may say its next byte.
    talk_ns: u64,
    /// Stops said so far.
    stops: usize,
    out: VecDeque<(u64, u8)>,
    free_ns: u64,
}

impl LinkChannel {
    /// The way towards the board of role `to` in a scene.
    pub fn new(scene: &Scene, to: Role) -> Self {
        let direction = u64::from(to == Role::Sensor);
        let sender = match to {
            Role::Sensor => Role::Display,
            _ => Role::Sensor,
        };
        let mut restarts: Vec<u64> = scene
            .faults
            .iter()
            .filter(|fault| fault.cuts_power(sender))
            .map(Fault::begins_ns)
            .collect();
        restarts.sort_unstable();
        let mut faults: Vec<Fault> = scene
            .faults
            .iter()
            .filter(|fault| concerns(fault.kind, to))
            .copied()
            .collect();
        faults.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        Self {
            weather: Impairments::new(&scene.link, scene.seed, direction),
            listens: !faults.is_empty(),
            faults,
            draws: Xoshiro256PlusPlus::seed_from_u64(scene.seed ^ (0x5EED << 8 | direction)),
            forger: Forger::new(),
            restarts_ns: restarts.into(),
            frame: Vec::new(),
            turned: Vec::new(),
            holds_frame: false,
            history: VecDeque::new(),
            held: BTreeMap::new(),
            held_count: 0,
            talk_ns: 0,
            stops: 0,
            out: VecDeque::new(),
            free_ns: 0,
        }
    }

    /// Whether a fault of the scene's is on this way.
    pub fn has_faults(&self) -> bool {
        self.listens
    }

    /// A byte whose last bit has left the sender's UART at `at_ns`. Instants must not decrease.
    #[inline]
    pub fn push(&mut self, at_ns: u64, byte: u8) {
        self.weather.push(at_ns, byte);
    }

    /// The next byte that has arrived by `now_ns`, and when it did.
    #[inline]
    pub fn pop(&mut self, now_ns: u64) -> Option<(u64, u8)> {
        if !self.listens {
            return self.weather.pop(now_ns);
        }
        self.advance(now_ns);
        self.out.pop_front_if(|&mut (due_ns, _)| due_ns <= now_ns)
    }

    /// When the next byte arrives, or may do so.
    #[inline]
    pub fn next_due(&self) -> Option<u64> {
        if !self.listens {
            return self.weather.next_due();
        }
        let out_ns = self.out.front().map(|&(due_ns, _)| due_ns);
        let events = [
            out_ns,
            self.weather.next_due(),
            self.next_held(),
            self.next_talk(),
        ];
        events.into_iter().flatten().min()
    }

    /// Does all that is due by `now_ns`, in the order of time.
    fn advance(&mut self, now_ns: u64) {
        loop {
            let byte_ns = self.weather.next_due().unwrap_or(u64::MAX);
            let held_ns = self.next_held().unwrap_or(u64::MAX);
            let talk_ns = self.next_talk().unwrap_or(u64::MAX);
            let next_ns = byte_ns.min(held_ns).min(talk_ns);
            if next_ns > now_ns {
                return;
            }
            let restart = self
                .restarts_ns
                .pop_front_if(|restart_ns| *restart_ns <= next_ns);
            if restart.is_some() {
                self.forger = Forger::new();
                self.history.clear();
                self.held.clear();
                continue;
            }
            if next_ns == held_ns {
                if let Some((_, frame)) = self.held.pop_first() {
                    self.emit(held_ns, &frame);
                }
            } else if next_ns == talk_ns {
                self.talk(talk_ns);
            } else if let Some((at_ns, byte)) = self.weather.pop(byte_ns) {
                self.take(at_ns, byte);
            }
        }
    }

    fn take(&mut self, at_ns: u64, byte: u8) {
        if self.frame.is_empty() {
            // Bytes that go straight through would run into frames that come later.
            self.holds_frame = self.forger.renumbers()
                || !self.held.is_empty()
                || self.on(at_ns, changes_frames).next().is_some();
        }
        let is_cut = self.on(at_ns, cuts).next().is_some();
        let mut turned = 0;
        let shares: Vec<f64> = self
            .on(at_ns, |kind| kind == Kind::LinkCorrupt)
            .map(|fault| fault.values[0])
            .collect();
        for share in shares {
            if self.draws.random_bool(share) {
                turned ^= 1 << (self.draws.next_u32() % 8);
            }
        }
        self.frame.push(byte);
        self.turned.push(turned);
        if !is_cut && !self.holds_frame {
            self.emit(at_ns, &[byte ^ turned]);
        }
        if byte != 0 {
            return;
        }
        let frame = std::mem::take(&mut self.frame);
        let turned = std::mem::take(&mut self.turned);
        self.history.push_back((at_ns, frame.clone()));
        let is_old = |frame: &mut (u64, _)| frame.0 + HISTORY_NS < at_ns;
        while self.history.pop_front_if(is_old).is_some() {}
        let fault = self.on(at_ns, changes_frames).last().copied();
        let passed = self.forger.pass(&frame, fault.as_ref());
        if is_cut || !self.holds_frame {
            return;
        }
        let turn = |mut frame: Vec<u8>| {
            for (byte, turned) in frame.iter_mut().zip(&turned) {
                *byte ^= turned;
            }
            frame
        };
        match (fault.map(|fault| (fault.kind, fault.values[0])), passed) {
            (Some((Kind::LinkReplay, back_ms)), _) => {
                // What had been heard before the fault, again and again.
                let from_ns = fault.map_or(0, |fault| fault.begins_ns());
                let back_ns = nanoseconds(back_ms * 1e-3);
                let then_ns = (from_ns + (at_ns - from_ns) % back_ns).saturating_sub(back_ns);
                let old = self
                    .history
                    .partition_point(|&(old_ns, _)| old_ns < then_ns);
                if let Some((_, frame)) = self.history.get(old).cloned() {
                    self.emit(at_ns, &turn(frame));
                }
            }
            (Some((Kind::LinkLate, delay_ms)), Some(frame)) => {
                let due_ns = at_ns + nanoseconds(delay_ms * 1e-3);
                self.held_count += 1;
                self.held.insert((due_ns, self.held_count), turn(frame));
            }
            (_, Some(frame)) => self.emit(at_ns, &turn(frame)),
            (_, None) => {}
        }
    }

    /// Puts bytes on the wire, the first of them complete at `at_ns` or when the wire is free.
    fn emit(&mut self, at_ns: u64, bytes: &[u8]) {
        for &byte in bytes {
            self.free_ns = at_ns.max(self.free_ns + BYTE_NS);
            self.out.push_back((self.free_ns, byte));
        }
    }

    /// The faults of some kinds that are on, in the order in which they began: of several that exclude each other the last
    /// is done.
    fn on(&self, at_ns: u64, choose: fn(Kind) -> bool) -> impl Iterator<Item = &Fault> {
        self.faults
            .iter()
            .filter(move |fault| choose(fault.kind) && fault.is_on(at_ns))
    }

    fn next_held(&self) -> Option<u64> {
        self.held.first_key_value().map(|(&(due_ns, _), _)| due_ns)
    }

    /// When the next Stop is said.
    fn next_stop(&self) -> Option<u64> {
        self.faults
            .iter()
            .filter(|fault| fault.kind == Kind::StopFromPeer)
            .nth(self.stops)
            .map(|fault| fault.begins_ns().max(self.free_ns))
            // Between two frames, not within one.
            .filter(|_| self.frame.is_empty())
    }

    /// When a fault says something by itself next.
    fn next_talk(&self) -> Option<u64> {
        let talks_ns = self
            .faults
            .iter()
            .filter(|fault| talks(fault.kind))
            .map(|fault| (fault.begins_ns().max(self.talk_ns), fault))
            .filter(|&(at_ns, fault)| fault.is_on(at_ns))
            .map(|(at_ns, _)| at_ns)
            .min();
        self.next_stop().into_iter().chain(talks_ns).min()
    }

    fn talk(&mut self, at_ns: u64) {
        let talking = self.on(at_ns, talks).last().map(|fault| fault.kind);
        // A Stop comes in between, unless the wire carries nothing.
        let bytes = if self.next_stop().is_some_and(|stop_ns| stop_ns <= at_ns) {
            self.stops += 1;
            let carries_nothing = self.on(at_ns, Kind::cuts_wire).next().is_some();
            if carries_nothing {
                Vec::new()
            } else {
                // What was said before it is no part of its frame.
                [vec![0], self.forger.stop()].concat()
            }
        } else {
            match talking {
                Some(Kind::LinkGarbage) => vec![self.draws.next_u32().to_le_bytes()[0]],
                Some(Kind::LinkFlood) => self.forger.repeat(),
                _ => vec![0],
            }
        };
        self.emit(at_ns, &bytes);
        self.talk_ns = at_ns + bytes.len() as u64 * BYTE_NS;
    }

    /// Whether what arrives at an instant is a line that is held low, and no byte that was said.
    pub fn is_held_low(&self, at_ns: u64) -> bool {
        self.on(at_ns, |kind| kind == Kind::WireStuckLow)
            .next()
            .is_some()
    }
}

/// Whether a kind is on the way towards a board.
fn concerns(kind: Kind, to: Role) -> bool {
    match kind {
        Kind::LinkDown
        | Kind::LinkGarbage
        | Kind::LinkCorrupt
        | Kind::LinkReplay
        | Kind::LinkLate => true,
        Kind::LinkFlood
        | Kind::WireStuckLow
        | Kind::EstimateOutOfRange
        | Kind::EstimateNan
        | Kind::EstimateJumping
        | Kind::EstimateContradictory
        | Kind::SensorSilent
        | Kind::StopFromPeer => to == Role::Display,
        _ => false,
    }
}

/// Nothing of what is sent arrives.
fn cuts(kind: Kind) -> bool {
    kind == Kind::LinkDown || talks(kind)
}

/// Says something in place of what is sent.
fn talks(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::LinkGarbage | Kind::LinkFlood | Kind::WireStuckLow
    )
}

/// Works on whole frames.
fn changes_frames(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::LinkReplay
            | Kind::LinkLate
            | Kind::EstimateOutOfRange
            | Kind::EstimateNan
            | Kind::EstimateJumping
            | Kind::EstimateContradictory
            | Kind::SensorSilent
    )
}
