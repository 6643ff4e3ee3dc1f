//! What speaks for a wavelength, and how probable that makes it.
//!
//! The probability that λ̂ is within 5 % of the truth is a logistic function of a few pieces of evidence. Its
//! weights come from a regression over surfaces drawn at random, with and without a period: `hil-sim jury
//! --seed 1 --surfaces 4000 --weights` finds them anew. They depend on what is stood by, so a change asks for
//! two or three rounds. How well the probabilities hold on other seeds is `hil-sim chart confidence`.

use super::fit::{Fitted, LENGTH_COUNT, LENGTHS};
use super::off;
use crate::float::{larger, smaller};

/// Evidence for a line of the averaged spectrum.
#[derive(Clone, Copy, Debug, Default)]
pub struct LineEvidence {
    /// How full the average is, 0 to 1.
    pub maturity: f32,
    /// Travel since the start, or the last change of surface, in wavelengths.
    pub travelled_waves: f32,
    /// Travel for which the line has been where it is, in wavelengths.
    pub held_waves: f32,
    /// Share of the energy that the wave explains over the latest two, three and eight waves, or as many of these as are
    /// configured: so for all that is said of eight. Over two it is 0 where that fit found another wave.
    pub shares: [f32; 3],
    /// How far the fits over three and eight waves are from the line, RMS over the line's memory of eight waves.
    pub wander: [f32; 2],
    /// Share of that memory in which the moment's clearest peak was the line.
    pub agreement: f32,
    /// Relative distance of λ̂ from the line.
    pub distance: f32,
    /// Energy of the line at the moment, over its average.
    pub presence: f32,
    /// The line's height over its flanks, a third of an octave away.
    pub sharpness: f32,
    /// How far the line itself has wandered, RMS of ln λ over twice that memory.
    pub spread: f32,
    /// Shares over three and eight waves, averaged as the wander is.
    pub kept_shares: [f32; 2],
}

/// Evidence for a wave of the moment that the average does not know.
#[derive(Clone, Copy, Debug, Default)]
pub struct WaveEvidence {
    /// Largest share of the energy that the wave explains over the latest 1.5, 2 or 3 waves, and over how
    /// many that is.
    pub share: f32,
    /// See `share`.
    pub waves: f32,
    /// Travel for which the wave has been there, in wavelengths.
    pub held_waves: f32,
    /// Share that the line explained lately that was stood by before; 0 if none was.
    pub known_share: f32,
    /// Relative distance between the fits over 1.5 and 3 waves.
    pub distance: f32,
    /// Standard deviation of ln λ of the fit over two waves.
    pub sigma: f32,
}

/// Number of weights, the constant left out.
pub const LINE_CLUES: usize = 30;
/// See [`LINE_CLUES`].
pub const WAVE_CLUES: usize = 11;

const LINE: [f32; LINE_CLUES + 1] = [
    -10.821, -0.460, -0.481, 2.489, -1.394, 0.546, -0.040, 0.542, 0.342, 0.042, 0.145, 0.582,
    5.820, 0.466, -1.389, 0.589, -2.453, 3.830, 0.581, 2.117, 0.163, -0.032, -0.040, -2.998,
    -0.009, -0.379, 0.843, 0.135, 0.180, 0.165, -0.009,
];
const WAVE: [f32; WAVE_CLUES + 1] = [
    -3.474, 0.681, 1.158, 0.858, 2.459, -0.326, -3.297, -0.195, -0.358, 0.124, 0.216, 0.608,
];

/// The logarithm of the share that is left unexplained, with its sign turned: 0 to 4.
fn odds(share: f32) -> f32 {
    -libm::logf(1.02 - share.clamp(0.0, 1.0))
}

