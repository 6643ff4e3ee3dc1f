//! Looks on at a run, for one of its faults.

use std::ops::Range;

use protocol::{DisplayState, Hold, Message, Role, Trip};

use super::conduct::{Conduct, QUICKLY_NS, SAID_NS, Stopped};
use super::due::{
    LINGERS_NS, again_ns, arm_goes_on, away_since_ns, board_of, goes_far, hidden, is_plain,
    is_slow, is_unheard, may_still_greet, must_show, rests, weather_signs,
};
use super::finding::Finding;
use super::outputs::Outputs;
use super::signs::Voice;
use super::step::Step;
use crate::judge::truth::Truth;
use crate::run::decoder::TimedMessage;
use crate::run::observer::{RunEvent, RunObserver};
use crate::scene::fault::{Class, Fault, Kind, Lasts, Shows, Sign, nanoseconds};
use crate::scene::{Follows, Scene};

/// How far the stimulus may be from its due phase, in cycles rms, while something is broken that must not reach it.
const IN_STEP_CYCLES: f64 = 0.05;
/// So long does a board that goes on never say nothing, in ns: one and a half estimates' time, ten motions'.
const ESTIMATES_NS: u64 = 15_000_000;
const MOTIONS_NS: u64 = 20_000_000;
/// A stop is told of so long after it has to show, in ms: the words may wait for others.
const NAMED_MS: f64 = 50.0;

/// Looks on a run from its start, for one fault.
#[derive(Clone, Debug)]
pub(super) struct FaultMonitor {
    fault: Fault,
    /// Until its window ends, or the display's power goes.
    due_ns: Range<u64>,
    /// Until the next fault begins.
    alone_ns: Range<u64>,
    /// What other faults may show meanwhile.
    of_others: Vec<Sign>,
    /// What the scene's own link shows, with and without the fault: no sign of it.
    weather: Vec<Sign>,
    /// See [`is_unheard`] and [`away_since_ns`].
    is_unheard: bool,
    away_since_ns: Option<u64>,
    /// When the board that it breaks last said that it runs, before the fault.
    ran_ns: Option<u64>,
    stopped: Stopped,
    /// Resets of the display that other faults still may bring, and since when those count.
    resets_of_others: usize,
    others_from_ns: u64,
    /// Who may be silent meanwhile.
    silenced: Vec<Role>,
    must_show: bool,
    /// When nobody looks on any more.
    until_ns: u64,
    fade_out_ns: u64,
    /// Whether the display had a tick before the fault.
    has_looked: bool,
    /// Whether the hand is too slow for it to show in time.
    is_slow: bool,
    /// See [`rests`] and [`hidden`].
    rests: bool,
    hidden: Option<&'static str>,
    outputs: Outputs,
    conduct: Conduct,
    /// If it is to keep in step.
    step: Option<Step>,
    resets: usize,
    display: Voice,
    sensor: Voice,
    /// The first of each, with its instant in ns and in words.
    seen: Vec<(Sign, u64, String)>,
    estimates: Beat,
    /// When the sensor first stood by an estimate though its converter or gauges tell it nothing.
    stood_by_ns: Option<u64>,
    motions: Beat,
}

/// What a board says again and again.
#[derive(Clone, Debug)]
struct Beat {
    most_ns: u64,
    last_ns: Option<u64>,
    /// When nothing had come for too long.
    missed_ns: Option<u64>,
}

impl Beat {
    fn new(most_ns: u64) -> Self {
        Self {
            most_ns,
            last_ns: None,
            missed_ns: None,
        }
    }

    fn heard(&mut self, at_ns: u64, alone_ns: &Range<u64>) {
        let last_ns = self.last_ns.replace(at_ns);
        if let Some(last_ns) = last_ns.filter(|&last_ns| at_ns > last_ns + self.most_ns) {
            // What has been missing since before is missed anew.
            let missed_ns = match last_ns + self.most_ns {
                before_ns if before_ns < alone_ns.start => alone_ns.start + self.most_ns,
                missed_ns => missed_ns,
            };
            if at_ns > missed_ns && alone_ns.contains(&missed_ns) {
                self.missed_ns.get_or_insert(missed_ns);
            }
        }
    }

