//! The texture under a gauge, and the wavelength that is true there.
//!
//! The trapezoid (ridge = groove, ramps of 0.1 λ) is the sum of its odd harmonics up to 7, seen through
//! a contact that blurs with a Gaussian of 0.12 mm, and scaled so that its fundamental has amplitude 1.
//! Each specimen begins with a rising flank at mid-height, so its neighbour meets it in a step, as two
//! plates that are laid side by side do.
//!
//! On top of that, or in its place, comes what makes a surface irregular, if a scene asks for it.
//!
//! The blur and the ramp are guesses of the numerical study behind this project, not measurements.

mod grain;
mod irregular;

use crate::scene;
use crate::scene::{Profile, Series};
use irregular::{GROOVE, Irregular};

/// Width of the contact, the standard deviation of a Gaussian, in mm: a guess.
pub const CONTACT_BLUR_MM: f64 = 0.12;
/// Width of a ramp of the trapezoid, in λ: a guess.
pub const RAMP: f64 = 0.1;
/// The highest harmonic of the trapezoid.
pub const HIGHEST_HARMONIC: u32 = 7;

/// Points of one period. At 2048 the straight line between two of them misses the 7th harmonic by at
/// most (2π · 7 / 2048)² / 8 = 6e-5 of its amplitude.
const POINTS: usize = 1 << POINTS_LOG2;
const POINTS_LOG2: u32 = 11;
/// What is left of a phase of 32 bits below the point's number.
const FRACTION_BITS: u32 = 32 - POINTS_LOG2;
/// Spacing of a recorded profile once it is blurred, in mm: a sixth of the blur.
pub const GRID_MM: f64 = 0.02;

/// One period, its first point repeated at the end.
pub(crate) type Period = [f32; POINTS + 1];

/// The surface, ready to be felt.
#[derive(Clone, Debug)]
pub struct Surface {
    patches: Vec<Patch>,
    recorded: Option<Recorded>,
    irregular: Option<Irregular>,
}

#[derive(Clone, Debug)]
struct Patch {
    start_mm: f64,
    wavelength_mm: f64,
    cycles_per_mm: f64,
    period: Box<Period>,
}

/// Measured heights on an even grid, blurred, without their mean, RMS 1/√2 as a sine of amplitude 1; or what is felt
/// there, as it is.
#[derive(Clone, Debug)]
struct Recorded {
    start_mm: f64,
    heights: Vec<f32>,
}

impl Surface {
    /// Prepares a scene's surface. `second_harmonic` is relative to the fundamental.
    pub fn new(surface: &scene::Surface, second_harmonic: f64) -> Self {
        let waves = |wavelength_mm| {
            let mut waves = harmonics_at(&surface.profile, wavelength_mm, CONTACT_BLUR_MM).to_vec();
            waves.push((2, second_harmonic));
            waves
        };
        Self::with(surface, waves, CONTACT_BLUR_MM)
    }

    /// As a point feels it, nothing blurred: `waves` are the harmonics of a specimen of a wavelength in
    /// mm, and their amplitudes.
    pub(crate) fn of_waves(
        surface: &scene::Surface,
        waves: impl Fn(f64) -> Vec<(u32, f64)>,
    ) -> Self {
        Self::with(surface, waves, 0.0)
    }

    fn with(
        surface: &scene::Surface,
        waves: impl Fn(f64) -> Vec<(u32, f64)>,
        blur_mm: f64,
    ) -> Self {
        let mut start_mm = surface.start_mm;
        let mut patches = Vec::with_capacity(surface.specimens.len());
        for specimen in &surface.specimens {
            let wavelength_mm = specimen.wavelength_mm;
            let waves: Vec<_> = waves(wavelength_mm)
                .into_iter()
                .map(|(n, amplitude)| (n, amplitude, 0.0))
                .collect();
            let period = period_of(&waves);
            patches.push(Patch {
                start_mm,
                wavelength_mm,
                cycles_per_mm: wavelength_mm.recip(),
                period,
            });
            start_mm += specimen.length_mm;
        }
        let recorded = match &surface.profile {
            Profile::Recorded(heights) => Some(Recorded::new(heights, blur_mm)),
            Profile::Felt(felt) => Some(Recorded::felt(felt)),
            Profile::Sine | Profile::Trapezoid => None,
        };
        Self {
            patches,
            recorded,
            irregular: Irregular::new(&surface.irregularity),
        }
    }

