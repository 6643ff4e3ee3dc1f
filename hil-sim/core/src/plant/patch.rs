//! The surface as a fingertip feels it that is not a point: a contact patch presses on it, and each gauge
//! lies some way below the skin.
//!
//! A load that varies along x with the wavenumber k is felt at a depth d by (1 + kd)·e^(−kd) of it: the
//! normal stress in an elastic half-space (Johnson, *Contact Mechanics*, 1985, chapter 2; of skin: Phillips
//! and Johnson 1981), whose answer to a line load is 2d³/(π (s² + d²)²). The load is the texture times
//! Hertz's pressure √(1 − (s/a)²), so that what lies beneath the middle counts for more than the edge.
//!
//! Against a point ([`Surface`]) this changes three things: short waves are felt less than long ones, a
//! specimen's border passes under a gauge bit by bit, and the harmonics are weaker. Where a gauge feels
//! nothing but one specimen, all that is periodic and stands in a table; near a border the load is summed
//! up, place by place.

use std::f64::consts::TAU;

use protocol::GAUGES;

use crate::plant::gauges::{PLACES_MM, Texture, advance};
use crate::plant::surface::{Period, Surface, feel, harmonics_at, period_of};
use crate::scene;
use crate::scene::Profile;

/// Depth of the gauges below the skin, in mm: a guess, a few times as deep as where a finger three times
/// smaller has its receptors.
pub const DEPTH_MM: f64 = 0.4;
/// Half of the contact's width, in mm: a guess, from 1 mm of indentation (the paper's section III-D) and
/// 18 mm of radius, √(2 · 18 · 1).
pub const HALF_WIDTH_MM: f64 = 6.0;
/// How far from a gauge the load is summed up, in mm: what lies beyond adds 0.05 %.
pub const REACH_MM: f64 = 8.0 * DEPTH_MM;

/// Longest distance of two places that are summed up, in mm: a tenth of the depth.
const SPACING_MM: f64 = 0.04;
/// Places in the shortest wave that counts.
const PLACES_A_WAVE: f64 = 3.0;
/// Waves of which less than this is felt, relative to the strongest, don't count.
const NEGLIGIBLE: f64 = 1e-4;

/// The surface under a patch.
#[derive(Clone, Debug)]
pub struct Patch {
    /// As a point would feel it, not blurred, without what is too short to be felt.
    sharp: Surface,
    sections: Vec<Section>,
    gauges: [Vec<(f64, f32)>; GAUGES],
    /// A recorded profile has no period, nor has an irregular one.
    is_periodic: bool,
}

/// A specimen.
#[derive(Clone, Debug)]
struct Section {
    /// Where its pattern begins, in mm.
    start_mm: f64,
    /// From where to where it lies; infinite at the ends of the surface.
    from_mm: f64,
    to_mm: f64,
    cycles_per_mm: f64,
    periods: [Box<Period>; GAUGES],
}

/// Share of a load of wavelength λ that a gauge feels at [`DEPTH_MM`], the contact being wide.
pub fn felt_share(wavelength_mm: f64) -> f64 {
    let depths = TAU * DEPTH_MM / wavelength_mm;
    (1.0 + depths) * libm::exp(-depths)
}

