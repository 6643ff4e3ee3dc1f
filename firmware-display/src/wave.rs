//! The surface's wave as it is played: its fundamental, its partials, and what does not repeat.
//!
//! g = s · (sin θ + Σ rₙ ρₙ sin(nθ + φₙ) + Σ ℓ_b ρ_b n_b(x))
//!
//! with the phase θ of [`crate::phase`], ratios rₙ, phases φₙ and levels ℓ_b of [`Texture`], and the random bands n_b of
//! [`crate::grain`] at the place x of the hand, and of the actuator in travelling mode. Nothing here knows the time but
//! the glides and the roll-offs ρ, so a stroke that is reversed plays the wave back to the bit.
//!
//! | what | why |
//! | --- | --- |
//! | a partial fades from n f = 200 Hz to 0 at 250 Hz, a band where its upper end does | the degree m of what is left has m f ≤ 250 Hz, and by Bernstein's inequality \|g′\| ≤ m max \|g\| nothing slews by more than a sine of 250 Hz; a band does so by [`crate::grain::STEEPEST`] |
//! | s is such that \|g\| ≤ 1 and the energy is no more than the sine's, see [`Scale`] | whichever ρ are at work: g is a sum in which each only makes one term smaller |
//! | all coefficients go over to new ones linearly, in [`GLIDE_MS`] | no voltage jumps, and a mixture of two waves that keep a bound keeps it |
//! | a band whose longest wave is longer than 2.5 λ is not played, and fades from 2 λ on | it would make more charge than [`crate::balance`] lets alone |

use protocol::texture::{BANDS, LOWEST_BAND_PER_MM, PARTIALS, measured};
use protocol::{Rendering, Texture, UpdateRate};

use crate::grain;
use crate::level::FALLS_FROM_HZ;
use crate::pace::RateChange;
use crate::phase::{TURN, Wavelength};
use crate::sine::{ONE, sine};
use crate::{MICROMETRES_PER_COUNT, ticks_at};

/// Time in which the wave goes over to that of a new texture.
pub const GLIDE_MS: u16 = 50;
/// From this frequency on a partial, or the upper end of a band, fades, to 0 at [`FALLS_FROM_HZ`].
pub const FADES_FROM_HZ: u32 = 200;
/// The peak that keeps the energy limit whatever the hand does: 0.84² · 25 V² are 17.6 V², as much as a sine makes under
/// the worst hand, which swings to and fro over ±0.3 λ.
pub const CALM_PEAK: f32 = 0.84;
/// What such a hand makes of a sine: 5 V times this is the root of 17.5 V².
const SWINGING_SINE: f32 = 0.836_7;
/// What ∫ g dθ may vary by: the sine has 2, and the balance gives it [`crate::balance::MARGIN`] times that. The rest is
/// for the encoder's counts.
const MOST_CHARGE: f32 = 0.9 * 2.0 * crate::balance::MARGIN as f32;

/// Places of a wave at which its peak is looked for.
const PLACES: usize = 32;
/// What the peak between these places may be more: 1/cos(π m/N) for a polynomial of degree m (Ehlich and Zeller 1964),
/// here of 2 and of 3.
const BETWEEN: [f32; PARTIALS] = [1.019_6, 1.045_1];
/// The turn from one of these places to the next.
const NEXT: (f32, f32) = (0.195_090_32, 0.980_785_3);

/// The speed is averaged over so many ticks of 2 kHz, as a power of two, as the frequency is in [`crate::level`].
const SHIFT: u32 = 3;
/// Fraction bits of the averaged travel.
const FRACTION: u32 = 12;

/// What the coefficients are: the fundamental's, real and imaginary part of each partial's, each band's.
const COEFFICIENTS: usize = 1 + 2 * PARTIALS + BANDS;

/// The wave, on its way to what was told last.
#[derive(Clone, Debug, PartialEq)]
pub struct Wave {
    rendering: Rendering,
    scale: Scale,
    now: [f32; COEFFICIENTS],
    target: [f32; COEFFICIENTS],
    per_tick: [f32; COEFFICIENTS],
    ticks_left: u32,
    /// The hand's travel a tick, averaged, in counts of Q12.
    travel: i32,
    played: Played,
}

