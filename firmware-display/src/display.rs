//! The display: estimates and encoder readings in, fifty DAC words out, and the supervisor over them.

use protocol::{
    DisplayConfiguration, DisplayCounters, DisplayState, Estimate, Hold, Motion, StopReason,
    Texture, Trip, UpdateRate,
};

use crate::endurance::Endurance;
use crate::fade::Fade;
use crate::hand::{Hand, Jump};
use crate::limits::Limits;
use crate::memory::Memory;
use crate::pace::per_tick;
use crate::plausibility::{Plausibility, Verdict};
use crate::relief::{self, Relief};
use crate::senses::{ConverterFault, Output, Readback, Senses, Transfer};
use crate::settings::Settings;
use crate::stimulus::Stimulus;
use crate::supervisor::{self, Event};
use crate::watch::Watch;
use crate::{ACTUATORS, ZERO_VOLT};

/// The display board's state, stepped once per output tick.
///
/// 0 V at start and until the converters have started and a trusted estimate has come; then it fades in
/// and follows the hand by the last trusted λ, whatever the link does. When that λ is older than
/// [`max_age_ms`](DisplayConfiguration::max_age_ms), or than a surface that was met just now is held
/// ([`crate::plausibility::Plausibility::is_fresh`]), or estimates speak against it, or there is another reason not to
/// drive, the stimulus fades out; it fades in again when the reason is gone. What no link and no hand can make good
/// stops it until the reset button or power: see [`crate::supervisor`] and `docs/src/explanation/safety.md`. Time is
/// counted in ticks alone: the same calls give the same words.
#[derive(Clone, Debug, PartialEq)]
pub struct Display {
    configuration: DisplayConfiguration,
    memory: Memory,
    state: DisplayState,
    /// What trips in the next tick.
    asked: Option<Trip>,
    watch: Watch,
    plausibility: Plausibility,
    relief: Relief,
    endurance: Endurance,
    hand: Hand,
    fade: Fade,
    stimulus: Stimulus,
    limits: Limits,
    send_anyway: bool,
    /// Stopped, and seen to be at 0 V.
    is_off: bool,
    counters: DisplayCounters,
}

impl Display {
    /// A display at 0 V that has seen neither hand nor surface, in [`DisplayState::Boot`]; stopped for
    /// good if a trip was `persisted` from before the reset.
    pub fn new(settings: &Settings, persisted: Option<Trip>) -> Self {
        let configuration = *settings.configuration();
        let actuators = settings.actuators();
        let mut display = Self {
            memory: Memory::of(&configuration, actuators),
            state: DisplayState::Boot,
            asked: None,
            watch: Watch::default(),
            plausibility: Plausibility::new(),
            relief: Relief::new(),
            endurance: Endurance::default(),
            hand: Hand::default(),
            fade: Fade::new(configuration.fade_in_ms, configuration.fade_out_ms),
            stimulus: Stimulus::new(&configuration, actuators),
            limits: Limits::new(configuration.update_rate, configuration.amplitude_mv),
            send_anyway: false,
            is_off: false,
            counters: DisplayCounters::ZERO,
            configuration,
        };
        if let Some(trip) = persisted {
            display.on(Event::Trip(trip));
        }
        if !settings.are_sound() {
            display.on(Event::Trip(Trip::Memory));
        }
        display
    }

    /// The converters have been started and read back, or failed to: before, nothing is driven.
    pub fn started(&mut self, converters: Result<(), ConverterFault>) {
        match converters {
            Ok(()) => self.on(Event::Started),
            Err(_) => {
                count(&mut self.counters.converter_faults, true);
                self.on(Event::Trip(Trip::Converter));
            }
        }
    }

    /// Takes settings as [`Settings`] made them; others are a fault of memory. See
    /// [`Stimulus::configure`] for how they come into force, and [`Display::rate`] for how long the periods are.
    pub fn configure(&mut self, settings: &Settings) {
        if !settings.are_sound() {
            self.ask(Trip::Memory);
            return;
        }
        let configuration = *settings.configuration();
        let actuators = settings.actuators();
        self.configuration = configuration;
        self.memory = Memory::of(&configuration, actuators);
        self.fade
            .set_times(configuration.fade_in_ms, configuration.fade_out_ms);
        self.stimulus.configure(&configuration, actuators);
        self.limits.set(configuration.amplitude_mv);
        // A lower age makes too old at once what no tick, and no texture, will see to become so.
        if !self.relief.wave_is_fresh(configuration.max_age_ms) {
            self.stimulus.wear_off();
        }
        if !self.relief.friction_is_fresh(configuration.max_age_ms) {
            self.stimulus.rub(None);
        }
    }