    /// The true wavelength at `x_mm`, in mm.
    pub fn wavelength_mm(&self, x_mm: f64) -> f64 {
        self.patch(x_mm).wavelength_mm
    }

    /// What a gauge at `x_mm` feels, 1 being the fundamental's amplitude. `advance` shifts the texture by
    /// a share of its period, in 2⁻³² cycles; a recorded one is not shifted.
    #[inline]
    pub fn feel(&self, x_mm: f64, advance: u32) -> f32 {
        match (&self.recorded, &self.irregular) {
            (Some(recorded), _) => recorded.feel(x_mm),
            (None, None) => self.patch(x_mm).feel(x_mm, advance),
            (None, Some(irregular)) => {
                let specimen = self.specimen(x_mm);
                self.patches[specimen].feel_irregular(irregular, specimen, x_mm, advance)
            }
        }
    }

    #[inline]
    fn patch(&self, x_mm: f64) -> &Patch {
        &self.patches[self.specimen(x_mm)]
    }

    /// The number of the specimen at a place.
    #[inline]
    fn specimen(&self, x_mm: f64) -> usize {
        self.patches[1..].partition_point(|patch| patch.start_mm <= x_mm)
    }
}

impl Patch {
    #[inline]
    fn feel(&self, x_mm: f64, advance: u32) -> f32 {
        let cycles = (x_mm - self.start_mm) * self.cycles_per_mm;
        feel(&self.period, cycles, advance)
    }

    fn feel_irregular(
        &self,
        irregular: &Irregular,
        specimen: usize,
        x_mm: f64,
        advance: u32,
    ) -> f32 {
        let from_start_mm = x_mm - self.start_mm;
        let cycles = from_start_mm * self.cycles_per_mm;
        // A phase behind is a small negative one.
        let ahead = f64::from(advance as i32) / 4_294_967_296.0;
        let ridges = if irregular.is_worn(specimen, cycles + ahead) {
            feel(&self.period, GROOVE, 0)
        } else {
            feel(&self.period, cycles, advance)
        };
        ridges + irregular.added(x_mm, from_start_mm, self.wavelength_mm) as f32
    }
}

/// What stands in a period `cycles` after its beginning, and `advance` · 2⁻³² of it further on.
#[inline]
pub(crate) fn feel(period: &Period, cycles: f64, advance: u32) -> f32 {
    // Whole cycles fall off at the top.
    let phase = ((cycles * 4_294_967_296.0) as i64 as u32).wrapping_add(advance);
    let point = (phase >> FRACTION_BITS) as usize;
    let fraction = (phase & ((1 << FRACTION_BITS) - 1)) as f32 / (1 << FRACTION_BITS) as f32;
    let (from, to) = (period[point], period[point + 1]);
    from + (to - from) * fraction
}

/// Rows on the grid that begins with the first of them.
fn on_grid(rows: &Series) -> Vec<f64> {
    let (first, last) = rows.extent();
    let points = ((last - first) / GRID_MM).floor() as usize + 1;
    let mut row = 0;
    (0..points)
        .map(|point| {
            let x_mm = first + point as f64 * GRID_MM;
            row = rows.row(x_mm, row);
            rows.value(row, 0, x_mm)
        })
        .collect()
}

impl Recorded {
    fn felt(rows: &Series) -> Self {
        Self {
            start_mm: rows.extent().0,
            heights: on_grid(rows).into_iter().map(|felt| felt as f32).collect(),
        }
    }