    /// When it went missing, if it was there at all before `alone_ns` ended.
    fn finish(mut self, alone_ns: &Range<u64>) -> Option<u64> {
        if self.last_ns.is_some_and(|last_ns| last_ns < alone_ns.end) {
            self.heard(alone_ns.end, alone_ns);
        }
        self.missed_ns
    }
}

impl FaultMonitor {
    /// Before a run of `scene`, for one of its faults until `until_ns`.
    pub fn new(scene: &Scene, number: usize, until_ns: u64) -> Self {
        let fault = scene.faults[number];
        let row = fault.kind.row();
        let from_ns = fault.begins_ns();
        let others = || {
            let others = scene.faults.iter().enumerate();
            others
                .filter(move |&(place, _)| place != number)
                .map(|(_, other)| other)
        };
        let next_ns = |is_next: fn(&Fault) -> bool| {
            let later = others().filter(|other| is_next(other) && other.begins_ns() > from_ns);
            later.map(Fault::begins_ns).min().unwrap_or(u64::MAX)
        };
        let due_ns = from_ns..until_ns.min(next_ns(|other| other.cuts_power(Role::Display)));
        let alone_ns = from_ns..until_ns.min(next_ns(|_| true));
        let last_power_ns = others()
            .filter(|other| other.cuts_power(Role::Display) && other.begins_ns() <= from_ns)
            .map(Fault::begins_ns)
            .max();
        let over_ns = fault.ends_ns().unwrap_or(from_ns);
        // With the display's power ends what has stopped it, unless that is still there.
        let ends_with_it = |other: &Fault| {
            fault.cuts_power(Role::Display)
                && (other.kind.row().lasts == Lasts::Once || !other.is_on(over_ns))
        };
        let stops = |other: &&Fault| {
            other.kind.row().class == Class::Stops
                && !is_unheard(other, scene)
                && other.begins_ns() <= from_ns
                && last_power_ns.is_none_or(|power_ns| other.begins_ns() > power_ns)
                && !ends_with_it(other)
        };
        let is_sure =
            |other: &Fault| must_show(other, scene) && away_since_ns(other, scene).is_none();
        let stopped = match others().filter(stops).max_by_key(|other| is_sure(other)) {
            None => Stopped::No,
            Some(other) if is_sure(other) => Stopped::Yes,
            Some(_) => Stopped::IfSilent,
        };
        let lingers = |other: &&Fault| {
            let over_ns = other.ends_ns().unwrap_or(other.begins_ns());
            // What was held up comes as much later.
            let late_ms = match other.kind {
                Kind::LinkLate => other.values[0],
                _ => 0.0,
            };
            over_ns + nanoseconds(late_ms * 1e-3) + LINGERS_NS > from_ns
                && other.begins_ns() < alone_ns.end
        };
        let lingering = || others().filter(|other| lingers(other));
        let resets_of_others = lingering().map(|other| other.kind.row().resets).sum();
        let others_from_ns = lingering().map(Fault::begins_ns).min().unwrap_or(from_ns);
        let silenced = lingering().flat_map(|other| other.kind.row().silences);
        let silenced = silenced.chain(row.silences).copied().collect();
        let mut of_others: Vec<Sign> = others()
            .filter(|other| {
                // The sensor says it again whenever it starts.
                let says_again = other.kind.is_of_arm() && other.begins_ns() <= from_ns;
                stops(other) || lingers(other) || says_again
            })
            .flat_map(|other| [other.kind.row().signs, other.kind.row().also])
            .flatten()
            .copied()
            .collect();
        if fault.kind == Kind::HandEncoderDead && scene.arm.follows == Follows::Link {
            // The arm stands still too, and nothing is sensed.
            of_others.push(Sign::Fading(Hold::Stale));
        }
        let weather = weather_signs(&scene.link);
        of_others.extend(&weather);
        let begun = || {
            let faults = scene.faults.iter();
            faults.filter(|other| other.begins_ns() < alone_ns.end)
        };
        // The arm goes on with the hand. It is told to come back, and where the hand turns it stands.
        if begun().any(|other| arm_goes_on(other, scene)) {
            of_others.push(Sign::ArmStopped(Trip::ArmStall));
        }
        // The tick after a stop of the ticks sees all that the hand went meanwhile.
        if begun().any(|other| goes_far(other, scene)) {
            of_others.extend([
                Sign::Stopped(Trip::HandEncoder),
                Sign::Counted(Role::Display, "encoder_jumps"),
            ]);
        }
        // Of a frame that comes late, a flood, a Stop, or a board before it started again may have had the number.
        let numbers_anew = |other: &Fault| {
            matches!(other.kind, Kind::LinkFlood | Kind::StopFromPeer)
                || !other.kind.row().silences.is_empty()
        };
        if scene.link.reorder > 0.0 && begun().any(numbers_anew) {
            // And a greeting may be overtaken by what it heralds, so that another is asked for.
            for role in [Role::Sensor, Role::Display] {
                of_others.extend([Sign::Counted(role, "duplicated"), Sign::Greets(role)]);
            }
        }
        if may_still_greet(&scene.link, fault.at_s) {
            of_others.extend([Role::Sensor, Role::Display].map(Sign::Greets));
        }
        // Where an estimator may take one thing for another, the display sees it jump.
        if !is_plain(scene) {
            of_others.push(Sign::Counted(Role::Display, "implausible"));
        }
        let configuration = scene.display_configuration();
        let blind_ns = others().filter(|other| other.kind == Kind::HandEncoderDead);
        let blind_ns = blind_ns.map(|other| other.begins_ns()..other.ends_ns().unwrap_or(u64::MAX));
        let tires = f64::from(configuration.full_drive_s) < scene.duration_s;
        if tires {
            of_others.push(Sign::Fading(Hold::FullDrive));
        }
        let again_within_ms = again_ns(&fault, scene).map(|own_ns| {
            // Not before it is to drive again after what was there just before.
            let before = lingering().filter(|other| other.begins_ns() <= from_ns);
            let due_ns = before.filter_map(|other| again_ns(other, scene)).max();
            (own_ns.max(due_ns.unwrap_or(0)) - over_ns) as f64 * 1e-6
        });
        // Since when the hand's counts are those of its place.
        let shifts = others().filter(|other| {
            matches!(other.kind, Kind::HandEncoderDead | Kind::HandEncoderJump)
                && other.begins_ns() <= from_ns
        });
        let shifted_ns = shifts.map(|other| match other.kind.row().lasts {
            Lasts::Once => other.begins_ns(),
            Lasts::For(_) | Lasts::ForGood => other.ends_ns().unwrap_or(u64::MAX),
        });
        let shifted_ns = shifted_ns.max().unwrap_or(0);
        // Of a flood, which estimates find room is chance.
        let keeps_step = row.class != Class::Stops
            && row.safe_within_ms.is_none()
            && fault.kind != Kind::LinkFlood
            && stopped != Stopped::Yes
            && shifted_ns <= from_ns;
        let truth = Truth {
            display: configuration,
            actuators: *scene.display.actuators,
            ..Truth::new("", "", &|_| 1.0)
        };
        Self {
            fault,
            outputs: Outputs::new(&fault, due_ns.end, &configuration, &scene.display.actuators),
            // When it has been driven for too long is not followed here.
            conduct: Conduct::new(
                &fault,
                again_within_ms,
                alone_ns.end,
                &configuration,
                if tires { Stopped::Yes } else { stopped },
                blind_ns.collect(),
                nanoseconds((scene.link.delay_ms + scene.link.jitter_ms) * 1e-3),
            ),
            step: keeps_step.then(|| Step::new(&truth, alone_ns.clone(), shifted_ns)),
            due_ns,
            alone_ns,
            of_others,
            weather,
            is_unheard: is_unheard(&fault, scene),
            away_since_ns: away_since_ns(&fault, scene),
            ran_ns: None,
            stopped,
            resets_of_others,
            others_from_ns,
            silenced,
            must_show: must_show(&fault, scene),
            until_ns,
            fade_out_ns: 1_000_000 * u64::from(configuration.fade_out_ms),
            has_looked: false,
            is_slow: is_slow(&fault, scene),
            rests: fault.kind.is_of_arm() && rests(&fault, scene),
            hidden: hidden(&fault, scene),
            resets: 0,
            display: Voice::new(Role::Display),
            sensor: Voice::new(Role::Sensor),
            seen: Vec::new(),
            estimates: Beat::new(ESTIMATES_NS),
            stood_by_ns: None,
            motions: Beat::new(MOTIONS_NS),
        }
    }

