//! What a real surface has and a grating has not: ridges worn away, a second wave, heights at random.

use std::f64::consts::TAU;

use super::grain::{Grain, hash};
use crate::scene;

/// The kind of hash that decides on ridges; the lattices of the grain have smaller numbers.
const RIDGES: u64 = 64;
/// Where a groove's middle lies, in cycles after the rising flank at mid-height.
pub(super) const GROOVE: f64 = 0.75;

/// The irregular part of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Irregular {
    second_wave: f64,
    second_ratio: f64,
    worn: f64,
    grain: Option<Grain>,
    seed: u64,
}

impl Irregular {
    /// None if there is nothing irregular about it.
    pub(super) fn new(asked: &scene::Irregularity) -> Option<Self> {
        (!asked.is_none()).then(|| Self {
            second_wave: asked.second_wave,
            second_ratio: asked.second_ratio,
            worn: asked.worn,
            grain: (asked.random > 0.0).then(|| Grain::new(asked.random, asked.seed)),
            seed: asked.seed,
        })
    }

    /// Whether a ridge is missing: the one whose rising flank is `cycles` 0 to 1 before, counted from groove
    /// to groove.
    #[inline]
    pub(super) fn is_worn(&self, specimen: usize, cycles: f64) -> bool {
        if self.worn == 0.0 {
            return false;
        }
        let ridge = (cycles + 1.0 - GROOVE).floor() as i64;
        let share = hash(self.seed, RIDGES + specimen as u64, ridge) as f64 / 2f64.powi(64);
        share < self.worn
    }

    /// What comes on top of the ridges, `x_mm` from the surface's zero and `from_start_mm` from the
    /// specimen's own.
    #[inline]
    pub(super) fn added(&self, x_mm: f64, from_start_mm: f64, wavelength_mm: f64) -> f64 {
        let mut added = 0.0;
        if self.second_wave > 0.0 {
            let cycles = from_start_mm / (wavelength_mm * self.second_ratio);
            added += self.second_wave * libm::sin(TAU * cycles.fract());
        }
        if let Some(grain) = &self.grain {
            added += grain.height(x_mm);
        }
        added
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use crate::plant::surface::Surface;
    use crate::scene;
    use crate::scene::{Irregularity, Profile, Specimen};

    fn surface(irregularity: Irregularity) -> Surface {
        Surface::new(
            &scene::Surface {
                specimens: vec![Specimen {
                    wavelength_mm: 2.0,
                    length_mm: f64::INFINITY,
                }],
                start_mm: 0.0,
                profile: Profile::Sine,
                irregularity,
            },
            0.0,
        )
    }

    #[test]
    fn a_worn_ridge_leaves_its_groove_level_and_the_others_stay() {
        let worn = surface(Irregularity {
            worn: 0.3,
            seed: 5,
            ..Irregularity::NONE
        });
        let sound = surface(Irregularity::NONE);
        let ridges = 4_000;
        let mut missing = 0;
        for ridge in 0..ridges {
            // The crest is a quarter of the wave after the flank.
            let crest_mm = 2.0 * (f64::from(ridge) + 0.25);
            if worn.feel(crest_mm, 0) < 0.0 {
                missing += 1;
                for aside_mm in [-0.99, -0.5, 0.3, 0.99] {
                    assert!((worn.feel(crest_mm + aside_mm, 0) + 1.0).abs() < 1e-3);
                }
            } else {
                for aside_mm in [-0.99, -0.5, 0.3, 0.99] {
                    let place = crest_mm + aside_mm;
                    assert_eq!(worn.feel(place, 0), sound.feel(place, 0));
                }
            }
        }
        // Binomial: σ = √(0.3 · 0.7 / 4000) = 0.7 %; 4 σ.
        let share = f64::from(missing) / f64::from(ridges);
        assert!((share - 0.3).abs() < 0.03, "{share}");
    }

    #[test]
    fn gauges_ahead_of_one_another_miss_the_same_ridge() {
        let worn = surface(Irregularity {
            worn: 0.5,
            seed: 7,
            ..Irregularity::NONE
        });
        // An eighth of a cycle ahead, and as much behind.
        for advance in [1u32 << 29, (1u32 << 29).wrapping_neg()] {
            let ahead_mm = 2.0 * f64::from(advance as i32) / 2f64.powi(32);
            for ridge in 0..200 {
                let crest_mm = 2.0 * (f64::from(ridge) + 0.25);
                let (own, other) = (
                    worn.feel(crest_mm, 0),
                    worn.feel(crest_mm - ahead_mm, advance),
                );
                assert!((own - other).abs() < 1e-3, "{own} and {other}");
            }
        }
    }

    #[test]
    fn a_second_wave_has_its_amplitude_and_its_own_wavelength() {
        let two = surface(Irregularity {
            second_wave: 0.6,
            second_ratio: 0.7,
            ..Irregularity::NONE
        });
        let first = surface(Irregularity::NONE);
        for place in 0..500 {
            let x_mm = f64::from(place) * 0.037 - 7.0;
            let added = f64::from(two.feel(x_mm, 0) - first.feel(x_mm, 0));
            let want = 0.6 * (TAU * x_mm / 1.4).sin();
            assert!((added - want).abs() < 1e-5, "{added} is not {want}");
        }
    }
}
