//! What the fifty actuators do, as the display's firmware computes it.
//!
//! The display does not send its voltages. They follow from the hand's motion, the estimates, the
//! configuration and the supervisor's state, which it does send, by the firmware's own library. Only the
//! wave's phase is not the board's: it counts from when this began to listen.

use firmware_display::fade::Fade;
use firmware_display::pace::per_tick;
use firmware_display::plausibility::{Plausibility, Verdict};
use firmware_display::{
    ACTUATORS, MICROMETRES_PER_COUNT, Settings, Stimulus, ZERO_VOLT, supervisor,
};
use protocol::actuators::{self, Actuator, DEFAULT_ACTUATORS};
use protocol::{DisplayConfiguration, DisplayState, Estimate, Motion};

/// Volts of a word's step.
const V_PER_STEP: f32 = 10.0 / 65_536.0;
/// Peaks are those of this long at least, in µs, and of twice as long at most.
const PEAK_US: u64 = 50_000;
/// A hand that was not heard for so long, in µs, begins anew.
const GAP_US: u64 = 100_000;
/// The widest grid that fits a description, in µm between neighbours.
const WIDEST_PITCH_UM: u16 = 4_000;

/// The fifty actuators.
#[derive(Clone, Debug)]
pub struct Fingertip {
    /// None: the array is one that this program does not know.
    settings: Option<Settings>,
    state: DisplayState,
    plausibility: Plausibility,
    fade: Fade,
    stimulus: Stimulus,
    last: Option<Motion>,
    /// The furthest of each word from 0 V, in the running window and in the one before.
    peaks: [[u16; ACTUATORS]; 2],
    window_us: u64,
}

impl Default for Fingertip {
    fn default() -> Self {
        Self::of(Settings::DEFAULT)
    }
}

impl Fingertip {
    fn of(settings: Settings) -> Self {
        let configuration = settings.configuration();
        Self {
            state: DisplayState::Boot,
            plausibility: Plausibility::new(),
            fade: Fade::new(configuration.fade_in_ms, configuration.fade_out_ms),
            stimulus: Stimulus::new(configuration, settings.actuators()),
            last: None,
            peaks: [[0; ACTUATORS]; 2],
            window_us: 0,
            settings: Some(settings),
        }
    }

    /// Takes the display's configuration. Its array is named by a hash only: the default one, and every
    /// grid of equal gains, are known by it.
    pub fn configure(&mut self, configuration: &DisplayConfiguration) {
        let in_force = self.settings.as_ref().map(Settings::configuration);
        if in_force == Some(configuration) {
            return;
        }
        self.settings = array(configuration.actuators)
            .and_then(|actuators| Settings::new(*configuration, &actuators).ok());
        if let Some(settings) = &self.settings {
            self.fade
                .set_times(configuration.fade_in_ms, configuration.fade_out_ms);
            self.stimulus.configure(configuration, settings.actuators());
        }
    }

    /// The supervisor's state, as the display says it; none: it is not heard.
    pub fn turn(&mut self, state: Option<DisplayState>) {
        self.state = state.unwrap_or_default();
        if state.is_none() {
            self.last = None;
        }
        if let DisplayState::Stopped(_) | DisplayState::Boot = self.state {
            self.stimulus.silence();
        }
    }

    /// The sensor has started anew, or the display.
    pub fn restart(&mut self) {
        self.plausibility = Plausibility::new();
        self.last = None;
    }

    /// Follows an estimate if the firmware would.
    pub fn hear(&mut self, estimate: &Estimate) {
        let Some(settings) = &self.settings else {
            return;
        };
        let max_age_ms = settings.configuration().max_age_ms;
        if let Verdict::Trusted(wavelength) = self.plausibility.judge(estimate, max_age_ms) {
            self.stimulus.follow(wavelength, estimate.amplitude_lsb);
        }
    }

    /// Follows the hand, tick by tick.
    pub fn follow(&mut self, motion: &Motion) {
        let last = self.last.replace(*motion);
        let (Some(settings), Some(last)) = (&self.settings, last) else {
            return;
        };
        let Some(elapsed_us) = motion.instant_us.checked_sub(last.instant_us) else {
            return;
        };
        if elapsed_us > GAP_US {
            return;
        }
        let rate = settings.configuration().update_rate;
        let quarters = per_tick(rate);
        let ticks = (elapsed_us * u64::from(rate.hz()) / 1_000_000).cast_signed();
        let counts =
            motion.position_um.wrapping_sub(last.position_um) / i64::from(MICROMETRES_PER_COUNT);
        // Wide: a board may say that it is anywhere.
        let by = |tick: i64| i128::from(counts) * i128::from(tick) / i128::from(ticks);
        for tick in 0..ticks {
            let travel = by(tick + 1) - by(tick);
            // No hand moves further in a tick.
            let travel = i16::try_from(travel).unwrap_or(0);
            self.plausibility
                .elapse(quarters, self.stimulus.is_resting());
            let gain = self.fade.step(supervisor::aim(self.state), quarters);
            if self.state != DisplayState::Boot && !matches!(self.state, DisplayState::Stopped(_)) {
                self.stimulus.tick(travel, gain);
            }
            for (peak, word) in self.peaks[0].iter_mut().zip(self.stimulus.words()) {
                *peak = (*peak).max(word.abs_diff(ZERO_VOLT));
            }
        }
        if motion.instant_us.saturating_sub(self.window_us) >= PEAK_US {
            self.window_us = motion.instant_us;
            self.peaks[1] = std::mem::replace(&mut self.peaks[0], [0; ACTUATORS]);
        }
    }

    /// Whether the display's array is known, so that anything can be said of it.
    pub const fn is_known(&self) -> bool {
        self.settings.is_some()
    }

    /// The actuators, if they are known.
    pub fn actuators(&self) -> Option<&[Actuator; ACTUATORS]> {
        self.settings.as_ref().map(Settings::actuators)
    }

    /// The largest voltage of each actuator in the last 50 to 100 ms, in V, 0 or above.
    pub fn peaks_v(&self) -> [f32; ACTUATORS] {
        std::array::from_fn(|actuator| {
            f32::from(self.peaks[0][actuator].max(self.peaks[1][actuator])) * V_PER_STEP
        })
    }

    /// The voltage of each actuator now, in V.
    pub fn volts(&self) -> [f32; ACTUATORS] {
        self.stimulus
            .words()
            .map(|word| (f32::from(word) - f32::from(ZERO_VOLT)) * V_PER_STEP)
    }
}

/// The array that a hash names, if it is a grid of equal gains.
fn array(hash: u32) -> Option<[Actuator; ACTUATORS]> {
    std::iter::once(DEFAULT_ACTUATORS)
        .chain((0..=WIDEST_PITCH_UM).map(actuators::grid))
        .find(|actuators| actuators::hash(actuators) == hash)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_that_is_said_to_be_beyond_the_sky_is_not_followed() {
        let mut fingertip = Fingertip::default();
        for (sequence, position_um) in [(0, 1 << 62), (1, -(1 << 62)), (2, i64::MAX), (3, 0)] {
            fingertip.follow(&Motion {
                sequence,
                instant_us: 50_000 * u64::from(sequence),
                position_um,
                velocity_um_s: 0,
            });
        }
        assert!(fingertip.volts().iter().all(|volts| volts.abs() < 1e-6));
    }
}
