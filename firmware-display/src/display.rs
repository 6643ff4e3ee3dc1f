//! The display: estimates and encoder readings in, fifty DAC words out.

use protocol::{
    DisplayConfiguration, DisplayCounters, DisplayState, Estimate, Mode, Motion, StopReason, Trip,
};

use crate::array::{Array, FULL_LEVEL, Trim};
use crate::fade::Fade;
use crate::hand::Hand;
use crate::pattern::Pattern;
use crate::phase::{Phase, Wavelength};
use crate::{
    ACTUATORS, ConverterFault, Output, Readback, Senses, Settings, Transfer, ZERO_VOLT, ticks,
};

/// An estimate is late, and refused, if it is behind the last by at most this many: 10 s.
const LATE_AT_MOST: u32 = 1_000;
/// A sensor that has just started sends sequences up to this; from it, one that is behind by more
/// than [`REORDERED_AT_MOST`] is a new beginning and not late.
const BEGINNING: u32 = 10;
/// The link puts estimates out of order by no more than this many.
const REORDERED_AT_MOST: u32 = 32;
/// A new amplitude is reached at this rate: the whole of 5 V in 20 ms.
const AMPLITUDE_PER_TICK: u32 = FULL_LEVEL / ticks(20);
/// The largest amplitude, in mV, and the voltage of [`FULL_LEVEL`].
const FULL_LEVEL_MV: u16 = 5_000;

/// The display board's state, stepped once per output tick of 500 µs.
///
/// 0 V at start and until the first valid estimate, then fades in and follows the hand by the last
/// valid λ, whatever the link does. When that λ is older than
/// [`max_age_ms`](DisplayConfiguration::max_age_ms) the stimulus fades out; it fades in again at the
/// next valid one. Time is counted in ticks alone: the same calls give the same words.
#[derive(Clone, Debug)]
pub struct Display {
    configuration: DisplayConfiguration,
    array: Array,
    hand: Hand,
    phase: Phase,
    wavelength: Option<Wavelength>,
    pattern: Pattern,
    fade: Fade,
    /// Amplitude in force, in Q16 DAC steps, on its way to the configuration's.
    amplitude: u32,
    /// Ticks since the last valid estimate.
    age_ticks: u32,
    following: bool,
    last_sequence: Option<u32>,
    state: DisplayState,
    send_anyway: bool,
    drawn: Drawn,
    words: [u16; ACTUATORS],
    counters: DisplayCounters,
}

/// All that the words depend on, apart from the trims. The default is 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Drawn {
    level: u32,
    turns: u32,
    pattern: Pattern,
}

impl Display {
    /// A display at 0 V that has seen neither hand nor surface, in [`DisplayState::Boot`]; stopped for
    /// good if a trip was `persisted` from before the reset.
    pub fn new(settings: &Settings, persisted: Option<Trip>) -> Self {
        let configuration = *settings.configuration();
        Self {
            array: Array::new(&[Trim::default(); ACTUATORS]),
            hand: Hand::default(),
            phase: Phase::default(),
            wavelength: None,
            pattern: Pattern::default(),
            fade: Fade::new(configuration.fade_in_ms, configuration.fade_out_ms),
            amplitude: 0,
            age_ticks: u32::MAX,
            following: false,
            last_sequence: None,
            state: persisted.map_or(DisplayState::Boot, DisplayState::Stopped),
            send_anyway: false,
            drawn: Drawn::default(),
            words: [ZERO_VOLT; ACTUATORS],
            counters: DisplayCounters::default(),
            configuration,
        }
    }

    /// The converters have been started and read back, or failed to: without it nothing is driven.
    pub fn started(&mut self, converters: Result<(), ConverterFault>) {
        match converters {
            Ok(()) if self.state == DisplayState::Boot => self.enter(DisplayState::Ready),
            Ok(()) => {}
            Err(_) => self.trip(Trip::Converter),
        }
    }

    /// Takes settings, which are checked. Nothing jumps: a new amplitude is reached at 5 V in 20 ms, a
    /// new mode or place as a new λ is.
    pub fn configure(&mut self, settings: &Settings) {
        let configuration = *settings.configuration();
        self.configuration = configuration;
        self.fade
            .set_times(configuration.fade_in_ms, configuration.fade_out_ms);
        self.aim_pattern();
    }

    /// The configuration in force.
    pub fn configuration(&self) -> DisplayConfiguration {
        self.configuration
    }

    /// Takes each actuator's gain and polarity, at once: for start-up.
    pub fn trim(&mut self, trims: &[Trim; ACTUATORS]) {
        self.array = Array::new(trims);
        self.send_anyway = true;
    }

    /// Takes what the sensor says.
    ///
    /// Refused and counted: an estimate that is not later than the last seen, and a valid one whose
    /// λ is missing, not finite, or out of the range of [`Wavelength`]. One that the estimator itself
    /// calls invalid changes nothing and does not make the last valid one younger. A sensor that
    /// restarts counts from 0 again: an estimate more than 1 000 behind the last one, or among the
    /// first eleven and more than 32 behind, is a new beginning.
    pub fn on_estimate(&mut self, estimate: &Estimate) {
        if self.is_late(estimate.sequence) {
            self.refuse();
            return;
        }
        self.last_sequence = Some(estimate.sequence);
        if !estimate.valid {
            return;
        }
        let Some(wavelength) = estimate.wavelength_mm.and_then(Wavelength::new) else {
            self.refuse();
            return;
        };
        self.counters.estimates = self.counters.estimates.wrapping_add(1);
        self.age_ticks = 0;
        self.wavelength = Some(wavelength);
        self.phase.follow(wavelength);
        self.aim_pattern();
    }

