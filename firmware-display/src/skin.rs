//! From the voltage to the skin and back: what an actuator does to the wave, undone.
//!
//! An actuator on the skin is taken for a second-order system from voltage to displacement,
//! H(s) = ω₀²/(s² + 2ζω₀s + ω₀²), each with its own ω₀ = 2πf₀ and ζ ([`protocol::Actuator::resonance_dhz`]). For the
//! displacement to be g the voltage has to be
//!
//! x = g + (2ζ/ω₀) ġ + (1/ω₀²) g̈
//!
//! The wave is known as a function of phase and place, and so are its derivatives by them; times the frequency and the
//! speed, which are averaged over 4 ms, they are those by the time. So nothing is differentiated, the encoder's steps are
//! not made larger, and nothing comes later than without. It is exact while the hand's speed does not change; what the
//! speed gains within 4 ms is missing.
//!
//! What the voltage may be more than the wave is taken off all actuators, so that they stay alike: the largest
//! [`Model::most`] of them all.
//!
//! Balance and limits come behind it.

use protocol::actuators::Actuator;
use protocol::{ACTUATORS, Rendering};

use crate::grain::STEEPEST;
use crate::level::FALLS_FROM_HZ;
use crate::pattern::Pattern;
use crate::sine::ONE;
use crate::wave::{CALM_PEAK, Wave};

/// What lies between the wave and each actuator's lane.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Which lane each actuator plays.
    lane_of: [u8; ACTUATORS],
    /// So many of what follows are in use.
    lanes: usize,
    /// The place of [`Pattern`] that each lane is at.
    place_of: [u8; ACTUATORS],
    models: [Model; ACTUATORS],
    /// Whether no actuator has a model: each place is a lane then.
    bare: bool,
    /// What all lanes are multiplied with.
    scale: f32,
    /// The amplitude of [`Skin::play_sine`], in Q30.
    sine_q30: i32,
}

/// How far the voltage is ahead of the displacement: 2ζ/f₀ in s and 1/f₀² in s².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Model {
    first: f32,
    second: f32,
}

impl Model {
    fn of(actuator: &Actuator) -> Self {
        if actuator.resonance_dhz == 0 {
            return Self::default();
        }
        let period_s = 10.0 / f32::from(actuator.resonance_dhz);
        Self {
            first: damping(actuator) * 2.0 * period_s,
            second: period_s * period_s,
        }
    }
}

/// ζ
fn damping(actuator: &Actuator) -> f32 {
    f32::from(actuator.damping_percent) / 100.0
}

/// How much larger than the wave the voltage of an actuator gets, and how much steeper than a sine of the wave's peak at
/// 250 Hz, while the wave has nothing above 250 Hz. With w = 250 Hz/f₀:
///
/// * Partials: x = (1 − ζ)(g + u²g″) + ζ(1 + u d/dθ)²g for ζ ≤ 1, with u = f/f₀. Of a g of degree m, m f ≤ 250 Hz,
///   |g″| ≤ m² max |g| (Bernstein), and |g + u g′| ≤ √(1 + m²u²) max |g| (Szegő). So |x| ≤ (1 + w²) max |g|, and for
///   ζ > 1 there is 2(ζ − 1) w more. By Bernstein again x is no steeper than a sine of its size at 250 Hz.
/// * The random part n has the slopes p of [`STEEPEST`]: |x| ≤ (1 + 2ζ p₁ w + p₂ w²) max |n|, and no steeper than a sine
///   of (p₁ + 2ζ p₂ w + p₃ w²) max |n|.
fn most(actuator: &Actuator, rendering: Rendering) -> f32 {
    if actuator.resonance_dhz == 0 {
        return 1.0;
    }
    let zeta = damping(actuator);
    let w = 10.0 * FALLS_FROM_HZ as f32 / f32::from(actuator.resonance_dhz);
    let partials = 1.0 + w * w + 2.0 * (zeta - 1.0).max(0.0) * w;
    if rendering != Rendering::Texture {
        return partials;
    }
    let [first, second, third] = STEEPEST;
    partials
        .max(1.0 + 2.0 * zeta * w * first + w * w * second)
        .max(first + 2.0 * zeta * w * second + w * w * third)
}

