//! What the surface is besides its wavelength: the shape of its wave, what does not repeat, and how it rubs.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Partials told of besides the fundamental: the second and the third.
pub const PARTIALS: usize = 2;
/// Octave bands of wavenumber in which what does not repeat is told.
pub const BANDS: usize = 4;
/// The lower end of the lowest of [`BANDS`], in waves per mm; each band reaches to twice its lower end, so that
/// the highest ends at 2 waves per mm, 0.5 mm.
pub const LOWEST_BAND_PER_MM: f32 = 0.125;
/// What stands for the fundamental's amplitude in [`Partial::ratio`] and [`Texture::bands`].
pub const UNITY: u16 = 1_000;
/// The largest ratio that is told: ten times the fundamental.
pub const LARGEST_RATIO: u16 = 10 * UNITY;

/// What stands in [`Partial::ratio`] and [`Texture::bands`] for what the sensor has not measured on this surface: it lies
/// beyond what the gauges tell at the speeds so far. It is not played.
pub const NOT_MEASURED: u16 = u16::MAX;

/// A partial of the surface's wave, sin θ + Σ rₙ sin(nθ + φₙ), where θ grows by 2π with each λ towards larger x.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Partial {
    /// rₙ in 1 / [`UNITY`], 0 to [`LARGEST_RATIO`], or [`NOT_MEASURED`].
    pub ratio: u16,
    /// φₙ in turns / 2¹⁶. It belongs to the place, so it is the same whichever way the finger moves. Gauges of which half feel
    /// the wave upside down can't tell which way up it is: the second may then be half a turn off.
    pub phase: u16,
}

/// How the surface rubs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Friction {
    /// Mean of the tangential force against the movement, less what the channel reads at rest as far as
    /// that is known, in mN.
    pub mean_mn: u16,
    /// Standard deviation of the tangential force while it moves, in mN.
    pub fluctuation_mn: u16,
}

/// What the surface is besides λ, at 20 Hz while the fingertip moves.
///
/// It belongs to the surface alone: neither the arm's speed nor its direction changes it, so a late one is as good
/// as an early one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Texture {
    /// [`crate::Estimate::sequence`] of the estimate that it was made with; one with a smaller one is older.
    pub sequence: u32,
    /// When it was made, in µs of the sensor's clock.
    pub instant_us: u64,
    /// Whether the sensor stands by all but the friction: it stands by λ, and what it says of the wave is averaged over
    /// enough of this surface.
    pub valid: bool,
    /// The second and the third partial of the wave whose fundamental has the wavelength λ.
    pub partials: [Partial; PARTIALS],
    /// Share of the texture's power that repeats with λ, in percent, 0 to 100: of what was measured.
    pub repeating_percent: u8,
    /// RMS of what does not repeat, in octave bands of wavenumber from the lowest up, in 1 / [`UNITY`] of the
    /// fundamental's amplitude, 0 to [`LARGEST_RATIO`], or [`NOT_MEASURED`]. The sensor's own noise is taken off.
    pub bands: [u16; BANDS],
    /// With the force channel, and while the fingertip slips.
    pub friction: Option<Friction>,
}

/// A ratio or a level as a number; none if it was [not measured](NOT_MEASURED).
pub fn measured(told: u16) -> Option<f32> {
    (told != NOT_MEASURED).then(|| f32::from(told.min(LARGEST_RATIO)) / f32::from(UNITY))
}

impl Texture {
    /// Whether all numbers are in their ranges.
    pub fn is_sound(&self) -> bool {
        let ratios = self.partials.iter().map(|partial| partial.ratio);
        ratios
            .chain(self.bands)
            .all(|ratio| ratio <= LARGEST_RATIO || ratio == NOT_MEASURED)
            && self.repeating_percent <= 100
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_measured_is_no_number() {
        assert_eq!(measured(NOT_MEASURED), None);
        assert_eq!(measured(0), Some(0.0));
        assert_eq!(measured(250), Some(0.25));
        assert_eq!(measured(LARGEST_RATIO + 1), Some(10.0));
    }

    #[test]
    fn a_texture_is_sound_up_to_the_ends_of_its_ranges() {
        let most = Partial {
            ratio: 10_000,
            phase: u16::MAX,
        };
        let ends = Texture {
            partials: [most; PARTIALS],
            repeating_percent: 100,
            bands: [10_000; BANDS],
            ..Texture::default()
        };
        assert!(Texture::default().is_sound() && ends.is_sound());
        let unknown = Texture {
            partials: [Partial {
                ratio: NOT_MEASURED,
                phase: 0,
            }; PARTIALS],
            bands: [NOT_MEASURED; BANDS],
            ..Texture::default()
        };
        assert!(unknown.is_sound());
        for place in 0..PARTIALS {
            let mut beyond = ends;
            beyond.partials[place].ratio += 1;
            assert!(!beyond.is_sound());
        }
        for band in 0..BANDS {
            let mut beyond = ends;
            beyond.bands[band] += 1;
            assert!(!beyond.is_sound());
        }
        let beyond = Texture {
            repeating_percent: 101,
            ..ends
        };
        assert!(!beyond.is_sound());
    }
}