    /// The configuration in force.
    pub fn configuration(&self) -> DisplayConfiguration {
        self.configuration
    }

    /// Who sends estimates asks for a greeting: it may have started again.
    pub const fn on_greeting(&mut self) {
        self.plausibility.on_greeting();
    }

    /// Takes what the sensor says, if it is to be trusted: see [`crate::plausibility`].
    pub fn on_estimate(&mut self, estimate: &Estimate) {
        let counters = &mut self.counters;
        let counter = match self
            .plausibility
            .judge(estimate, self.configuration.max_age_ms)
        {
            Verdict::Trusted(wavelength) => {
                self.stimulus.follow(wavelength, estimate.amplitude_lsb);
                Some(&mut counters.estimates)
            }
            Verdict::Idle => None,
            Verdict::Late | Verdict::OutOfRange => Some(&mut counters.refused_estimates),
            Verdict::Implausible => Some(&mut counters.implausible),
            Verdict::Flooding => Some(&mut counters.flooded),
        };
        if let Some(counter) = counter {
            count(counter, true);
        }
        counters.implausible = counters
            .implausible
            .wrapping_add(self.plausibility.take_unconfirmed());
        if self.plausibility.take_beginning() {
            self.relief.begin_anew();
        }
    }

    /// Takes what the sensor says of the surface besides λ: see [`crate::relief`].
    pub fn on_texture(&mut self, texture: &Texture) {
        let counters = &mut self.counters;
        let may_begin = self.plausibility.may_begin();
        match self.relief.judge(texture, may_begin) {
            relief::Verdict::Taken => {
                if texture.valid {
                    self.stimulus.wear(texture);
                }
                if texture.friction.is_some() {
                    self.stimulus.rub(texture.friction);
                }
            }
            relief::Verdict::Late => count(&mut counters.refused_estimates, true),
            relief::Verdict::Unsound => count(&mut counters.implausible, true),
            relief::Verdict::Flooding => count(&mut counters.flooded, true),
        }
        if !self.relief.friction_is_fresh(self.configuration.max_age_ms) {
            self.stimulus.rub(None);
        }
    }

    /// 0 V from the next tick on, and for good.
    pub fn stop(&mut self, reason: StopReason) {
        self.ask(reason.trip());
    }

    /// What has stopped it for good, once the outputs are off: CLR is low, or the tick before sent 0 V and the
    /// converters have it.
    pub fn off(&self) -> Option<Trip> {
        match self.state {
            DisplayState::Stopped(trip) if self.is_off => Some(trip),
            _ => None,
        }
    }

    /// One output tick, with the hand encoder's counter and the board as it is.
    pub fn tick(&mut self, encoder: u16, senses: &Senses) -> Output {
        count(&mut self.counters.ticks, true);
        if let DisplayState::Stopped(_) = self.state {
            // The words that it sent last are 0 V.
            self.is_off = senses.is_clear || senses.transfer == Transfer::Done;
        }
        let rate = self.stimulus.rate();
        self.limits.pace(rate);
        let quarters = per_tick(rate);
        let elapsed = quarters.saturating_mul(senses.missed_ticks.saturating_add(1));
        let travel = self.hand.read(encoder, elapsed);
        self.elapse(elapsed);
        self.sense(senses, travel, elapsed);
        match self.hold() {
            Some(hold) => self.on(Event::Hold(hold)),
            // What CLR took to 0 V stays there for this tick, and fades in.
            None if senses.clear_fell => {}
            None => self.on(Event::Fresh),
        }
        let send = self.drive(travel.unwrap_or(0), quarters);
        count(&mut self.counters.updates, send);
        Output {
            send,
            release: supervisor::releases(self.state),
        }
    }

    /// How long the period is that the next tick ends: another rate is in force from the one after it on.
    pub const fn rate(&self) -> UpdateRate {
        self.stimulus.rate()
    }

    /// The words of the last tick: [`ZERO_VOLT`] is 0 V, a step 10 V / 65 536.
    pub fn words(&self) -> &[u16; ACTUATORS] {
        self.stimulus.words()
    }

    /// The hand's [`Motion`] every 2 ms, whatever the state; see [`Hand::motion`].
    pub fn motion(&mut self, instant_us: u64) -> Option<Motion> {
        self.hand.motion(instant_us)
    }

