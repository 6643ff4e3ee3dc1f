//! How jerky the gauges are: the power of their second difference, which high frequencies dominate.

use protocol::GAUGES;

use crate::SAMPLE_RATE_HZ;
use crate::estimator::Touch;
use crate::float::{larger, smaller, sqrt};
use crate::phasor::phasor;
use crate::travel::PLACES_PER_UM;

/// Gains in power of the first and of the second difference for white noise behind the anti-aliasing filter.
const NOISE_GAINS: [f32; 2] = [1.83, 4.85];
/// Share of what noise makes of a difference that is not known.
const NOISE_DOUBT: f32 = 0.1;
/// What a contact dulls a texture by: a Gaussian of this σ in mm, 0.24 mm wide at half height.
const CONTACT_SIGMA_MM: f32 = 0.1;
/// Power of the first and of the second difference, relative to the wave's, that is never held against a surface: as noise
/// makes, so the first has 2.65 times as much of it.
const LEAST_JERKS: [f32; 2] = [0.013, 0.005];
/// What is faster than this is noise: a fingertip on its spring slips for some ms. White noise is at 303 Hz.
const SLIPS_BELOW_HZ: f32 = 350.0;
/// Up to this speed, 25 mm/s in places a millisecond, what a contact of 0.24 mm lets through passes at some 100 Hz at most. So
/// the first difference tells slips from it, too, and noise makes less of it.
const SLOW_PLACES: f32 = 25.0 * PLACES_PER_UM as f32;
/// How much more than from its quiet moments steady power may be, which is known to a fifth or so.
const STEADY_DOUBT: f32 = 1.05;
/// Speed from which on a millisecond counts, in places a millisecond: 5 mm/s.
const MOVED_PLACES: f32 = 5.0 * PLACES_PER_UM as f32;
/// Time constant of the speed, in samples.
const SPEED_SAMPLES: f32 = 16.0;
/// Share of the samples that are the quiet ones, the step that their bound is followed in, and its least,
/// relative to the mean.
const QUIET_SHARE: f32 = 0.1;
/// See [`QUIET_SHARE`].
const QUIET_STEP: f32 = 0.02;
/// See [`QUIET_SHARE`].
const QUIET_LEAST: f32 = 1e-3;
/// The tenth percentile of χ² over its mean, with one to five degrees of freedom: white noise's quiet
/// bound, by the number of gauges.
const QUIET_OF_MEAN: [f32; GAUGES] = [0.0158, 0.1054, 0.1948, 0.2659, 0.3221];
/// Time constant of the high-frequency power, in samples.
const JERK_SAMPLES: f32 = 300.0;

/// The power of a difference in time, over the milliseconds that moved.
#[derive(Clone, Copy, Debug, Default)]
struct Power {
    /// Its mean, and the mean of it by speed in places a millisecond.
    mean: f32,
    by_speed: f32,
    /// The power by speed that a tenth of them are below: roughness passes as fast as the arm is.
    quiet: f32,
}

/// The power of the first and of the second difference in time. High frequencies dominate the second one: where the
/// arm is slow, and slips are slower than the noise, the first shows more of them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Jerk {
    before: [[f32; GAUGES]; 2],
    /// Speed lately, in places a millisecond.
    speed: f32,
    /// Of the first and of the second difference.
    powers: [Power; 2],
    mean_speed: f32,
    samples: u32,
}

impl Power {
    /// Takes a millisecond's, for that share of the mean; the quiet one follows in steps of that size.
    fn take(&mut self, power: f32, per_speed: f32, share: f32, step: f32) {
        let by_speed = power * per_speed;
        self.mean += (power - self.mean) * share;
        self.by_speed += (by_speed - self.by_speed) * share;
        if self.quiet == 0.0 {
            self.quiet = by_speed;
        }
        // A quantile in steps of its own size: so many up as down once a share of the powers is below.
        self.quiet *= if by_speed > self.quiet {
            1.0 + step * QUIET_SHARE
        } else {
            1.0 - step * (1.0 - QUIET_SHARE)
        };
        self.quiet = larger(self.quiet, self.by_speed * QUIET_LEAST);
    }

    /// What the mean power may be if it is always as in the quiet moments, speed for speed, with `gauges`
    /// gauges: a fingertip that sticks and slips is quiet in between, noise and a rough surface are not.
    fn steady(&self, gauges: u32) -> f32 {
        let gauges = (gauges as usize).clamp(1, GAUGES);
        let by_speed = larger(self.by_speed, f32::MIN_POSITIVE);
        let share = self.quiet / (QUIET_OF_MEAN[gauges - 1] * by_speed);
        STEADY_DOUBT * self.mean * smaller(share, 1.0)
    }
}

