//! What the surface is besides λ: the partials of its wave, what does not repeat, how it rubs.
//!
//! ```text
//! touches ─> knots of equal travel ─> a block of three waves ─> least squares ─┬─> partials ──> averages ─> Texture
//!                                                                               └─> what is left ─> spectrum ─┘
//! ```
//!
//! A block is 48 knots over three waves, or 6 mm if that is more, one way. Constant, slope and three partials are
//! fitted to each gauge at λ̂. The places where a wave begins under each gauge are of no interest, so each gauge's
//! partials are taken relative to its own fundamental: of Zₙ = Aₙ e^(iαₙ) counts Zₙ (Z̄₁/|Z₁|)ⁿ, which no shift of place
//! changes. An error of λ̂ shifts all of a block alike, and drops out too. Weighed by the fundamental's amplitude and
//! averaged over blocks and gauges that is unbiased. Before gauges are summed, one that feels the wave upside down is
//! turned over, if that shows by more than chance.
//!
//! What is left of one gauge after the fit has a spectrum over wavenumber; the noise of the gauge is white in time, so
//! of a known density in wavenumber at a known speed, and is taken off.
//!
//! Only what the sensor feels counts: a partial beyond [`HIGHEST_HZ`] in a block is left out of its average, and one that
//! was so in all of them is told as not measured, as is a band.

mod averages;
mod block;
mod friction;
mod partial;
mod rest;

use protocol::texture::{NOT_MEASURED, PARTIALS, UNITY};
use protocol::{GAUGES, Texture};

use crate::SAMPLE_RATE_HZ;
use crate::estimator::{Finding, MIN_AMPLITUDE_LSB, Touch};
use crate::float::sqrt;
use crate::travel::{PLACES_PER_MM, PLACES_PER_UM, Place};
use averages::Averages;
use block::Block;
use friction::Rub;
use partial::{PartialSum, in_units};
use rest::Rest;

/// Textures a second.
pub const TEXTURE_RATE_HZ: u32 = 20;
/// The highest frequency in Hz at which a partial, or a band, is believed: above, the sensor's resonance and the
/// anti-aliasing filter are.
pub const HIGHEST_HZ: f32 = 200.0;

/// Wavelengths in a block, and the least travel in mm, so that the lowest band has a line in its spectrum.
const BLOCK_WAVES: f32 = 3.0;
/// See [`BLOCK_WAVES`].
const BLOCK_MM: f32 = 6.0;
/// Blocks of a surface from which on its texture is stood by.
const ENOUGH_BLOCKS: f32 = 2.0;
/// λ̂ that differs by more than this share is another surface.
const ANOTHER: f32 = 0.05;
/// Who has gone back by more than this has turned: three counts of the encoder.
const BACK: Place = 15 * PLACES_PER_UM;

/// A complex number.
type Complex = [f32; 2];

/// The way that arm or contact go.
#[derive(Clone, Copy, Debug, Default)]
struct Course {
    back: bool,
    /// Furthest place that way.
    furthest: Place,
}

impl Course {
    /// How far `place` is ahead of all before.
    fn ahead(&self, place: Place) -> Place {
        let ahead = place.wrapping_sub(self.furthest);
        if self.back { -ahead } else { ahead }
    }

    /// Takes where it is.
    fn go(&mut self, place: Place) {
        let ahead = self.ahead(place);
        if ahead < -BACK {
            self.turn(place);
        } else if ahead > 0 {
            self.furthest = place;
        }
    }

    /// Turns at `place`.
    const fn turn(&mut self, place: Place) {
        self.back = !self.back;
        self.furthest = place;
    }
}

