//! What speaks for a wavelength, and how probable that makes it.
//!
//! The probability that λ̂ is within 5 % of the truth is a logistic function of a few pieces of evidence. Its
//! weights come from a regression over surfaces drawn at random, with and without a period (the tuning
//! seeds of `hil-sim jury`); how well the probabilities hold on others is `hil-sim chart confidence`.

/// Evidence for a line of the averaged spectrum.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LineEvidence {
    /// How full the average is, 0 to 1.
    pub maturity: f32,
    /// Travel since the start, or the last change of surface, in wavelengths.
    pub travelled_waves: f32,
    /// Travel for which the line has been where it is, in wavelengths.
    pub held_waves: f32,
    /// Share of the energy that the wave explains over the latest two, three and eight waves.
    pub shares: [f32; 3],
    /// How far the fits over three and eight waves are from the line, RMS over the average's memory.
    pub wander: [f32; 2],
    /// Share of the average's memory in which the moment's highest peak was the line.
    pub agreement: f32,
    /// Relative distance of λ̂ from the line.
    pub distance: f32,
    /// Energy of the line at the moment, over its average.
    pub presence: f32,
    /// The line's height over its flanks, a third of an octave away.
    pub sharpness: f32,
    /// How far the line itself has wandered, RMS of ln λ over twice the average's memory.
    pub spread: f32,
    /// Shares over three and eight waves, averaged as the wander is.
    pub kept_shares: [f32; 2],
}

/// Evidence for a wave of the moment that the average does not know.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WaveEvidence {
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
const LINE_CLUES: usize = 16;
/// See [`LINE_CLUES`].
const WAVE_CLUES: usize = 6;

const LINE: [f32; LINE_CLUES + 1] = [
    -14.579, -4.928, 0.808, 0.965, 0.874, 0.228, 0.786, 0.550, 0.703, 2.594, 0.527, 0.549, 4.392,
    0.417, -1.080, -0.615, 0.054,
];
const WAVE: [f32; WAVE_CLUES + 1] = [-10.811, 0.026, 0.988, 1.225, 2.583, 0.503, 1.135];

/// The logarithm of the share that is left unexplained, with its sign turned: 0 to 4.
fn odds(share: f32) -> f32 {
    -libm::logf(1.02 - share.clamp(0.0, 1.0))
}

impl LineEvidence {
    /// On scales on which the regression is linear.
    fn clues(&self) -> [f32; LINE_CLUES] {
        [
            self.maturity,
            libm::logf(1.0 + self.travelled_waves.min(30.0)),
            libm::logf(1.0 + self.held_waves.min(30.0)),
            odds(self.shares[0]),
            odds(self.shares[1]),
            odds(self.shares[2]),
            -libm::logf(self.wander[0] + 0.005),
            -libm::logf(self.wander[1] + 0.005),
            self.agreement,
            -libm::logf(self.distance.min(0.3) + 0.003),
            libm::logf(self.presence.clamp(0.05, 20.0)),
            libm::logf(self.sharpness.clamp(0.6, 20.0)),
            -libm::logf(self.spread + 0.003),
            odds(self.kept_shares[0]),
            odds(self.kept_shares[1]),
            self.drop() * self.drop(),
        ]
    }

    /// How much less the wave explains now than it used to: a wave that was strong and is gone.
    fn drop(&self) -> f32 {
        (self.kept_shares[0] - self.shares[0]).max(0.0)
    }

    /// Probability that λ̂ is within 5 %.
    pub fn probability(&self) -> f32 {
        logistic(&LINE, &self.clues())
    }
}

impl WaveEvidence {
    /// See [`LineEvidence::clues`].
    fn clues(&self) -> [f32; WAVE_CLUES] {
        [
            odds(self.share),
            self.waves,
            libm::logf(1.0 + self.held_waves.min(10.0)),
            self.known_share,
            -libm::logf(self.distance.min(0.3) + 0.003),
            -libm::logf(self.sigma.clamp(1e-5, 1.0)),
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