impl Jerk {
    /// Takes a millisecond's touch and its travel in places.
    pub(super) fn push(&mut self, touch: &Touch, travel: i32) {
        let [before, older] = self.before;
        let (mut first, mut second) = (0.0, 0.0);
        for gauge in 0..GAUGES {
            if touch.usable >> gauge & 1 == 1 {
                let step = touch.gauges[gauge] - before[gauge];
                let bend = step - (before[gauge] - older[gauge]);
                first += step * step;
                second += bend * bend;
            }
        }
        self.before = [touch.gauges, before];
        self.speed += (travel.abs() as f32 - self.speed) * (1.0 / SPEED_SAMPLES);
        if self.speed < MOVED_PLACES {
            return;
        }
        self.samples = self.samples.saturating_add(1);
        // The first two differences are with nothing.
        let Some(samples) = self.samples.checked_sub(2).filter(|&samples| samples > 0) else {
            return;
        };
        let one = 1.0 / samples as f32;
        let (share, step) = (larger(one, 1.0 / JERK_SAMPLES), larger(one, QUIET_STEP));
        let per_speed = 1.0 / self.speed;
        let [of_first, of_second] = &mut self.powers;
        if self.speed < SLOW_PLACES {
            of_first.take(first, per_speed, share, step);
        } else {
            // The rest of it is asked for below that speed alone.
            of_first.mean += (first - of_first.mean) * share;
        }
        of_second.take(second, per_speed, share, step);
        self.mean_speed += (self.speed - self.mean_speed) * share;
    }

    /// Begins anew, on another surface or with other gauges: it is as quiet as before in between.
    pub(super) fn restart(&mut self) {
        *self = Self {
            samples: self.samples.min(2),
            powers: self.powers.map(|power| Power {
                quiet: power.quiet,
                ..Power::default()
            }),
            mean_speed: 0.0,
            ..*self
        };
    }

    /// Whether the fingertip seems to stick and slip, on a wave of that power in as many gauges, passing at
    /// `hz` for the arm: there is power at high frequencies that neither `noise` nor the surface makes. A
    /// fingertip that slips is fast for some ms, whatever the arm does: at the arm's speed that would be waves
    /// finer than a contact lets through.
    pub(super) fn is_slip(
        &self,
        wavelength_mm: f32,
        hz: f32,
        explained: f32,
        noise: f32,
        gauges: u32,
    ) -> bool {
        // What a wave with sharp edges makes, as far as the contact leaves them sharp.
        let edges = |order: i32| {
            let wave = |number: f32, share: f32| {
                share * difference_gain(number * hz, order) * let_through(number / wavelength_mm)
            };
            (wave(1.0, 1.0) + wave(2.0, 0.1) + wave(3.0, 1.0 / 9.0) + wave(5.0, 0.04))
                / let_through(1.0 / wavelength_mm)
        };
        let left = |n: usize| {
            let known = NOISE_GAINS[n] * noise;
            let power = &self.powers[n];
            power.mean - larger(power.steady(gauges), known) - NOISE_DOUBT * known
        };
        let may_be = |n: usize| left(n) > explained * LEAST_JERKS[n];
        let is_slow = self.mean_speed < SLOW_PLACES;
        // Mostly there is no need to ask further.
        if !(may_be(1) || is_slow && may_be(0)) {
            return false;
        }
        let beyond_noise = |n: usize| larger(self.powers[n].mean - NOISE_GAINS[n] * noise, 0.0);
        let (first, second) = (beyond_noise(0), beyond_noise(1));
        // Of a single frequency the differences' powers are (2 sin(πf/fs))² apart.
        let sine = if second < 4.0 * first {
            0.5 * sqrt(second / first)
        } else {
            1.0
        };
        let slip_hz = SAMPLE_RATE_HZ as f32 / core::f32::consts::PI * libm::asinf(sine);
        let per_mm = slip_hz * PLACES_PER_UM as f32 / larger(self.mean_speed, f32::MIN_POSITIVE);
        let stands_out = |n: usize| {
            let least = explained * larger(let_through(per_mm), LEAST_JERKS[n]);
            left(n) > least && left(n) > explained * edges(n as i32 + 1) + least
        };
        slip_hz < SLIPS_BELOW_HZ && (stands_out(1) || is_slow && stands_out(0))
    }
}

/// Share of a wave's power that a contact lets through, by its wavenumber in cycles per mm.
fn let_through(per_mm: f32) -> f32 {
    let radians = 2.0 * core::f32::consts::PI * CONTACT_SIGMA_MM * per_mm;
    libm::expf(-smaller(radians * radians, 40.0))
}

/// Power gain of the first or second difference at 1 kHz, (2 sin(πf/fs))² or its square, up to half the sample rate.
fn difference_gain(frequency_hz: f32, order: i32) -> f32 {
    let half_turns = smaller(frequency_hz / SAMPLE_RATE_HZ as f32, 0.5);
    let [_, sin] = phasor((half_turns * 2_147_483_648.0) as u32);
    let square = 4.0 * sin * sin;
    if order == 1 { square } else { square * square }
}