/// How the wave is brought to its amplitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// The fundamental alone is whole, and what is added to it takes away as much as it adds at most: the energy under
    /// the worst hand is no more than the sine's 17.5 V² by the triangle inequality, or, where that lets it be stronger,
    /// no more than 17.6 V² because |g| ≤ [`CALM_PEAK`].
    #[default]
    Whole,
    /// |g| ≤ [`CALM_PEAK`] always: for what goes through something else on its way to the actuators.
    Calm,
}

/// What is played in a tick, roll-offs included, over the amplitude.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Played {
    /// s
    pub fundamental: f32,
    /// s rₙ ρₙ cos φₙ and s rₙ ρₙ sin φₙ.
    pub partials: [(f32, f32); PARTIALS],
    /// s ℓ_b ρ_b, over [`grain::RMS`].
    pub bands: [f32; BANDS],
    /// The wave's frequency in Hz, and the hand's speed in mm/s over 2π, negative backwards.
    hz: f32,
    speed: f32,
}

impl Wave {
    /// The fundamental alone.
    pub fn new(rendering: Rendering, scale: Scale) -> Self {
        let mut wave = Self {
            rendering,
            scale,
            now: [0.0; COEFFICIENTS],
            target: [0.0; COEFFICIENTS],
            per_tick: [0.0; COEFFICIENTS],
            ticks_left: 0,
            travel: 0,
            played: Played::default(),
        };
        wave.target = wave.plain();
        wave.settle();
        wave
    }

    /// Goes over to the wave of a sound texture of a surface of this λ.
    pub fn follow(&mut self, texture: &Texture, wavelength: Wavelength, rate: UpdateRate) {
        let target = match self.rendering {
            Rendering::Fundamental => return,
            Rendering::Shape => self.coefficients(texture, [0.0; BANDS], wavelength),
            Rendering::Texture => {
                self.coefficients(texture, levels(texture, wavelength), wavelength)
            }
        };
        self.aim(target, rate);
    }

    /// Goes back to the fundamental alone.
    pub fn forget(&mut self, rate: UpdateRate) {
        let plain = self.plain();
        if self.target != plain {
            self.aim(plain, rate);
        }
    }

    /// Ticks last another time from now on.
    pub fn change_rate(&mut self, change: RateChange) {
        self.glide(change.ticks(self.ticks_left));
        self.travel = change.a_tick(self.travel);
    }

    /// Is there at once: for when nobody feels it.
    pub const fn settle(&mut self) {
        self.now = self.target;
        self.ticks_left = 0;
    }

    fn plain(&self) -> [f32; COEFFICIENTS] {
        let mut plain = [0.0; COEFFICIENTS];
        plain[0] = match self.scale {
            Scale::Whole => 1.0,
            Scale::Calm => CALM_PEAK,
        };
        plain
    }

    fn aim(&mut self, target: [f32; COEFFICIENTS], rate: UpdateRate) {
        self.target = target;
        self.glide(ticks_at(rate, GLIDE_MS));
    }

    /// Is there after `ticks` ticks, by equal steps; nothing changes with none.
    fn glide(&mut self, ticks: u32) {
        self.ticks_left = ticks;
        if ticks == 0 {
            return;
        }
        let part = 1.0 / ticks as f32;
        for ((step, target), now) in self.per_tick.iter_mut().zip(&self.target).zip(&self.now) {
            *step = (target - now) * part;
        }
    }

    fn coefficients(
        &self,
        texture: &Texture,
        levels: [f32; BANDS],
        wavelength: Wavelength,
    ) -> [f32; COEFFICIENTS] {
        let ratio = |partial: usize| measured(texture.partials[partial].ratio).unwrap_or(0.0);
        let partials = core::array::from_fn(|partial| {
            let phase = u32::from(texture.partials[partial].phase) << 16;
            (
                ratio(partial) * cosine_of(phase),
                ratio(partial) * sine_of(phase),
            )
        });
        let grain_peak: f32 = levels.iter().map(|level| level * grain::PEAK).sum();
        let calm = CALM_PEAK / (peak(&partials) + grain_peak);
        let scale = match self.scale {
            Scale::Calm => calm,
            Scale::Whole => {
                let added = ratio(0) + ratio(1) + grain_peak;
                calm.max(1.0 / (1.0 + added / SWINGING_SINE))
            }
        };
        let radians_per_mm = core::f32::consts::TAU / wavelength.mm();
        let grain_charge: f32 = (levels.iter().enumerate())
            .map(|(band, level)| level * grain::CHARGE * grain::spacing_mm(band) * radians_per_mm)
            .sum();
        // A partial's own charge is its amplitude's, twice over n.
        let charge = 2.0 + ratio(0) + ratio(1) * (2.0 / 3.0) + grain_charge;
        let scale = scale.min(MOST_CHARGE / charge);
        let [(re2, im2), (re3, im3)] = partials;
        let [b0, b1, b2, b3] = levels;
        [1.0, re2, im2, re3, im3, b0, b1, b2, b3].map(|coefficient| scale * coefficient)
    }