    fn new(profile: &Series, blur_mm: f64) -> Self {
        let mut raw = on_grid(profile);
        let points = raw.len();
        // By a power of two, which costs no bit: squares of very small heights would be 0.
        let highest = raw.iter().copied().map(f64::abs).fold(0.0, f64::max);
        let (_, exponent) = libm::frexp(highest);
        for height in &mut raw {
            *height = libm::scalbn(*height, -exponent);
        }
        let mean = raw.iter().sum::<f64>() / points as f64;

        let reach = (4.0 * blur_mm / GRID_MM).ceil() as i64;
        let weight = |step: i64| match step {
            0 => 1.0,
            _ => libm::exp(-0.5 * (step as f64 * GRID_MM / blur_mm).powi(2)),
        };
        let total: f64 = (-reach..=reach).map(weight).sum();
        let blurred: Vec<f64> = (0..points as i64)
            .map(|centre| {
                let sum: f64 = (-reach..=reach)
                    .map(|step| {
                        let point = (centre + step).clamp(0, points as i64 - 1) as usize;
                        weight(step) * (raw[point] - mean)
                    })
                    .sum();
                sum / total
            })
            .collect();

        let power = blurred.iter().map(|height| height * height).sum::<f64>() / points as f64;
        // A perfectly flat profile stays flat.
        let scale = if power > 0.0 {
            (0.5 / power).sqrt()
        } else {
            0.0
        };
        let heights = blurred
            .iter()
            .map(|height| (height * scale) as f32)
            .collect();
        Self {
            start_mm: profile.extent().0,
            heights,
        }
    }

    fn feel(&self, x_mm: f64) -> f32 {
        let at = ((x_mm - self.start_mm) / GRID_MM).clamp(0.0, (self.heights.len() - 1) as f64);
        let point = (at as usize).min(self.heights.len().saturating_sub(2));
        let (from, to) = (
            self.heights[point],
            self.heights[(point + 1).min(self.heights.len() - 1)],
        );
        from + (to - from) * (at - point as f64) as f32
    }
}

/// The amplitudes of the sines n = 1, 3, 5, 7, the first of them 1, seen through a contact that blurs
/// with a Gaussian of `blur_mm`.
pub(crate) fn harmonics_at(profile: &Profile, wavelength_mm: f64, blur_mm: f64) -> [(u32, f64); 4] {
    use std::f64::consts::{PI, TAU};
    // A square wave's 1/n, its flanks drawn out over RAMP (a sinc), through the contact (a Gaussian).
    let amplitude = |n: u32| {
        let n = f64::from(n);
        let ramp = libm::sin(PI * n * RAMP) / (PI * n * RAMP);
        let blur = libm::exp(-0.5 * (TAU * n * blur_mm / wavelength_mm).powi(2));
        ramp * blur / n
    };
    [1, 3, 5, HIGHEST_HARMONIC].map(|n| match profile {
        // Very short waves are blurred to nothing; the signal is relative to what is left.
        _ if n == 1 => (n, 1.0),
        Profile::Trapezoid if amplitude(1) > 0.0 => (n, amplitude(n) / amplitude(1)),
        _ => (n, 0.0),
    })
}

