//! Whether the display drives when it is to, and only then: by the estimates that arrived and the hand's true
//! movement.

use std::collections::VecDeque;
use std::ops::Range;

use protocol::{DisplayConfiguration, Friction, Hold, Role};

use super::due::STARTS_S;
use super::outputs::SILENCE_NS;
use crate::judge::trust::Trust;
use crate::run::recording::{Arrival, OutputRecord, TickRecord, ZERO_VOLT};
use crate::scene::fault::{Class, Fault, Sign, nanoseconds};

/// From an arrival to the outputs: the tick that hears it, the next one, and its edge, at 2 kHz.
const HEARD_NS: u64 = 3_000_000;
/// From a reason to hold until the display says so: its next tick, and the message's way.
pub(super) const SAID_NS: u64 = 5_000_000;
/// In which every reason to hold but age brings the outputs to 0 V.
pub(super) const QUICKLY_NS: u64 = 8_000_000;
/// From which speed on a hand moves, in mm/s, and for how long it has to until the display must drive: it takes a
/// hand without a count for 19 ms for one at rest.
const MOVES_MM_S: f64 = 10.0;
const MOVES_NS: u64 = 40_000_000;
/// An amplitude in mV, two steps of the DAC, that shows by nothing. So long after, in ns, it may still be so faint.
const FAINT_MV: f64 = 0.3;
const FAINT_NS: u64 = 100_000_000;
/// Up to which a wave is played in full.
const PLAYED_HZ: f64 = 250.0;
/// So long before a fault tells how much was known of the surface.
const BEFORE_NS: u64 = 500_000_000;
const MS: u64 = 1_000_000;

/// Whether the display has stopped for good before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Stopped {
    #[default]
    No,
    /// What may have stopped it was too short or too small for it to have to: its outputs tell.
    IfSilent,
    Yes,
}

/// What of it was not as it should be, each with its instant in ns since the scene's start.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Misconduct {
    /// The outputs were not at 0 V though there was a reason to hold.
    pub loud: Option<(Hold, u64)>,
    /// It said that it drives though there was a reason to hold, and went on to be.
    pub says_driving: Option<(Hold, u64)>,
    /// They were at 0 V though the hand moved and nothing held it.
    pub silent_ns: Option<u64>,
    /// A reason to hold came up while it drove: the first.
    pub held: Option<(Hold, u64)>,
    /// All that came up until the next fault, also before this one and while the hand rested.
    pub reasons: Vec<(Hold, u64)>,
    /// They were driven for the first time after the fault was over.
    pub again_ns: Option<u64>,
    /// Of the time in which they have to be, for how long the hand moved, in ns; and of that, with nothing to hold them.
    pub moved_ns: u64,
    pub free_ns: u64,
    /// Estimates that were heard in half a second before the fault, and those of them that are stood by.
    pub heard_before: usize,
    pub valid_before: usize,
}

/// How strong the stimulus is to be by what the sensor has told of the surface.
#[derive(Clone, Debug, Default)]
struct Level {
    amplitude_mv: f64,
    /// What is played at full; 0 if the amplitude does not follow it.
    reference_lsb: f64,
    reference_mn: f64,
    /// As last told.
    surface_lsb: Option<f64>,
    fluctuation_mn: Option<f64>,
}

impl Level {
    /// In mV; in full as far as nothing was told.
    fn mv(&self) -> f64 {
        let part = |told: Option<f64>, reference: f64| match told {
            Some(told) if reference > 0.0 => (told / reference).min(1.0),
            _ => 1.0,
        };
        let surface = part(self.surface_lsb, self.reference_lsb);
        self.amplitude_mv * surface * part(self.fluctuation_mn, self.reference_mn)
    }
}

