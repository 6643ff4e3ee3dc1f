//! The stimulus: the hand's travel and the surface's λ in, fifty DAC words out, each output tick.
//!
//! ```text
//! travel ─┬─> Phase ─> Pattern ─> Wave ─> Skin ──> Balance: − mean ──> Array: · gain, rounded ──> words
//!         └─> Rest ───> Gate ─┐                                  ▲
//!             Level: roll-off ┴───────────── gain ───────────────┘
//! ```
//!
//! y = 5 V · sin(2π (x + xᵢ)/λ) while all is well (equation (12) of Okamoto et al. 2009, accumulated), and
//! exactly 0 V when the hand rests, within 19 ms of its last count. With [`Rendering::Shape`] and
//! [`Rendering::Texture`] the sine becomes the surface's [`Wave`], and with a model of the actuator that is what the
//! skin gets ([`Skin`]).
//!
//! The last resort against steps, of a hand that cannot move so: no word changes by more than
//! [`MOST_V_PER_MS`].

use protocol::actuators::Actuator;
use protocol::{DisplayConfiguration, Friction, Mode, Rendering, Texture, UpdateRate};

use crate::array::{Array, EACH};
use crate::balance::{Balance, Channels, Drive, Sharing};
use crate::gate::Gate;
use crate::level::Level;
use crate::pace::RateChange;
use crate::pattern::Pattern;
use crate::phase::{Phase, Wavelength};
use crate::plausibility::{are_about_the_same, is_another_surface};
use crate::rest::Rest;
use crate::skin::Skin;
use crate::wave::{Scale, Wave};
use crate::{ACTUATORS, MICROMETRES_PER_COUNT, ZERO_VOLT, ticks_at};

/// The steepest that any voltage gets, in V/ms: a little more than 5 V at 250 Hz need.
pub const MOST_V_PER_MS: i32 = 8;
/// The least time in which an actuator's phase glides to that of another λ, so that no voltage jumps.
const LEAST_GLIDE_MS: u16 = 10;

/// The display board's output, stepped once per output tick.
///
/// Time is counted in ticks alone: the same calls give the same words.
#[derive(Clone, Debug, PartialEq)]
pub struct Stimulus {
    /// Of the tick that comes next.
    rate: UpdateRate,
    /// Of those after it.
    next_rate: UpdateRate,
    glide_ms: u16,
    description: Description,
    /// A description that waits until the one in force is silent.
    waiting: Option<Description>,
    wavelength: Option<Wavelength>,
    array: Array,
    pattern: Pattern,
    skin: Skin,
    wave: Wave,
    phase: Phase,
    /// Where the hand is, from where it began, in µm; it wraps.
    place_um: i32,
    level: Level,
    rest: Rest,
    gate: Gate,
    balance: Balance,
    /// What the actuators do, before gains: of a tick, and only the first of it if they all do the same.
    lanes: [i32; ACTUATORS],
    /// Whether all words are 0 V and nothing was to be heard in the last tick.
    silent: bool,
    words: [u16; ACTUATORS],
}

/// What the actuators are and how they share the stimulus.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Description {
    mode: Mode,
    rendering: Rendering,
    actuators: [Actuator; ACTUATORS],
}

impl Stimulus {
    /// 0 V, a hand at rest and no λ yet. Configuration and actuators are checked.
    pub fn new(configuration: &DisplayConfiguration, actuators: &[Actuator; ACTUATORS]) -> Self {
        let pattern = Pattern::new(configuration.mode, actuators);
        let skin = Skin::new(configuration.rendering, actuators, &pattern);
        Self {
            rate: configuration.update_rate,
            next_rate: configuration.update_rate,
            glide_ms: configuration.glide_ms,
            description: Description {
                mode: configuration.mode,
                rendering: configuration.rendering,
                actuators: *actuators,
            },
            waiting: None,
            wavelength: None,
            array: Array::new(actuators),
            wave: Wave::new(configuration.rendering, scale_behind(&skin)),
            pattern,
            skin,
            phase: Phase::default(),
            place_um: 0,
            level: Level::new(configuration),
            rest: Rest::default(),
            gate: Gate::default(),
            balance: Balance::default(),
            lanes: [0; ACTUATORS],
            silent: true,
            words: [ZERO_VOLT; ACTUATORS],
        }
    }