/// How much further than with a standing voltage an actuator moves with a sine of the same size, at most: 1/(2ζ √(1 − ζ²))
/// where ζ² < ½, at its resonance. The root is that of its chord, no more than 1.5 % less.
fn resonance(actuator: &Actuator) -> f32 {
    let zeta = damping(actuator);
    if actuator.resonance_dhz == 0 || zeta * zeta >= 0.5 {
        return 1.0;
    }
    let root = 1.0 - (2.0 - core::f32::consts::SQRT_2) * zeta * zeta;
    0.5 / (zeta * root)
}

/// Whether an actuator of these has a model.
pub fn any_is_modelled(actuators: &[Actuator; ACTUATORS]) -> bool {
    actuators.iter().any(|actuator| actuator.resonance_dhz != 0)
}

/// What these actuators' displacement is of the wave, so that no voltage gets larger than the wave: 1 where none has a model.
pub fn scale(rendering: Rendering, actuators: &[Actuator; ACTUATORS]) -> f32 {
    let most = |actuator| most(actuator, rendering);
    1.0 / actuators.iter().map(most).fold(1.0, f32::max)
}

impl Skin {
    /// The lanes of these actuators, which lie as `pattern` says.
    pub fn new(rendering: Rendering, actuators: &[Actuator; ACTUATORS], pattern: &Pattern) -> Self {
        let mut skin = Self {
            lane_of: *pattern.place_of(),
            lanes: pattern.places(),
            place_of: [0; ACTUATORS],
            models: [Model::default(); ACTUATORS],
            bare: !any_is_modelled(actuators),
            scale: 1.0,
            sine_q30: 1 << 30,
        };
        if skin.bare {
            return skin;
        }
        skin.lanes = 0;
        for (index, actuator) in actuators.iter().enumerate() {
            let place = pattern.place_of()[index];
            skin.lane_of[index] = skin.lane_for(place, Model::of(actuator)) as u8;
        }
        skin.scale = scale(rendering, actuators);
        let highest = actuators.iter().map(resonance).fold(1.0, f32::max);
        skin.sine_q30 = (CALM_PEAK * skin.scale / highest * (1_u32 << 30) as f32) as i32;
        skin
    }

    /// The lane of a model at a place; a new one if there is none.
    fn lane_for(&mut self, place: u8, model: Model) -> usize {
        let lanes = self.place_of.iter().zip(&self.models);
        let found = lanes
            .take(self.lanes)
            .position(|lane| lane == (&place, &model));
        found.unwrap_or_else(|| {
            let lane = self.lanes;
            self.place_of[lane] = place;
            self.models[lane] = model;
            self.lanes += 1;
            lane
        })
    }

    /// How many lanes are worked out, 1 to [`ACTUATORS`].
    pub const fn lanes(&self) -> usize {
        self.lanes
    }

    /// Which lane each actuator plays.
    pub const fn lane_of(&self) -> &[u8; ACTUATORS] {
        &self.lane_of
    }

    /// Whether no actuator has a model.
    pub const fn is_bare(&self) -> bool {
        self.bare
    }

    /// Whether lane and model of one actuator, of those there are, follow from its description.
    pub fn is_of(&self, index: usize, actuator: &Actuator, pattern: &Pattern) -> bool {
        let (lane, place) = (self.lane_of[index], pattern.place_of()[index]);
        if self.bare {
            return actuator.resonance_dhz == 0 && lane == place;
        }
        let lane = usize::from(lane);
        lane < self.lanes
            && self.place_of.get(lane) == Some(&place)
            && self.models.get(lane) == Some(&Model::of(actuator))
    }

    /// The sine alone at each place, in Q28, without models: as large as it can be so that no actuator moves further than
    /// [`Skin::play`] lets it.
    pub fn play_sine(&self, pattern: &Pattern, turns: u32, places: &mut [i32]) {
        pattern.sines(turns, places);
        if !self.bare {
            for place in places {
                *place = ((i64::from(*place) * i64::from(self.sine_q30)) >> 30) as i32;
            }
        }
    }