impl Patch {
    /// Prepares a scene's surface. `second_harmonic` is relative to the fundamental. The strongest
    /// specimen's fundamental has amplitude 1.
    pub fn new(surface: &scene::Surface, second_harmonic: f64) -> Self {
        let longest_mm = surface.specimens.iter().fold(0.0f64, |longest, specimen| {
            longest.max(specimen.wavelength_mm)
        });
        let strongest = felt_share(longest_mm);
        let counts = |wavelength_mm: f64, n: u32| {
            felt_share(wavelength_mm / f64::from(n)) >= NEGLIGIBLE * strongest
        };
        let amplitudes = |wavelength_mm: f64| -> Vec<(u32, f64)> {
            let mut waves = harmonics_at(&surface.profile, wavelength_mm, 0.0).to_vec();
            waves.push((2, second_harmonic));
            waves.retain(|&(n, amplitude)| amplitude != 0.0 && counts(wavelength_mm, n));
            waves
        };
        let shortest_mm = surface
            .specimens
            .iter()
            .flat_map(|specimen| {
                amplitudes(specimen.wavelength_mm)
                    .into_iter()
                    .map(|(n, _)| specimen.wavelength_mm / f64::from(n))
            })
            .fold(f64::INFINITY, f64::min);
        let spacing_mm = SPACING_MM.min(shortest_mm / PLACES_A_WAVE);
        let gauges = PLACES_MM.map(|place_mm| {
            let mut weights = weights(place_mm, spacing_mm);
            let (size, _) = gain(&weights, TAU / longest_mm);
            for (_, weight) in &mut weights {
                *weight /= size as f32;
            }
            weights
        });
        let mut start_mm = surface.start_mm;
        let mut sections: Vec<Section> = Vec::with_capacity(surface.specimens.len());
        for specimen in &surface.specimens {
            let waves = amplitudes(specimen.wavelength_mm);
            sections.push(Section {
                start_mm,
                from_mm: start_mm,
                to_mm: start_mm + specimen.length_mm,
                cycles_per_mm: specimen.wavelength_mm.recip(),
                periods: std::array::from_fn(|gauge| {
                    period_felt(&waves, specimen.wavelength_mm, &gauges[gauge])
                }),
            });
            start_mm += specimen.length_mm;
        }
        if let Some(first) = sections.first_mut() {
            first.from_mm = f64::NEG_INFINITY;
        }
        if let Some(last) = sections.last_mut() {
            last.to_mm = f64::INFINITY;
        }
        Self {
            sharp: Surface::of_waves(surface, amplitudes),
            sections,
            gauges,
            is_periodic: surface.irregularity.is_none()
                && !matches!(surface.profile, Profile::Recorded(_) | Profile::Felt(_)),
        }
    }
}

/// The period of a specimen's waves, number and amplitude, as a gauge of such weights feels it.
fn period_felt(waves: &[(u32, f64)], wavelength_mm: f64, weights: &[(f64, f32)]) -> Box<Period> {
    let felt: Vec<(u32, f64, f64)> = waves
        .iter()
        .map(|&(n, amplitude)| {
            let (size, ahead) = gain(weights, TAU * f64::from(n) / wavelength_mm);
            (n, amplitude * size, ahead)
        })
        .collect();
    period_of(&felt)
}

impl Texture for Patch {
    /// 1 is the amplitude of the strongest specimen's fundamental.
    #[inline]
    fn felt_by(&self, gauge: usize, fingertip_mm: f64) -> f32 {
        let at_mm = fingertip_mm + PLACES_MM[gauge];
        let advance = advance(gauge);
        if self.is_periodic {
            let begun = |section: &Section| section.from_mm <= at_mm - REACH_MM;
            let section = &self.sections[self.sections[1..].partition_point(begun)];
            if at_mm + REACH_MM <= section.to_mm {
                return feel(
                    &section.periods[gauge],
                    (at_mm - section.start_mm) * section.cycles_per_mm,
                    advance,
                );
            }
        }
        self.gauges[gauge]
            .iter()
            .map(|&(beside_mm, weight)| weight * self.sharp.feel(at_mm + beside_mm, advance))
            .sum()
    }
}

/// Places beside a gauge that lies at `place_mm` of the fingertip, in mm, and what a load there weighs.
fn weights(place_mm: f64, spacing_mm: f64) -> Vec<(f64, f32)> {
    let half = (REACH_MM / spacing_mm).ceil() as i64;
    (-half..=half)
        .map(|step| {
            let beside_mm = step as f64 * spacing_mm;
            let off_middle = (place_mm + beside_mm) / HALF_WIDTH_MM;
            let pressure = (1.0 - off_middle * off_middle).max(0.0).sqrt();
            let squares = beside_mm * beside_mm + DEPTH_MM * DEPTH_MM;
            let depth = 2.0 * DEPTH_MM.powi(3) / (std::f64::consts::PI * squares * squares);
            (beside_mm, (pressure * depth * spacing_mm) as f32)
        })
        .filter(|&(_, weight)| weight > 0.0)
        .collect()
}