    /// Takes a checked configuration. A new amplitude is reached in 20 ms; a new mode or rendering, and new actuators,
    /// come into force when the gate has closed, which takes 6 ms, and it opens again in 6 ms. If nothing
    /// is to be heard all is in force with the next tick. Another rate is so after the next tick, since the period under way
    /// keeps its length; the stimulus goes on through it.
    pub fn configure(
        &mut self,
        configuration: &DisplayConfiguration,
        actuators: &[Actuator; ACTUATORS],
    ) {
        self.next_rate = configuration.update_rate;
        self.glide_ms = configuration.glide_ms;
        self.level.configure(configuration, self.rate);
        let asked = Description {
            mode: configuration.mode,
            rendering: configuration.rendering,
            actuators: *actuators,
        };
        self.waiting = (asked != self.description).then_some(asked);
    }

    /// Follows a surface of this λ and amplitude (in ADC steps) from here on, gliding. A glide of 1/λ that is under way
    /// to about this λ ends when it would have, however often an estimate comes; that of the places begins anew.
    pub fn follow(&mut self, wavelength: Wavelength, amplitude_lsb: f32) {
        self.level.follow(amplitude_lsb, self.rate);
        if self.wavelength != Some(wavelength) {
            let before = self.wavelength.replace(wavelength);
            if before.is_some_and(|before| is_another_surface(before, wavelength)) {
                self.wave.forget(self.rate);
            }
            let glide = ticks_at(self.rate, self.glide_ms);
            let left = self.phase.ticks_left();
            let goes_on =
                left > 0 && before.is_some_and(|before| are_about_the_same(before, wavelength));
            self.phase
                .follow(wavelength, if goes_on { left } else { glide });
            // The places scatter with the estimates: glides of one length each keep that from a standing voltage.
            let glide = glide.max(ticks_at(self.rate, LEAST_GLIDE_MS));
            self.pattern.aim(wavelength.phase_per_micrometre(), glide);
        }
        if self.silent {
            self.settle();
        }
    }

    /// Goes over, in [`crate::wave::GLIDE_MS`], to the wave of a sound texture of the surface that is followed. Without a
    /// λ nothing changes.
    pub fn wear(&mut self, texture: &Texture) {
        if let Some(wavelength) = self.wavelength {
            self.wave.follow(texture, wavelength, self.rate);
        }
    }

    /// Goes back to the fundamental alone: nothing is known of the surface but λ.
    pub fn wear_off(&mut self) {
        self.wave.forget(self.rate);
    }

    /// Plays what rubs like this, gliding; None if nothing is known of it.
    pub fn rub(&mut self, friction: Option<Friction>) {
        self.level.rub(friction, self.rate);
    }

    /// How long the period is that the next tick ends.
    pub const fn rate(&self) -> UpdateRate {
        self.rate
    }

    /// One tick in which the hand moved by `travel` counts of 5 µm; `gain` is the supervisor's, in Q31,
    /// 0 to 2³¹. True if any of [`Stimulus::words`] changed.
    pub fn tick(&mut self, travel: i16, gain: u32) -> bool {
        let changed = self.play(travel, gain);
        if self.rate != self.next_rate {
            self.change_rate();
        }
        changed
    }

    /// Not inlined, since it is seldom.
    #[inline(never)]
    fn change_rate(&mut self) {
        let change = RateChange {
            from: self.rate,
            to: self.next_rate,
        };
        self.phase.change_rate(change);
        self.pattern.change_rate(change);
        self.wave.change_rate(change);
        self.level.change_rate(change);
        self.balance.change_rate(change);
        self.rate = self.next_rate;
    }

