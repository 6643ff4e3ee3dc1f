//! Averages over blocks of what the surface is.

use protocol::texture::{BANDS, PARTIALS};

use super::block::WAVES;
use super::partial::{MEMORY_BLOCKS, PartialSum};
use super::rest::{Rest, band_of};

/// Averages over blocks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Averages {
    pub blocks: f32,
    /// Of each partial: Zₙ (Z̄₁/|Z₁|)ⁿ |Z₁|, |Z₁|², and the variance of the former by what is left; over how many blocks.
    pub partials: [PartialSum; PARTIALS],
    /// Of each band: power, the fundamental's power, and blocks.
    pub bands: [[f32; 3]; BANDS],
}

impl Averages {
    /// Takes the spectrum of what is left of a block.
    pub fn take(&mut self, rest: &Rest) {
        for (band, sum) in self.bands.iter_mut().enumerate() {
            let [mean, fundamental, blocks] = sum;
            let lines = rest.lines[band];
            // The fit has taken a line for each partial, whatever was there.
            let fitted = (1..=WAVES)
                .filter(|&n| band_of(n as f32 / rest.wavelength_mm) == Some(band))
                .count() as f32;
            if lines > fitted {
                *blocks = (*blocks + 1.0).min(MEMORY_BLOCKS);
                let share = 1.0 / *blocks;
                let power = rest.bands[band] * lines / (lines - fitted);
                *mean += share * (power - *mean);
                *fundamental += share * (rest.fundamental - *fundamental);
            }
        }
    }
}