#[cfg(test)]
mod tests {
    use core::f32::consts::TAU;
    use core::ops::Range;

    use super::*;

    const WAVELENGTH_MM: f32 = 2.0;
    const SPEED_MM_S: f32 = 30.0;
    /// The wave's amplitude, and its power in all gauges.
    const WAVE: f32 = 300.0;
    const WAVES_POWER: f32 = 0.5 * WAVE * WAVE * GAUGES as f32;

    fn feel(
        jerk: &mut Jerk,
        times_ms: Range<u32>,
        mm_s: f32,
        usable: u8,
        felt: impl Fn(f32, usize) -> f32,
    ) {
        for ms in times_ms {
            let touch = Touch {
                gauges: core::array::from_fn(|gauge| felt(ms as f32, gauge)),
                usable,
                ..Touch::default()
            };
            jerk.push(&touch, (mm_s * PLACES_PER_UM as f32) as i32);
        }
    }

    fn sine(ms: f32, hz: f32) -> f32 {
        libm::sinf(TAU * libm::fmodf(ms * hz, 1_000.0) / 1_000.0)
    }

    /// A quarter of a turn from gauge to gauge: what four of them have of power is always the same.
    fn even(amplitude: f32) -> impl Fn(f32, usize) -> f32 {
        move |ms, gauge| match gauge {
            4 => 1e4 * sine(ms, 170.0),
            gauge => amplitude * sine(ms + 2.5 * gauge as f32, 100.0),
        }
    }

    fn assert_near(got: f32, want: f32, share: f32) {
        assert!(
            (got - want).abs() <= share * want.abs(),
            "{got}, not {want}"
        );
    }

    #[test]
    fn of_a_sine_the_powers_of_both_differences_are_known() {
        let mut jerk = Jerk::default();
        // Of the fifth gauge, which is not usable, nothing counts.
        feel(&mut jerk, 0..2_000, 40.0, 0b0_1111, even(100.0));
        let gain = {
            let sin = libm::sinf(TAU * 0.05);
            4.0 * sin * sin
        };
        assert_near(jerk.powers[0].mean, 4.0 * 5_000.0 * gain, 1e-3);
        assert_near(jerk.powers[1].mean, 4.0 * 5_000.0 * gain * gain, 1e-3);
        let places = 40.0 * PLACES_PER_UM as f32;
        assert_near(jerk.mean_speed, places, 1e-3);
        assert_near(jerk.powers[1].by_speed, jerk.powers[1].mean / places, 1e-3);
        assert_near(
            jerk.powers[1].quiet,
            jerk.powers[1].by_speed,
            2.0 * QUIET_STEP,
        );
        // Where all moments are alike, all of the power may be a rough surface's.
        assert_near(
            jerk.powers[1].steady(1),
            STEADY_DOUBT * jerk.powers[1].mean,
            1e-6,
        );
    }

    #[test]
    fn the_quiet_power_falls_nine_times_as_fast_as_it_rises() {
        let mut jerk = Jerk::default();
        feel(&mut jerk, 0..2_000, 40.0, 0b0_1111, even(100.0));
        feel(&mut jerk, 2_000..2_010, 40.0, 0b0_1111, even(50.0));
        let before = jerk.powers[1].quiet;
        feel(&mut jerk, 2_010..2_030, 40.0, 0b0_1111, even(50.0));
        assert_near(jerk.powers[1].quiet, before * libm::powf(0.982, 20.0), 1e-4);
        feel(&mut jerk, 2_030..2_040, 40.0, 0b0_1111, even(200.0));
        let before = jerk.powers[1].quiet;
        feel(&mut jerk, 2_040..2_060, 40.0, 0b0_1111, even(200.0));
        assert_near(jerk.powers[1].quiet, before * libm::powf(1.002, 20.0), 1e-4);
        // However quiet it is, a thousandth of the mean is left.
        feel(&mut jerk, 2_060..2_800, 40.0, 0b0_1111, even(0.0));
        assert_near(jerk.powers[1].quiet, 1e-3 * jerk.powers[1].by_speed, 1e-3);
    }

    #[test]
    fn an_arm_that_creeps_tells_nothing_and_a_restart_forgets_the_means_alone() {
        let mut jerk = Jerk::default();
        feel(&mut jerk, 0..1_000, 4.5, 0b0_1111, even(100.0));
        assert_eq!((jerk.powers[1].mean, jerk.samples), (0.0, 0));
        feel(&mut jerk, 1_000..2_000, 5.5, 0b0_1111, even(100.0));
        assert!(jerk.powers[1].mean > 0.0);
        let quiet = jerk.powers[1].quiet;
        jerk.restart();
        assert_eq!(
            [
                jerk.powers[0].mean,
                jerk.powers[1].mean,
                jerk.powers[1].by_speed,
                jerk.mean_speed
            ],
            [0.0; 4]
        );
        assert_eq!((jerk.powers[1].quiet, jerk.samples), (quiet, 2));
        // The first sample afterwards is the mean.
        feel(&mut jerk, 2_000..2_001, 5.5, 0b0_1111, even(100.0));
        assert_near(jerk.mean_speed, jerk.speed, 1e-6);
    }