    fn play(&mut self, travel: i16, gain: u32) -> bool {
        let turned = self.phase.advance(travel);
        self.place_um = self
            .place_um
            .wrapping_add(i32::from(travel) * MICROMETRES_PER_COUNT);
        let gain = self.gain(travel, turned, gain);
        let is_sine = self.is_sine();
        if !is_sine {
            self.wave.tick(travel, self.level.turn(), self.rate);
        }
        if self.silent && gain == 0 {
            self.settle();
            return false;
        }
        self.pattern.glide();
        let (lanes, mut lane_of) = if is_sine {
            (self.pattern.places(), self.pattern.place_of())
        } else {
            (self.skin.lanes(), self.skin.lane_of())
        };
        // In phase they play the same sine, wherever they are.
        let one = lanes == 1 || (is_sine && self.pattern.is_flat());
        let most = self.most_steps();
        let sharing = self.balance.sharing();
        let count = match sharing {
            Sharing::All if one => 1,
            _ => lanes,
        };
        let mut lanes = self.lanes.get_mut(..count).unwrap_or_default();
        let turns = self.phase.turns();
        if is_sine {
            self.skin.play_sine(&self.pattern, turns, lanes);
        } else {
            self.skin
                .play(&self.wave, &self.pattern, turns, self.place_um, lanes);
        }
        if sharing == Sharing::Each {
            part(&mut self.lanes, lane_of);
            lanes = &mut self.lanes;
            lane_of = &EACH;
        }
        let drive = Drive {
            gain: self.level.part_of_full(gain),
            turn: self.level.turn(),
            // The words' own limit is for nothing but a fault of memory.
            most_steps: most - 2,
            rate: self.rate,
        };
        self.balance.remove(lanes, drive);
        let level = (u64::from(self.level.amplitude()) * u64::from(gain)) >> 30;
        let changed = self
            .array
            .draw(level as u32, lanes, lane_of, most, &mut self.words);
        self.silent = gain == 0 && are_silent(&self.words);
        changed
    }

    /// Whether the words are the sine itself, and no wave has to be worked out. Where more is asked for at several places
    /// there is no time to balance each channel by itself: as long as that is needed there is the sine alone.
    fn is_sine(&self) -> bool {
        let is_asked_for =
            self.description.rendering == Rendering::Fundamental && self.skin.is_bare();
        let has_no_time = self.balance.sharing() == Sharing::Each && self.pattern.places() > 1;
        is_asked_for || has_no_time
    }

    /// What all lanes are multiplied with in this tick, in Q30.
    fn gain(&mut self, travel: i16, turned: i32, supervisors: u32) -> u32 {
        self.level.tick(turned, self.rate);
        self.rest.tick(travel, self.rate);
        let open = !self.rest.is_resting() && self.waiting.is_none() && supervisors > 0;
        self.gate.tick(open, self.rate);
        let gain = (u64::from(self.gate.gain()) * u64::from(supervisors)) >> 31;
        ((gain * u64::from(self.level.roll_off(self.rate))) >> 30) as u32
    }

    /// The most that a word changes in a tick.
    const fn most_steps(&self) -> i32 {
        let ticks_per_ms = (self.rate.hz() / 1_000) as i32;
        MOST_V_PER_MS * 65_536 / 10 / ticks_per_ms
    }

    /// Ends what is under way, while nobody feels it.
    fn settle(&mut self) {
        let (lane_of, gains_q30) = (*self.skin.lane_of(), *self.array.gains_q30());
        let before = Channels {
            lane_of: &lane_of,
            gains_q30: &gains_q30,
        };
        if let Some(description) = self.waiting.take() {
            self.array = Array::new(&description.actuators);
            self.pattern = Pattern::new(description.mode, &description.actuators);
            self.skin = Skin::new(description.rendering, &description.actuators, &self.pattern);
            self.wave = Wave::new(description.rendering, scale_behind(&self.skin));
            if let Some(wavelength) = self.wavelength {
                self.pattern.aim(wavelength.phase_per_micrometre(), 1);
            }
            let after = Channels {
                lane_of: self.skin.lane_of(),
                gains_q30: self.array.gains_q30(),
            };
            self.balance.carry(before, after, self.rate);
            self.description = description;
        } else {
            self.balance.meet(before, self.rate);
        }
        self.phase.settle();
        self.level.settle();
        self.wave.settle();
        if self.pattern.is_gliding() {
            self.pattern.settle();
        }
    }

    /// The words of the last tick: [`ZERO_VOLT`] is 0 V, a step 10 V / 65 536.
    pub const fn words(&self) -> &[u16; ACTUATORS] {
        &self.words
    }

    /// The description of the actuators that was asked for last.
    pub fn actuators(&self) -> &[Actuator; ACTUATORS] {
        let asked = self.waiting.as_ref().unwrap_or(&self.description);
        &asked.actuators
    }

    /// Whether what the words are made with still follows from the description of `actuator` in force.
    pub fn follows_from(&self, actuator: usize) -> bool {
        let description = &self.description;
        description
            .actuators
            .get(actuator)
            .is_some_and(|described| {
                self.array.is_of(actuator, described)
                    && self.pattern.is_of(actuator, description.mode, described)
                    && self.skin.is_of(actuator, described, &self.pattern)
            })
    }