/// Looks on from the scene's start, and judges while the fault is the only one.
#[derive(Clone, Debug, Default)]
pub(super) struct Conduct {
    /// When it is judged, in ns.
    judged_ns: Range<u64>,
    /// When it need not drive, whatever arrives.
    excused_ns: Range<u64>,
    /// When it has to drive again.
    again_ns: Range<u64>,
    /// When it can't tell that the hand moves.
    blind_ns: Vec<Range<u64>>,
    stopped: Stopped,
    /// What tells the display of the surface is broken itself.
    spoils_estimates: bool,
    /// It was held already when the fault began.
    was_held: Option<bool>,
    level: Level,
    /// When that was last too low to show.
    faint_ns: Option<u64>,
    way_ns: u64,
    /// Estimates came that are not to be followed, when it has to drive again.
    unfollowed: bool,
    max_age_ms: u16,
    fade_out_ns: u64,
    trust: Trust,
    /// The last one to be followed; not finite before the first.
    wavelength_mm: f64,
    /// Not heard yet.
    arrived: VecDeque<Arrival>,
    hand: Option<(u64, f64)>,
    moves_since_ns: Option<u64>,
    silent_since_ns: Option<u64>,
    /// All were at 0 V for longer than a wave that passes it, while the hand moved, since the fault began.
    has_fallen_silent: bool,
    held_since: Option<(Hold, u64)>,
    /// All reasons to hold that there are, and since when.
    reasons: Vec<(Hold, u64)>,
    /// When it said while it was held that it drives.
    said_driving_ns: Option<u64>,
    free_since_ns: u64,
    seen: Misconduct,
}

impl Conduct {
    /// Judges until `until_ns`, and whether it drives `again_within_ms` of the fault's end. A display that has `stopped` for
    /// good before need not drive, nor one whose hand's encoder
    /// stands still by another fault, `blind_ns`. Messages take up to `way_ns`.
    pub fn new(
        fault: &Fault,
        again_within_ms: Option<f64>,
        until_ns: u64,
        configuration: &DisplayConfiguration,
        stopped: Stopped,
        blind_ns: Vec<Range<u64>>,
        way_ns: u64,
    ) -> Self {
        let row = fault.kind.row();
        let from_ns = fault.begins_ns();
        let over_ns = fault.ends_ns().unwrap_or(from_ns);
        let cuts_power = fault.cuts_power(Role::Display);
        let excused_ns = match row.class {
            Class::Stops => from_ns..u64::MAX,
            _ if cuts_power => from_ns..over_ns + nanoseconds(STARTS_S),
            _ if row.safe_within_ms.is_some() => from_ns..over_ns,
            _ => from_ns..from_ns,
        };
        Self {
            judged_ns: from_ns..until_ns,
            excused_ns,
            again_ns: match again_within_ms {
                Some(ms) => over_ns..over_ns + nanoseconds(ms * 1e-3) + way_ns,
                None => over_ns..over_ns,
            },
            blind_ns,
            stopped,
            spoils_estimates: fault.kind.is_of_arm() || row.signs.contains(&Sign::NoValidEstimate),
            level: Level {
                amplitude_mv: configuration.amplitude_mv.into(),
                reference_lsb: configuration.reference_lsb.into(),
                reference_mn: configuration.reference_mn.into(),
                ..Level::default()
            },
            way_ns,
            max_age_ms: configuration.max_age_ms,
            fade_out_ns: u64::from(configuration.fade_out_ms) * MS,
            trust: Trust::new(configuration.max_age_ms),
            wavelength_mm: f64::INFINITY,
            silent_since_ns: Some(0),
            ..Self::default()
        }
    }

    /// The display was reset: what it has heard is forgotten.
    pub fn restart(&mut self) {
        self.trust = Trust::new(self.max_age_ms);
        self.wavelength_mm = f64::INFINITY;
        self.arrived.clear();
        (self.level.surface_lsb, self.level.fluctuation_mn) = (None, None);
    }

    /// An estimate has arrived at the display.
    pub fn received(&mut self, arrival: &Arrival) {
        self.arrived.push_back(*arrival);
        self.hear();
    }

    /// What has come by the last tick is heard once that is over, whenever it is told.
    fn hear(&mut self) {
        let heard_ns = self.hand.map_or(0, |(at_ns, _)| at_ns);
        while let Some(arrival) = self
            .arrived
            .pop_front_if(|arrival| arrival.at_ns <= heard_ns)
        {
            let begins_ns = self.judged_ns.start;
            if (begins_ns.saturating_sub(BEFORE_NS)..begins_ns).contains(&heard_ns) {
                self.seen.heard_before += 1;
                self.seen.valid_before += usize::from(arrival.estimate.valid);
            }
            if arrival.has_asked {
                self.trust.greet();
            }
            match self.trust.hear(heard_ns, &arrival.estimate) {
                Some(mm) => {
                    self.wavelength_mm = mm;
                    self.level.surface_lsb = Some(arrival.estimate.amplitude_lsb.into());
                }
                None => self.unfollowed |= self.again_ns.contains(&arrival.at_ns),
            }
        }
    }