    /// What is said of a wave with `extra` on it, by the time in ms and the gauge.
    fn is_slip(hz: f32, mm_s: f32, noise: f32, extra: impl Fn(f32, usize) -> f32) -> bool {
        let mut jerk = Jerk::default();
        feel(&mut jerk, 0..3_000, mm_s, 0b1_1111, |ms, gauge| {
            WAVE * sine(ms, hz) + extra(ms, gauge)
        });
        jerk.is_slip(mm_s / hz, hz, WAVES_POWER, noise, GAUGES as u32)
    }

    /// For 8 of 50 ms the fingertip slips: so many Hz of that amplitude, the same in all gauges.
    fn bursts(hz: f32, amplitude: f32) -> impl Fn(f32, usize) -> f32 {
        move |ms, _| {
            if libm::fmodf(ms, 50.0) < 8.0 {
                amplitude * sine(ms, hz)
            } else {
                0.0
            }
        }
    }

    #[test]
    fn moments_that_are_too_fast_for_the_contact_are_slip() {
        let hz = SPEED_MM_S / WAVELENGTH_MM;
        assert!(is_slip(hz, SPEED_MM_S, 0.0, bursts(150.0, 100.0)));
        assert!(!is_slip(hz, SPEED_MM_S, 0.0, |_, _| 0.0));
        // Too weak, and faster than any fingertip on its spring.
        assert!(!is_slip(hz, SPEED_MM_S, 0.0, bursts(150.0, 50.0)));
        assert!(!is_slip(hz, SPEED_MM_S, 0.0, bursts(420.0, 100.0)));
        // At five times the speed 150 Hz are 1 mm, which a contact feels.
        assert!(!is_slip(
            5.0 * hz,
            5.0 * SPEED_MM_S,
            0.0,
            bursts(150.0, 100.0)
        ));
        // Always there, it is a rough surface.
        let rough = |ms: f32, gauge: usize| 100.0 * sine(ms + gauge as f32 / 0.6, 150.0);
        assert!(!is_slip(hz, SPEED_MM_S, 0.0, rough));
    }

    #[test]
    fn noise_that_is_known_is_not_held_against_the_surface() {
        let hz = SPEED_MM_S / WAVELENGTH_MM;
        // The bursts' mean power in the second difference is some 3 300 in all gauges.
        let with = |noise| is_slip(hz, SPEED_MM_S, noise, bursts(150.0, 100.0));
        assert!(with(100.0) && with(250.0));
        assert!(!with(600.0) && !with(1_000.0));
    }

    #[test]
    fn slips_of_a_slow_arm_stand_out_of_more_noise() {
        // Bursts that swell and fade, at 110 Hz: twice as much of them is in the first difference as in the second.
        let soft = |ms: f32, _| {
            let envelope = larger(sine(ms, 20.0), 0.0);
            127.0 * envelope * envelope * sine(ms, 110.0)
        };
        let slip = |mm_s: f32, noise| is_slip(3.0, mm_s, noise, soft);
        assert!(slip(10.0, 150.0));
        assert!(!slip(27.5, 150.0));
        // Noise that makes as much of the first difference hides them again.
        assert!(!slip(10.0, 1_200.0));
    }

    #[test]
    fn a_wave_that_passes_fast_is_jerky_by_itself() {
        // 100 Hz of a wave of 0.6 mm, and its edges' third at 300 Hz.
        let edge = |ms: f32, _| WAVE / 3.0 * 0.2 * sine(ms, 300.0);
        assert!(!is_slip(100.0, 60.0, 0.0, |_, _| 0.0));
        assert!(!is_slip(100.0, 60.0, 0.0, edge));
    }

    #[test]
    fn gains_are_as_physics_has_them() {
        assert_near(difference_gain(250.0, 2), 4.0, 1e-4);
        assert_near(difference_gain(500.0, 2), 16.0, 1e-4);
        assert_near(difference_gain(800.0, 2), 16.0, 1e-4);
        assert_near(difference_gain(250.0, 1), 2.0, 1e-4);
        assert_near(
            let_through(1.0 / (TAU * CONTACT_SIGMA_MM)),
            libm::expf(-1.0),
            1e-4,
        );
        assert_near(let_through(1e3), libm::expf(-40.0), 1e-4);
    }
}