/// The period of a sum of sines: number, amplitude, and by how much each is ahead, in rad.
pub(crate) fn period_of(waves: &[(u32, f64, f64)]) -> Box<Period> {
    let mut period = Box::new([0.0; POINTS + 1]);
    for (point, value) in period.iter_mut().enumerate() {
        let theta = std::f64::consts::TAU * point as f64 / POINTS as f64;
        let sum: f64 = waves
            .iter()
            .filter(|wave| wave.1 != 0.0)
            .map(|&(n, amplitude, ahead)| amplitude * libm::sin(f64::from(n) * theta + ahead))
            .sum();
        *value = sum as f32;
    }
    period
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::sync::Arc;

    use super::*;
    use crate::scene::Specimen;

    fn surface(profile: Profile, specimens: &[(f64, f64)]) -> Surface {
        let specimens = specimens
            .iter()
            .map(|&(wavelength_mm, length_mm)| Specimen {
                wavelength_mm,
                length_mm,
            })
            .collect();
        Surface::new(
            &scene::Surface {
                specimens,
                start_mm: 10.0,
                profile,
                irregularity: scene::Irregularity::NONE,
            },
            0.0,
        )
    }

    /// Amplitude and phase of the `n`th harmonic of what is felt over one period of 2 mm.
    fn harmonic(surface: &Surface, n: f64, advance: u32) -> (f64, f64) {
        let points = 4096;
        let (mut sine, mut cosine) = (0.0, 0.0);
        for point in 0..points {
            let cycles = f64::from(point) / f64::from(points);
            let felt = f64::from(surface.feel(10.0 + 2.0 * cycles, advance));
            sine += felt * libm::sin(TAU * n * cycles);
            cosine += felt * libm::cos(TAU * n * cycles);
        }
        let scale = 2.0 / f64::from(points);
        (
            libm::hypot(sine * scale, cosine * scale),
            libm::atan2(cosine, sine),
        )
    }

    #[test]
    fn the_fundamental_has_amplitude_one_and_the_harmonics_their_share() {
        let trapezoid = surface(Profile::Trapezoid, &[(2.0, f64::INFINITY)]);
        // f32 and straight lines between the points: below 1e-4.
        assert!((harmonic(&trapezoid, 1.0, 0).0 - 1.0).abs() < 1e-4);
        assert!(harmonic(&trapezoid, 2.0, 0).0 < 1e-4);
        // 1/3 of a square's, sinc(0.3)/sinc(0.1) for the ramps, e^(−½ (2π 0.12/2)² (9 − 1)) for the blur.
        let ramp = (0.3 * TAU / 2.0).sin() / 3.0 / (0.1 * TAU / 2.0).sin();
        let third = ramp / 3.0 * (-0.5 * (TAU * 0.06).powi(2) * 8.0).exp();
        assert!((harmonic(&trapezoid, 3.0, 0).0 - third).abs() < 1e-4);
        let sine = surface(Profile::Sine, &[(2.0, f64::INFINITY)]);
        assert!(harmonic(&sine, 3.0, 0).0 < 1e-4);
    }

    #[test]
    fn an_advance_shifts_the_texture_by_its_share_of_a_cycle() {
        let trapezoid = surface(Profile::Trapezoid, &[(2.0, f64::INFINITY)]);
        let (_, phase) = harmonic(&trapezoid, 1.0, 1 << 29);
        assert!((phase - TAU / 8.0).abs() < 1e-4, "{phase}");
        assert_eq!(trapezoid.feel(10.25, 1 << 31), trapezoid.feel(11.25, 0));
    }

    #[test]
    fn each_place_has_its_own_specimen_and_the_outer_ones_go_on() {
        let three = surface(
            Profile::Sine,
            &[(1.0, 5.0), (2.0, 5.0), (4.0, f64::INFINITY)],
        );
        for (x_mm, wavelength_mm) in [
            (-1e6, 1.0),
            (14.999, 1.0),
            (15.0, 2.0),
            (19.999, 2.0),
            (20.0, 4.0),
            (1e6, 4.0),
        ] {
            assert_eq!(three.wavelength_mm(x_mm), wavelength_mm, "{x_mm}");
        }
        // A quarter of each one's wave after its start: the crest.
        for x_mm in [10.25, 15.5, 21.0] {
            assert!((three.feel(x_mm, 0) - 1.0).abs() < 1e-6, "{x_mm}");
        }
    }

    #[test]
    fn far_from_the_start_the_texture_is_as_sharp_as_near() {
        let sine = surface(Profile::Sine, &[(2.0, f64::INFINITY)]);
        for cycles in [0.1, 0.3, 0.77] {
            let near = sine.feel(10.0 + 2.0 * cycles, 0);
            let far = sine.feel(10.0 + 2.0 * (1e6 + cycles), 0);
            assert!((near - far).abs() < 1e-5);
            assert!((f64::from(near) - (TAU * cycles).sin()).abs() < 1e-5);
        }
    }

    #[test]
    fn a_recorded_sine_is_felt_as_a_sine_of_amplitude_one() {
        let at: Vec<f64> = (0..=4000).map(|row| f64::from(row) * 0.01).collect();
        let values = at
            .iter()
            .map(|x_mm| 7.0 + 0.03 * (TAU * x_mm / 2.0).sin())
            .collect();
        let series = Arc::new(Series {
            at,
            values,
            width: 1,
        });
        let recorded = surface(Profile::Recorded(series), &[(2.0, f64::INFINITY)]);
        // Twenty whole periods of 2 mm; the ends' blur reaches 0.5 mm in.
        for x_mm in [4.5, 10.1, 31.3] {
            let felt = f64::from(recorded.feel(x_mm, 0));
            assert!(
                (felt - (TAU * x_mm / 2.0).sin()).abs() < 0.01,
                "{felt} at {x_mm}"
            );
        }
        assert!(recorded.feel(-5.0, 0).is_finite() && recorded.feel(99.0, 0).is_finite());
    }
}