/// What becomes of a sine of a wavenumber per mm: its size, and by how much it is ahead, in rad:
/// Σ weight · e^(j k s).
fn gain(weights: &[(f64, f32)], wavenumber_per_mm: f64) -> (f64, f64) {
    let (mut real, mut imaginary) = (0.0, 0.0);
    for &(beside_mm, weight) in weights {
        let (sine, cosine) = libm::sincos(wavenumber_per_mm * beside_mm);
        real += f64::from(weight) * cosine;
        imaginary += f64::from(weight) * sine;
    }
    (libm::hypot(real, imaginary), libm::atan2(imaginary, real))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Specimen;

    fn surface(profile: Profile, specimens: &[(f64, f64)]) -> scene::Surface {
        scene::Surface {
            specimens: specimens
                .iter()
                .map(|&(wavelength_mm, length_mm)| Specimen {
                    wavelength_mm,
                    length_mm,
                })
                .collect(),
            start_mm: 0.0,
            profile,
            irregularity: scene::Irregularity::NONE,
        }
    }

    /// Amplitude of the fundamental of what `gauge` feels over three periods from `from_mm` on.
    fn amplitude(patch: &Patch, gauge: usize, from_mm: f64, wavelength_mm: f64) -> f64 {
        let points = 3_000;
        let (mut sine, mut cosine) = (0.0, 0.0);
        for point in 0..points {
            let x_mm = from_mm + 3.0 * wavelength_mm * f64::from(point) / f64::from(points);
            let felt = f64::from(patch.felt_by(gauge, x_mm));
            let angle = TAU * x_mm / wavelength_mm;
            sine += felt * angle.sin();
            cosine += felt * angle.cos();
        }
        sine.hypot(cosine) * 2.0 / f64::from(points)
    }

    #[test]
    fn one_specimen_has_a_fundamental_of_one_under_every_gauge() {
        for wavelength_mm in [0.3, 1.0, 4.0] {
            let patch = Patch::new(
                &surface(Profile::Trapezoid, &[(wavelength_mm, f64::INFINITY)]),
                0.0,
            );
            for gauge in 0..GAUGES {
                // f32 and straight lines between the points of a table: below 1e-4.
                let found = amplitude(&patch, gauge, 5.0, wavelength_mm);
                assert!((found - 1.0).abs() < 2e-4, "{wavelength_mm}: {found}");
            }
        }
    }

    #[test]
    fn a_short_wave_is_felt_less_than_a_long_one_as_the_half_space_says() {
        let patch = Patch::new(
            &surface(Profile::Sine, &[(1.0, 100.0), (4.0, f64::INFINITY)]),
            0.0,
        );
        // The middle one's contact is wide on both sides: the envelope bends the kernel by
        // s²/2a² of it, (d/a)²/2 = 0.2 %; cutting it off at 8 depths takes 0.05 %.
        let found = amplitude(&patch, 2, 40.0, 1.0) / amplitude(&patch, 2, 150.0, 4.0);
        let due = felt_share(1.0) / felt_share(4.0);
        assert!((found / due - 1.0).abs() < 0.01, "{found} for {due}");
        assert!((due - 0.328).abs() < 0.001);
    }

    #[test]
    fn table_and_sum_are_the_same_where_both_hold() {
        let one = Patch::new(&surface(Profile::Trapezoid, &[(2.0, f64::INFINITY)]), 0.15);
        // The same surface with a border that is none: everything near it is summed up.
        let two = Patch::new(
            &surface(Profile::Trapezoid, &[(2.0, 20.0), (2.0, f64::INFINITY)]),
            0.15,
        );
        for step in 0..400 {
            let x_mm = 15.0 + 0.025 * f64::from(step);
            for gauge in 0..GAUGES {
                let (table, sum) = (one.felt_by(gauge, x_mm), two.felt_by(gauge, x_mm));
                // The sharp table's own lines: (2π · 7 / 2048)² / 8 of a seventh harmonic, and f32.
                assert!((table - sum).abs() < 2e-4, "{x_mm}: {table}, {sum}");
            }
        }
    }

    #[test]
    fn a_border_passes_bit_by_bit() {
        let surface = surface(Profile::Sine, &[(4.0, 20.0), (2.0, f64::INFINITY)]);
        let (patch, point) = (Patch::new(&surface, 0.0), Surface::new(&surface, 0.0));
        // The steepest change of slope over 20 µm around the border under the middle gauge.
        let bend = |feel: &dyn Fn(f64) -> f64| {
            (-50..50)
                .map(|step| {
                    let x_mm = 20.0 + 0.02 * f64::from(step);
                    feel(x_mm - 0.02) - 2.0 * feel(x_mm) + feel(x_mm + 0.02)
                })
                .fold(0.0f64, |most, bend| most.max(bend.abs()))
        };
        let sharp = bend(&|x_mm| f64::from(point.feel(x_mm, advance(2))));
        let soft = bend(&|x_mm| f64::from(patch.felt_by(2, x_mm)));
        // A kink of slope is drawn out over the depth, 0.4 mm, where 20 µm were looked at; half of the
        // kernel's weight lies within a third of it.
        assert!(soft < 0.15 * sharp, "{soft}, {sharp}");
    }
}