    /// One tick in which the hand moved by `travel` counts, while the wave turns by `turn` / 2³² a tick on average.
    pub fn tick(&mut self, travel: i16, turn: i32, rate: UpdateRate) {
        match self.ticks_left {
            0 => {}
            1 => self.settle(),
            _ => {
                for (now, step) in self.now.iter_mut().zip(&self.per_tick) {
                    *now += step;
                }
                self.ticks_left -= 1;
            }
        }
        let shift = match rate {
            UpdateRate::Hz2000 => SHIFT,
            UpdateRate::Hz4000 => SHIFT + 1,
        };
        self.travel += ((i32::from(travel) << FRACTION) - self.travel) >> shift;
        const MM_PER_COUNT: f32 = MICROMETRES_PER_COUNT as f32 / 1_000.0 / (1 << FRACTION) as f32;
        let tick_hz = rate.hz() as f32;
        let speed_mm_s = self.travel as f32 * (MM_PER_COUNT * tick_hz);
        let hz = turn as f32 * (tick_hz * (1.0 / TURN as f32));
        let most = FALLS_FROM_HZ as f32;
        let [a, re2, im2, re3, im3, bands @ ..] = self.now;
        let (second, third) = (roll_off(2.0 * hz), roll_off(3.0 * hz));
        self.played = Played {
            fundamental: a,
            partials: [(re2 * second, im2 * second), (re3 * third, im3 * third)],
            bands,
            hz: hz.clamp(-most, most),
            speed: speed_mm_s * (1.0 / core::f32::consts::TAU),
        };
        for (band, level) in self.played.bands.iter_mut().enumerate() {
            if *level != 0.0 {
                *level *= roll_off(speed_mm_s * grain::upper_end_per_mm(band));
            }
        }
    }

    /// What it is made of in this tick.
    pub const fn played(&self) -> &Played {
        &self.played
    }

    /// The wave where it is at `turns` / 2³², with the surface at `place_um`, within ± 1.
    #[inline]
    pub fn at(&self, turns: u32, place_um: i32) -> f32 {
        let Played {
            fundamental,
            partials: [(re2, im2), (re3, im3)],
            bands,
            ..
        } = &self.played;
        let [(s1, _), (s2, c2), (s3, c3)] = multiples(turns);
        fundamental * s1
            + (re2 * s2 + im2 * c2)
            + (re3 * s3 + im3 * c3)
            + grain::value(bands, place_um)
    }

    /// The same and, as long as the hand goes on as fast as it does, its first and second derivative by the time, over
    /// 2π and over (2π)²: in 1/s and 1/s².
    #[inline]
    pub fn derivatives(&self, turns: u32, place_um: i32) -> [f32; 3] {
        let Played {
            fundamental,
            partials: [(re2, im2), (re3, im3)],
            bands,
            hz,
            speed,
        } = &self.played;
        let [(s1, c1), (s2, c2), (s3, c3)] = multiples(turns);
        let (first, second, third) = (fundamental * s1, re2 * s2 + im2 * c2, re3 * s3 + im3 * c3);
        let slope = fundamental * c1 + 2.0 * (re2 * c2 - im2 * s2) + 3.0 * (re3 * c3 - im3 * s3);
        let bend = -(first + 4.0 * second + 9.0 * third);
        let [grain, grain_slope, grain_bend] = grain::derivatives(bands, place_um);
        [
            first + second + third + grain,
            hz * slope + speed * grain_slope,
            hz * hz * bend + speed * speed * grain_bend,
        ]
    }
}

/// Levels of the bands over [`grain::RMS`], of those that are not too long for the balance.
fn levels(texture: &Texture, wavelength: Wavelength) -> [f32; BANDS] {
    let mut levels = texture
        .bands
        .map(|band| measured(band).unwrap_or(0.0) * (1.0 / grain::RMS));
    let mut longest_mm = 1.0 / LOWEST_BAND_PER_MM;
    for level in &mut levels {
        *level *= (5.0 - 2.0 * longest_mm / wavelength.mm()).clamp(0.0, 1.0);
        longest_mm /= 2.0;
    }
    levels
}