    /// Why it need not show in that time.
    fn unseen(&self) -> Option<&'static str> {
        let kind = self.fault.kind;
        let may_have_stopped = self.stopped != Stopped::No && !self.outputs.was_driving;
        if kind.row().class == Class::Stops && may_have_stopped {
            return Some("the display has stopped before");
        }
        let back_ns = || nanoseconds(self.fault.values[0] * 1e-3);
        if kind == Kind::LinkReplay && self.due_ns.start < back_ns() {
            return Some("there is nothing so old to replay");
        }
        let within_ms = self.fault.seen_within_ms().unwrap_or(0.0);
        if self.left_ns() < nanoseconds(within_ms * 1e-3) {
            return Some(self.ends());
        }
        if kind.row().class != Class::Stops {
            if self.alone_ns.end - self.alone_ns.start < nanoseconds(within_ms * 1e-3) {
                return Some("the next fault begins before");
            }
            // Of what is on its way to 0 V already, no other reason is told.
            let fades = |sign: &Sign| matches!(sign, Sign::Fading(_));
            if self.conduct.was_held() && kind.row().signs.iter().all(fades) {
                return Some("the display is held already");
            }
        }
        if self.is_slow {
            return Some("the hand moves too slowly");
        }
        if self.rests {
            return Some("the arm may be at rest, or is told too little");
        }
        if self.hidden.is_some() {
            return self.hidden;
        }
        let hides = |sign: &Sign| self.weather.contains(sign);
        // Of these two, what else shows is chance.
        let hidden = match kind {
            Kind::LinkCorrupt | Kind::LinkGarbage => kind.row().signs.iter().any(hides),
            _ => kind.row().signs.iter().all(hides),
        };
        hidden.then_some("the scene's link shows the same without it")
    }

    /// From its beginning until nobody looks on any more, in ns.
    fn left_ns(&self) -> u64 {
        self.due_ns.end.saturating_sub(self.due_ns.start)
    }

    /// What ends that.
    fn ends(&self) -> &'static str {
        if self.due_ns.end < self.until_ns {
            "the power goes before"
        } else {
            "the scene ends before"
        }
    }

    /// What became of it.
    pub fn finish(self) -> Finding {
        let (unseen, ends, left_ns) = (self.unseen(), self.ends(), self.left_ns());
        let Self {
            fault,
            alone_ns,
            of_others,
            weather,
            is_unheard,
            away_since_ns,
            ran_ns,
            stopped,
            resets_of_others,
            silenced,
            must_show,
            has_looked,
            until_ns,
            fade_out_ns,
            seen,
            ..
        } = self;
        let row = fault.kind.row();
        let from_ns = alone_ns.start;
        let ms = |at_ns: u64| at_ns.saturating_sub(from_ns) as f64 * 1e-6;
        let first = seen
            .iter()
            .filter(|(sign, ..)| row.signs.contains(sign) && !weather.contains(sign))
            .min_by_key(|&(_, at_ns, words)| (at_ns, words));
        let outputs = self.outputs.finish();
        let has_stopped = match stopped {
            Stopped::No => false,
            Stopped::IfSilent => !outputs.was_driving,
            Stopped::Yes => true,
        };
        let mut unjudged = Vec::new();
        // A frame that was on its way is no sign of life.
        let is_away = away_since_ns
            .is_some_and(|since_ns| ran_ns.is_none_or(|ran_ns| ran_ns < since_ns + SAID_NS));
        if is_away && must_show && first.is_none() {
            unjudged.push("whether it shows: its board does not run then".to_owned());
        }
        // At rest there is nothing that a gauge or an encoder could be missed by.
        // Nor where no words go out anything that they could be missed by.
        let is_mute = row.shows == Shows::WhileDriving && !outputs.was_driving;
        if is_mute && must_show && !has_stopped && first.is_none() {
            unjudged.push("whether it shows: the display does not drive".to_owned());
        }
        let must_show = must_show
            && !is_unheard
            && !is_away
            && !is_mute
            && (row.class == Class::Stops || outputs.was_driving)
            // A count from which nobody has counted yet is no jump.
            && (fault.kind != Kind::HandEncoderJump || has_looked);
        let due_again_ns = self.conduct.due_again_ns();
        let need_not_drive = self.conduct.has_stopped();
        let is_faint = self.conduct.is_faint_when_due();
        let shows_again = self.conduct.shows_again();
        let conduct = self.conduct.finish();
        let leaves_ms = |ms: f64| left_ns >= nanoseconds(ms * 1e-3);
        let mut otherwise = Vec::new();
        if is_unheard {
            unjudged.push("whether the display obeys: nothing arrives there then".to_owned());
        }
        let seen_within_ms = fault.seen_within_ms();
        if let Some(within_ms) = seen_within_ms
            && let Some(why) = unseen
            && must_show
            && first.is_none_or(|&(_, at_ns, _)| ms(at_ns) > within_ms)
        {
            unjudged.push(format!("whether it shows within {within_ms} ms: {why}"));
        }
        if let Some(within_ms) = row.safe_within_ms
            && must_show
            && outputs.safe_ns.is_none()
            && !leaves_ms(within_ms)
        {
            unjudged.push(format!(
                "whether all outputs are at 0 V within {within_ms} ms: {ends}"
            ));
        }
        let named = |(sign, ..): &&(Sign, u64, String)| matches!(sign, Sign::Stopped(trip) if row.trips.contains(trip));
        if row.class == Class::Stops && must_show && !has_stopped {
            // A board that is silenced, or has to start again first, says it when it can.
            let is_prompt = row.resets == 0 && !row.silences.contains(&Role::Display);
            let within_ms = seen_within_ms.into_iter().chain(row.safe_within_ms);
            let due_ms = match within_ms.reduce(f64::max) {
                Some(within_ms) if is_prompt => within_ms + NAMED_MS,
                _ => row.watch_s * 1e3,
            };
            match seen
                .iter()
                .filter(named)
                .map(|&(_, at_ns, _)| ms(at_ns))
                .reduce(f64::min)
            {
                None if !leaves_ms(due_ms) => {
                    unjudged.push(format!("whether it says that it has stopped: {ends}"));
                }
                None => {
                    otherwise.push(format!("does not say that it has stopped: {:?}", row.trips))
                }
                Some(named_ms) if is_prompt && named_ms > due_ms => {
                    otherwise.push(format!(
                        "says that it has stopped after {named_ms:.2} ms of {due_ms}"
                    ));
                }
                Some(_) => {}
            }
        }
        // A reason to hold that arrived has to be said.
        let is_due = |hold: Hold, at_ns: u64| {
            let said = conduct.reasons.iter().any(|&(due, due_ns)| {
                // What was on its way to 0 V before says so again with its counters.
                let fades_ns = match hold {
                    Hold::Stale => fade_out_ns,
                    _ => QUICKLY_NS,
                };
                let again_ns = if due_ns < from_ns { fades_ns } else { 0 };
                due == hold && (due_ns..=due_ns + again_ns + SAID_NS).contains(&at_ns)
            });
            said || row.signs.contains(&Sign::Fading(hold))
                || row.also.contains(&Sign::Fading(hold))
        };
        if let Some((hold, due_ns)) = conduct.held
            && row.class != Class::Stops
            && !has_stopped
            && due_ns + SAID_NS < alone_ns.end
            && !seen
                .iter()
                .any(|&(sign, at_ns, _)| sign == Sign::Fading(hold) && at_ns <= due_ns + SAID_NS)
        {
            otherwise.push(format!(
                "does not say that it holds, {hold:?}, at {:.2} ms",
                ms(due_ns)
            ));
        }
        // What is due is counted as well, at the next second, and so is what was due before.
        let says_due = |(sign, at_ns, _): &(Sign, u64, String)| matches!(sign, Sign::Fading(hold) if is_due(*hold, *at_ns));
        let fades_are_due = seen.iter().any(says_due);
        let faded_before = |counted_ns: u64| {
            let before =
                |&(_, due_ns): &(Hold, u64)| due_ns < from_ns && counted_ns < due_ns + LINGERS_NS;
            conduct.reasons.iter().any(before)
        };
        for (sign, at_ns, words) in &seen {
            let may = row.signs.contains(sign)
                || row.also.contains(sign)
                || of_others.contains(sign)
                || matches!(sign, Sign::Fading(hold) if is_due(*hold, *at_ns))
                || matches!(sign, Sign::Counted(_, "fades"))
                    && (fades_are_due || faded_before(*at_ns));
            if alone_ns.contains(at_ns) && !may {
                otherwise.push(format!(
                    "not to be expected: {words}, at {:.2} ms",
                    ms(*at_ns)
                ));
            }
        }
        if let Some((hold, at_ns)) = conduct.says_driving {
            otherwise.push(format!(
                "says that it drives at {:.2} ms, {hold:?}",
                ms(at_ns)
            ));
        }
        if let Some((hold, at_ns)) = conduct.loud {
            otherwise.push(format!("drives at {:.2} ms, {hold:?}", ms(at_ns)));
        }
        if let Some(at_ns) = conduct.silent_ns {
            otherwise.push(format!(
                "silent from {:.2} ms on, without a reason",
                ms(at_ns)
            ));
        }
        let over_ns = fault.ends_ns().unwrap_or(from_ns);
        if let Some(due_ns) = due_again_ns
            && conduct.again_ns.is_none_or(|again_ns| again_ns > due_ns)
        {
            let within_ms = (due_ns - over_ns) as f64 * 1e-6;
            let within = format!("again within {within_ms:.0} ms of its end");
            if need_not_drive {
                let why = match stopped {
                    Stopped::No => "it may have been driven for too long",
                    _ if fault.cuts_power(Role::Display) => "what has stopped it is still there",
                    _ => "the display has stopped before",
                };
                unjudged.push(format!("whether it drives {within}: {why}"));
            } else if is_faint {
                unjudged.push(format!(
                    "whether it drives {within}: the stimulus is too faint to show"
                ));
            } else if !outputs.drove {
                unjudged.push(format!("whether it drives {within}: it never drove before"));
            } else if due_ns > alone_ns.end {
                let ends = match alone_ns.end < until_ns {
                    true => "the next fault begins before",
                    false => ends,
                };
                unjudged.push(format!("whether it drives {within}: {ends}"));
            } else if shows_again {
                otherwise.push(format!("does not drive {within}"));
            } else {
                unjudged.push(format!(
                    "whether it drives {within}: the hand rests, or nothing comes that is to be followed"
                ));
            }
        }
        for (role, beat, what) in [
            (Role::Sensor, self.estimates, "estimates"),
            (Role::Display, self.motions, "motions"),
        ] {
            if let Some(at_ns) = beat.finish(&alone_ns)
                && !silenced.contains(&role)
            {
                otherwise.push(format!("no {what} from {:.2} ms on", ms(at_ns)));
            }
        }
        if let Some(at_ns) = self.stood_by_ns
            && unseen.is_none()
        {
            otherwise.push(format!("stands by an estimate at {:.2} ms", ms(at_ns)));
        }
        if let Some(off) = self.step.and_then(Step::finish)
            && off > IN_STEP_CYCLES
        {
            otherwise.push(format!("out of step by {off:.3} cycles rms"));
        }
        if let Some(at_ns) = outputs.beyond_ns {
            otherwise.push(format!(
                "beyond the limits of voltage and slew at {:.2} ms",
                ms(at_ns)
            ));
        }
        Finding {
            fault,
            was_driving: outputs.was_driving,
            detected_ns: first.map(|&(_, at_ns, _)| at_ns - from_ns),
            sign: first.map(|(.., words)| words.clone()).unwrap_or_default(),
            safe_ns: outputs.safe_ns.map(|at_ns| at_ns - from_ns),
            stuck: outputs.stuck(),
            standing: outputs.standing(),
            drives_again: outputs.drives_again,
            again_ns: conduct.again_ns.map(|again_ns| again_ns - over_ns),
            resets: self.resets,
            resets_of_others,
            unjudged,
            must_show,
            has_stopped: seen.iter().any(|sign| named(&sign)),
            is_unheard,
            unseen,
            left_ns,
            otherwise,
        }
    }

    fn said(&mut self, role: Role, said: &TimedMessage) {
        let goes_on = matches!(said.message, Message::Estimate(_) | Message::Motion(_));
        if goes_on && role == board_of(&self.fault) && said.at_ns < self.due_ns.start {
            self.ran_ns = Some(said.at_ns);
        }
        match said.message {
            Message::Estimate(estimate) if role == Role::Sensor => {
                self.estimates.heard(said.at_ns, &self.alone_ns);
                let is_against_it = |after_ms: f64| {
                    said.at_ns >= self.alone_ns.start + nanoseconds(after_ms * 1e-3)
                        && self.alone_ns.contains(&said.at_ns)
                        && self.fault.is_on(said.at_ns)
                };
                if estimate.valid
                    && self
                        .fault
                        .kind
                        .row()
                        .nothing_valid_after_ms
                        .is_some_and(is_against_it)
                {
                    self.stood_by_ns.get_or_insert(said.at_ns);
                }
            }
            Message::Texture(texture) if role == Role::Sensor => {
                if let Some(friction) = texture.friction {
                    self.conduct.rubs(friction);
                }
            }
            Message::Motion(_) if role == Role::Display => {
                self.motions.heard(said.at_ns, &self.alone_ns);
            }
            Message::Safety(safety)
                if role == Role::Display && safety.state == DisplayState::Driving =>
            {
                self.conduct.says_driving(said.at_ns);
            }
            _ => {}
        }
        let voice = match role {
            Role::Display => &mut self.display,
            Role::Sensor => &mut self.sensor,
            Role::Host => return,
        };
        if said.at_ns < self.due_ns.start {
            voice.note(said);
        } else if self.due_ns.contains(&said.at_ns) {
            for (sign, words) in voice.signs(&self.fault, &said.message) {
                self.note(said.at_ns, sign, format!("{}: {words}", role.name()));
            }
        }
    }

    fn note(&mut self, at_ns: u64, sign: Sign, words: String) {
        match self.seen.iter_mut().find(|(seen, ..)| *seen == sign) {
            Some(seen) if seen.1 <= at_ns => {}
            Some(seen) => *seen = (sign, at_ns, words),
            None => self.seen.push((sign, at_ns, words)),
        }
    }
}