    /// The outputs have changed.
    pub fn output(&mut self, output: &OutputRecord) {
        if output.words.iter().all(|&word| word == ZERO_VOLT) {
            self.silent_since_ns.get_or_insert(output.at_ns);
            return;
        }
        self.silent_since_ns = None;
        if output.at_ns > self.again_ns.start {
            self.seen.again_ns.get_or_insert(output.at_ns);
        }
    }

    /// The sensor has told how the surface rubs, up to [`FAINT_NS`] before the display hears it.
    pub fn rubs(&mut self, friction: Friction) {
        self.level.fluctuation_mn = Some(friction.fluctuation_mn.into());
    }

    /// The display has said that it drives.
    pub fn says_driving(&mut self, at_ns: u64) {
        let is_held = |(_, since_ns): (Hold, u64)| at_ns > since_ns + SAID_NS;
        if self.held_since.is_some_and(is_held) && self.judged_ns.contains(&at_ns) {
            self.said_driving_ns.get_or_insert(at_ns);
        }
    }

    /// A tick of the display's.
    pub fn tick(&mut self, tick: &TickRecord) {
        let at_ns = tick.at_ns;
        self.follow_hand(tick);
        if self.level.mv() <= FAINT_MV && at_ns < self.judged_ns.end {
            self.faint_ns = Some(at_ns);
        }
        let holds: Vec<Hold> = self.trust.holds(at_ns).collect();
        self.reasons.retain(|(reason, _)| holds.contains(reason));
        for &hold in &holds {
            if !self.reasons.iter().any(|&(reason, _)| reason == hold) {
                self.reasons.push((hold, at_ns));
            }
        }
        match holds.first().copied() {
            None => {
                self.said_driving_ns = None;
                if self.held_since.take().is_some() {
                    self.free_since_ns = at_ns;
                }
            }
            Some(hold) => {
                // A reason that comes on top of age hastens it. Where one is over when another comes up, it may have
                // driven in between.
                let goes_on = |(before, _): &(Hold, u64)| {
                    *before == hold || *before != Hold::Stale && holds.contains(before)
                };
                if !self.held_since.as_ref().is_some_and(goes_on) {
                    self.held_since = self
                        .reasons
                        .iter()
                        .find(|&&(reason, _)| reason == hold)
                        .copied();
                    // What it said before a reason that has just come up was about none.
                    let is_just_up = |(_, since_ns): (Hold, u64)| since_ns == at_ns;
                    self.said_driving_ns
                        .take_if(|_| self.held_since.is_some_and(is_just_up));
                    if at_ns < self.judged_ns.end {
                        self.seen.reasons.push((hold, at_ns));
                    }
                }
            }
        }
        if self.judged_ns.contains(&at_ns) {
            self.was_held.get_or_insert(self.held_since.is_some());
            if self.stopped == Stopped::IfSilent {
                let is_silent = self
                    .silent_since_ns
                    .is_some_and(|silent_ns| at_ns > silent_ns + SILENCE_NS);
                self.stopped = if is_silent { Stopped::Yes } else { Stopped::No };
            }
            self.judge(at_ns);
        }
        self.hear();
    }

    fn follow_hand(&mut self, tick: &TickRecord) {
        let Some((before_ns, before_mm)) = self.hand.replace((tick.at_ns, tick.position_mm)) else {
            return;
        };
        let step_ns = tick.at_ns.saturating_sub(before_ns);
        let speed_mm_s = (tick.position_mm - before_mm).abs() / (step_ns as f64 * 1e-9);
        let is_blind = self.blind_ns.iter().any(|of| of.contains(&tick.at_ns));
        if !is_blind && speed_mm_s >= MOVES_MM_S && speed_mm_s <= PLAYED_HZ * self.wavelength_mm {
            self.moves_since_ns.get_or_insert(before_ns);
            if self.again_ns.contains(&tick.at_ns) {
                self.seen.moved_ns += step_ns;
                if self.held_since.is_none() {
                    self.seen.free_ns += step_ns;
                }
            }
        } else {
            self.moves_since_ns = None;
        }
    }