    /// Whether the hand rests, see [`Rest`].
    pub const fn is_resting(&self) -> bool {
        self.rest.is_resting()
    }

    /// 0 V at once; goes on from there as after a rest if ticks have a gain again.
    pub fn silence(&mut self) {
        self.words = [ZERO_VOLT; ACTUATORS];
        self.gate.shut();
        self.balance.silence();
        self.silent = true;
    }
}

/// Gives each actuator its lane.
fn part(lanes: &mut [i32; ACTUATORS], lane_of: &[u8; ACTUATORS]) {
    // From the last on: no lane is later than its first actuator.
    for (actuator, lane) in lane_of.iter().enumerate().rev() {
        lanes[actuator] = lanes.get(usize::from(*lane)).copied().unwrap_or(0);
    }
}

/// Behind the wave its voltage may get larger where there is a model.
const fn scale_behind(skin: &Skin) -> Scale {
    if skin.is_bare() {
        Scale::Whole
    } else {
        Scale::Calm
    }
}

/// Not inlined, since it would be worked out for nothing while there is a gain.
#[inline(never)]
fn are_silent(words: &[u16; ACTUATORS]) -> bool {
    words.iter().all(|word| *word == ZERO_VOLT)
}

#[cfg(test)]
mod tests {
    use protocol::Mode;
    use protocol::actuators::DEFAULT_ACTUATORS;

    use super::*;

    #[test]
    fn what_the_words_are_made_with_is_held_against_each_trait_of_an_actuator() {
        let configuration = DisplayConfiguration {
            mode: Mode::Travelling,
            ..DisplayConfiguration::DEFAULT
        };
        let mut actuators = DEFAULT_ACTUATORS;
        actuators[3].resonance_dhz = 900;
        let changes: [fn(&mut Actuator); 6] = [
            |a| a.gain_q15 -= 1,
            |a| a.inverted ^= true,
            |a| a.x_um += 1,
            |a| a.phase ^= 1,
            |a| a.resonance_dhz = 901,
            |a| a.resonance_dhz = 0,
        ];
        for change in changes {
            let mut stimulus = Stimulus::new(&configuration, &actuators);
            assert!((0..ACTUATORS).all(|index| stimulus.follows_from(index)));
            change(&mut stimulus.description.actuators[3]);
            for index in 0..ACTUATORS {
                assert_eq!(stimulus.follows_from(index), index != 3, "{index}");
            }
        }
        assert!(!Stimulus::new(&configuration, &actuators).follows_from(ACTUATORS));
    }

    #[test]
    fn a_glide_ends_in_its_time_however_often_an_estimate_of_that_surface_comes() {
        for update_rate in [UpdateRate::Hz2000, UpdateRate::Hz4000] {
            let configuration = DisplayConfiguration {
                mode: Mode::Travelling,
                update_rate,
                ..DisplayConfiguration::DEFAULT
            };
            let mut stimulus = Stimulus::new(&configuration, &DEFAULT_ACTUATORS);
            let mut hear = |wavelength_mm, ms| {
                let wavelength = Wavelength::new(wavelength_mm).unwrap();
                stimulus.follow(wavelength, 100.0);
                for _ in 0..ticks_at(update_rate, ms) {
                    stimulus.tick(9, 1 << 31);
                }
                let is_there = stimulus.phase.per_count() == wavelength.phase_per_count();
                assert_eq!(is_there, stimulus.phase.ticks_left() == 0);
                (is_there, stimulus.pattern.is_gliding())
            };
            assert_eq!(hear(1.0, 500), (true, false));
            // The wavenumber is there in 20 ms, the places 20 ms after the last one that differs.
            assert_eq!(hear(4.0, 5), (false, true));
            assert_eq!(hear(4.02, 5), (false, true));
            assert_eq!(hear(3.98, 5), (false, true));
            assert_eq!(hear(4.01, 5), (true, true));
            assert_eq!(hear(4.01, 15), (true, false));
            // Another λ takes a whole glide, also from the middle of one.
            assert_eq!(hear(3.0, 15), (false, true));
            assert_eq!(hear(3.4, 15), (false, true));
            assert_eq!(hear(3.4, 5), (true, false));
        }
    }
}
