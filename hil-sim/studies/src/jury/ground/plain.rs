//! Surfaces without a period.

use std::f64::consts::TAU;

use super::super::dice::Dice;
use super::{GRID_MM, run_in};

/// A profile without any period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plain {
    /// Nothing at all.
    Flat,
    /// A climb with a bend: the height over the whole way is a parabola.
    Slope {
        /// Height from the beginning to the end, over the signal's level.
        rise: f64,
        /// Height in the middle over the straight line's, over the signal's level.
        bend: f64,
    },
    /// A random surface with a power spectrum of 1/k between 0.1 and 50 mm.
    Random,
    /// A random surface with a band of wavenumbers. **A narrow band looks periodic for a few waves**:
    /// about 1/bandwidth of them.
    NarrowBand {
        /// Of the band's centre.
        wavelength_mm: f64,
        /// Between the points of half the power, over the centre.
        bandwidth: f64,
    },
    /// Round bumps at places that know nothing of each other (Poisson).
    Bumps {
        /// Mean distance, in mm.
        spacing_mm: f64,
        /// σ of a bump, in mm.
        width_mm: f64,
    },
    /// Steps up and down at such places.
    Steps {
        /// Mean distance, in mm.
        spacing_mm: f64,
    },
}

impl Plain {
    pub(super) fn lay(&self, points: usize, dice: &mut Dice) -> Vec<f32> {
        match *self {
            Self::Flat => vec![0.0; points],
            Self::Slope { rise, bend } => (0..points)
                .map(|point| {
                    let share = point as f64 / points as f64;
                    (rise * share + 4.0 * bend * share * (1.0 - share)) as f32
                })
                .collect(),
            Self::Random => {
                // Poles a factor of four apart, each with the same power: 1/k between the outermost.
                let keeps =
                    [0.1, 0.4, 1.6, 6.4, 25.6, 50.0].map(|mm: f64| libm::exp(-TAU * GRID_MM / mm));
                let mut poles = [0.0; 6];
                run_in(points, 50.0, || {
                    let mut sum = 0.0;
                    for (pole, keep) in poles.iter_mut().zip(keeps) {
                        *pole = keep * *pole + libm::sqrt(1.0 - keep * keep) * dice.gaussian();
                        sum += *pole;
                    }
                    sum
                })
            }
            Self::NarrowBand {
                wavelength_mm,
                bandwidth,
            } => {
                // Two complex poles in a row: half the power at ±0.6436 of one pole's half width.
                let radian_per_mm = TAU / wavelength_mm;
                let half_width = 0.5 * bandwidth * radian_per_mm / 0.643_594;
                let keep = libm::exp(-half_width * GRID_MM);
                let (sine, cosine) = libm::sincos(radian_per_mm * GRID_MM);
                let (re, im) = (keep * cosine, keep * sine);
                let mut poles = [(0.0, 0.0); 2];
                run_in(points, 2.0 / half_width, || {
                    let mut given = (dice.gaussian(), dice.gaussian());
                    for pole in &mut poles {
                        *pole = (
                            re * pole.0 - im * pole.1 + given.0,
                            re * pole.1 + im * pole.0 + given.1,
                        );
                        given = *pole;
                    }
                    given.0
                })
            }
            Self::Bumps {
                spacing_mm,
                width_mm,
            } => {
                let mut heights = vec![0.0_f32; points];
                let reach = libm::ceil(4.0 * width_mm / GRID_MM) as isize;
                let mut at_mm = 0.0;
                loop {
                    at_mm += spacing_mm * -libm::log(1.0 - dice.uniform());
                    let middle = (at_mm / GRID_MM) as isize;
                    if middle >= points as isize {
                        return heights;
                    }
                    let height = dice.between(0.4, 1.0);
                    let past = (middle + reach).min(points as isize);
                    for point in (middle - reach).max(0)..past {
                        let off = (point - middle) as f64 * GRID_MM / width_mm;
                        heights[point as usize] += (height * libm::exp(-0.5 * off * off)) as f32;
                    }
                }
            }
            Self::Steps { spacing_mm } => {
                let (mut height, mut next_mm) = (0.0, 0.0);
                (0..points)
                    .map(|point| {
                        while point as f64 * GRID_MM >= next_mm {
                            next_mm += spacing_mm * -libm::log(1.0 - dice.uniform());
                            // Back towards the middle as well, so that it stays within the rails.
                            height = 0.7 * height + dice.gaussian();
                        }
                        height as f32
                    })
                    .collect()
            }
        }
    }
}