/// What the sensor makes of the surface besides λ.
#[derive(Clone, Debug)]
pub struct Surface {
    /// λ̂ in mm while it is stood by, else what it was last; 0 before.
    wavelength_mm: f32,
    /// Phase of a place, in 2⁻³² cycles.
    increment: u32,
    stood_by: bool,
    /// Where the last touch was, none before the first.
    last: Option<Place>,
    arm: Course,
    contact: Course,
    /// Phase at the last touch, in 2⁻³² cycles of λ̂.
    phase: u32,
    block: Block,
    rest: Option<Rest>,
    averages: Averages,
    rub: Rub,
    /// Of the last touch of a block.
    usable: u8,
    noise: [f32; GAUGES],
}

impl Default for Surface {
    fn default() -> Self {
        Self::new()
    }
}

impl Surface {
    /// Nothing felt yet.
    pub fn new() -> Self {
        Self {
            wavelength_mm: 0.0,
            increment: 0,
            stood_by: false,
            last: None,
            arm: Course::default(),
            contact: Course::default(),
            phase: 0,
            block: Block::new(BLOCK_MM),
            rest: None,
            averages: Averages::default(),
            rub: Rub::default(),
            usable: 0,
            noise: [0.0; GAUGES],
        }
    }

    /// Takes a millisecond's touch, where the arm was then, and the tangential force in N if there is a channel for it.
    pub fn push(&mut self, touch: &Touch, arm: Place, force_n: Option<f32>) {
        let Some(last) = self.last.replace(touch.place) else {
            self.arm.furthest = arm;
            self.contact.furthest = touch.place;
            return;
        };
        let moved = touch.place.wrapping_sub(last);
        if moved == 0 {
            return;
        }
        let mut ahead = self.contact.ahead(touch.place);
        // Noise of a force channel moves the contact back too, but not the arm. Without one they are at the same place.
        let arm_agrees = force_n.is_none() || {
            self.arm.go(arm);
            self.arm.back != self.contact.back
        };
        if ahead < -BACK && arm_agrees {
            self.contact.turn(last);
            ahead = self.contact.ahead(touch.place);
            self.rub.turn();
            if !self.block.is_complete() {
                self.begin_block();
            }
        }
        // New ground alone: noise goes to and fro.
        let mut travel_mm = 0.0;
        if ahead > 0 {
            self.contact.furthest = touch.place;
            travel_mm = ahead as f32 * (1.0 / PLACES_PER_MM as f32);
            if let Some(force_n) = force_n {
                self.rub
                    .push(force_n, self.contact.back, travel_mm, self.stood_by);
            }
        }
        if self.wavelength_mm <= 0.0 {
            return;
        }
        self.block.sound &= self.stood_by;
        self.phase = self
            .phase
            .wrapping_add((moved as u32).wrapping_mul(self.increment));
        // One after the other: the mean cost counts, not how many blocks there are.
        if self.rest.is_none() && !self.block.is_complete() {
            self.block.add(&touch.gauges, self.phase, travel_mm);
            self.usable = touch.usable;
            self.noise = touch.noise;
        }
    }

    fn begin_block(&mut self) {
        self.block
            .restart((BLOCK_WAVES * self.wavelength_mm).max(BLOCK_MM));
    }