    /// The supervisor's state.
    pub fn state(&self) -> DisplayState {
        self.state
    }

    /// What was counted since the start.
    pub fn counters(&self) -> DisplayCounters {
        DisplayCounters {
            state: self.state,
            ..self.counters
        }
    }

    fn ask(&mut self, trip: Trip) {
        self.asked = self.asked.or(Some(trip));
    }

    /// Tells the supervisor, and is at 0 V at once where its state asks for it.
    fn on(&mut self, event: Event) {
        let before = self.state;
        self.state = supervisor::next(before, event);
        if self.state == before {
            return;
        }
        count(&mut self.counters.changes, true);
        match self.state {
            DisplayState::Fading(Hold::Stale) => count(&mut self.counters.fades, true),
            DisplayState::Stopped(_) => self.hush(),
            _ => {}
        }
    }

    /// All words at 0 V; they are sent in any case, since the chips may hold others.
    fn hush(&mut self) {
        self.stimulus.silence();
        self.limits.cleared();
        self.send_anyway = true;
    }

    fn elapse(&mut self, quarters: u32) {
        let rests = self.stimulus.is_resting();
        self.plausibility.elapse(quarters, rests);
        self.forget(quarters);
        self.endurance.elapse(
            quarters,
            matches!(self.state, DisplayState::Driving | DisplayState::Fading(_)),
            rests,
            self.configuration.full_drive_s,
        );
    }

    /// Time passes, and what is known of the surface's wave besides λ may become too old.
    fn forget(&mut self, quarters: u32) {
        let max_age_ms = self.configuration.max_age_ms;
        let was_fresh = self.relief.wave_is_fresh(max_age_ms);
        self.relief.elapse(quarters);
        if was_fresh && !self.relief.wave_is_fresh(max_age_ms) {
            self.stimulus.wear_off();
        }
    }

    /// All that trips before a word is computed; the first one counts.
    fn sense(&mut self, senses: &Senses, travel: Result<i16, Jump>, quarters: u32) {
        // Where CLR is not held off it falls.
        if senses.clear_fell && supervisor::releases(self.state) {
            count(&mut self.counters.clears, true);
            self.on(Event::Cleared);
            self.hush();
        }
        let watched = self.watch.look(senses, quarters);
        self.send_anyway |= self.watch.words_are_missing();
        let differs = senses.readback == Readback::Differs;
        let counters = &mut self.counters;
        count(
            &mut counters.converter_faults,
            differs || self.watch.alarm_begins(),
        );
        count(&mut counters.unheard, senses.unheard);
        count(
            &mut counters.spi_errors,
            senses.transfer == Transfer::Failed,
        );
        let stalled = u32::from(senses.transfer == Transfer::Stalled);
        counters.deadline_misses = counters
            .deadline_misses
            .wrapping_add(senses.missed_ticks)
            .wrapping_add(stalled);
        count(&mut counters.encoder_jumps, travel.is_err());
        let forgot = !self.memory.agrees(&self.configuration, &self.stimulus);
        for trip in [
            watched,
            self.asked,
            travel.err().map(|_| Trip::HandEncoder),
            forgot.then_some(Trip::Memory),
        ]
        .into_iter()
        .flatten()
        {
            self.on(Event::Trip(trip));
        }
    }

    /// Why not to drive: first what has to end it quickly.
    fn hold(&self) -> Option<Hold> {
        let estimates = &self.plausibility;
        if self.watch.is_unheard() {
            Some(Hold::Unheard)
        } else if estimates.floods() {
            Some(Hold::Flood)
        } else if estimates.distrusts() {
            Some(Hold::Distrust)
        } else if estimates.contradicts() {
            Some(Hold::Contradiction)
        } else if self.endurance.is_exhausted() {
            Some(Hold::FullDrive)
        } else if !estimates.is_fresh(self.configuration.max_age_ms) {
            Some(Hold::Stale)
        } else {
            None
        }
    }

    /// The words of this tick. Whether they are to be sent.
    fn drive(&mut self, travel: i16, quarters: u32) -> bool {
        let gain = self.fade.step(supervisor::aim(self.state), quarters);
        let mut changed = false;
        if !matches!(self.state, DisplayState::Stopped(_)) {
            changed = self.stimulus.tick(travel, gain);
            if self.limits.check(self.stimulus.words()).is_err() {
                self.on(Event::Trip(Trip::Limit));
            }
            let fades = matches!(self.state, DisplayState::Fading(_));
            if fades && gain == 0 && self.words() == &[ZERO_VOLT; ACTUATORS] {
                self.on(Event::Silent);
            }
        }
        core::mem::take(&mut self.send_anyway) || changed
    }
}

