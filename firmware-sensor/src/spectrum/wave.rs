//! The wave of the moment, where it is not the line: a new surface, or chance.

use super::evidence::{WaveEvidence, best_of};
use super::{CONVINCING, SAME, Spectrum, Supposition, fills_some, is_common, off};
use crate::float::larger;

/// The wave of the moment, from one estimate to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wave {
    pub(super) mm: f32,
    pub(super) held_waves: f32,
    /// It is the surface: convincing by its evidence alone, and there for a wavelength.
    pub(super) is_surface: bool,
}

impl Spectrum {
    /// What is to be said of a wave that the line is not.
    pub(super) fn weigh_wave(&mut self) -> Option<Supposition> {
        let found = &self.survey.wave_pass.found;
        let Some((best, _)) = best_of(&found[..3]) else {
            self.wave = Wave::default();
            return None;
        };
        if off(best.wavelength_mm, self.wave.mm) < SAME {
            self.wave.held_waves += self.survey.fresh_mm / best.wavelength_mm;
        } else {
            self.wave.held_waves = 0.0;
        }
        self.wave.mm = best.wavelength_mm;
        let evidence = WaveEvidence::of(found, self.wave.held_waves, self.known_share)?;
        let probability = evidence.probability();
        self.weighed.wave = Some((best.wavelength_mm, evidence));
        let is_common = is_common(&best, self.touch.usable);
        self.wave.is_surface = is_common && probability > CONVINCING && self.wave.held_waves > 1.0;
        if !is_common {
            return None;
        }
        // Where a strong line has gone, something has taken its place. What is no wave may fill a gauge for a wave and a half, and
        // seldom two.
        let follows = self.line.is_gone()
            && self.wave.held_waves > 0.0
            && fills_some(&best, self.touch.usable);
        let least = if follows { best.share() } else { 0.0 };
        Some(Supposition {
            wavelength_mm: best.wavelength_mm,
            probability: larger(probability, least),
            fitted: Some(best),
            new: follows,
        })
    }
}