impl LineEvidence {
    /// On scales on which the regression is nearly linear, with squares and products for what is not.
    pub fn clues(&self) -> [f32; LINE_CLUES] {
        let travelled = libm::logf(1.0 + smaller(self.travelled_waves, 30.0));
        let held_waves = 1.0 + smaller(self.held_waves, 30.0);
        let held = libm::logf(held_waves);
        let strength = odds(self.shares[0]);
        let long_strength = odds(self.shares[2]);
        let steadiness = -libm::logf(self.wander[1] + 0.005);
        let sharp = libm::logf(self.sharpness.clamp(0.6, 20.0));
        let firm = -libm::logf(self.spread + 0.003);
        let agreement = self.agreement;
        let close = -libm::logf(smaller(self.distance, 0.3) + 0.003);
        [
            self.maturity,
            travelled,
            held,
            strength,
            odds(self.shares[1]),
            long_strength,
            -libm::logf(self.wander[0] + 0.005),
            steadiness,
            agreement,
            close,
            libm::logf(self.presence.clamp(0.05, 20.0)),
            sharp,
            firm,
            odds(self.kept_shares[0]),
            odds(self.kept_shares[1]),
            self.drop() * self.drop(),
            strength / held_waves,
            strength * sharp,
            agreement * sharp,
            held * sharp,
            strength * strength,
            held * held,
            sharp * sharp,
            firm * firm,
            travelled * held,
            agreement * agreement,
            steadiness * long_strength,
            self.maturity * sharp,
            close * strength,
            close * self.maturity,
        ]
    }

    /// How much less the wave explains now than it used to: a wave that was strong and is gone.
    fn drop(&self) -> f32 {
        larger(self.kept_shares[0] - self.shares[0], 0.0)
    }

    /// Probability that λ̂ is within 5 %.
    pub fn probability(&self) -> f32 {
        logistic(&LINE, &self.clues())
    }
}

/// The fit that explains most, and over how many waves it goes.
pub(super) fn best_of(found: &[Option<Fitted>]) -> Option<(Fitted, f32)> {
    found
        .iter()
        .zip(LENGTHS)
        .filter_map(|(fitted, waves)| Some(((*fitted)?, waves)))
        .max_by(|(one, _), (other, _)| one.share().total_cmp(&other.share()))
}

impl WaveEvidence {
    /// Of the fits over 1.5, 2 and 3 waves. `None` without any.
    pub(super) fn of(
        found: &[Option<Fitted>; LENGTH_COUNT],
        held_waves: f32,
        known_share: f32,
    ) -> Option<Self> {
        let (best, waves) = best_of(&found[..3])?;
        Some(Self {
            share: best.share(),
            waves,
            held_waves,
            known_share,
            distance: found[0].zip(found[2]).map_or(0.3, |(short, long)| {
                off(short.wavelength_mm, long.wavelength_mm)
            }),
            sigma: found[1].map_or(1.0, |fitted| fitted.sigma),
        })
    }

    /// See [`LineEvidence::clues`].
    pub fn clues(&self) -> [f32; WAVE_CLUES] {
        let strength = odds(self.share);
        let held = libm::logf(1.0 + smaller(self.held_waves, 10.0));
        let firm = -libm::logf(smaller(self.distance, 0.3) + 0.003);
        let sharp = -libm::logf(self.sigma.clamp(1e-5, 1.0));
        [
            strength,
            self.waves,
            held,
            self.known_share,
            firm,
            sharp,
            strength * held,
            strength * strength,
            sharp * held,
            firm * sharp,
            sharp * sharp,
        ]
    }

    /// Probability that λ̂ is within 5 %.
    pub fn probability(&self) -> f32 {
        logistic(&WAVE, &self.clues())
    }
}

fn logistic(weights: &[f32], clues: &[f32]) -> f32 {
    let (constant, weights) = (weights[0], &weights[1..]);
    let sum: f32 = weights
        .iter()
        .zip(clues)
        .map(|(weight, clue)| weight * clue)
        .sum();
    1.0 / (1.0 + libm::expf(-(constant + sum)))
}