fn count(counter: &mut u32, happened: bool) {
    *counter = counter.wrapping_add(u32::from(happened));
}

#[cfg(test)]
mod tests {
    use protocol::actuators::{Actuator, DEFAULT_ACTUATORS};
    use protocol::{Contact, GAUGES, GaugeHealth, Range};

    use super::*;

    /// One that has followed a hand of 70 mm/s for 100 ms.
    fn driving() -> (Display, u16) {
        let mut display = Display::new(&Settings::DEFAULT, None);
        display.started(Ok(()));
        display.on_estimate(&Estimate {
            sequence: 1,
            instant_us: 0,
            wavelength_mm: Some(2.0),
            valid: true,
            confidence: 1.0,
            amplitude_lsb: 100.0,
            counted_mm: None,
            range: Range::T1,
            contact: Contact::Slip,
            velocity_um_s: 70_000,
            lag_um: None,
            gauges_used: 1,
            health: [GaugeHealth::Good; GAUGES],
        });
        for tick in 1..=200 {
            display.tick(tick * 7, &Senses::default());
        }
        assert_eq!(display.state(), DisplayState::Driving);
        (display, 200 * 7)
    }

    /// Ticks until it has stopped, in which it is at 0 V and no word was beyond `most` steps before.
    fn stopped_after(display: &mut Display, mut encoder: u16, most: u16) -> (u32, Trip) {
        for tick in 1..1_000 {
            encoder += 7;
            let output = display.tick(encoder, &Senses::default());
            if let DisplayState::Stopped(trip) = display.state() {
                assert!(output.send && !output.release);
                assert_eq!(*display.words(), [ZERO_VOLT; ACTUATORS]);
                return (tick, trip);
            }
            assert!(
                display
                    .words()
                    .iter()
                    .all(|w| w.abs_diff(ZERO_VOLT) <= most)
            );
        }
        panic!("never stopped");
    }

    #[test]
    fn textures_of_a_sensor_that_starts_again_are_heard_whenever_its_arm_moves() {
        let (mut display, _) = driving();
        let estimate = |sequence: u32| Estimate {
            sequence,
            instant_us: 0,
            wavelength_mm: None,
            valid: false,
            confidence: 0.0,
            amplitude_lsb: 0.0,
            counted_mm: None,
            range: Range::T1,
            contact: Contact::Unknown,
            velocity_um_s: 0,
            lag_um: None,
            gauges_used: 1,
            health: [GaugeHealth::Good; GAUGES],
        };
        let texture = |sequence: u32| Texture {
            sequence,
            ..Texture::default()
        };
        display.on_estimate(&estimate(371));
        display.on_texture(&texture(370));
        display.on_texture(&texture(60));
        assert_eq!(display.counters().refused_estimates, 1, "late");
        display.on_estimate(&estimate(0));
        display.on_texture(&texture(60));
        assert_eq!(display.counters().refused_estimates, 1, "a new beginning");
    }

    #[test]
    fn a_setting_that_changed_by_itself_stops_in_the_next_tick() {
        let (mut display, encoder) = driving();
        display.configuration.amplitude_mv ^= 1 << 9;
        let stopped = stopped_after(&mut display, encoder, 32_767);
        assert_eq!(stopped, (1, Trip::Memory));
    }

    #[test]
    fn an_actuator_that_changed_by_itself_stops_within_nine_milliseconds() {
        let change: fn(&mut Actuator) = |actuator| actuator.gain_q15 ^= 1 << 14;
        for index in 0..ACTUATORS {
            let (mut display, encoder) = driving();
            let mut changed = DEFAULT_ACTUATORS;
            change(&mut changed[index]);
            display.stimulus = Stimulus::new(&display.configuration, &changed);
            let (ticks, trip) = stopped_after(&mut display, encoder, 32_767);
            assert_eq!(trip, Trip::Memory);
            assert!(ticks <= 18, "{ticks}");
        }
    }

    #[test]
    fn words_beyond_a_limit_do_not_go_out() {
        let (mut display, encoder) = driving();
        display.limits = Limits::new(display.configuration.update_rate, 1_000);
        // A quarter of 28.6 ms, in which the wave has a crest.
        let (ticks, trip) = stopped_after(&mut display, encoder, 6_554);
        assert_eq!(trip, Trip::Limit);
        assert!(ticks <= 29, "{ticks}");
    }
}