    /// The lanes in Q28, within ± [`ONE`], with `turns` / 2³² and `place_um` in the fingertip's middle.
    pub fn play(
        &self,
        wave: &Wave,
        pattern: &Pattern,
        turns: u32,
        place_um: i32,
        lanes: &mut [i32],
    ) {
        let places = pattern
            .iter()
            .map(|(ahead, x_um)| (turns.wrapping_add(ahead), place_um.wrapping_add(x_um)));
        if self.bare {
            for (lane, (turns, place_um)) in lanes.iter_mut().zip(places) {
                *lane = fixed(wave.at(turns, place_um));
            }
            return;
        }
        let mut derivatives = [[0.0; 3]; ACTUATORS];
        for (derivatives, (turns, place_um)) in derivatives.iter_mut().zip(places) {
            *derivatives = wave
                .derivatives(turns, place_um)
                .map(|derivative| self.scale * derivative);
        }
        let models = self.place_of.iter().zip(&self.models);
        for (lane, (place, model)) in lanes.iter_mut().zip(models) {
            let [value, first, second] = derivatives
                .get(usize::from(*place))
                .copied()
                .unwrap_or_default();
            *lane = fixed(value + model.first * first + model.second * second);
        }
    }
}

/// In Q28.
#[inline]
fn fixed(value: f32) -> i32 {
    (value.clamp(-1.0, 1.0) * ONE as f32) as i32
}

#[cfg(test)]
mod tests {
    use protocol::Mode;
    use protocol::actuators::DEFAULT_ACTUATORS;

    use super::*;

    fn modelled(resonance_dhz: u16, damping_percent: u16) -> Actuator {
        Actuator {
            resonance_dhz,
            damping_percent,
            ..DEFAULT_ACTUATORS[0]
        }
    }

    #[test]
    fn the_voltage_is_made_no_smaller_than_its_bounds_ask_for() {
        use Rendering::{Fundamental, Shape, Texture};
        for (rendering, resonance_dhz, damping_percent, bound) in [
            (Texture, 0, 50, 1.0),
            // w = 1, ζ = 0.5: 1 + w².
            (Fundamental, 2_500, 50, 2.0),
            // w = 2.5, ζ = 1.5: and 2 (ζ − 1) w more.
            (Shape, 1_000, 150, 9.75),
            // w = 0.25, ζ = 2: the random part's size, 1 + 2ζ 0.59 w + 0.71 w².
            (Texture, 10_000, 200, 1.634_375),
            // w = 2.5, ζ = 2: its slope, 0.59 + 2ζ 0.71 w + 1.23 w².
            (Texture, 1_000, 200, 15.377_5),
        ] {
            let found = most(&modelled(resonance_dhz, damping_percent), rendering);
            assert!((found / bound - 1.0).abs() < 1e-6, "{found} for {bound}");
        }
    }

    #[test]
    fn a_lane_is_told_from_that_of_another_place_or_model() {
        let mut actuators = DEFAULT_ACTUATORS;
        let pattern = Pattern::new(Mode::Travelling, &actuators);
        let other = Pattern::new(Mode::Uniform, &actuators);
        let bare = Skin::new(Rendering::Shape, &actuators, &pattern);
        actuators[7] = Actuator {
            resonance_dhz: 900,
            ..actuators[7]
        };
        let skin = Skin::new(Rendering::Shape, &actuators, &pattern);
        assert_eq!(skin.lanes(), pattern.places() + 1);
        for (index, actuator) in actuators.iter().enumerate() {
            assert!(skin.is_of(index, actuator, &pattern), "{index}");
            // The place of all in a uniform wave is the first one's.
            let at_first = pattern.place_of()[index] == other.place_of()[index];
            assert_eq!(skin.is_of(index, actuator, &other), at_first, "{index}");
            assert_eq!(bare.is_of(index, actuator, &pattern), index != 7, "{index}");
            let twin = Actuator {
                resonance_dhz: 901,
                ..*actuator
            };
            assert!(!skin.is_of(index, &twin, &pattern), "{index}");
        }
        // A lane behind the last one is at the first place and has no model, too.
        let mut changed = skin.clone();
        changed.lane_of[0] = skin.lanes() as u8;
        assert!(!changed.is_of(0, &actuators[0], &pattern));
        let mut changed = bare;
        changed.lane_of[0] = 1;
        assert!(!changed.is_of(0, &DEFAULT_ACTUATORS[0], &pattern));
    }
}