/// The gain of what has a frequency of `hz`.
#[inline]
fn roll_off(hz: f32) -> f32 {
    const WIDTH: f32 = (FALLS_FROM_HZ - FADES_FROM_HZ) as f32;
    ((FALLS_FROM_HZ as f32 - hz.abs()) * (1.0 / WIDTH)).clamp(0.0, 1.0)
}

#[inline]
fn sine_of(turns: u32) -> f32 {
    sine(turns) as f32 * (1.0 / ONE as f32)
}

#[inline]
fn cosine_of(turns: u32) -> f32 {
    sine_of(turns.wrapping_add(1 << 30))
}

/// Sine and cosine of once, twice and three times the angle.
#[inline]
fn multiples(turns: u32) -> [(f32, f32); 1 + PARTIALS] {
    of_multiples(sine_of(turns), cosine_of(turns))
}

#[inline]
fn of_multiples(s: f32, c: f32) -> [(f32, f32); 1 + PARTIALS] {
    let square = s * s;
    [
        (s, c),
        (2.0 * s * c, 1.0 - 2.0 * square),
        (s * (3.0 - 4.0 * square), c * (1.0 - 4.0 * square)),
    ]
}

/// No less than the largest value of sin θ with both partials, either or none of them: between these the wave is a
/// mixture of them.
fn peak(partials: &[(f32, f32); PARTIALS]) -> f32 {
    let [(re2, im2), (re3, im3)] = partials;
    let (mut s, mut c) = (0.0_f32, 1.0_f32);
    let mut peaks = [0.0_f32; PARTIALS];
    for _ in 0..PLACES {
        let [(s1, _), (s2, c2), (s3, c3)] = of_multiples(s, c);
        let (second, third) = (re2 * s2 + im2 * c2, re3 * s3 + im3 * c3);
        peaks[0] = peaks[0].max((s1 + second).abs());
        peaks[1] = peaks[1]
            .max((s1 + third).abs())
            .max((s1 + second + third).abs());
        (s, c) = (s * NEXT.1 + c * NEXT.0, c * NEXT.1 - s * NEXT.0);
    }
    // The sine alone has 1.
    (peaks[0] * BETWEEN[0]).max(peaks[1] * BETWEEN[1]).max(1.0)
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use protocol::Partial;
    use protocol::texture::NOT_MEASURED;

    use super::*;

    const RATE: UpdateRate = UpdateRate::Hz2000;

    fn wavelength(mm: f32) -> Wavelength {
        Wavelength::new(mm).unwrap()
    }

    fn texture(ratios: [u16; 2], phases: [u16; 2], bands: [u16; BANDS]) -> Texture {
        Texture {
            valid: true,
            partials: core::array::from_fn(|n| Partial {
                ratio: ratios[n],
                phase: phases[n],
            }),
            bands,
            ..Texture::default()
        }
    }

    /// Textures of all kinds, as if at random.
    fn textures() -> impl Iterator<Item = Texture> {
        let mut random = 7_u32;
        let mut next = move || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            random >> 8
        };
        let mut ratio = move || match next() % 4 {
            0 => 0,
            1 => next() % 300,
            2 => next() % 1_500,
            _ => next() % 10_001,
        } as u16;
        (0..2_000).map(move |index| {
            let bands = match index % 3 {
                0 => [0; BANDS],
                _ => core::array::from_fn(|_| ratio()),
            };
            let phases = [ratio().wrapping_mul(6_553), ratio().wrapping_mul(6_551)];
            texture([ratio(), ratio()], phases, bands)
        })
    }

    /// A wave that has gone over to this texture, on a hand that moves by `counts`.
    fn worn(texture: &Texture, scale: Scale, wavelength_mm: f32, counts: i16) -> Wave {
        let mut wave = Wave::new(Rendering::Texture, scale);
        wave.follow(texture, wavelength(wavelength_mm), RATE);
        let turn = f64::from(counts) * 0.005 / f64::from(wavelength_mm) * TURN;
        (0..300).for_each(|_| wave.tick(counts, turn as i32, RATE));
        wave
    }

    fn value(wave: &Wave, turns: u32, place_um: i32) -> f32 {
        wave.at(turns, place_um)
    }

    #[test]
    fn what_was_not_measured_is_not_played() {
        let told = texture(
            [NOT_MEASURED, 300],
            [7, 11_111],
            [0, NOT_MEASURED, 300, NOT_MEASURED],
        );
        let known = texture([0, 300], [0, 11_111], [0, 0, 300, 0]);
        let [told, known] = [told, known].map(|of| worn(&of, Scale::Whole, 4.0, 1));
        assert_eq!(told.target, known.target);
    }

    #[test]
    fn whatever_the_texture_is_its_charge_has_room_beside_the_balances_margin() {
        let mut closest = 0.0_f32;
        for texture in textures() {
            for mm in [0.6, 0.9, 1.3, 2.0, 2.8, 4.0, 5.6, 8.0] {
                let mut wave = Wave::new(Rendering::Texture, Scale::Whole);
                wave.follow(&texture, wavelength(mm), RATE);
                let [a, re2, im2, re3, im3, bands @ ..] = wave.target;
                let grain: f32 = (bands.iter().enumerate())
                    .map(|(band, level)| level * grain::CHARGE * grain::spacing_mm(band))
                    .sum();
                let charge = 2.0 * a
                    + re2.hypot(im2)
                    + re3.hypot(im3) * (2.0 / 3.0)
                    + grain * core::f32::consts::TAU / mm;
                closest = closest.max(charge / MOST_CHARGE);
            }
        }
        assert!((0.99..1.001).contains(&closest), "{closest}");
    }

    #[test]
    fn another_wave_is_reached_exactly_and_speed_is_averaged_as_long_at_both_rates() {
        let texture = texture([3_333, 1_777], [1_234, 43_210], [77, 55, 33, 11]);
        let travels = [UpdateRate::Hz2000, UpdateRate::Hz4000].map(|rate| {
            let mut wave = Wave::new(Rendering::Texture, Scale::Whole);
            wave.follow(&texture, wavelength(2.0), rate);
            let ticks_of = |ms: u32| ms * rate.hz() / 1_000;
            (0..ticks_of(4)).for_each(|_| wave.tick(16, 0, rate));
            let travel = wave.travel;
            (0..ticks_of(1_000)).for_each(|_| wave.tick(16, 0, rate));
            assert_eq!(wave.now, wave.target, "{rate:?}");
            travel
        });
        // After 4 ms, 1 − 1/e and a little more of it.
        for travel in travels {
            let share = f64::from(travel) / f64::from(16 << FRACTION);
            assert!((0.6..0.68).contains(&share), "{travels:?}");
        }
    }

    #[test]
    fn whatever_the_texture_is_the_wave_keeps_its_bounds() {
        for texture in textures() {
            for scale in [Scale::Whole, Scale::Calm] {
                // All of it is played, partials alone, and the sine alone.
                for counts in [1, 40, 70, 90] {
                    let wave = worn(&texture, scale, 2.0, counts);
                    let values = (0..96_u32).map(|i| {
                        let shape = value(&wave, i.wrapping_mul(44_739_243), 0);
                        let grain: f32 = wave.played.bands.iter().sum::<f32>() * grain::PEAK;
                        shape.abs() + grain
                    });
                    let most = values.fold(0.0, f32::max);
                    let bound = match scale {
                        Scale::Whole => 1.0,
                        Scale::Calm => CALM_PEAK,
                    };
                    assert!(most <= bound + 1e-6, "{texture:?} {scale:?}: {most}");
                }
            }
        }
    }

    /// The energy under a hand that spends its time at any places of the wave is a mean of g² over them. For the sine and
    /// a hand that swings it is 17.5 V² at most. What is added to the sine may add its own peak to the root of that.
    #[test]
    fn the_energy_is_the_sines_whatever_hand_swings() {
        let measures: std::vec::Vec<std::vec::Vec<u32>> = (0..40)
            .map(|swing| {
                let (half, middle) = (
                    0.02 + 0.05 * f64::from(swing % 20),
                    0.25 * f64::from(swing / 20),
                );
                (0..64)
                    .map(|i| {
                        let turns = middle + half * (TAU * f64::from(i) / 64.0).sin();
                        (turns.rem_euclid(1.0) * TURN) as u32
                    })
                    .collect()
            })
            .collect();
        let energy_v2 = |wave: &Wave, places: &[u32]| {
            let squares = places
                .iter()
                .map(|&turns| (5.0 * value(wave, turns, 0)).powi(2));
            squares.sum::<f32>() / places.len() as f32
        };
        // About a crest the balance is at work.
        let sine = worn(&texture([0, 0], [0, 0], [0; BANDS]), Scale::Whole, 2.0, 1);
        let measures: std::vec::Vec<_> = measures
            .into_iter()
            .filter(|places| energy_v2(&sine, places) <= 17.55)
            .collect();
        assert!(measures.len() > 20);
        for texture in textures().step_by(8) {
            let texture = Texture {
                bands: [0; BANDS],
                ..texture
            };
            let wave = worn(&texture, Scale::Whole, 2.0, 1);
            for places in &measures {
                let energy_v2 = energy_v2(&wave, places);
                assert!(energy_v2 <= 17.65, "{texture:?}: {energy_v2} V²");
            }
        }
    }

    #[test]
    fn no_partials_make_more_charge_than_the_sine() {
        for texture in textures().filter(|texture| texture.bands == [0; BANDS]) {
            for (counts, played) in [(1, [1.0, 1.0]), (90, [0.0, 0.0])] {
                let wave = worn(&texture, Scale::Whole, 2.0, counts);
                let (mut charge, mut low, mut high) = (0.0_f64, 0.0_f64, 0.0_f64);
                for i in 0..720_u32 {
                    let turns = (f64::from(i) / 720.0 * TURN) as u32;
                    charge += f64::from(value(&wave, turns, 0)) * TAU / 720.0;
                    (low, high) = (low.min(charge), high.max(charge));
                }
                assert!(high - low <= 2.01, "{texture:?} {played:?}: {}", high - low);
            }
        }
    }

    #[test]
    fn long_bands_are_left_out_and_the_others_keep_the_charge_within_the_balances_room() {
        let told = texture([0, 0], [0, 0], [500; BANDS]);
        for (wavelength_mm, played) in [(1.0, [false, false, true, true]), (4.0, [true; BANDS])] {
            let wave = worn(&told, Scale::Whole, wavelength_mm, 1);
            assert_eq!(wave.played.bands.map(|level| level > 0.0), played);
            let radians = core::f32::consts::TAU / wavelength_mm;
            let grain: f32 = (wave.played.bands.iter().enumerate())
                .map(|(band, level)| level * grain::CHARGE * grain::spacing_mm(band) * radians)
                .sum();
            let charge = 2.0 * wave.played.fundamental + grain;
            assert!(charge <= 2.0 * crate::balance::MARGIN as f32, "{charge}");
        }
    }

    #[test]
    fn a_reversed_stroke_plays_the_wave_back_to_the_bit() {
        use crate::phase::Phase;
        let told = texture([700, 300], [11_111, 50_000], [300; BANDS]);
        let mut wave = worn(&told, Scale::Whole, 2.0, 6);
        let mut phase = Phase::default();
        phase.follow(wavelength(2.0), 0);
        let mut place_um = 0;
        let mut step = |counts: i16, wave: &mut Wave| {
            wave.tick(counts, phase.advance(counts), RATE);
            place_um += i32::from(counts) * MICROMETRES_PER_COUNT;
            value(wave, phase.turns(), place_um).to_bits()
        };
        let counts = |tick: i32| (tick % 11 - 2) as i16;
        let there: std::vec::Vec<u32> = (0..4_000)
            .map(|tick| step(counts(tick), &mut wave))
            .collect();
        for tick in (1..4_000).rev() {
            assert_eq!(step(-counts(tick), &mut wave), there[tick as usize - 1]);
        }
    }

    #[test]
    fn the_derivatives_are_those_of_the_wave() {
        let told = texture([700, 300], [11_111, 50_000], [300; BANDS]);
        for counts in [1, -1] {
            let wave = worn(&told, Scale::Whole, 4.0, counts);
            let at = |tick: i32| {
                let turns = (tick * i32::from(counts)) as u32;
                let turned = turns.wrapping_mul((TURN * 0.005 / 4.0) as u32);
                wave.derivatives(turned, turns as i32 * 5).map(f64::from)
            };
            let per_tick = TAU / f64::from(RATE.hz());
            for tick in 1..2_000 {
                let [before, here, after] = [tick - 1, tick, tick + 1].map(at);
                for order in 0..2 {
                    let slope = (after[order] - before[order]) / 2.0 / per_tick;
                    // 5 µm a tick is little of 0.5 mm.
                    let most = [0.1, 3.0][order];
                    assert!(
                        (slope - here[order + 1]).abs() <= most,
                        "{order} {tick}: {slope} {here:?}"
                    );
                }
            }
        }
    }
}