    /// 0 V from the next tick on, and for good.
    pub fn stop(&mut self, reason: StopReason) {
        self.trip(match reason {
            StopReason::Operator => Trip::Operator,
            StopReason::Host => Trip::Host,
        });
    }

    /// One output tick with the hand encoder's counter and the board as it is.
    pub fn tick(&mut self, encoder: u16, senses: &Senses) -> Output {
        self.counters.ticks = self.counters.ticks.wrapping_add(1);
        if senses.stop_input_open {
            self.trip(Trip::EmergencyStop);
        }
        if senses.alarm || senses.readback == Readback::Differs {
            self.trip(Trip::Converter);
        }
        self.send_anyway |= senses.clear_fell || senses.transfer != Transfer::Done;
        let travel = self.hand.read(encoder);
        self.phase.advance(travel);
        let silent = self.fade.gain() == 0;
        self.supervise();
        self.approach(silent, travel);
        let drawn = self.next_drawn();
        let mut send = core::mem::take(&mut self.send_anyway);
        if send || drawn != self.drawn {
            let sines = drawn.pattern.sines(drawn.turns);
            send |= self.array.draw(drawn.level, &sines, &mut self.words);
            self.drawn = drawn;
        }
        self.counters.updates = self.counters.updates.wrapping_add(u32::from(send));
        Output {
            send,
            release: !matches!(self.state, DisplayState::Boot | DisplayState::Stopped(_)),
        }
    }

    /// The words of the last tick: [`ZERO_VOLT`] is 0 V, a step 10 V / 65 536.
    pub fn words(&self) -> &[u16; ACTUATORS] {
        &self.words
    }

    /// The hand's [`Motion`] after every fourth tick; see [`Hand::motion`].
    pub fn motion(&mut self, instant_us: u64) -> Option<Motion> {
        self.hand.motion(instant_us)
    }

    /// What was counted since the start; deadline misses and SPI errors are the board's to fill in.
    pub fn counters(&self) -> DisplayCounters {
        self.counters
    }

    /// The supervisor's state.
    pub fn state(&self) -> DisplayState {
        self.state
    }

    fn enter(&mut self, state: DisplayState) {
        self.counters.changes = self.counters.changes.wrapping_add(1);
        self.counters.state = state;
        self.state = state;
    }

    fn trip(&mut self, trip: Trip) {
        if !matches!(self.state, DisplayState::Stopped(_)) {
            self.enter(DisplayState::Stopped(trip));
        }
    }

    /// Whether `sequence` was sent before, or with, the last one seen.
    fn is_late(&self, sequence: u32) -> bool {
        let Some(last) = self.last_sequence else {
            return false;
        };
        // A later one is behind by almost 2³².
        let behind = last.wrapping_sub(sequence);
        let begins_anew = sequence <= BEGINNING && behind > REORDERED_AT_MOST;
        behind <= LATE_AT_MOST && !begins_anew
    }

    fn refuse(&mut self) {
        self.counters.refused_estimates = self.counters.refused_estimates.wrapping_add(1);
    }

    fn aim_pattern(&mut self) {
        let half_pitch_um = f64::from(protocol::actuators::DEFAULT_PITCH_UM) / 2.0;
        self.pattern
            .aim(match (self.configuration.mode, self.wavelength) {
                (Mode::Travelling, Some(wavelength)) => wavelength.phase_of(half_pitch_um),
                _ => 0,
            });
    }

    /// Ages the last valid estimate and fades accordingly.
    fn supervise(&mut self) {
        self.age_ticks = self.age_ticks.saturating_add(1);
        let fresh = self.age_ticks <= ticks(self.configuration.max_age_ms);
        if self.following && !fresh {
            self.counters.fades = self.counters.fades.wrapping_add(1);
        }
        self.following = fresh;
        self.fade.step(fresh);
    }

    /// Takes amplitude and pattern on to where they are to be: at once while nobody feels it.
    fn approach(&mut self, silent: bool, travel: i16) {
        let amplitude_mv = self.configuration.amplitude_mv.min(FULL_LEVEL_MV);
        let amplitude =
            (u64::from(FULL_LEVEL) * u64::from(amplitude_mv) / u64::from(FULL_LEVEL_MV)) as u32;
        if silent {
            self.amplitude = amplitude;
            self.pattern.settle();
            return;
        }
        let low = self.amplitude.saturating_sub(AMPLITUDE_PER_TICK);
        let high = self.amplitude.saturating_add(AMPLITUDE_PER_TICK);
        self.amplitude = amplitude.clamp(low, high);
        let turned = u32::from(travel.unsigned_abs()).saturating_mul(self.phase.per_count());
        self.pattern.glide(turned);
    }

    fn next_drawn(&self) -> Drawn {
        let level = ((u64::from(self.amplitude) * u64::from(self.fade.gain())) >> 31) as u32;
        if matches!(self.state, DisplayState::Boot | DisplayState::Stopped(_)) || level == 0 {
            return Drawn::default();
        }
        Drawn {
            level,
            turns: self.phase.turns(),
            pattern: self.pattern,
        }
    }
}