    /// Fits the block, and takes its partials into the averages.
    fn solve(&mut self) {
        let Some(fits) = self.block.fits() else {
            return;
        };
        let mut usable = [false; GAUGES];
        let mut loudest = (0.0, 0);
        for (gauge, fit) in fits.iter().enumerate() {
            let power = fit.power(1);
            if self.usable >> gauge & 1 == 1 && power > MIN_AMPLITUDE_LSB * MIN_AMPLITUDE_LSB {
                usable[gauge] = true;
                if power > loudest.0 {
                    loudest = (power, gauge);
                }
            }
        }
        if loudest.0 <= 0.0 {
            return;
        }
        // Waves a ms, and so Hz.
        let waves_per_ms = self.block.travel_mm / self.wavelength_mm / self.block.touches.max(1.0);
        let hz = waves_per_ms * SAMPLE_RATE_HZ as f32;
        let mut of_block = [PartialSum::default(); PARTIALS];
        for (gauge, fit) in fits.iter().enumerate().filter(|&(gauge, _)| usable[gauge]) {
            for (sum, relative) in of_block.iter_mut().zip(fit.relative()) {
                sum.add(gauge, relative, fit.power(1), fit.variance);
            }
        }
        let averages = &mut self.averages;
        averages.blocks += 1.0;
        for ((n, sum), of_block) in (2..).zip(&mut averages.partials).zip(&of_block) {
            if n as f32 * hz <= HIGHEST_HZ {
                sum.follow(of_block, n % 2 == 0);
            }
        }
        let gauge = core::mem::replace(&mut self.block.loudest, loudest.1);
        if !usable[gauge] {
            return;
        }
        let speed_mm_s = hz * self.wavelength_mm;
        // White up to half the samples' rate.
        let noise = self.noise[gauge] * speed_mm_s * (2.0 / SAMPLE_RATE_HZ as f32);
        self.rest = Some(Rest::new(
            &fits[gauge],
            self.wavelength_mm,
            [self.block.travel_mm, self.block.touches],
            noise,
            HIGHEST_HZ / speed_mm_s.max(1.0),
        ));
    }

    /// Does a step of what there is to do: to be called where the estimator has little to do, twice in 10 ms at least.
    pub fn work(&mut self) {
        if let Some(rest) = &mut self.rest {
            if rest.step(&mut self.block.ground) {
                self.averages.take(rest);
                self.rest = None;
            }
        } else if self.block.is_complete() {
            if self.block.sound {
                self.solve();
            }
            self.begin_block();
        }
    }

    /// Hears what the estimator says of λ.
    pub fn hear(&mut self, finding: &Finding) {
        self.stood_by = finding.valid;
        if finding.landed {
            self.begin_surface();
        }
        let Some(wavelength_mm) = finding.wavelength_mm.filter(|_| finding.valid) else {
            return;
        };
        let another = (wavelength_mm / self.wavelength_mm - 1.0).abs() > ANOTHER;
        self.wavelength_mm = wavelength_mm;
        self.increment = (4_294_967_296.0 / (wavelength_mm * PLACES_PER_MM as f32)) as u32;
        if another || self.averages.blocks == 0.0 && !self.block.is_begun() {
            self.begin_surface();
        }
    }

    fn begin_surface(&mut self) {
        self.averages = Averages::default();
        self.rest = None;
        self.begin_block();
    }

    /// What there is to say with the estimate of that number, made at `instant_us` of the board's clock.
    pub fn say(&self, sequence: u32, instant_us: u64, slips: bool) -> Texture {
        let averages = &self.averages;
        let partials = averages.partials.map(|sum| sum.partial());
        let powers = averages.bands.map(|[power, fundamental, _]| {
            if fundamental > 0.0 {
                (power / fundamental).max(0.0)
            } else {
                0.0
            }
        });
        let repeats = partials.iter().fold(0.5, |sum, partial| {
            let ratio = f32::from(partial.ratio) / f32::from(UNITY);
            sum + 0.5 * ratio * ratio
        });
        let rest: f32 = powers.iter().sum();
        let mut told = Texture {
            sequence,
            instant_us,
            valid: self.stood_by && averages.blocks >= ENOUGH_BLOCKS,
            partials,
            repeating_percent: (100.0 * repeats / (repeats + rest) + 0.5) as u8,
            bands: powers.map(|power| in_units(sqrt(power))),
            friction: self.rub.friction().filter(|_| slips),
        };
        for (partial, sum) in told.partials.iter_mut().zip(&averages.partials) {
            if !sum.is_measured() {
                partial.ratio = NOT_MEASURED;
            }
        }
        for (level, [_, fundamental, _]) in told.bands.iter_mut().zip(&averages.bands) {
            // No block has had a line of its own in this band.
            if *fundamental <= 0.0 {
                *level = NOT_MEASURED;
            }
        }
        told
    }
}

fn times([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c - b * d, a * d + b * c]
}
