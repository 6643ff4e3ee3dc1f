//! The display: estimates and encoder readings in, fifty DAC words out.

use protocol::actuators::DEFAULT_ACTUATORS;
use protocol::{DisplayConfiguration, DisplayCounters, Estimate, Motion};

use crate::fade::Fade;
use crate::hand::Hand;
use crate::phase::Wavelength;
use crate::stimulus::Stimulus;
use crate::{ACTUATORS, ticks};

/// An estimate is late, and refused, if it is behind the last by at most this many: 10 s.
const LATE_AT_MOST: u32 = 1_000;
/// A sensor that has just started sends sequences up to this; from it, one that is behind by more
/// than [`REORDERED_AT_MOST`] is a new beginning and not late.
const BEGINNING: u32 = 10;
/// The link puts estimates out of order by no more than this many.
const REORDERED_AT_MOST: u32 = 32;
/// The display board's state, stepped once per output tick of 500 µs.
///
/// 0 V at start and until the first valid estimate, then fades in and follows the hand by the last
/// valid λ, whatever the link does. When that λ is older than
/// [`max_age_ms`](DisplayConfiguration::max_age_ms) the stimulus fades out; it fades in again at the
/// next valid one. Time is counted in ticks alone: the same calls give the same words.
#[derive(Clone, Debug)]
pub struct Display {
    configuration: DisplayConfiguration,
    stimulus: Stimulus,
    hand: Hand,
    fade: Fade,
    /// Ticks since the last valid estimate.
    age_ticks: u32,
    following: bool,
    last_sequence: Option<u32>,
    stopped: bool,
    send_anyway: bool,
    counters: DisplayCounters,
}

impl Display {
    /// A display at 0 V that has seen neither hand nor surface. `configuration` is checked.
    pub fn new(configuration: DisplayConfiguration) -> Self {
        Self {
            stimulus: Stimulus::new(&configuration, &DEFAULT_ACTUATORS),
            hand: Hand::default(),
            fade: Fade::new(configuration.fade_in_ms, configuration.fade_out_ms),
            age_ticks: u32::MAX,
            following: false,
            last_sequence: None,
            stopped: false,
            send_anyway: false,
            counters: DisplayCounters::default(),
            configuration,
        }
    }

    /// Takes a checked configuration; see [`Stimulus::configure`].
    pub fn configure(&mut self, configuration: DisplayConfiguration) {
        self.configuration = configuration;
        self.fade
            .set_times(configuration.fade_in_ms, configuration.fade_out_ms);
        self.stimulus.configure(&configuration, &DEFAULT_ACTUATORS);
    }

    /// The configuration in force.
    pub fn configuration(&self) -> DisplayConfiguration {
        self.configuration
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
        self.stimulus.follow(wavelength, estimate.amplitude_lsb);
    }

    /// 0 V from the next tick on, and for good.
    pub fn stop(&mut self) {
        self.stopped = true;
    }

    /// Makes the next tick send its words even if they are the last ones: for when the chips may hold
    /// others, after a failed transfer or a CLR.
    pub fn resend(&mut self) {
        self.send_anyway = true;
    }

    /// One output tick, every 500 µs, with the hand encoder's counter. True if any of
    /// [`Display::words`] changed and all are to be sent; a hand at rest sends nothing.
    pub fn tick(&mut self, encoder: u16) -> bool {
        self.counters.ticks = self.counters.ticks.wrapping_add(1);
        let travel = self.hand.read(encoder);
        self.supervise();
        let mut send = core::mem::take(&mut self.send_anyway);
        if self.stopped {
            send |= self.words() != &[crate::ZERO_VOLT; ACTUATORS];
            self.stimulus.silence();
        } else {
            send |= self.stimulus.tick(travel, self.fade.gain());
        }
        self.counters.updates = self.counters.updates.wrapping_add(u32::from(send));
        send
    }

    /// The words of the last tick: [`ZERO_VOLT`] is 0 V, a step 10 V / 65 536.
    pub fn words(&self) -> &[u16; ACTUATORS] {
        self.stimulus.words()
    }

    /// The hand's [`Motion`] after every fourth tick; see [`Hand::motion`].
    pub fn motion(&mut self, instant_us: u64) -> Option<Motion> {
        self.hand.motion(instant_us)
    }

    /// What was counted since the start; deadline misses and SPI errors are the board's to fill in.
    pub fn counters(&self) -> DisplayCounters {
        self.counters
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
}