    fn judge(&mut self, at_ns: u64) {
        if let Some((hold, _)) = self.held_since
            && let Some(said_ns) = self
                .said_driving_ns
                .filter(|said_ns| at_ns > said_ns + HEARD_NS)
        {
            self.seen.says_driving.get_or_insert((hold, said_ns));
        }
        if let Some((hold, since_ns)) = self.held_since
            && !self.excused_ns.contains(&since_ns)
            && self.silent_since_ns.is_none()
        {
            // One that is over with the next estimate may be the judge's alone: what comes with a tick may be heard by the
            // next one.
            if since_ns >= self.judged_ns.start && at_ns > since_ns + HEARD_NS {
                self.seen.held.get_or_insert((hold, since_ns));
            }
            let fades_ns = match hold {
                Hold::Stale => self.fade_out_ns,
                _ => QUICKLY_NS,
            };
            if at_ns > since_ns + fades_ns + HEARD_NS {
                self.seen.loud.get_or_insert((hold, at_ns));
            }
        }
        // It has to have been driving once: what it waits for at first is not known here.
        let is_faint = |faint_ns| at_ns <= faint_ns + self.way_ns + FAINT_NS;
        let may_rest = self.stopped != Stopped::No
            || self.faint_ns.is_some_and(is_faint)
            || self.held_since.is_some()
            || self.excused_ns.contains(&at_ns)
            || self.seen.again_ns.is_none() && self.excused_ns.end > self.judged_ns.start;
        let Some((silent_ns, moves_ns)) = self.silent_since_ns.zip(self.moves_since_ns) else {
            return;
        };
        if at_ns > silent_ns + SILENCE_NS && silent_ns > self.judged_ns.start {
            let is_first = !std::mem::replace(&mut self.has_fallen_silent, true);
            // What drove on until then has not driven again.
            self.seen
                .again_ns
                .take_if(|_| is_first && self.again_ns.contains(&at_ns));
        }
        let free_ns = self.free_since_ns.max(self.judged_ns.start);
        if !may_rest
            && silent_ns > self.judged_ns.start
            && at_ns > silent_ns + SILENCE_NS
            && at_ns > moves_ns + MOVES_NS
            && at_ns > free_ns + self.fade_out_ns + HEARD_NS + SILENCE_NS
        {
            self.seen.silent_ns.get_or_insert(silent_ns);
        }
    }

    /// What was not as it should be.
    pub fn finish(self) -> Misconduct {
        self.seen
    }

    /// Until when the display has to drive again, if it has to, unless it [has stopped](Conduct::has_stopped).
    pub fn due_again_ns(&self) -> Option<u64> {
        (!self.again_ns.is_empty()).then_some(self.again_ns.end)
    }

    /// Whether it has stopped for good before, so that it need not drive.
    pub fn has_stopped(&self) -> bool {
        self.stopped != Stopped::No
    }

    /// Whether there was a reason to hold when the fault began.
    pub fn was_held(&self) -> bool {
        self.was_held == Some(true)
    }

    /// Whether the stimulus was too faint to show when the display had to drive again, or when the next fault began.
    pub fn is_faint_when_due(&self) -> bool {
        let due_ns = self.again_ns.end.min(self.judged_ns.end);
        let is_then = |faint_ns| faint_ns + self.way_ns + FAINT_NS >= due_ns;
        self.faint_ns.is_some_and(is_then)
    }

    /// Whether that can be seen: the hand moves for half of the time. Where nothing was known of the surface before, or
    /// less than half of the estimates were stood by, or some come by which nothing is to be followed, only the time counts
    /// in which something is.
    pub fn shows_again(&self) -> bool {
        let knew_little = 2 * self.seen.valid_before < self.seen.heard_before;
        let knows_nothing =
            self.was_held() || knew_little || self.unfollowed && !self.spoils_estimates;
        let counted_ns = if knows_nothing {
            self.seen.free_ns
        } else {
            self.seen.moved_ns
        };
        2 * counted_ns >= self.again_ns.end - self.again_ns.start
    }
}