impl RunObserver for FaultMonitor {
    fn see(&mut self, event: RunEvent<'_>) {
        self.step.see(event);
        if let RunEvent::Reset(reset) = event
            && reset.role == Role::Display
        {
            self.conduct.restart();
        }
        match event {
            RunEvent::Tick(tick) => {
                self.has_looked |= tick.at_ns < self.due_ns.start;
                self.conduct.tick(tick);
            }
            RunEvent::Output(output) => {
                self.outputs.add(output);
                self.conduct.output(output);
            }
            RunEvent::Received(arrival) => self.conduct.received(arrival),
            RunEvent::Said(role, said) => self.said(role, said),
            RunEvent::Reset(reset)
                if reset.role == Role::Display
                    && (self.others_from_ns..self.due_ns.start).contains(&reset.at_ns) =>
            {
                self.resets_of_others = self.resets_of_others.saturating_sub(1);
            }
            RunEvent::Reset(reset) if self.due_ns.contains(&reset.at_ns) => {
                let is_its_own = self.alone_ns.contains(&reset.at_ns);
                self.resets += usize::from(reset.role == Role::Display && is_its_own);
                if !reset.is_injected {
                    let words = format!("{} reset", reset.role.name());
                    self.note(reset.at_ns, Sign::Reset(reset.role), words);
                }
            }
            RunEvent::Cleared(at_ns) if self.due_ns.contains(&at_ns) => {
                self.note(at_ns, Sign::ClearFell, "CLR fell".to_owned());
            }
            _ => {}
        }
    }
}
